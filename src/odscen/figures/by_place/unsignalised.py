"""Capacity of lane groups without lights, by interval, from what was driven.

The formulas are HCM's (:mod:`odscen.figures.by_place.gap_acceptance`,
:mod:`odscen.figures.by_place.all_way_stop`); flows are those of the run: of each connection the
vehicles that entered by it, in the interval in which they would have come to the line without
control delay. Lanes that several movements share carry them in the shares in which it was driven.

A run is a field study as well. So a lane whose queue did not clear in an interval has the capacity
that was seen, the vehicles that left it; and none has less than those.
"""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass
from typing import TYPE_CHECKING

from odscen.figures.by_place.all_way_stop import (
    FROM_LEFT,
    FROM_RIGHT,
    OPPOSING,
    Relations,
    StopLane,
    all_way_capacities,
)
from odscen.figures.by_place.analysis_times import begins_at
from odscen.figures.by_place.capacity import HELD, shared_lanes
from odscen.figures.by_place.facilities import Facility, movement_facilities
from odscen.figures.by_place.gap_acceptance import (
    LEFT,
    RIGHT,
    THROUGH,
    Stream,
    as_cars,
    entry_capacity,
    two_way_capacities,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import polars as pl

    from odscen.figures.by_place.facilities import NetFacts
    from odscen.figures.by_place.lane_groups import LaneGroups
    from odscen.figures.by_place.lane_places import LanePlaces

_TURNS = {"l": LEFT, "L": LEFT, "t": LEFT, "r": RIGHT, "R": RIGHT}
"""SUMO's letters of directions; turnarounds wait as those do who turn left."""
_FULL = 0.95
"""Share of an interval with a queue from which it did not clear."""
_SIDE = math.pi / 4
"""Radians from straight ahead within which another approach is the opposing one."""


@dataclass(frozen=True, slots=True)
class _Way:
    """A connection that is not at a light."""

    stream: Stream
    facility: str
    onto_ring: bool


def unsignalised_sums(
    passed: pl.DataFrame,
    groups: LaneGroups,
    places: LanePlaces,
    facts: NetFacts,
    clock: pl.DataFrame,
) -> pl.DataFrame:
    """Capacity of lane groups at stop and yield signs and roundabouts, vehicles by interval.

    Parameters
    ----------
    passed
        From :func:`odscen.figures.by_place.control_delay.vehicle_passages`.
    clock
        ``begin`` and ``end`` of each interval, s.

    Returns
    -------
    ``lane_group``, ``begin``, ``capacity``. Groups that give way to none are not in it, nor are
    junctions that no vehicle entered in the interval.
    """
    import polars as pl

    # Of no other lane groups than those of the map, which are made once as well.
    ways = facts.once("unlit_ways", places, lambda: _find_unsignalised_ways(groups, places, facts))
    outer = facts.once("outer_lanes", places, lambda: _outer_lanes(groups, facts))
    bearings = facts.once("bearings", places, lambda: _approach_bearings(groups, places, facts))
    junctions = dict(groups.ways.select("via", "junction").rows())
    flows = _measure_flows(passed, facts, clock)
    found = []
    for (begin, seconds), rows in _flows_by_interval(flows, clock):
        driven: dict[str, dict[str, _Way]] = defaultdict(dict)
        for junction in sorted({junctions[via] for via in rows if via in ways}):
            driven[junction] = {}
        for via, way in ways.items():
            if junctions[via] in driven:
                flow, heavy = rows.get(via, (0.0, 0.0))
                stream = way.stream._replace(flow=flow, heavy=heavy)
                driven[junctions[via]][via] = _Way(stream, way.facility, way.onto_ring)
        for row in driven.values():
            for via, hourly in _compute_capacities(row, outer, bearings).items():
                found.append((via, begin, hourly * seconds / 3600.0))
    schema = {"via": pl.String, "begin": pl.Float64, "capacity": pl.Float64}
    by_way = pl.DataFrame(found, schema=schema, orient="row").sort("via", "begin")
    yielding = [via for via, way in ways.items() if way.facility != Facility.MAJOR.value]
    some = groups.ways.filter(pl.col("via").is_in(yielding)).select("lane_group").unique()
    lanes = shared_lanes(by_way, passed, groups).join(some, on="lane_group", how="semi")
    seen = _queue_observations(passed, groups, clock)
    return (
        lanes.join(seen, on=("source", "begin"), how="left")
        .with_columns(served=pl.col("served").fill_null(0))
        .with_columns(
            capacity=pl.when(pl.col("full").fill_null(value=False))
            .then("served")
            .otherwise(pl.max_horizontal("capacity", "served"))
        )
        .group_by("lane_group", "begin")
        .agg(pl.col("capacity").sum())
        .sort("lane_group", "begin")
    )


def _find_unsignalised_ways(
    groups: LaneGroups, places: LanePlaces, facts: NetFacts
) -> dict[str, _Way]:
    """Connections that are not at lights, without flows, by ``via``."""
    import polars as pl

    kinds = movement_facilities(places, facts).filter(pl.col("facility") != Facility.SIGNAL.value)
    approaches = places.ways.filter(pl.col("via") == pl.col("lane")).select("via", "approach")
    rows = (
        groups.ways.join(approaches.unique("via"), on="via")
        .join(kinds.drop("junction"), on=("movement", "approach"))
        .join(facts.links, on="via")
        .sort("via")
    )
    ways = {}
    for row in rows.iter_rows(named=True):
        ends = str(row["movement"]).split(">")
        stream = Stream(
            via=row["via"], lane=row["source"], approach=row["approach"], road=ends[0],
            onto=ends[-1], turn=_TURNS.get(row["turn"], THROUGH),
            yields_to=frozenset(row["yields_to"]), flow=0.0,
        )  # fmt: skip
        ways[stream.via] = _Way(stream, row["facility"], bool(row["onto_ring"]))
    return ways


def _measure_flows(passed: pl.DataFrame, facts: NetFacts, clock: pl.DataFrame) -> pl.DataFrame:
    """``begin``, ``via``, ``number`` of vehicles and ``heavy``, the share of trucks and buses."""
    import polars as pl

    some = passed.drop_nulls("movement")
    due = some["time"] - some["before"]
    return (
        some.select("id", "lane", begins_at(due, clock))
        .drop_nulls("begin")
        .join(facts.drivers.select("id", "heavy"), on="id", how="left")
        .group_by("begin", via="lane")
        .agg(number=pl.len(), heavy=pl.col("heavy").cast(pl.Float64).mean().fill_null(0.0))
        .sort("begin", "via")
    )


def _flows_by_interval(
    flows: pl.DataFrame, clock: pl.DataFrame
) -> list[tuple[tuple[float, float], dict[str, tuple[float, float]]]]:
    """Begin and length of each interval with vehicles, and what entered, an hour, by ``via``."""
    length = {begin: end - begin for begin, end in clock.select("begin", "end").rows()}
    found: dict[float, dict[str, tuple[float, float]]] = {}
    for begin, via, number, heavy in flows.select("begin", "via", "number", "heavy").rows():
        found.setdefault(begin, {})[via] = number * 3600.0 / length[begin], heavy
    return [((begin, length[begin]), rows) for begin, rows in found.items()]


def _compute_capacities(
    ways: Mapping[str, _Way], outer: Mapping[str, bool], bearings: Mapping[str, float]
) -> dict[str, float]:
    """Vehicles an hour of each connection of one junction."""
    streams = [way.stream for way in ways.values()]
    found = two_way_capacities(streams)
    stops = {via for via, way in ways.items() if way.facility == Facility.ALL_WAY_STOP.value}
    if stops:
        lanes = _stop_lanes([ways[via].stream for via in sorted(stops)])
        at_line = all_way_capacities(lanes, _relate_approaches(lanes, bearings))
        found |= {via: at_line[ways[via].stream.lane] for via in stops}
    entries = [way for way in ways.values() if way.facility == Facility.ROUNDABOUT.value]
    for entry in entries:
        found[entry.stream.via] = _roundabout_entry_capacity(entry.stream, ways, outer)
    return found


def _roundabout_entry_capacity(
    stream: Stream, ways: Mapping[str, _Way], outer: Mapping[str, bool]
) -> float:
    """Vehicles an hour that a lane can carry into a roundabout."""
    streams = [way.stream for way in ways.values()]
    before = [other for other in streams if other.via in stream.yields_to]
    beside = {
        via
        for way in ways.values()
        if way.stream.approach == stream.approach
        for via in way.stream.yields_to
    }
    own = [other for other in streams if other.lane == stream.lane]
    trucks = sum(other.flow * other.heavy for other in own)
    flow = sum(other.flow for other in own)
    cars = entry_capacity(
        sum(as_cars(other.flow, other.heavy) for other in before),
        lanes=len({other.lane for other in streams if other.approach == stream.approach}),
        around=len({other.lane for other in streams if other.via in beside}),
        outer=outer.get(stream.lane, True),
    )
    return cars / as_cars(1.0, trucks / flow if flow else 0.0)


def _stop_lanes(streams: Sequence[Stream]) -> list[StopLane]:
    of_lane: dict[str, list[Stream]] = defaultdict(list)
    for stream in streams:
        of_lane[stream.lane].append(stream)
    lanes = []
    for lane, ones in sorted(of_lane.items()):
        flow = sum(stream.flow for stream in ones)
        shares = {
            turn: sum(stream.flow for stream in ones if stream.turn == turn) / flow if flow else 0.0
            for turn in (LEFT, RIGHT)
        }
        heavy = sum(stream.flow * stream.heavy for stream in ones) / flow if flow else 0.0
        lanes.append(
            StopLane(
                lane, ones[0].approach, flow, left=shares[LEFT], right=shares[RIGHT], heavy=heavy
            )
        )
    return lanes


def _relate_approaches(lanes: Sequence[StopLane], bearings: Mapping[str, float]) -> Relations:
    """From where vehicles of other approaches come, by the directions in which they drive."""
    approaches = sorted({lane.approach for lane in lanes})
    found: Relations = {approach: {} for approach in approaches}
    for approach in approaches:
        for other in approaches:
            if other != approach:
                turned = (bearings[other] - bearings[approach]) % (2 * math.pi)
                side = FROM_RIGHT if turned < math.pi else FROM_LEFT
                opposing = abs(turned - math.pi) <= _SIDE
                found[approach][other] = OPPOSING if opposing else side
    return found


def _approach_bearings(groups: LaneGroups, places: LanePlaces, facts: NetFacts) -> dict[str, float]:
    """Direction in which each approach comes to its line, radians, SUMO's frame."""
    approaches = dict(
        places.ways.filter(places.ways["via"] == places.ways["lane"])
        .select("source", "approach")
        .rows()
    )
    found: dict[str, float] = {}
    for lane in sorted(set(groups.ways["source"].to_list())):
        shape = facts.shapes.get(lane)
        if shape is not None and len(shape) > 1:
            x, y = (shape[-1] - shape[-2]).tolist()
            found.setdefault(approaches[lane], math.atan2(y, x))
    return found


def _outer_lanes(groups: LaneGroups, facts: NetFacts) -> dict[str, bool]:
    """Whether a lane is the outermost of its approach: SUMO lists lanes from there inwards."""
    lanes = facts.limits.join(groups.ways, left_on="lane", right_on="source", how="semi")
    first = set(lanes.unique("edge", keep="first", maintain_order=True)["lane"])
    return {lane: lane in first for lane in lanes["lane"]}


def _queue_observations(
    passed: pl.DataFrame, groups: LaneGroups, clock: pl.DataFrame
) -> pl.DataFrame:
    """``source``, ``begin``, vehicles ``served``, and whether the queue was there all the time."""
    import polars as pl

    lanes = dict(groups.ways.select("via", "source").rows())
    lanes |= {lane: lane for lane in lanes.values()}
    rows: dict[str, list[tuple[float, float, bool]]] = defaultdict(list)
    for lane, time, before, entered in passed.select(
        "lane", "time", "before", entered=pl.col("movement").is_not_null()
    ).rows():
        if lane in lanes:
            rows[lanes[lane]].append((time - before + HELD, time, entered))
    found = []
    spans_of_time = clock.select("begin", "end").rows()
    for lane, ones in sorted(rows.items()):
        for begin, end in spans_of_time:
            spans = [(max(a, begin), min(b, end)) for a, b, _ in ones if a < end and b > begin]
            served = sum(entered and begin <= time < end for _, time, entered in ones)
            found.append((lane, begin, served, _covered_seconds(spans) >= _FULL * (end - begin)))
    schema = {
        "source": pl.String, "begin": pl.Float64, "served": pl.Int64, "full": pl.Boolean,
    }  # fmt: skip
    return pl.DataFrame(found, schema=schema, orient="row")


def _covered_seconds(spans: Sequence[tuple[float, float]]) -> float:
    """Seconds that are in one of the spans or more."""
    total, until = 0.0, -math.inf
    for begin, end in sorted(spans):
        total += max(0.0, end - max(begin, until))
        until = max(until, end)
    return total
