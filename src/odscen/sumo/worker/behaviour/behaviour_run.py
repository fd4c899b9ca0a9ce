"""A behaviour model in a running simulation: before each step it sees the road and drives."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.base.errors import InputError, OdscenError, SimulationError
from odscen.base.frames import angle_deg_from_hdg
from odscen.learning.behaviour.behaviour_model import ActionKind, BehaviourDoor
from odscen.scenario.document.named_random import stream
from odscen.sumo.folder.layout import BEHAVIOUR_FILE, SUMO_FOLDER
from odscen.sumo.worker.behaviour.behaviour_doors import open_behaviour
from odscen.sumo.worker.behaviour.road_sight import RoadSight

if TYPE_CHECKING:
    from collections.abc import Collection
    from pathlib import Path

    from odscen.learning.behaviour.behaviour_model import Action, BehaviourModel, Observation
    from odscen.learning.fill import Array
    from odscen.results.records.run_records import Plan
    from odscen.sumo.worker.driven_vehicles import DrivenVehicles
    from odscen.sumo.worker.session import Session

_FASTEST = 150.0
"""m/s; a model that asks for more is mistaken."""
_NEEDS = {
    ActionKind.SPEED: ("speed",), ActionKind.SPEED_UNCHECKED: ("speed",),
    ActionKind.LANE_POSITION: ("lane", "pos"), ActionKind.POSE: ("x", "y", "hdg"),
}  # fmt: skip


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
        self._modes: dict[str, tuple[bool, bool]] = {}
        self._earlier: set[str] = set()

    @classmethod
    def in_folder(cls, run: Path, plan: Plan) -> BehaviourRun:
        """The model of the run in a folder.

        Raises
        ------
        InputError
            If it cannot be made.
        """
        text = (run / SUMO_FOLDER / BEHAVIOUR_FILE).read_text(encoding="utf-8")
        door = BehaviourDoor(**json.loads(text))
        return cls(open_behaviour(door, plan.seed), plan, door.shown)

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
            self._begin(session)
        seen, names = self._sight.look(session.time)
        if not names:
            return
        try:
            action, controlled = self._model.act(seen, self._state)
        except OdscenError as error:
            raise self._failure(seen, str(error)) from error
        except Exception as error:  # whatever code from outside may raise
            raise self._failure(seen, f"act failed: {error!r}") from error
        try:
            asked = _Asked(action, controlled, len(names))
            self._drive(seen, names, asked, taken)
        except InputError as error:
            raise self._failure(seen, str(error)) from error

    def state(self) -> list[str]:
        """What has to be remembered from one slice of a run to the next: who is driven."""
        return sorted({*self._modes, *self._earlier})

    def restore(self, state: Collection[str]) -> None:
        """Inverse of :meth:`state`."""
        self._earlier = set(state)

    def _begin(self, session: Session) -> None:
        self._session, self._road = session, session.driven_vehicles()
        self._sight = RoadSight(self._road, self._plan, session.time)
        rng = stream(self._plan.seed, "behaviour", f"{session.time:g}")
        try:
            self._state = self._model.init(rng, self._sight.scene)
        except OdscenError as error:
            raise SimulationError(f"behaviour {self._name}: {error}") from error  # noqa: EM102
        except Exception as error:
            msg = f"behaviour {self._name}: init failed: {error!r}"
            raise SimulationError(msg) from error

    def _drive(
        self, seen: Observation, names: list[str], asked: _Asked, taken: Collection[str]
    ) -> None:
        present = set(names)
        self._earlier &= present
        for name in self._modes.keys() - present:
            del self._modes[name]
        for row in asked.rows.tolist():
            name = names[row]
            if name in taken:
                self._modes.pop(name, None)
                self._earlier.discard(name)
                continue
            present.discard(name)
            try:
                self._act(seen, row, name, asked)
            except self._road.errors as error:
                msg = f"vehicle {name!r}: SUMO cannot: {error}"
                raise InputError(msg) from error
        for name in names:  # those whom it does not control (any more)
            if name in present and (name in self._modes or name in self._earlier):
                self._modes.pop(name, None)
                self._earlier.discard(name)
                if name not in taken:
                    self._road.release(name)

    def _act(self, seen: Observation, row: int, name: str, asked: _Asked) -> None:
        kind = asked.kind[row]
        mode = kind == ActionKind.SPEED, asked.change is not None
        if self._modes.get(name) != mode:
            self._road.take_over(name, checked=mode[0], changes=mode[1])
            self._modes[name] = mode
            self._earlier.discard(name)
        if asked.speed is not None:
            self._road.set_speed(name, asked.speed[row])
        if asked.change is not None and asked.change[row]:
            self._road.change_lane(name, asked.change[row], self._plan.step_length)
        if kind == ActionKind.LANE_POSITION:
            lane = asked.whole["lane"][row]
            if not 0 <= lane < len(self._sight.scene.lane_id):
                msg = f"vehicle {name!r}: there is no lane {lane}"
                raise InputError(msg)
            pos = float(asked.real["pos"][row])
            self._road.put_on_lane(name, str(self._sight.scene.lane_id[lane]), pos)
        elif kind == ActionKind.POSE:
            x, y, hdg = (float(asked.real[one][row]) for one in ("x", "y", "hdg"))
            half = 0.5 * float(self._sight.scene.vehicle_length[seen.index[row]])
            x += half * math.cos(hdg) + self._plan.net_offset[0]
            y += half * math.sin(hdg) + self._plan.net_offset[1]
            self._road.put(name, x, y, float(angle_deg_from_hdg(hdg)))

    def _failure(self, seen: Observation, words: str) -> SimulationError:
        return SimulationError(f"behaviour {self._name} at {seen.time:g} s: {words}")


class _Asked:
    """What a model has asked for, checked; rows of those that it controls."""

    def __init__(self, action: Action, controlled: Any, count: int) -> None:
        mask = np.asarray(controlled)
        if mask.shape != (count,) or mask.dtype != np.bool_:
            msg = f"is_controlled is {mask.dtype} {mask.shape}, not bool ({count},)"
            raise InputError(msg)
        self.rows = np.flatnonzero(mask)
        kinds = np.broadcast_to(np.asarray(action.kind), (count,))
        used = np.unique(kinds[mask]).tolist()
        if unknown := [kind for kind in used if kind not in {*ActionKind}]:
            msg = f"there is no kind of action {unknown[0]!r}"
            raise InputError(msg)
        self.kind = kinds.tolist()
        self.real = {
            name: self._numbers(action, name, count)
            for name in ("speed", "pos", "x", "y", "hdg")
            if getattr(action, name) is not None
        }
        self.whole = {
            name: self._numbers(action, name, count).astype(np.int64).tolist()
            for name in ("lane", "change")
            if getattr(action, name) is not None
        }
        for kind in used:
            for name in _NEEDS[ActionKind(kind)]:
                if name not in self.real and name not in self.whole:
                    msg = f"an action of kind {ActionKind(kind).name} needs {name}"
                    raise InputError(msg)
        speed = self.real.get("speed")
        if speed is not None and len(self.rows):
            low, high = speed[self.rows].min(), speed[self.rows].max()
            if low < 0.0 or high > _FASTEST:
                bad = low if low < 0.0 else high
                msg = f"a speed of {bad:g} m/s is not between 0 and {_FASTEST:g}"
                raise InputError(msg)
        self.speed = None if speed is None else speed.tolist()
        self.change = self.whole.get("change")

    def _numbers(self, action: Action, name: str, count: int) -> Array:
        try:
            values = np.asarray(getattr(action, name), dtype=np.float64)
        except (TypeError, ValueError) as error:
            msg = f"{name} is no array of numbers"
            raise InputError(msg) from error
        if values.shape != (count,):
            msg = f"{name} has shape {values.shape}, not ({count},)"
            raise InputError(msg)
        bad = ~np.isfinite(values[self.rows])
        if bad.any():
            row = int(self.rows[np.flatnonzero(bad)[0]])
            msg = f"{name} of row {row} is {values[row]:g}"
            raise InputError(msg)
        return np.where(np.isfinite(values), values, 0.0)
