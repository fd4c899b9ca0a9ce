"""Traces of ASAM OSI 3, ``.osi`` and MCAP (that of omega-prime, too): moving objects in time.

A ``.osi`` file is messages, each after its length in four bytes, little-endian
(``open-simulation-interface``, ``doc/architecture/trace_file_formats.adoc``). Read are
``GroundTruth``, and the ``global_ground_truth`` of ``SensorView``; of both only the fields that
tracks have, by the numbers of ``osi_groundtruth.proto``, ``osi_object.proto`` and
``osi_common.proto``.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import polars as pl

from odscen.base.errors import InputError, MissingDependencyError
from odscen.base.shown import printable
from odscen.formats.tracks.recorded_traffic import RecordedTraffic, complete_tracks

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

OSI_VEHICLE: Final = 2
OSI_OBJECTS: Final = {0: "unknown", 1: "other", 3: "pedestrian", 4: "animal"}
"""``MovingObject.Type`` but for vehicles."""
OSI_VEHICLES: Final = {
    0: "unknown",
    1: "other",
    2: "car",
    3: "car",
    4: "car",
    5: "car",
    6: "van",
    7: "truck",
    8: "trailer",
    9: "trailer",
    10: "motorcycle",
    11: "bicycle",
    12: "bus",
    13: "tram",
    14: "train",
    15: "wheelchair",
    16: "truck",
    17: "scooter",
}
"""``MovingObject.VehicleClassification.Type``."""
_GROUND_TRUTH_OF_VIEW, _TIMESTAMP, _MOVING_OBJECT = 7, 2, 5
_ID, _BASE, _TYPE, _CLASSIFICATION = 1, 2, 3, 6
_DIMENSION, _POSITION, _ORIENTATION, _VELOCITY, _ACCELERATION = 1, 2, 3, 4, 5
_VARINT, _FIXED64, _BYTES, _FIXED32 = 0, 1, 2, 5
_MOST_MESSAGE = 1 << 30
_LONGEST_SHIFT = 63
"""Of the last of the ten bytes that a number has at most."""


class _Row(NamedTuple):
    id: str
    time: float
    kind: str
    x: float
    y: float
    hdg: float
    vx: float
    vy: float
    ax: float
    ay: float
    length: float
    width: float


def read_osi_trace(file: Path, begin: float, end: float) -> RecordedTraffic:
    """Moving objects of a trace, from one second of it to another.

    Raises
    ------
    InputError
        If it is damaged: names the message and its byte.
    MissingDependencyError
        If it is MCAP, and the package to read that is not installed.
    """
    packed = file.suffix.lower() == ".mcap"
    rows: list[_Row] = []
    for number, place, content, is_view in _mcap_messages(file) if packed else _read_messages(file):
        try:
            truth = _first_message(content, _GROUND_TRUTH_OF_VIEW) if is_view else content
            rows += _objects_of(truth, begin, end)
        except (IndexError, struct.error, ValueError, TypeError) as error:
            raise InputError(
                f"it is no message of OSI: {error}", element=f"message {number} at byte {place}"
            ) from error
    return complete_tracks(pl.DataFrame(rows, schema=_SCHEMA, orient="row"), "osi")


_SCHEMA: Final = {
    name: pl.String if name in ("id", "kind") else pl.Float64 for name in _Row._fields
}


def _read_messages(file: Path) -> Iterator[tuple[int, int, bytes, bool]]:
    """Number, first byte, content, and whether it is a view of a sensor, of each message."""
    # The published naming of traces has sv, gt and more between underscores.
    is_view = "_sv_" in file.name or file.name.startswith("sv_")
    try:
        with file.open("rb") as stream:
            number = 0
            while head := stream.read(4):
                place, number = stream.tell(), number + 1
                size = int.from_bytes(head, "little")
                if len(head) < 4 or size > _MOST_MESSAGE:
                    raise InputError(
                        f"{size} is not its length", element=f"message {number} at byte {place - 4}"
                    )
                content = stream.read(size)
                if len(content) < size:
                    raise InputError(
                        f"it has {len(content)} of its {size} bytes",
                        element=f"message {number} at byte {place}",
                    )
                yield number, place, content, is_view
    except OSError as error:
        raise InputError(f"it cannot be read: {error.strerror}") from error


def _mcap_messages(file: Path) -> Iterator[tuple[int, int, bytes, bool]]:
    try:
        from mcap.reader import make_reader
    except ImportError as error:
        raise MissingDependencyError(
            "MCAP is read by the package mcap: pip install odscen[osi]"
        ) from error
    try:
        with file.open("rb") as stream:
            wanted = {"osi3.GroundTruth": False, "osi3.SensorView": True}
            for number, (schema, _, message) in enumerate(make_reader(stream).iter_messages(), 1):
                if schema is not None and schema.name in wanted:
                    yield number, message.log_time, message.data, wanted[schema.name]
    except Exception as error:  # of that package and its packings, whatever damage leads to
        raise InputError(f"it is no MCAP: {printable(str(error))}") from error


def osi_fields(content: bytes) -> Iterator[tuple[int, Any]]:
    """Number and value of each field of a message: an integer, a double, or bytes.

    Raises
    ------
    ValueError
        If it is no message.
    """
    at, size = 0, len(content)
    while at < size:
        tag, at = _varint(content, at)
        wire = tag & 7
        if wire == _FIXED64:
            yield tag >> 3, struct.unpack_from("<d", content, at)[0]
            at += 8
        elif wire == _BYTES:
            length, at = _varint(content, at)
            if at + length > size:
                raise ValueError(f"field {tag >> 3} has {size - at} of its {length} bytes")
            yield tag >> 3, content[at : at + length]
            at += length
        elif wire == _VARINT:
            value, at = _varint(content, at)
            yield tag >> 3, value
        elif wire == _FIXED32:
            at += 4
        else:
            raise ValueError(f"wire type {wire} of field {tag >> 3}")


def _varint(content: bytes, at: int) -> tuple[int, int]:
    value = content[at]
    at += 1
    if value < 128:
        return value, at
    value &= 127
    shift = 7
    while True:
        byte = content[at]
        at += 1
        if shift > _LONGEST_SHIFT:
            raise ValueError("a number has more than ten bytes")
        value |= (byte & 127) << shift
        if byte < 128:
            return value, at
        shift += 7


def _first_message(content: bytes, number: int) -> bytes:
    found = next((value for field, value in osi_fields(content) if field == number), b"")
    return bytes(found)


def _read_numbers(content: bytes) -> dict[int, Any]:
    return dict(osi_fields(content))


def _objects_of(truth: bytes, begin: float, end: float) -> list[_Row]:
    time, rows = 0.0, []
    objects = []
    for field, value in osi_fields(truth):
        if field == _TIMESTAMP:
            stamp = _read_numbers(value)
            time = stamp.get(1, 0) + stamp.get(2, 0) / 1e9
        elif field == _MOVING_OBJECT:
            objects.append(value)
    if not begin <= time <= end:
        return []
    for content in objects:
        parts = dict(osi_fields(content))
        base = {k: _read_numbers(value) for k, value in osi_fields(parts.get(_BASE, b"")) if k <= 5}
        place, size = base.get(_POSITION, {}), base.get(_DIMENSION, {})
        velocity, change = base.get(_VELOCITY, {}), base.get(_ACCELERATION, {})
        kind = OSI_OBJECTS.get(parts.get(_TYPE, 0), "other")
        if parts.get(_TYPE) == OSI_VEHICLE:
            vehicle = _read_numbers(parts.get(_CLASSIFICATION, b"")).get(1, 0)
            kind = OSI_VEHICLES.get(vehicle, "other")
        rows.append(
            _Row(
                str(_read_numbers(parts.get(_ID, b"")).get(1, 0)),
                time,
                kind,
                place.get(1, 0.0),
                place.get(2, 0.0),
                base.get(_ORIENTATION, {}).get(3, 0.0),
                velocity.get(1, 0.0),
                velocity.get(2, 0.0),
                change.get(1, 0.0),
                change.get(2, 0.0),
                size.get(1, 0.0),
                size.get(2, 0.0),
            )
        )
    return rows
