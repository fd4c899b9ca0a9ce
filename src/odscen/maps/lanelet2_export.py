"""A map as Lanelet2, for Autoware and everything else that reads it: the other way of the importer.

Each lane of a section is a lanelet, cut again where its limit, access or road marks change. Bounds
are polylines within :data:`CHORD` of the lane borders; lanes side by side share them, and lanes
that follow each other share the nodes between them, as Lanelet2 wants it.
"""

from __future__ import annotations

import itertools
import math
from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
import shapely
from lxml import etree

from odscen.base.errors import InputError
from odscen.base.ids import LaneKey, RoadId
from odscen.base.markup import number
from odscen.base.shown import shown
from odscen.convert.model.conversion_report import ElementOutcome, ReportEntry
from odscen.opendrive.lanes import RoadTable, is_forward
from odscen.opendrive.objects import crosswalks, signal_kind, stop_lines
from odscen.opendrive.road_model import DRIVABLE_TYPES, WALKABLE_TYPES, lane_use
from odscen.opendrive.topology import lane_successors

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from odscen.base.arrays import FloatArray
    from odscen.opendrive.road_model import OpenDrive, Road, RoadMark, Signal, Validity

CHORD: Final = 0.005
"""Metres by which a bound may leave the border that it stands for."""
_STEP = 0.2
_WELD = 0.3
"""Metres between the ends of linked lanes up to which these are one node."""
_THIN = 0.02
_SUBTYPES: Final = {
    "biking": "bicycle_lane",
    "bus": "bus_lane",
    "taxi": "bus_lane",
    "shoulder": "road_shoulder",
    "stop": "road_shoulder",
}
_ROAD_TYPES: Final = {"motorway": "highway", "townPlayStreet": "play_street"}
_NONURBAN: Final = frozenset({"rural", "motorway"})
_TURN: Final = math.radians(30.0)
_LINES: Final = {
    "solid": ("line_thin", "solid"),
    "broken": ("line_thin", "dashed"),
    "solid solid": ("line_thin", "solid_solid"),
    "solid broken": ("line_thin", "solid_dashed"),
    "broken solid": ("line_thin", "dashed_solid"),
    "broken broken": ("line_thin", "dashed"),
    "curb": ("curbstone", "low"),
    "botts dots": ("line_thin", "dashed"),
}
_PARTICIPANTS: Final = {
    "bus": "vehicle:bus",
    "taxi": "vehicle:taxi",
    "bicycle": "bicycle",
    "pedestrian": "pedestrian",
    "passengerCar": "vehicle:car",
    "delivery": "vehicle:truck",
    "motorcycle": "vehicle:motorcycle",
    "emergency": "vehicle:emergency",
}


class ExportedLanelets(NamedTuple):
    """A Lanelet2 file, and what became of the elements of the map."""

    osm: bytes
    entries: list[ReportEntry]


class _Piece(NamedTuple):
    """A lane between two s within its section."""

    key: LaneKey
    number: int
    start: float
    end: float


@dataclass(slots=True, eq=False)
class _Writer:
    odr: OpenDrive
    table: RoadTable
    entries: list[ReportEntry] = field(default_factory=list)
    nodes: list[FloatArray] = field(default_factory=list)
    same: dict[int, int] = field(default_factory=dict)
    ways: list[tuple[list[int], dict[str, str]]] = field(default_factory=list)
    relations: list[tuple[int, list[tuple[str, str, int]], dict[str, str]]] = field(
        default_factory=list
    )
    lanelets: dict[_Piece, int] = field(default_factory=dict)
    regulations: dict[int, list[int]] = field(default_factory=lambda: defaultdict(list))
    count: int = 0

    def node(self, point: FloatArray) -> int:
        """Add a node; gives its index."""
        self.nodes.append(point)
        return len(self.nodes) - 1

    def root(self, index: int) -> int:
        """The node that a node has become one with."""
        while index in self.same:
            index = self.same[index]
        return index

    def way(self, nodes: list[int], **tags: str) -> int:
        """Add a way; gives its index."""
        self.ways.append((nodes, tags))
        return len(self.ways) - 1

    def relation(self, members: list[tuple[str, str, int]], **tags: str) -> int:
        """Add a relation; gives its index. Members are kind, role, index."""
        self.relations.append((len(self.relations), members, tags))
        return len(self.relations) - 1

    def lose(self, element: str, reason: str) -> None:
        """Add a row of what Lanelet2 does not say."""
        self.entries.append(ReportEntry(ElementOutcome.LOST, element, reason))


