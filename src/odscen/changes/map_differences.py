"""Two maps held against each other: every difference once, in words, and nothing else.

What counts is what the files mean: the order of elements, a lane section cut in two, or a profile
written in other pieces is no difference. Roads are paired by id, else by where they lie.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, fields
from math import hypot
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from odscen.base.shown import shown_id
from odscen.changes.lane_differences import RoadPair, lane_differences
from odscen.changes.map_change import ChangePlace, MapChange, metres, of_lane, of_road
from odscen.changes.paired_lanes import SAME, merged, paired_stretches
from odscen.opendrive.lanes import RoadTable, is_forward
from odscen.opendrive.topology import lane_successors

if TYPE_CHECKING:
    from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence

    from odscen.base.arrays import FloatArray
    from odscen.base.ids import LaneKey, RoadId
    from odscen.changes.map_change import ChangedThing, ChangeKind
    from odscen.opendrive.road_model import Controller, Junction, OpenDrive, Road, RoadLink


class _LinkEnd(NamedTuple):
    """A lane where it meets another, named as in the map before: road, id, s of the meeting."""

    road: RoadId
    lane: int
    s: float


_Link = tuple[_LinkEnd, _LinkEnd]


@dataclass(frozen=True, slots=True)
class PairedRoads:
    """Roads that both maps have, by their ids in each."""

    by_before: Mapping[str, RoadPair]
    by_after: Mapping[str, RoadPair]


def lane_link_differences(
    before: OpenDrive, after: OpenDrive, roads: PairedRoads
) -> Iterator[MapChange]:
    """Links from lane to lane that only one map has, where both have both lanes.

    What a lane that came or went takes with it is not told: the lane is.
    """
    old = set(_list_links(before, roads.by_before, 0))
    new = set(_list_links(after, roads.by_after, 1))
    kinds: tuple[tuple[ChangeKind, set[_Link]], ...] = (
        ("removed", old - new),
        ("added", new - old),
    )
    for kind, links in kinds:
        for here, there in sorted(links):
            within = here.road == there.road
            what: ChangedThing = "lane link" if within else "connection"
            junction = None if within else _common_junction(roads, here.road, there.road)
            through = f" (junction {shown_id(junction)})" if junction else ""
            subject = f"from {of_lane(here.road, here.lane)} to {of_lane(there.road, there.lane)}"
            place = ChangePlace(here.road, here.s, here.s, here.lane)
            yield MapChange(kind, what, f"{what} {subject}{through}", place=place)


def _common_junction(roads: PairedRoads, *names: str) -> str | None:
    found = [roads.by_before[name].before.junction for name in names]
    return next((str(junction_id) for junction_id in found if junction_id), None)


def _list_links(odr: OpenDrive, pairs: Mapping[str, RoadPair], side: int) -> Iterator[_Link]:
    """Links of a map between lanes that both maps have, named as before."""
    for key, followers in lane_successors(odr).items():
        for follower in followers:
            if key.road == follower.road and key.section != follower.section:
                link = _link_within_road(pairs, key, follower, side)
            else:
                link = _link_between_roads(odr, pairs, (key, follower), side)
            if link is not None:
                yield link


def _link_within_road(
    pairs: Mapping[str, RoadPair], key: LaneKey, follower: LaneKey, side: int
) -> _Link | None:
    """Link over the border of two sections that both maps have there."""
    pair = pairs.get(key.road)
    if pair is None:
        return None
    later = max(key, follower, key=lambda lane_key: lane_key.section)
    at = [
        number
        for number, stretch in enumerate(pair.stretches)
        if stretch.sections[side] == later.section
    ]
    if not at or at[0] == 0:
        return None
    low, high = pair.stretches[at[0] - 1], pair.stretches[at[0]]
    if low.sections[1 - side] == high.sections[1 - side]:
        return None  # the other map has one section here: its lanes go on
    ends = []
    for lane_key in (key, follower):
        number = at[0] if lane_key.section == later.section else at[0] - 1
        ends.append(_name_as_before(pair, number, lane_key.lane, side, high.s0))
    return (ends[0], ends[1]) if ends[0] and ends[1] else None


def _link_between_roads(
    odr: OpenDrive, pairs: Mapping[str, RoadPair], link: tuple[LaneKey, LaneKey], side: int
) -> _Link | None:
    ends = []
    for key, leaves in zip(link, (True, False), strict=True):
        pair = pairs.get(key.road)
        if pair is None:
            return None
        road = odr.roads[key.road]
        lane = road.sections[key.section].lanes[key.lane]
        forward = is_forward(road, lane)
        number = len(pair.stretches) - 1 if forward == leaves else 0
        at = pair.before.length if forward == leaves else 0.0
        ends.append(_name_as_before(pair, number, key.lane, side, at))
    return (ends[0], ends[1]) if ends[0] and ends[1] else None


def _name_as_before(pair: RoadPair, number: int, lane: int, side: int, s: float) -> _LinkEnd | None:
    """Lane of one map by its name in the map before; none if only one map has it."""
    for both in pair.stretches[number].pairs:
        named = both[side]
        if named is not None and named.id == lane:
            return None if both[0] is None or both[1] is None else _link_end(pair, both[0].id, s)
    return None


def _link_end(pair: RoadPair, lane: int, s: float) -> _LinkEnd:
    at = pair.before.length if abs(s - pair.before.length) <= SAME else s
    return _LinkEnd(pair.before.id, lane, round(at, 3))


# ------------------------------------------------------------------------- junctions, controllers
def junction_differences(
    before: OpenDrive, after: OpenDrive, roads: PairedRoads
) -> Iterator[MapChange]:
    """Junctions that came, went or have other priorities, controllers, types or roads."""
    names = {str(pair.after.id): str(pair.before.id) for pair in roads.by_before.values()}
    old, new = before.junctions, after.junctions
    for name in _keys_only_in(old, new):
        yield MapChange("removed", "junction", f"junction {shown_id(name)}")
    for name in _keys_only_in(new, old):
        yield MapChange("added", "junction", f"junction {shown_id(name)}")
    for key, junction in old.items():
        if key in new:
            yield from _junction_values(junction, new[key], names)
    for pair in roads.by_before.values():
        old_one, new_one = (str(road.junction or "none") for road in (pair.before, pair.after))
        if old_one != new_one:
            subject = f"junction of {of_road(pair.before.id)}"
            place = ChangePlace(pair.before.id, 0.0, pair.before.length)
            yield MapChange("changed", "junction", subject, old_one, new_one, place)


def _keys_only_in(these: Iterable[str], others: Container[str]) -> list[str]:
    return [str(key) for key in these if key not in others]


def _junction_values(old: Junction, new: Junction, names: Mapping[str, str]) -> Iterator[MapChange]:
    name = f"junction {shown_id(old.id)}"
    ways = {f"road {priority.high} over road {priority.low}" for priority in old.priorities}
    others = {
        f"road {names.get(priority.high, priority.high)} "
        f"over road {names.get(priority.low, priority.low)}"
        for priority in new.priorities
    }
    for roads_of_priority in sorted(ways - others):
        yield MapChange("removed", "priority", f"priority of {roads_of_priority} at {name}")
    for roads_of_priority in sorted(others - ways):
        yield MapChange("added", "priority", f"priority of {roads_of_priority} at {name}")
    for what, before, after in (
        ("type", old.type, new.type),
        ("name", old.name, new.name),
        ("controllers", _join_sorted(old.controllers), _join_sorted(new.controllers)),
        ("main road", old.main_road, new.main_road),
    ):
        if before != after:
            said_both = before or "none", after or "none"
            yield MapChange("changed", "junction", f"{what} of {name}", *said_both)


def _join_sorted(items: Iterable[str]) -> str:
    return ", ".join(sorted(items))


def controller_differences(
    before: Mapping[str, Controller], after: Mapping[str, Controller]
) -> Iterator[MapChange]:
    """Controllers that came, went, or control other signals."""
    for key in _keys_only_in(before, after):
        yield MapChange("removed", "controller", f"controller {shown_id(key)}")
    for key in _keys_only_in(after, before):
        yield MapChange("added", "controller", f"controller {shown_id(key)}")
    for key, old in before.items():
        new = after.get(key)
        if new is None:
            continue
        controlled = _list_controlled(old.controls), _list_controlled(new.controls)
        if controlled[0] != controlled[1]:
            subject = f"signals of controller {shown_id(key)}"
            yield MapChange("changed", "controller", subject, *controlled)


def _list_controlled(controls: Sequence[tuple[str, str]]) -> str:
    return _join_sorted(signal for signal, _ in controls) or "none"


_STEP = 2.0
_LINE = 0.01
_ANGLE = 1e-5


def road_differences(pair: RoadPair, roads: Mapping[str, str]) -> Iterator[MapChange]:
    """Differences of a road beside its lanes.

    Parameters
    ----------
    pair
        The road in both maps.
    roads
        Id before by id after, of each road that is in both maps.
    """
    old, new = pair.before, pair.after
    yield from _compare_attributes(old, new)
    if old == new:
        return
    yield from _compare_reference_lines(pair)
    yield from _compare_road_types(old, new)
    for end in ("predecessor", "successor"):
        yield from _compare_road_link(old, new, end, roads)


def _compare_attributes(old: Road, new: Road) -> Iterator[MapChange]:
    place = ChangePlace(old.id, 0.0, old.length)
    for name, before, after in (
        ("id", old.id, new.id),
        ("name", old.name, new.name),
        ("rule", old.rule, new.rule),
    ):
        if before != after:
            subject = f"{name} of {of_road(old.id)}"
            both = before or "none", after or "none"
            yield MapChange("changed", "road", subject, *both, place=place)
    if abs(old.length - new.length) > SAME:
        both = f"{metres(old.length)} m", f"{metres(new.length)} m"
        place = ChangePlace(old.id, old.length, old.length)
        yield MapChange("changed", "geometry", f"length of {of_road(old.id)}", *both, place=place)


def _compare_reference_lines(pair: RoadPair) -> Iterator[MapChange]:
    """Reference line, height, roll and lane offset, each with its greatest difference."""
    end = min(pair.before.length, pair.after.length)
    s = np.linspace(0.0, end, max(2, int(end / _STEP) + 1))
    old, new = (
        _evaluate_road(table, road, s)
        for table, road in zip(pair.tables, (pair.before, pair.after), strict=True)
    )
    moved = np.hypot(old["x"] - new["x"], old["y"] - new["y"])
    if moved.max() > _LINE:
        yield MapChange(
            "moved",
            "geometry",
            f"line of {of_road(pair.before.id)}",
            None,
            f"by up to {metres(float(moved.max()))} m",
            place=_place_of_difference(pair, s, moved, _LINE),
        )
    things: tuple[tuple[ChangedThing, str, float], ...] = (
        ("elevation", "m", SAME),
        ("superelevation", "rad", _ANGLE),
        ("lane offset", "m", SAME),
    )
    for what, unit, same in things:
        apart = np.abs(old[what] - new[what])
        at = int(np.argmax(apart))
        if apart[at] > same:
            subject = f"{what} of {of_road(pair.before.id)} at s {metres(float(s[at]))} m"
            before, after = (f"{metres(float(row[what][at]))} {unit}" for row in (old, new))
            place = _place_of_difference(pair, s, apart, same)
            yield MapChange("changed", what, subject, before, after, place)


def _evaluate_road(table: RoadTable, road: Road, s: FloatArray) -> dict[str, FloatArray]:
    row = np.full(s.size, table.road_index[road.id])
    line = table.reference(row, s)
    return {
        "x": line.x,
        "y": line.y,
        "elevation": line.z,
        "superelevation": line.roll,
        "lane offset": table.lane_offset(row, s),
    }


def _place_of_difference(
    pair: RoadPair, s: FloatArray, apart: FloatArray, same: float
) -> ChangePlace:
    at = np.flatnonzero(apart > same)
    return ChangePlace(pair.before.id, float(s[at[0]]), float(s[at[-1]]))


def _compare_road_types(old: Road, new: Road) -> Iterator[MapChange]:
    if old.types == new.types:
        return
    end = min(old.length, new.length)
    starts = merged((road_type.s for road in (old, new) for road_type in road.types), end=end)
    before = None
    for s0, s1 in zip(starts, [*starts[1:], end], strict=True):
        types = _type_at(old, 0.5 * (s0 + s1)), _type_at(new, 0.5 * (s0 + s1))
        if types[0] != types[1] and types != before:
            subject = f"type of {of_road(old.id)}"
            place = ChangePlace(old.id, s0, s1)
            yield MapChange("changed", "road type", subject, *types, place=place)
        before = types


def _type_at(road: Road, s: float) -> str:
    holding = [road_type.type for road_type in road.types if road_type.s <= s]
    return holding[-1] if holding else "none"


def _compare_road_link(
    old: Road, new: Road, end: str, roads: Mapping[str, str]
) -> Iterator[MapChange]:
    before: RoadLink | None = getattr(old, end)
    after: RoadLink | None = getattr(new, end)
    links = _link_words(before, None), _link_words(after, roads)
    if links[0] != links[1]:
        at = 0.0 if end == "predecessor" else old.length
        subject = f"{end} of {of_road(old.id)}"
        yield MapChange("changed", "road link", subject, *links, place=ChangePlace(old.id, at, at))


def _link_words(link: RoadLink | None, roads: Mapping[str, str] | None) -> str:
    if link is None:
        return "none"
    number: Any = link.element_id
    if roads is not None and link.element_type == "road":
        number = roads.get(number, number)
    end = f", its {link.contact_point}" if link.contact_point else ""
    return f"{link.element_type} {number}{end}"


_MOVED = 0.01
_NEAR = 0.5
_PLACE = ("id", "s", "t")
_MS_UNITS = ("m/s", "km/h", "mph")


def furniture_differences(old: Road, new: Road) -> Iterator[MapChange]:
    """Differences of signals, references of signals, and objects of a road."""
    yield from _compare_things(old, new, old.signals, new.signals, _signal_name)
    yield from _compare_things(
        old, new, old.signal_references, new.signal_references, _reference_name
    )
    yield from _compare_things(old, new, old.objects, new.objects, _object_name)


def _signal_name(signal: Any) -> tuple[ChangedThing, str]:
    return "signal", f"signal {shown_id(signal.id)} (type {shown_id(signal.type)})"


def _reference_name(reference: Any) -> tuple[ChangedThing, str]:
    return "signal reference", f"reference to signal {shown_id(reference.id)}"


def _object_name(item: Any) -> tuple[ChangedThing, str]:
    if item.type == "crosswalk":
        return "crosswalk", f"crosswalk {shown_id(item.id)}"
    return "object", f"object {shown_id(item.id)} ({item.type or 'no type'})"


def _compare_things(
    old: Road,
    new: Road,
    before: Sequence[Any],
    after: Sequence[Any],
    name: Callable[[Any], tuple[ChangedThing, str]],
) -> Iterator[MapChange]:
    if before == after:
        return
    pairs, gone, came = _pair_things(before, after)
    for thing in gone:
        what, subject = name(thing)
        yield MapChange(
            "removed", what, f"{subject} of {of_road(old.id)}", place=_place_of_thing(old, thing)
        )
    for thing in came:
        what, subject = name(thing)
        yield MapChange(
            "added", what, f"{subject} of {of_road(new.id)}", place=_place_of_thing(new, thing)
        )
    for first, second in pairs:
        yield from _compare_fields(old, first, second, name)


def _place_of_thing(road: Road, thing: Any) -> ChangePlace:
    return ChangePlace(road.id, thing.s, thing.s, None, thing.t)


def _pair_things(
    before: Sequence[Any], after: Sequence[Any]
) -> tuple[list[tuple[Any, Any]], list[Any], list[Any]]:
    """Pair by id, the nearest first where an id is not unique; then by type and place."""
    pairs: list[tuple[Any, Any]] = []
    gone = _take_pairs(before, list(after), pairs, key=lambda thing: thing.id, within=float("inf"))
    taken = {id(second) for _, second in pairs}
    rest = [thing for thing in after if id(thing) not in taken]
    gone = _take_pairs(gone, rest, pairs, key=_type_and_subtype, within=_NEAR)
    taken = {id(second) for _, second in pairs}
    return pairs, gone, [thing for thing in after if id(thing) not in taken]


def _type_and_subtype(thing: Any) -> tuple[str, str]:
    return getattr(thing, "type", thing.id), getattr(thing, "subtype", "")


def _take_pairs(
    before: Sequence[Any],
    after: Sequence[Any],
    pairs: list[tuple[Any, Any]],
    *,
    key: Callable[[Any], Any],
    within: float,
) -> list[Any]:
    """Add pairs of the same key, nearest first; what found no partner is returned."""
    free: dict[Any, list[Any]] = defaultdict(list)
    for thing in after:
        free[key(thing)].append(thing)
    alone = []
    for thing in before:
        near = min(free[key(thing)], key=lambda other: _distance_apart(thing, other), default=None)
        if near is None or _distance_apart(thing, near) > within:
            alone.append(thing)
            continue
        free[key(thing)] = [other for other in free[key(thing)] if other is not near]
        pairs.append((thing, near))
    return alone


def _distance_apart(one: Any, other: Any) -> float:
    return hypot(one.s - other.s, one.t - other.t)


def _compare_fields(
    road: Road, old: Any, new: Any, name: Callable[[Any], tuple[ChangedThing, str]]
) -> Iterator[MapChange]:
    what, subject = name(old)
    of = f"{subject} of {of_road(road.id)}"
    place = _place_of_thing(road, old)
    if _distance_apart(old, new) > _MOVED:
        before, after = (f"s {metres(thing.s)} m, t {metres(thing.t)} m" for thing in (old, new))
        yield MapChange("moved", what, of, before, after, place)
    if old.id != new.id:
        yield MapChange("changed", what, f"id of {of}", old.id, new.id, place=place)
    for field in _field_names(old):
        before, after = getattr(old, field), getattr(new, field)
        if field not in _PLACE and not _values_equal(before, after):
            label = field.replace("_", " ")
            values = _describe_field(old, field), _describe_field(new, field)
            if values[0] == values[1]:
                values = "as it was", "another"
            yield MapChange("changed", what, f"{label} of {of}", *values, place=place)


def _field_names(thing: Any) -> Sequence[str]:
    names: Sequence[str] = getattr(thing, "_fields", ())
    return names or [field.name for field in fields(thing)]


def _values_equal(before: Any, after: Any) -> bool:
    if isinstance(before, float) and isinstance(after, float):
        return abs(before - after) <= SAME
    return bool(before == after)


def _describe_field(thing: Any, field: str) -> str:
    value = getattr(thing, field)
    if field == "value" and value is not None and thing.unit in _MS_UNITS:
        return f"{metres(round(value * 3.6, 2))} km/h"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return metres(value)
    if field == "validities":
        return (
            ", ".join(f"lanes {thing.from_lane} to {thing.to_lane}" for thing in value)
            or "all lanes"
        )
    if isinstance(value, tuple):
        return f"{len(value)}"
    return str(value) if value not in (None, "") else "none"


_SAME_PLACE = 0.1


def map_differences(before: OpenDrive, after: OpenDrive) -> tuple[MapChange, ...]:
    """Find the differences of two maps, roads in the order of the file before, then what came.

    Parameters
    ----------
    before, after
        The maps as read.
    """
    tables = RoadTable.of(before), RoadTable.of(after)
    partners = _find_partner_roads(before, after, tables)
    pairs = [
        RoadPair(
            before.roads[old],
            after.roads[new],
            tables,
            tuple(paired_stretches(before.roads[old], after.roads[new])),
        )
        for old, new in partners.items()
    ]
    roads = PairedRoads(
        {str(pair.before.id): pair for pair in pairs}, {str(pair.after.id): pair for pair in pairs}
    )
    return (
        *_compare_headers(before, after),
        *_compare_roads(before, after, partners),
        *_within_roads(pairs, {str(new): str(old) for old, new in partners.items()}),
        *lane_link_differences(before, after, roads),
        *junction_differences(before, after, roads),
        *controller_differences(before.controllers, after.controllers),
    )


def _compare_headers(before: OpenDrive, after: OpenDrive) -> Iterator[MapChange]:
    old, new = before.header, after.header
    for name, was, now in (
        ("geographic reference", old.geo_reference, new.geo_reference),
        ("offset", str(old.offset), str(new.offset)),
    ):
        if was != now:
            subject = f"{name} of the map"
            yield MapChange("changed", "header", subject, was or "none", now or "none")


def _find_partner_roads(
    before: OpenDrive, after: OpenDrive, tables: tuple[RoadTable, RoadTable]
) -> dict[RoadId, RoadId]:
    """Id after of each road that both maps have."""
    partners = {road: road for road in before.roads if road in after.roads}
    alone = [road for road in before.roads if road not in partners]
    rest = [road for road in after.roads if road not in partners]
    if alone and rest:
        places = _road_places(tables[1], [after.roads[road] for road in rest])
        for road, place in zip(
            alone,
            _road_places(tables[0], [before.roads[road_id] for road_id in alone]),
            strict=True,
        ):
            apart = np.abs(places - place).max(axis=1)
            nearest = int(np.argmin(apart))
            if apart[nearest] <= _SAME_PLACE:
                partners[road] = rest[nearest]
                places[nearest] = np.inf
    return {road: partners[road] for road in before.roads if road in partners}


def _road_places(
    table: RoadTable, roads: list[Road]
) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Where roads begin, have their middle and end, shape ``(roads, 6)``, metres."""
    rows = np.array([table.road_index[road.id] for road in roads])
    length = np.array([road.length for road in roads])
    points = [table.reference(rows, part * length) for part in (0.0, 0.5, 1.0)]
    return np.stack([value for point in points for value in (point.x, point.y)], axis=1)


def _compare_roads(
    before: OpenDrive, after: OpenDrive, partners: Mapping[RoadId, RoadId]
) -> Iterator[MapChange]:
    for road in before.roads.values():
        if road.id not in partners:
            yield _whole_road_change(road, "removed")
    known = set(partners.values())
    for road in after.roads.values():
        if road.id not in known:
            yield _whole_road_change(road, "added")


def _whole_road_change(road: Road, kind: str) -> MapChange:
    of = f" of junction {road.junction}" if road.junction else ""
    size = f"{metres(road.length)} m{of}"
    place = ChangePlace(road.id, 0.0, road.length)
    if kind == "added":
        return MapChange("added", "road", of_road(road.id), None, size, place)
    return MapChange("removed", "road", of_road(road.id), size, None, place)


def _within_roads(pairs: list[RoadPair], names: Mapping[str, str]) -> Iterator[MapChange]:
    for pair in pairs:
        if pair.before == pair.after:
            continue
        yield from road_differences(pair, names)
        yield from lane_differences(pair)
        yield from furniture_differences(pair.before, pair.after)
