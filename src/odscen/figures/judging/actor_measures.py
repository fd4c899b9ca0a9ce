"""What a criterion can ask of one actor: each measure with its value and its instant.

Where no conflict of an actor was recorded, TTC, PET and DRAC are at the limit of what is recorded,
as those of the run are.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.categories import Category
from odscen.figures.judging.lane_departure import lane_departures
from odscen.figures.measures.conflicts import SEEN_DRAC, SEEN_PET, SEEN_TTC
from odscen.figures.measures.figure import Basis, Better, Figure
from odscen.records.outcomes import ActorStatus
from odscen.records.run_events import EventKind

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    import polars as pl

    from odscen.figures.judging.lane_departure import DrivenLanes
    from odscen.figures.measures.summary import ActorOutcome
    from odscen.records.run_events import Event
    from odscen.scenario.story.road_view import ActorView


class Measured(NamedTuple):
    """A value in the unit of its measure, and when it was so, s; ``None`` without an instant."""

    value: float
    time: float | None = None


@dataclass(frozen=True, slots=True)
class RunRecords:
    """What was recorded of a run, for verdicts on single actors and for instants.

    Attributes
    ----------
    conflicts
        From :func:`odscen.figures.measures.conflicts.conflict_table`; ``None`` if criticality was
        not measured.
    speeds
        ``time`` (s) and ``speed`` (m/s) of an actor by its id, in order of time; ``None`` if no
        trajectory of it was recorded.
    bodies
        ``time`` (s), ``x``, ``y`` (m) and ``hdg`` (rad) of the centre of an actor's body, and its
        ``length`` and ``width`` (m), by its id, in order of time; ``None`` as there.
    lanes
        Lanes of vehicles; ``None`` of a run without a network of SUMO's.
    """

    outcomes: Sequence[ActorOutcome] = ()
    events: Sequence[Event] = ()
    conflicts: pl.DataFrame | None = None
    speeds: Callable[[str], pl.DataFrame | None] = lambda _: None
    bodies: Callable[[str], pl.DataFrame | None] = lambda _: None
    lanes: Callable[[], DrivenLanes | None] = lambda: None


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ActorMeasure(Figure):
    """A measure of one actor; ``compute`` gives ``None`` where the run has not recorded it."""

    compute: Callable[[RunRecords, ActorOutcome], Measured | None]
    basis: Basis = Basis.ACTORS


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PairMeasure(Figure):
    """A measure of one actor and another, by its id: ``NAME(ACTOR,OTHER)``."""

    compute: Callable[[RunRecords, ActorOutcome, str], Measured | None]
    basis: Basis = Basis.ACTORS


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RuleMeasure(Figure):
    """A measure of a rule, by its id: ``NAME(RULE)``."""

    compute: Callable[[RunRecords, str], Measured | None]
    basis: Basis = Basis.ACTORS


def first_event(records: RunRecords, kind: EventKind, actor: str | None = None) -> float | None:
    """When such an event came first, of one actor or of any; s."""
    return next(
        (
            event.time
            for event in records.events
            if event.kind is kind and (actor is None or actor in (event.actor, event.partner))
        ),
        None,
    )


def worst_conflict(
    conflicts: pl.DataFrame | None, measure: str, actor: str | None = None
) -> Measured | None:
    """Worst value of ``ttc``, ``pet`` or ``drac`` and the begin of its conflict.

    The limit of what is recorded if there is none; ``None`` if criticality was not measured.
    """
    import polars as pl

    if conflicts is None:
        return None
    known = conflicts.filter(pl.col(measure).is_not_null())
    if actor is not None:
        known = known.filter((pl.col("one") == actor) | (pl.col("other") == actor))
    highest = measure == "drac"
    limit = {"ttc": SEEN_TTC, "pet": SEEN_PET, "drac": SEEN_DRAC}[measure]
    if known.is_empty():
        return Measured(limit)
    row = known.sort(measure, "begin", descending=[highest, False]).row(0, named=True)
    return Measured(float(row[measure]), float(row["begin"]))


def _measure_arrival(_: RunRecords, outcome: ActorOutcome) -> Measured:
    return Measured(float(outcome.status is ActorStatus.ARRIVED), outcome.arrived)


def _count_measure(name: str, kind: EventKind) -> Callable[[RunRecords, ActorOutcome], Measured]:
    return lambda records, outcome: Measured(
        float(getattr(outcome, name)), first_event(records, kind, outcome.id)
    )


def _make_outcome_measure(name: str) -> Callable[[RunRecords, ActorOutcome], Measured | None]:
    def found(_: RunRecords, outcome: ActorOutcome) -> Measured | None:
        value = getattr(outcome, name)
        return None if value is None else Measured(float(value), outcome.arrived)

    return found


def _conflict_measure(measure: str) -> Callable[[RunRecords, ActorOutcome], Measured | None]:
    def found(records: RunRecords, outcome: ActorOutcome) -> Measured | None:
        if outcome.inserted is None:
            return None
        return worst_conflict(records.conflicts, measure, outcome.id)

    return found


def _top_speed(records: RunRecords, outcome: ActorOutcome) -> Measured | None:
    trace = records.speeds(outcome.id)
    if trace is None or trace.is_empty():
        return None
    row = trace.sort("speed", "time", descending=[True, False]).row(0, named=True)
    return Measured(float(row["speed"]), float(row["time"]))


def _measure_impacts(
    name: str, *, first: bool
) -> Callable[[RunRecords, ActorOutcome], Measured | None]:
    """The first or the largest value of an actor's collisions; without any 0, or nothing."""

    def found(records: RunRecords, outcome: ActorOutcome) -> Measured | None:
        hits = [
            event
            for event in records.events
            if event.kind is EventKind.COLLISION and outcome.id in (event.actor, event.partner)
        ]
        known = [
            Measured(event.values[name], event.time)
            for event in hits
            if event.values is not None and name in event.values
        ]
        if not hits and not first:
            return Measured(0.0)
        if not known:  # SUMO says of those that it has found neither speed nor place
            return None
        return known[0] if first else max(known, key=lambda moment: moment.value)

    return found


