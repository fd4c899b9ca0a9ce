"""OpenDRIVE roads and junctions of a network of lanelets."""

from __future__ import annotations

import math
import re
from collections import defaultdict
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final, Literal, NamedTuple

import numpy as np

from odscen.base.ids import JunctionId, RoadId
from odscen.maps.importers.lanelet2.lane_network import (
    Group,
    LaneNetwork,
    Path,
    Strip,
    bundle_paths,
    find_paths,
    overlapping_pairs,
)
from odscen.maps.importers.lanelet2.lanelet_file import Bound, Lanelet, reversed_bound
from odscen.maps.importers.lanelet2.road_fitting import RoadEnd, cut_line, fit_road
from odscen.opendrive.road_model import (
    Connection,
    Junction,
    Lane,
    LaneAccess,
    LaneSection,
    LaneSpeed,
    Road,
    RoadLink,
    RoadMark,
    RoadType,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from odscen.base.arrays import FloatArray
    from odscen.maps.importers.lanelet2.lanelet_file import LaneletMap, Tags
    from odscen.maps.importers.lanelet2.road_fitting import FittedRoad
    from odscen.opendrive.road_model import ContactPoint, LaneChange

LANE_TYPES: Final = {
    "road": "driving",
    "highway": "driving",
    "play_street": "driving",
    "exit": "driving",
    "bus_lane": "bus",
    "emergency_lane": "shoulder",
    "road_shoulder": "shoulder",
    "bicycle_lane": "biking",
    "walkway": "sidewalk",
    "shared_walkway": "sidewalk",
    "stairs": "sidewalk",
    "pedestrian_lane": "sidewalk",
}
_SPEED_PARTS = re.compile(r"\s*([0-9]+(?:\.[0-9]+)?)\s*(km/?h|kmph|kph|mph|mps|m/s)?\s*")
_PER_MPS = {"mph": 0.44704, "mps": 1.0, "m/s": 1.0}
# German traffic rules of Lanelet2, lanelet2_traffic_rules/src/GermanTrafficRules.cpp, km/h.
_USUAL_SPEEDS = {
    "urban": {"highway": 130.0, "play_street": 7.0, "exit": 7.0},
    "nonurban": {"highway": 130.0, "play_street": 7.0, "exit": 7.0, "road": 100.0},
}
_USUAL = 50.0
_MARKS: Final = {
    ("line_thin", "solid"): ("solid", 0.12),
    ("line_thin", "dashed"): ("broken", 0.12),
    ("line_thin", "solid_solid"): ("solid solid", 0.12),
    ("line_thin", "dashed_solid"): ("broken solid", 0.12),
    ("line_thin", "solid_dashed"): ("solid broken", 0.12),
    ("line_thick", "solid"): ("solid", 0.25),
    ("line_thick", "dashed"): ("broken", 0.25),
    ("line_thick", "solid_solid"): ("solid solid", 0.25),
    ("line_thick", "dashed_solid"): ("broken solid", 0.25),
    ("line_thick", "solid_dashed"): ("solid broken", 0.25),
    ("pedestrian_marking", ""): ("broken", 0.12),
    ("bike_marking", ""): ("broken", 0.12),
}
_MIRRORED = {"solid broken": "broken solid", "broken solid": "solid broken"}
_PARTICIPANTS: Final = {
    "bus": "bus",
    "taxi": "taxi",
    "bicycle": "bicycle",
    "pedestrian": "pedestrian",
    "truck": "delivery",
    "car": "passengerCar",
    "motorcycle": "motorcycle",
    "emergency": "emergency",
}


class LanePlace(NamedTuple):
    """Where a lanelet, or a part of one, is: road, lane, s from and to, and whether along s.

    ``part`` is the number of the part, 0 for a whole lanelet.
    """

    road: RoadId
    lane: int
    start: float
    end: float
    along: bool
    part: int


@dataclass(slots=True, eq=False)
class BuiltRoad:
    """A road with what was needed to build it."""

    road: Road
    fitted: FittedRoad
    lanelets: list[Lanelet]


@dataclass(slots=True, eq=False)
class BuiltRoads:
    """All roads and junctions, and where the lanelets are.

    Attributes
    ----------
    places
        By id of the lanelet in the file, in the order of its parts.
    lost_parts
        Ids of lanelets, or parts, that no way through a junction uses.
    """

    roads: dict[RoadId, BuiltRoad] = field(default_factory=dict)
    junctions: dict[JunctionId, Junction] = field(default_factory=dict)
    places: dict[str, list[LanePlace]] = field(default_factory=lambda: defaultdict(list))
    lost_parts: list[str] = field(default_factory=list)
    truncated: bool = False

    def add(self, built: BuiltRoad, steps: Iterable[tuple[Lanelet, LanePlace]]) -> None:
        """Add a road and the places of its lanelets."""
        self.roads[built.road.id] = built
        for lanelet, place in steps:
            self.places[lanelet.source].append(place)


class _End(NamedTuple):
    """An end of a strip."""

    strip: int
    contact: ContactPoint


@dataclass(slots=True, eq=False)
class _StripRoad:
    """A strip with its columns, cut ends and road id.

    ``tails`` has for each end what lies beyond the cut, by the node in which it ends.
    """

    strip: Strip
    id: RoadId
    columns: list[list[Lanelet]]
    along: list[bool]
    separator: int
    borders: list[Bound]
    lines: list[FloatArray]
    ends: dict[ContactPoint, RoadEnd] = field(default_factory=dict)
    tails: dict[ContactPoint, dict[str, FloatArray]] = field(default_factory=dict)

    def lane_id(self, column: int) -> int:
        """OpenDRIVE id of a column, counted from the left."""
        left = column < self.separator
        return self.separator - column if left else self.separator - column - 1


def build_roads(network: LaneNetwork, strips: Sequence[Strip], *, first_id: int = 1) -> BuiltRoads:
    """Build all roads: those outside junctions first, then the connecting ones."""
    built = BuiltRoads()
    number = first_id
    roads = []
    for strip in strips:
        roads.append(_lay_columns(network, strip, RoadId(str(number))))
        number += 1
    place_of = {
        lanelet.id: (index, column)
        for index, road in enumerate(roads)
        for column, lanelets in enumerate(road.columns)
        for lanelet in lanelets
    }
    paths, built.truncated = find_paths(network)
    bundles = bundle_paths(network, paths)
    junction_of, ends_in = _number_junctions(network, roads, place_of, bundles, number)
    number += len(set(junction_of))
    neighbours = _link_ends(network, roads, place_of)
    _cut_ends(roads, neighbours, ends_in)
    for index, road in enumerate(roads):
        links: dict[ContactPoint, RoadLink | None] = {
            "start": _describe_link(_End(index, "start"), roads, neighbours, ends_in),
            "end": _describe_link(_End(index, "end"), roads, neighbours, ends_in),
        }
        lane_links = _link_lanes(network, index, roads, place_of)
        _build_road(network, built, road, links, lane_links, junction=None)
    connections: dict[JunctionId, list[Connection]] = defaultdict(list)
    for bundle, junction in zip(bundles, junction_of, strict=True):
        road, links, lane_links, connection = _lay_bundle(
            network, roads, place_of, bundle, RoadId(str(number))
        )
        number += 1
        _build_road(network, built, road, links, lane_links, junction=junction)
        others = connections[junction]
        others.append(connection._replace(id=str(len(others))))
    for junction, rows in connections.items():
        built.junctions[junction] = Junction(junction, "", "default", tuple(rows))
    for places in built.places.values():
        places.sort(key=lambda place: place.part)
    used = {n for path in paths for n in path.inside}
    built.lost_parts = [
        lanelet.id
        for group in network.groups
        if group.is_connecting
        for lanelet in group.lanelets
        if lanelet.id not in used
    ]
    return built


# ----------------------------------------------------------------------------- laying out
def _join_bounds(bounds: Sequence[Bound]) -> Bound:
    """Bounds one behind the other as one."""
    nodes = bounds[0].nodes
    ways = list(bounds[0].ways)
    for bound in bounds[1:]:
        ways.extend((start + len(nodes) - 1, way) for start, way in bound.ways)
        nodes += bound.nodes[1:]
    return Bound(nodes, tuple(ways))


def _group_borders(groups: Sequence[Group]) -> list[Bound]:
    return [_join_bounds(column) for column in zip(*(g.borders for g in groups), strict=True)]


def _lay_columns(network: LaneNetwork, strip: Strip, identity: RoadId) -> _StripRoad:
    """Columns and borders of a strip from left to right in the direction of its road."""
    forward = [list(column) for column in zip(*(g.lanelets for g in strip.forward), strict=True)]
    borders = _group_borders(strip.forward)
    backward: list[list[Lanelet]] = []
    if strip.backward:
        groups = strip.backward[::-1]
        turned = [list(column) for column in zip(*(g.lanelets for g in groups), strict=True)]
        backward = [column[::-1] for column in turned[::-1]]
        other = [reversed_bound(border) for border in _group_borders(groups)[::-1]]
        borders = [*borders, *other[1:]] if network.left_hand else [*other, *borders[1:]]
    if network.left_hand:
        columns, along = [*forward, *backward], [True] * len(forward) + [False] * len(backward)
        separator = len(forward)
    else:
        columns, along = [*backward, *forward], [False] * len(backward) + [True] * len(forward)
        separator = len(backward)
    lines = [network.source.line(border.nodes) for border in borders]
    return _StripRoad(strip, identity, columns, along, separator, borders, lines)


def _number_junctions(
    network: LaneNetwork,
    roads: Sequence[_StripRoad],
    place_of: dict[str, tuple[int, int]],
    bundles: Sequence[Sequence[Path]],
    first: int,
) -> tuple[list[JunctionId], dict[_End, JunctionId]]:
    """Junction of each bundle, and of each road's end; what overlaps is in one junction."""
    parent = list(range(len(bundles)))

    def root(k: int) -> int:
        while parent[k] != k:
            parent[k] = parent[parent[k]]
            k = parent[k]
        return k

    by_key: dict[object, int] = {}
    ends: dict[_End, int] = {}
    for k, bundle in enumerate(bundles):
        keys: list[object] = [n for path in bundle for n in path.inside]
        for identity, is_last in ((bundle[0].before, True), (bundle[0].after, False)):
            index, column = place_of[identity]
            end = _End(index, "end" if roads[index].along[column] == is_last else "start")
            keys.append(end)
            ends[end] = k
        for key in keys:
            other = by_key.setdefault(key, k)
            parent[root(k)] = root(other)
    inner = [
        lanelet
        for group in network.groups
        if group.is_connecting
        for lanelet in group.lanelets
        if lanelet.id in by_key
    ]
    for a, b, _ in overlapping_pairs(network.source, inner):
        parent[root(by_key[inner[a].id])] = root(by_key[inner[b].id])
    names: dict[int, JunctionId] = {}
    for k in range(len(bundles)):
        names.setdefault(root(k), JunctionId(str(first + len(names))))
    return (
        [names[root(k)] for k in range(len(bundles))],
        {end: names[root(k)] for end, k in ends.items()},
    )


def _link_ends(
    network: LaneNetwork, roads: Sequence[_StripRoad], place_of: dict[str, tuple[int, int]]
) -> dict[_End, _End]:
    """Which end of a road meets which of another one, without a junction between."""
    ends: dict[_End, _End] = {}
    for index, road in enumerate(roads):
        for column, lanelets in enumerate(road.columns):
            along = road.along[column]
            end = _End(index, "end" if along else "start")
            # Columns list the lanelets along the road, so the last driven is at its other end.
            last = lanelets[-1] if along else lanelets[0]
            for identity in network.following[last.id]:
                if identity not in place_of:
                    continue
                other, their = place_of[identity]
                entry = _End(other, "start" if roads[other].along[their] else "end")
                ends.setdefault(end, entry)
                ends.setdefault(entry, end)
    return ends


# ----------------------------------------------------------------------------- cuts
def _direction_at(lines: Sequence[FloatArray], *, last: bool) -> FloatArray:
    """Unit vector out of a road: the mean direction of its outer borders over the last metres."""
    total = np.zeros(2)
    for line in (lines[0], lines[-1]):
        run = line[::-1, :2] if last else line[:, :2]
        distance = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(run, axis=0).T))])
        reach = min(2.0, float(distance[-1]))
        inner = np.array([np.interp(reach, distance, column) for column in run.T])
        away = run[0] - inner
        total += away / max(float(np.hypot(*away)), 1e-9)
    size = float(np.hypot(*total))
    if size < 1e-6:
        chord = lines[0][-1, :2] - lines[0][0, :2] if last else lines[0][0, :2] - lines[0][-1, :2]
        total, size = chord, max(float(np.hypot(*chord)), 1e-9)
    direction: FloatArray = total / size
    return direction


