"""Runs that a page has started: one worker process and one thread each."""

from __future__ import annotations

import hashlib
import itertools
import json
import re
import threading
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from odscen.carla.served import ServedJob, run_served
from odscen.catalog.folders import discard
from odscen.catalog.store import check_name
from odscen.durations import clock
from odscen.errors import ConflictError, InputError, NotFoundError, OdscenError, WorkspaceError
from odscen.scenario.files import dumps
from odscen.scenario.problems import refuse_errors
from odscen.sumo import layout
from odscen.sumo.live import Live
from odscen.sumo.long_runs import about
from odscen.sumo.prepare import prepare, write_report
from odscen.sumo.progress import Command, Failed, Pace
from odscen.sumo.runner import run_prepared
from odscen.sumo.snapshots import origin
from odscen.sumo.status import going, read_status
from odscen.web.messages import RunInfo, RunProgress, RunState
from odscen.workflow import SUFFIX, check_scenario, load_map

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.carla.client import Address
    from odscen.catalog.store import Workspace
    from odscen.results.records import Plan
    from odscen.scenario.document import Scenario
    from odscen.web.messages import Control, NewRun

MOST = 8
"""Runs that can go on at a time."""
PATIENCE = 5.0
"""Wall seconds that runs have for their end when the server ends."""


@dataclass(slots=True, eq=False)
class Active:
    """A run that this server has started.

    Attributes
    ----------
    plan
        What is to happen; ``None`` while it is prepared.
    carla
        Whether a CARLA server shows it too.
    """

    id: str
    scenario: Scenario
    live: Live
    plan: Plan | None = None
    finishing: bool = False
    carla: bool = False
    error: str | None = None
    ended: RunState | None = None
    future: Future[None] = field(default_factory=Future)

    @property
    def state(self) -> RunState:
        """What it does now."""
        if self.ended is not None:
            return self.ended
        if self.finishing or self.live.ended:
            return "finishing"
        if self.live.progress is None and self.live.picture.number == 0:
            return "preparing"
        return "paused" if self.live.pace.paused else "running"

    def end(self, state: RunState, error: str | None = None) -> None:
        """Say how it has ended."""
        self.error = error
        self.ended = state
        self.live.wake()