def export_lanelet2(odr: OpenDrive, *, origin: str = "") -> ExportedLanelets:
    """Write a map as Lanelet2.

    Parameters
    ----------
    origin
        ``"latitude,longitude"`` of x = y = 0 for a map without a projection of its own.

    Returns
    -------
    ExportedLanelets
        Nodes have latitude, longitude, ``ele``, and Autoware's ``local_x`` and ``local_y``, which
        are the coordinates of the map.

    Raises
    ------
    InputError
        If the map has no lane that Lanelet2 knows, or the origin is none.
    """
    writer = _Writer(odr, RoadTable.of(odr))
    pieces = _write_lanes(writer)
    if not writer.lanelets:
        raise InputError("the map has no lane for vehicles or pedestrians")
    _weld_lanes(writer, pieces)
    _write_crosswalks(writer)
    _write_signals(writer, _write_stop_lines(writer))
    _write_priorities(writer)
    return ExportedLanelets(_write_xml(writer, origin), writer.entries)


# ----------------------------------------------------------------------------- lanes
def _is_exported(kind: str) -> bool:
    return kind in DRIVABLE_TYPES | WALKABLE_TYPES | {"biking", "shoulder", "stop", "shared"}


def _write_lanes(writer: _Writer) -> dict[LaneKey, list[tuple[_Piece, tuple[int, int]]]]:
    """Write the lanelets; gives for each lane its pieces along s, with their left and right way.

    Left and right are those along s; nodes run along s.
    """
    table = writer.table
    pieces: dict[LaneKey, list[tuple[_Piece, tuple[int, int]]]] = {}
    skipped: dict[tuple[RoadId, str], int] = defaultdict(int)
    for road in writer.odr.roads.values():
        ends: dict[int, tuple[int, ...]] = {}
        for section_number, section in enumerate(road.sections):
            if section.s_end - section.s < 1e-3:
                continue
            cuts = _find_cuts(section.lanes.values(), section.s, section.s_end)
            for part, (start, end) in enumerate(itertools.pairwise(cuts)):
                borders: dict[int, int] = {}
                for lane in section.lanes.values():
                    key = LaneKey(road.id, section_number, lane.id)
                    if lane.id == 0:
                        continue
                    kind = lane_use(lane)
                    row = table.lane_index[key]
                    s = np.linspace(start, end, 9)
                    if float(table.lane_width(np.full(9, row), s).max()) < _THIN:
                        continue
                    if not _is_exported(kind):
                        skipped[road.id, kind] += part == 0
                        continue
                    inner_id = lane.id - 1 if lane.id > 0 else lane.id + 1
                    for border in (inner_id, lane.id):
                        if border not in borders:
                            borders[border] = _write_border(
                                writer, road, section_number, lane.id, border, start, end, ends
                            )
                    left, right = (
                        (borders[lane.id], borders[inner_id])
                        if lane.id > 0
                        else (borders[inner_id], borders[lane.id])
                    )
                    piece = _Piece(key, part, start, end)
                    pieces.setdefault(key, []).append((piece, (left, right)))
                    _write_lanelet(writer, road, piece, left, right)
                ends = {
                    border: (writer.ways[way][0][-1], section_number)
                    for border, way in borders.items()
                }
    for (road_id, kind), count in skipped.items():
        reason = f"{count} lanes of the type {shown(kind)}: Lanelet2 has no lanelet of it"
        writer.lose(f"road {road_id}", reason)
    return pieces


