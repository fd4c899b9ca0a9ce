"""The rules for demand: zones, profiles, matrices, counts, inputs, routes, parking and transit."""

from __future__ import annotations

from collections import defaultdict
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

from odscen.base.categories import DEFAULT_BODY
from odscen.base.shown import some_of
from odscen.scenario.demand.count_stations import contradictions, transitions
from odscen.scenario.demand.day_profiles import BUILT_IN, known_profiles
from odscen.scenario.demand.inflow import entries, entries_of, entry_lanes
from odscen.scenario.demand.zones import PLACE_SEPARATOR, place_segments, zone_segments
from odscen.scenario.document.problems import Problem, error, limited, warning
from odscen.scenario.placing.region import on_foot

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

    from odscen.base.categories import Category
    from odscen.lanegraph.parking_areas import MapParking
    from odscen.scenario.demand.inflow import Entry
    from odscen.scenario.document.scenario_document import (
        Counts,
        Demand,
        Matrix,
        Scenario,
        SharedRoutes,
        TransitLine,
        VehicleInput,
        Window,
    )
    from odscen.scenario.placing.region import NodePlace, Region

_HOURS = 24
"""Of a day: a profile with fewer shares has longer slices, which may not be what was meant."""


def transit_problems(scenario: Scenario, region: Region) -> Iterator[Problem]:
    """Yield everything wrong with stops and lines of a scenario."""
    places: dict[str, NodePlace] = {}
    for index, stop in enumerate(scenario.transit.stops):
        where = f"transit.stops[{index}]"
        if stop.id in places:
            message = f"two stops are called {stop.id!r}; give one of them another id"
            yield error("duplicate_id", f"{where}.id", message)
        place, found = _road_place(region, stop.node, f"{where}.node", f"stop {stop.id!r}")
        yield from found
        if place is not None:
            places[stop.id] = place
    known = {stop.id for stop in scenario.transit.stops}
    listed = _list_names(known)
    nodes = {stop.id: stop.node for stop in scenario.transit.stops}
    region.look_up(leg for line in scenario.transit.lines for leg in _line_legs(line, nodes))
    for index, line in enumerate(scenario.transit.lines):
        where = f"transit.lines[{index}]"
        yield from _line_problems(scenario, line, where)
        unknown = [(row, one.stop) for row, one in enumerate(line.stops) if one.stop not in known]
        for row, name in unknown:
            message = f"line {line.id!r} serves stop {name!r}; there are {listed}"
            yield error("unknown_stop", f"{where}.stops[{row}].stop", message)
        if not unknown:
            yield from _route_problems(line, places, region, where)


def _line_legs(line: TransitLine, nodes: Mapping[str, str]) -> Iterator[tuple[str, str | None]]:
    """Yield the pairs of nodes between which a line leads, by the nodes of its stops."""
    served = (nodes[stop.stop] for stop in line.stops if stop.stop in nodes)
    return pairwise((line.start, *served, *([line.goal] if line.goal else ())))


def _line_problems(scenario: Scenario, line: TransitLine, where: str) -> Iterator[Problem]:
    if on_foot(line.category):
        message = f"line {line.id!r} has pedestrians; its trips are made by vehicles"
        yield error("wrong_graph", f"{where}.category", message)
    first = line.departures[0] if line.departures else line.begin
    if first >= scenario.simulation.duration:
        message = (
            f"line {line.id!r} departs first at {first:g} s, but the run ends at "
            f"{scenario.simulation.duration:g} s; depart earlier or run longer"
        )
        yield warning("departs_too_late", where, message)


