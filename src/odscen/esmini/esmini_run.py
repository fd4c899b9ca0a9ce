"""A scenario in esmini: its OpenSCENARIO export played by the program of the user, as a run.

esmini is started without a window. What it logs after each step is the run; the same scenario has
run in SUMO before, and both are compared.
"""

from __future__ import annotations

import json
import math
import os
import re
import shutil
import subprocess
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from odscen.base.atomic_folders import passing_folder
from odscen.base.errors import InputError, MissingDependencyError
from odscen.esmini.esmini_log import EsminiLog
from odscen.formats.base import NOTES_SUFFIX, ExportSource, RecordedRun
from odscen.formats.openscenario_format import write_openscenario
from odscen.runs.new_run import PreparedRun, SimulationOutcome
from odscen.runs.recorded import read_light_states
from odscen.scenario.document.problems import warning
from odscen.simulators.base import Simulator
from odscen.sumo.realize.realization import as_run
from odscen.sumo.realize.run_map import RunMap
from odscen.sumo.runner.sumo_simulator import SumoSimulator
from odscen.sumo.runner.tracked_run import ShownRun, ShownUser, simulate_tracked

if TYPE_CHECKING:
    from collections.abc import Iterator

    from odscen.esmini.esmini_log import LoggedEntity
    from odscen.formats.base import ExportFiles
    from odscen.runs.reporter import Progress, Reporter
    from odscen.runs.run_settings import RunSettings
    from odscen.scenario.document.problems import Problem
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.simulators.base import SimulatedMap
    from odscen.sumo.runner.run_folder import SumoPreparedRun
    from odscen.sumo.runner.tracked_run import SumoTracks

PROGRAM_VARIABLE = "ODSCEN_ESMINI"
"""Names the program, where no option does."""
PLAYS = ("run", "story")
"""What esmini is given: SUMO's run, each road user along its line; or actors and rules."""
LOG_FILE = "esmini.log"
SILENCE = 300.0
"""Seconds without a step after which esmini is ended."""
_LOOK = 0.05
_VERSION = "1.2"
_NAME = "scenario"
_RELEASE = re.compile(r"esmini GIT REV: (\S+)")
NOT_IN_FILE = "it is traffic, which is not in the file that esmini plays"


@dataclass(frozen=True, slots=True, kw_only=True)
class EsminiRun(PreparedRun):
    """A planned run with that of SUMO which it is compared to."""

    scenario: Scenario
    on: RunMap
    sumo: SumoPreparedRun