_STOPPED = 0.1
"""m/s."""
_SPAN = 0.5
"""Seconds over which accelerations are means where their change is asked for."""


def _highest_deceleration(records: RunRecords, outcome: ActorOutcome) -> Measured | None:
    trace = records.speeds(outcome.id)
    if trace is None or trace.height < 2:
        return None
    times, speeds = (trace.sort("time")[name].to_numpy() for name in ("time", "speed"))
    lost = -np.diff(speeds) / np.diff(times)
    row = int(np.argmax(lost))
    return Measured(max(0.0, float(lost[row])), float(times[row + 1]))


def _highest_jerk(records: RunRecords, outcome: ActorOutcome) -> Measured | None:
    trace = records.speeds(outcome.id)
    if trace is None or trace.height < 3:
        return None
    times, speeds = (trace.sort("time")[name].to_numpy() for name in ("time", "speed"))
    rows = max(1, round(_SPAN / float(np.median(np.diff(times)))))
    if len(times) <= 2 * rows:
        return None
    span = times[rows:] - times[:-rows]
    gained = (speeds[rows:] - speeds[:-rows]) / span
    jerks = np.abs(gained[rows:] - gained[:-rows]) / span[rows:]
    row = int(np.argmax(jerks))
    return Measured(float(jerks[row]), float(times[row + rows]))


def _comes_to_standstill(records: RunRecords, outcome: ActorOutcome) -> Measured | None:
    trace = records.speeds(outcome.id)
    if trace is None or trace.is_empty():
        return None
    times, speeds = (trace.sort("time")[name].to_numpy() for name in ("time", "speed"))
    moved = np.maximum.accumulate(speeds >= _STOPPED)
    stood = np.flatnonzero(moved & (speeds < _STOPPED))
    return Measured(1.0, float(times[stood[0]])) if stood.size else Measured(0.0)


def _furthest_departure(records: RunRecords, outcome: ActorOutcome) -> Measured | None:
    bodies, lanes = records.bodies(outcome.id), records.lanes()
    if bodies is None or lanes is None or outcome.category == Category.PEDESTRIAN:
        return None
    found = lane_departures(bodies, lanes)
    if not found:
        return None
    beyond = np.array([moment.beyond for moment in found])
    furthest = int(beyond.argmax())
    if beyond[furthest] <= 0.0:
        return Measured(0.0)
    before = np.flatnonzero(beyond[:furthest] <= 0.0)
    begin = int(before[-1]) + 1 if before.size else 0
    return Measured(float(beyond[furthest]), found[begin].time)


def _shortest_distance(records: RunRecords, outcome: ActorOutcome, other: str) -> Measured | None:
    from odscen.scenario.story.condition_kinds import body_distance

    own, its = records.bodies(outcome.id), records.bodies(other)
    if own is None or its is None:
        return None
    best = Measured(math.inf)
    for one, two in _bodies_at_once(own, its):
        least = (
            math.dist((one.x, one.y), (two.x, two.y)) - _measure_reach(one) - _measure_reach(two)
        )
        if least < best.value and (away := body_distance(one, two)) < best.value:
            best = Measured(away, one.standing)
    return best if best.value < math.inf else None


