"""A scenario in SUMO and CARLA at once: SUMO drives, the server shows every step of it."""

from __future__ import annotations

import signal
import threading
import time
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.app.runs import carry_out, check_file, prepare_run
from odscen.base.errors import CarlaError
from odscen.carla.camera import first_view, watch_from_above
from odscen.carla.carla_server import Server
from odscen.carla.light_heads import Heads
from odscen.carla.mirrored import MirroredPlan
from odscen.carla.parity_recorder import StateRecorder
from odscen.carla.server_map import ensure_map
from odscen.sumo.realize.run_settings import AS_DESIGNED
from odscen.sumo.runner.elevation import ElevationLookup
from odscen.sumo.runner.in_step import InStep

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from odscen.carla.camera import Camera
    from odscen.carla.cosim_options import CosimOptions
    from odscen.results.records.run_records import Plan
    from odscen.sumo.folder.finished_run import Run
    from odscen.sumo.realize.run_settings import RunSettings
    from odscen.sumo.runner.in_step import Step
    from odscen.sumo.worker.protocol import EgoPose, OnProgress
    from odscen.workspace.store import Workspace

INTERRUPTED = 130
"""Exit code after Ctrl-C."""


@dataclass(slots=True)
class CosimReport:
    """What came of the mirror.

    Attributes
    ----------
    map
        ``there``, ``loaded`` or ``generated``.
    ticks, spawned
        How many ticks were made, and how many actors.
    refused
        Road users whom the server never took: id, tries, its words.
    signals, signals_missing
        How many signals of the map are joined to a light of the server, and ids of those that the
        server has no light for.
    sizes
        Metres by which the length of a blueprint differs from the road user it represents.
    interruptions
        How often the stream of the server's states was cut and came back.
    own_ms
        Median and 95th percentile of our own share of a tick, milliseconds.
    error, interrupted
        Why it has ended early.
    left_behind
        What could not be given back, in words.
    """

    address: str
    map: str = ""
    ticks: int = 0
    spawned: int = 0
    refused: list[dict[str, Any]] = field(default_factory=list)
    signals: int = 0
    signals_missing: list[str] = field(default_factory=list)
    sizes: dict[str, float] = field(default_factory=dict)
    interruptions: int = 0
    own_ms: tuple[float, float] | None = None
    error: str | None = None
    interrupted: bool = False
    left_behind: list[str] = field(default_factory=list)


def cosim(
    workspace: Workspace,
    path: Path,
    options: CosimOptions,
    *,
    settings: RunSettings = AS_DESIGNED,
    out: Path | None = None,
    progress: OnProgress | None = None,
) -> tuple[Run, CosimReport]:
    """Run a scenario in SUMO and show it on a CARLA server.

    The run folder is that of :func:`odscen.app.runs.run`, whatever happens to the server: if that
    fails, SUMO stops and what it did so far is kept.

    Parameters
    ----------
    path
        Scenario file.
    options
        How it is mirrored.
    settings
        How it is run; always in one piece.
    out
        Folder that gets the run's folder; the workspace's ``runs`` if not given.
    progress
        Called in this thread, a few times a second.

    Raises
    ------
    ScenarioError
        If the scenario has errors.
    CarlaError
        If the server is not there or does not fit; nothing has run then.
    """
    options.check()
    run = check_file(workspace, path, out=out, settings=replace(settings, slice_length=None))
    prepared = prepare_run(run)
    ticks = options.ticks(prepared.plan.step_length)
    report = CosimReport(str(options.address))
    with (
        interrupts() as interrupted,
        Server(options.address) as server,
        ExitStack() as stack,
    ):
        xodr = run.entry.read("xodr").decode()
        report.map = ensure_map(server, run.entry.name, xodr, load=options.load_map)
        server.synchronize(prepared.plan.step_length / ticks)
        mirrored = MirroredPlan.on(server, run, prepared.plan, options)
        report.sizes = mirrored.sizes
        heads = Heads(run.map.sumo.lights)
        show = _Show(server, mirrored, heads, ticks, report, interrupted)
        in_step = InStep(
            prepared.plan,
            ElevationLookup(run.map.sumo.graph, run.entry.lane_table()),
            show.on_step,
            placed=mirrored.ego.row if mirrored.ego else None,
        )
        show.stop = in_step.stop
        recorder = None
        if options.parity:
            recorder = StateRecorder(prepared.plan, mirrored.blueprints, mirrored.shapes)
            show.witnesses.append(partial(show.record, recorder=recorder))
        if options.pictures.any or options.on_picture:
            view = first_view(prepared.plan, options.pictures)
            camera = stack.enter_context(
                watch_from_above(server, view, options.pictures, options.on_picture)
            )
            show.witnesses.append(lambda step: _follow_ego(camera, prepared.plan, step))
        if options.on_step is not None:
            show.on_shown = options.on_step

        def ended(folder: Path) -> None:
            if recorder is not None:
                recorder.write(folder, run.map.drawing)

        result = carry_out(run, prepared, progress=progress, ended=ended, live=in_step)
        show.conclude()
    report.left_behind = server.left_behind
    return result, report


