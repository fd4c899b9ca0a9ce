"""Reads an OSI trace with ASAM's own messages and osi-utilities; run in their environment.

``python osi_utilities_reader.py FILE OUT.json``, of ``.osi`` or ``.mcap``: positions as read, and
counts as JSON on stdout. Each message is held against the definitions of OSI: no field that they do
not know, each value of an enumeration one of theirs, the same bytes when it is written again.
"""

import json
import math
import sys
from pathlib import Path

from google.protobuf.descriptor import FieldDescriptor
from google.protobuf.unknown_fields import UnknownFieldSet
from osi3.osi_groundtruth_pb2 import GroundTruth
from osi_utilities import ChannelSpecification, MessageType, open_channel


def check_fields(message):
    """No unknown fields, and no unknown values, in a message and those within it."""
    assert not len(UnknownFieldSet(message)), message.DESCRIPTOR.name
    for field, value in message.ListFields():
        values = value if field.is_repeated else [value]
        if field.type == FieldDescriptor.TYPE_MESSAGE:
            for each in values:
                check_fields(each)
        elif field.type == FieldDescriptor.TYPE_ENUM:
            assert all(each in field.enum_type.values_by_number for each in values), field.name


def main(file, out):
    rows, numbers, lights, frames, last = [], set(), set(), 0, -1
    kind = MessageType.GROUND_TRUTH
    topic = "ground_truth" if file.endswith(".mcap") else None
    spec = ChannelSpecification(path=Path(file), message_type=kind, topic=topic)
    with open_channel(spec) as channel:
        for read in channel:
            frames += 1
            content = read.SerializeToString()
            # What is read by the schema that MCAP carries is held against OSI's own, too.
            truth = GroundTruth.FromString(content)
            check_fields(truth)
            assert truth.SerializeToString() == content
            assert truth.IsInitialized()
            now = truth.timestamp.seconds * 10**9 + truth.timestamp.nanos
            assert now > last
            last = now
            here = [moving.id.value for moving in truth.moving_object]
            bulbs = [light.id.value for light in truth.traffic_light]
            assert len({*here, *bulbs}) == len(here) + len(bulbs)  # unique among all objects
            assert truth.map_reference
            assert not truth.HasField("host_vehicle_id") or truth.host_vehicle_id.value in here
            numbers.update(here)
            lights.add(tuple(bulbs))
            for moving in truth.moving_object:
                base = moving.base
                size = base.dimension
                assert min(size.length, size.width, size.height) > 0
                assert moving.type
                assert abs(base.orientation.yaw) <= math.pi
                place = base.position
                rows.append((moving.id.value, now / 1e9, place.x, place.y, base.orientation.yaw))
    assert len(lights) == 1  # the same bulbs at each instant
    Path(out).write_text(json.dumps(rows))
    print(json.dumps({"frames": frames, "tracks": len(numbers), "bulbs": len(lights.pop())}))


main(*sys.argv[1:])