def _cut_ends(
    roads: Sequence[_StripRoad], neighbours: dict[_End, _End], ends_in: dict[_End, JunctionId]
) -> None:
    """Give each road straight ends, square to it.

    A road that leads on is cut where the first of its borders ends, and the rest belongs to the
    road behind: there the borders are exact on both sides. One that leads nowhere is continued to
    where the last of them ends.
    """
    for index, road in enumerate(roads):
        for contact in ("start", "end"):
            end = _End(index, contact)
            neighbour = neighbours.get(end) if end not in ends_in else None
            if neighbour is not None and neighbour.contact in roads[neighbour.strip].tails:
                master = roads[neighbour.strip]
                cut = master.ends[neighbour.contact]
                road.ends[contact] = RoadEnd(-cut.outward, -cut.offset)
                tails = master.tails[neighbour.contact]
                for k, border in enumerate(road.borders):
                    node = border.nodes[-1 if contact == "end" else 0]
                    if node in tails and len(tails[node]) > 1:
                        tail = tails[node]
                        road.lines[k] = (
                            np.concatenate([road.lines[k], tail[-2::-1]])
                            if contact == "end"
                            else np.concatenate([tail[:-1], road.lines[k]])
                        )
                _trim_road(road, contact)
                continue
            outward = _direction_at(road.lines, last=contact == "end")
            corners = np.array([line[-1 if contact == "end" else 0, :2] for line in road.lines])
            along = corners @ outward
            is_linked = end in ends_in or neighbour is not None
            offset = float(along.min() if is_linked else along.max())
            sizes = [float(np.hypot(*np.diff(line[:, :2], axis=0).T).sum()) for line in road.lines]
            if is_linked and float(np.ptp(along)) > 0.4 * min(sizes):
                offset = float(along.mean())
            road.ends[contact] = RoadEnd(outward, offset)
            _trim_road(road, contact)


