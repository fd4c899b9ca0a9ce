"""Reads a TFRecord of scenarios with Waymo's own messages; run in its environment.

``python waymo_reader.py FILE.tfrecord OUT.npz``: positions as read, and counts as JSON on stdout.
"""

import json
import struct
import sys
from pathlib import Path

from waymo_open_dataset.protos import scenario_pb2


def records(data):
    at = 0
    while at < len(data):
        (size,) = struct.unpack_from("<Q", data, at)
        yield data[at + 12 : at + 12 + size]
        at += 16 + size


def main(file, out):
    rows, counts = [], {"scenarios": 0, "tracks": 0, "states": 0, "lanes": [], "light_states": 0}
    kinds = set()
    for record in records(Path(file).read_bytes()):
        scenario = scenario_pb2.Scenario()
        assert scenario.ParseFromString(record) == len(record)
        assert scenario.IsInitialized()
        # What a message does not know is kept aside; nothing may be there.
        assert scenario.SerializeToString(deterministic=True) == record or not unknown(scenario)
        assert len(scenario.timestamps_seconds) == 91
        assert scenario.current_time_index == 10
        assert 0 <= scenario.sdc_track_index < len(scenario.tracks)
        assert len(scenario.dynamic_map_states) == 91
        features = [one.WhichOneof("feature_data") for one in scenario.map_features]
        assert all(features)
        kinds |= set(features)
        ids = {one.id for one in scenario.map_features}
        assert len(ids) == len(scenario.map_features)
        lanes = {one.id for one in scenario.map_features if one.HasField("lane")}
        for one in scenario.map_features:
            assert set(one.lane.entry_lanes) | set(one.lane.exit_lanes) <= lanes
        for state in scenario.dynamic_map_states:
            assert {one.lane for one in state.lane_states} <= lanes
            counts["light_states"] += len(state.lane_states)
        counts["scenarios"] += 1
        counts["tracks"] += len(scenario.tracks)
        counts["lanes"].append(len(lanes))
        for track in scenario.tracks:
            assert len(track.states) == 91
            for step, state in enumerate(track.states):
                if state.valid:
                    place = (state.center_x, state.center_y, state.heading)
                    rows.append((scenario.scenario_id, track.id, step, *place))
    counts["states"] = len(rows)
    counts["features"] = sorted(kinds)
    Path(out).write_text(json.dumps(rows))
    print(json.dumps(counts))


def unknown(message):
    return len(message.UnknownFields())


main(*sys.argv[1:])
