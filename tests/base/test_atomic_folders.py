from __future__ import annotations

import os
import stat
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from odscen.base.atomic_folders import scratch_folder

SCRIPT = """
import os, resource, sys
from pathlib import Path
from odscen.base.atomic_folders import new_folder
resource.setrlimit(resource.RLIMIT_NOFILE, (int(sys.argv[2]), 4096))
parent = Path(sys.argv[1])
held = []
try:
    with new_folder(parent / "map") as folder:
        (folder / "a" / "b" / "c").mkdir(parents=True)
        while True:
            held.append(os.open(folder, os.O_RDONLY))
except OSError as error:
    print(error.strerror)
"""


@pytest.mark.skipif(os.name == "nt", reason="POSIX limits")
@pytest.mark.parametrize("handles", [3, 4, 5, 8])
def test_nothing_is_left_of_a_folder_where_no_handle_is_left(tmp_path: Path, handles: int) -> None:
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, tmp_path, str(handles)],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == "Too many open files\n"
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The system's folder for temporary files, empty."""
    folder = tmp_path / "tmp"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    monkeypatch.setenv("TMPDIR", str(folder))
    return folder


def test_a_scratch_folder_is_its_users_alone_and_nothing_stays_of_it(temporary: Path) -> None:
    with scratch_folder() as folder:
        (folder / "run.json").write_text("{}")
        assert folder.parent == temporary / f"odscen-{os.getuid()}"
        assert stat.S_IMODE(folder.parent.stat().st_mode) == 0o700
        assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    assert list(temporary.iterdir()) == []


def test_a_link_under_the_name_of_the_scratch_folder_is_not_followed(
    temporary: Path, tmp_path: Path
) -> None:
    other = tmp_path / "other"
    leftover = other / ".building-mine"
    other.mkdir(mode=0o700)  # all right but for the link to it
    leftover.mkdir()
    (temporary / f"odscen-{os.getuid()}").symlink_to(other)
    with scratch_folder() as folder:
        assert folder.resolve().is_relative_to(temporary)
        assert list(other.iterdir()) == [leftover]
    assert list(other.iterdir()) == [leftover]


@pytest.mark.parametrize("mode", [0o777, 0o750])
def test_a_scratch_folder_that_others_can_enter_is_not_used(temporary: Path, mode: int) -> None:
    open_to_others = temporary / f"odscen-{os.getuid()}"
    open_to_others.mkdir()
    open_to_others.chmod(mode)
    with scratch_folder() as folder:
        assert folder.parent != open_to_others
        assert stat.S_IMODE(folder.parent.stat().st_mode) == 0o700
    assert list(temporary.iterdir()) == [open_to_others]


@pytest.mark.skipif(os.getuid() != 0, reason="only root gives a folder to somebody else")
def test_a_scratch_folder_of_another_user_is_not_used(temporary: Path) -> None:
    theirs = temporary / f"odscen-{os.getuid()}"
    theirs.mkdir(mode=0o700)
    os.chown(theirs, 12345, 12345)
    with scratch_folder() as folder:
        assert folder.parent != theirs
    assert list(theirs.iterdir()) == []


def test_what_a_killed_process_left_is_removed_by_the_next_one_and_what_lives_stays(
    temporary: Path,
) -> None:
    code = (
        "import os, signal; from odscen.base.atomic_folders import scratch_folder\n"
        "with scratch_folder() as folder:\n"
        "    (folder / 'run').mkdir(); os.kill(os.getpid(), signal.SIGKILL)"
    )
    with scratch_folder() as living:
        for _ in range(2):
            subprocess.run([sys.executable, "-c", code], check=False)
        kept = {path.name for path in living.parent.iterdir()}
        assert living.name in kept
        assert len(kept) == 2  # the second one has removed what the first one left
    code = "from odscen.base.atomic_folders import scratch_folder\nwith scratch_folder(): pass"
    subprocess.run([sys.executable, "-c", code], check=True)
    assert list(temporary.iterdir()) == []


def test_without_any_temporary_folder_there_is_no_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    def none_usable() -> str:
        raise FileNotFoundError("No usable temporary directory found")

    monkeypatch.setattr(tempfile, "gettempdir", none_usable)
    with pytest.raises(FileNotFoundError, match="No usable"), scratch_folder():
        pass