class Esmini(Simulator[EsminiRun]):
    """The export of a scenario, or of SUMO's run of it, in the program esmini.

    Parameters
    ----------
    play
        One of :data:`PLAYS`.
    program
        Path of esmini; if empty that of ``ODSCEN_ESMINI``, or ``esmini`` of the search path.

    Raises
    ------
    InputError
        If ``play`` is another word.
    """

    label = "esmini"
    options: ClassVar = {
        "type": "object",
        "properties": {
            "play": {
                "type": "string",
                "enum": [*PLAYS],
                "title": "What esmini plays",
                "default": "run",
            },
            "program": {"type": "string", "title": "Program", "default": ""},
        },
    }

    def __init__(self, play: str = "run", program: str = "") -> None:
        if play not in PLAYS:
            raise InputError(f"{play!r} is none of {', '.join(PLAYS)}", element="play")
        self.play = play
        self._program = program

    @property
    def program(self) -> str:
        """The program as it is called: it is started in another folder."""
        named = self._program or os.environ.get(PROGRAM_VARIABLE, "") or "esmini"
        there = shutil.which(named)
        return named if there is None else str(Path(there).absolute())

    def unsupported(self, scenario: Scenario, on: SimulatedMap) -> tuple[Problem, ...]:
        """List what the file that esmini is given does not say of a scenario."""
        if self.play == "run" or not isinstance(on, RunMap):
            return ()
        notes = json.loads(str(_write_scenario(scenario, on)[_NAME + NOTES_SUFFIX]))
        found = [
            warning(
                "not_in_esmini",
                row["place"],
                f"{row['place']} is not in the file for esmini: {row['reason']}",
            )
            for row in notes["left_out"]
        ]
        found += [
            warning(
                "not_in_esmini",
                row["place"],
                f"{row['place']} is not quite the same in the file for esmini: {row['reason']}",
            )
            for row in notes["approximated"]
        ]
        return tuple(found)

    def check_settings(self, settings: RunSettings) -> None:
        """Refuse what SUMO refuses, and runs without microscopic traffic."""
        # A behaviour model drives in SUMO's run.
        super().check_settings(replace(settings, behaviour=None))
        SumoSimulator().check_settings(settings)

    def prepare(
        self, scenario: Scenario, on: SimulatedMap, settings: RunSettings, reporter: Reporter
    ) -> EsminiRun:
        """Prepare SUMO's run, once it is known that esmini is there.

        Raises
        ------
        MissingDependencyError
            If the program that is named is not there, or is not esmini.
        TypeError
            If the map has no SUMO network.
        """
        if not isinstance(on, RunMap):
            raise TypeError("SUMO runs on maps of the catalogue, which have its network")
        release = self._ask_release()
        sumo = SumoSimulator().prepare(scenario, on, replace(settings, slice_length=None), reporter)
        plan = sumo.plan
        if self.play == "story":
            own = {actor.id for actor in scenario.actors}
            actors = (
                actor if actor.id in own else replace(actor, problem=NOT_IN_FILE)
                for actor in plan.actors
            )
            plan = replace(plan, actors=tuple(actors))
        return EsminiRun(
            plan=plan,
            settings=settings,
            scenario_json=sumo.scenario_json,
            problems=sumo.problems,
            notes=sumo.notes,
            about={**sumo.about, "driven_by": self.label, "esmini": {"play": self.play}},
            versions={**sumo.versions, "esmini": release},
            scenario=as_run(scenario, settings),
            on=on,
            sumo=sumo,
        )

    def run(self, prepared: EsminiRun, folder: Path, reporter: Reporter) -> SimulationOutcome:
        """Run SUMO, play the export in esmini, and compare both."""
        begin = time.perf_counter()
        with passing_folder(folder.parent) as staging:
            sumo_run = staging / "sumo-run"
            outcome, tracks = simulate_tracked(prepared.sumo, prepared.on, sumo_run, reporter)
            if outcome.sim_seconds is None or outcome.error or outcome.stopped:
                return SimulationOutcome(
                    None, None, outcome.wall_seconds, error=outcome.error or "it was stopped"
                )
            files = self._export_files(prepared, tracks, sumo_run, outcome.sim_seconds)
            place = staging / "esmini"
            place.mkdir()
            for name, content in files.items():
                if isinstance(content, str):
                    (place / name).write_text(content, encoding="utf-8")
                elif isinstance(content, bytes):
                    (place / name).write_bytes(content)
                else:
                    shutil.copyfile(content, place / name)
            rows = {
                actor.id: row
                for row, actor in enumerate(prepared.plan.actors)
                if actor.problem is None
            }
            shown = ShownRun(
                prepared, prepared.on, tracks, self.label, compared=frozenset(rows.values())
            )
            played = _Played(shown, rows, prepared.plan.until - prepared.plan.step_length / 2)
            error, stopped = self._play_files(place, folder / LOG_FILE, prepared, played, reporter)
        outcome = shown.write(folder)
        for words in (*shown.notes(), *played.notes()):
            reporter.said(words)
        return SimulationOutcome(
            outcome.sim_seconds if shown.steps else None,
            outcome.steps,
            time.perf_counter() - begin,
            error=error,
            stopped=stopped,
        )

    def _ask_release(self) -> str:
        try:
            asked = subprocess.run(
                [self.program, "--version"],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                timeout=60,
                check=False,
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            raise MissingDependencyError(
                f"esmini cannot be started: {self.program}: {error}; name its program: "
                f"--esmini PATH, or in the variable {PROGRAM_VARIABLE}"
            ) from error
        release = _RELEASE.search(asked.stdout.decode(errors="replace"))
        if release is None:
            raise MissingDependencyError(
                f"{self.program} is not esmini; name its program: --esmini PATH, or in the "
                f"variable {PROGRAM_VARIABLE}"
            )
        return release[1]

    def _export_files(
        self, prepared: EsminiRun, tracks: SumoTracks, sumo_run: Path, until: float
    ) -> ExportFiles:
        """Write what esmini plays."""
        if self.play == "story":
            scenario = prepared.scenario
            timing = {"duration": prepared.plan.until, "step_length": prepared.plan.step_length}
            simulation = scenario.simulation.model_copy(update=timing)
            scenario = scenario.model_copy(update={"simulation": simulation})
            return _write_scenario(scenario, prepared.on)
        import polars as pl

        names = [actor.id for actor in prepared.plan.actors]
        rows = pl.DataFrame(
            {
                "time": tracks.when.round(6),
                "id": pl.Series([names[row] for row in tracks.row], dtype=pl.String),
                **{name: getattr(tracks, name) for name in ("x", "y", "z", "hdg")},
            }
        )
        recorded = RecordedRun(
            prepared.plan.actors,
            rows.sort("id", "time"),
            read_light_states(sumo_run),
            until,
            prepared.plan.step_length,
        )
        return _write_scenario(prepared.scenario, prepared.on, recorded)

    def _play_files(
        self, place: Path, log: Path, prepared: EsminiRun, played: _Played, reporter: Reporter
    ) -> tuple[str | None, bool]:
        """Let esmini play; why it failed, and whether it was stopped."""
        limit = prepared.settings.time_limit
        end = math.inf if limit is None else time.monotonic() + limit
        table = place / "steps.csv"
        command = [
            self.program, "--osc", f"{_NAME}.xosc", "--headless", "--collision",
            "--fixed_timestep", f"{prepared.plan.step_length:g}",
            "--seed", str(prepared.scenario.seed),
            "--csv_logger", table.name, "--disable_log",
            # Otherwise headings at the vertices of a line are half-way to the next one's, and
            # vertices within 0.1 m are one.
            "--pline_interpolation", "segment", "--traj_filter", "0.0",
        ]  # fmt: skip
        with (
            log.open("wb") as said,
            subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=said,
                stderr=subprocess.STDOUT,
                cwd=place,
            ) as child,
        ):
            try:
                for text in _read_growing(table, child, reporter, end):
                    if not played.take(text):
                        child.kill()
                        return None, False
                    reporter.advanced(played.progress())
            except (TimeoutError, InputError) as error:
                child.kill()
                return str(error), False
            except BaseException:
                child.kill()
                raise
            if reporter.cancelled:
                child.kill()
                return None, True
            child.wait()
        # After what is wrong with the file esmini may end with 0, too.
        if child.returncode or not played.steps:
            return f"esmini ended with {child.returncode}: {_last_error(log)}", False
        return None, False