def _route_problems(
    line: TransitLine, places: Mapping[str, NodePlace], region: Region, where: str
) -> Iterator[Problem]:
    start, found = _road_place(region, line.start, f"{where}.start", f"line {line.id!r}")
    yield from found
    goal = None
    if line.goal is not None:
        goal, found = _road_place(region, line.goal, f"{where}.goal", f"line {line.id!r}")
        yield from found
    if start is None or any(stop.stop not in places for stop in line.stops):
        return
    named = [(line.start, start), *((stop.stop, places[stop.stop]) for stop in line.stops)]
    if goal is not None:
        named.append((str(line.goal), goal))
    for (one, place), (other, further) in pairwise(named):
        if not region.leads(place, further):
            nodes = [line.start, *([line.goal] if line.goal else [])]
            message = f"line {line.id!r}: no way leads from {one!r} to {other!r} inside the region"
            yield error("no_path", f"{where}.stops", message, nodes=nodes)
            return
    if goal is None and not len(region.candidates(named[-1][1])):
        message = f"line {line.id!r} has no end of the region to go to after its last stop"
        yield error("no_goal", f"{where}.goal", message)


def _road_place(
    region: Region, node: str, where: str, name: str
) -> tuple[NodePlace | None, list[Problem]]:
    place = region.place(node)
    if place is None or place.walk:
        what = "is on a walk, not on a lane" if place else "is not on the map"
        return None, [error("unknown_node", where, f"{name}: node {node!r} {what}", nodes=[node])]
    lanes = region.graph.lanes
    if not region.holds(place):
        message = f"{name}: node {node!r} is outside the region of interest"
        return None, [error("outside_roi", where, message, nodes=[node])]
    if lanes.lanes.junctions[int(lanes.lane[place.node])] is not None:
        message = f"{name}: node {node!r} is inside a junction; move it onto a road"
        return None, [error("in_junction", where, message, nodes=[node])]
    if float(lanes.width[place.node]) < min(body.width for body in DEFAULT_BODY.values()):
        message = f"{name}: the lane is too narrow at node {node!r}"
        return None, [error("lane_too_narrow", where, message, nodes=[node])]
    return place, []


_LISTED = 30
"""Names that a message lists at most."""


def _list_names(known: Iterable[str]) -> str:
    return some_of(sorted(known), most=_LISTED, between=", ") or "none"


_PARKING = "demand.parking"


def parking_problems(
    scenario: Scenario, region: Region, parking: MapParking | None
) -> Iterator[Problem]:
    """Yield why trips cannot park as the demand wants; ``parking`` ``None`` is not known."""
    how = scenario.demand.parking
    if not how.used:
        return
    demand = scenario.demand
    if not (demand.inputs or demand.matrices or demand.background):
        message = "no trips park: there are no inputs, matrices and background; add some or drop it"
        yield warning("nothing_parks", _PARKING, message)
    if parking is None:
        return
    if not parking.areas:
        beside = (
            f" within reach of a lane; {parking.unreached} are not" if parking.unreached else ""
        )
        message = (
            "the map has no parking places (objects of type parkingSpace, lanes of type parking)"
            f"{beside}; drop parking from the demand"
        )
        yield error("no_parking", _PARKING, message)
    elif not any(region.lanes[area.node] for area in parking.areas):
        message = (
            f"none of the {len(parking.areas)} parking areas of the map is in the region of "
            "interest; add their segments or drop parking from the demand"
        )
        segments = region.graph.lanes.segment
        names = {str(region.graph.segments.ids[segments[area.node]]) for area in parking.areas}
        yield error("parking_outside_roi", _PARKING, message, segments=sorted(names))


class _Places(NamedTuple):
    """What parts of the demand may name.

    Attributes
    ----------
    known, inside
        Segments of the map, and those of the region.
    zones
        Segments of each zone.
    """

    known: Collection[str]
    inside: frozenset[str]
    zones: Mapping[str, tuple[str, ...]]

    @classmethod
    def of(cls, demand: Demand, region: Region) -> _Places:
        """Those of a demand in a region; once for all of its parts."""
        return cls(
            frozenset(map(str, region.graph.segments.ids)),
            frozenset(map(str, region.segments)),
            zone_segments(demand),
        )

    def segments_of(self, name: str) -> tuple[str, ...]:
        """Segments of a zone; any other name is that of a segment."""
        return self.zones.get(name, (name,))

    def has(self, name: str) -> bool:
        """Whether there is a zone or a segment of that name."""
        return name in self.zones or name in self.known

    def reaches_inside(self, name: str) -> bool:
        """Whether any of its segments is in the region."""
        return not self.inside.isdisjoint(self.segments_of(name))


