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
from typing import TYPE_CHECKING

import numpy as np

from odscen.app.running.runs import carry_out, check_file, prepare_run
from odscen.base.errors import CarlaError, InputError
from odscen.base.frames import XodrPose, xodr_to_sumo
from odscen.carla.native.native_plan import native_actors
from odscen.carla.native.native_worker import NativeJob, Note, Shot, Tick, work
from odscen.carla.sensors.camera import first_view
from odscen.carla.sensors.pictures import Wish
from odscen.carla.server.carla_server import Server
from odscen.carla.server.client import Address
from odscen.carla.server.environment import weather_parameters
from odscen.carla.server.interruption import interrupts
from odscen.figures.measures.summary import actor_outcomes, actors_to_json
from odscen.records.run_events import Event, EventKind, events_to_json
from odscen.runs import layout
from odscen.runs.run_settings import AS_DESIGNED
from odscen.sumo.runner.worker_process import Ended
from odscen.sumo.worker.protocol import Done, Failed, Progress

if TYPE_CHECKING:
    import threading
    from collections.abc import Callable
    from multiprocessing.connection import Connection
    from pathlib import Path

    from odscen.app.running.runs import CheckedRun
    from odscen.carla.native.native_worker import Told
    from odscen.maps.store import Workspace
    from odscen.records.run_plan import Plan
    from odscen.runs.finished_run import Run
    from odscen.runs.run_settings import RunSettings
    from odscen.scenario.document.rules_document import StoryRule
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.worker.protocol import OnProgress

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


def run_native(
    workspace: Workspace,
    path: Path,
    options: NativeOptions,
    *,
    settings: RunSettings = AS_DESIGNED,
    out: Path | None = None,
    progress: OnProgress | None = None,
    tell: Callable[[str], None] | None = None,
) -> tuple[Run, NativeReport]:
    """Let CARLA's Traffic Manager and walkers run a scenario.

    Ctrl-C ends it between two ticks, and what it did so far is kept.

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
    progress
        Called in this thread with each tick.
    tell
        Called before the run with each part of the scenario that CARLA will not do.

    Raises
    ------
    ScenarioError
        If the scenario has errors.
    MissingDependencyError
        If pictures are wanted and cannot be made.
    """
    if options.pictures.any or options.on_picture:
        options.pictures.check()
    run = check_file(workspace, path, out=out, settings=replace(settings, slice_length=None))
    if tell is not None:
        for words in left_out(run.scenario):
            tell(words)
    prepared = prepare_run(run)
    plan = prepared.plan
    report = NativeReport()

    def simulate(folder: Path) -> Ended:
        job = _job(run, plan, options, log=folder / LOG_FILE)
        with interrupts() as interrupted:
            follower = _Follower(job, folder, report, progress, options.on_picture)
            ended = follower.run(interrupted)
            report.interrupted = interrupted.is_set()
        return ended

    # SUMO has no part in this: no files of its own, and no routes that it could not find.
    actors = tuple(replace(actor, problem=None) for actor in plan.actors)
    prepared = replace(
        prepared,
        plan=replace(plan, actors=actors),
        sumo_files={},
        problems=(),
        notes=(),
        about={**prepared.about, "driven_by": "carla"},
    )
    return carry_out(run, prepared, simulate=simulate), report


def left_out(scenario: Scenario) -> list[str]:
    """What CARLA alone does not do of a scenario, in words: a line for each part and rule."""
    parts = [
        *_actors_parts(scenario),
        *(f"measure {one.id} ({one.kind})" for one in scenario.measures),
        *(f"rule {one.id} of {one.actor}: {_actions(one)}" for one in scenario.rules),
    ]
    if scenario.demand.parking.begin or scenario.demand.parking.end:
        parts.append("parking at the begin and end of trips")
    return [f"CARLA alone does not do {words}" for words in parts]


def _actors_parts(scenario: Scenario) -> list[str]:
    """One line for each field of actors that only SUMO acts on, with the actors that have it."""
    having = {
        "crosses_anywhere": [one.id for one in scenario.actors if one.crosses_anywhere],
        "ignores_red": [one.id for one in scenario.actors if one.ignores_red],
        "initial_speed": [one.id for one in scenario.actors if one.initial_speed is not None],
    }
    return [f"{name} of {', '.join(ids)}" for name, ids in having.items() if ids]


def _actions(rule: StoryRule) -> str:
    return ", ".join(one.kind for item in rule.then for one in item.parts)