def _find_cuts(lanes: Iterable[object], start: float, end: float) -> list[float]:
    """Where marks, limits or access of a section change: s, with its ends."""
    from odscen.opendrive.road_model import Lane

    found = {start, end}
    for lane in lanes:
        if isinstance(lane, Lane):
            for records in (lane.speeds, lane.access, lane.road_marks):
                found.update(record.s for record in records)
    inside = sorted(s for s in found if start + 0.5 < s < end - 0.5)
    cuts = [start]
    for s in inside:
        if s - cuts[-1] > 0.5:
            cuts.append(s)
    return [*cuts, end]


def _write_border(
    writer: _Writer,
    road: Road,
    section: int,
    lane_id: int,
    border: int,
    start: float,
    end: float,
    ends: Mapping[int, tuple[int, ...]],
) -> int:
    """Write the outer border of a lane, or the line in the middle (0), as a way along s."""
    table = writer.table
    row = table.lane_index[LaneKey(road.id, section, lane_id)]
    s = np.linspace(start, end, max(3, math.ceil((end - start) / _STEP) + 1))
    lanes = np.full(s.size, row)
    points = table.lane_points(lanes, s, at=1.0 if border == lane_id else 0.0)
    line = np.stack([points.x, points.y, points.z], axis=1)
    kept = shapely.get_coordinates(shapely.LineString(line[:, :2]).simplify(CHORD))
    where = np.searchsorted(_arc_lengths(line), _run_of(line, kept)).clip(0, len(line) - 1)
    where[0], where[-1] = 0, len(line) - 1
    indices = [writer.node(line[k]) for k in dict.fromkeys(where.tolist())]
    # The part before it in the same section ends where this one begins.
    before = ends.get(border)
    if before is not None and before[1] == section:
        writer.same[indices[0]] = writer.root(before[0])
    mark = _mark_at(road, section, border, start)
    return writer.way(indices, **_mark_tags(mark))


def _arc_lengths(line: FloatArray) -> FloatArray:
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line[:, :2], axis=0).T))])


def _run_of(line: FloatArray, kept: FloatArray) -> FloatArray:
    """Arc length in a line of points that are among its own, in order."""
    run = _arc_lengths(line)
    places = []
    k = 0
    for point in kept:
        while k < len(line) - 1 and float(np.hypot(*(line[k, :2] - point))) > 1e-9:
            k += 1
        places.append(float(run[k]))
    return np.array(places)


def _mark_at(road: Road, section: int, border: int, s: float) -> RoadMark | None:
    lane = road.sections[section].lanes.get(border)
    begun = [mark for mark in lane.road_marks if mark.s <= s + 0.5] if lane is not None else []
    return begun[-1] if begun else None


def _mark_tags(mark: RoadMark | None) -> dict[str, str]:
    if mark is None or mark.type not in _LINES:
        tags = {"type": "virtual"}
    else:
        kind, subtype = _LINES[mark.type]
        if mark.weight == "bold" and kind == "line_thin":
            kind = "line_thick"
        tags = {"type": kind, "subtype": subtype}
        if mark.color in ("yellow", "white", "red", "blue", "green"):
            tags["color"] = mark.color
    if mark is not None:
        if mark.lane_change in ("both", "none"):
            tags["lane_change"] = "yes" if mark.lane_change == "both" else "no"
        else:
            to_left = mark.lane_change == "increase"
            tags["lane_change:left"] = "yes" if to_left else "no"
            tags["lane_change:right"] = "no" if to_left else "yes"
    return tags


