"""What runs show at the targets of a calibration, and which targets nothing can be measured at."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from odscen.base.errors import InputError
from odscen.runs.recorded import trajectory_files
from odscen.scenario.demand.count_stations import Observation, place_points
from odscen.scenario.demand.targets import FLOW, LONGEST_QUEUE, QUEUE, TRAVEL_TIME
from odscen.sumo.realize.passages import seen_passages

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.app.maps import LoadedMap
    from odscen.runs.finished_run import Run
    from odscen.scenario.demand.targets import Target
    from odscen.scenario.document.scenario_document import Scenario

SHORTEST: Final = 60.0
"""Seconds of a slice of travel times and queues, at least."""


class Measured(NamedTuple):
    """What runs show: a value for each target, vehicles of a run, and verdicts that are not good.

    ``passages`` are the vehicles at all flow targets together, mean over the seeds.
    """

    values: tuple[float | None, ...]
    vehicles: float
    passages: float
    verdicts: tuple[str, ...]


def read_values(
    run: Run, targets: Sequence[Target], loaded: LoadedMap
) -> tuple[list[float | None], int]:
    """Read the value of each target from a run, and how many vehicles there were.

    Raises
    ------
    InputError
        If the run has no trajectories.
    """
    import polars as pl

    files = trajectory_files(run.folder)
    if not files:
        raise InputError("the run has no trajectories to measure in", file=str(run.folder))
    seen = [Observation("", t.place, t.begin, t.end, t.value) for t in targets if t.kind == FLOW]
    passages, vehicles = seen_passages(pl.scan_parquet(files), loaded.sumo, seen)
    kinds = {target.kind for target in targets}
    stations = run.stations() if TRAVEL_TIME in kinds else None
    groups = (
        run.figures_by("lane_group", over_time=True) if kinds & {QUEUE, LONGEST_QUEUE} else None
    )
    found: list[float | None] = []
    for target in targets:
        if target.kind == FLOW:
            found.append(float(passages.get((target.place, target.begin, target.end), 0)))
        elif target.kind == TRAVEL_TIME and stations is not None:
            found.append(_read_travel_time(stations, target))
        elif groups is not None:
            found.append(_read_queue(groups, target))
    return found, vehicles


def _read_travel_time(stations: Any, target: Target) -> float | None:
    """Mean over the vehicles that have completed the section in the slice."""
    import polars as pl

    col = pl.col
    rows = stations.filter(
        (col("station") == target.place) & (col("kind") == "section"),
        (col("begin") >= target.begin) & (col("end") <= target.end),
        col("travel_time").is_not_null(),
    )
    number = rows["vehicles"].sum()
    return float((rows["travel_time"] * rows["vehicles"]).sum() / number) if number else None


def _read_queue(groups: Any, target: Target) -> float | None:
    """Of the lane groups of an approach the longest queue: mean over time, or its maximum."""
    import polars as pl

    col = pl.col
    rows = groups.filter(
        (col("begin") >= target.begin) & (col("end") <= target.end),
        col("lane_group").map_elements(
            lambda name: is_group_of(str(name), target.place), return_dtype=pl.Boolean
        ),
    )
    if not rows.height:
        return 0.0  # rows of groups that nobody came to are left out
    if target.kind == LONGEST_QUEUE:
        return float(rows["queue_metres_max"].max() or 0.0)
    lasts = target.end - target.begin
    each = rows.group_by("lane_group").agg(
        (col("queue_metre_seconds").sum() / lasts).alias("queue_metres")
    )
    return float(each["queue_metres"].max() or 0.0)


def is_group_of(lane_group: str, place: str) -> bool:
    """Whether a lane group is the place itself, or one of the approach (``r1>j10``)."""
    return lane_group == place or any(
        movement.startswith(f"{place}>") for movement in lane_group.split(" + ")
    )


def refuse_unknown_places(scenario: Scenario, loaded: LoadedMap, targets: Sequence[Target]) -> None:
    """Refuse targets that no run of the scenario has a value of.

    Raises
    ------
    InputError
        If nothing can be measured at a place, or its time is outside the figures; names it.
    """
    flows = {target.place for target in targets if target.kind == FLOW}
    known = place_points(loaded.sumo.graph, flows)
    sections = {section.id for section in scenario.study.sections}
    begin, end = scenario.study.warm_up, scenario.simulation.duration
    for target in targets:
        if target.kind == FLOW and target.place not in known:
            raise InputError(
                f"{target.place!r} is no count station of the map: give a segment, or segments "
                "that follow each other, as r8>j54>r12",
                element=target.words,
            )
        if target.kind == TRAVEL_TIME and target.place not in sections:
            there = ", ".join(sorted(sections)) or "none"
            raise InputError(
                f"{target.place!r} is no travel-time section of the scenario's study; there are: "
                f"{there}",
                element=target.words,
            )
        if target.kind in (QUEUE, LONGEST_QUEUE):
            approach = ">".join(target.place.split(" + ")[0].split(">")[:2])
            if ">" not in approach or not place_points(loaded.sumo.graph, [approach]):
                raise InputError(
                    f"{target.place!r} is no approach of a junction: give it as r8>j54",
                    element=target.words,
                )
        if target.end > end or (target.kind != FLOW and target.begin < begin):
            raise InputError(
                f"the run has figures from {begin:g} to {end:g} s (after the warm-up of its study)",
                element=target.words,
            )


def common_interval(targets: Sequence[Target]) -> float | None:
    """Longest interval, s, that all slices of travel times and queues are made of.

    ``None`` without any.

    Raises
    ------
    InputError
        If it is shorter than :data:`SHORTEST`, or no whole seconds.
    """
    times = [time for t in targets if t.kind != FLOW for time in (t.begin, t.end)]
    if not times:
        return None
    if any(time % 1.0 for time in times):
        raise InputError("travel times and queues need slices of whole seconds")
    common = float(math.gcd(*(int(time) for time in times)))
    if common < SHORTEST:
        raise InputError(
            f"slices of travel times and queues must be made of intervals of {SHORTEST:g} s at "
            f"least; these have {common:g} s in common"
        )
    return common
