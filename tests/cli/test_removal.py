import os
import pty
import shutil
import subprocess
import sys

import pytest

from tests.cli.conftest import odscen

MAP = "signal_crossing"


@pytest.fixture
def own(workspace, tmp_path):
    shutil.copytree(workspace, tmp_path / "own")
    return tmp_path / "own"


@pytest.mark.slow
def test_a_removed_map_says_what_is_on_it_and_comes_back(own):
    w = ("--workspace", own)
    before = [one["name"] for one in odscen("maps", "list", "--json", *w).json["maps"]]
    assert odscen("generate", "--map", MAP, "--count", 2, *w).code == 0
    done = odscen("maps", "remove", MAP, "--yes", "--json", *w)
    (row,) = done.json["removed"]
    assert (row["name"], row["scenarios"], row["runs"], row["live"]) == (MAP, 2, 0, 0)
    assert f"Map {MAP} has 2 scenarios, 0 runs, 0 live" in done.err
    before.remove(MAP)
    assert [one["name"] for one in odscen("maps", "list", "--json", *w).json["maps"]] == before
    assert odscen("maps", "remove", MAP, "--yes", *w).code == 2
    (item,) = odscen("trash", "list", "--json", *w).json["items"]
    assert (item["id"], item["kind"]) == (row["id"], "map")
    assert odscen("trash", "restore", MAP, "--json", *w).json["restored"][0]["id"] == row["id"]
    assert odscen("maps", "show", MAP, "--json", *w).code == 0
    assert odscen("trash", "list", "--json", *w).json == {"items": []}


@pytest.mark.slow
def test_scenarios_are_removed_by_name_and_deleted_for_good_from_the_wastebasket(own):
    w = ("--workspace", own)
    odscen("generate", "--map", MAP, *w)
    (file,) = (own / "scenarios").glob("*.scenario.json")
    name = file.name.removesuffix(".scenario.json")
    assert odscen("remove", "scenario", name, "--yes", *w).code == 0
    assert not file.exists()
    assert odscen("trash", "empty", "--yes", "--json", *w).json["deleted"][0]["name"] == name
    assert odscen("trash", "restore", name, *w).code == 2


def test_a_script_that_does_not_say_yes_is_refused_and_nothing_is_removed(own):
    done = odscen("maps", "remove", MAP, "--json", "--workspace", own)
    assert done.code == 2
    assert "--yes" in done.json["error"]["message"]
    assert (own / "maps" / MAP / "map.json").is_file()


@pytest.mark.slow
@pytest.mark.parametrize(("answer", "code"), [(b"n\n", 2), (b"y\n", 0)])
def test_a_person_is_asked(own, answer, code):
    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "odscen", "maps", "remove", MAP, "--workspace", str(own)]
    with subprocess.Popen(command, stdin=theirs, stderr=subprocess.PIPE) as process:
        os.write(ours, answer)
        said = process.stderr.read().decode()
    os.close(ours)
    os.close(theirs)
    assert process.returncode == code, said
    assert f"Remove {MAP}? [y/N]" in said
    assert (own / "maps" / MAP).is_dir() == (code == 2)