class _Played:
    """Takes esmini's steps down until the run is over."""

    def __init__(self, shown: ShownRun, rows: dict[str, int], last: float) -> None:
        self._shown, self._rows, self._last = shown, rows, last
        self._log = EsminiLog()
        self._numbers: dict[int, int] = {}
        self._there: set[int] = set()
        self._gone: set[int] = set()
        self._back: set[str] = set()

    @property
    def steps(self) -> int:
        """Taken down so far."""
        return self._shown.steps

    def progress(self) -> Progress:
        """How far esmini is."""
        return self._shown.progress()

    def take(self, text: str) -> bool:
        """Take some more of the log down; whether more is wanted."""
        for instant, entities in self._log.take(text):
            if instant > self._last:
                return False
            self._take_step(round(instant, 6), entities)
        return True

    def _take_step(self, instant: float, entities: list[LoggedEntity]) -> None:
        here = {self._rows[entity.name]: entity for entity in entities if entity.name in self._rows}
        self._numbers |= {entity.number: row for row, entity in here.items()}
        self._gone |= self._there - here.keys()
        self._there = set(here)
        back = self._gone & here.keys()
        self._back |= {here[row].name for row in back}
        users = [
            ShownUser(row, entity.x, entity.y, entity.z, entity.hdg, abs(entity.speed))
            for row, entity in here.items()
            if row not in back
        ]
        contacts = [
            (row, self._numbers[other])
            for row, entity in here.items()
            for other in entity.touched
            if other in self._numbers
        ]
        self._shown.take(instant, users, contacts)

    def notes(self) -> list[str]:
        """What a run has no word for."""
        return [
            f"{name} was there again in esmini after it had gone: the run has it until then"
            for name in sorted(self._back)
        ]


def _write_scenario(
    scenario: Scenario, on: RunMap, recorded: RecordedRun | None = None
) -> ExportFiles:
    return write_openscenario(
        ExportSource(
            name=_NAME,
            scenario=scenario,
            sumo_map=on.sumo,
            map_file=on.file("xodr"),
            net=on.file("net"),
            assets=on.assets,
            options={"version": _VERSION},
            recorded=recorded,
        )
    )


def _read_growing(
    file: Path, child: subprocess.Popen[bytes], reporter: Reporter, end: float
) -> Iterator[str]:
    """Text of a file as a process writes it, until that ends or is to end.

    Raises
    ------
    TimeoutError
        If nothing is written for too long, or time is up; says which.
    """
    last = time.monotonic()
    while not file.exists():
        if child.poll() is not None and not file.exists():
            return
        if time.monotonic() - last > SILENCE:
            raise TimeoutError(f"esmini said nothing for {SILENCE:g} s")
        if reporter.cancelled:
            return
        time.sleep(_LOOK)
    with file.open(encoding="utf-8", errors="replace") as table:
        while not reporter.cancelled:
            ended = child.poll() is not None
            now = time.monotonic()
            if now > end:
                raise TimeoutError("stopped after the time limit")
            if now - last > SILENCE:
                raise TimeoutError(f"esmini said nothing for {SILENCE:g} s")
            if text := table.read(1 << 20):
                last = now
                yield text
            elif ended:
                return
            else:
                time.sleep(_LOOK)


def _last_error(log: Path) -> str:
    """What esmini said last of what is wrong, or last at all."""
    lines = log.read_text(encoding="utf-8", errors="replace").split("\n")
    lines = [line.strip() for line in lines if line.strip()]
    wrong = [line for line in lines if "error" in line.lower()]
    return (wrong or lines or ["it said nothing"])[-1]
