"""Small OpenDRIVE texts for tests: one road or a few, defaults wherever it does not matter."""

from __future__ import annotations

LINE = '<geometry s="0" x="0" y="0" hdg="0" length="100"><line/></geometry>'
LANES = """
<laneSection s="0">
  <left><lane id="1" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/></lane></left>
  <center><lane id="0" type="none"/></center>
  <right><lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></right>
</laneSection>
"""


def lane(
    lane_id: int, *, width: float = 3.5, inside: str = "", kind: str = "driving", more: str = ""
) -> str:
    """One lane of constant width; ``inside`` are further elements, ``more`` further attributes."""
    shape = "" if lane_id == 0 else f'<width sOffset="0" a="{width}" b="0" c="0" d="0"/>'
    return f'<lane id="{lane_id}" type="{kind}" {more}>{inside}{shape}</lane>'


def section(*lanes: str, s: float = 0.0) -> str:
    """A lane section of lanes as :func:`lane` gives them; the centre lane may be left out."""
    sides: dict[str, list[str]] = {"left": [], "center": [], "right": []}
    for text in lanes:
        number = int(text.split('id="', 1)[1].split('"', 1)[0])
        sides["left" if number > 0 else "right" if number else "center"].append(text)
    sides["center"] = sides["center"] or ['<lane id="0" type="none"/>']
    parts = "".join(f"<{side}>{''.join(found)}</{side}>" for side, found in sides.items() if found)
    return f'<laneSection s="{s}">{parts}</laneSection>'


def road(
    road_id: str = "1",
    *,
    length: float = 100.0,
    plan: str = LINE,
    lanes: str = LANES,
    link: str = "",
    junction: str = "-1",
    inside: str = "",
    more: str = "",
) -> str:
    """One road; ``inside`` are further elements, ``more`` further attributes."""
    return (
        f'<road id="{road_id}" length="{length!r}" junction="{junction}" {more}>'
        f"<link>{link}</link><planView>{plan}</planView>{inside}<lanes>{lanes}</lanes></road>"
    )


def document(*parts: str, version: str = "1.6") -> str:
    """A whole file."""
    major, minor = version.split(".")
    header = f'<header revMajor="{major}" revMinor="{minor}"/>'
    return f'<?xml version="1.0"?><OpenDRIVE>{header}{"".join(parts)}</OpenDRIVE>'
