"""Reads an OSI trace with betterosi and omega-prime; run in their environment.

``python osi_reader.py FILE.osi OUT.json``: positions as read, and counts as JSON on stdout.
"""

import json
import sys
from pathlib import Path

import betterosi
import omega_prime


def main(file, out):
    rows, numbers, lights, frames = [], set(), set(), 0
    for truth in betterosi.read(file, return_ground_truth=True):
        frames += 1
        time = truth.timestamp.seconds + truth.timestamp.nanos / 1e9
        here = {one.id.value for one in truth.moving_object}
        assert len(here) == len(truth.moving_object)
        assert truth.map_reference
        assert truth.host_vehicle_id is None or truth.host_vehicle_id.value in here
        numbers |= here
        lights.add(tuple(one.id.value for one in truth.traffic_light))
        for one in truth.moving_object:
            base = one.base
            assert base.dimension.height > 0
            rows.append(
                (one.id.value, time, base.position.x, base.position.y, base.orientation.yaw)
            )
    assert len(lights) == 1  # the same bulbs at each instant
    recording = omega_prime.Recording.from_file(file, validate=True)
    assert recording.df.height == len(rows)
    assert set(recording.df["idx"].unique()) == numbers
    Path(out).write_text(json.dumps(rows))
    print(json.dumps({"frames": frames, "tracks": len(numbers), "bulbs": len(lights.pop())}))


main(*sys.argv[1:])
