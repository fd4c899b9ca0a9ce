"""Packed files are read with all their members, and no further than a bound."""

from __future__ import annotations

import gzip

import pytest

from odscen.base.errors import InputError
from odscen.base.unpacking import unpack_gzip

TEXT = b"<net>" + b"x" * 3_000_000 + b"</net>"


def test_all_members_of_a_packed_file_are_read() -> None:
    packed = b"".join(gzip.compress(TEXT[n : n + 500_000]) for n in range(0, len(TEXT), 500_000))
    assert unpack_gzip(packed, most=10_000_000) == TEXT


@pytest.mark.parametrize(
    ("packed", "message"),
    [
        (gzip.compress(TEXT)[:-20], "the packed file is cut off"),
        (gzip.compress(TEXT) + gzip.compress(TEXT)[:30], "the packed file is cut off"),
        (b"\x1f\x8b broken", "the packed file is damaged"),
        (gzip.compress(TEXT) * 4, "unpacked, the file has more than 10000000 bytes"),
    ],
)
def test_what_is_damaged_cut_off_or_too_long_is_refused(packed: bytes, message: str) -> None:
    with pytest.raises(InputError, match=message):
        unpack_gzip(packed, most=10_000_000)
