"""Runs in esmini: with a stand-in for the program, and with the real one where it is there.

``ODSCEN_ESMINI`` names it, or it is on the search path.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import odscen
from odscen.app.maps import map_of
from odscen.app.running.runs import run_map
from odscen.app.template_scenarios import template_scenario
from odscen.base.errors import InputError, MissingDependencyError
from odscen.esmini import esmini_run
from odscen.esmini.esmini_run import NOT_IN_FILE, PROGRAM_VARIABLE, Esmini
from odscen.runs.run_settings import RunSettings
from tests.reporters import Listener

if TYPE_CHECKING:
    from odscen.maps.store import Workspace
    from odscen.runs.finished_run import Run

SETTINGS = RunSettings(until=40.0)
STAND_IN = Path(__file__).with_name("stand_in.py")
REAL = shutil.which(os.environ.get(PROGRAM_VARIABLE, "") or "esmini")
real = pytest.mark.skipif(REAL is None, reason=f"{PROGRAM_VARIABLE} and PATH have no esmini")


@pytest.fixture
def stand_in(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    program = tmp_path / "bin" / "esmini"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" "{STAND_IN}" "$@"\n')
    program.chmod(0o755)
    monkeypatch.setenv(PROGRAM_VARIABLE, str(program))
    return program


def play(workspace: Workspace, sampled: Path, out: Path, **more: Any) -> Run:
    return odscen.run(workspace, sampled, simulator="esmini", settings=SETTINGS, out=out, **more)


def parity_of(run: Run) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((run.folder / "parity.json").read_text(encoding="utf-8"))
    return found


@pytest.mark.slow
@pytest.mark.usefixtures("stand_in")
def test_what_esmini_shows_of_a_run_is_a_run_with_figures_and_parity(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    listener = Listener()
    run = play(workspace, sampled, tmp_path / "played", reporter=listener)
    sumo = odscen.run(workspace, sampled, settings=SETTINGS, out=tmp_path / "sumo")
    assert run.status == "completed", run.summary["error"]
    assert (run.summary["driven_by"], run.summary["esmini"]) == ("esmini", {"play": "run"})
    assert run.summary["versions"]["esmini"] == "v0.0-stand-in"
    assert listener.progress
    for name in ("planned", "inserted", "arrived"):
        assert run.counts[name] == sumo.counts[name] > 3
    parity = parity_of(run)
    assert (parity["shown_by"], parity["share_mirrored"]) == ("esmini", 1.0)
    assert parity["position_error_m"]["max"] < 1e-5
    assert parity["heading_error_deg"]["max"] < 1e-3
    page = (run.folder / "parity.html").read_text(encoding="utf-8")
    assert "SUMO and esmini compared" in page
    assert run.report is not None
    kept = [entry.name for entry in (tmp_path / "played").iterdir()]
    assert kept == [run.folder.name], "what esmini was given is gone"


@pytest.mark.slow
@pytest.mark.parametrize("wrong", ["aside", "contact", "back"])
def test_what_esmini_does_otherwise_is_found(
    workspace: Workspace,
    sampled: Path,
    tmp_path: Path,
    stand_in: Path,
    monkeypatch: pytest.MonkeyPatch,
    wrong: str,
) -> None:
    monkeypatch.setenv("MISBEHAVE", wrong)
    monkeypatch.delenv(PROGRAM_VARIABLE)
    listener = Listener()
    played = Esmini(program=str(stand_in))
    run = odscen.run(
        workspace, sampled, simulator=played, settings=SETTINGS, out=tmp_path / "out",
        reporter=listener,
    )  # fmt: skip
    assert run.status == "completed", run.summary["error"]
    parity = parity_of(run)
    if wrong == "aside":
        assert parity["position_error_m"]["p50"] == pytest.approx(0.5, abs=1e-5)
    elif wrong == "contact":
        assert run.counts["collided"] == 2, "both of them, once"
        assert any("in esmini for 1.5 s" in words for words in listener.words)
    else:
        assert parity["share_mirrored"] < 1.0
        assert [absent["since"] for absent in parity["absent"]] == [6.0]
        assert any("was there again in esmini" in words for words in listener.words)


@pytest.mark.slow
def test_a_program_that_ends_is_a_failed_run_with_its_words(
    workspace: Workspace,
    sampled: Path,
    tmp_path: Path,
    stand_in: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    del stand_in
    monkeypatch.setenv("MISBEHAVE", "ends")
    run = play(workspace, sampled, tmp_path / "ends")
    assert run.status == "failed"
    assert run.summary["error"] == (
        "esmini ended with 7: [5.000] [error] the stand-in was told to end"
    )
    assert run.summary["sim_seconds"] == 5.0, "what it did so far is kept"
    monkeypatch.setenv("MISBEHAVE", "refuses")
    run = play(workspace, sampled, tmp_path / "refuses")
    assert run.status == "failed"
    assert run.summary["error"].endswith("Exception: the stand-in takes no such file")
    monkeypatch.setenv("MISBEHAVE", "waits")
    monkeypatch.setattr(esmini_run, "SILENCE", 0.5)
    begin = time.monotonic()
    run = play(workspace, sampled, tmp_path / "waits")
    assert time.monotonic() - begin < 30.0
    assert run.summary["error"] == "esmini said nothing for 0.5 s"


def test_what_is_no_esmini_is_named_before_anything_runs(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    with pytest.raises(MissingDependencyError, match="is not esmini"):
        odscen.run(workspace, sampled, simulator=Esmini(program=sys.executable), out=tmp_path)
    nowhere = Esmini(program=str(tmp_path / "esmini"))
    with pytest.raises(MissingDependencyError, match=f"cannot be started.*{PROGRAM_VARIABLE}"):
        odscen.run(workspace, sampled, simulator=nowhere, out=tmp_path)
    assert not any(tmp_path.iterdir())
    with pytest.raises(InputError, match="'film' is none of run, story"):
        Esmini(play="film")


def test_what_the_file_of_a_story_does_not_say_is_listed_before_the_run(
    workspace: Workspace,
) -> None:
    scenario = template_scenario(workspace, "red-light", "signal_crossing")
    on = run_map(map_of(workspace, scenario).entry, workspace.assets())
    assert Esmini().unsupported(scenario, on) == ()
    found = Esmini(play="story").unsupported(scenario, on)
    words = {problem.message for problem in found}
    assert "criteria is not in the file for esmini: OpenSCENARIO has no word for it" in words
    approximated = [text for text in words if "is not quite the same in the file for" in text]
    assert approximated
    assert {problem.severity for problem in found} == {"warning"}


@real
@pytest.mark.slow
def test_esmini_plays_a_run_to_the_millimetre(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    run = play(workspace, sampled, tmp_path / "played")
    assert run.status == "completed", run.summary["error"]
    parity = parity_of(run)
    assert parity["share_mirrored"] == 1.0
    assert parity["position_error_m"]["max"] < 1e-3
    assert parity["heading_error_deg"]["max"] < 0.01
    again = play(workspace, sampled, tmp_path / "again")
    first, second = ((one.folder / "trajectories.parquet").read_bytes() for one in (run, again))
    assert first == second


@real
@pytest.mark.slow
def test_esmini_drives_the_story_of_a_scene_and_traffic_is_not_in_it(
    workspace: Workspace, tmp_path: Path
) -> None:
    scene = template_scenario(workspace, "red-light", "signal_crossing")
    played = Esmini(play="story")
    run = odscen.run(workspace, scene, simulator=played, settings=SETTINGS, out=tmp_path / "out")
    assert run.status == "completed", run.summary["error"]
    assert parity_of(run)["share_mirrored"] == 1.0
    assert set(run.actors()["problem"]) <= {None, NOT_IN_FILE}