def route_problems(scenario: Scenario, region: Region) -> Iterator[Problem]:
    """Yield what is wrong with the routes of the demand."""
    demand, places = scenario.demand, _Places.of(scenario.demand, region)
    for index, one in enumerate(demand.routes.shares):
        where = f"demand.routes.shares[{index}]"
        yield from _end_problems(one, places, where)
        yield from _via_problems(one, places, where)
    generated = any(count.use == "generate" for count in demand.counts)
    if demand.routes.by == "travel_time" and generated:
        message = (
            "traffic generated from counts is made beside trips on their quickest routes in free "
            "flow; with other routes by travel time the counts are met less well"
        )
        yield warning("counts_by_travel_time", "demand.routes.by", message)


def _end_problems(shared_routes: SharedRoutes, places: _Places, where: str) -> Iterator[Problem]:
    for field, name in (
        ("origin", shared_routes.origin),
        ("destination", shared_routes.destination),
    ):
        if not places.has(name):
            message = f"{name!r} is neither a zone nor a segment of the map"
            yield error("unknown_zone", f"{where}.{field}", message)
        elif not places.reaches_inside(name):
            message = f"{name!r} is outside the region of interest"
            yield error("zone_outside_roi", f"{where}.{field}", message)


def _via_problems(shared_routes: SharedRoutes, places: _Places, where: str) -> Iterator[Problem]:
    for row, (via, _) in enumerate(shared_routes.routes):
        here = f"{where}.routes[{row}]"
        for name in via:
            if name not in places.known:
                message = f"the route leads over {name!r}, which the map does not have"
                yield error("unknown_segment", here, message, segments=[name])
            elif name not in places.inside:
                message = f"the route leads over {name!r}, outside the region of interest"
                yield error("zone_outside_roi", here, message, segments=[name])


def window_problems(scenario: Scenario, part: Window, where: str) -> Iterator[Problem]:
    """Yield what is wrong with begin and end of a part of the demand."""
    duration = scenario.simulation.duration
    if part.end is not None and part.end <= part.begin:
        message = f"{part.id!r} ends at {part.end:g} s, not after it begins ({part.begin:g} s)"
        yield error("flow_window_empty", f"{where}.end", message)
    elif part.begin >= duration:
        message = (
            f"{part.id!r} begins at {part.begin:g} s, but the run ends at {duration:g} s; begin "
            "earlier or run longer"
        )
        severity = error if part.end is None else warning
        yield severity("departs_too_late", f"{where}.begin", message)


def foot_problems(mix: Iterable[Category], name: str, where: str, what: str) -> Iterator[Problem]:
    """Yield an error if a mix of vehicles has pedestrians."""
    if any(on_foot(category) for category in mix):
        message = f"{name!r} has pedestrians; {what} are of vehicles: use a matrix for them"
        yield error("wrong_graph", f"{where}.mix", message)


MOST = 20
"""Rows of a table that are named one by one; the rest are counted."""


NAMED = 8
"""Entries that a message lists."""


