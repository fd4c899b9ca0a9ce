"""Checksums of stored files: ``SHA256SUMS`` in a folder, as ``sha256sum -c`` reads it.

Whatever is read again later has its SHA-256 written down beside it, and is compared before anything
is computed from it: disks, copies and people change files. The last line is a comment with the
SHA-256 of the lines above it, so that the list itself is checked, too.

Small files that change while work goes on carry their own: :func:`seal` and :func:`unsealed`.
"""

from __future__ import annotations

import hashlib
import json
import logging
import os
import re
from functools import cache
from typing import TYPE_CHECKING, Any

from odscen.base.errors import DamagedError, DamagedFile
from odscen.base.to_disk import write_whole

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping
    from pathlib import Path

SUMS_FILE = "SHA256SUMS"

MISSING = "no such file"
_OWN = "its own checksum in its last line"
_DIGEST = re.compile(r"[0-9a-f]{64}")
_LINE = re.compile(r"([0-9a-f]{64})  (.+)")
_SEAL = '"sha256": "'
_AT_ONCE = 1 << 18
"""Bytes; where there are less no buffer is made for them, which would take longer."""


def digest(content: bytes) -> str:
    """SHA-256, hexadecimal."""
    return hashlib.sha256(content).hexdigest()


def file_digest(path: Path | str) -> str:
    """SHA-256 of a file of any size, hexadecimal."""
    with open(path, "rb", buffering=0) as file:  # noqa: PTH123 - asked for each file of a run
        first = file.read(_AT_ONCE)
        if len(first) < _AT_ONCE:
            return digest(first)
        file.seek(0)
        return hashlib.file_digest(file, "sha256").hexdigest()


def sums_of(
    folder: Path, *, leave: Collection[str] = (), known: Mapping[str, str] | None = None
) -> dict[str, str]:
    """SHA-256 of every file in a folder and below, by its path in it, sorted.

    Parameters
    ----------
    leave
        Paths that are left out: files that change later.
    known
        What has been computed already; such files are not read.
    """
    known, top = known or {}, str(folder)
    return {
        name: known.get(name) or file_digest(f"{top}/{name}")
        for name in sorted(_names_in(top, ""))
        if name != SUMS_FILE and name not in leave
    }


def _names_in(folder: str, before: str) -> Iterator[str]:
    """Yield names of files in a folder and below, folders with a slash before them."""
    with os.scandir(folder) as found:
        for entry in found:
            if entry.is_dir(follow_symlinks=False):
                yield from _names_in(entry.path, f"{before}{entry.name}/")
            elif entry.is_file():
                yield before + entry.name


def write_sums(folder: Path, sums: Mapping[str, str], *, hidden: bool = False) -> None:
    """Write the list of a folder in one step.

    Of a ``hidden`` folder, which appears when all of it is on the disk, the list does not go first.
    """
    lines = "".join(f"{sums[name]}  {name}\n" for name in sorted(sums))
    text = f"{lines}# {digest(lines.encode())}\n"
    if hidden:
        (folder / SUMS_FILE).write_text(text, encoding="utf-8")
    else:
        write_whole(folder / SUMS_FILE, text)


def read_sums(folder: Path) -> dict[str, str] | None:
    """Read the list of a folder; ``None`` if it has none, as those of earlier versions.

    Raises
    ------
    DamagedError
        If the list itself is not as it was written.
    """
    try:
        content = (folder / SUMS_FILE).read_bytes()
    except FileNotFoundError:
        return None
    except OSError as error:
        raise _describe_damage(folder / SUMS_FILE, "a list that can be read", str(error)) from error
    lines, mark, own = content.rpartition(b"# ")
    if not mark or own != f"{digest(lines)}\n".encode():
        raise _describe_damage(folder / SUMS_FILE, _read_own_checksum(own.strip()), digest(lines))
    matches = (_LINE.fullmatch(line) for line in lines.decode().splitlines())
    return {line[2]: line[1] for line in matches if line}


def damaged_files(
    folder: Path, sums: Mapping[str, str], *, may_miss: Collection[str] = ()
) -> list[DamagedFile]:
    """Files that are not as the list says; those in ``may_miss`` may have been deleted."""
    files = []
    for name, expected in sums.items():
        try:
            now = file_digest(folder / name)
        except FileNotFoundError:
            if name in may_miss:
                continue
            now = MISSING
        except OSError as error:
            now = error.strerror or str(error)
        if now != expected:
            files.append(DamagedFile(name, expected, now))
    return files


