"""Runs that a page has started: one worker process and one thread each."""

from __future__ import annotations

import itertools
import shutil
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import asdict, replace
from typing import TYPE_CHECKING

from odscen.app.removal import KnownRun, known_runs, remove
from odscen.app.running.resumed_runs import resume
from odscen.app.running.runs import carry_out, check_run, prepare_run
from odscen.app.scenarios import SUFFIX, read_scenario
from odscen.base.atomic_folders import scratch_folder
from odscen.base.errors import ConflictError, InputError, NotFoundError, OdscenError
from odscen.carla.served.served_run import ServedJob, run_served
from odscen.records.run_plan import Plan
from odscen.runs import layout
from odscen.runs.recording import Recording
from odscen.runs.reporter import Reporter
from odscen.runs.run_settings import RunSettings
from odscen.runs.run_status import read_status
from odscen.scenario.document.json_form import dumps
from odscen.simulators.installed import (
    CARLA_MIRROR,
    CARLA_NATIVE,
    ESMINI,
    METADRIVE,
    SUMO,
    open_simulator,
)
from odscen.sumo.runner.live_run import Live
from odscen.sumo.runner.run_folder import SumoPreparedRun
from odscen.sumo.runner.sumo_simulator import SumoSimulator
from odscen.sumo.worker.behaviour.behaviour_doors import chosen_behaviour
from odscen.sumo.worker.protocol import Command, Failed, Pace
from odscen.sumo.worker.snapshots import origin
from odscen.web.kept_runs import KeptRuns, names_of_runs, numbered_stem
from odscen.web.large.large_runs import LargeRun
from odscen.web.live_view import Active
from odscen.web.wire.run_messages import RunForecast, RunInfo, RunProgress, RunState

if TYPE_CHECKING:
    from collections.abc import Callable

    from odscen.app.running.runs import CheckedRun
    from odscen.carla.server.client import Address
    from odscen.maps.store import Workspace
    from odscen.maps.wastebasket import RemovedItem
    from odscen.runs.finished_run import Run
    from odscen.runs.reporter import Progress
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.web.wire.run_messages import GoOn, NewRun, RunControl

MOST = 8
"""Runs that can go on at a time."""
PATIENCE = 5.0
"""Wall seconds that runs have for their end when the server ends."""


class PageReporter(Reporter):
    """Shows on the page how far a run is; the page can end it.

    ``watched`` runs have the page as their companion.
    """

    def __init__(self, active: Active, *, watched: bool) -> None:
        self._active, self._watched = active, watched

    def advanced(self, progress: Progress) -> None:
        if not self._watched:  # who watches a run in SUMO has heard it
            self._active.live.take(progress, b"")

    def said(self, words: str) -> None:
        self._active.preparing = words

    @property
    def cancelled(self) -> bool:
        return self._active.live.stop_wanted


