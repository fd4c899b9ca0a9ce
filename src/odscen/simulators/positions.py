"""All records of a run from plain positions: trajectories, events, trips, what became of each."""

from __future__ import annotations

import time as wall_clock
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.categories import Category
from odscen.base.errors import InputError
from odscen.base.frames import XodrPose, xodr_to_sumo
from odscen.figures.measures.summary import Trip, actor_outcomes, actors_to_json
from odscen.records.replay import BODY_CENTRE, SPEED_OF
from odscen.records.run_events import Event, EventKind, events_to_json
from odscen.runs import layout
from odscen.runs.new_run import SimulationOutcome
from odscen.runs.reporter import SILENT, Progress

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from pathlib import Path

    from odscen.records.run_plan import Plan
    from odscen.runs.new_run import PreparedRun
    from odscen.runs.reporter import Reporter

STOPPED = 0.1
"""m/s below which a road user is stopped, as in SUMO."""


class Position(NamedTuple):
    """Where a road user is: centre of its body in the OpenDRIVE frame, metres, rad, m/s."""

    id: str
    x: float
    y: float
    hdg: float
    speed: float = 0.0
    z: float = 0.0


@dataclass(slots=True)
class _TripSoFar:
    depart: float
    x: float
    y: float
    time: float
    speed: float
    length: float = 0.0
    waiting: float = 0.0
    halts: int = 0


class PositionRecord:
    """Takes positions step by step, and writes the records of the run from them.

    A road user departs with the first step that it is in, and has arrived with the first that it is
    not in any more.

    Parameters
    ----------
    prepared
        What has been prepared; says what is recorded.
    """

    def __init__(self, prepared: PreparedRun) -> None:
        self._plan = prepared.plan
        self._recording = prepared.settings.recording
        self._begin = wall_clock.perf_counter()
        self._rows = {actor.id: row for row, actor in enumerate(self._plan.actors)}
        self._under_way: dict[str, _TripSoFar] = {}
        self._ended: dict[str, tuple[_TripSoFar, float]] = {}
        self._events: list[Event] = []
        self._times: list[float] = []
        self._states: list[np.ndarray] = []
        self._last_recorded = -np.inf
        self._time = 0.0
        self._steps = 0
        self._stopped = False

    def times(self, reporter: Reporter = SILENT) -> Iterator[float]:
        """Yield the time of each step, s, until the run is over; reports how far it is.

        It is over at the end of the plan, when all have arrived, or when the reporter says so.
        """
        plan, step = self._plan, 0
        limit = self._plan.until - self._plan.step_length / 2
        waiting = {actor.id for actor in plan.actors if actor.problem is None}
        while (now := round(step * plan.step_length, 6)) <= limit:
            if reporter.cancelled:
                self._stopped = True
                return
            yield now
            step += 1
            if step % 10 == 0 or not self._under_way:
                arrived, running = len(self._ended), len(self._under_way)
                reporter.advanced(
                    Progress(now, plan.until, running, arrived + running, arrived, len(plan.actors))
                )
            if not self._under_way and waiting <= self._ended.keys():
                return

    def add(self, time: float, positions: Iterable[Position]) -> None:
        """Take in where all road users are at a time, s; times rise.

        Raises
        ------
        InputError
            If one is not in the plan, has departed before and is back, or is nowhere.
        """
        there = {position.id: position for position in positions}
        for position in there.values():
            if position.id not in self._rows:
                raise InputError(f"there is no road user {position.id!r} in the plan of the run")
            if not np.isfinite(position[1:]).all():
                raise InputError(f"{position.id!r} is nowhere at {time:g} s: {position[1:]}")
            if position.id in self._ended:
                raise InputError(f"{position.id!r} is back at {time:g} s, but has arrived before")
            self._follow_user(time, position)
        for name in [name for name in self._under_way if name not in there]:
            trip = self._under_way.pop(name)
            self._ended[name] = trip, time
            self._events.append(
                Event(
                    time, EventKind.ARRIVED, name, trip.x, trip.y,
                    travel_time=round(time - trip.depart, 6),
                )
            )  # fmt: skip
        self._record_step(time, list(there.values()))
        self._time, self._steps = time, self._steps + 1

    def collide(self, time: float, name: str, partner: str, x: float, y: float) -> None:
        """Take in that two road users collide at a time, s, and the middle of their contact."""
        self._events.append(Event(time, EventKind.COLLISION, name, x, y, partner=partner))

    def write(self, folder: Path) -> SimulationOutcome:
        """Write the records into the folder of the run, and say how it ended."""
        trips = {
            name: self._measure_trip(name, trip, end) for name, (trip, end) in self._ended.items()
        }
        trips |= {
            name: self._measure_trip(name, trip, None) for name, trip in self._under_way.items()
        }
        write_records(self._plan, self._events, folder, trips)
        if self._plan.trajectories and self._states:
            file = folder / layout.TRAJECTORIES_FILE
            write_trajectories(self._plan, self._times, self._states, file)
        self._write_trips(trips, folder / layout.TRIPS_FILE)
        step = self._plan.step_length
        return SimulationOutcome(
            sim_seconds=round(min(self._time + step, self._plan.until), 6),
            steps=self._steps,
            wall_seconds=wall_clock.perf_counter() - self._begin,
            stopped=self._stopped,
        )

    def _follow_user(self, time: float, position: Position) -> None:
        """Take in how far a road user has come, and whether it was stopped."""
        trip = self._under_way.get(position.id)
        if trip is None:
            planned = self._plan.actors[self._rows[position.id]]
            error = float(np.hypot(position.x - planned.x, position.y - planned.y))
            self._under_way[position.id] = _TripSoFar(
                time, position.x, position.y, time, position.speed
            )
            self._events.append(
                Event(time, EventKind.DEPARTED, position.id, position.x, position.y, error=error)
            )
            return
        trip.length += float(np.hypot(position.x - trip.x, position.y - trip.y))
        if position.speed < STOPPED:
            trip.waiting += time - trip.time
            trip.halts += trip.speed >= STOPPED
        trip.x, trip.y, trip.time, trip.speed = position.x, position.y, time, position.speed

    def _record_step(self, time: float, positions: Sequence[Position]) -> None:
        """Keep the states of a step, as often and where they are wanted."""
        recording = self._recording
        if not self._plan.trajectories:
            return
        if recording.every is not None and time < self._last_recorded + recording.every - 1e-9:
            return
        self._last_recorded = time
        rows = np.array(
            [(self._rows[p.id], p.x, p.y, p.z, p.hdg, 0.0, p.speed) for p in positions],
            dtype=np.float64,
        ).reshape(-1, 7)
        if recording.region is not None:
            x0, y0, x1, y1 = recording.region
            inside = (rows[:, 1] >= x0) & (rows[:, 1] <= x1)
            rows = rows[inside & (rows[:, 2] >= y0) & (rows[:, 2] <= y1)]
        self._times.append(time)
        self._states.append(rows)

    def _measure_trip(self, name: str, trip: _TripSoFar, end: float | None) -> Trip:
        """What was measured on a trip; the time lost is that beyond the free-flow time."""
        planned = self._plan.actors[self._rows[name]]
        loss = None
        if end is not None and planned.free_flow_time is not None:
            loss = max(0.0, end - trip.depart - planned.free_flow_time)
        walks = planned.category == Category.PEDESTRIAN
        return Trip(loss, trip.waiting, None if walks else trip.halts)

    def _write_trips(self, trips: dict[str, Trip], file: Path) -> None:
        """Write the table of trips, columns as of :mod:`odscen.sumo.outputs.output_tables`."""
        import polars as pl

        rows = []
        for name, known in trips.items():
            trip, end = self._ended.get(name, (None, None))
            trip = trip or self._under_way[name]
            person = self._plan.actors[self._rows[name]].person
            rows.append(
                {
                    "id": name,
                    "person": person,
                    "depart": trip.depart,
                    "arrival": end,
                    "duration": (self._time if end is None else end) - trip.depart,
                    "route_length": None if person and end is None else trip.length,
                    "waiting_time": known.waiting_time,
                    "waiting_count": known.stops,
                    "time_loss": known.time_loss,
                }
            )
        if not rows:
            return
        schema = {
            "id": pl.String, "person": pl.Boolean, "depart": pl.Float64, "arrival": pl.Float64,
            "duration": pl.Float64, "route_length": pl.Float64, "waiting_time": pl.Float64,
            "waiting_count": pl.Int64, "time_loss": pl.Float64,
        }  # fmt: skip
        table = pl.DataFrame(rows, schema=schema)
        table.sort("arrival", "depart", "id", nulls_last=True).write_parquet(file)