def _write_lanelet(writer: _Writer, road: Road, piece: _Piece, left: int, right: int) -> None:
    """Write a lanelet; ``left`` and ``right`` are those along s."""
    table = writer.table
    lane = road.sections[piece.key.section].lanes[piece.key.lane]
    kind = lane_use(lane)
    road_type = next((t.type for t in reversed(road.types) if t.s <= piece.start + 1e-6), "")
    walks = kind in WALKABLE_TYPES
    subtype = "walkway" if walks else _SUBTYPES.get(kind) or _ROAD_TYPES.get(road_type, "road")
    tags = {
        "type": "lanelet",
        "subtype": subtype,
        "location": "nonurban" if road_type in _NONURBAN else "urban",
        "one_way": "no" if walks or lane.direction == "both" else "yes",
    }
    row = table.lane_index[piece.key]
    speed = float(table.speed_limit(np.array([row]), np.array([piece.start + 1e-6]))[0])
    if not walks and math.isfinite(speed):
        tags["speed_limit"] = number(3.6 * speed, 3)
    for record in lane.access:
        participant = _PARTICIPANTS.get(record.restriction)
        if record.s <= piece.start + 0.5 and participant is not None:
            tags[f"participant:{participant}"] = "no" if record.rule == "deny" else "yes"
    if not lane.access and not walks and kind in DRIVABLE_TYPES and kind not in ("bus", "taxi"):
        tags["participant:vehicle"] = "yes"
    forward = is_forward(road, lane)
    if road.junction is not None and not walks:
        first, last = table.lane_points(
            np.array([row, row]), np.array([piece.start, piece.end])
        ).hdg.tolist()
        turn = math.remainder(last - first, 2.0 * math.pi) * (1.0 if forward else -1.0)
        tags["turn_direction"] = (
            "straight" if abs(turn) < _TURN else "left" if turn > 0.0 else "right"
        )
    sides = (left, right) if forward else (right, left)
    members = [("way", "left", sides[0]), ("way", "right", sides[1])]
    writer.lanelets[piece] = writer.relation(members, **tags)


def _weld_lanes(
    writer: _Writer, pieces: Mapping[LaneKey, Sequence[tuple[_Piece, tuple[int, int]]]]
) -> None:
    """Make one of the nodes in which linked lanes end and begin."""

    def corners(key: LaneKey, *, last: bool) -> tuple[int, int]:
        """Left and right node at an end of a lane, as its drivers see them."""
        forward = is_forward(
            writer.odr.roads[key.road],
            writer.odr.roads[key.road].sections[key.section].lanes[key.lane],
        )
        at_end = forward == last
        _, (left, right) = pieces[key][-1 if at_end else 0]
        nodes = [writer.ways[way][0][-1 if at_end else 0] for way in (left, right)]
        return (nodes[0], nodes[1]) if forward else (nodes[1], nodes[0])

    for key, after in lane_successors(writer.odr).items():
        for other in after:
            if key not in pieces or other not in pieces:
                continue
            gap = 0.0
            for a, b in zip(corners(key, last=True), corners(other, last=False), strict=True):
                first, second = writer.root(a), writer.root(b)
                apart = float(np.linalg.norm(writer.nodes[first] - writer.nodes[second]))
                if first != second and apart <= _WELD:
                    low, high = sorted((first, second))
                    writer.same[high] = low
                elif first != second:
                    gap = max(gap, apart)
            if gap:
                writer.lose(
                    f"road {key.road} > lane {key.lane}",
                    f"its link to lane {other.lane} of road {other.road}: their borders are "
                    f"{gap:.2f} m apart",
                )


# ----------------------------------------------------------------------------- furniture
def _write_crosswalks(writer: _Writer) -> None:
    for item in crosswalks(writer.odr, writer.table):
        along = item.axis[1] - item.axis[0]
        size = float(np.hypot(*along))
        if size < 0.1:
            writer.lose(f"road {item.road} > object {item.object_id}", "a crosswalk of no length")
            continue
        ring = item.polygon
        if len(ring) == 4:
            edges = np.roll(ring, -1, axis=0) - ring
            lead = np.abs(edges @ along) / np.maximum(np.hypot(*edges.T), 1e-9)
            first = 0 if lead[0] + lead[2] >= lead[1] + lead[3] else 1
            a = ring[[first, (first + 1) % 4]]
            b = ring[[(first + 3) % 4, (first + 2) % 4]]
        else:
            across = np.array([-along[1], along[0]]) / size * (item.width / 2.0)
            a, b = item.axis - across, item.axis + across
        ways = [
            writer.way(
                [writer.node(np.append(point, item.z)) for point in line],
                type="pedestrian_marking",
            )
            for line in (b, a)
        ]
        writer.relation(
            [("way", "left", ways[0]), ("way", "right", ways[1])],
            type="lanelet",
            subtype="crosswalk",
            location="urban",
            one_way="no",
            **{"participant:pedestrian": "yes"},
        )


