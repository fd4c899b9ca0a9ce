"""A SUMO network as it is written to ``.net.xml``.

Source: sumo.dlr.de/docs/Networks/SUMO_Road_Networks.html. Lengths in metres, speeds in m/s, shapes
in the OpenDRIVE frame: :attr:`Net.offset` is added when the file is written.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.convert.model.net_shapes import LinkPath

if TYPE_CHECKING:
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
    heavy_speed
        m/s, what trucks and buses drive in a curve; infinite where there is none.
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
    heavy_speed: float = math.inf


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
    def heavy_speed(self) -> float:
        """m/s, what trucks and buses drive in its sharpest lane; infinite without a curve."""
        return min(lane.heavy_speed for lane in self.lanes)

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
        paths: dict[SumoLaneId, LinkPath] = {}
        for first in (lanes[link.via] for link in self.links if link.via):
            second = beyond.get(first.id)
            if second is None:
                paths[first.id] = LinkPath(first.shape, first.speed, None)
            else:
                shape = np.concatenate([first.shape, lanes[second].shape[1:]])
                paths[first.id] = LinkPath(shape, first.speed, first.length)
        return paths