def _trim_road(road: _StripRoad, contact: ContactPoint) -> None:
    last = contact == "end"
    tails = {}
    for k, border in enumerate(road.borders):
        road.lines[k], outside = cut_line(road.lines[k], road.ends[contact], last=last)
        tails[border.nodes[-1 if last else 0]] = outside
    road.tails[contact] = tails


# ----------------------------------------------------------------------------- links
def _describe_link(
    end: _End,
    roads: Sequence[_StripRoad],
    neighbours: dict[_End, _End],
    ends_in: dict[_End, JunctionId],
) -> RoadLink | None:
    if end in ends_in:
        return RoadLink("junction", ends_in[end], None)
    other = neighbours.get(end)
    if other is None:
        return None
    return RoadLink("road", roads[other.strip].id, other.contact)


LaneLinks = dict[int, dict[Literal["start", "end"], tuple[int, ...]]]


def _link_lanes(
    network: LaneNetwork,
    index: int,
    roads: Sequence[_StripRoad],
    place_of: dict[str, tuple[int, int]],
) -> LaneLinks:
    """Lanes of the neighbours at both ends of each column, where there is no junction."""
    links: LaneLinks = {}
    road = roads[index]
    for column, lanelets in enumerate(road.columns):
        at: dict[Literal["start", "end"], tuple[int, ...]] = {}
        along = road.along[column]
        first, last = lanelets[0].id, lanelets[-1].id
        for contact, identities in (
            ("start", network.preceding[first] if along else network.following[first]),
            ("end", network.following[last] if along else network.preceding[last]),
        ):
            found = [place_of[n] for n in identities if n in place_of]
            at[contact] = tuple(roads[other].lane_id(their) for other, their in found)  # type: ignore[index]
        links[column] = at
    return links


