"""An OSI trace in MCAP: messages in a container with their schema, by the package ``mcap``.

Names and metadata are those of ASAM OSI (``open-simulation-interface``,
``doc/architecture/trace_file_formats.adoc``). The schema is a ``FileDescriptorSet`` with the
messages and fields that odscen writes, so that a reader without OSI's own definitions can decode
them; enumerations are ``int32`` there, which is the same on the wire.
"""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Final

from odscen.base.errors import MissingDependencyError
from odscen.formats.recordings.protobuf_wire import message, text, whole

if TYPE_CHECKING:
    from collections.abc import Iterable

SCHEMA: Final = "osi3.GroundTruth"
TOPIC: Final = "ground_truth"
PROTOBUF: Final = "3.20.0"
"""Release of protobuf whose files of definitions OSI 3.7 asks for."""
_TRACE: Final = "net.asam.osi.trace"

_DOUBLE, _INT64, _UINT64, _INT32, _STRING, _MESSAGE, _UINT32 = 1, 3, 4, 5, 9, 11, 13
"""``FieldDescriptorProto.Type``."""
_OPTIONAL, _REPEATED = 1, 3
"""``FieldDescriptorProto.Label``."""
_PLAIN: Final = {
    "double": _DOUBLE, "int64": _INT64, "uint64": _UINT64, "int32": _INT32, "string": _STRING,
    "uint32": _UINT32,
}  # fmt: skip
_FIELDS: Final = {
    "InterfaceVersion": "1 version_major uint32, 2 version_minor uint32, 3 version_patch uint32",
    "Timestamp": "1 seconds int64, 2 nanos uint32",
    "Identifier": "1 value uint64",
    "Dimension3d": "1 length double, 2 width double, 3 height double",
    "Vector3d": "1 x double, 2 y double, 3 z double",
    "Orientation3d": "1 roll double, 2 pitch double, 3 yaw double",
    "BaseMoving": "1 dimension Dimension3d, 2 position Vector3d, 3 orientation Orientation3d, "
    "4 velocity Vector3d, 5 acceleration Vector3d",
    "BaseStationary": "1 dimension Dimension3d, 2 position Vector3d, 3 orientation Orientation3d",
    "MovingObject": "1 id Identifier, 2 base BaseMoving, 3 type int32, "
    "6 vehicle_classification MovingObject.VehicleClassification",
    "MovingObject.VehicleClassification": "1 type int32",
    "TrafficLight": "1 id Identifier, 2 base BaseStationary, "
    "3 classification TrafficLight.Classification",
    "TrafficLight.Classification": "1 color int32, 2 icon int32, 3 mode int32",
    "GroundTruth": "1 version InterfaceVersion, 2 timestamp Timestamp, "
    "3 host_vehicle_id Identifier, 5 moving_object MovingObject *, "
    "7 traffic_light TrafficLight *, 14 proj_string string, 15 map_reference string",
}
"""Number, name and type of the fields of each message; those that repeat have a star."""


def write_mcap(frames: Iterable[tuple[float, bytes]], *, version: str, description: str) -> bytes:
    """A trace of ``GroundTruth`` messages.

    Parameters
    ----------
    frames
        Time (s) and content of each message, in order of time.
    version
        Of OSI.

    Raises
    ------
    MissingDependencyError
        If the package ``mcap`` is not installed.
    """
    try:
        from mcap.writer import CompressionType, Writer
    except ImportError as error:
        raise MissingDependencyError(
            "MCAP is written by the package mcap: pip install odscen[osi]"
        ) from error
    stream = io.BytesIO()
    writer = Writer(stream, compression=CompressionType.ZSTD)
    writer.start(profile="", library="odscen")
    versions = {"min_osi_version": version, "max_osi_version": version}
    versions |= {"min_protobuf_version": PROTOBUF, "max_protobuf_version": PROTOBUF}
    writer.add_metadata(_TRACE, {"version": version, **versions, "description": description})
    schema = writer.register_schema(SCHEMA, "protobuf", schema_of_ground_truth())
    channel = writer.register_channel(
        TOPIC,
        "protobuf",
        schema,
        {
            f"{_TRACE}.channel.osi_version": version,
            f"{_TRACE}.channel.protobuf_version": PROTOBUF,
            f"{_TRACE}.channel.description": description,
        },
    )
    for number, (time, content) in enumerate(frames):
        nanos = round(time * 1e9)
        writer.add_message(channel, nanos, content, nanos, sequence=number)
    writer.finish()  # type: ignore[no-untyped-call]
    return stream.getvalue()


def schema_of_ground_truth() -> bytes:
    """``FileDescriptorSet`` of the messages that are written."""
    outer = [name for name in _FIELDS if "." not in name]
    messages = b"".join(message(4, _describe_message(name)) for name in outer)
    file = text(1, "osi_groundtruth.proto") + text(2, "osi3") + messages
    return message(1, file)


def _describe_message(name: str) -> bytes:
    """``DescriptorProto`` of a message, and of those inside it."""
    inner = [other for other in _FIELDS if other.startswith(f"{name}.")]
    fields = b"".join(message(2, _describe_field(words)) for words in _FIELDS[name].split(", "))
    nested = b"".join(message(3, _describe_message(other)) for other in inner)
    return text(1, name.rpartition(".")[2]) + fields + nested


def _describe_field(words: str) -> bytes:
    """``FieldDescriptorProto`` of a field."""
    number, name, kind, *star = words.split()
    label = _REPEATED if star else _OPTIONAL
    content = text(1, name) + whole(3, int(number)) + whole(4, label)
    if kind in _PLAIN:
        return content + whole(5, _PLAIN[kind])
    return content + whole(5, _MESSAGE) + text(6, f".osi3.{kind}")