def _gap_when_stopped(records: RunRecords, outcome: ActorOutcome, other: str) -> Measured | None:
    import polars as pl

    from odscen.scenario.story.condition_kinds import body_distance

    own, its, speeds = records.bodies(outcome.id), records.bodies(other), records.speeds(outcome.id)
    if own is None or its is None or speeds is None:
        return None
    trace = speeds.sort("time")
    moved = trace.filter(pl.col("speed") >= _STOPPED)
    if moved.is_empty():
        return None
    stood = trace.filter((pl.col("speed") < _STOPPED) & (pl.col("time") > moved["time"][0]))
    best: Measured | None = None
    for one, two in _bodies_at_once(own.join(stood.select("time"), on="time"), its):
        ahead = (two.x - one.x) * math.cos(one.hdg) + (two.y - one.y) * math.sin(one.hdg)
        if ahead <= one.length / 2.0:  # it is past the other one's front, or beside it
            continue
        away = body_distance(one, two)
        if best is None or away < best.value:
            best = Measured(away, one.standing)
    return best


def _measure_reach(body: ActorView) -> float:
    return math.hypot(body.length, body.width) / 2.0


def _bodies_at_once(own: pl.DataFrame, its: pl.DataFrame) -> Iterator[tuple[ActorView, ActorView]]:
    """Both bodies at the instants at which both were there, which is ``standing`` of them."""
    for row in own.join(its, on="time", suffix="_other").sort("time").iter_rows(named=True):
        yield (
            _body_of_row(row, ""),
            _body_of_row(row, "_other"),
        )


def _body_of_row(row: Mapping[str, float], suffix: str) -> ActorView:
    from odscen.scenario.story.road_view import ActorView

    x, y, hdg, length, width = (
        row[f"{name}{suffix}"] for name in ("x", "y", "hdg", "length", "width")
    )
    return ActorView(
        "", x, y, hdg, 0.0, 0.0, length, width, 0.0, person=False, standing=row["time"]
    )


def _rule_instant(records: RunRecords, rule: str) -> float | None:
    return next(
        (
            event.time
            for event in records.events
            if event.kind is EventKind.RULE_STARTED and event.rule == rule
        ),
        None,
    )


def _has_fired(records: RunRecords, rule: str) -> Measured:
    time = _rule_instant(records, rule)
    return Measured(float(time is not None), time)


def _fired_at(records: RunRecords, rule: str) -> Measured | None:
    time = _rule_instant(records, rule)
    return None if time is None else Measured(time, time)


_SSM = "FHWA-RD-03-050; SUMO's SSM device"