def input_problems(scenario: Scenario, region: Region) -> Iterator[Problem]:
    """Yield everything wrong with the vehicle inputs of a scenario."""
    if not scenario.demand.inputs:
        return
    every, places = entries(region), _Places.of(scenario.demand, region)
    reached: dict[tuple[int, ...], frozenset[str]] = {}
    for index, part in enumerate(scenario.demand.inputs):
        where = f"demand.inputs[{index}]"
        yield from window_problems(scenario, part, where)
        yield from foot_problems(part.mix, part.id, where, "inputs")
        yield from _length_problems(scenario, part, where)
        found = [*_entry_problems(part, every, where, places)]
        yield from found
        if found or not part.to:
            inside = None
        else:
            lanes = _nodes_of_lanes(part, every)
            if lanes not in reached:
                reached[lanes] = _reached_segments(lanes, region)
            inside = reached[lanes]
        yield from _goal_problems(part, places, where, reached=inside)


def _length_problems(scenario: Scenario, part: VehicleInput, where: str) -> Iterator[Problem]:
    end = scenario.simulation.duration if part.end is None else part.end
    last = part.begin + len(part.volumes) * part.interval
    if part.volumes and last < end:
        message = (
            f"the {len(part.volumes)} volumes of {part.id!r} end at {last:g} s, the input at "
            f"{end:g} s: none come in between"
        )
        yield warning("volumes_too_short", f"{where}.volumes", message)


def _entry_problems(
    part: VehicleInput, every: Sequence[Entry], where: str, places: _Places
) -> Iterator[Problem]:
    mine = entries_of(part, every)
    here = f"{where}.segment"
    if part.segment not in places.known:
        message = (
            f"the map has no segment {part.segment!r}; vehicles can enter on {_list_entries(every)}"
        )
        yield error("unknown_segment", here, message, segments=[part.segment])
    elif not mine:
        way = f" {part.direction}" if part.direction else ""
        message = (
            f"no lane leads{way} into the region of interest on {part.segment!r}; vehicles can "
            f"enter on {_list_entries(every)}"
        )
        yield error("no_entry", here, message, segments=[part.segment])
    elif len(mine) > 1:
        message = f"vehicles can enter {part.segment!r} both ways; give its direction"
        yield error("entry_ambiguous", here, message, segments=[part.segment])
    else:
        known = [lane.lane for lane in mine[0].lanes]
        for row, lane in enumerate(part.lanes):
            if lane not in known:
                message = f"lane {lane} is not among those that enter on {part.segment!r}: {known}"
                yield error("unknown_lane", f"{where}.lanes[{row}]", message)


def _goal_problems(
    part: VehicleInput, places: _Places, where: str, *, reached: frozenset[str] | None
) -> Iterator[Problem]:
    for row, (name, _) in enumerate(part.to):
        here, segments = f"{where}.to[{row}]", places.segments_of(name)
        if not places.has(name):
            message = f"{name!r} is neither a zone nor a segment of the map"
            yield error("unknown_zone", here, message)
        elif not places.reaches_inside(name):
            message = f"{name!r} is outside the region of interest"
            yield error("zone_outside_roi", here, message, segments=segments)
        elif reached is not None and reached.isdisjoint(segments):
            message = f"no way leads from {part.segment!r} to {name!r} inside the region"
            yield error("no_path", here, message, segments=(part.segment, *segments))


def _nodes_of_lanes(part: VehicleInput, every: Sequence[Entry]) -> tuple[int, ...]:
    """First nodes of the lanes of an input."""
    return tuple(
        lane.node for entry in entries_of(part, every) for lane in entry_lanes(part, entry)
    )


def _reached_segments(starts: Iterable[int], region: Region) -> frozenset[str]:
    """Segments that can be reached from any of some nodes."""
    lanes, ids = region.graph.lanes, region.graph.segments.ids
    rows = {
        int(row)
        for start in starts
        for row in set(lanes.segment[region.router.reachable(start)].tolist())
    }
    return frozenset(str(ids[row]) for row in rows)


def _list_entries(every: Sequence[Entry]) -> str:
    names = [f"{entry.segment} ({entry.direction})" for entry in every[:NAMED]]
    more = len(every) - len(names)
    return ", ".join(names) + (f" and {more} more" if more else "") or "no segment"


