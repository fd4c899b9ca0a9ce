"""Damage to archives of arrays."""

from __future__ import annotations

import io
import zipfile
import zlib
from typing import Any

import numpy as np

from bench.fuzz.damage import RAW, Change, Generator, flipped, pick, torn

Array = np.ndarray[Any, np.dtype[Any]]


def _member(data: bytes, rng: Generator) -> bytes:
    """One member of an archive gone, cut, empty, doubled, or another's."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = {name: archive.read(name) for name in archive.namelist()}
    except (zipfile.BadZipFile, zlib.error, EOFError, OSError, ValueError, NotImplementedError):
        return flipped(data, rng)
    if not members:
        return data
    name = pick(rng, sorted(members))
    what = pick(rng, ("drop", "cut", "swap", "array", "array", "huge", "outside"))
    if what == "drop":
        del members[name]
    elif what == "cut":
        members[name] = torn(members[name], rng)
    elif what == "swap":
        members[name] = members[pick(rng, sorted(members))]
    elif what == "outside":
        members["../../outside.npy"] = members[name]
    elif what == "huge":
        members[name] = _huge_array()
    else:
        members[name] = _array(members[name], rng)
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive:
        for each, content in members.items():
            archive.writestr(each, content)
    return made.getvalue()


def _huge_array() -> bytes:
    """A header that promises 16 GB, and nothing behind it."""
    made = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        made, {"descr": "<f8", "fortran_order": False, "shape": (2_000_000_000,)}
    )
    return made.getvalue() + bytes(64)


def _array(member: bytes, rng: Generator) -> bytes:
    """Another type, shape or content of one array."""
    try:
        array = np.lib.format.read_array(io.BytesIO(member))
    except (ValueError, EOFError, OSError):
        return flipped(member, rng)
    what = pick(rng, ("type", "shape", "value", "shorter", "empty"))
    with np.errstate(all="ignore"):  # numbers that its type does not have are meant
        array = _changed_array(array, what, rng)
    made = io.BytesIO()
    np.lib.format.write_array(made, np.asarray(array), allow_pickle=False)
    return made.getvalue()


def _changed_array(array: Array, what: str, rng: Generator) -> Array:
    if what == "type":
        array = (
            array.astype(pick(rng, ("U20", "i8", "u1", "?", "c16")), casting="unsafe")
            if array.dtype.kind != "U"
            else np.zeros(array.shape)
        )
    elif what == "shape":
        array = array.reshape(-1, 1)
    elif what == "shorter":
        array = array[: len(array) // 2] if array.ndim else array
    elif what == "empty":
        array = array[:0] if array.ndim else array
    elif array.size and array.dtype.kind in "iuf":
        array = array.copy()
        array.flat[int(rng.integers(array.size))] = (
            pick(rng, (np.nan, np.inf, -1e300, 1e300))
            if array.dtype.kind == "f"
            else pick(rng, (-1, np.iinfo(array.dtype).max, np.iinfo(array.dtype).min))
        )
    return array


ARCHIVE: dict[str, Change] = {**RAW, **{f"member {n}": _member for n in range(8)}}