def _lay_bundle(
    network: LaneNetwork,
    roads: Sequence[_StripRoad],
    place_of: dict[str, tuple[int, int]],
    bundle: Sequence[Path],
    identity: RoadId,
) -> tuple[_StripRoad, dict[ContactPoint, RoadLink | None], LaneLinks, Connection]:
    """The connecting road of paths side by side."""
    columns = [[network.lanelet(n) for n in path.inside] for path in bundle]
    borders = [_join_bounds([lanelet.left for lanelet in columns[0]])]
    borders += [_join_bounds([lanelet.right for lanelet in column]) for column in columns]
    separator = len(columns) if network.left_hand else 0
    lines = [network.source.line(border.nodes) for border in borders]
    road = _StripRoad(
        Strip([]), identity, columns, [True] * len(columns), separator, borders, lines
    )
    links: dict[ContactPoint, RoadLink | None] = {}
    lane_links: LaneLinks = {k: {} for k in range(len(columns))}
    for contact, names in (
        ("start", [path.before for path in bundle]),
        ("end", [path.after for path in bundle]),
    ):
        index, column = place_of[names[0]]
        other = roads[index]
        there: ContactPoint = "end" if other.along[column] == (contact == "start") else "start"
        cut = other.ends[there]
        road.ends[contact] = RoadEnd(-cut.outward, -cut.offset)  # type: ignore[index]
        for k, border in enumerate(borders):
            node = border.nodes[0 if contact == "start" else -1]
            tail = other.tails[there].get(node)
            if tail is not None and len(tail) > 1:
                road.lines[k] = (
                    np.concatenate([tail[:-1], road.lines[k]])
                    if contact == "start"
                    else np.concatenate([road.lines[k], tail[-2::-1]])
                )
        _trim_road(road, contact)  # type: ignore[arg-type]
        links[contact] = RoadLink("road", other.id, there)  # type: ignore[index]
        for k, name in enumerate(names):
            lane_links[k][contact] = (other.lane_id(place_of[name][1]),)  # type: ignore[index]
    before = place_of[bundle[0].before][0]
    connection = Connection(
        "",
        roads[before].id,
        identity,
        "start",
        tuple((lane_links[k]["start"][0], road.lane_id(k)) for k in range(len(columns))),
    )
    return road, links, lane_links, connection


