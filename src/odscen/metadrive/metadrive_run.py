"""A scenario in MetaDrive: SUMO's run, its road users replayed, and some driven by physics.

MetaDrive has a Python of its own, so that what it asks for is no dependency; a process there is
given :mod:`odscen.metadrive.hand_over` and tells what there is after each step.
"""

from __future__ import annotations

import json
import math
import os
import selectors
import subprocess
import sys
import time
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from odscen.base.atomic_folders import passing_folder
from odscen.base.errors import InputError, MissingDependencyError
from odscen.formats.recordings.map_elements import map_elements
from odscen.metadrive.hand_over import DRIVES, drives_of, write_job
from odscen.opendrive.parse import parse
from odscen.runs.new_run import PreparedRun, SimulationOutcome
from odscen.scenario.document.problems import warning
from odscen.simulators.base import Simulator
from odscen.sumo.realize.road_users.free_flow import environment_effect
from odscen.sumo.realize.run_map import RunMap
from odscen.sumo.runner.sumo_simulator import SumoSimulator
from odscen.sumo.runner.tracked_run import ShownRun, ShownUser, simulate_tracked

if TYPE_CHECKING:
    from collections.abc import Iterator

    from odscen.runs.reporter import Reporter
    from odscen.runs.run_settings import RunSettings
    from odscen.scenario.document.problems import Problem
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.simulators.base import SimulatedMap
    from odscen.sumo.runner.run_folder import SumoPreparedRun
    from odscen.sumo.runner.tracked_run import SumoTracks

PYTHON_VARIABLE = "ODSCEN_METADRIVE_PYTHON"
"""Names the Python that has MetaDrive, where no option does."""
CHILD = Path(__file__).with_name("metadrive_child.py")
LOG_FILE = "metadrive.log"
SILENCE = 300.0
"""Seconds without a line after which MetaDrive's process is ended; building a large map takes
some."""
_LOOK = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class MetaDriveRun(PreparedRun):
    """A planned run with that of SUMO which it replays."""

    scenario: Scenario
    on: RunMap
    sumo: SumoPreparedRun


