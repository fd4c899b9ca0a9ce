"""A behaviour model in a running simulation: before each step it sees the road and drives."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

from odscen.base.errors import InputError, OdscenError, SimulationError
from odscen.base.frames import angle_deg_from_hdg
from odscen.learning.behaviour.behaviour_model import BehaviourDoor, DrivingKind
from odscen.learning.behaviour.checked_action import CheckedAction
from odscen.scenario.document.named_random import stream
from odscen.sumo.folder.layout import BEHAVIOUR_FILE, SUMO_FOLDER
from odscen.sumo.worker.behaviour.behaviour_doors import open_behaviour
from odscen.sumo.worker.behaviour.road_sight import RoadSight

if TYPE_CHECKING:
    from collections.abc import Collection
    from pathlib import Path

    from odscen.learning.behaviour.behaviour_model import BehaviourModel, RoadObservation
    from odscen.results.records.run_records import Plan
    from odscen.sumo.worker.driven_vehicles import DrivenVehicles
    from odscen.sumo.worker.session import Session


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
            asked = CheckedAction(action, controlled, len(names))
            self._drive(seen, names, asked, taken)
        except InputError as error:
            raise self._failure(seen, str(error)) from error

    def close(self) -> None:
        """Let a model that has a method ``close`` know that the simulation is over."""
        close = getattr(self._model, "close", None)
        if callable(close):
            close()

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
        self, seen: RoadObservation, names: list[str], asked: CheckedAction, taken: Collection[str]
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

    def _act(self, seen: RoadObservation, row: int, name: str, asked: CheckedAction) -> None:
        kind = asked.kind[row]
        mode = kind == DrivingKind.SPEED, asked.change is not None
        if self._modes.get(name) != mode:
            self._road.take_over(name, checked=mode[0], changes=mode[1])
            self._modes[name] = mode
            self._earlier.discard(name)
        if asked.speed is not None:
            self._road.set_speed(name, asked.speed[row])
        if asked.change is not None and asked.change[row]:
            self._road.change_lane(name, asked.change[row], self._plan.step_length)
        if kind == DrivingKind.LANE_POSITION:
            lane = asked.whole["lane"][row]
            if not 0 <= lane < len(self._sight.scene.lane_id):
                msg = f"vehicle {name!r}: there is no lane {lane}"
                raise InputError(msg)
            pos = float(asked.real["pos"][row])
            self._road.put_on_lane(name, str(self._sight.scene.lane_id[lane]), pos)
        elif kind == DrivingKind.POSE:
            x, y, hdg = (float(asked.real[one][row]) for one in ("x", "y", "hdg"))
            half = 0.5 * float(self._sight.scene.vehicle_length[seen.index[row]])
            x += half * math.cos(hdg) + self._plan.net_offset[0]
            y += half * math.sin(hdg) + self._plan.net_offset[1]
            self._road.put(name, x, y, float(angle_deg_from_hdg(hdg)))

    def _failure(self, seen: RoadObservation, words: str) -> SimulationError:
        return SimulationError(f"behaviour {self._name} at {seen.time:g} s: {words}")