# ----------------------------------------------------------------------------- one road
def _build_road(
    network: LaneNetwork,
    built: BuiltRoads,
    laid: _StripRoad,
    links: dict[ContactPoint, RoadLink | None],
    lane_links: LaneLinks,
    junction: JunctionId | None,
) -> None:
    inward, outward = -laid.ends["start"].outward, laid.ends["end"].outward
    fitted = fit_road(
        laid.lines,
        laid.separator,
        math.atan2(inward[1], inward[0]),
        math.atan2(outward[1], outward[0]),
    )
    # s at which the lanelets of the strip follow each other, by the nodes of the line between the
    # directions.
    count = len(laid.columns[0])
    corners = []
    for step in range(1, count):
        lanelet = laid.columns[0][step]
        along = laid.along[0]
        nodes = [bound.nodes[0 if along else -1] for bound in (lanelet.left, lanelet.right)]
        corners.append(network.source.line(nodes).mean(axis=0))
    inner = fitted.locate(np.array(corners))[0].tolist() if corners else []
    starts = [0.0, *sorted(inner)]
    edges = [*starts, fitted.length]
    lanes = {0: Lane(0, "none", road_marks=_mark_border(network, fitted, laid, laid.separator))}
    steps = []
    for column, lanelets in enumerate(laid.columns):
        lane_id = laid.lane_id(column)
        border = column if lane_id > 0 else column + 1
        linked = lane_links[column]
        lanes[lane_id] = Lane(
            lane_id,
            LANE_TYPES[lanelets[0].subtype],
            widths=fitted.widths[column],
            road_marks=_mark_border(network, fitted, laid, border),
            speeds=tuple(_lane_speeds(network.source, lanelets, starts)),
            access=tuple(_lane_access(lanelets, starts)),
            predecessors=linked.get("start", ()),
            successors=linked.get("end", ()),
        )
        steps += [
            (
                lanelet,
                LanePlace(
                    laid.id,
                    lane_id,
                    edges[k],
                    edges[k + 1],
                    laid.along[column],
                    lanelet.part,
                ),
            )
            for k, lanelet in enumerate(lanelets)
        ]
    ordered = dict(sorted(lanes.items(), reverse=True))
    everything = [lanelet for column in laid.columns for lanelet in column]
    speeds = [limit.max for lane in lanes.values() for limit in lane.speeds]
    road = Road(
        id=laid.id,
        name="",
        length=fitted.length,
        junction=junction,
        rule="LHT" if network.left_hand else "RHT",
        predecessor=links["start"],
        successor=links["end"],
        types=(RoadType(0.0, _road_type(everything), max(speeds, default=None)),),
        geometry=fitted.geometry,
        elevation=fitted.elevation,
        superelevation=fitted.superelevation,
        lane_offset=fitted.lane_offset,
        sections=(LaneSection(0.0, fitted.length, ordered),),
    )
    built.add(BuiltRoad(road, fitted, everything), steps)


