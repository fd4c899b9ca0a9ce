"""What goes over the wire about maps; see :mod:`odscen.web.messages`.

The parts of ``map.json`` are sent as they are, see :mod:`odscen.maps.map_build`. Columns are
made by :mod:`odscen.web.packed` and :mod:`odscen.drawing.map_drawing`; here is only their
shape: they are sent unchecked.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from odscen.base.arrays import Bounds
from odscen.convert.model.conversion_report import ElementOutcome
from odscen.convert.model.conversion_settings import ConverterName
from odscen.lanegraph.map_statistics import MapStatistics
from odscen.maps.map_edits import MapEdit
from odscen.maps.traffic_losses import LossKind
from odscen.opendrive.objects import SignalKind
from odscen.web.messages import Answer, Name, OptionInfo, RequestBody

Point = tuple[float, float]
"""x and y, metres."""


class MapHeader(Answer):
    """The map's version of OpenDRIVE, and on which side is driven: RHT, LHT or mixed."""

    version: str
    rule: str


class GraphCounts(Answer):
    """Sizes of a map's graphs; ``spacing`` of the nodes in metres."""

    spacing: float
    nodes: int
    successor_edges: int
    left_edges: int
    right_edges: int
    segments: int
    pedestrian_nodes: int
    pedestrian_edges: int


class NetCounts(Answer):
    """The SUMO network's file, and what is in it."""

    net_file: str
    edges: int
    lanes: int
    junctions: int
    tl_logics: int
    crossings: int
    walking_areas: int


class NetworkOrigin(Answer):
    """Who wrote the SUMO network; ``source`` is the file of one that was brought in."""

    converter: ConverterName
    source: str | None


class ImporterInfo(Answer):
    """A format that maps can have, with what can be chosen when one is added."""

    name: str
    label: str
    suffixes: list[str]
    options: list[OptionInfo]


class MapInfo(Answer):
    """A map of the catalogue; ``report_counts`` says how many elements had which outcome.

    ``lost`` and ``guessed`` count what matters for traffic.
    ``importer`` has read its file ``source``: ``opendrive``, or that of another format.

    An ``outdated`` one was built by an earlier odscen, and is rebuilt when it is first opened.
    """

    name: str
    sha256: str
    source: str
    importer: str
    opendrive: MapHeader
    statistics: MapStatistics
    graph: GraphCounts
    sumo: NetCounts
    network: NetworkOrigin
    report_counts: dict[ElementOutcome, int]
    lost: dict[LossKind, int]
    guessed: dict[LossKind, int]
    preview: str
    outdated: bool


class BrokenMapInfo(Answer):
    """A map of the catalogue that cannot be used, and why."""

    name: str
    problem: str


class CrosswalkInfo(Answer):
    """A crosswalk: its outline, and the line along which people walk; metres."""

    id: str
    road: str
    polygon: list[Point]
    begin: Point = Field(alias="from")
    end: Point = Field(alias="to")
    width: float


class StopLineInfo(Answer):
    """A stop line from end to end."""

    id: str
    road: str
    ends: list[Point]


class SignalInfo(Answer):
    """A light or sign; metres, ``value`` of a speed limit in m/s.

    It holds for lanes from the first to the second of each pair; for all if there is none.
    """

    kind: SignalKind
    id: str
    road: str
    s: float
    t: float
    x: float
    y: float
    z: float
    orientation: str
    lanes: list[tuple[int, int]]
    value: float | None


class SemanticsInfo(Answer):
    """Where the crosswalks, stop lines, lights and signs are."""

    crosswalks: list[CrosswalkInfo]
    stop_lines: list[StopLineInfo]
    signals: list[SignalInfo]


class LightInfo(Answer):
    """A traffic light: its SUMO id, by which live states are reported, and what scenarios call it.

    ``green`` are the seconds of each stage in the map's program. For each letter of its state,
    ``signals`` has the OpenDRIVE signals that show it, and ``paths`` some points of the movement
    that it is for, the first one at the stop line; none if the network has no such movement.
    ``walks`` says which letters are for crossings.
    """

    id: str
    names: list[str]
    green: list[float]
    signals: list[list[str]]
    paths: list[list[Point]]
    walks: list[bool]


class MapDetails(MapInfo):
    """The same with what the map means, and its traffic lights."""

    semantics: SemanticsInfo
    lights: list[LightInfo]


Side = Literal[
    "east", "north-east", "north", "north-west", "west", "south-west", "south", "south-east"
]


class LegInfo(Answer):
    """A road segment at a junction, and the side of the junction on which it lies."""

    segment: str
    side: Side


class JunctionNameInfo(Answer):
    """What the name of a junction is made of: at most two streets that meet, none if nameless.

    ``which`` is a side, or the id, where several junctions meet the same streets; else empty.
    """

    id: str
    streets: list[str]
    which: str
    legs: list[LegInfo]


class RoadEndInfo(Answer):
    """A junction at the end of a road, and the one street that crosses there; else empty."""

    junction: str
    street: str