class MetaDrive(Simulator[MetaDriveRun]):
    """SUMO's run in MetaDrive, the ego driven by its physics and its policy.

    Parameters
    ----------
    ego, traffic
        What moves the ego, and all other cars, vans, trucks and buses: one of
        :data:`~odscen.metadrive.hand_over.DRIVES`. Two-wheelers and pedestrians are replayed.
    python
        The Python that has MetaDrive; if empty that of ``ODSCEN_METADRIVE_PYTHON``, or this one.

    Raises
    ------
    InputError
        If ``ego`` or ``traffic`` is another word.
    """

    label = "MetaDrive"
    options: ClassVar = {
        "type": "object",
        "properties": {
            "ego": {"type": "string", "enum": [*DRIVES], "title": "The ego", "default": "idm"},
            "traffic": {
                "type": "string",
                "enum": [*DRIVES],
                "title": "Other vehicles",
                "default": "replay",
            },
            "python": {"type": "string", "title": "Python that has MetaDrive", "default": ""},
        },
    }

    def __init__(self, ego: str = "idm", traffic: str = "replay", python: str = "") -> None:
        for name, value in {"ego": ego, "traffic": traffic}.items():
            if value not in DRIVES:
                raise InputError(f"{value!r} is none of {', '.join(DRIVES)}", element=name)
        self.ego, self.traffic = ego, traffic
        self._python = python

    @property
    def python(self) -> str:
        """The Python that MetaDrive is run by."""
        return self._python or os.environ.get(PYTHON_VARIABLE, "") or sys.executable

    def unsupported(self, scenario: Scenario, on: SimulatedMap) -> tuple[Problem, ...]:
        """List what MetaDrive does not do of a scenario."""
        heights = on.graph.lanes.z
        warnings = [
            warning(
                "not_in_metadrive",
                "environment",
                "MetaDrive has no traffic lights and no weather: only SUMO's drivers react to them",
            )
        ]
        if len(heights) and float(np.ptp(heights)) > 1.0:
            warnings.append(
                warning(
                    "not_in_metadrive",
                    "map",
                    "MetaDrive's ground is level: slopes have no effect on its physics",
                )
            )
        egos = {actor.id for actor in scenario.actors if actor.ego}
        if self.traffic == "idm" or (self.ego == "idm" and egos):
            warnings.append(
                warning(
                    "not_in_metadrive",
                    "actors",
                    "who is driven by MetaDrive's IDM sees no traffic light, sign or right of way",
                )
            )
        warnings += [
            warning(
                "not_in_metadrive",
                f"rules[{index}]",
                f"MetaDrive's IDM does not follow rule {rule.id} of {rule.actor}",
            )
            for index, rule in enumerate(scenario.rules)
            if (self.ego if rule.actor in egos else self.traffic) == "idm"
        ]
        return tuple(warnings)

    def check_settings(self, settings: RunSettings) -> None:
        """Refuse what SUMO refuses, and runs without microscopic traffic."""
        # A behaviour model drives in SUMO's run, which MetaDrive replays.
        super().check_settings(replace(settings, behaviour=None))
        SumoSimulator().check_settings(settings)

    def prepare(
        self, scenario: Scenario, on: SimulatedMap, settings: RunSettings, reporter: Reporter
    ) -> MetaDriveRun:
        """Prepare SUMO's run, once it is known that MetaDrive is there.

        Raises
        ------
        MissingDependencyError
            If the Python that is named has no MetaDrive.
        TypeError
            If the map has no SUMO network.
        """
        if not isinstance(on, RunMap):
            raise TypeError("SUMO runs on maps of the catalogue, which have its network")
        release, python = self._ask_version()
        sumo = SumoSimulator().prepare(scenario, on, replace(settings, slice_length=None), reporter)
        return MetaDriveRun(
            plan=sumo.plan,
            settings=settings,
            scenario_json=sumo.scenario_json,
            problems=sumo.problems,
            notes=sumo.notes,
            about={
                **sumo.about,
                "driven_by": self.label,
                "metadrive": {"ego": self.ego, "traffic": self.traffic},
            },
            versions={**sumo.versions, "metadrive": release, "metadrive_python": python},
            scenario=scenario,
            on=on,
            sumo=sumo,
        )

    def run(self, prepared: MetaDriveRun, folder: Path, reporter: Reporter) -> SimulationOutcome:
        """Run SUMO, replay its run in MetaDrive, and compare both."""
        begin = time.perf_counter()
        with passing_folder(folder.parent) as staging:
            on, scenario = prepared.on, prepared.scenario
            place = staging / "sumo-run"
            outcome, tracks = simulate_tracked(prepared.sumo, on, place, reporter)
            if outcome.sim_seconds is None or outcome.error or outcome.stopped:
                return SimulationOutcome(
                    None, None, outcome.wall_seconds, error=outcome.error or "it was stopped"
                )
            drives = drives_of(prepared.plan, ego=self.ego, traffic=self.traffic)
            job = staging / "job"
            job.mkdir()
            write_job(
                job,
                plan=prepared.plan,
                tracks=tracks,
                drives=drives,
                lanes=_lanes_of(on),
                graph=on.graph.lanes,
                assets=on.assets,
                grip=environment_effect(scenario.environment, on.assets).grip,
            )
            shown = _ShownInMetaDrive(prepared, tracks)
            error, stopped = self._follow_child(job, folder, shown, reporter, prepared)
        outcome = shown.write(folder)
        for words in shown.notes():
            reporter.said(words)
        return SimulationOutcome(
            outcome.sim_seconds if shown.steps else None,
            outcome.steps,
            time.perf_counter() - begin,
            error=error,
            stopped=stopped,
        )

    def _ask_version(self) -> tuple[str, str]:
        """Release of MetaDrive, and of its Python."""
        try:
            asked = subprocess.run(
                [self.python, str(CHILD), "--version"],
                capture_output=True,
                text=True,
                timeout=60,
                check=False,
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            raise MissingDependencyError(
                f"the Python that is to have MetaDrive cannot be started: {self.python}: {error}"
            ) from error
        words = asked.stdout.split()
        if asked.returncode or len(words) != 2:
            raise MissingDependencyError(
                f"{self.python} has no MetaDrive: install metadrive-simulator in an environment of "
                "its own, and name its Python: --simulator-set python=PATH, or in the variable "
                f"{PYTHON_VARIABLE}"
            )
        return words[0], words[1]

    def _follow_child(
        self,
        job: Path,
        folder: Path,
        shown: _ShownInMetaDrive,
        reporter: Reporter,
        prepared: MetaDriveRun,
    ) -> tuple[str | None, bool]:
        """Take down what MetaDrive's process tells; why it failed, and whether it was stopped."""
        limit = prepared.settings.time_limit
        end = math.inf if limit is None else time.monotonic() + limit
        log = folder / LOG_FILE
        environment = {name: os.environ[name] for name in os.environ if name != "PYTHONPATH"}
        with (
            log.open("wb") as errors,
            subprocess.Popen(
                [self.python, str(CHILD), str(job)],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=errors,
                env=environment,
            ) as child,
        ):
            try:
                for line in _lines_of(child, reporter, end):
                    shown.take_line(json.loads(line))
                    reporter.advanced(shown.progress())
            except TimeoutError as error:
                child.kill()
                return str(error), False
            except BaseException:
                child.kill()
                raise
            if reporter.cancelled:
                child.kill()
                return None, True
            child.wait()
        if child.returncode:
            words = log.read_text(encoding="utf-8", errors="replace").strip().splitlines()
            last_words = words[-1] if words else "it said nothing"
            return f"MetaDrive's process ended with {child.returncode}: {last_words}", False
        return None, False


def _lines_of(child: subprocess.Popen[bytes], reporter: Reporter, end: float) -> Iterator[bytes]:
    """Lines of a process until it ends, or is to end.

    Raises
    ------
    TimeoutError
        If it says nothing for too long, or time is up; says which.
    """
    assert child.stdout is not None
    last, rest = time.monotonic(), b""
    with selectors.DefaultSelector() as selector:
        selector.register(child.stdout, selectors.EVENT_READ)
        while not reporter.cancelled:
            now = time.monotonic()
            if now > end:
                raise TimeoutError("stopped after the time limit")
            if now - last > SILENCE:
                raise TimeoutError(f"MetaDrive's process said nothing for {SILENCE:g} s")
            if not selector.select(_LOOK):
                continue
            read = os.read(child.stdout.fileno(), 1 << 16)
            if not read:
                return
            last = time.monotonic()
            *lines, rest = (rest + read).split(b"\n")
            yield from lines


def _lanes_of(on: RunMap) -> Any:
    odr = parse(on.file("xodr").read_bytes().decode())
    return map_elements(odr, on.graph.lanes).lanes


class _ShownInMetaDrive(ShownRun):
    """What MetaDrive shows, on the ground that its own is flat for."""

    def __init__(self, prepared: MetaDriveRun, tracks: SumoTracks) -> None:
        super().__init__(prepared, prepared.on, tracks, MetaDrive.label)
        self._heights = _Heights(tracks)
        self._off_road: Counter[int] = Counter()

    def take_line(self, line: dict[str, Any]) -> None:
        """Take one step down."""
        time = round(line["step"] * self._plan.step_length, 6)
        users = [
            ShownUser(row, x, y, self._heights.at(row, x, y), hdg, speed)
            for row, x, y, hdg, speed in line["users"]
        ]
        self.take(time, users, line["contacts"])
        self._off_road.update(line["off_road"])

    def notes(self) -> list[str]:
        """What physics did that SUMO's run did not: contacts, and driving beside the lanes."""
        plan, words = self._plan, super().notes()
        for row, count in sorted(self._off_road.items()):
            name, seconds = plan.actors[row].id, f"{count * plan.step_length:.1f}"
            words.append(f"{name} was beside the lanes in MetaDrive for {seconds} s")
        return words


class _Heights:
    """Height of the ground where SUMO had a road user nearest; MetaDrive's is level."""

    def __init__(self, tracks: SumoTracks) -> None:
        self._order = np.argsort(tracks.row, kind="stable")
        rows = tracks.row[self._order]
        most = int(rows[-1]) + 1 if len(rows) else 0
        self._first = np.searchsorted(rows, np.arange(most + 1))
        self._x, self._y, self._z = (getattr(tracks, name)[self._order] for name in ("x", "y", "z"))

    def at(self, row: int, x: float, y: float) -> float:
        """Height at a place, metres."""
        own = slice(int(self._first[row]), int(self._first[row + 1]))
        near = int(np.argmin((self._x[own] - x) ** 2 + (self._y[own] - y) ** 2))
        return float(self._z[own][near])