class Runs:
    """Runs in a workspace, going on and finished."""

    def __init__(self, workspace: Workspace, carla: Address) -> None:
        self.kept = KeptRuns(workspace.runs)
        self._workspace = workspace
        self._carla = carla
        self._pool = ThreadPoolExecutor(max_workers=MOST, thread_name_prefix="run")
        self._lock = threading.Lock()
        self._active: dict[str, Active] = {}

    def start(self, name: str, scenario: Scenario, wish: NewRun) -> str:
        """Start a run of a scenario; its id.

        Raises
        ------
        ScenarioError
            If the scenario has errors.
        ConflictError
            If too many are going on, or CARLA shows another one.
        """
        if wish.simulator is not None and wish.simulator.name == CARLA_MIRROR:
            wish = wish.model_copy(update={"carla": True, "simulator": None})
        run = check_run(self._workspace, scenario, name=name, settings=self._settings_of_wish(wish))
        if wish.carla and (wish.every is not None or not wish.trajectories):
            raise InputError(
                "a run that CARLA shows is recorded step by step; leave every and trajectories out"
            )
        with self._lock:
            self._refuse_more()
            if wish.carla and any(
                active_run.carla and active_run.ended is None
                for active_run in self._active.values()
            ):
                raise ConflictError(
                    "CARLA shows another run already; stop that one, or wait for its end"
                )
            pace = Pace(paused=wish.paused, speed=wish.speed)
            active = Active(self._free_id(name), scenario, Live(pace), carla=wish.carla)
            self._active[active.id] = active
        run = replace(run, name=active.id, folder=self._workspace.runs / active.id)
        active.future = self._pool.submit(
            self._run_to_end, active, lambda: self._simulate_run(active, run, wish)
        )
        return active.id

    def start_large(self, name: str, wish: NewRun) -> str:
        """Start a run of a large scenario, all of it in a process of its own; parameters as above.

        Raises
        ------
        ScenarioError, ConflictError
            As :meth:`start`.
        """
        with self._lock:
            self._refuse_more()
        live = Live(Pace(paused=wish.paused, speed=wish.speed))
        file = self._workspace.scenarios / f"{name}{SUFFIX}"
        large = LargeRun(
            self._workspace, file, name=name, settings=self._settings_of_wish(wish), live=live
        )
        try:
            with self._lock:
                self._refuse_more()
                active = Active(self._free_id(name), large.scenario, live, forget=large.forget)
                self._active[active.id] = active
        except ConflictError:
            large.end()
            raise
        active.future = self._pool.submit(
            self._run_to_end, active, lambda: self._follow_large(active, large)
        )
        return active.id

    def resume(self, run: str, wish: GoOn) -> None:
        """Go on with an interrupted run.

        Raises
        ------
        NotFoundError
            If there is no such run.
        ConflictError
            If it has ended, is going on, or too many are.
        DamagedError
            If a file of it is not as it was written.
        """
        folder = self.kept.folder(run)
        if (state := self.info(run).state) != "interrupted":
            raise ConflictError(f"run {run!r} is {state}; only an interrupted one can be resumed")
        self.kept.whole(run)
        scenario = read_scenario(folder / layout.SCENARIO_FILE)
        plan = Plan.from_json((folder / layout.PLAN_FILE).read_text(encoding="utf-8"))
        with self._lock:
            self._refuse_more()
            active = Active(run, scenario, Live(Pace(speed=wish.speed)))
            active.prepared(plan)
            if (before := self._active.get(run)) is not None:
                before.forget()
            self._active[run] = active
        active.future = self._pool.submit(
            self._run_to_end, active, lambda: self._resume_run(active)
        )

    def forecast(self, scenario: Scenario, wish: NewRun) -> RunForecast:
        """What a run will need; takes as long as getting it ready.

        Raises
        ------
        ScenarioError
            If the scenario has errors.
        """
        settings = self._settings_of_wish(wish)
        prepared = prepare_run(
            check_run(self._workspace, scenario, name=wish.scenario, settings=settings)
        )
        if not isinstance(prepared, SumoPreparedRun) or prepared.expected is None:
            raise InputError("what a run will need is known of runs in SUMO only")
        expected = prepared.expected
        return RunForecast(
            planned=len(prepared.plan.actors),
            running=expected.running,
            disk=expected.disk,
            memory=expected.memory,
            free=shutil.disk_usage(self._workspace.root).free,
        )

    def active(self, run: str) -> Active:
        """Return a run that this server has started.

        Raises
        ------
        NotFoundError
            If it has not.
        """
        with self._lock:
            if run not in self._active:
                raise NotFoundError("run of this server", run, list(self._active))
            return self._active[run]

    def control(self, run: str, control: RunControl) -> RunInfo:
        """Steer a run.

        Raises
        ------
        ConflictError
            If it has ended.
        """
        active = self.active(run)
        if active.live.ended:
            raise ConflictError(f"run {run!r} has ended")
        if control.action == "interrupt":
            if not active.long:
                raise ConflictError(
                    f"run {run!r} is not in slices and could not be resumed; stop it"
                )
            active.interrupted = True
            active.live.kill()
            return self.info(run)
        active.live.command(Command(control.action, control.speed))
        return self.info(run)

    def info(self, run: str) -> RunInfo:
        """One run, going on or finished; :class:`NotFoundError` if there is none of that id."""
        with self._lock:
            active = self._active.get(run)
        if active is None:
            return self.kept.info(run)
        progress = active.live.progress
        over = active.ended is not None
        return RunInfo(
            run=run,
            state=active.state,
            scenario=active.scenario.name,
            map=active.scenario.map.name,
            speed=active.live.pace.speed,
            carla=active.carla,
            progress=None if progress is None else RunProgress(**asdict(progress)),
            summary=self.kept.summary(run) if over else None,
            error=active.error,
            finished=self.kept.end_time(run) if over else None,
            slices=self.kept.slices(run),
            preparing=active.preparing if active.state == "preparing" else None,
            clock=active.scenario.demand.clock,
        )

    def rows(self, *, scenario: str | None = None) -> list[RunInfo]:
        """Runs, without their summaries; the newest last.

        ``scenario`` is the name of a scenario file, if only its runs are wanted.
        """
        wanted = (
            (lambda _run: True)
            if scenario is None
            else names_of_runs(scenario, self._workspace.scenarios).fullmatch
        )
        with self._lock:
            names = dict.fromkeys(filter(wanted, self._active))
        done = [name for name in self.kept.by_age() if wanted(name) and name not in names]
        order = dict.fromkeys([*done, *names])
        rows = []
        for name in order:
            with suppress(InputError):  # not a name of ours, or just removed
                rows.append(self.info(name).model_copy(update={"summary": None}))
        return rows

    def remove(self, run: str) -> RemovedItem | None:
        """Move a finished or interrupted run into the wastebasket.

        Returns
        -------
        RemovedItem or None
            ``None`` if it failed before it had anything to keep.
        """
        with self._lock:
            active = self._active.get(run)
            if active is not None and active.ended is None:
                raise ConflictError(f"run {run!r} is under way; stop it first")
            self._active.pop(run, None)
        if active is not None:
            active.forget()
        if active is not None and not (self._workspace.runs / run).exists():
            return None
        self.kept.folder(run)
        return remove(self._workspace, "run", run)

    def known(self) -> list[KnownRun]:
        """All runs, those of this server that go on included."""
        with self._lock:
            going = {name: run for name, run in self._active.items() if run.ended is None}
        kept = [run for run in known_runs(self._workspace) if run.name not in going]
        maps = {name: run.scenario.map for name, run in going.items()}
        own = [KnownRun(name, of.name, of.sha256, live=True) for name, of in maps.items()]
        return [*kept, *own]

    def close(self) -> None:
        """Stop everything that is going on; what does not stop in time is ended."""
        with self._lock:
            going = [
                run_under_way
                for run_under_way in self._active.values()
                if run_under_way.ended is None
            ]
        self._pool.shutdown(wait=False, cancel_futures=True)
        for run_under_way in going:
            if run_under_way.long:  # can go on when there is a server again
                run_under_way.live.kill()
            run_under_way.live.command(Command("stop"))
        for run_under_way in going:
            try:
                run_under_way.future.exception(timeout=PATIENCE)
            except TimeoutError:
                run_under_way.live.kill()
        with self._lock:
            known = list(self._active.values())
        for run_under_way in known:
            run_under_way.forget()

    def _run_to_end(
        self, active: Active, simulate: Callable[[], tuple[RunState, str | None]]
    ) -> None:
        try:
            state, error = simulate()
        except OdscenError as wrong:
            active.end("failed", str(wrong))
        except BaseException as wrong:
            active.end("failed", f"{type(wrong).__name__}: {wrong}")
            raise
        else:
            active.end(state, error)

    def _simulate_run(
        self, active: Active, run: CheckedRun, wish: NewRun
    ) -> tuple[RunState, str | None]:
        reporter = PageReporter(active, watched=isinstance(run.simulator, SumoSimulator))
        prepared = prepare_run(run, reporter=reporter)
        active.prepared(prepared.plan)
        if wish.carla:
            return self._mirror_run(active, prepared.plan, run.settings, wish)

        result = carry_out(run, prepared, reporter=reporter, live=active.live)
        return _end_of(result, active)

    def _follow_large(self, active: Active, large: LargeRun) -> tuple[RunState, str | None]:
        def prepared(slice_length: float | None) -> None:
            active.introduction, active.slice_length = large.introduction, slice_length
            active.live.wake()

        def ended() -> None:
            active.finishing = True

        def preparing(words: str) -> None:
            active.preparing = words

        failed = large.follow(active.id, preparing=preparing, prepared=prepared, ended=ended)
        if failed is not None:
            return "failed", failed
        info = self.kept.info(active.id)
        return info.state, None if active.interrupted else info.error

    def _resume_run(self, active: Active) -> tuple[RunState, str | None]:
        folder = self._workspace.runs / active.id
        return _end_of(resume(self._workspace, folder, live=active.live), active)

    def _refuse_more(self) -> None:
        if sum(active_run.ended is None for active_run in self._active.values()) >= MOST:
            raise ConflictError(f"{MOST} runs are under way; stop one, or wait for the end of one")

    def _mirror_run(
        self, active: Active, plan: Plan, settings: RunSettings, wish: NewRun
    ) -> tuple[RunState, str | None]:
        """Run it in SUMO and in CARLA, in a process that has CARLA's client."""
        with scratch_folder() as folder:
            file = folder / f"{active.id}{SUFFIX}"
            file.write_text(dumps(active.scenario), encoding="utf-8")
            last = run_served(
                ServedJob(
                    workspace=str(self._workspace.root),
                    scenario=str(file),
                    log=str(folder / "carla.log"),
                    address=str(self._carla),
                    step_length=plan.step_length,
                    origin=origin(plan),
                    settings=settings,
                    paused=wish.paused,
                    speed=wish.speed,
                ),
                active.live,
            )
        if isinstance(last, Failed):
            return "failed", last.reason
        return ("stopped" if last.stopped else "completed"), None

    def _settings_of_wish(self, wish: NewRun) -> RunSettings:
        """How a run is wished for; a CARLA server is the one that the page was started with.

        Raises
        ------
        InputError
            If a behaviour model or simulator is not one of those installed, or not possible so.
        """
        driver, chosen = wish.behaviour, wish.simulator
        name, options = SUMO, {}
        if chosen is not None:
            name, options = chosen.name, dict(chosen.options)
            if name == CARLA_NATIVE:
                options["address"] = str(self._carla)
            if name == METADRIVE and "python" in options:
                words = "the Python that has MetaDrive is chosen where this server is started"
                raise InputError(words, element="python")
            if name == ESMINI and "program" in options:
                words = "the program of esmini is chosen where this server is started"
                raise InputError(words, element="program")
            open_simulator(name, options, installed_only=True)
        return RunSettings(
            seed=wish.seed,
            until=wish.until,
            step_length=wish.step_length,
            recording=Recording(trajectories=wish.trajectories, every=wish.every),
            behaviour=None if driver is None else chosen_behaviour(driver.name, driver.options),
            simulator=name,
            simulator_options=options,
        )

    def _free_id(self, name: str) -> str:
        for number in itertools.count(1):
            free = f"{numbered_stem(name)}-{number}"
            if free not in self._active and not (self._workspace.runs / free).exists():
                return free
        raise AssertionError


def _end_of(result: Run, active: Active) -> tuple[RunState, str | None]:
    """How a run has ended, and why, if it has not ended as planned."""
    if result.status == "completed":
        return ("stopped" if result.summary["stopped"] else "completed"), None
    if read_status(result.folder) is None:
        return "failed", str(result.summary["error"])
    return "interrupted", None if active.interrupted else str(result.summary["error"])
