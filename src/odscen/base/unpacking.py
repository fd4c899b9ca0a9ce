"""Packed files: gzip and bzip2, whole or in parts, with a bound on what comes out."""

from __future__ import annotations

import bz2
import zlib
from typing import TYPE_CHECKING, Final

from odscen.base.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator

GZIP: Final = b"\x1f\x8b"
"""How gzip begins."""
_CHUNK: Final = 1 << 20


def unpack_gzip(content: bytes, *, most: int) -> bytes:
    """Unpack a gzip file with all its members: SUMO's tools write a new one every 64 kB.

    Raises
    ------
    InputError
        If it is damaged or cut off, or has more than ``most`` bytes.
    """
    parts, size = [], 0
    for part in unpack_parts(content):
        size += len(part)
        if size > most:
            raise InputError(f"unpacked, the file has more than {most} bytes")
        parts.append(part)
    return b"".join(parts)


def unpack_parts(content: bytes) -> Iterator[bytes]:
    """Unpack gzip or bzip2 in parts of at most a megabyte, all members of the file.

    Raises
    ------
    InputError
        If it is damaged or cut off.
    """
    is_gzip = content.startswith(GZIP)
    rest = content
    while rest:
        unpacker = zlib.decompressobj(wbits=31) if is_gzip else bz2.BZ2Decompressor()
        data = rest
        try:
            while not unpacker.eof:
                part = unpacker.decompress(data, _CHUNK)
                data = unpacker.unconsumed_tail if is_gzip else b""  # type: ignore[union-attr]
                if part:
                    yield part
                elif unpacker.eof:
                    break
                elif is_gzip or unpacker.needs_input:  # type: ignore[union-attr]
                    raise InputError("the packed file is cut off; download it again")
        except (zlib.error, OSError, ValueError) as error:
            raise InputError(f"the packed file is damaged: {error}") from error
        rest = unpacker.unused_data.lstrip(b"\0")
