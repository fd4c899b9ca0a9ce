"""The rules for demand: zones, profiles, matrices, counts and background traffic on their map."""

from __future__ import annotations

from collections import Counter, defaultdict
from itertools import pairwise
from typing import TYPE_CHECKING

from odscen.base.shown import some_of
from odscen.scenario.checks.demand_route_checks import route_problems
from odscen.scenario.checks.input_checks import input_problems
from odscen.scenario.checks.window_checks import foot_problems, window_problems
from odscen.scenario.demand.count_stations import contradictions, transitions
from odscen.scenario.demand.day_profiles import BUILT_IN, known_profiles
from odscen.scenario.demand.zones import PLACE_SEPARATOR, place_segments, segments_of
from odscen.scenario.document.problems import Problem, error, warning

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from odscen.scenario.document.scenario_document import Counts, Demand, Matrix, Scenario
    from odscen.scenario.placing.region import Region

MOST = 20
"""Rows of a table that are named one by one; the rest are counted."""


def demand_problems(scenario: Scenario, region: Region) -> Iterator[Problem]:
    """Yield everything wrong with the demand of a scenario."""
    demand = scenario.demand
    yield from _name_problems(demand, region)
    yield from _zone_problems(demand, region)
    yield from _profile_problems(scenario)
    yield from input_problems(scenario, region)
    yield from route_problems(scenario, region)
    for index, matrix in enumerate(demand.matrices):
        where = f"demand.matrices[{index}]"
        yield from window_problems(scenario, matrix, where)
        yield from _limited(matrix_problems(demand, matrix, region, where), where)
    for index, counts in enumerate(demand.counts):
        where = f"demand.counts[{index}]"
        yield from _limited(counts_problems(counts, region, where), where)
    for index, background in enumerate(demand.background):
        where = f"demand.background[{index}]"
        yield from window_problems(scenario, background, where)
        yield from foot_problems(background.mix, background.id, where, "background traffic")


def matrix_problems(
    demand: Demand, matrix: Matrix, region: Region, where: str
) -> Iterator[Problem]:
    """Yield what is wrong with the rows of a matrix."""
    zones = {zone.id for zone in demand.zones}
    known = {str(name) for name in region.graph.segments.ids}
    inside = {str(name) for name in region.segments}
    for index, (origin, destination, _) in enumerate(matrix.trips):
        for end, name in enumerate(dict.fromkeys((origin, destination))):
            here = f"{where}.trips[{index}][{end}]"
            if name not in zones and name not in known:
                message = f"{name!r} is neither a zone nor a segment of the map"
                yield error("unknown_zone", here, message)
            elif not inside.intersection(segments_of(demand, name)):
                message = (
                    f"{name!r} is outside the region of interest; add its segment or drop the row"
                )
                yield error("zone_outside_roi", here, message, segments=segments_of(demand, name))
    pairs: dict[tuple[str, str], list[int]] = defaultdict(list)
    for index, (origin, destination, _) in enumerate(matrix.trips):
        pairs[origin, destination].append(index)
    for (origin, destination), rows in pairs.items():
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
        for one in contradictions(counts, region.graph):
            message = f"{one.begin:g} to {one.end:g} s: {one.message}; not all can be met"
            segments = dict.fromkeys(n for place in one.places for n in place_segments(place))
            yield warning("counts_contradict", where, message, segments=segments)


def _name_problems(demand: Demand, region: Region) -> Iterator[Problem]:
    segments = {str(name) for name in region.graph.segments.ids}
    for kind in ("zones", "profiles"):
        seen: set[str] = set()
        for index, one in enumerate(getattr(demand, kind)):
            where = f"demand.{kind}[{index}].id"
            if one.id in seen:
                message = f"two {kind} are called {one.id!r}; give one of them another name"
                yield error("duplicate_id", where, message)
            seen.add(one.id)
            if kind == "zones" and one.id in segments:
                message = f"zone {one.id!r} has the name of a segment; give it another"
                yield error("zone_named_as_segment", where, message)
            if kind == "profiles" and one.id in BUILT_IN:
                message = f"there is a built-in day profile {one.id!r}; give yours another name"
                yield error("duplicate_id", where, message)


def _zone_problems(demand: Demand, region: Region) -> Iterator[Problem]:
    known = {str(name) for name in region.graph.segments.ids}
    for index, zone in enumerate(demand.zones):
        for row, name in enumerate(zone.segments):
            if name not in known:
                where = f"demand.zones[{index}].segments[{row}]"
                message = f"zone {zone.id!r} has segment {name!r}, which the map does not have"
                yield error("unknown_segment", where, message, segments=[name])


def _profile_problems(scenario: Scenario) -> Iterator[Problem]:
    known = known_profiles(scenario.demand)
    users = [(f"flows[{index}]", flow) for index, flow in enumerate(scenario.flows)]
    for where, one in (*users, *scenario.demand.parts):
        profile = getattr(one, "profile", None)
        if profile is not None and profile not in known:
            message = f"{one.id!r} has day profile {profile!r}; there are {', '.join(known)}"
            yield error("unknown_profile", f"{where}.profile", message)


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
        broken = [pair for pair in pairwise(names) if not _leads(onwards, pair)]
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


def _leads(onwards: dict[str, set[str]], pair: tuple[str, str]) -> bool:
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


def _limited(problems: Iterable[Problem], where: str) -> Iterator[Problem]:
    """Yield the first problems of each kind, and how many more there are."""
    seen: Counter[tuple[str, str]] = Counter()
    for problem in problems:
        key = problem.severity, problem.code
        seen[key] += 1
        if seen[key] <= MOST:
            yield problem
    for (severity, code), number in seen.items():
        if number > MOST:
            make = error if severity == "error" else warning
            yield make(code, where, f"{number - MOST} more of the same kind")
