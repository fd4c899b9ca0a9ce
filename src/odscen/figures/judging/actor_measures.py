"""What a criterion can ask of one actor: each measure with its value and its instant.

Where no conflict of an actor was recorded, TTC, PET and DRAC are at the limit of what is recorded,
as those of the run are.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from odscen.figures.measures.conflicts import SEEN_DRAC, SEEN_PET, SEEN_TTC
from odscen.figures.measures.figure import Basis, Better, Figure
from odscen.records.outcomes import ActorStatus
from odscen.records.run_events import EventKind

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import polars as pl

    from odscen.figures.measures.summary import ActorOutcome
    from odscen.records.run_events import Event


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
    """

    outcomes: Sequence[ActorOutcome] = ()
    events: Sequence[Event] = ()
    conflicts: pl.DataFrame | None = None
    speeds: Callable[[str], pl.DataFrame | None] = lambda _: None


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ActorMeasure(Figure):
    """A measure of one actor; ``compute`` gives ``None`` where the run has not recorded it."""

    compute: Callable[[RunRecords, ActorOutcome], Measured | None]
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


def _of_outcome(name: str) -> Callable[[RunRecords, ActorOutcome], Measured | None]:
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
        compute=_of_outcome("mean_speed"),
    ),
    ActorMeasure(
        name="travel_time",
        unit="s",
        label="travel time",
        definition="Time from insertion to arrival.",
        source="events",
        better=Better.LOWER,
        compute=_of_outcome("travel_time"),
    ),
    ActorMeasure(
        name="delay",
        unit="s",
        label="delay",
        definition="Time lost below the desired speed, of an actor that arrived.",
        source="SUMO tripinfo, timeLoss",
        better=Better.LOWER,
        compute=_of_outcome("delay"),
    ),
    ActorMeasure(
        name="waiting_time",
        unit="s",
        label="stopped delay",
        definition="Time that the actor was below 0.1 m/s.",
        source="SUMO tripinfo, waitingTime",
        better=Better.LOWER,
        compute=_of_outcome("waiting_time"),
    ),
)
"""In the order in which they are offered."""

_BY_NAME = {measure.name: measure for measure in ACTOR_MEASURES}
ACTOR_NAMES = tuple(_BY_NAME)


def actor_measure(name: str) -> ActorMeasure | None:
    """Look up a measure of actors; ``None`` if there is none of this name."""
    return _BY_NAME.get(name)
