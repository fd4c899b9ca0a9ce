"""The wire format of protocol buffers: https://protobuf.dev/programming-guides/encoding.

Just what messages are made of that are written here. Many messages of one kind whose fields all
have a fixed width are packed at once, as rows of an array.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.base.arrays import FloatArray

_VARINT, _FIXED64, _BYTES, _FIXED32 = 0, 1, 2, 5
_MOST_BYTES = 127
"""Of a message whose length is one byte."""


def varint(value: int) -> bytes:
    """Base-128 varint; negative numbers are those of int32 and int64, ten bytes."""
    value &= (1 << 64) - 1
    found = bytearray()
    while value > 127:
        found.append(value & 127 | 128)
        value >>= 7
    found.append(value)
    return bytes(found)


def _encode_tag(field: int, wire: int) -> bytes:
    return varint(field << 3 | wire)


def whole(field: int, value: int) -> bytes:
    """A field of an integer, enumeration or truth value."""
    return _encode_tag(field, _VARINT) + varint(value)


def double(field: int, value: float) -> bytes:
    """A field of a double."""
    return _encode_tag(field, _FIXED64) + struct.pack("<d", value)


def message(field: int, content: bytes) -> bytes:
    """A field of a message, or of bytes."""
    return _encode_tag(field, _BYTES) + varint(len(content)) + content


def text(field: int, value: str) -> bytes:
    """A field of a string."""
    return message(field, value.encode())


def packed_messages(
    field: int,
    columns: Mapping[int, tuple[str, FloatArray]],
    *,
    flags: Mapping[int, Sequence[bool] | np.ndarray[tuple[int, ...], np.dtype[np.bool_]]]
    | None = None,
) -> bytes:
    """A repeated field of messages that have the same fields, one for each row.

    Parameters
    ----------
    columns
        By field: ``d`` (double) or ``f`` (float), and the values.
    flags
        By field: truth values.
    """
    kinds = {"d": (_FIXED64, "<f8"), "f": (_FIXED32, "<f4")}
    layout: list[tuple[str, str]] = [("tag", "u1"), ("size", "u1")]
    values: list[tuple[str, object]] = []
    for number, (kind, column) in columns.items():
        wire, form = kinds[kind]
        layout += [(f"t{number}", "u1"), (f"v{number}", form)]
        values += [(f"t{number}", number << 3 | wire), (f"v{number}", column)]
    for number, flag in (flags or {}).items():
        layout += [(f"t{number}", "u1"), (f"v{number}", "u1")]
        values += [(f"t{number}", number << 3 | _VARINT), (f"v{number}", np.asarray(flag))]
    kind_of = np.dtype(layout)
    size = kind_of.itemsize - 2
    assert size <= _MOST_BYTES
    rows = np.zeros(len(next(iter(columns.values()))[1]), dtype=kind_of)
    rows["tag"], rows["size"] = field << 3 | _BYTES, size
    for name, value in values:
        rows[name] = value
    return rows.tobytes()
