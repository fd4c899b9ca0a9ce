"""The rules for vehicle inputs: an entry where they are, and a way to where they go."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.scenario.checks.window_checks import foot_problems, window_problems
from odscen.scenario.demand.entries import entries, entries_of, entry_lanes
from odscen.scenario.demand.zones import segments_of
from odscen.scenario.document.problems import Problem, error, warning

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from odscen.scenario.demand.entries import Entry
    from odscen.scenario.document.scenario_document import Scenario, VehicleInput
    from odscen.scenario.placing.region import Region

NAMED = 8
"""Entries that a message lists."""


def input_problems(scenario: Scenario, region: Region) -> Iterator[Problem]:
    """Yield everything wrong with the vehicle inputs of a scenario."""
    if not scenario.demand.inputs:
        return
    every = entries(region)
    for index, part in enumerate(scenario.demand.inputs):
        where = f"demand.inputs[{index}]"
        yield from window_problems(scenario, part, where)
        yield from foot_problems(part.mix, part.id, where, "inputs")
        yield from _length_problems(scenario, part, where)
        found = [*_entry_problems(part, every, where, region)]
        yield from found
        yield from _goal_problems(scenario, part, region, where, found=not found)


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
    part: VehicleInput, every: Sequence[Entry], where: str, region: Region
) -> Iterator[Problem]:
    mine = entries_of(part, every)
    here = f"{where}.segment"
    if part.segment not in {str(name) for name in region.graph.segments.ids}:
        message = f"the map has no segment {part.segment!r}; vehicles can enter on {_listed(every)}"
        yield error("unknown_segment", here, message, segments=[part.segment])
    elif not mine:
        way = f" {part.direction}" if part.direction else ""
        message = (
            f"no lane leads{way} into the region of interest on {part.segment!r}; vehicles can "
            f"enter on {_listed(every)}"
        )
        yield error("no_entry", here, message, segments=[part.segment])
    elif len(mine) > 1:
        message = f"vehicles can enter {part.segment!r} both ways; give its direction"
        yield error("entry_ambiguous", here, message, segments=[part.segment])
    else:
        known = [one.lane for one in mine[0].lanes]
        for row, lane in enumerate(part.lanes):
            if lane not in known:
                message = f"lane {lane} is not among those that enter on {part.segment!r}: {known}"
                yield error("unknown_lane", f"{where}.lanes[{row}]", message)


def _goal_problems(
    scenario: Scenario, part: VehicleInput, region: Region, where: str, *, found: bool
) -> Iterator[Problem]:
    zones = {zone.id for zone in scenario.demand.zones}
    ids = [str(name) for name in region.graph.segments.ids]
    inside = {str(name) for name in region.segments}
    reached = _reached_segments(part, region) if found else None
    for row, (name, _) in enumerate(part.to):
        here, segments = f"{where}.to[{row}]", segments_of(scenario.demand, name)
        if name not in zones and name not in ids:
            message = f"{name!r} is neither a zone nor a segment of the map"
            yield error("unknown_zone", here, message)
        elif not inside.intersection(segments):
            message = f"{name!r} is outside the region of interest"
            yield error("zone_outside_roi", here, message, segments=segments)
        elif reached is not None and not reached.intersection(segments):
            message = f"no way leads from {part.segment!r} to {name!r} inside the region"
            yield error("no_path", here, message, segments=(part.segment, *segments))


def _reached_segments(part: VehicleInput, region: Region) -> set[str]:
    """Segments that can be reached from any lane of an input."""
    lanes, ids = region.graph.lanes, region.graph.segments.ids
    rows = {
        int(row)
        for entry in entries_of(part, entries(region))
        for one in entry_lanes(part, entry)
        for row in set(lanes.segment[region.router.reachable(one.node)].tolist())
    }
    return {str(ids[row]) for row in rows}


def _listed(every: Sequence[Entry]) -> str:
    names = [f"{one.segment} ({one.direction})" for one in every[:NAMED]]
    more = len(every) - len(names)
    return ", ".join(names) + (f" and {more} more" if more else "") or "no segment"