ACTOR_MEASURES: tuple[ActorMeasure, ...] = (
    ActorMeasure(
        name="arrived",
        unit="",
        label="goal reached",
        definition="1 if the actor reached its goal, 0 if not.",
        source="events",
        better=Better.HIGHER,
        compute=_measure_arrival,
    ),
    ActorMeasure(
        name="collided",
        unit="",
        label="collisions",
        definition="How many times the actor collided.",
        source="events",
        better=Better.LOWER,
        compute=_count_measure("collisions", EventKind.COLLISION),
    ),
    ActorMeasure(
        name="emergency_stopped",
        unit="",
        label="emergency stops",
        definition="How many times the actor braked harder than it comfortably can.",
        source="events",
        better=Better.LOWER,
        compute=_count_measure("emergency_stops", EventKind.EMERGENCY_STOP),
    ),
    ActorMeasure(
        name="teleported",
        unit="",
        label="teleports",
        definition="How many times SUMO teleported the actor.",
        source="events",
        better=Better.LOWER,
        compute=_count_measure("teleports", EventKind.TELEPORT_START),
    ),
    ActorMeasure(
        name="min_ttc",
        unit="s",
        label="shortest time to collision (TTC)",
        definition="Shortest time to collision of the actor with a vehicle; 3 s at most.",
        source=_SSM,
        better=Better.HIGHER,
        basis=Basis.CONFLICTS,
        compute=_conflict_measure("ttc"),
    ),
    ActorMeasure(
        name="min_pet",
        unit="s",
        label="shortest post-encroachment time (PET)",
        definition="Shortest post-encroachment time of the actor with any road user; 3 s at most.",
        source=_SSM,
        better=Better.HIGHER,
        basis=Basis.CONFLICTS,
        compute=_conflict_measure("pet"),
    ),
    ActorMeasure(
        name="max_drac",
        unit="m/s2",
        label="highest deceleration to avoid a crash (DRAC)",
        definition="Highest deceleration to avoid a crash with a vehicle; 3 m/s\u00b2 at least.",
        source=_SSM,
        better=Better.LOWER,
        basis=Basis.CONFLICTS,
        compute=_conflict_measure("drac"),
    ),
    ActorMeasure(
        name="max_speed",
        unit="m/s",
        label="highest speed",
        definition="Highest recorded speed of the actor.",
        source="trajectories",
        compute=_top_speed,
    ),
    ActorMeasure(
        name="mean_speed",
        unit="m/s",
        label="mean speed",
        definition="Route length over travel time, of an actor that arrived.",
        source="events",
        better=Better.HIGHER,
        compute=_make_outcome_measure("mean_speed"),
    ),
    ActorMeasure(
        name="travel_time",
        unit="s",
        label="travel time",
        definition="Time from insertion to arrival.",
        source="events",
        better=Better.LOWER,
        compute=_make_outcome_measure("travel_time"),
    ),
    ActorMeasure(
        name="delay",
        unit="s",
        label="delay",
        definition="Time lost below the desired speed, of an actor that arrived.",
        source="SUMO tripinfo, timeLoss",
        better=Better.LOWER,
        compute=_make_outcome_measure("delay"),
    ),
    ActorMeasure(
        name="waiting_time",
        unit="s",
        label="stopped delay",
        definition="Time that the actor was below 0.1 m/s.",
        source="SUMO tripinfo, waitingTime",
        better=Better.LOWER,
        compute=_make_outcome_measure("waiting_time"),
    ),
    ActorMeasure(
        name="impact_speed",
        unit="m/s",
        label="impact speed",
        definition="Highest speed of the actor and whom it collided with to each other; 0 without.",
        source="events",
        better=Better.LOWER,
        compute=_measure_impacts("impact_speed", first=False),
    ),
    ActorMeasure(
        name="impact_overlap",
        unit="",
        label="overlap at impact",
        definition="Share of the width of who hits that the other one is in front of, first time.",
        source="events",
        compute=_measure_impacts("overlap", first=True),
    ),
    ActorMeasure(
        name="stopped",
        unit="",
        label="came to a standstill",
        definition="1 if the actor, once under way, was below 0.1 m/s; 0 if not.",
        source="trajectories",
        compute=_comes_to_standstill,
    ),
    ActorMeasure(
        name="max_deceleration",
        unit="m/s2",
        label="highest deceleration",
        definition="Highest loss of speed from one record to the next, over the time between.",
        source="trajectories",
        better=Better.LOWER,
        compute=_highest_deceleration,
    ),
    ActorMeasure(
        name="max_jerk",
        unit="m/s3",
        label="highest jerk",
        definition="Highest change of acceleration per second, of means over half a second.",
        source="trajectories",
        better=Better.LOWER,
        compute=_highest_jerk,
    ),
    ActorMeasure(
        name="lane_departure",
        unit="m",
        label="lane departure",
        definition="How far the body of a vehicle was beyond the border of its lane, at most.",
        source="trajectories; lanes of the SUMO network",
        better=Better.LOWER,
        compute=_furthest_departure,
    ),
)
"""In the order in which they are offered."""

_BY_NAME = {measure.name: measure for measure in ACTOR_MEASURES}
ACTOR_NAMES = tuple(_BY_NAME)


PAIR_MEASURES = (
    PairMeasure(
        name="min_distance",
        unit="m",
        label="shortest distance",
        definition="Shortest distance between the bodies of two actors; 0 where they touch.",
        source="trajectories",
        better=Better.HIGHER,
        compute=_shortest_distance,
    ),
    PairMeasure(
        name="stopped_before",
        unit="m",
        label="gap when stopped",
        definition="Least distance between the bodies while the actor, once under way, is below "
        "0.1 m/s with the other one ahead of its front; not met if that never was so.",
        source="trajectories",
        better=Better.HIGHER,
        compute=_gap_when_stopped,
    ),
)
RULE_MEASURES = (
    RuleMeasure(
        name="fired",
        unit="",
        label="firing",
        definition="1 if a rule has fired, 0 if not.",
        source="events",
        compute=_has_fired,
    ),
    RuleMeasure(
        name="fired_at",
        unit="s",
        label="instant of firing",
        definition="When a rule has first fired, of one that has.",
        source="events",
        compute=_fired_at,
    ),
)
Measure = ActorMeasure | PairMeasure | RuleMeasure


def measure_of(name: str, about: str) -> Measure | None:
    """Measure of what is written in brackets: two ids with a comma, or the id of one or a rule."""
    if "," in about:
        return next((measure for measure in PAIR_MEASURES if measure.name == name), None)
    return actor_measure(name) or next(
        (measure for measure in RULE_MEASURES if measure.name == name), None
    )


def actor_measure(name: str) -> ActorMeasure | None:
    """Look up a measure of actors; ``None`` if there is none of this name."""
    return _BY_NAME.get(name)
