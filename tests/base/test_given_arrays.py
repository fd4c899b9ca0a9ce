"""Arrays from outside: read whole, or refused by name."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from odscen.base import given_arrays
from odscen.base.errors import InputError
from odscen.base.given_arrays import Array, arrays_from_npz, npz_bytes


def member(header: bytes, body: bytes = b"", *, version: bytes = b"\x01\x00") -> bytes:
    """An .npz file of one array with this header."""
    magic = b"\x93NUMPY" + version + len(header).to_bytes(2, "little")
    with zipfile.ZipFile(buffer := io.BytesIO(), "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.npy", magic + header + body)
    return buffer.getvalue()


def said(kind: str, shape: str, *, more: str = "") -> bytes:
    return f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}{more}}}\n".encode()


def pickled() -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, a=np.array([None], dtype=object))
    return buffer.getvalue()


def cut() -> bytes:
    data = npz_bytes({"a": np.arange(1000)})
    return data[: len(data) // 2]


def flipped() -> bytes:
    """A byte in the middle of an array is another one."""
    data = bytearray(npz_bytes({"a": np.arange(1000)}))
    data[len(data) // 2] ^= 0xFF
    return bytes(data)


@pytest.mark.parametrize(
    "values",
    [
        np.arange(6).reshape(2, 3),
        np.asfortranarray(np.arange(6.0).reshape(2, 3)),
        np.array(["a", "é", ""]),
        np.array("text"),
        np.array(3.5),
        np.array([True]),
        np.array([1, 2], dtype=">i4"),
        np.empty((0, 4), dtype=np.uint8),
    ],
)
def test_what_numpy_writes_is_read_as_it_was_and_can_be_changed(values: Array) -> None:
    (read,) = arrays_from_npz(npz_bytes({"a": values})).values()
    assert read.dtype == values.dtype.newbyteorder("=")
    assert read.shape == values.shape
    assert read.tolist() == values.tolist()
    read[...] = values  # not a view of bytes that nobody may change


def test_compressed_files_are_read_too_and_only_what_is_wanted() -> None:
    np.savez_compressed(buffer := io.BytesIO(), a=np.arange(5), b=np.zeros(3))
    assert [*arrays_from_npz(buffer.getvalue(), only=("b", "c"))] == ["b"]


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (lambda: b"", "f: it cannot be read as an .npz file"),
        (lambda: b"PK\x03\x04 and more", "f: it cannot be read as an .npz file"),
        (cut, "f: it cannot be read as an .npz file"),
        (flipped, "f: array a: it is malformed: Bad CRC-32"),
        (lambda: npz_bytes({"a": np.arange(3)})[30:], "f: it cannot|f: array a"),
        (pickled, "f: array a: it is malformed: it has values of object"),
        (lambda: member(said("<f8", "(3,)"), bytes(16)), r"says \(3,\) .* and 16 bytes follow"),
        (lambda: member(said("<f8", "(9999999999999,)")), "and 0 bytes follow"),
        (lambda: member(said("<U0", "(9999999999999,)")), "and 0 bytes follow"),
        (lambda: member(said("<f8", "(-1, -1)"), bytes(8)), "and 8 bytes follow"),
        (lambda: member(said("V8", "(1,)"), bytes(8)), "not numbers or text"),
        (lambda: member(said("<m8[s]", "(1,)"), bytes(8)), "not numbers or text"),
        (lambda: member(said("<U1", "(1,)"), b"\xff\xff\xff\xff"), "0xffffffff is no character"),
        (lambda: member(said("<U1", "(1,)"), b"\x00\xd8\x00\x00"), "0xd800 is no character"),
        (lambda: member(b"{"), "malformed"),
        (lambda: member(b"[" * 5000), "malformed"),
        (lambda: member(said("<f8", "(1,)"), bytes(8), version=b"\x09\x00"), "format is 9.0"),
        (lambda: member(b"", version=b"\x01\x00")[:-1], "cannot be read"),
    ],
)
def test_what_is_not_an_array_is_refused_by_name(data: Callable[[], bytes], words: str) -> None:
    with pytest.raises(InputError, match=words) as refused:
        arrays_from_npz(data(), file="f")
    assert str(refused.value).startswith("f: ")


def test_a_file_that_unpacks_to_too_much_is_refused_before_it_is_unpacked() -> None:
    np.savez_compressed(buffer := io.BytesIO(), a=np.zeros(10**6))
    data = buffer.getvalue()
    assert len(data) < 20_000
    with pytest.raises(InputError, match="its arrays have 8,000,128 bytes; 1,000,000 are"):
        arrays_from_npz(data, most=10**6)


def test_a_file_of_too_many_arrays_is_refused() -> None:
    many = npz_bytes({f"a{k}": np.zeros(0) for k in range(given_arrays.MOST_ARRAYS + 1)})
    with pytest.raises(InputError, match="it has 1001 arrays; 1000 are the most"):
        arrays_from_npz(many)


@pytest.mark.slow
@given(st.data())
def test_damage_anywhere_is_refused_or_changes_no_shape(data: st.DataObject) -> None:
    whole = npz_bytes({"a": np.arange(20), "b": np.array(["x", "yz"])})
    damaged = bytearray(whole)
    for _ in range(data.draw(st.integers(1, 4))):
        damaged[data.draw(st.integers(0, len(whole) - 1))] = data.draw(st.integers(0, 255))
    try:
        arrays = arrays_from_npz(bytes(damaged[: data.draw(st.integers(0, len(whole)))]))
    except InputError:
        return
    assert all(one.nbytes <= len(whole) for one in arrays.values())
