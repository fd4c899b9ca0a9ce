"""What is done after each step of SUMO's: the ticks that show it, and who watches them."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from odscen.base.errors import CarlaError
from odscen.carla.server.batch import ENOUGH_TRIES
from odscen.sumo.worker.protocol import Outside

if TYPE_CHECKING:
    import threading
    from collections.abc import Callable, Iterator, Mapping

    from odscen.carla.mirror.cosim_report import CosimReport
    from odscen.carla.mirror.mirrored import MirroredPlan
    from odscen.carla.mirror.parity_recorder import StateRecorder
    from odscen.carla.mirror.step_clock import StepClock
    from odscen.carla.server.batch import ActorPlace, Batch
    from odscen.carla.server.carla_server import Server
    from odscen.convert.lane_table.light_heads import SignalHeads
    from odscen.sumo.runner.in_step import Step
    from odscen.sumo.worker.protocol import EgoPose


class StepShow:
    """What is done after each step of SUMO's.

    Attributes
    ----------
    witnesses
        Called with each step that has been shown.
    views
        Asked before each tick, with what it will show, where cameras are to be.
    hooks
        Called after each tick.
    on_shown
        Called after the witnesses; false ends the run.
    """

    def __init__(
        self,
        server: Server,
        mirrored: MirroredPlan,
        heads: SignalHeads,
        clock: StepClock,
        report: CosimReport,
        interrupted: threading.Event,
        *,
        carla_signals: bool = False,
    ) -> None:
        self.stop: Callable[[str | None], None] = lambda _failure: None
        self.outside: Callable[[Outside], None] = lambda _outside: None
        self.witnesses: list[Callable[[Step], None]] = []
        self.views: list[Callable[[Step], Mapping[int, ActorPlace]]] = []
        self.hooks: list[Callable[[], None]] = []
        self.on_shown: Callable[[Step], bool] = lambda _step: True
        self._server = server
        self._mirror = mirrored.mirror
        self._heads = heads
        self._ego = mirrored.ego
        self._ground = mirrored.ground
        self._wheels = mirrored.wheels
        self._doors = mirrored.doors
        self._foreign = mirrored.foreign
        self._foreign_seen = False
        self._clock = clock
        self._report = report
        self._interrupted = interrupted
        self._leads = carla_signals
        self._joined = server.watch_lights() if carla_signals else server.take_lights()
        self._told: dict[str, str] = {}
        self._letters: dict[str, str] = {}
        self._states: dict[str, str] = {}
        self._own: list[float] = []
        known = heads.signals
        report.signals = len(known & self._joined.keys())
        report.signals_missing = sorted(known - self._joined.keys())

    def on_step(self, step: Step) -> EgoPose | None:
        """Show a step; an error ends the run, whose results are kept."""
        if self._interrupted.is_set():
            self._report.interrupted = True
            self.stop(None)
            return None
        try:
            step = self._ground.under(step)
            self._show_step(step)
            for witness in self.witnesses:
                witness(step)
            if not self.on_shown(step):
                self.stop(None)
                return None
            self._show_outside()
            return self._ego.driven(step) if self._ego else None
        except CarlaError as error:
            self._report.error = str(error)
            self.stop(str(error))
            return None

    def _show_outside(self) -> None:
        """Let SUMO see what others do on the server; nothing is said while there is nothing."""
        users = self._foreign.users() if self._foreign else []
        lights = self._switched_lights() if self._leads else {}
        if users or lights or self._foreign_seen:
            self._foreign_seen = bool(users)
            self.outside(Outside(users, lights))

    def _switched_lights(self) -> dict[str, str]:
        """Letters of SUMO's lights that the server has switched."""
        shown = self._server.light_states()
        self._told = {signal: shown[actor] for signal, actor in self._joined.items()}
        letters = self._heads.letters(self._told)
        changed = {name: own for name, own in letters.items() if self._letters.get(name) != own}
        self._letters = letters
        return changed

    def record(self, step: Step, recorder: StateRecorder) -> None:
        """Let a recorder take down a step that has just been shown."""
        if self._leads:  # SUMO follows by a step
            seen = self._told
        else:
            shown = self._server.light_states()
            seen = {signal: shown[actor] for signal, actor in self._joined.items()}
        pairs = {
            signal: (state, seen[signal])
            for signal, state in self._states.items()
            if signal in seen
        }
        recorder.take(step, self._server.world.get_snapshot(), self._mirror.actors, pairs)

    def conclude(self) -> None:
        """Fill in the rest of the report."""
        report = self._report
        report.spawned = self._mirror.spawned
        report.refused = [
            {"actor": refusal.actor, "tries": refusal.tries, "reason": refusal.reason}
            for refusal in self._mirror.refusals.values()
        ]
        if self._foreign is not None:
            report.foreign = [
                {"actor": actor, "type": kind, "role": role}
                for actor, (kind, role) in sorted(self._foreign.seen.items())
            ]
        report.interruptions = self._server.interruptions
        if self._own:
            median, worst = np.percentile(np.array(self._own) * 1e3, [50, 95])
            report.own_ms = round(float(median), 3), round(float(worst), 3)

    def _show_step(self, step: Step) -> None:
        if self._doors is not None:
            self._doors.before(step)
        for batch in self._planned_batches(step):
            if self._mirror.shown is step:
                changed = self._changed_lights(step)
                batch.signals.update({} if self._leads else changed)
            self._point_cameras(batch)
            waited = self._server.waited
            start = time.perf_counter()
            self._move_parts(batch)
            self._mirror.answered(self._server.apply(batch))
            self._refuse_an_empty_world()
            took = time.perf_counter() - start
            self._own[-1] += took - (self._server.waited - waited)
            self._report.ticks += 1
            for hook in self.hooks:
                hook()

    def _point_cameras(self, batch: Batch) -> None:
        """Let cameras follow what the tick shows."""
        shown = self._mirror.shown
        if shown is not None:
            for view in self.views:
                batch.views.update(view(shown))

    def _move_parts(self, batch: Batch) -> None:
        """Let doors and wheels near the ego go with what the tick shows."""
        shown, actors = self._mirror.shown, self._mirror.actors
        if self._doors is not None:
            batch.doors.update(self._doors.moved(actors))
        if shown is not None and self._wheels is not None:
            spent = sum(map(len, batch.doors.values()))
            batch.wheels.update(self._wheels.turned(shown, actors, spent=spent))

    def _refuse_an_empty_world(self) -> None:
        """Raise once one was tried again and again and the server has not taken any."""
        if self._mirror.spawned:
            return
        for refusal in self._mirror.refusals.values():
            if refusal.tries >= ENOUGH_TRIES:
                raise CarlaError(
                    f"the CARLA server at {self._report.address} takes no road user, "
                    f"{len(self._mirror.refusals)} were tried: {refusal.reason}"
                )

    def _planned_batches(self, step: Step) -> Iterator[Batch]:
        """Batches of a step; what planning each one takes is counted as ours."""
        batches = self._mirror.batches(step, self._clock.shares(step))
        while True:
            waited, start = self._server.waited, time.perf_counter()
            batch = next(batches, None)
            if batch is None:
                return
            took = time.perf_counter() - start
            self._own.append(took - (self._server.waited - waited))
            yield batch

    def _changed_lights(self, step: Step) -> dict[int, str]:
        states = self._heads.states(step.lights)
        changed = {
            self._joined[signal]: state
            for signal, state in states.items()
            if signal in self._joined and self._states.get(signal) != state
        }
        self._states = states
        return changed