def _road_type(lanelets: Sequence[Lanelet]) -> str:
    subtypes = {lanelet.subtype for lanelet in lanelets}
    if subtypes <= {"walkway", "shared_walkway", "stairs", "pedestrian_lane"}:
        return "pedestrian"
    if subtypes <= {"bicycle_lane"}:
        return "bicycle"
    if "highway" in subtypes:
        return "motorway"
    if "play_street" in subtypes:
        return "townPlayStreet"
    return "rural" if any(ll.tags.get("location") == "nonurban" for ll in lanelets) else "town"


def read_speed(text: str) -> float | None:
    """A speed of a tag in m/s, in km/h where it names no unit; ``None`` if it is none."""
    match = _SPEED_PARTS.fullmatch(text.lower())
    if match is None or float(match[1]) <= 0.0:
        return None
    return float(match[1]) * _PER_MPS.get(match[2] or "", 1.0 / 3.6)


def speed_of(source: LaneletMap, lanelet: Lanelet) -> tuple[float | None, str]:
    """Limit of a lanelet, m/s, and whether it is ``regulated``, a ``tag`` or ``usual``."""
    for reference in lanelet.regulations:
        element = source.regulatory.get(reference)
        if element is not None and element.subtype in ("speed_limit", "digital_speed_limit"):
            speed = read_sign_speed(source, element.tags, element.members)
            if speed is not None:
                return speed, "regulated"
    for key in ("speed_limit", "speed_limit:mandatory", "participant:vehicle:speed_limit"):
        speed = read_speed(lanelet.tags.get(key, ""))
        if speed is not None:
            return speed, "tag"
    if LANE_TYPES[lanelet.subtype] in ("sidewalk", "biking", "shoulder"):
        return None, "usual"
    location = lanelet.tags.get("location", "urban")
    usual = _USUAL_SPEEDS.get(location, _USUAL_SPEEDS["urban"]).get(lanelet.subtype, _USUAL)
    return usual / 3.6, "usual"


def read_sign_speed(
    source: LaneletMap, tags: Tags, members: dict[str, list[tuple[str, str]]]
) -> float | None:
    """What a speed limit says, m/s: by its own tags or by those of its sign."""
    texts = [tags.get("sign_type", ""), tags.get("speed_limit", ""), tags.get("limit", "")]
    for _, way in members.get("refers", ()):
        texts.append(source.way_tags.get(way, {}).get("subtype", ""))
    for text in texts:
        # "de274-60", "50kmh", "30 mph", "274.1-30"
        number = text.rpartition("-")[2] if re.match(r"(?i)[a-z]{0,2}274", text) else text
        speed = read_speed(number)
        if speed is not None:
            return speed
    return None


def _lane_speeds(
    source: LaneletMap, lanelets: Sequence[Lanelet], starts: Sequence[float]
) -> Iterable[LaneSpeed]:
    last: float | None = None
    for lanelet, s in zip(lanelets, starts, strict=True):
        speed, _ = speed_of(source, lanelet)
        if speed is not None and speed != last:
            yield LaneSpeed(s, speed)
            last = speed