def demand_problems(scenario: Scenario, region: Region) -> Iterator[Problem]:
    """Yield everything wrong with the demand of a scenario."""
    demand, places = scenario.demand, _Places.of(scenario.demand, region)
    yield from _name_problems(demand, places)
    yield from _zone_problems(demand, places)
    yield from _profile_problems(scenario)
    yield from input_problems(scenario, region)
    yield from route_problems(scenario, region)
    for index, matrix in enumerate(demand.matrices):
        where = f"demand.matrices[{index}]"
        yield from window_problems(scenario, matrix, where)
        yield from limited(matrix_problems(matrix, places, where), most=MOST, where=where)
    for index, counts in enumerate(demand.counts):
        where = f"demand.counts[{index}]"
        yield from limited(counts_problems(counts, region, where), most=MOST, where=where)
    for index, background in enumerate(demand.background):
        where = f"demand.background[{index}]"
        yield from window_problems(scenario, background, where)
        yield from foot_problems(background.mix, background.id, where, "background traffic")


def matrix_problems(matrix: Matrix, places: _Places, where: str) -> Iterator[Problem]:
    """Yield what is wrong with the rows of a matrix."""
    for index, (origin, destination, _) in enumerate(matrix.trips):
        for end, name in enumerate(dict.fromkeys((origin, destination))):
            here = f"{where}.trips[{index}][{end}]"
            if not places.has(name):
                message = f"{name!r} is neither a zone nor a segment of the map"
                yield error("unknown_zone", here, message)
            elif not places.reaches_inside(name):
                message = (
                    f"{name!r} is outside the region of interest; add its segment or drop the row"
                )
                segments = places.segments_of(name)
                yield error("zone_outside_roi", here, message, segments=segments)
    pairs: dict[tuple[str, str], list[int]] = defaultdict(list)
    for index, (origin, destination, _) in enumerate(matrix.trips):
        pairs[origin, destination].append(index)
    for (origin, destination), rows in pairs.items():
        if origin == destination and origin in places.known and origin not in places.zones:
            message = (
                f"trips from segment {origin!r} to itself may end before they leave it; "
                f"give another destination"
            )
            yield warning("trip_to_itself", f"{where}.trips[{rows[0]}]", message)
        if len(rows) > 1:
            message = (
                f"trips from {origin!r} to {destination!r} are given {len(rows)} times; add up"
            )
            yield error("row_twice", f"{where}.trips[{rows[1]}]", message)


def counts_problems(counts: Counts, region: Region, where: str) -> Iterator[Problem]:
    """Yield what is wrong with counts: each on its own, then those that contradict each other."""
    yield from foot_problems(counts.mix, counts.id, where, "counts of vehicles")
    found = [*_place_problems(counts, region, where), *_slice_problems(counts, where)]
    yield from found
    if not found:
        for contradiction in contradictions(counts, region.graph):
            begin, end = contradiction.begin, contradiction.end
            message = f"{begin:g} to {end:g} s: {contradiction.message}; not all can be met"
            segments = dict.fromkeys(
                n for place in contradiction.places for n in place_segments(place)
            )
            yield warning("counts_contradict", where, message, segments=segments)


def _name_problems(demand: Demand, places: _Places) -> Iterator[Problem]:
    for kind in ("zones", "profiles"):
        seen: set[str] = set()
        for index, one in enumerate(getattr(demand, kind)):
            where = f"demand.{kind}[{index}].id"
            if one.id in seen:
                message = f"two {kind} are called {one.id!r}; give one of them another name"
                yield error("duplicate_id", where, message)
            seen.add(one.id)
            if kind == "zones" and one.id in places.known:
                message = f"zone {one.id!r} has the name of a segment; give it another"
                yield error("zone_named_as_segment", where, message)
            if kind == "profiles" and one.id in BUILT_IN:
                message = f"there is a built-in day profile {one.id!r}; give yours another name"
                yield error("duplicate_id", where, message)


