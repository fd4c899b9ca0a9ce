"""Damaged runs and maps: named before anything is computed, rebuilt, or set aside."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

import pytest

from odscen.app.doctor import examine
from odscen.app.running.reports import renew_report
from odscen.app.running.resumed_runs import resume
from odscen.app.running.runs import carry_out, check_file, prepare_run
from odscen.base.errors import DamagedError, InputError
from odscen.experiments.comparisons import compare
from odscen.maps.store import Workspace
from odscen.runs.reporter import Progress
from odscen.runs.run_settings import RunSettings
from odscen.runs.run_sums import damaged_in
from odscen.sumo.runner.live_run import Live
from tests.reporters import EachProgress, Listener

SLICE = 10.0


@dataclass(frozen=True)
class RunPair:
    """The same run twice: interrupted after its second slice, and at its end."""

    workspace: Workspace
    interrupted: Path
    finished: Path


@pytest.fixture(scope="module")
def pair(workspace: Workspace, sampled: Path, tmp_path_factory: pytest.TempPathFactory) -> RunPair:
    out = tmp_path_factory.mktemp("pair")
    settings = RunSettings(slice_length=SLICE, until=40.0, step_length=0.1)
    checked = check_file(workspace, sampled, out=out, settings=settings)
    live = Live()

    def kill(message: Progress) -> None:
        if message.time > 2 * SLICE + 2.0:
            live.kill()

    run = carry_out(checked, prepare_run(checked), reporter=EachProgress(kill), live=live)
    assert run.status == "failed"
    finished = out / "finished"
    shutil.copytree(run.folder, finished)
    assert resume(workspace, finished).status == "completed"
    return RunPair(workspace, run.folder, finished)


def flip(file: Path, place: float = 0.5) -> None:
    content = bytearray(file.read_bytes())
    content[int(place * (len(content) - 1))] ^= 1
    file.unlink()  # networks are shared by links
    file.write_bytes(content)


def files_of(run: Path) -> list[str]:
    return sorted(
        path.relative_to(run).as_posix()
        for path in run.rglob("*")
        if path.is_file() and path.stat().st_size
    )


class ComputingError(Exception):
    """Something would have been computed."""


@pytest.mark.slow
@pytest.mark.parametrize("place", [0.0, 0.5, 1.0])
def test_a_byte_that_has_changed_anywhere_is_named_by_resume_before_anything_is_computed(
    pair: RunPair, tmp_path: Path, place: float
) -> None:
    class UntilResumed(Listener):
        def said(self, words: str) -> None:
            super().said(words)
            if words.startswith(("resumes at", "begins anew")):
                raise ComputingError

    listener = UntilResumed()

    names = files_of(pair.interrupted)
    assert len(names) > 20
    assert {"SHA256SUMS", "status.json", "run.json", "sumo/net.net.xml"} < set(names)
    assert "slices/0002/checkpoint.json" in names
    for name in names:
        run = tmp_path / "run"
        shutil.copytree(pair.interrupted, run)
        flip(run / name, place)
        listener.words.clear()
        with pytest.raises((DamagedError, ComputingError)) as caught:
            resume(pair.workspace, run, reporter=listener)
        said = str(caught.value) if isinstance(caught.value, DamagedError) else listener.words[0]
        assert f"{name}: expected" in said, (name, said)
        shutil.rmtree(run)


@pytest.mark.slow
@pytest.mark.parametrize("place", [0.0, 0.5, 1.0])
def test_a_byte_that_has_changed_anywhere_is_named_by_report_and_compare(
    pair: RunPair,
    tmp_path: Path,
    place: float,
    caplog: pytest.LogCaptureFixture,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def computing(*_arguments: object, **_options: object) -> None:
        raise ComputingError

    monkeypatch.setattr("odscen.app.running.reports.load_map", computing)
    names = files_of(pair.finished)
    assert len(names) > 25
    for name in names:
        run = tmp_path / "run"
        shutil.copytree(pair.finished, run)
        flip(run / name, place)
        with pytest.raises(DamagedError, match=rf"{name}: expected (sha256 )?.+, found"):
            compare(run, pair.finished)
        caplog.clear()
        with pytest.raises((DamagedError, ComputingError)) as caught:
            renew_report(pair.workspace, run)
        said = str(caught.value) + caplog.text
        assert f"{name}: expected" in said, (name, said)
        assert isinstance(caught.value, ComputingError) == (name == "report.html")
        shutil.rmtree(run)


@pytest.mark.slow
def test_what_users_delete_to_save_room_is_not_damage(pair: RunPair, tmp_path: Path) -> None:
    run = tmp_path / "run"
    shutil.copytree(pair.finished, run)
    shutil.rmtree(run / "trajectories")
    (run / "report.html").unlink()
    assert damaged_in(run) == []
    assert compare(run, pair.finished).rows
    (run / "plan.json").unlink()
    with pytest.raises(DamagedError, match=r"plan\.json: expected sha256 .*, found no such file"):
        compare(run, pair.finished)


@pytest.mark.slow
def test_reports_and_comparisons_of_an_interrupted_run_say_how_to_resume_it(pair: RunPair) -> None:
    words = rf"is interrupted at 0:00 of 0:00 h; odscen resume {pair.interrupted} resumes it"
    with pytest.raises(InputError, match=words):
        renew_report(pair.workspace, pair.interrupted)
    with pytest.raises(InputError, match=words):
        compare(pair.interrupted, pair.finished)


@pytest.mark.slow
def test_a_run_without_checksums_resumes_and_says_so_once(
    pair: RunPair, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    run = tmp_path / "run"
    shutil.copytree(pair.interrupted, run)
    (run / "SHA256SUMS").unlink()
    assert resume(pair.workspace, run).status == "completed"
    assert [one.message for one in caplog.records if str(run) in one.message] == [
        f"{run} has no SHA256SUMS, as of earlier versions: its files are not checked"
    ]
    assert (run / "actors.json").read_bytes() == (pair.finished / "actors.json").read_bytes()


@pytest.mark.slow
def test_what_records_and_maps_say_is_rebuilt_to_the_same_bytes(
    pair: RunPair, tmp_path: Path
) -> None:
    runs = []
    for name in (
        "sumo/net.net.xml",
        "figures/network.csv",
        "figures.json",
        "report.html",
        "SHA256SUMS",
    ):
        run = tmp_path / f"run{len(runs)}"
        shutil.copytree(pair.finished, run)
        flip(run / name)
        runs.append(run)
    found = list(examine(pair.workspace, runs))
    assert [(step.name, step.action) for step in found] == [(run.name, "found") for run in runs]
    steps = list(examine(pair.workspace, runs, repair=True))
    assert [(step.name, step.action) for step in steps] == [(run.name, "rebuilt") for run in runs]
    for run in runs:
        assert damaged_in(run) == []
        for name in files_of(pair.finished):
            if name not in ("report.html", "SHA256SUMS"):
                assert (run / name).read_bytes() == (pair.finished / name).read_bytes(), name
    assert list(examine(pair.workspace, runs)) == []


def test_what_nothing_else_says_is_set_aside(pair: RunPair, tmp_path: Path) -> None:
    run = tmp_path / "run"
    shutil.copytree(pair.finished, run)
    flip(run / "actors.json")
    (step,) = examine(pair.workspace, [run], repair=True)
    assert step.action == "set aside"
    assert step.place == str(tmp_path / "damaged" / "run")
    assert "actors.json: expected sha256" in step.words
    assert not run.exists()
    assert (Path(step.place) / "actors.json").is_file()


@pytest.mark.slow
def test_the_status_of_an_interrupted_run_is_rebuilt_and_the_run_resumes(
    pair: RunPair, tmp_path: Path
) -> None:
    run = tmp_path / "run"
    shutil.copytree(pair.interrupted, run)
    flip(run / "status.json")
    flip(run / "sumo" / "net.net.xml")
    (step,) = examine(pair.workspace, [run], repair=True)
    assert step.action == "rebuilt"
    assert (run / "status.json").read_bytes() == (pair.interrupted / "status.json").read_bytes()
    assert resume(pair.workspace, run).status == "completed"


@pytest.mark.slow
def test_maps_are_built_anew_from_their_xodr_and_else_set_aside(tmp_path: Path) -> None:
    store = Workspace.open(tmp_path)
    source = Path(__file__).parents[2] / "maps" / "t_junction_signs.xodr"
    for name in ("info", "graph", "lost"):
        store.add_map(source, name=name)
    net = (tmp_path / "maps" / "info" / "net.net.xml").read_bytes()
    flip(tmp_path / "maps" / "info" / "map.json")
    flip(tmp_path / "maps" / "graph" / "graph.npz")
    flip(tmp_path / "maps" / "lost" / "map.xodr")
    assert [step.action for step in examine(store)] == ["found"] * 3
    steps = {step.name: step for step in examine(store, repair=True)}
    actions = {name: step.action for name, step in steps.items()}
    assert actions == {"info": "rebuilt", "graph": "rebuilt", "lost": "set aside"}
    assert steps["lost"].place == str(tmp_path / "damaged" / "maps" / "lost")
    assert store.map_names() == ["graph", "info"]
    assert (tmp_path / "maps" / "info" / "net.net.xml").read_bytes() == net
    assert list(examine(store)) == []


def test_a_damaged_catalogue_of_models_is_set_aside_and_those_that_ship_are_used(
    tmp_path: Path,
) -> None:
    store = Workspace.open(tmp_path)
    store.assets_folder.mkdir()
    (store.assets_folder / "blueprints.json").write_text("[", encoding="utf-8")
    (step,) = examine(store, repair=True)
    assert (step.what, step.action) == ("assets", "set aside")
    assert len(store.assets().blueprints) > 50
