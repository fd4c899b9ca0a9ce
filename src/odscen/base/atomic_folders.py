"""Folders that appear whole or not at all, those for a while, and what is left of both.

While a process fills or deletes a folder it holds a lock on it, the system's own: what is left of a
process that was killed is recognised by a lock that nobody holds, see :func:`clear_leftovers`.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import stat
import tempfile
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from odscen.base.errors import WorkspaceError
from odscen.base.folder_locks import same_file
from odscen.base.to_disk import all_to_disk, to_disk

if TYPE_CHECKING:
    from collections.abc import Iterator

_ATTEMPTS = 20
_BUILDING, _REMOVED, _REPLACED = ".building-", ".removed-", ".replaced-"


@contextmanager
def new_folder(final: Path) -> Iterator[Path]:
    """Yield an empty folder that is renamed to ``final`` when the block succeeds.

    It lies beside ``final``, so that the rename is one step; whatever ``final`` held is replaced,
    when all of the new folder is on the disk. If the block raises, nothing is left of the new
    folder and ``final`` is untouched.
    """
    final.parent.mkdir(parents=True, exist_ok=True)
    with _temporary_folder(final.parent, _BUILDING) as folder:
        folder.chmod(0o755)  # mkdtemp makes it private, which a finished map or run need not be
        yield folder
        all_to_disk(folder)
        _put_in_place(folder, final)
        to_disk(final.parent)


@contextmanager
def in_use(folder: Path) -> Iterator[None]:
    """Keep a folder in the making from being cleared away, for another process that works in it."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH)
        yield
    finally:
        os.close(descriptor)


@contextmanager
def passing_folder(parent: Path) -> Iterator[Path]:
    """Yield an empty folder that is removed afterwards.

    That of a process that was killed is removed by :func:`clear_leftovers` of ``parent``.
    """
    with _temporary_folder(parent, _BUILDING) as folder:
        yield folder


@contextmanager
def scratch_folder() -> Iterator[Path]:
    """Yield an empty folder in the temporary directory that is removed afterwards.

    It lies in a folder that only its user can enter; what killed processes of that user have left
    there is removed by the next one, once.
    """
    tempfile.gettempdir()  # outside of the loop: there may be none
    with ExitStack() as stack:
        while True:
            with suppress(FileNotFoundError):  # another process has just removed it
                parent = _private_folder()
                stack.callback(_remove_if_empty, parent)
                folder = stack.enter_context(passing_folder(parent))
                break
        yield folder


def _private_folder() -> Path:
    """Folder of this user in the temporary directory, which is everybody's.

    Whoever is there first can take the name, with a link to where files are to be deleted or with
    a folder to write runs into: another name, which nobody can foresee, is taken then.
    """
    name = f"odscen-{os.getuid()}"
    folder = Path(tempfile.gettempdir(), name)
    with suppress(FileExistsError):
        folder.mkdir(mode=0o700)
    status = folder.lstat()
    if stat.S_ISDIR(status.st_mode) and status.st_uid == os.getuid() and not status.st_mode & 0o077:
        _clear_once(folder)
        return folder
    return Path(tempfile.mkdtemp(prefix=f"{name}-"))


@cache
def _clear_once(folder: Path) -> None:
    clear_leftovers(folder)


def _remove_if_empty(folder: Path) -> None:
    with suppress(OSError):
        folder.rmdir()


def discard(folder: Path) -> None:
    """Take a folder out of sight in one step, then delete it."""
    with _temporary_folder(folder.parent, _REMOVED) as grave:
        folder.rename(grave / folder.name)


def clear_leftovers(parent: Path) -> list[str]:
    """Remove what processes that were killed have left in a folder of maps or runs.

    What was about to be replaced when its process was killed is put back. Nothing that a process
    works on is touched, and nothing raises.

    Returns
    -------
    list of str
        Names of what was removed.
    """
    try:
        leftovers = sorted(path for path in parent.iterdir() if path.name.startswith("."))
    except OSError:
        return []
    kinds = (_BUILDING, _REMOVED, _REPLACED)
    cleared = []
    for path in leftovers:
        is_lock = path.name.endswith(".lock")
        if (is_lock or path.name.startswith(kinds)) and _clear_path(path):
            cleared.append(path.name)
    return cleared


@contextmanager
def _temporary_folder(parent: Path, prefix: str) -> Iterator[Path]:
    """Yield a new folder whose lock is held, and delete what is left of it."""
    while True:
        folder = Path(tempfile.mkdtemp(prefix=prefix, dir=parent))
        with suppress(FileNotFoundError):  # cleared away before we had the lock
            descriptor = _hold_folder(folder)
            if same_file(descriptor, folder):
                break
            os.close(descriptor)
    try:
        yield folder
    finally:
        with suppress(OSError):
            shutil.rmtree(folder)
        os.close(descriptor)
        _delete_with_one_handle(folder)


def _delete_with_one_handle(folder: Path) -> None:
    """Delete what is left of a folder where files are open already, as many as may be."""
    with suppress(OSError):
        for path in [*sorted(folder.rglob("*"), reverse=True), folder]:
            if path.is_dir() and not path.is_symlink():
                path.rmdir()
            else:
                path.unlink(missing_ok=True)


def _hold_folder(folder: Path) -> int:
    """Take the lock of a folder that has just been made; it does not stay without one."""
    try:
        descriptor = os.open(folder, os.O_RDONLY)
    except FileNotFoundError:
        raise
    except OSError:
        folder.rmdir()
        raise
    fcntl.flock(descriptor, fcntl.LOCK_SH)
    return descriptor


def _put_in_place(folder: Path, final: Path) -> None:
    """Rename ``folder`` to ``final``; the last of several processes that do so at a time wins."""
    for _ in range(_ATTEMPTS):
        with _temporary_folder(final.parent, _REPLACED) as grave:
            with suppress(FileNotFoundError):
                final.rename(grave / final.name)
            try:
                folder.rename(final)
            except OSError:
                if not final.exists():  # not that another process was faster
                    with suppress(OSError):
                        (grave / final.name).rename(final)
                    raise
            else:
                return
    raise WorkspaceError(f"{final} is written by other processes all the time")


def _clear_path(path: Path) -> bool:
    try:
        descriptor = os.open(path, os.O_RDONLY)
    except OSError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if not same_file(descriptor, path):
            return False
        if path.name.startswith(_REPLACED):
            _put_back(path)
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink()
    except OSError:  # held, or not ours to delete
        return False
    finally:
        os.close(descriptor)
    return True


def _put_back(grave: Path) -> None:
    for old in grave.iterdir():
        final = grave.parent / old.name
        if not final.exists():
            old.rename(final)
