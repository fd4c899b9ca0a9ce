"""One process at a time works on a folder: a lock beside it that says who holds it, since when.

The lock is the system's own: it ends with the processes that hold it, however they end. It lies
beside the folder and not in it, as folders are replaced by renaming, and is there only while it is
held, or after a process that was killed.
"""

from __future__ import annotations

import errno
import fcntl
import json
import os
import socket
import sys
import time
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any

from odscen.base.errors import ConflictError, InputError
from odscen.base.shown import printable

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

GRACE = 10.0
"""Wall seconds to wait for the processes of a holder that is gone: they are about to notice, and
bring what they have to the disk."""
_LISTEN = 0.05


def lock_file(folder: Path) -> Path:
    """Where the lock of a folder is."""
    return folder.with_name(f".{folder.name}.lock")


@contextmanager
def locked(folder: Path, *, what: str, patience: float = 0.0) -> Iterator[int]:
    """Hold the lock of a folder, which need not be there; its parent is made.

    Yields the lock's file descriptor: processes that inherit it hold the lock as well. Of a parent
    that was made nothing is left if nothing came into it.

    Parameters
    ----------
    what
        How the folder is named in messages, for example ``run 'two'``.
    patience
        Wall seconds to wait for a holder that lives.

    Raises
    ------
    ConflictError
        If another process holds it; says which, and since when.
    InputError
        If the path of the folder is no text.
    NotADirectoryError
        If a file lies where its parent belongs.
    """
    _refuse_undecodable(folder)
    absent = [parent for parent in folder.parents if not parent.exists()]
    descriptor = _take_lock(folder, what, patience)
    try:
        yield descriptor
    finally:
        with suppress(OSError):
            lock_file(folder).unlink()  # before it is given back: nobody else has it yet
        os.close(descriptor)
        with suppress(OSError):  # that are not empty
            for parent in absent:
                parent.rmdir()


def _make_parent(folder: Path) -> None:
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
    except FileExistsError as error:  # a file of that name
        raise NotADirectoryError(
            errno.ENOTDIR, os.strerror(errno.ENOTDIR), error.filename
        ) from error


def _refuse_undecodable(folder: Path) -> None:
    """Refuse a folder whose path other programs and files cannot be given."""
    path = str(folder.absolute())
    try:
        path.encode()
    except UnicodeEncodeError:
        raise InputError(
            f"the path of this folder is no text in {sys.getfilesystemencoding()}; name another "
            "one, or set a locale with UTF-8, as LC_ALL=C.UTF-8 is",
            file=printable(path),
        ) from None


def is_locked(folder: Path) -> bool:
    """Whether some process holds the lock of a folder."""
    return not free(lock_file(folder))


def free(path: Path) -> bool:
    """Whether nobody holds the lock on a file or folder; true if it is not there."""
    try:
        descriptor = os.open(path, os.O_RDONLY)
    except OSError:
        return True
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    finally:
        os.close(descriptor)
    return True


def same_file(descriptor: int, path: Path) -> bool:
    """Whether a path still leads to the file that is open."""
    try:
        return os.path.samestat(os.fstat(descriptor), path.stat())
    except OSError:
        return False


def _take_lock(folder: Path, what: str, patience: float) -> int:
    path, start = lock_file(folder), time.monotonic()
    while True:
        _make_parent(folder)
        try:
            descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        except FileNotFoundError:  # another process had made the parent, and has just removed it
            continue
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if same_file(descriptor, path):
                _write_holder(descriptor)
                return descriptor
            os.close(descriptor)  # its holder has just removed it
        except BlockingIOError:
            holder = _read_holder(descriptor)
            os.close(descriptor)
            if time.monotonic() - start >= (patience if _holder_lives(holder) else GRACE):
                raise ConflictError(
                    f"{what} is in the hands of {_describe_holder(holder)}"
                ) from None
            time.sleep(_LISTEN)
        except BaseException:
            os.close(descriptor)
            raise


def _write_holder(descriptor: int) -> None:
    since = time.strftime("%Y-%m-%d %H:%M:%S")
    holder = {"pid": os.getpid(), "host": socket.gethostname(), "since": since}
    os.ftruncate(descriptor, 0)
    os.pwrite(descriptor, json.dumps(holder).encode(), 0)


def _read_holder(descriptor: int) -> dict[str, Any]:
    """What the holder has said of itself; empty if it has not yet."""
    try:
        holder = json.loads(os.pread(descriptor, 1000, 0))
    except (OSError, ValueError):
        return {}
    return holder if isinstance(holder, dict) else {}


def _holder_lives(holder: dict[str, Any]) -> bool:
    """Whether the process that took the lock is there; what it has started may outlive it."""
    if not holder or holder.get("host") != socket.gethostname():
        return bool(holder)
    try:
        os.kill(int(holder["pid"]), 0)
    except (ProcessLookupError, ValueError, KeyError):
        return False
    except OSError:  # somebody else's
        return True
    return True


def _describe_holder(holder: dict[str, Any]) -> str:
    if not holder:
        return "another process"
    host = holder.get("host")
    place = "" if host == socket.gethostname() else f" on {host}"
    return f"process {holder.get('pid')}{place} since {holder.get('since')}"