def _follow_ego(camera: Camera, plan: Plan, step: Step) -> None:
    for k in np.flatnonzero(np.array([plan.actors[row].ego for row in step.index.tolist()])):
        camera.follow(float(step.x[k]), float(step.y[k]), float(step.z[k]))


class _Show:
    """What is done after each step of SUMO's."""

    def __init__(
        self,
        server: Server,
        mirrored: MirroredPlan,
        heads: Heads,
        ticks: int,
        report: CosimReport,
        interrupted: threading.Event,
    ) -> None:
        self.stop: Callable[[], None] = lambda: None
        self.witnesses: list[Callable[[Step], None]] = []
        self.on_shown: Callable[[Step], bool] = lambda _step: True
        self._server = server
        self._mirror = mirrored.mirror
        self._heads = heads
        self._ego = mirrored.ego
        self._ticks = ticks
        self._report = report
        self._interrupted = interrupted
        self._joined = server.take_lights()
        self._states: dict[str, str] = {}
        self._own: list[float] = []
        known = heads.signals
        report.signals = len(known & self._joined.keys())
        report.signals_missing = sorted(known - self._joined.keys())

    def on_step(self, step: Step) -> EgoPose | None:
        """Show a step; an error ends the run, whose results are kept."""
        if self._interrupted.is_set():
            self._report.interrupted = True
            self.stop()
            return None
        try:
            self._show(step)
            for witness in self.witnesses:
                witness(step)
            if not self.on_shown(step):
                self.stop()
                return None
            return self._ego.driven(step) if self._ego else None
        except CarlaError as error:
            self._report.error = str(error)
            self.stop()
            return None

    def record(self, step: Step, recorder: StateRecorder) -> None:
        """Let a recorder take down a step that has just been shown."""
        shown = self._server.light_states()
        pairs = {
            signal: (state, shown[self._joined[signal]])
            for signal, state in self._states.items()
            if signal in self._joined
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
        report.interruptions = self._server.interruptions
        if self._own:
            median, worst = np.percentile(np.array(self._own) * 1e3, [50, 95])
            report.own_ms = round(float(median), 3), round(float(worst), 3)

    def _show(self, step: Step) -> None:
        for number, batch in enumerate(self._timed(step), start=1):
            if number == self._ticks:
                batch.signals.update(self._changed_lights(step))
            waited = self._server.waited
            start = time.perf_counter()
            self._mirror.answered(self._server.apply(batch))
            took = time.perf_counter() - start
            self._own[-1] += took - (self._server.waited - waited)
            self._report.ticks += 1

    def _timed(self, step: Step) -> Iterator[Any]:
        """Batches of a step; what planning each one takes is counted as ours."""
        batches = self._mirror.batches(step, self._ticks)
        while True:
            start = time.perf_counter()
            batch = next(batches, None)
            if batch is None:
                return
            self._own.append(time.perf_counter() - start)
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


@contextmanager
def interrupts() -> Iterator[threading.Event]:
    """Let Ctrl-C and SIGTERM end a run between two steps; a second Ctrl-C ends it at once.

    Everything is still given back then. Outside the main thread nothing can be caught.
    """
    stopping = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield stopping
        return

    def tell(number: int, _frame: object) -> None:
        if stopping.is_set() and number == signal.SIGINT:
            raise KeyboardInterrupt
        stopping.set()

    kept = {number: signal.signal(number, tell) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield stopping
    finally:
        for number, handler in kept.items():
            signal.signal(number, handler)
