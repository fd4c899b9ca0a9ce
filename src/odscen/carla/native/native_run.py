"""A scenario driven by CARLA alone, from the document to a run folder like that of ``odscen run``.

The folder has the same files, so that reports, replays and scripts work on it. Two things are not
SUMO's: no vehicle is teleported, and collisions are not recorded.
"""

from __future__ import annotations

import multiprocessing
import signal
import time
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, ClassVar

from odscen.app.running.runs import carry_out, check_file, prepare_run
from odscen.base.errors import CarlaError, InputError
from odscen.carla.native.native_plan import native_actors
from odscen.carla.native.native_worker import NativeJob, Note, Shot, Tick, work
from odscen.carla.sensors.camera import first_view
from odscen.carla.sensors.pictures import Wish
from odscen.carla.server.carla_server import Server
from odscen.carla.server.client import Address
from odscen.carla.server.environment import weather_parameters
from odscen.carla.server.interruption import interrupts
from odscen.records.run_events import EventKind
from odscen.runs import layout
from odscen.runs.new_run import SimulationOutcome, refuse_finished_run
from odscen.runs.reporter import SILENT, Progress
from odscen.runs.run_settings import AS_DESIGNED
from odscen.scenario.document.problems import warning
from odscen.simulators.base import RoutedRun, Simulator
from odscen.simulators.positions import write_records, write_trajectories
from odscen.sumo.realize.run_map import RunMap
from odscen.sumo.worker.protocol import Done, Failed

if TYPE_CHECKING:
    import threading
    from collections.abc import Callable
    from multiprocessing.connection import Connection
    from pathlib import Path

    import numpy as np

    from odscen.carla.native.native_worker import Told
    from odscen.maps.store import Workspace
    from odscen.records.run_events import Event
    from odscen.runs.finished_run import Run
    from odscen.runs.reporter import Reporter
    from odscen.runs.run_settings import RunSettings
    from odscen.scenario.document.problems import Problem
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.simulators.base import SimulatedMap

LOG_FILE = "carla.log"
USUAL_TICK = 0.05
"""Seconds of a tick at most, and those that the Traffic Manager takes for granted where it moves
vehicles without physics (``HYBRID_MODE_DT`` of LibCarla)."""
GRACE = 30.0
"""Seconds that the worker has for giving the server back."""
SILENCE = 60.0
"""Seconds without a tick, at least, after which a worker that has made some is ended; with a
server's time-out of more than a sixth of it, six time-outs. Each wait in a tick has one."""
_LOOK = 0.5
"""Seconds between two looks at whether the run is to end."""


@dataclass(frozen=True, slots=True)
class NativeOptions:
    """How CARLA is to drive.

    Attributes
    ----------
    address
        Of the server.
    tick
        Simulated seconds of a tick; the scenario's step, but at most 0.05, if not given. Without
        physics it is 0.05.
    physics
        Whether vehicles have their own physics; see
        :class:`odscen.carla.native.native_traffic.Traffic`.
    on_picture
        Called with each picture as JPEG.

    Raises
    ------
    InputError
        If there is another tick than 0.05 s without physics.
    """

    address: Address = field(default_factory=Address)
    tick: float | None = None
    load_map: bool = True
    physics: bool = True
    pictures: Wish = field(default_factory=Wish)
    on_picture: Callable[[bytes], None] | None = None

    def __post_init__(self) -> None:
        if not self.physics and self.tick not in (None, USUAL_TICK):
            raise InputError(
                f"without physics the Traffic Manager moves vehicles by {USUAL_TICK:g} s in each "
                f"tick, so a tick of {self.tick:g} s would change their speed: leave it out",
                element="tick",
            )


@dataclass(slots=True)
class NativeReport:
    """What is to be known of a run besides its folder: notes in words, and whether it was ended."""

    notes: list[str] = field(default_factory=list)
    interrupted: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class NativeRun(RoutedRun):
    """A planned run with what CARLA has to be told of it."""

    scenario: Scenario
    on: RunMap


