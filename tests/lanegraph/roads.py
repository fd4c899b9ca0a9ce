"""Small OpenDRIVE texts for tests of the lane graph: straight and curved roads with plain lanes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.opendrive.parse import parse

if TYPE_CHECKING:
    from odscen.opendrive.road_model import OpenDrive


def lane(
    number: int,
    *,
    kind: str = "driving",
    width: float = 3.5,
    slope: float = 0.0,
    change: str = "both",
    before: int | None = None,
    after: int | None = None,
) -> str:
    """A lane of width ``width + slope * ds``; ``change`` is of the mark on its outer border."""
    links = "".join(
        f'<{word} id="{other}"/>'
        for word, other in (("predecessor", before), ("successor", after))
        if other is not None
    )
    return (
        f'<lane id="{number}" type="{kind}" level="false"><link>{links}</link>'
        f'<width sOffset="0" a="{width}" b="{slope}" c="0" d="0"/>'
        f'<roadMark sOffset="0" type="broken" weight="standard" color="standard" width="0.12" '
        f'laneChange="{change}"/></lane>'
    )


def section(*lanes: str, s: float = 0.0, centre: str = "none") -> str:
    def number(text: str) -> int:
        return int(text.split('"')[1])

    left = "".join(sorted((one for one in lanes if number(one) > 0), key=number, reverse=True))
    right = "".join(sorted((one for one in lanes if number(one) < 0), key=number, reverse=True))
    mark = (
        f'<roadMark sOffset="0" type="solid" color="standard" width="0.1" laneChange="{centre}"/>'
    )
    return (
        f'<laneSection s="{s}">'
        + (f"<left>{left}</left>" if left else "")
        + f'<center><lane id="0" type="none" level="false">{mark}</lane></center>'
        + (f"<right>{right}</right>" if right else "")
        + "</laneSection>"
    )


def road(
    name: str,
    *sections: str,
    x: float = 0.0,
    y: float = 0.0,
    hdg: float = 0.0,
    length: float = 100.0,
    curvature: float = 0.0,
    junction: str = "-1",
    before: str = "",
    after: str = "",
    kind: str = "town",
    speed: str = "",
    rule: str = "RHT",
    objects: str = "",
) -> str:
    """A road; ``before`` and ``after`` are ``"road 7 end"`` or ``"junction 5"``."""

    def link(tag: str, text: str) -> str:
        if not text:
            return ""
        what, number, *contact = text.split()
        point = f' contactPoint="{contact[0]}"' if contact else ""
        return f'<{tag} elementType="{what}" elementId="{number}"{point}/>'

    shape = f'<arc curvature="{curvature}"/>' if curvature else "<line/>"
    return (
        f'<road name="" length="{length}" id="{name}" junction="{junction}" rule="{rule}">'
        f"<link>{link('predecessor', before)}{link('successor', after)}</link>"
        f'<type s="0" type="{kind}">{speed}</type>'
        f'<planView><geometry s="0" x="{x}" y="{y}" hdg="{hdg}" length="{length}">{shape}'
        f"</geometry></planView><lanes>{''.join(sections)}</lanes>"
        f"<objects>{objects}</objects></road>"
    )


def network(*parts: str) -> OpenDrive:
    """Parse roads and junctions."""
    return parse(
        '<?xml version="1.0"?><OpenDRIVE><header revMajor="1" revMinor="6" name="" version="1"/>'
        f"{''.join(parts)}</OpenDRIVE>"
    )


def junction(name: str, *connections: tuple[str, str, str], kind: str = "default") -> str:
    """A junction of (incoming road, connecting road, contact point), lane -1 to lane -1 each."""
    other = "linkedRoad" if kind == "direct" else "connectingRoad"
    return (
        f'<junction id="{name}" name="" type="{kind}">'
        + "".join(
            f'<connection id="{k}" incomingRoad="{incoming}" {other}="{connecting}" '
            f'contactPoint="{contact}"><laneLink from="-1" to="-1"/></connection>'
            for k, (incoming, connecting, contact) in enumerate(connections)
        )
        + "</junction>"
    )