def write_records(
    plan: Plan, events: Iterable[Event], folder: Path, trips: dict[str, Trip] | None = None
) -> None:
    """Write ``events.json``, in order of time, and ``actors.json``."""
    in_order = sorted(events, key=lambda event: event.time)
    outcomes = actor_outcomes(plan, in_order, trips or {})
    (folder / layout.EVENTS_FILE).write_text(events_to_json(in_order), encoding="utf-8")
    (folder / layout.ACTORS_FILE).write_text(actors_to_json(outcomes), encoding="utf-8")


def write_trajectories(
    plan: Plan, times: Sequence[float], states: Sequence[np.ndarray], file: Path
) -> None:
    """Write states in the columns and the frame that SUMO's own recording has.

    The file says that its speeds are those of body centres; SUMO's are of fronts, see
    :func:`odscen.records.replay.speeds_of_positions`.

    Parameters
    ----------
    states
        Of each time, shape ``(N, 7)``: row of the plan, x, y, z, hdg, pitch of the body centre in
        the OpenDRIVE frame (metres, rad), speed (m/s).
    """
    import polars as pl

    table = np.concatenate([np.empty((0, 7)), *states])
    index = table[:, 0].astype(np.int64)
    length = np.array([actor.length for actor in plan.actors])
    _, x, y, z, hdg, pitch, speed = table.T
    front = xodr_to_sumo(
        XodrPose(x, y, z, hdg, pitch), length=length[index], net_offset=plan.net_offset
    )
    names = [actor.id for actor in plan.actors]
    pl.DataFrame(
        {
            "timestep_time": np.repeat(np.array(times), [len(part) for part in states]),
            "vehicle_id": pl.Series([names[row] for row in index], dtype=pl.String),
            "vehicle_x": np.asarray(front.x),
            "vehicle_y": np.asarray(front.y),
            "vehicle_z": np.asarray(front.z),
            "vehicle_angle": np.asarray(front.angle_deg),
            "vehicle_speed": speed,
        }
    ).write_parquet(file, metadata={SPEED_OF: BODY_CENTRE})