class RoadNameInfo(Answer):
    """What the name of a road segment is made of; ``street`` is empty if it has none.

    ``side`` is that of the first junction on which it lies; empty without a junction.
    """

    id: str
    street: str
    ends: list[RoadEndInfo]
    side: Side | Literal[""]


class MapNames(Answer):
    """Names of the junctions and roads of a map, in parts, to be said in any language."""

    junctions: list[JunctionNameInfo]
    roads: list[RoadNameInfo]


class PlaceInfo(Answer):
    """What is at a place of a map: its lane, and what is near it.

    Width in metres, limit in km/h, direction of driving in rad; ``ring`` is the outline of the
    lane, x and y in turn.
    """

    road: str
    type: str
    width: float
    limit: float | None
    hdg: float
    ring: list[float]
    parts: list[Literal["stop_line", "crosswalk", "light", "sign", "island", "object"]]


class BackgroundInfo(Answer):
    """The picture under a map: pixels, and where it lies.

    ``affine`` are the numbers a to f of x = a column + b row + c, y = d column + e row + f, metres.
    """

    source: str
    width: int
    height: int
    affine: list[float]
    version: str


class MapEdits(RequestBody):
    """All edits of a map, in place of those that it has; ``out`` is the map that gets them."""

    edits: list[MapEdit]
    out: Name | None = None


class ConversionEntry(Answer):
    """What became of one element, and why.

    An importer of another format says how sure it is, 0 to 1, and the element's id in its file.
    """

    fate: ElementOutcome
    element: str
    reason: str
    confidence: float | None = None
    source_id: str | None = None


class MapEditsInfo(Answer):
    """Edits of a map in their order, and what became of each; the row of edit n has number n."""

    edits: list[MapEdit]
    rows: list[ConversionEntry]


class EditTrialRequest(RequestBody):
    """An edit to be tried."""

    edit: MapEdit


class EditTrial(Answer):
    """What an edit would do: its row, and outlines of what changes, x and y in turn, metres."""

    row: ConversionEntry
    outlines: list[list[float]]


class ConversionInfo(Answer):
    """What became of all elements on the way to SUMO; figures of ``docs/sumo-network.md``."""

    counts: dict[ElementOutcome, int]
    figures: dict[str, float]
    entries: list[ConversionEntry]


class NodeColumns(Answer):
    """Nodes of a graph, a row each: the lane that it is on, its place, and its segment.

    ``first_node`` is the first row of each lane, whose names are ``lane_keys``.
    """

    lane_keys: list[str]
    first_node: list[int]
    lane: list[int]
    x: list[float]
    y: list[float]
    hdg: list[float]
    width: list[float]
    segment: list[int]


class EdgeColumns(Answer):
    """Edges between nodes; ``relation`` 0 is successor, 1 left, 2 right."""

    source: list[int]
    target: list[int]
    relation: list[int]


class WalkColumns(NodeColumns):
    """The pedestrian graph; ``kind`` of an edge: 0 sidewalk, 1 roadside, 2 crosswalk, 3 joint.

    ``walkable`` is 1 where the simulator can place a road user exactly.
    """

    walkable: list[int]
    source: list[int]
    target: list[int]
    kind: list[int]


class SegmentInfo(Answer):
    """A segment and its neighbours, which are rows."""

    id: str
    kind: str
    neighbours: list[int]


class GraphColumns(NodeColumns):
    """The lane graph, the segments and the pedestrian graph.

    Per lane its type, and the junction that it lies in. Per node ``speed_limit`` in m/s, if there
    is one, ``left_lane`` and ``right_lane`` (-1 if there is none), and whether it is ``spawnable``:
    1 where the simulator can place a road user exactly.
    """

    spacing: float
    lane_types: list[str]
    lane_junctions: list[str | None]
    s: list[float]
    speed_limit: list[float | None]
    left_lane: list[int]
    right_lane: list[int]
    spawnable: list[int]
    edges: EdgeColumns
    segments: list[SegmentInfo]
    walks: WalkColumns


class HeightColumns(Answer):
    """Heights of the nodes of both graphs in their order, metres; none where all have the same.

    ``z`` is of the lane graph, ``walks`` of the pedestrian graph.
    """

    z: list[float]
    walks: list[float]


class PackedLines(Answer):
    """Lines or rings: how many points each has, and centimetres from each point to the next."""

    sizes: list[int]
    steps: list[int]


class DrawingColumns(Answer):
    """What is drawn of a map, see ``docs/drawings.md``.

    Areas have a level, a kind and rings; marks a level, a colour, a width, painted and gap of
    dashes if they are dashed, and lines; symbols a kind, x, y, heading and a text.
    """

    format: str
    version: int
    name: str
    bounds: Bounds
    areas: list[tuple[int, str, PackedLines]]
    marks: list[tuple[int, str, float, tuple[float, float] | None, PackedLines]]
    symbols: list[tuple[str, float, float, float, str]]
    crosswalks: PackedLines
    bars: PackedLines
    stop_lines: PackedLines
    parking_spaces: PackedLines
    buildings: PackedLines
