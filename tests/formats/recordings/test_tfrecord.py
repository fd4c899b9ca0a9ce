from __future__ import annotations

import struct

import numpy as np
import pytest

from odscen.formats.recordings.tfrecord import crc32c, read_tfrecord, tfrecord


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (b"", 0x00000000),
        (b"a", 0xC1D04330),
        (b"123456789", 0xE3069283),
        (bytes(32), 0x8A9136AA),
        (b"\xff" * 32, 0x62A8AB43),
        (bytes(range(32)), 0x46DD794E),
    ],
)
def test_the_checksum_is_that_of_rfc_3720(data: bytes, expected: int) -> None:
    assert crc32c(data) == expected


@pytest.mark.parametrize("size", [1, 3, 4, 5, 1023, 1024, 1025, 5000])
def test_long_data_have_the_checksum_of_one_byte_after_the_other(size: int) -> None:
    data = np.random.default_rng(size).integers(0, 256, size, dtype=np.uint8).tobytes()
    register = 0xFFFFFFFF
    for byte in data:
        register ^= byte
        for _ in range(8):
            register = register >> 1 ^ (0x82F63B78 if register & 1 else 0)
    assert crc32c(data) == register ^ 0xFFFFFFFF


def test_records_read_back_and_a_changed_byte_is_noticed() -> None:
    records = [b"first", b"", b"x" * 3000]
    data = tfrecord(records)
    assert list(read_tfrecord(data)) == records
    assert struct.unpack_from("<Q", data) == (5,)
    broken = bytearray(data)
    broken[-10] ^= 1
    with pytest.raises(ValueError, match="byte 37"):
        list(read_tfrecord(bytes(broken)))
    with pytest.raises(ValueError, match="damaged"):
        list(read_tfrecord(data[:-1]))
