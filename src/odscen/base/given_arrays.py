"""Arrays in .npz files from outside: no pickles, nothing larger than it says, text that is text."""

from __future__ import annotations

import io
import math
import zipfile
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from odscen.base.errors import InputError
from odscen.base.given_files import UNREADABLE_ARCHIVE

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

Array = np.ndarray[Any, np.dtype[Any]]

MOST_UNPACKED = 2_000_000_000
"""Bytes of all arrays of a file together; the graph of the largest map that ships has 3 million."""
MOST_ARRAYS = 1000
_KINDS = "biufUS"
"""Kinds of values that are read: truth, whole numbers, reals, text."""
_MOST_CHARACTER = 0x10FFFF
_SURROGATES = (0xD800, 0xDFFF)


def npz_bytes(arrays: Mapping[str, Array], *, deflated: bool = False) -> bytes:
    """Write arrays as an .npz file without pickles; the same arrays give the same bytes."""
    buffer = io.BytesIO()
    write = np.savez_compressed if deflated else np.savez
    write(buffer, allow_pickle=False, **arrays)
    return buffer.getvalue()


def arrays_from_npz(
    data: bytes,
    *,
    file: str | None = None,
    only: Collection[str] | None = None,
    most: int = MOST_UNPACKED,
) -> dict[str, Array]:
    """Read the arrays of an .npz file; each has the size that its header says, or is refused.

    Parameters
    ----------
    only
        Names of the arrays that are wanted, of those that are there; all if not given.
    most
        Bytes of all of them together, unpacked.

    Raises
    ------
    InputError
        If it is no such file, or has too much; names the array and what is wrong with it.
    """
    if data.startswith(np.lib.format.MAGIC_PREFIX):
        raise InputError("it is a single array, not an .npz file with named ones", file=file)
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            return _read_arrays(archive, file, only, most)
    except UNREADABLE_ARCHIVE as error:
        raise InputError("it cannot be read as an .npz file", file=file) from error


def _read_arrays(
    archive: zipfile.ZipFile, file: str | None, only: Collection[str] | None, most: int
) -> dict[str, Array]:
    members = {member.filename.removesuffix(".npy"): member for member in archive.infolist()}
    if len(members) > MOST_ARRAYS:
        raise InputError(f"it has {len(members)} arrays; {MOST_ARRAYS} are the most", file=file)
    wanted = [name for name in members if only is None or name in only]
    size = sum(members[name].file_size for name in wanted)
    if size > most:
        raise InputError(f"its arrays have {size:,} bytes; {most:,} are the most", file=file)
    found = {}
    for name in wanted:
        try:
            with archive.open(members[name]) as stream:
                found[name] = _read_array(stream, members[name].file_size)
        except UNREADABLE_ARCHIVE as error:
            raise InputError(
                f"it is malformed: {error}", file=file, element=f"array {name}"
            ) from error
    return found


def _read_array(stream: IO[bytes], size: int) -> Array:
    """One array; ``ValueError`` says what is wrong with it."""
    version = np.lib.format.read_magic(stream)
    readers = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }
    if version not in readers:
        raise ValueError(f"its format is {version[0]}.{version[1]}, not 1.0 or 2.0")
    try:
        shape, by_columns, dtype = readers[version](stream)
    except Exception as error:  # numpy reads it as Python, and passes on whatever that raises
        raise ValueError("its header cannot be read") from error
    if dtype.kind not in _KINDS:
        raise ValueError(f"it has values of {dtype}, not numbers or text")
    count, left = math.prod(shape), size - stream.tell()
    if min(shape, default=0) < 0 or count * dtype.itemsize != left or count > left:
        raise ValueError(f"its header says {shape} values of {dtype}, and {left} bytes follow")
    values = np.frombuffer(bytearray(stream.read(left)), dtype=dtype)
    values = values.astype(dtype.newbyteorder("="), copy=False)
    if dtype.kind == "U" and count:
        _refuse_no_text(values)
    return values.reshape(shape, order="F" if by_columns else "C")


def _refuse_no_text(values: Array) -> None:
    """Refuse numbers that are no characters, on which everything that reads text would fail."""
    letters = values.view(np.uint32)
    low, high = _SURROGATES
    odd = (letters > _MOST_CHARACTER) | ((letters >= low) & (letters <= high))
    if np.any(odd):
        raise ValueError(f"{int(letters[odd][0]):#x} is no character")
