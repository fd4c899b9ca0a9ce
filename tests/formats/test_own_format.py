"""A format of an installed package: the one of CONTRIBUTING.md, on the command line, in Python."""

from __future__ import annotations

import csv
import doctest
import json
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

import odscen
import odscen.formats.base
from odscen.formats import find_format, format_of_file, list_formats
from tests import own_format

if TYPE_CHECKING:
    from collections.abc import Iterator

MAPS = Path(__file__).parents[2] / "maps"


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    folder = tmp_path / "site"
    folder.mkdir()
    own_format.install(folder, monkeypatch)
    yield folder
    own_format.forget()


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> odscen.Workspace:
    store = odscen.Workspace.open(tmp_path_factory.mktemp("own-format"))
    store.add_map(MAPS / "signal_crossing.xodr")
    return store


@pytest.fixture(scope="module")
def sampled(workspace: odscen.Workspace) -> Path:
    settings = odscen.GenerationSettings(map_name="signal_crossing", seed=5, fill=0.2)
    return odscen.generate(workspace, settings=settings)[0]


def call(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "odscen", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)


def test_the_example_of_a_format_runs() -> None:
    assert doctest.testmod(odscen.formats.base).failed == 0


@pytest.mark.slow
def test_it_is_written_and_read_in_python(
    package: Path, workspace: odscen.Workspace, sampled: Path, tmp_path: Path
) -> None:
    assert package.is_dir()
    (file,) = odscen.export(workspace, sampled, tmp_path, to="actors")
    assert file.name.endswith(".actors.csv")
    actors = odscen.read_scenario(sampled).actors
    with file.open() as lines:
        rows = list(csv.DictReader(lines))
    assert [(row["id"], row["goal"]) for row in rows] == [
        (one.id, one.goal or "") for one in actors
    ]
    with file.open("a") as lines:
        lines.write("nobody,car,,,\n")
    read = odscen.import_file(workspace, file, on_map="signal_crossing")
    assert read.scenario is not None
    assert [
        (one.id, one.category, one.spawn, one.goal, one.speed) for one in read.scenario.actors
    ] == [(one.id, one.category, one.spawn, one.goal, one.speed) for one in actors]
    (refused,) = read.lists["refused"]
    assert (refused.file, refused.xpath) == (file.name, f"row {len(actors) + 1}")
    assert refused.reason == "it has no id or no spawn"
    assert len(read.lists["taken"]) == len(actors)


@pytest.mark.slow
def test_it_is_written_and_read_on_the_command_line(
    package: Path, workspace: odscen.Workspace, sampled: Path, tmp_path: Path
) -> None:
    assert package.is_dir()
    place = ("--workspace", workspace.root)
    made = call("export", sampled, "--to", "actors", "-o", tmp_path, *place, "--json")
    assert made.returncode == 0, made.stderr
    (file,) = json.loads(made.stdout)["files"]
    out = tmp_path / "back.scenario.json"
    read = call("import", file, "--out", out, "--map", "signal_crossing", *place, "--json")
    assert read.returncode == 0, read.stderr
    assert {"taken", "refused", "problems"} <= json.loads(read.stdout).keys()
    back, before = odscen.read_scenario(out), odscen.read_scenario(sampled)
    assert [one.spawn for one in back.actors] == [one.spawn for one in before.actors]
    shown = call("export", "--help").stdout + call("import", "--help").stdout
    assert shown.count("actors") >= 4
    wrong = call("export", sampled, "--to", "actor", "-o", tmp_path, *place)
    assert (wrong.returncode, "actors" in wrong.stderr) == (2, True)


def test_the_longest_ending_decides_what_a_file_is(package: Path) -> None:
    assert package.is_dir()
    assert format_of_file("a.Actors.csv").id == "actors"
    assert format_of_file("a.csv").id == "trajectories"
    with pytest.raises(odscen.InputError, match="no format has its ending"):
        format_of_file("a.paper")


def test_a_package_that_cannot_be_imported_says_so_when_it_is_named(package: Path) -> None:
    (package / "my_format.py").write_text("import nothing_of_that_name\n")
    own_format.forget()
    assert "sumo" in list_formats()
    with pytest.raises(odscen.InputError, match="nothing_of_that_name"):
        find_format("actors")


def test_an_error_of_a_format_from_outside_names_it(
    package: Path, workspace: odscen.Workspace, sampled: Path, tmp_path: Path
) -> None:
    code = (package / "my_format.py").read_text()
    (package / "my_format.py").write_text(
        code.replace("def write_table(source):", "def write_table(source):\n    1 / 0")
    )
    own_format.forget()
    with pytest.raises(odscen.InputError, match="the format actors failed: ZeroDivisionError"):
        odscen.export(workspace, sampled, tmp_path, to="actors")


def test_a_recording_becomes_a_table_of_tracks(workspace: odscen.Workspace, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("time,id,x,y,colour\n1,b,0,0,red\n0,b,1,2,red\n")
    read = odscen.import_file(workspace, tmp_path / "a.csv", out=tmp_path / "tracks.csv")
    assert read.scenario is None
    assert [row.xpath for row in read.lists["ignored"]] == ["column colour"]
    lines = (tmp_path / "tracks.csv").read_text().splitlines()
    assert lines[0] == "id,time,category,kind,x,y,hdg,speed,acceleration,length,width,quality"
    assert lines[1].startswith("b,0.0,car,car,1.0,2.0,-2.03")
    assert len(lines) == 3
