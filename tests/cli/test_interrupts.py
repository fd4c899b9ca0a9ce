import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from tests.cli.conftest import SHIPPED, odscen


@pytest.fixture
def in_the_foreground():
    """Let commands hear SIGINT, even if these tests run in the background of a shell.

    There it is ignored, also by all that is started.
    """
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize(
    "arguments",
    [
        ("maps", "add"),
        ("maps", "nope"),
        ("generate", "--count", "-1"),
        ("run", "x", "--jobs", "many"),
    ],
)
def test_a_wrong_call_is_one_json_object_too(arguments):
    done = odscen(*arguments, "--json")
    assert done.code == 2
    assert done.json["error"]["type"] == "UsageError"
    assert done.json["error"]["message"]


@pytest.mark.slow
def test_the_same_map_can_be_added_several_times_at_once(tmp_path):
    def add(_number):
        return odscen("maps", "add", SHIPPED / "roundabout.xodr", "--json", "--workspace", tmp_path)

    with ThreadPoolExecutor(4) as pool:
        finished = list(pool.map(add, range(4)))
    assert [done.code for done in finished] == [0] * 4, [done.err for done in finished]
    assert [path.name for path in (tmp_path / "maps").iterdir()] == ["roundabout"]


@pytest.mark.slow
@pytest.mark.usefixtures("in_the_foreground")
@pytest.mark.skipif(os.name == "nt", reason="sends SIGINT as a POSIX terminal does")
def test_an_interrupted_run_leaves_nothing(workspace, tmp_path):
    w = ("--workspace", workspace)
    odscen("generate", "--map", "signal_crossing", "--fill", "0.3", "--out", tmp_path / "s", *w)
    runs = tmp_path / "r"
    command = [sys.executable, "-m", "odscen", "run", tmp_path / "s", "--out", runs, *w]
    # Steps of a hundredth of a second: the run takes long enough to be met in its middle.
    with subprocess.Popen(
        [*command, "--step-length", "0.01", "--json"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        while process.poll() is None and not list(runs.glob(".building-*/trajectories.parquet")):
            time.sleep(0.01)
        os.killpg(process.pid, signal.SIGINT)
        out, err = process.communicate(timeout=180)
    assert process.returncode == 130
    assert out == ""
    assert "Traceback" not in err
    assert not runs.exists()


@pytest.mark.slow
@pytest.mark.usefixtures("in_the_foreground")
@pytest.mark.skipif(os.name == "nt", reason="sends SIGINT as a POSIX terminal does")
def test_a_long_run_that_is_interrupted_says_how_to_go_on_and_does(workspace, tmp_path):
    w = ("--workspace", workspace)
    odscen("generate", "--map", "signal_crossing", "--fill", "0.3", "--out", tmp_path / "s", *w)
    (scenario,) = (tmp_path / "s").iterdir()
    folder = tmp_path / "r" / scenario.name.removesuffix(".scenario.json")
    command = ["run", scenario, "--step-length", "0.05", "--slice", "10s"]
    with subprocess.Popen(
        [sys.executable, "-m", "odscen", *command, "--out", folder.parent, *w],
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        while process.poll() is None and not (folder / "slices" / "0001").is_dir():
            time.sleep(0.01)
        os.killpg(process.pid, signal.SIGINT)
        _, err = process.communicate(timeout=180)
    assert process.returncode == 130
    assert f"odscen resume {folder}" in err
    again = odscen(*command, "--out", folder.parent, *w)
    assert again.code == 2
    assert "has not ended" in again.err
    resumed = odscen("resume", folder, "--json", *w)
    assert resumed.code == 0, resumed.err
    assert "resumes at" in resumed.err
    assert resumed.json["status"] == "completed"
    alone = odscen(*command, "--out", tmp_path / "alone", *w)
    assert alone.code == 0
    for name in ("actors.json", "events.json", "trajectories/part-0001.parquet"):
        assert (folder / name).read_bytes() == (
            tmp_path / "alone" / folder.name / name
        ).read_bytes()
    assert odscen("resume", folder, *w).code == 2