class CarlaNative(Simulator[NativeRun]):
    """CARLA alone: its Traffic Manager and its walkers, without SUMO.

    Parameters
    ----------
    address
        Of the server, ``HOST:PORT``.
    physics
        Whether vehicles have their own physics.

    Attributes
    ----------
    report
        What is to be known of the last run.
    """

    label = "CARLA alone"
    options: ClassVar = {
        "type": "object",
        "properties": {
            "address": {
                "type": "string",
                "title": "Address of the CARLA server",
                "default": "127.0.0.1:2000",
            },
            "physics": {
                "type": "boolean",
                "title": "Vehicles have physics",
                "default": True,
            },
        },
    }

    def __init__(self, address: str = "127.0.0.1:2000", physics: bool = True) -> None:
        self.driving = NativeOptions(address=Address.parse(address), physics=physics)
        self.report = NativeReport()

    @classmethod
    def with_options(cls, options: NativeOptions) -> CarlaNative:
        """Make one that drives in a certain way.

        Raises
        ------
        MissingDependencyError
            If pictures are wanted and cannot be made.
        """
        if options.pictures.any or options.on_picture:
            options.pictures.check()
        made = cls()
        made.driving = options
        return made

    def unsupported(self, scenario: Scenario, on: SimulatedMap) -> tuple[Problem, ...]:
        """List what CARLA alone does not do of a scenario."""
        del on
        return tuple(warning("not_in_carla", where, words) for where, words in left_out(scenario))

    def prepare(
        self, scenario: Scenario, on: SimulatedMap, settings: RunSettings, reporter: Reporter
    ) -> NativeRun:
        """Plan the run: SUMO has no part in it, and there are no files of its own."""
        del reporter
        if not isinstance(on, RunMap):
            raise TypeError("runs in CARLA are planned on maps of the catalogue")
        routed = on.routed_run(scenario, replace(settings, slice_length=None))
        values = {name: getattr(routed, name) for name in RoutedRun.__dataclass_fields__}
        values["about"] = {**routed.about, "meso": False, "driven_by": "carla"}
        return NativeRun(**values, scenario=scenario, on=on)

    def run(self, prepared: NativeRun, folder: Path, reporter: Reporter) -> SimulationOutcome:
        """Let CARLA drive; Ctrl-C ends it between two ticks, and what it did so far is kept."""
        options, plan, on = self.driving, prepared.plan, prepared.on
        report = self.report = NativeReport()
        usual = min(plan.step_length, USUAL_TICK) if options.physics else USUAL_TICK
        job = NativeJob(
            address=options.address,
            plan=plan,
            assets=on.assets,
            actors=native_actors(prepared.scenario, on.graph, plan),
            delta=options.tick or usual,
            map_name=on.name,
            xodr=on.file("xodr").read_bytes().decode(),
            log=folder / LOG_FILE,
            view=first_view(plan, options.pictures),
            weather=weather_parameters(prepared.scenario.environment, on.assets),
            load_map=options.load_map,
            physics=options.physics,
            pictures=options.pictures,
            watched=options.on_picture is not None,
        )
        with interrupts() as interrupted:
            follower = _Follower(job, folder, report, reporter, options.on_picture)
            outcome = follower.run(interrupted)
            report.interrupted = interrupted.is_set()
        for words in report.notes:
            reporter.said(words)
        return outcome


def run_native(
    workspace: Workspace,
    path: Path,
    options: NativeOptions,
    *,
    settings: RunSettings = AS_DESIGNED,
    out: Path | None = None,
    overwrite: bool = False,
    reporter: Reporter = SILENT,
) -> tuple[Run, NativeReport]:
    """Let CARLA's Traffic Manager and walkers run a scenario, see :class:`CarlaNative`.

    Parameters
    ----------
    path
        Scenario file.
    options
        How CARLA drives.
    settings
        How it is run; always in one piece.
    out
        Folder that gets the run's folder; the workspace's ``runs`` if not given.
    overwrite
        Whether a run that has ended is replaced in ``out``; in the workspace's ``runs`` it is.
    reporter
        Hears, in this thread, of each part of the scenario that CARLA will not do, of each tick,
        and of what else is to be known.

    Raises
    ------
    ScenarioError
        If the scenario has errors.
    MissingDependencyError
        If pictures are wanted and cannot be made.
    """
    native = CarlaNative.with_options(options)
    run = check_file(workspace, path, out=out, settings=settings, simulator=native)
    if out is not None and not overwrite:
        refuse_finished_run(run.folder)
    for problem in run.unsupported:
        reporter.said(problem.message)
    return carry_out(run, prepare_run(run), reporter=reporter), native.report


def left_out(scenario: Scenario) -> list[tuple[str, str]]:
    """What CARLA alone does not do of a scenario: where each part and rule is, and words for it."""
    having = {
        "crosses_anywhere": [actor.id for actor in scenario.actors if actor.crosses_anywhere],
        "ignores_red": [actor.id for actor in scenario.actors if actor.ignores_red],
        "initial_speed": [actor.id for actor in scenario.actors if actor.initial_speed is not None],
    }
    parts = [("actors", f"{name} of {', '.join(ids)}") for name, ids in having.items() if ids]
    for index, measure in enumerate(scenario.measures):
        parts.append((f"measures[{index}]", f"measure {measure.id} ({measure.kind})"))
    for index, rule in enumerate(scenario.rules):
        actions = ", ".join(action.kind for item in rule.then for action in item.parts)
        parts.append((f"rules[{index}]", f"rule {rule.id} of {rule.actor}: {actions}"))
    if scenario.demand.parking.begin or scenario.demand.parking.end:
        parts.append(("demand.parking", "parking at the begin and end of trips"))
    return [(where, f"CARLA alone does not do {words}") for where, words in parts]