def access_of(lanelet: Lanelet) -> tuple[tuple[str, str], ...]:
    """Who may use a lanelet beyond what its type says: rule and restriction, in order."""
    allowed: set[str] = set()
    denied: set[str] = set()
    for key, value in lanelet.tags.items():
        if not key.startswith("participant:"):
            continue
        name = key.split(":")[-1]
        restriction = _PARTICIPANTS.get(name)
        if restriction is None:
            continue
        (allowed if value in ("yes", "true", "1") else denied).add(restriction)
    if LANE_TYPES[lanelet.subtype] == "sidewalk":
        return ()  # its type says it; bicycles on it are in the report
    if "participant:vehicle" in lanelet.tags:
        return tuple(("deny", name) for name in sorted(denied))
    if allowed and LANE_TYPES[lanelet.subtype] == "driving":
        return tuple(("allow", name) for name in sorted(allowed))
    return tuple(("deny", name) for name in sorted(denied))


def _lane_access(lanelets: Sequence[Lanelet], starts: Sequence[float]) -> Iterable[LaneAccess]:
    last: tuple[tuple[str, str], ...] = ()
    for lanelet, s in zip(lanelets, starts, strict=True):
        rules = access_of(lanelet)
        if rules != last:
            for rule, restriction in rules:
                yield LaneAccess(s, rule, restriction)
            last = rules


def _mark_border(
    network: LaneNetwork, fitted: FittedRoad, laid: _StripRoad, border: int
) -> tuple[RoadMark, ...]:
    """Road marks of a border by the ways that it is made of."""
    bound = laid.borders[border]
    starts = [bound.nodes[start] for start, _ in bound.ways]
    places = fitted.locate(network.source.line(starts))[0]
    marks: list[RoadMark] = []
    for k, (_, way) in enumerate(bound.ways):
        tags = network.source.way_tags.get(way, {})
        mark = _mark_of(network.source, tags, bound, k, way)
        s = 0.0 if k == 0 else float(places[k])
        if marks and s <= marks[-1].s + 1e-3:
            s = marks[-1].s
            marks.pop()
        if marks and mark == marks[-1]._replace(s=0.0):
            continue
        if s < fitted.length - 1e-3 or not marks:
            marks.append(mark._replace(s=s))
    return tuple(marks)


def _mark_of(source: LaneletMap, tags: Tags, bound: Bound, k: int, way: str) -> RoadMark:
    kind, subtype = tags.get("type", ""), tags.get("subtype", "")
    # The sides of a way are those of its own direction, which may be against the road.
    nodes = source.ways.get(way, ())
    start = bound.ways[k][0]
    is_turned = (
        nodes[:2] != bound.nodes[start : start + 2] and nodes[-1:] == bound.nodes[start : start + 1]
    )
    if kind in ("curbstone", "guard_rail", "wall", "fence"):
        return RoadMark(
            0.0, "curb" if kind == "curbstone" else "none", "standard", "standard", 0.0, "none"
        )
    found = _MARKS.get((kind, subtype)) or _MARKS.get((kind, ""))
    name, width = found or ("none", 0.0)
    if is_turned:
        name = _MIRRORED.get(name, name)
    color = tags.get("color", "standard")
    color = color if color in ("white", "yellow", "red", "blue", "green") else "standard"
    weight = "bold" if kind == "line_thick" else "standard"
    return RoadMark(0.0, name, color, weight, width, _lane_change(tags, name, is_turned=is_turned))


def _lane_change(tags: Tags, name: str, *, is_turned: bool) -> LaneChange:
    """Who may cross a line: by its tags, else as Lanelet2 reads its type.

    ``increase`` is from right to left along the road: towards larger lane ids.
    """
    yes = ("yes", "true", "1")
    to_left = {"broken": True, "solid broken": False, "broken solid": False}.get(name, False)
    to_right = to_left
    if name == "solid broken":  # from left to right: the right lane has the broken line
        to_left = True
    elif name == "broken solid":
        to_right = True
    if "lane_change" in tags:
        to_left = to_right = tags["lane_change"] in yes
    for key, side in (("lane_change:left", "left"), ("lane_change:right", "right")):
        if key in tags:
            allowed = tags[key] in yes
            if (side == "left") != is_turned:
                to_left = allowed
            else:
                to_right = allowed
    if to_left and to_right:
        return "both"
    return "increase" if to_left else "decrease" if to_right else "none"


def replace_road(built: BuiltRoads, road: Road) -> None:
    """Put a changed road in the place of the one of its id."""
    item = built.roads[road.id]
    built.roads[road.id] = replace(item, road=road)
