"""Maps and documents from outside, read by real children within limits."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import psutil
import pytest

from odscen.base.atomic_folders import clear_leftovers
from odscen.base.errors import LimitError, OpenDriveError, ScenarioError, ToolError
from odscen.maps.allowances import BuildLimits
from odscen.maps.guarded_build import read_scenario_in_child
from odscen.maps.store import Workspace
from tests.opendrive.snippets import document, lane, road, section

SHIPPED = Path(__file__).parents[2] / "maps"
SMALL = SHIPPED / "t_junction_signs.xodr"
linux = pytest.mark.skipif(sys.platform != "linux", reason="only Linux limits memory")


class EnoughError(Exception):
    """What a progress function raises to end the work."""


@pytest.fixture
def scratch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder for temporary files, empty."""
    folder = tmp_path / "scratch"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


@pytest.fixture
def store(tmp_path: Path) -> Workspace:
    return Workspace.open(tmp_path / "workspace")


@pytest.fixture
def motorway(tmp_path: Path) -> Path:
    """200 km of motorway in 10 kB: several seconds, and 1.2 GB."""
    file = tmp_path / "motorway.xodr"
    lanes = section(*(lane(-k) for k in (1, 2, 3)))
    line = '<geometry s="0" x="{}" y="0" hdg="0" length="10000"><line/></geometry>'
    roads = [
        road(str(k), length=10_000, plan=line.format(10_000 * k), lanes=lanes) for k in range(20)
    ]
    file.write_text(document(*roads))
    return file


def children() -> list[psutil.Process]:
    return [one for one in psutil.Process().children() if "child_worker" in _command(one)]


def _command(process: psutil.Process) -> str:
    with suppress(psutil.ZombieProcess):  # one of another test that nothing has waited for
        return " ".join(process.cmdline())
    return ""


def left(store: Workspace, scratch: Path) -> list[str]:
    return [path.name for folder in (store.root / "maps", scratch) for path in folder.iterdir()]


@pytest.mark.slow
@linux
def test_a_map_that_needs_too_much_memory_is_refused_and_the_next_one_is_built(
    store: Workspace, scratch: Path, motorway: Path
) -> None:
    with pytest.raises(LimitError) as caught:
        store.add_map(motorway, limits=BuildLimits(memory=0.3))
    assert caught.value.exit_code == 3
    assert str(caught.value).startswith(
        "motorway.xodr: building the map needs more than 0.30 GB of memory, the limit for a map of "
        "its size; to allow more: --build-memory 0.60"
    )
    assert left(store, scratch) == []
    assert store.add_map(SMALL).name == "t_junction_signs"


@pytest.mark.slow
def test_a_map_that_takes_too_long_is_refused(
    store: Workspace, scratch: Path, motorway: Path
) -> None:
    with pytest.raises(
        LimitError, match=r"^motorway\.xodr: building the map (needs more than|did)"
    ):
        store.add_map(motorway, limits=BuildLimits(minutes=0.01))
    assert left(store, scratch) == []


def test_a_child_that_does_not_end_is_ended_by_the_clock(
    store: Workspace, scratch: Path, motorway: Path
) -> None:
    with pytest.raises(LimitError, match=r"did not end within 0\.036 s"):
        store.add_map(motorway, limits=BuildLimits(minutes=0.0001))
    assert left(store, scratch) == []
    assert children() == []


@pytest.mark.slow
def test_a_child_that_is_killed_is_an_error_that_says_so(store: Workspace, scratch: Path) -> None:
    def kill(_what: str, _share: float) -> None:
        for child in children():
            child.kill()

    with pytest.raises(ToolError, match=r"its process was ended by signal SIGKILL, perhaps by the"):
        store.add_map(SMALL, progress=kill)
    assert left(store, scratch) == []
    assert store.add_map(SMALL).name == "t_junction_signs"


@pytest.mark.slow
def test_what_the_progress_function_raises_ends_the_child_and_leaves_nothing(
    store: Workspace, scratch: Path, motorway: Path
) -> None:
    def enough(what: str, _share: float) -> None:
        if what == "building the lane graph":
            raise EnoughError

    with pytest.raises(EnoughError):
        store.add_map(motorway, progress=enough)
    assert left(store, scratch) == []
    assert children() == []


def test_progress_is_told_again_while_nothing_changes(store: Workspace, motorway: Path) -> None:
    told: list[str] = []

    def count(what: str, _share: float) -> None:
        told.append(what)
        if told.count(what) > 2:
            raise EnoughError

    with pytest.raises(EnoughError):
        store.add_map(motorway, progress=count)


