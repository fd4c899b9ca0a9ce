from __future__ import annotations

import struct

import numpy as np
import pytest

from odscen.formats.recordings.protobuf_wire import (
    double,
    message,
    packed_messages,
    text,
    varint,
    whole,
)


@pytest.mark.parametrize(
    ("value", "expected"),
    [(0, b"\0"), (1, b"\1"), (127, b"\x7f"), (150, b"\x96\1"), (-1, b"\xff" * 9 + b"\1")],
)
def test_varints_are_those_of_the_documentation(value: int, expected: bytes) -> None:
    assert varint(value) == expected


def test_rows_that_are_packed_are_messages_one_by_one() -> None:
    x, y, on = np.array([1.5, -2.0]), np.array([0.25, 4.0]), np.array([True, False])
    packed = packed_messages(3, {2: ("d", x), 5: ("f", y)}, flags={11: on})
    single = [
        message(3, double(2, a) + b"\x2d" + struct.pack("<f", b) + whole(11, int(c)))
        for a, b, c in zip(x.tolist(), y.tolist(), on.tolist(), strict=True)
    ]
    assert packed == b"".join(single)


def test_texts_are_counted_in_bytes() -> None:
    assert text(5, "é") == b"\x2a\x02\xc3\xa9"
