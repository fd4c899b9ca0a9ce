import signal
import subprocess
import sys
import time

import pytest

from odscen.base import folder_locks
from odscen.base.atomic_folders import clear_leftovers, new_folder
from odscen.base.errors import ConflictError
from odscen.base.folder_locks import is_locked, lock_file, locked

HOLDER = """
import sys, time
from pathlib import Path
from odscen.base.atomic_folders import new_folder
from odscen.base.folder_locks import locked
folder = Path(sys.argv[1])
with locked(folder, what="run"), new_folder(folder):
    print("held", flush=True)
    time.sleep(60)
"""


def holder(folder):
    process = subprocess.Popen(
        [sys.executable, "-c", HOLDER, folder], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "held\n"
    return process


def test_the_second_is_told_who_holds_a_folder_and_since_when(tmp_path):
    with holder(tmp_path / "x") as process:
        try:
            assert is_locked(tmp_path / "x")
            words = rf"^run 'x' is in the hands of process {process.pid} since \d{{4}}-"
            with pytest.raises(ConflictError, match=words), locked(tmp_path / "x", what="run 'x'"):
                pass
        finally:
            process.kill()


def test_a_lock_is_gone_when_it_is_given_back(tmp_path):
    with locked(tmp_path / "x", what="run"):
        assert lock_file(tmp_path / "x").is_file()
    assert list(tmp_path.iterdir()) == []
    assert not is_locked(tmp_path / "x")


def test_a_parent_that_was_made_stays_if_something_came_into_it(tmp_path):
    with locked(tmp_path / "runs" / "mine" / "x", what="run"):
        (tmp_path / "runs" / "kept").touch()
    assert [path.name for path in tmp_path.rglob("*")] == ["runs", "kept"]
    with locked(tmp_path / "runs" / "x", what="run"), locked(tmp_path / "runs" / "y", what="run"):
        pass
    assert (tmp_path / "runs").is_dir()


@pytest.mark.slow
def test_a_folder_that_is_about_to_be_free_is_waited_for(tmp_path):
    # A process that the holder has started outlives it for a moment, with the lock.
    code = (
        "import os, subprocess, sys; from pathlib import Path\n"
        "from odscen.base.folder_locks import locked\n"
        "with locked(Path(sys.argv[1]), what='run') as lock:\n"
        "    subprocess.Popen(['sleep', '1'], pass_fds=[lock]); os._exit(0)\n"
    )
    subprocess.run([sys.executable, "-c", code, tmp_path / "x"], check=True)
    assert is_locked(tmp_path / "x")
    with locked(tmp_path / "x", what="run"):
        pass


def test_what_a_killed_process_leaves_is_cleared_and_what_a_living_one_builds_is_not(tmp_path):
    with holder(tmp_path / "dead") as dead, holder(tmp_path / "alive") as alive:
        try:
            dead.send_signal(signal.SIGKILL)
            dead.wait()
            assert len(list(tmp_path.glob(".building-*"))) == 2
            cleared = clear_leftovers(tmp_path)
            assert len(cleared) == 2
            assert ".dead.lock" in cleared
            left = {path.name for path in tmp_path.iterdir()}
            assert ".alive.lock" in left
            assert len(left) == 2
        finally:
            alive.kill()


def test_what_was_about_to_be_replaced_is_put_back(tmp_path):
    old = tmp_path / ".replaced-x" / "town"
    old.mkdir(parents=True)
    (old / "map.json").write_text("{}", encoding="utf-8")
    clear_leftovers(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["town"]
    assert (tmp_path / "town" / "map.json").is_file()


def test_a_new_folder_replaces_the_one_before(tmp_path):
    for text in ("one", "two"):
        with new_folder(tmp_path / "x") as folder:
            (folder / "a").write_text(text, encoding="utf-8")
    assert (tmp_path / "x" / "a").read_text(encoding="utf-8") == "two"
    assert [path.name for path in tmp_path.iterdir()] == ["x"]


def test_a_holder_that_has_not_signed_yet_is_waited_for(tmp_path, monkeypatch):
    monkeypatch.setattr(folder_locks, "GRACE", 0.2)
    with locked(tmp_path / "x", what="run"):
        lock_file(tmp_path / "x").write_text("", encoding="utf-8")
        start = time.monotonic()
        with (
            pytest.raises(ConflictError, match="another process"),
            locked(tmp_path / "x", what="run"),
        ):
            pass
        assert time.monotonic() - start >= 0.2
    assert list(tmp_path.iterdir()) == []