def _job(run: CheckedRun, plan: Plan, options: NativeOptions, *, log: Path) -> NativeJob:
    return NativeJob(
        address=options.address,
        plan=plan,
        assets=run.assets,
        actors=native_actors(run.scenario, run.map.sumo.graph, plan),
        delta=options.tick
        or (min(plan.step_length, USUAL_TICK) if options.physics else USUAL_TICK),
        map_name=run.entry.name,
        xodr=run.entry.read("xodr").decode(),
        log=log,
        view=first_view(plan, options.pictures),
        weather=weather_parameters(run.scenario.environment, run.assets),
        load_map=options.load_map,
        physics=options.physics,
        pictures=options.pictures,
        watched=options.on_picture is not None,
    )


class _Follower:
    """Starts the worker, takes down what it tells, and writes it when it has ended."""

    def __init__(
        self,
        job: NativeJob,
        folder: Path,
        report: NativeReport,
        progress: OnProgress | None,
        on_picture: Callable[[bytes], None] | None,
    ) -> None:
        self._job = job
        self._folder = folder
        self._notes = report.notes
        self._progress = progress
        self._on_picture = on_picture
        self._events: list[Event] = []
        self._times: list[float] = []
        self._rows: list[np.ndarray] = []
        self._own: tuple[int, ...] = ()
        self._silent = 0.0

    def run(self, interrupted: threading.Event) -> Ended:
        """Run the worker to its end, whatever that is; what it reported until then is written."""
        start = time.perf_counter()
        context = multiprocessing.get_context("spawn")
        here, there = context.Pipe()
        process = context.Process(target=work, args=(self._job, there), daemon=True)
        process.start()
        there.close()
        try:
            last = self._follow(here, interrupted)
        finally:
            here.close()  # the worker sees that, and gives the server back
            process.join(0.0 if self._silent else GRACE)
            if process.is_alive():
                process.kill()
                process.join()
        if last is None:
            self._clear_up()
        self._write()
        seconds = time.perf_counter() - start
        if isinstance(last, Done):
            return Ended(last, seconds, None)
        if isinstance(last, Failed):
            return Ended(None, seconds, last.reason)
        return Ended(None, seconds, self._crash(process.exitcode or 0))

    def _follow(self, pipe: Connection, interrupted: threading.Event) -> Done | Failed | None:
        last: Done | Failed | None = None
        asked = False
        heard = time.monotonic()
        while True:
            if interrupted.is_set() and not asked:
                asked = True
                with suppress(OSError):  # it has just ended
                    pipe.send("stop")
            try:
                if not pipe.poll(_LOOK):
                    if self._times and time.monotonic() - heard > self._patience:
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
                self._take(message)

    @property
    def _patience(self) -> float:
        return max(SILENCE, 6.0 * self._job.address.timeout)

    def _take(self, tick: Tick) -> None:
        self._own = tick.own
        self._events += tick.events
        self._notes += tick.notes
        self._times.append(tick.time)
        self._rows.append(tick.rows)
        if self._progress is not None:
            plan = self._job.plan
            count = [event.kind for event in self._events].count
            departed, arrived = count(EventKind.DEPARTED), count(EventKind.ARRIVED)
            planned = len(plan.actors)
            self._progress(
                Progress(tick.time, plan.until, tick.running, departed, arrived, planned)
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

    def _crash(self, code: int) -> str:
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

    def _write(self) -> None:
        plan = self._job.plan
        events = tuple(sorted(self._events, key=lambda event: event.time))
        outcomes = actor_outcomes(plan, events)
        folder = self._folder
        (folder / layout.EVENTS_FILE).write_text(events_to_json(events), encoding="utf-8")
        (folder / layout.ACTORS_FILE).write_text(actors_to_json(outcomes), encoding="utf-8")
        write_trajectories(plan, self._times, self._rows, folder / layout.TRAJECTORIES_FILE)


def write_trajectories(plan: Plan, times: list[float], rows: list[np.ndarray], file: Path) -> None:
    """Write states per tick in the columns and the frame that SUMO's own recording has."""
    import polars as pl

    table = np.concatenate([np.empty((0, 7)), *rows])
    index = table[:, 0].astype(np.int64)
    length = np.array([actor.length for actor in plan.actors])
    _, x, y, z, hdg, pitch, speed = table.T
    front = xodr_to_sumo(
        XodrPose(x, y, z, hdg, pitch), length=length[index], net_offset=plan.net_offset
    )
    names = [actor.id for actor in plan.actors]
    pl.DataFrame(
        {
            "timestep_time": np.repeat(np.array(times), [len(part) for part in rows]),
            "vehicle_id": pl.Series([names[row] for row in index], dtype=pl.String),
            "vehicle_x": np.asarray(front.x),
            "vehicle_y": np.asarray(front.y),
            "vehicle_z": np.asarray(front.z),
            "vehicle_angle": np.asarray(front.angle_deg),
            "vehicle_speed": speed,
        }
    ).write_parquet(file)