class _Follower:
    """Starts the worker, takes down what it tells, and writes it when it has ended."""

    def __init__(
        self,
        job: NativeJob,
        folder: Path,
        report: NativeReport,
        reporter: Reporter,
        on_picture: Callable[[bytes], None] | None,
    ) -> None:
        self._job = job
        self._folder = folder
        self._notes = report.notes
        self._reporter = reporter
        self._on_picture = on_picture
        self._events: list[Event] = []
        self._times: list[float] = []
        self._rows: list[np.ndarray] = []
        self._own: tuple[int, ...] = ()
        self._silent = 0.0

    def run(self, interrupted: threading.Event) -> SimulationOutcome:
        """Run the worker to its end, whatever that is; what it reported until then is written."""
        start = time.perf_counter()
        context = multiprocessing.get_context("spawn")
        here, there = context.Pipe()
        process = context.Process(target=work, args=(self._job, there), daemon=True)
        process.start()
        there.close()
        try:
            last = self._follow_worker(here, interrupted)
        finally:
            here.close()  # the worker sees that, and gives the server back
            process.join(0.0 if self._silent else GRACE)
            if process.is_alive():
                process.kill()
                process.join()
        if last is None:
            self._clear_up()
        plan = self._job.plan
        write_records(plan, self._events, self._folder)
        trajectories = self._folder / layout.TRAJECTORIES_FILE
        write_trajectories(plan, self._times, self._rows, trajectories)
        seconds = time.perf_counter() - start
        if isinstance(last, Done):
            return SimulationOutcome(last.sim_seconds, last.steps, seconds, stopped=last.stopped)
        failure = (
            last.reason if isinstance(last, Failed) else self._explain_crash(process.exitcode or 0)
        )
        return SimulationOutcome(None, None, seconds, error=failure)

    def _follow_worker(
        self, pipe: Connection, interrupted: threading.Event
    ) -> Done | Failed | None:
        last: Done | Failed | None = None
        asked = False
        heard = time.monotonic()
        while True:
            if (interrupted.is_set() or self._reporter.cancelled) and not asked:
                asked = True
                with suppress(OSError):  # it has just ended
                    pipe.send("stop")
            try:
                if not pipe.poll(_LOOK):
                    if self._times and time.monotonic() - heard > self._silence_limit:
                        self._silent = time.monotonic() - heard
                        return last
                    continue
                message: Told = pipe.recv()
            except (EOFError, ConnectionResetError):
                return last
            heard = time.monotonic()
            if isinstance(message, Done | Failed):
                last = message
            elif isinstance(message, Note):
                self._notes.append(message.words)
            elif isinstance(message, Shot):
                if self._on_picture is not None:
                    self._on_picture(message.jpeg)
            else:
                self._take_tick(message)

    @property
    def _silence_limit(self) -> float:
        return max(SILENCE, 6.0 * self._job.address.timeout)

    def _take_tick(self, tick: Tick) -> None:
        self._own = tick.own
        self._events += tick.events
        self._notes += tick.notes
        self._times.append(tick.time)
        self._rows.append(tick.rows)
        plan = self._job.plan
        count = [event.kind for event in self._events].count
        departed, arrived = count(EventKind.DEPARTED), count(EventKind.ARRIVED)
        self._reporter.advanced(
            Progress(tick.time, plan.until, tick.running, departed, arrived, len(plan.actors))
        )

    def _clear_up(self) -> None:
        """Take away what a worker that has died has left, if its server answers in time."""
        deadline = time.monotonic() + GRACE
        while self._job.address.listens() and time.monotonic() < deadline:
            with suppress(CarlaError), Server(self._job.address) as server:
                server.inherit(self._own)
                return
        self._notes.append(
            f"the CARLA server at {self._job.address} did not answer any more: what was made "
            "there, if it still runs, could not be taken back"
        )

    def _explain_crash(self, code: int) -> str:
        """Say what an exit code means: the Traffic Manager aborts when it meets an error."""
        job = self._job
        if self._silent:
            return (
                f"the process that drives CARLA gave no sign for {self._silent:.0f} s and was "
                f"ended; see {LOG_FILE}"
            )
        if code == -signal.SIGABRT:
            return (
                f"CARLA's Traffic Manager has given up: the server at {job.address} has "
                f"gone away or has not answered for {job.address.timeout:g} s; see {LOG_FILE}"
            )
        return f"the process that drives CARLA ended with exit code {code}; see {LOG_FILE}"