@pytest.mark.slow
def test_a_child_that_waits_takes_the_next_map(store: Workspace) -> None:
    for child in children():  # one that other tests have left, and that may be full
        child.kill()
        child.wait()
    store.add_map(SMALL)
    before = [one.pid for one in children()]
    with pytest.raises(OpenDriveError):
        store.add_map_content(b"<OpenDRIVE/>", file="none.xodr", name="none")
    store.add_map(SHIPPED / "roundabout.xodr")
    assert len(before) == 1
    assert [one.pid for one in children()] == before


@pytest.mark.slow
def test_two_maps_are_built_at_once(store: Workspace, motorway: Path) -> None:
    begun, over = threading.Event(), threading.Event()

    def wait(_what: str, _share: float) -> None:
        begun.set()
        if over.is_set():
            raise EnoughError

    def build() -> None:
        with pytest.raises(EnoughError):
            store.add_map(motorway, progress=wait)

    thread = threading.Thread(target=build)
    thread.start()
    assert begun.wait(60)
    store.add_map(SMALL)
    assert thread.is_alive()
    over.set()
    thread.join(60)
    assert store.map_names() == ["t_junction_signs"]


@pytest.mark.slow
def test_a_killed_command_leaves_no_process_and_no_folder(tmp_path: Path, motorway: Path) -> None:
    root, scratch = tmp_path / "other", tmp_path / "tmp"
    scratch.mkdir()
    command = [sys.executable, "-m", "odscen", "maps", "add", str(motorway), "--workspace"]
    with subprocess.Popen(
        [*command, str(root)],
        env={**os.environ, "TMPDIR": str(scratch)},
        stderr=subprocess.DEVNULL,
    ) as parent:
        wait_for(lambda: any((root / "maps").glob(".building-*/graph.npz")))
        started = psutil.Process(parent.pid).children(recursive=True)
        parent.send_signal(signal.SIGKILL)
    assert started
    wait_for(lambda: not any(one.is_running() for one in started))
    # The lock's file is nobody's any more, and goes with the next look for leftovers.
    wait_for(lambda: {one.suffix for one in (root / "maps").iterdir()} <= {".lock"})
    wait_for(lambda: not any(scratch.glob("*/.*")))
    clear_leftovers(root / "maps")
    assert not any((root / "maps").iterdir())


def test_a_fork_leaves_the_waiting_child_to_its_parent() -> None:
    code = (
        "import os; from odscen.maps import child_process as c; c.keep_ready();\n"
        "pid = os.fork()\n"
        "if not pid: os._exit(len(c._waiting))\n"
        "assert os.waitpid(pid, 0)[1] == 0 and len(c._waiting) == 1 and c._waiting[0].alive\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.slow
def test_modules_beside_the_caller_do_not_hide_those_of_python(tmp_path: Path) -> None:
    (tmp_path / "json.py").write_text("raise SystemExit('not this one')")
    command = ["-P", "-m", "odscen", "maps", "add", str(SMALL), "--workspace", "w"]
    done = subprocess.run(
        [sys.executable, *command], check=False, cwd=tmp_path, capture_output=True, text=True
    )
    assert (done.returncode, "built in" in done.stderr) == (0, True)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"[" * 100_000, "recursion limit exceeded"),
        (b'{"name": ' + b"9" * 400 + b"}", "name"),
        (b"<graphml>" + b"<a>" * 100_000, "Excessive depth"),
        (b"\xff\xfe", "not UTF-8"),
    ],
    ids=["brackets", "digits", "depth", "bytes"],
)
def test_a_scenario_made_to_hurt_is_refused_with_its_name(content: bytes, words: str) -> None:
    with pytest.raises(ScenarioError, match=words) as caught:
        read_scenario_in_child(content, file="bad.json")
    assert str(caught.value).startswith("bad.json: ")


@pytest.mark.slow
@linux
def test_a_scenario_of_millions_of_faults_ends_the_child_only(scratch: Path) -> None:
    with pytest.raises(
        LimitError, match=r"^bad\.json: reading the scenario needs more than 0\.\d+ GB"
    ):
        read_scenario_in_child(b'{"actors": [' + b"{}," * 5_000_000 + b"{}]}", file="bad.json")
    assert list(scratch.iterdir()) == []


def wait_for(true: Callable[[], object], seconds: float = 120.0) -> None:
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end
        time.sleep(0.02)
