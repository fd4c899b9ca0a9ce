"""A behaviour model in a running simulation: before each step it sees the road and drives."""

from __future__ import annotations

import math
import weakref
from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.base.errors import InputError, OdscenError, SimulationError
from odscen.base.frames import angle_deg_from_hdg
from odscen.learning.behaviour.behaviour_model import CheckedAction, DrivingKind
from odscen.scenario.document.distributions import stream
from odscen.sumo.worker.behaviour.road_sight import RoadSight

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from odscen.base.arrays import FloatArray, Int32Array, IntArray
    from odscen.learning.behaviour.behaviour_model import BehaviourModel
    from odscen.records.run_plan import Plan
    from odscen.sumo.worker.behaviour.lazy_observation import LazyObservation
    from odscen.sumo.worker.simulation.driven_vehicles import DrivenVehicles
    from odscen.sumo.worker.simulation.session import Session


class BehaviourRun:
    """The model of one run, and what SUMO was made to do for it.

    Parameters
    ----------
    model
        Drives.
    name
        How messages call it.
    """

    def __init__(self, model: BehaviourModel, plan: Plan, name: str) -> None:
        self._model = model
        self._plan = plan
        self._name = name
        self._session: Session | None = None
        self._road: DrivenVehicles
        self._sight: RoadSight
        self._state: Any = None
        self._earlier: set[str] = set()
        self._names: list[str] = []
        self._mode: IntArray  # of each vehicle of the scene, 0 if SUMO drives it
        self._speed: FloatArray  # that was last set, NaN if none was

    def before_step(self, session: Session, taken: Collection[str]) -> None:
        """Let the model drive in the step that comes.

        Parameters
        ----------
        taken
            Vehicles that rules or other programs move; the model does not.

        Raises
        ------
        SimulationError
            If it fails, or asks for what cannot be.
        """
        if self._session is not session:
            self._begin_session(session)
        left = self._drive_one_step(session.time, taken)
        kept = None if left is None else left()
        if kept is not None:  # the model holds on to it, and may look at it later
            kept.read_all()

    def _drive_one_step(
        self, time: float, taken: Collection[str]
    ) -> weakref.ref[LazyObservation] | None:
        """Show the model the road, and do what it asks for; a reference to what it was shown."""
        seen, names = self._sight.look(time)
        if not names:
            return None
        try:
            action, controlled = self._model.act(seen, self._state)
        except OdscenError as error:
            raise self._behaviour_failure(time, str(error)) from error
        except Exception as error:  # whatever code from outside may raise
            raise self._behaviour_failure(time, f"act failed: {error!r}") from error
        try:
            asked = CheckedAction(action, controlled, len(names))
            self._drive_vehicles(seen.index, names, asked, taken)
        except InputError as error:
            raise self._behaviour_failure(time, str(error)) from error
        return weakref.ref(seen)

    def close(self) -> None:
        """Let a model that has a method ``close`` know that the simulation is over."""
        close = getattr(self._model, "close", None)
        if callable(close):
            close()

    def state(self) -> list[str]:
        """What has to be remembered from one slice of a run to the next: who is driven."""
        if self._session is None:
            return sorted(self._earlier)
        driven = self._sight.scene.vehicle_id[self._mode > 0].tolist()
        return sorted({*driven, *self._earlier})

    def restore(self, state: Collection[str]) -> None:
        """Inverse of :meth:`state`."""
        self._earlier = set(state)

    def _begin_session(self, session: Session) -> None:
        self._session, self._road = session, session.driven_vehicles()
        self._sight = RoadSight(self._road, self._plan, session.time)
        count = len(self._sight.scene.vehicle_id)
        self._mode, self._speed = np.zeros(count, dtype=np.int64), np.full(count, np.nan)
        rng = stream(self._plan.seed, "behaviour", f"{session.time:g}")
        try:
            self._state = self._model.init(rng, self._sight.scene)
        except OdscenError as error:
            raise SimulationError(f"behaviour {self._name}: {error}") from error
        except Exception as error:
            raise SimulationError(f"behaviour {self._name}: init failed: {error!r}") from error

    def _drive_vehicles(
        self, index: Int32Array, names: list[str], asked: CheckedAction, taken: Collection[str]
    ) -> None:
        """Do what is asked of the vehicles on the road, rows of the scene ``index``."""
        if names is not self._names:
            self._names = names
            gone = np.ones(len(self._mode), dtype=np.bool_)
            gone[index] = False
            self._forget_rows(gone)
            self._earlier.intersection_update(names)
        free = np.ones(len(names), dtype=np.bool_)
        if taken:
            free[:] = [name not in taken for name in names]
            self._forget_rows(index[~free])
            self._earlier.difference_update(taken)
        mine = np.zeros(len(names), dtype=np.bool_)
        mine[asked.rows] = True
        rows = np.flatnonzero(mine & free)
        name = ""
        try:
            for name in self._take_over_vehicles(index, names, rows, asked):
                self._earlier.discard(name)
            some, speeds = self._new_speeds(index, rows, asked)
            set_speed = self._road.set_speed
            for name, speed in zip(map(names.__getitem__, some), speeds, strict=True):
                set_speed(name, speed)
            for row in self._rows_asked_more(rows, asked):
                name = names[row]
                self._act_on_vehicle(int(index[row]), row, name, asked)
            back = free & ~mine & (self._mode[index] > 0)
            if self._earlier:
                back |= free & ~mine & np.array([name in self._earlier for name in names])
            for row in np.flatnonzero(back).tolist():  # it does not control them (any more)
                name = names[row]
                self._earlier.discard(name)
                self._road.release(name)
            self._forget_rows(index[back])
        except self._road.errors as error:
            raise InputError(f"vehicle {name!r}: SUMO cannot: {error}") from error

    def _forget_rows(self, rows: Any) -> None:
        self._mode[rows], self._speed[rows] = 0, np.nan

    def _take_over_vehicles(
        self, index: Int32Array, names: list[str], rows: IntArray, asked: CheckedAction
    ) -> Iterator[str]:
        """Let vehicles do what is set, where they do not yet; yields each before that."""
        changes = asked.change is not None
        mode = 1 + (asked.kind[rows] == DrivingKind.SPEED) + 2 * changes
        new = self._mode[index[rows]] != mode
        for row in rows[new].tolist():
            yield names[row]
            checked = asked.kind[row] == DrivingKind.SPEED
            self._road.take_over(names[row], checked=bool(checked), changes=changes)
        self._mode[index[rows]] = mode
        self._speed[index[rows[new]]] = np.nan

    def _new_speeds(
        self, index: Int32Array, rows: IntArray, asked: CheckedAction
    ) -> tuple[list[int], list[float]]:
        """Rows of vehicles whose speeds have to be set, and speeds: one that is set lasts."""
        if asked.speed is None:
            return [], []
        speed = asked.speed[rows]
        # Placing a vehicle may change its speed, so what was set before means nothing.
        placed = asked.kind[rows] >= DrivingKind.LANE_POSITION
        new = placed | (speed != self._speed[index[rows]])
        self._speed[index[rows]] = speed
        return rows[new].tolist(), speed[new].tolist()

    def _rows_asked_more(self, rows: IntArray, asked: CheckedAction) -> list[int]:
        """Rows of vehicles that are asked for more than a speed."""
        more = asked.kind[rows] >= DrivingKind.LANE_POSITION
        if asked.change is not None:
            more |= asked.change[rows] != 0
        found: list[int] = rows[more].tolist()
        return found

    def _act_on_vehicle(self, vehicle: int, row: int, name: str, asked: CheckedAction) -> None:
        kind = asked.kind[row]
        if asked.change is not None and asked.change[row]:
            self._road.change_lane(name, int(asked.change[row]), self._plan.step_length)
        if kind == DrivingKind.LANE_POSITION:
            lane = int(asked.whole["lane"][row])
            if not 0 <= lane < len(self._sight.scene.lane_id):
                raise InputError(f"vehicle {name!r}: there is no lane {lane}")
            pos = float(asked.real["pos"][row])
            self._road.put_on_lane(name, str(self._sight.scene.lane_id[lane]), pos)
        elif kind == DrivingKind.POSE:
            x, y, hdg = (float(asked.real[column][row]) for column in ("x", "y", "hdg"))
            half = 0.5 * float(self._sight.scene.vehicle_length[vehicle])
            x += half * math.cos(hdg) + self._plan.net_offset[0]
            y += half * math.sin(hdg) + self._plan.net_offset[1]
            self._road.put(name, x, y, float(angle_deg_from_hdg(hdg)))

    def _behaviour_failure(self, time: float, words: str) -> SimulationError:
        return SimulationError(f"behaviour {self._name} at {time:g} s: {words}")