def _zone_problems(demand: Demand, places: _Places) -> Iterator[Problem]:
    for index, zone in enumerate(demand.zones):
        for row, name in enumerate(zone.segments):
            if name not in places.known:
                where = f"demand.zones[{index}].segments[{row}]"
                message = f"zone {zone.id!r} has segment {name!r}, which the map does not have"
                yield error("unknown_segment", where, message, segments=[name])


def _profile_problems(scenario: Scenario) -> Iterator[Problem]:
    known = known_profiles(scenario.demand)
    listed = some_of(list(known), most=_LISTED, between=", ")
    users = [(f"flows[{index}]", flow) for index, flow in enumerate(scenario.flows)]
    for where, one in (*users, *scenario.demand.parts):
        profile = getattr(one, "profile", None)
        if profile is not None and profile not in known:
            message = f"{one.id!r} has day profile {profile!r}; there are {listed}"
            yield error("unknown_profile", f"{where}.profile", message)
    for index, own in enumerate(scenario.demand.profiles):
        number = len(own.shares)
        if own.begin is None and 1 < number < _HOURS:
            message = (
                f"the {number} shares of profile {own.id!r} are slices of {_HOURS / number:.3g} h "
                f"each, from midnight on; give begin and end if they are of a part of the day"
            )
            yield warning("profile_over_day", f"demand.profiles[{index}].shares", message)


def _place_problems(counts: Counts, region: Region, where: str) -> Iterator[Problem]:
    known = {str(name) for name in region.graph.segments.ids}
    inside = {str(name) for name in region.segments}
    onwards = transitions(region.graph)
    first_row: dict[str, int] = {}
    for index, row in enumerate(counts.rows):
        first_row.setdefault(row[0], index)
    for place, index in first_row.items():
        here, names = f"{where}.rows[{index}][0]", place_segments(place)
        unknown = [name for name in names if name not in known]
        outside = [name for name in names if name not in inside]
        broken = [pair for pair in pairwise(names) if not _leads_on(onwards, pair)]
        if unknown:
            message = f"place {place!r} has segment {unknown[0]!r}, which the map does not have"
            yield error("unknown_segment", here, message, segments=unknown)
        elif outside:
            message = f"place {place!r} has {outside[0]!r}, which is outside the region of interest"
            yield error("place_outside_roi", here, message, segments=outside)
        elif broken:
            one, other = broken[0]
            message = f"place {place!r}: no lane leads from {one!r} into {other!r}"
            yield error("place_broken", here, message, segments=broken[0])


def _leads_on(onwards: dict[str, set[str]], pair: tuple[str, str]) -> bool:
    return pair[1] in onwards.get(pair[0], ())


def _slice_problems(counts: Counts, where: str) -> Iterator[Problem]:
    begin, end = counts.rows[0][1:3]
    length = end - begin
    rows: dict[tuple[str, float], list[int]] = defaultdict(list)
    for index, (place, start, stop, _) in enumerate(counts.rows):
        offset = (start - begin) / length if length > 0 else 0.5
        if stop <= start or stop - start != length or abs(offset - round(offset)) > 1e-6:
            message = (
                f"the slice from {start:g} to {stop:g} s does not fit that of the first row; "
                f"slices of {counts.id!r} are all as long as each other and follow one another"
            )
            yield error("slice_uneven", f"{where}.rows[{index}]", message)
        rows[place, start].append(index)
    for (place, start), given in rows.items():
        if len(given) > 1:
            listed = some_of([f"{counts.rows[index][3]:g}" for index in given])
            message = (
                f"{place.replace(PLACE_SEPARATOR, ' > ')} from {start:g} s on was counted "
                f"{len(given)} times: {listed}; keep one"
            )
            here = f"{where}.rows[{given[1]}]"
            yield error("counted_twice", here, message, segments=place_segments(place))