class Runs:
    """Runs in a workspace, going on and finished."""

    def __init__(self, workspace: Workspace, carla: Address) -> None:
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
        refuse_errors(check_scenario(self._workspace, scenario))
        with self._lock:
            if sum(one.ended is None for one in self._active.values()) >= MOST:
                msg = f"{MOST} runs are going on; stop one, or wait for the end of one"
                raise ConflictError(msg)
            if wish.carla and any(one.carla and one.ended is None for one in self._active.values()):
                msg = "CARLA shows another run already; stop that one, or wait for its end"
                raise ConflictError(msg)
            pace = Pace(paused=wish.paused, speed=wish.speed)
            active = Active(self._free_id(name), scenario, Live(pace), carla=wish.carla)
            self._active[active.id] = active
        active.future = self._pool.submit(self._run, active, wish)
        return active.id

    def active(self, run: str) -> Active:
        """Return a run that this server has started.

        Raises
        ------
        NotFoundError
            If it has not.
        """
        with self._lock:
            if run not in self._active:
                what = "run of this server"
                raise NotFoundError(what, run, list(self._active))
            return self._active[run]

    def control(self, run: str, control: Control) -> RunInfo:
        """Steer a run.

        Raises
        ------
        ConflictError
            If it has ended.
        """
        active = self.active(run)
        if active.live.ended:
            msg = f"run {run!r} has ended"
            raise ConflictError(msg)
        active.live.command(Command(control.action, control.speed))
        return self.info(run)

    def info(self, run: str) -> RunInfo:
        """One run, going on or finished; :class:`NotFoundError` if there is none of that id."""
        with self._lock:
            active = self._active.get(run)
        if active is None:
            return self._finished(run)
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
            summary=self._summary(run) if over else None,
            error=active.error,
            finished=self._end_time(run) if over else None,
        )

    def rows(self, *, scenario: str | None = None) -> list[RunInfo]:
        """Runs, without their summaries; the newest last.

        ``scenario`` is the name of a scenario file, if only its runs are wanted.
        """
        wanted = (lambda _run: True) if scenario is None else _names_of(scenario).fullmatch
        with self._lock:
            names = dict.fromkeys(filter(wanted, self._active))
        folders = self._workspace.runs.iterdir() if self._workspace.runs.is_dir() else ()
        found = [
            (file.stat().st_mtime, path)
            for path in folders
            if wanted(path.name) and (file := _shown(path))
        ]
        done = [path for _, path in sorted(found)]
        order = dict.fromkeys([*(p.name for p in done if p.name not in names), *names])
        rows = []
        for name in order:
            with suppress(InputError):  # not a name of ours, or just removed
                rows.append(self.info(name).model_copy(update={"summary": None}))
        return rows

    def folder(self, run: str) -> Path:
        """Folder of a run that is finished, or in slices and interrupted.

        Raises
        ------
        NotFoundError
            If there is none.
        """
        folder = self._workspace.runs / check_name(run, what="run")
        if _shown(folder) is None:
            what = "finished run"
            raise NotFoundError(what, run, [])
        return folder

    def content(self, run: str) -> str:
        """Digest of what a finished run's scenario says, its name and description left out."""
        try:
            text = (self.folder(run) / layout.SCENARIO_FILE).read_text(encoding="utf-8")
            said = json.loads(text)
            said.pop("name", None)
            said.pop("description", None)
        except (OSError, ValueError, AttributeError) as error:
            what = "scenario of run"
            raise NotFoundError(what, run, []) from error
        return hashlib.sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()

    def remove(self, run: str) -> None:
        """Remove a finished or interrupted run."""
        with self._lock:
            active = self._active.get(run)
            if active is not None and active.ended is None:
                msg = f"run {run!r} is going on; stop it first"
                raise ConflictError(msg)
            self._active.pop(run, None)
        if active is not None and not (self._workspace.runs / run).exists():
            return  # it failed before it had anything to keep
        folder = self.folder(run)
        if going(folder) == "running":
            msg = f"run {run!r} is going on in another process"
            raise ConflictError(msg)
        try:
            discard(folder)
        except OSError as error:
            msg = f"run {run!r}: {error.strerror or error}"
            raise WorkspaceError(msg) from error

    def close(self) -> None:
        """Stop everything that is going on; what does not stop in time is ended."""
        with self._lock:
            going = [one for one in self._active.values() if one.ended is None]
        self._pool.shutdown(wait=False, cancel_futures=True)
        for one in going:
            one.live.command(Command("stop"))
        for one in going:
            try:
                one.future.exception(timeout=PATIENCE)
            except TimeoutError:
                one.live.kill()

    def _run(self, active: Active, wish: NewRun) -> None:
        try:
            state, error = self._simulate(active, wish)
        except OdscenError as wrong:
            active.end("failed", str(wrong))
        except BaseException as wrong:
            active.end("failed", f"{type(wrong).__name__}: {wrong}")
            raise
        else:
            active.end(state, error)

    def _simulate(self, active: Active, wish: NewRun) -> tuple[RunState, str | None]:
        scenario = active.scenario
        entry = self._workspace.map_for(scenario.map.name, scenario.map.sha256)
        loaded = load_map(entry)
        prepared = prepare(
            scenario,
            loaded.sumo,
            entry.path("net"),
            self._workspace.assets(),
            seed=wish.seed,
            until=wish.until,
            step_length=wish.step_length,
        )
        active.plan = prepared.plan
        active.live.wake()

        if wish.carla:
            return self._mirror(active, prepared.plan, wish)

        def finish(folder: Path, summary: Mapping[str, Any]) -> None:
            active.finishing = True
            write_report(folder, summary, drawing=loaded.drawing, sumo_map=loaded.sumo)

        out = self._workspace.runs / active.id
        result = run_prepared(prepared, out, finish=finish, live=active.live)
        if result.status == "failed":
            return "failed", str(result.summary["error"])
        return ("stopped" if result.summary["stopped"] else "completed"), None

    def _mirror(self, active: Active, plan: Plan, wish: NewRun) -> tuple[RunState, str | None]:
        """Run it in SUMO and in CARLA, in a process that has CARLA's client."""
        with TemporaryDirectory(prefix="odscen-") as folder:
            file = Path(folder) / f"{active.id}{SUFFIX}"
            file.write_text(dumps(active.scenario), encoding="utf-8")
            last = run_served(
                ServedJob(
                    workspace=str(self._workspace.root),
                    scenario=str(file),
                    log=str(Path(folder) / "carla.log"),
                    address=str(self._carla),
                    step_length=plan.step_length,
                    origin=origin(plan),
                    seed=wish.seed,
                    until=wish.until,
                    paused=wish.paused,
                    speed=wish.speed,
                ),
                active.live,
            )
        if isinstance(last, Failed):
            return "failed", last.reason
        return ("stopped" if last.stopped else "completed"), None

    def _free_id(self, name: str) -> str:
        for number in itertools.count(1):
            free = f"{_stem(name)}-{number}"
            if free not in self._active and not (self._workspace.runs / free).exists():
                return free
        raise AssertionError

    def _finished(self, run: str) -> RunInfo:
        folder = self.folder(run)
        if not (folder / layout.SUMMARY_FILE).is_file():
            return _unfinished(folder)
        summary = self._summary(folder.name) or {}
        failed = summary.get("status") != "completed"
        return RunInfo(
            run=run,
            state="failed" if failed else "stopped" if summary.get("stopped") else "completed",
            scenario=str(summary.get("scenario", run)),
            map=summary.get("map"),
            summary=summary,
            error=summary.get("error"),
            finished=self._end_time(folder.name),
        )

    def _end_time(self, run: str) -> float | None:
        try:
            return (self._workspace.runs / run / layout.SUMMARY_FILE).stat().st_mtime
        except OSError:
            return None

    def _summary(self, run: str) -> dict[str, Any] | None:
        try:
            text = (self._workspace.runs / run / layout.SUMMARY_FILE).read_text(encoding="utf-8")
            summary: dict[str, Any] = json.loads(text)
        except (OSError, ValueError):
            return None
        return summary


