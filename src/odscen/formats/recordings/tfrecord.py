"""TFRecord files: each record between its length and masked checksums.

https://www.tensorflow.org/tutorials/load_data/tfrecord#tfrecords_format_details: length as uint64,
masked CRC-32C of the length, the record, masked CRC-32C of the record; little-endian.
"""

from __future__ import annotations

import struct
from functools import lru_cache, reduce
from operator import xor
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray

_POLYNOMIAL = 0x82F63B78
"""Of CRC-32C (Castagnoli, RFC 3720), bits reversed."""
_MASK_DELTA = 0xA282EAD8
_ALL = 0xFFFFFFFF
_ROW = 1024
"""Bytes that are taken one after the other; rows of them are taken all at once."""


def tfrecord(records: Iterable[bytes]) -> bytes:
    """A file of records."""
    parts = []
    for record in records:
        length = struct.pack("<Q", len(record))
        parts += [length, _masked_crc(length), record, _masked_crc(record)]
    return b"".join(parts)


def read_tfrecord(data: bytes) -> Iterator[bytes]:
    """Records of a file.

    Raises
    ------
    ValueError
        If it is cut off, or a checksum is wrong.
    """
    at = 0
    while at < len(data):
        length = data[at : at + 8]
        size = int.from_bytes(length, "little")
        record = data[at + 12 : at + 12 + size]
        checks = data[at + 8 : at + 12], data[at + 12 + size : at + 16 + size]
        if checks != (_masked_crc(length), _masked_crc(record)):
            raise ValueError(f"the record at byte {at} is damaged")
        yield record
        at += 16 + size


def crc32c(data: bytes) -> int:
    """CRC-32C of some bytes.

    The register is linear in the data: rows of it are worked through side by side, each from an
    empty register, and joined by moving what came before on by the length of a row. That the
    register begins with ones is the same as the first four bytes being inverted; zeros before that
    change nothing.
    """
    head = bytes(255 - byte for byte in data[:4].ljust(4, b"\0"))
    if len(data) < 4:
        return _crc_of_short(data)
    rows = -(-len(data) // _ROW)
    padded = np.frombuffer((head + data[4:]).rjust(rows * _ROW, b"\0"), dtype=np.uint8)
    register = np.zeros(rows, dtype=np.uint32)
    table = _make_crc_table()
    for column in padded.reshape(rows, _ROW).T:
        register = table[(register ^ column) & 255] ^ (register >> 8)
    moved = _make_row_shifts()
    joined = 0
    for row in register.tolist():
        joined = row ^ reduce(xor, (moved[k][joined >> 8 * k & 255] for k in range(4)))
    return joined ^ _ALL


def _masked_crc(data: bytes) -> bytes:
    crc = crc32c(data)
    return struct.pack("<I", ((crc >> 15 | crc << 17) + _MASK_DELTA) & _ALL)


def _crc_of_short(data: bytes) -> int:
    register, table = _ALL, _make_crc_table().tolist()
    for byte in data:
        register = table[(register ^ byte) & 255] ^ (register >> 8)
    return int(register ^ _ALL)


@lru_cache(maxsize=1)
def _make_crc_table() -> NDArray[np.uint32]:
    """Register after each byte, from an empty one."""
    table = np.arange(256, dtype=np.uint32)
    for _ in range(8):
        table = np.where(table & 1, table >> 1 ^ np.uint32(_POLYNOMIAL), table >> 1)
    return table.astype(np.uint32)


@lru_cache(maxsize=1)
def _make_row_shifts() -> list[list[int]]:
    """Register after a row of zeros, for each value of each of its four bytes."""
    register = np.arange(256, dtype=np.uint32)[None] << (8 * np.arange(4, dtype=np.uint32))[:, None]
    table = _make_crc_table()
    for _ in range(_ROW):
        register = table[register & 255] ^ (register >> 8)
    return [[int(bit) for bit in row] for row in register]