@cache
def say_unchecked(folder: Path) -> None:
    """Say once that a folder was written by a version that kept no checksums."""
    words = "%s has no %s, as of earlier versions: its files are not checked"
    logging.getLogger("odscen").warning(words, folder, SUMS_FILE)


def read_checked(folder: Path, name: str, sums: Mapping[str, str] | None) -> bytes:
    """Content of a file, compared with the list of its folder, if it has one.

    Raises
    ------
    DamagedError
        If it is not as it was written, or is missing.
    """
    expected = None if sums is None else sums.get(name)
    try:
        content = (folder / name).read_bytes()
    except OSError as error:
        words = MISSING if isinstance(error, FileNotFoundError) else error.strerror or str(error)
        wrong = DamagedFile(name, expected or "a file", words)
        raise DamagedError(str(folder), [wrong]) from error
    if expected is not None and (found := digest(content)) != expected:
        raise DamagedError(str(folder), [DamagedFile(name, expected, found)])
    return content


def refuse_damaged(folder: Path, sums: Mapping[str, str]) -> None:
    """Compare files of a folder with their checksums.

    Raises
    ------
    DamagedError
        With each that is not as it was written.
    """
    wrong = damaged_files(folder, sums)
    if wrong:
        raise DamagedError(str(folder), wrong)


def seal_files(folder: Path, names: Iterable[str]) -> None:
    """Write down the checksums of files of a folder that have been written, beside those known."""
    sums = read_sums(folder) or {}
    write_sums(folder, {**sums, **{name: file_digest(folder / name) for name in names}})


def unseal_files(folder: Path, names: Collection[str]) -> None:
    """Forget the checksums of files that are about to be written anew: a kill may come between."""
    sums = read_sums(folder) or {}
    if not sums.keys().isdisjoint(names):
        write_sums(folder, {name: digest for name, digest in sums.items() if name not in names})


def check_files(
    folder: Path, *, only: Collection[str] | None = None, may_miss: Collection[str] = ()
) -> None:
    """Compare files of a folder with their checksums, all of them or some.

    One that has none was written by a process that was killed before it could write that down.
    Those in ``may_miss`` may have been deleted, as they are made anew.

    Raises
    ------
    DamagedError
        With each that is not as it was written.
    """
    sums = read_sums(folder)
    if sums is None:
        say_unchecked(folder)
        return
    asked = {name: known for name, known in sums.items() if only is None or name in only}
    wrong = damaged_files(folder, asked, may_miss=may_miss)
    if wrong:
        raise DamagedError(str(folder), wrong)


def seal(data: Mapping[str, Any], *, indent: int | None = None) -> str:
    """JSON of an object with its own SHA-256 as its last field."""
    return seal_text(json.dumps(data, indent=indent, ensure_ascii=False), indent=indent or 0)


def seal_text(text: str, *, indent: int = 0) -> str:
    """The JSON text of an object that has fields, with its own SHA-256 as its last one."""
    head = text.rstrip().removesuffix("}").rstrip("\n") + f",\n{' ' * indent}{_SEAL}"
    return f'{head}{digest(head.encode())}"\n}}\n'


def unsealed(path: Path) -> dict[str, Any]:
    """Read what :func:`seal` has made; what earlier versions wrote has no seal and is believed.

    Raises
    ------
    DamagedError
        If it is not as it was written.
    OSError
        If it cannot be read.
    """
    content = path.read_bytes()
    head, mark, own = content.rpartition(_SEAL.encode())
    actual = digest(head + mark)
    if mark and own != f'{actual}"\n}}\n'.encode():
        raise _describe_damage(path, _read_own_checksum(own[:64]), actual)
    try:
        data = json.loads(content)
    except (ValueError, RecursionError) as error:
        raise _describe_damage(path, _OWN, "something that is no JSON") from error
    if not isinstance(data, dict) or (not mark and data.get("version") != 1):
        raise _describe_damage(path, _OWN, "none")
    data.pop("sha256", None)
    return data


def _read_own_checksum(own: bytes) -> str:
    """The checksum that a file says of itself, if it is one."""
    own_sum = own.decode("ascii", "replace")
    return own_sum if _DIGEST.fullmatch(own_sum) else _OWN


def _describe_damage(path: Path, expected: str, found: str) -> DamagedError:
    return DamagedError(str(path.parent), [DamagedFile(path.name, expected, found)])