def _write_stop_lines(writer: _Writer) -> dict[RoadId, list[tuple[float, int]]]:
    """Write stop lines; gives s and way by road."""
    found: dict[RoadId, list[tuple[float, int]]] = defaultdict(list)
    for item in stop_lines(writer.odr, writer.table):
        nodes = [writer.node(np.append(point, item.z)) for point in item.ends]
        found[item.road].append((item.s, writer.way(nodes, type="stop_line")))
    return found


def _pieces_of(
    writer: _Writer, road: RoadId, s: float, orientation: str, validities: Sequence[Validity]
) -> list[int]:
    """Lanelets that a signal at s acts on."""
    lanelets = []
    for piece, lanelet in writer.lanelets.items():
        if piece.key.road != road:
            continue
        item = writer.odr.roads[road]
        lane = item.sections[piece.key.section].lanes[piece.key.lane]
        if lane_use(lane) not in DRIVABLE_TYPES or not piece.start - 1e-6 <= s <= piece.end + 1e-6:
            continue
        if validities:
            applies = any(
                min(v.from_lane, v.to_lane) <= lane.id <= max(v.from_lane, v.to_lane)
                for v in validities
            )
        else:
            applies = {"+": is_forward(item, lane), "-": not is_forward(item, lane)}.get(
                orientation, True
            )
        if applies:
            lanelets.append(lanelet)
    return lanelets


def _write_signals(writer: _Writer, lines: Mapping[RoadId, list[tuple[float, int]]]) -> None:
    references = defaultdict(list)
    for road in writer.odr.roads.values():
        for reference in road.signal_references:
            references[reference.id].append((road.id, reference))
    for road in writer.odr.roads.values():
        for signal in road.signals:
            kind = signal_kind(signal)
            path = f"road {road.id} > signal {signal.id}"
            if kind not in ("traffic_light", "stop", "yield"):
                if kind != "speed_limit":  # limits are on the lanes
                    writer.lose(path, f"a signal of the type {shown(signal.type)}")
                continue
            s = min(max(signal.s, 0.0), road.length)
            lanelets = _pieces_of(writer, road.id, s, signal.orientation, signal.validities)
            for other, reference in references[signal.id]:
                place = min(max(reference.s, 0.0), writer.odr.roads[other].length)
                lanelets += _pieces_of(
                    writer, other, place, reference.orientation, reference.validities
                )
            if not lanelets:
                writer.lose(path, "no lane for vehicles is controlled by it")
                continue
            _write_regulation(writer, road, signal, kind, lanelets, lines)


def _write_regulation(
    writer: _Writer,
    road: Road,
    signal: Signal,
    kind: str,
    lanelets: Sequence[int],
    lines: Mapping[RoadId, list[tuple[float, int]]],
) -> None:
    """Write a light or a sign, and let the lanelets name it."""
    row = np.array([writer.table.road_index[road.id]])
    ends = []
    for shift in (-0.5, 0.5):
        at = writer.table.points(
            row, np.array([signal.s]), np.array([signal.t + shift]), signal.z_offset
        )
        ends.append(writer.node(np.array([float(value[0]) for value in at])))
    if kind == "traffic_light":
        tags = {"type": "traffic_light", "subtype": "red_yellow_green", "height": "0.9"}
    else:
        code = signal.type if signal.type in ("205", "206") else {"stop": "206"}.get(kind, "205")
        tags = {"type": "traffic_sign", "subtype": f"de{code}"}
    members = [("way", "refers", writer.way(ends, **tags))]
    near = sorted((abs(s - signal.s), way) for s, way in lines.get(road.id, ()))
    if near and near[0][0] < 30.0:
        members.append(("way", "ref_line", near[0][1]))
    subtype = "traffic_light" if kind == "traffic_light" else "traffic_sign"
    element = writer.relation(members, type="regulatory_element", subtype=subtype)
    for lanelet in dict.fromkeys(lanelets):
        writer.regulations[lanelet].append(element)