def _stem(scenario: str) -> str:
    """Beginning of the ids of a scenario's runs; a number follows."""
    return scenario[:56]


def _names_of(scenario: str) -> re.Pattern[str]:
    """Ids of a scenario's runs that a server has started."""
    return re.compile(rf"{re.escape(_stem(scenario))}-[1-9]\d*")


def _shown(folder: Path) -> Path | None:
    """Return the file that makes a folder a run: its summary, or its status if it has not ended."""
    files = (folder / name for name in (layout.SUMMARY_FILE, layout.STATUS_FILE))
    return next((file for file in files if file.is_file()), None)


def _unfinished(folder: Path) -> RunInfo:
    """Describe a run in slices that has not ended, from what it last said of itself."""
    status = read_status(folder) or {}
    at, until = float(status.get("time", 0.0)), float(status.get("until", 0.0))
    state: RunState = going(folder) or "interrupted"
    told = f"Interrupted at {clock(at)} of {clock(until)} h. odscen resume {folder.name} goes on."
    return RunInfo(
        run=folder.name,
        state=state,
        scenario=str(status.get("scenario", folder.name)),
        map=about(folder).get("map"),
        progress=RunProgress(
            time=at,
            until=until,
            **{key: status.get(key, 0) for key in ("running", "departed", "arrived", "planned")},
        ),
        error=told if state == "interrupted" else None,
    )
