"""A model that switches the lights of a running simulation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.base.errors import OdscenError, SimulationError
from odscen.learning.behaviour.light_model import (
    DECISION_INTERVAL,
    KEEP,
    LightObservation,
    LightScene,
    LightsObservation,
    checked_stages,
)
from odscen.runs.layout import LIGHT_STAGES_FILE, SUMO_FOLDER
from odscen.scenario.document.distributions import stream
from odscen.sumo.realize.lights.light_stages import lights_from_json

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.learning.behaviour.light_model import LightModel
    from odscen.records.run_plan import Plan
    from odscen.sumo.realize.lights.light_stages import SwitchedLight
    from odscen.sumo.worker.simulation.session import Session
    from odscen.sumo.worker.simulation.switched_lights import SwitchedLights

_SMALL = 1e-6
"""Seconds that sums of steps may be off by."""


class _HeldLight:
    """One light: its own program until it shows a stage, then what the model wants.

    Attributes
    ----------
    stage
        That has green or comes next; -1 under its own program.
    """

    def __init__(self, light: SwitchedLight, lights: SwitchedLights) -> None:
        self.light = light
        self._lights = lights
        self.stage = -1
        self._since = 0.0
        self._steps: list[tuple[float, str]] = []
        self._step_end = 0.0

    @property
    def changes(self) -> bool:
        """Whether it is between two greens."""
        return bool(self._steps)

    def advance(self, now: float) -> None:
        """Show what is due at the begin of a step."""
        name = self.light.facts.id
        if self.stage < 0:
            self._take_over(now)
        elif not self._lights.is_held(name):
            self.stage, self._steps = -1, []  # a plan or an outage has been switched on
            return
        while self._steps and now >= self._step_end - _SMALL:
            self._steps.pop(0)
            self._show_step(self._step_end)

    def green_for(self, now: float) -> float:
        """Seconds of green."""
        return 0.0 if self.stage < 0 or self._steps else now - self._since

    def may_switch(self, now: float) -> bool:
        """Whether the green may end."""
        if self.stage < 0 or self._steps:
            return False
        return now - self._since >= self.light.facts.least_green[self.stage] - _SMALL

    def switch_to(self, stage: int, now: float) -> None:
        """End the green, and begin the way to another stage."""
        self._steps = [*self.light.ways[self.stage][stage]]
        self.stage = stage
        self._step_end = now
        self._show_step(now)

    def state(self) -> list[Any]:
        """What has to be remembered from one slice of a run to the next."""
        return [self.stage, self._since, self._steps, self._step_end]

    def restore(self, state: list[Any]) -> None:
        """Inverse of :meth:`state`: SUMO forgets what a light was set to."""
        self.stage, self._since, steps, self._step_end = state
        self._steps = [(seconds, shown) for seconds, shown in steps]
        if self.stage >= 0:
            shown = self._steps[0][1] if self._steps else self.light.facts.states[self.stage]
            self._lights.show(self.light.facts.id, shown)

    def _take_over(self, now: float) -> None:
        """Hold the light once its program shows a stage."""
        facts, shown = self.light.facts, self._lights.state(self.light.facts.id)
        if shown in facts.states:
            self.stage = facts.states.index(shown)
            self._show_step(now)

    def _show_step(self, begin: float) -> None:
        name = self.light.facts.id
        if self._steps:
            seconds, state = self._steps[0]
            self._step_end = begin + seconds
            self._lights.show(name, state)
        else:
            self._since = begin
            self._lights.show(name, self.light.facts.states[self.stage])


class LightRun:
    """The model of one run.

    Parameters
    ----------
    model
        Switches.
    name
        How messages call it.
    """

    def __init__(
        self, model: LightModel, lights: tuple[SwitchedLight, ...], plan: Plan, name: str
    ) -> None:
        self._model = model
        self._lights = lights
        self._plan = plan
        self._name = name
        self._interval = float(getattr(model, "interval", DECISION_INTERVAL))
        self._session: Session | None = None
        self._road: SwitchedLights
        self._held: list[_HeldLight] = []
        self._scene: LightScene
        self._state: Any = None
        self._next = 0.0
        self._earlier: dict[str, list[Any]] = {}

    @classmethod
    def in_folder(cls, run: Path, model: LightModel, plan: Plan, name: str) -> LightRun:
        """The lights of the run in a folder."""
        text = (run / SUMO_FOLDER / LIGHT_STAGES_FILE).read_text(encoding="utf-8")
        return cls(model, lights_from_json(text), plan, name)

    def before_step(self, session: Session) -> None:
        """Show what is due, and let the model choose where it is time to.

        Raises
        ------
        SimulationError
            If the model fails, or asks for what cannot be.
        """
        now = session.time
        if self._session is not session:
            self._begin_session(session, now)
        for held in self._held:
            held.advance(now)
        if now < self._next - _SMALL or not self._held:
            return
        self._next += self._interval
        seen = LightsObservation(now, tuple(self._observe_light(held, now) for held in self._held))
        try:
            chosen = checked_stages(self._model.switch(seen, self._state), self._scene)
        except OdscenError as error:
            raise self._describe_failure(now, str(error)) from error
        except Exception as error:  # whatever code from outside may raise
            raise self._describe_failure(now, f"switch failed: {error!r}") from error
        for held, light, stage in zip(self._held, seen.lights, chosen, strict=True):
            if light.may_switch and stage not in {KEEP, held.stage}:
                held.switch_to(stage, now)

    def state(self) -> dict[str, Any]:
        """What has to be remembered from one slice of a run to the next."""
        return {held.light.facts.id: held.state() for held in self._held}

    def restore(self, state: dict[str, Any]) -> None:
        """Inverse of :meth:`state`."""
        self._earlier = state

    def close(self) -> None:
        """Let a model that has a method ``close`` know that the simulation is over."""
        close = getattr(self._model, "close", None)
        if callable(close):
            close()

    def _begin_session(self, session: Session, now: float) -> None:
        self._session, self._road = session, session.switched_lights()
        lights = [light for light in self._lights if light.facts.id in self._road.known]
        self._held = [_HeldLight(light, self._road) for light in lights]
        for held in self._held:
            if earlier := self._earlier.get(held.light.facts.id):
                held.restore(earlier)
        self._next = now
        facts = tuple(light.facts for light in lights)
        self._scene = LightScene(self._plan.step_length, now, self._interval, facts)
        rng = stream(self._plan.seed, "lights", f"{now:g}")
        if not self._interval >= self._plan.step_length:
            raise SimulationError(
                f"behaviour {self._name}: interval is {self._interval:g} s, less than a step of "
                f"{self._plan.step_length:g} s"
            )
        try:
            self._state = self._model.init_lights(rng, self._scene)
        except OdscenError as error:
            raise SimulationError(f"behaviour {self._name}: {error}") from error
        except Exception as error:
            raise SimulationError(
                f"behaviour {self._name}: init_lights failed: {error!r}"
            ) from error

    def _observe_light(self, held: _HeldLight, now: float) -> LightObservation:
        facts = held.light.facts
        traffic = np.array(
            [self._road.traffic(lanes) for lanes in facts.approaches], dtype=np.float64
        ).reshape(-1, 4)
        leaving = np.array([self._road.count(lane) for lane in facts.exits], dtype=np.float64)
        vehicles, queue, waiting, lost = traffic.T
        return LightObservation(
            held.stage, held.green_for(now), held.may_switch(now), vehicles, queue, waiting, lost,
            leaving,
        )  # fmt: skip

    def _describe_failure(self, time: float, words: str) -> SimulationError:
        return SimulationError(f"behaviour {self._name} at {time:g} s: {words}")
