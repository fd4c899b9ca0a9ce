"""A SUMO network as it is written to ``.net.xml``.

Source: sumo.dlr.de/docs/Networks/SUMO_Road_Networks.html. Lengths in metres, speeds in m/s, shapes
in the OpenDRIVE frame: :attr:`Net.offset` is added when the file is written.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.xml_text import escape
from odscen.convert.model.net_shapes import LinkPath, border

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from odscen.base.arrays import FloatArray
    from odscen.base.ids import SumoEdgeId, SumoLaneId


NORMAL = "normal"
INTERNAL = "internal"
CROSSING = "crossing"
WALKING_AREA = "walkingarea"

DIGITS = 4
"""Decimals of lengths and positions in the file."""

LEAST_LENGTH = 0.1
"""Metres of a lane, at least, as SUMO wants it."""

VERSION = "1.20"
"""Version of the network format."""

CROSSED = "c"
"""The turn of a link that is a crossing."""

UNUSED = ""
"""The turn of a link that is none: a letter of states that no connection of the network has."""

STAGE = "stage "
"""How the names of phases begin that give green; a number follows, from 1."""


@dataclass(frozen=True, slots=True, eq=False)
class NetLane:
    """One ``<lane>``.

    Attributes
    ----------
    index
        0 is the outermost lane (the rightmost in right-hand traffic).
    length
        What SUMO's positions run to: one length for all lanes of an edge.
    allowed
        Vehicle classes that may use the lane.
    shape
        Shape ``(K, 3)``; of walking areas and junctions the outline.
    change_left, change_right
        Whether road marks permit leaving the lane to that side.
    xodr
        OpenDRIVE lanes as ``road_lane``, for ``origId``.
    """

    id: SumoLaneId
    index: int
    length: float
    speed: float
    width: float
    allowed: frozenset[str]
    shape: FloatArray
    type: str = ""
    change_left: bool = True
    change_right: bool = True
    xodr: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class NetEdge:
    """One ``<edge>``; inner ones have neither ``start`` nor ``end`` (junctions)."""

    id: SumoEdgeId
    function: str
    lanes: tuple[NetLane, ...]
    start: str = ""
    end: str = ""
    name: str = ""
    priority: int = 1
    crosses: tuple[SumoEdgeId, ...] = ()

    @property
    def length(self) -> float:
        """Length of its lanes."""
        return self.lanes[0].length


@dataclass(frozen=True, slots=True)
class NetLink:
    """One ``<connection>`` between lanes given by edge and index.

    ``visibility`` is how far before the link, m, one sees whom one has to give way to; ``None`` is
    SUMO's 4.5 m.
    """

    source: SumoEdgeId
    target: SumoEdgeId
    source_lane: int = 0
    target_lane: int = 0
    via: SumoLaneId | None = None
    direction: str = "s"
    state: str = "M"
    light: str = ""
    light_index: int = -1
    visibility: float | None = None


@dataclass(frozen=True, slots=True)
class Request:
    """Right of way of one link: which links it yields to and which it meets, by index.

    ``waits_inside`` says that it yields at a place inside the junction, not at the stop line.
    """

    yields_to: frozenset[int]
    foes: frozenset[int]
    waits_inside: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class NetJunction:
    """One ``<junction>``; ``outline`` has shape ``(K, 3)``.

    The order of ``incoming`` and of the links that leave them is the order of ``inner`` and
    ``requests``: SUMO counts on it.
    """

    id: str
    type: str
    place: tuple[float, float, float]
    outline: FloatArray
    incoming: tuple[SumoLaneId, ...] = ()
    inner: tuple[SumoLaneId, ...] = ()
    requests: tuple[Request, ...] = ()
    xodr: str = ""


@dataclass(frozen=True, slots=True)
class Phase:
    """One ``<phase>``: seconds, and a letter for each link of the light.

    ``least`` and ``most`` bound a phase that vehicles may prolong, in seconds; both 0 otherwise.
    """

    duration: float
    state: str
    name: str = ""
    least: float = 0.0
    most: float = 0.0

    @property
    def is_stage(self) -> bool:
        """Whether it is the green of a stage, not the change to the next one."""
        return self.name.startswith(STAGE)


class LightLink(NamedTuple):
    """What one letter of a light's states is for.

    Attributes
    ----------
    source, target
        Lanes of a movement; of a crossing the walking areas at its ends.
    turn
        SUMO's letter (``s``, ``l``, ``r``, ``t``), :data:`CROSSED` for a crossing, :data:`UNUSED`
        where there is no connection; the lanes are empty then.
    speed
        m/s of the approach; 0 for a crossing.
    crossed
        Edges that a crossing leads over.
    path
        Some points of its way, x and y in the OpenDRIVE frame, metres.
    """

    source: SumoLaneId
    target: SumoLaneId
    turn: str
    speed: float = 0.0
    crossed: tuple[SumoEdgeId, ...] = ()
    path: tuple[tuple[float, float], ...] = ()


class LinkConflict(NamedTuple):
    """Two links of a light that meet, by index.

    Attributes
    ----------
    yields
        The one that gives way to the other by the junction's right of way; -1 if neither does.
    shares
        Whether drivers expect the two to have green together, so that one may give way.
    clearing, clearing_back
        Whole seconds from the end of yellow (of a crossing: of green) of ``one`` until ``other``
        may begin, and of ``other`` until ``one`` may.
    """

    one: int
    other: int
    yields: int
    shares: bool
    clearing: float
    clearing_back: float


@dataclass(frozen=True, slots=True)
class TrafficLight:
    """One ``<tlLogic>``; ``signals`` are the OpenDRIVE signals behind each link.

    ``links`` and ``conflicts`` say what its links are; they are not written.
    """

    id: str
    phases: tuple[Phase, ...]
    type: str = "static"
    offset: float = 0.0
    program: str = "0"
    signals: tuple[tuple[str, ...], ...] = ()
    links: tuple[LightLink, ...] = ()
    conflicts: tuple[LinkConflict, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Net:
    """A whole network, in the order in which it is written.

    ``inner_junctions`` are SUMO's internal ones, where vehicles wait within a junction.
    """

    offset: tuple[float, float]
    lefthand: bool
    edges: tuple[NetEdge, ...]
    links: tuple[NetLink, ...]
    junctions: tuple[NetJunction, ...]
    lights: tuple[TrafficLight, ...] = ()
    roundabouts: tuple[tuple[tuple[str, ...], tuple[SumoEdgeId, ...]], ...] = ()
    flat: bool = field(default=False)
    inner_junctions: tuple[NetJunction, ...] = ()

    @property
    def boundary(self) -> tuple[float, float, float, float]:
        """x_min, y_min, x_max, y_max of all lanes in SUMO's frame."""
        shapes = [lane.shape[:, :2] for edge in self.edges for lane in edge.lanes]
        if not shapes:
            return 0.0, 0.0, 0.0, 0.0
        points = np.concatenate(shapes) + np.array(self.offset)
        low, high = points.min(axis=0), points.max(axis=0)
        x0, y0, x1, y1 = (round(float(v), DIGITS) for v in (*low, *high))
        return x0, y0, x1, y1

    def counts(self) -> dict[str, int]:
        """Numbers for the catalogue; edges and lanes are those outside junctions."""
        functions = [edge.function for edge in self.edges]
        return {
            "edges": functions.count(NORMAL),
            "lanes": sum(len(edge.lanes) for edge in self.edges if edge.function == NORMAL),
            "junctions": len(self.junctions),
            "tl_logics": len(self.lights),
            "crossings": functions.count(CROSSING),
            "walking_areas": functions.count(WALKING_AREA),
        }

    def link_paths(self) -> dict[SumoLaneId, LinkPath]:
        """How connections run through their junctions, by their first internal lane."""
        of_edge = {edge.id: edge.lanes for edge in self.edges}
        lanes = {lane.id: lane for own in of_edge.values() for lane in own}
        beyond = {
            of_edge[link.source][link.source_lane].id: link.via for link in self.links if link.via
        }
        found: dict[SumoLaneId, LinkPath] = {}
        for first in (lanes[link.via] for link in self.links if link.via):
            second = beyond.get(first.id)
            if second is None:
                found[first.id] = LinkPath(first.shape, first.speed, None)
            else:
                shape = np.concatenate([first.shape, lanes[second].shape[1:]])
                found[first.id] = LinkPath(shape, first.speed, first.length)
        return found

    def to_xml(self) -> bytes:
        """Text of ``net.net.xml``; the same network gives the same bytes."""
        x0, y0, x1, y1 = self.boundary
        offset = f"{self.offset[0]:.2f},{self.offset[1]:.2f}"
        lines = [
            '<?xml version="1.0" encoding="UTF-8"?>',
            f'<net version="{VERSION}" junctionCornerDetail="5"'
            + (' lefthand="true"' if self.lefthand else "")
            + (' walkingareas="true"' if self.counts()["walking_areas"] else "")
            + ' limitTurnSpeed="5.50">',
            f'    <location netOffset="{offset}" convBoundary="{x0},{y0},{x1},{y1}"'
            ' origBoundary="-10000000000.00,-10000000000.00,10000000000.00,10000000000.00"'
            ' projParameter="!"/>',
        ]
        inner = [edge for edge in self.edges if edge.function != NORMAL]
        outer = [edge for edge in self.edges if edge.function == NORMAL]
        for edge in (*inner, *outer):
            lines += self._edge(edge)
        for light in self.lights:
            lines += light_xml(light)
        for junction in self.junctions:
            lines += self._junction(junction)
        for junction in self.inner_junctions:
            lines += self._junction(junction)
        paths = self.link_paths()
        inside = {edge.id for edge in inner}
        for link in self.links:
            own = None if link.source in inside or link.via is None else paths[link.via]
            lines.append(self._link(link, own))
        for nodes, edges in self.roundabouts:
            lines.append(f'    <roundabout nodes="{" ".join(nodes)}" edges="{" ".join(edges)}"/>')
        lines += ["</net>", ""]
        return "\n".join(lines).encode()

    def _edge(self, edge: NetEdge) -> Iterator[str]:
        ends = f' from="{edge.start}" to="{edge.end}"' if edge.function == NORMAL else ""
        kind = f' function="{edge.function}"' if edge.function != NORMAL else ""
        rank = f' priority="{edge.priority}"' if edge.function == NORMAL else ""
        name = f' name="{_quoted(edge.name)}"' if edge.name else ""
        crossed = f' crossingEdges="{" ".join(edge.crosses)}"' if edge.crosses else ""
        shape, custom = "", ' customShape="1"'
        if edge.function == NORMAL:
            inmost, side = edge.lanes[-1], -0.5 if self.lefthand else 0.5
            shape = f' shape="{self._shape(border(inmost.shape, side * inmost.width))}"'
        elif edge.function == INTERNAL:
            custom = ""
        yield f'    <edge id="{edge.id}"{ends}{kind}{rank}{name}{crossed}{shape}>'
        for lane in edge.lanes:
            change = "" if lane.change_left else ' changeLeft="emergency"'
            change += "" if lane.change_right else ' changeRight="emergency"'
            kind = f' type="{lane.type}"' if lane.type else ""
            text = (
                f'        <lane id="{lane.id}" index="{lane.index}"'
                f' allow="{" ".join(sorted(lane.allowed))}"{change} speed="{lane.speed:.2f}"'
                f' length="{lane.length:.{DIGITS}f}" width="{lane.width:.2f}"{kind}{custom}'
                f' shape="{self._shape(lane.shape)}"'
            )
            if lane.xodr:
                yield text + ">"
                yield f'            <param key="origId" value="{_quoted(" ".join(lane.xodr))}"/>'
                yield "        </lane>"
            else:
                yield text + "/>"
        yield "    </edge>"

    def _junction(self, junction: NetJunction) -> Iterator[str]:
        x, y = junction.place[0] + self.offset[0], junction.place[1] + self.offset[1]
        z = "" if self.flat else f' z="{junction.place[2]:.{DIGITS}f}"'
        custom = "" if junction.type == INTERNAL else ' customShape="1"'
        text = (
            f'    <junction id="{junction.id}" type="{junction.type}"{custom} x="{x:.{DIGITS}f}"'
            f' y="{y:.{DIGITS}f}"{z} incLanes="{" ".join(junction.incoming)}"'
            f' intLanes="{" ".join(junction.inner)}" shape="{self._shape(junction.outline)}"'
        )
        if not junction.requests and not junction.xodr:
            yield text + "/>"
            return
        yield text + ">"
        count = len(junction.requests)
        for index, request in enumerate(junction.requests):
            yield (
                f'        <request index="{index}" response="{_bits(request.yields_to, count)}"'
                f' foes="{_bits(request.foes, count)}" cont="{int(request.waits_inside)}"/>'
            )
        if junction.xodr:
            yield f'        <param key="opendrive" value="{_quoted(junction.xodr)}"/>'
        yield "    </junction>"

    def _link(self, link: NetLink, path: LinkPath | None) -> str:
        via = f' via="{link.via}"' if link.via else ""
        light = f' tl="{link.light}" linkIndex="{link.light_index}"' if link.light else ""
        kept = ""
        if path is not None:
            waits = "" if path.waits_at is None else f' contPos="{path.waits_at:.{DIGITS}f}"'
            kept = f'{waits} speed="{path.speed:.2f}" shape="{self._shape(path.shape)}"'
        sight = "" if link.visibility is None else f' visibility="{link.visibility:g}"'
        return (
            f'    <connection from="{link.source}" to="{link.target}" fromLane="{link.source_lane}"'
            f' toLane="{link.target_lane}"{via}{light}{sight} dir="{link.direction}"'
            f' state="{link.state}"{kept}/>'
        )

    def _shape(self, shape: FloatArray) -> str:
        points = shape + np.array([*self.offset, 0.0])
        if self.flat:
            return " ".join([f"{x:.4f},{y:.4f}" for x, y, _ in points.tolist()])
        return " ".join([f"{x:.4f},{y:.4f},{z:.4f}" for x, y, z in points.tolist()])


