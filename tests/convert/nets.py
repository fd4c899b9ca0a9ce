"""A fork of three roads with sidewalk, crosswalk and lights, and SUMO networks of it by hand.

Road 1 leads from x = 0 to the junction at x = 40, road 2 straight on from x = 60, road 3 turns
off to the right. Lanes for cars are 3.5 m wide right of y = 0, the sidewalk 2 m right of them.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import cos, sin
from typing import TYPE_CHECKING

import numpy as np

from tests.lanegraph.roads import lane, network, road, section

if TYPE_CHECKING:
    from odscen.opendrive.road_model import OpenDrive

TURN = -0.5
OFFSET = np.array([100.0, 50.0])
"""netOffset of the networks."""

_CROSSWALK = """
<object id="77" type="crosswalk" s="20" t="-1.75" zOffset="0" hdg="0" orientation="none"><outline>
<cornerLocal u="-2" v="-1.75" z="0" height="0"/><cornerLocal u="2" v="-1.75" z="0" height="0"/>
<cornerLocal u="2" v="1.75" z="0" height="0"/><cornerLocal u="-2" v="1.75" z="0" height="0"/>
</outline></object>"""


def fork(*, lights: bool = False, sign: str = "") -> OpenDrive:
    """Fork in the road; ``lights`` puts a controller into its junction, of ``sign`` if given."""
    walked = section(lane(-1), lane(-2, kind="sidewalk", width=2.0))
    corner = {"x": 40.0 + 20.0 * cos(TURN), "y": 20.0 * sin(TURN), "hdg": TURN}
    links = "".join(
        f'<connection id="{k}" incomingRoad="1" connectingRoad="{connecting}" contactPoint="start">'
        '<laneLink from="-1" to="-1"/></connection>'
        for k, connecting in enumerate(("10", "11"))
    )
    controller = '<controller id="5" type="0"/>' if lights else ""
    return network(
        road("1", walked, length=40.0, after="junction 9", objects=_CROSSWALK).replace(
            "</objects>", f"</objects><signals>{sign}</signals>"
        ),
        road("2", walked, x=60.0, length=40.0, before="junction 9"),
        road("3", section(lane(-1)), **corner, length=20.0, before="junction 9"),
        _connecting("10", "2", x=40.0),
        _connecting("11", "3", x=40.0, hdg=TURN),
        '<controller id="5" name="c"><control signalId="1" type="0"/></controller>'
        if lights
        else "",
        f'<junction id="9" name="" type="default">{links}{controller}</junction>',
    )


def _connecting(name: str, after: str, **place: float) -> str:
    only = section(lane(-1, before=-1, after=-1))
    ends = {"before": "road 1 end", "after": f"road {after} start"}
    return road(name, only, length=20.0, junction="9", **ends, **place)


def turned(start: float, end: float) -> np.ndarray:
    """Centre of the lane that turns off, between two distances from the junction."""
    ahead, right = np.array([cos(TURN), sin(TURN)]), np.array([sin(TURN), -cos(TURN)])
    return np.array([40.0, 0.0]) + 1.75 * right + np.outer([start, end], ahead)


@dataclass(frozen=True)
class HandNet:
    """A SUMO network; change it with :func:`dataclasses.replace`, write it with ``bytes``."""

    shapes: dict[str, np.ndarray] = field(
        default_factory=lambda: {
            "a_0": np.array([[0.0, -4.5], [40.0, -4.5]]),
            "a_1": np.array([[0.0, -1.75], [40.0, -1.75]]),
            "b_0": np.array([[60.0, -4.5], [100.0, -4.5]]),
            "b_1": np.array([[60.0, -1.75], [100.0, -1.75]]),
            "c_0": turned(20.0, 40.0),
            ":j_0_0": np.array([[40.0, -1.75], [60.0, -1.75]]),
            ":j_1_0": turned(0.0, 20.0),
            ":j_c0_0": np.array([[20.0, -3.5], [20.0, 0.0]]),
        }
    )
    walked: tuple[str, ...] = ("a_0", "b_0", ":j_c0_0")
    links: tuple[tuple[str, str, str], ...] = (("a_1", "b_1", ":j_0_0"), ("a_1", "c_0", ":j_1_0"))
    states: tuple[str, ...] = ()
    foes: tuple[str, ...] = ("10", "01")
    """Of links 0 and 1; both conflict."""
    left_hand: bool = False

    def moved(self, name: str, x: float = 0.0, y: float = 0.0) -> HandNet:
        return self.shaped(name, self.shapes[name] + [x, y])

    def shaped(self, name: str, shape: np.ndarray) -> HandNet:
        return replace(self, shapes={**self.shapes, name: shape})

    def without(self, *names: str) -> HandNet:
        kept = {name: shape for name, shape in self.shapes.items() if name not in names}
        links = tuple(link for link in self.links if not set(names) & set(link))
        return replace(self, shapes=kept, links=links)

    def __bytes__(self) -> bytes:
        edges: dict[str, str] = {}
        for name, shape in self.shapes.items():
            edge, index = name.rsplit("_", 1)
            edges[edge] = edges.get(edge, "") + self._lane(name, index, shape)
        parts = [
            f'<edge id="{edge}"{_function(edge)}>{lanes}</edge>' for edge, lanes in edges.items()
        ]
        if self.states:
            phases = "".join(f'<phase duration="9" state="{state}"/>' for state in self.states)
            parts.append(f'<tlLogic id="t" type="static">{phases}</tlLogic>')
        requests = "".join(
            f'<request index="{k}" response="00" foes="{foes}" cont="0"/>'
            for k, foes in enumerate(self.foes)
        )
        kind = "traffic_light" if self.states else "priority"
        incoming = " ".join(dict.fromkeys(source for source, _, _ in self.links))
        parts.append(f'<junction id="j" type="{kind}" incLanes="{incoming}">{requests}</junction>')
        parts += [self._link(k, *link) for k, link in enumerate(self.links)]
        side = ' lefthand="true"' if self.left_hand else ""
        location = f'<location netOffset="{OFFSET[0]:.2f},{OFFSET[1]:.2f}"/>'
        return f"<net{side}>{location}{''.join(parts)}</net>".encode()

    def _lane(self, name: str, index: str, shape: np.ndarray) -> str:
        shown = " ".join(f"{x:.4f},{y:.4f}" for x, y in shape + OFFSET)
        who = 'allow="pedestrian"' if name in self.walked else 'disallow="pedestrian"'
        wide = 'width="4.0"' if "_c" in name else 'width="3.5"'
        return f'<lane id="{name}" index="{index}" {who} {wide} shape="{shown}"/>'

    def _link(self, k: int, source: str, target: str, via: str) -> str:
        (a, i), (b, j) = source.rsplit("_", 1), target.rsplit("_", 1)
        light = f' tl="t" linkIndex="{k}"' if self.states else ""
        internal = f' via="{via}"' if via else ""
        return f'<connection from="{a}" to="{b}" fromLane="{i}" toLane="{j}"{internal}{light}/>'


def _function(edge: str) -> str:
    if edge.startswith(":"):
        return f' function="{"crossing" if "_c" in edge else "internal"}"'
    return ' from="n" to="j"'