def _write_priorities(writer: _Writer) -> None:
    """Write priorities of junctions as right of way: one element for each road that yields."""
    by_road: dict[RoadId, list[int]] = defaultdict(list)
    for piece, lanelet in writer.lanelets.items():
        by_road[piece.key.road].append(lanelet)
    for junction in writer.odr.junctions.values():
        over: dict[RoadId, list[RoadId]] = defaultdict(list)
        for priority in junction.priorities:
            over[priority.low].append(priority.high)
        for low, highs in over.items():
            goes = [lanelet for high in highs for lanelet in by_road[high]]
            waits = by_road[low]
            if not goes or not waits:
                continue
            members = [("relation", "right_of_way", lanelet) for lanelet in goes]
            members += [("relation", "yield", lanelet) for lanelet in waits]
            element = writer.relation(members, type="regulatory_element", subtype="right_of_way")
            for lanelet in (*goes, *waits):
                writer.regulations[lanelet].append(element)


# ----------------------------------------------------------------------------- file
def _write_xml(writer: _Writer, origin: str) -> bytes:
    used = sorted({writer.root(n) for nodes, _ in writer.ways for n in nodes})
    degrees = _degrees_of(writer, np.array([writer.nodes[k][:2] for k in used]), origin)
    root = etree.Element("osm", version="0.6", generator="odscen")
    node_ids = {index: str(k + 1) for k, index in enumerate(used)}
    first_way = len(used) + 1
    first_relation = first_way + len(writer.ways)
    for index, (lat, lon) in zip(used, degrees.tolist(), strict=True):
        x, y, z = writer.nodes[index].tolist()
        element = etree.SubElement(
            root, "node", id=node_ids[index], lat=f"{lat:.12f}", lon=f"{lon:.12f}"
        )
        tags = {"local_x": number(x, 4), "local_y": number(y, 4), "ele": number(z, 4)}
        _write_tags(element, tags)
    for k, (nodes, tags) in enumerate(writer.ways):
        element = etree.SubElement(root, "way", id=str(first_way + k))
        last = ""
        for index in nodes:
            ref = node_ids[writer.root(index)]
            if ref != last:
                etree.SubElement(element, "nd", ref=ref)
            last = ref
        _write_tags(element, tags)
    for k, members, tags in writer.relations:
        element = etree.SubElement(root, "relation", id=str(first_relation + k))
        named = [("relation", "regulatory_element", n) for n in writer.regulations.get(k, ())]
        for kind, role, index in (*members, *named):
            member = (first_way if kind == "way" else first_relation) + index
            etree.SubElement(element, "member", type=kind, role=role, ref=str(member))
        _write_tags(element, tags)
    return etree.tostring(root, encoding="UTF-8", xml_declaration=True, pretty_print=True)


def _write_tags(element: etree._Element, tags: Mapping[str, str]) -> None:
    for key, value in tags.items():
        etree.SubElement(element, "tag", k=key, v=value)


def _degrees_of(writer: _Writer, points: FloatArray, origin: str) -> FloatArray:
    """Latitude and longitude of points of the map; of one without a projection by the origin."""
    from pyproj import Transformer

    from odscen.maps.importers.lanelet2.lanelet_file import projection_at

    header = writer.odr.header
    crs = header.crs
    x, y = points.T
    if crs is not None and not origin:
        dx, dy, _, turn = header.offset
        x, y = (
            dx + x * math.cos(turn) - y * math.sin(turn),
            dy + x * math.sin(turn) + y * math.cos(turn),
        )
    else:
        crs, _ = projection_at(origin or "0,0")
        if not origin:
            writer.entries.append(
                ReportEntry(
                    ElementOutcome.GUESSED,
                    "header > geoReference",
                    "the map has no projection: x = y = 0 is put at latitude 0, longitude 0; the "
                    "origin says where it is",
                    0.1,
                )
            )
    transformer = Transformer.from_crs(crs, "EPSG:4326", always_xy=True)
    lon, lat = transformer.transform(x, y)
    return np.stack([np.asarray(lat), np.asarray(lon)], axis=1)