def light_xml(light: TrafficLight) -> Iterator[str]:
    """Lines of one ``<tlLogic>``."""
    yield (
        f'    <tlLogic id="{light.id}" type="{light.type}" programID="{light.program}"'
        f' offset="{light.offset:g}">'
    )
    for phase in light.phases:
        bounds = ""
        if light.type == "actuated" and phase.most > phase.least:
            bounds = f' minDur="{phase.least:g}" maxDur="{phase.most:g}"'
        name = f' name="{_quoted(phase.name)}"' if phase.name else ""
        yield f'        <phase duration="{phase.duration:g}" state="{phase.state}"{bounds}{name}/>'
    for index, signals in enumerate(light.signals):
        if signals:
            value = _quoted(" ".join(signals))
            yield f'        <param key="linkSignalID:{index}" value="{value}"/>'
    yield "    </tlLogic>"


def _bits(indices: Iterable[int], count: int) -> str:
    """Indices as SUMO writes them: the last letter is link 0."""
    letters = ["0"] * count
    for index in indices:
        letters[count - 1 - index] = "1"
    return "".join(letters)


def _quoted(text: str) -> str:
    """Text of an attribute on one line."""
    plain = "".join(c if c.isprintable() else " " for c in text)
    return escape(plain, {'"': "&quot;"})
