"""The token of a workspace, kept over starts of the server, so that open pages keep working.

It lies in the user's own state folder and not in the workspace: a workspace is handed on, copied
and shared, and who made one must not know the token of those who open it.
"""

from __future__ import annotations

import hashlib
import os
import secrets
import stat
from contextlib import suppress
from typing import TYPE_CHECKING

from odscen.web.security import is_token

if TYPE_CHECKING:
    from pathlib import Path

_BYTES = 24
_LONGEST = 1000
"""Bytes of the file that are read; a token has 256 at most."""


def kept_token(workspace: Path, folder: Path, *, renew: bool = False) -> str:
    """Token of a workspace: the one of its last start, or a new one that is kept.

    One that others could have read or written is not used again: the file has to be a plain one
    of this user, with no rights for others. Where nothing can be kept, it is of this start only.

    Parameters
    ----------
    workspace
        Its root; the token is of this very folder.
    folder
        Of this user, for all tokens; made if need be, for this user alone.
    renew
        Make a new one and forget the last.
    """
    name = hashlib.sha256(os.fsencode(workspace.resolve())).hexdigest()[:32]
    file = folder / name
    if not renew and (token := _read_token(file)) is not None:
        return token
    token = secrets.token_urlsafe(_BYTES)
    _write_token(file, token)
    return token


def _read_token(file: Path) -> str | None:
    """Token in a file that only this user can read and write; ``None`` if there is none."""
    flags = os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
    try:
        handle = os.open(file, flags)
    except OSError:
        return None
    try:
        about = os.fstat(handle)
        own = os.name == "nt" or (about.st_uid == os.geteuid() and not about.st_mode & 0o077)
        if not (own and stat.S_ISREG(about.st_mode)):
            return None
        text = os.read(handle, _LONGEST).decode("ascii", "replace").strip()
    except OSError:
        return None
    finally:
        os.close(handle)
    return text if is_token(text) else None


def _write_token(file: Path, token: str) -> None:
    """Write a token for this user alone; without a word if it cannot be kept."""
    part = file.with_name(f"{file.name}.{os.getpid()}.part")
    try:
        file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        part.unlink(missing_ok=True)
        handle = os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with os.fdopen(handle, "w", encoding="ascii") as opened:
            opened.write(token)
        part.replace(file)
    except OSError:
        with suppress(OSError):
            part.unlink(missing_ok=True)
