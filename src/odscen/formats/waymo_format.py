"""Waymo Open Motion Dataset: ``Scenario`` messages in a TFRecord file.

Fields are those of ``scenario.proto`` and ``map.proto`` of
https://github.com/waymo-research/waymo-open-dataset; written without TensorFlow.
"""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

from odscen.formats.base import WINDOW_OPTIONS, Format

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from odscen.base.arrays import FloatArray
    from odscen.formats.base import ExportFiles, ExportSource
    from odscen.formats.recordings.run_recording import (
        LaneElement,
        LineElement,
        MapElements,
        RunRecording,
        Tracks,
    )

STEPS = 91
"""Instants of a scenario: 1.1 s of history with the present, and 8 s of future."""
PRESENT = 10
"""Instant that is the present."""
_PREDICTED = 8
"""Road users that are to be predicted, at most."""
_MILES_PER_HOUR = 2.2369362920544
_TYPES = {"pedestrian": 2, "bicycle": 3}
_VEHICLE = 1
_STATES = (0, 4, 5, 6)
"""``LANE_STATE_UNKNOWN``, ``STOP``, ``CAUTION`` and ``GO``, by the colour of the light."""


def write_waymo_scenarios(source: ExportSource) -> ExportFiles:
    """One TFRecord file of scenarios of 9.1 s one after the other, and what is in it.

    Raises
    ------
    InputError
        If there are no road users, or too much, in the run.
    """
    from odscen.formats.recordings.record import recording_of
    from odscen.formats.recordings.tfrecord import tfrecord

    recording = recording_of(source)
    number = {name: row + 1 for row, name in enumerate(recording.tracks.ids)}
    features = source.of_map.made("waymo", lambda: _map_features(recording.elements))
    records, listed = [], []
    for first in _window_starts(len(recording.times)):
        tracks = recording.tracks.part(first, first + STEPS)
        if not tracks.ids:
            continue
        name = f"{recording.name}-{first:06d}"
        records.append(_encode_scenario(recording, tracks, first, name, number, features))
        listed.append(
            {"scenario_id": name, "begin": float(recording.times[first]), "tracks": len(tracks.ids)}
        )
    data = {
        "format": "waymo",
        "run": recording.name,
        "map": recording.map_name,
        "step": 0.1,
        "recorded_step": recording.recorded_step,
        "interpolated": recording.interpolated,
        "lanes": len(recording.elements.lanes),
        "scenarios": listed,
        "ids": number,
    }
    return {
        f"{recording.name}.tfrecord": tfrecord(records),
        f"{recording.name}.export.json": json.dumps(data, indent=2, ensure_ascii=False) + "\n",
    }


def _window_starts(instants: int) -> Iterator[int]:
    """First instant of each scenario; the last begins earlier where it would be cut off."""
    last = max(instants - STEPS, 0)
    yield from range(0, last, STEPS)
    yield last


def _encode_scenario(
    recording: RunRecording,
    tracks: Tracks,
    first: int,
    name: str,
    number: Mapping[str, int],
    features: bytes,
) -> bytes:
    from odscen.formats.recordings.protobuf_wire import double, message, text, whole

    times = [round(k * 0.1, 6) for k in range(STEPS)]
    velocity = tracks.velocity
    leading = max(tracks.leading(min(PRESENT, tracks.valid.shape[1] - 1)), 0)
    return b"".join(
        [
            *(double(1, time) for time in times),
            *(
                message(2, _encode_track(tracks, row, velocity[row], number[user]))
                for row, user in enumerate(tracks.ids)
            ),
            text(5, name),
            whole(6, leading),
            *(message(7, light_state) for light_state in _light_states(recording, first)),
            features,
            whole(10, PRESENT),
            *(
                message(11, whole(1, row) + whole(2, 1))
                for row in _choose_to_predict(tracks, leading)
            ),
        ]
    )


def _encode_track(tracks: Tracks, row: int, velocity: FloatArray, number: int) -> bytes:
    import numpy as np

    from odscen.formats.recordings.protobuf_wire import packed_messages, whole

    missing = STEPS - tracks.valid.shape[1]

    def padded(values: FloatArray) -> FloatArray:
        return np.pad(values, (0, missing))

    valid = np.pad(tracks.valid[row], (0, missing))
    height = float(tracks.height[row])
    columns = {
        2: ("d", padded(tracks.x[row])),
        3: ("d", padded(tracks.y[row])),
        4: ("d", np.where(valid, padded(tracks.z[row]) + 0.5 * height, 0.0)),
        5: ("f", np.where(valid, tracks.length[row], 0.0)),
        6: ("f", np.where(valid, tracks.width[row], 0.0)),
        7: ("f", np.where(valid, height, 0.0)),
        8: ("f", padded(tracks.hdg[row])),
        9: ("f", padded(velocity[:, 0])),
        10: ("f", padded(velocity[:, 1])),
    }
    kind = _TYPES.get(tracks.categories[row], _VEHICLE)
    return whole(1, number) + whole(2, kind) + packed_messages(3, columns, flags={11: valid})


def _choose_to_predict(tracks: Tracks, leading: int) -> list[int]:
    """Those who move most of the road users that are there now, without the leading one."""
    import numpy as np

    present = min(PRESENT, tracks.valid.shape[1] - 1)
    moved = tracks.speed.sum(axis=1)
    there = [row for row in np.flatnonzero(tracks.valid[:, present]).tolist() if row != leading]
    return sorted(sorted(there, key=lambda row: (-moved[row], row))[:_PREDICTED])


def _light_states(recording: RunRecording, first: int) -> Iterator[bytes]:
    """``DynamicMapState`` of each instant."""
    from odscen.formats.recordings.protobuf_wire import message, whole

    signals = recording.signals
    shown = [
        [
            message(1, whole(1, lane) + whole(2, state) + message(3, _encode_point(stop)))
            for state in _STATES
        ]
        for lane, stop in zip((signals.lane + 1).tolist(), signals.stop, strict=True)
    ]
    for instant in range(first, first + STEPS):
        if instant >= len(recording.times):
            yield b""
            continue
        yield b"".join(
            by_color[color]
            for by_color, color in zip(shown, signals.color[:, instant].tolist(), strict=True)
        )


def _encode_point(xyz: FloatArray) -> bytes:
    from odscen.formats.recordings.protobuf_wire import double

    return b"".join(double(field, float(value)) for field, value in enumerate(xyz, start=1))


def _map_features(elements: MapElements) -> bytes:
    """Lanes are features 1, 2, ... in their order; then lines, edges and crosswalks."""
    from odscen.formats.recordings.protobuf_wire import message, whole

    found = [(3, _encode_lane(lane, elements)) for lane in elements.lanes]
    found += [
        (4, whole(1, line_type(line)) + _encode_points(2, line.points)) for line in elements.lines
    ]
    found += [(5, whole(1, 1) + _encode_points(2, edge)) for edge in elements.edges]
    found += [(8, _encode_points(1, crosswalk.corners)) for crosswalk in elements.crosswalks]
    return b"".join(
        message(8, whole(1, number) + message(field, content))
        for number, (field, content) in enumerate(found, start=1)
    )


def _encode_lane(lane: LaneElement, elements: MapElements) -> bytes:
    from odscen.formats.recordings.protobuf_wire import double, whole

    known = math.isfinite(lane.speed_limit)
    limit = double(1, lane.speed_limit * _MILES_PER_HOUR) if known else b""
    return b"".join(
        [
            limit,
            whole(2, 1 if lane.road_type == "motorway" else 2),
            whole(3, bool(lane.junction)),
            _encode_points(8, lane.centre),
            *(whole(9, row + 1) for row in lane.entries),
            *(whole(10, row + 1) for row in lane.exits),
            _encode_neighbour(11, lane, lane.left_lane, elements),
            _encode_neighbour(12, lane, lane.right_lane, elements),
        ]
    )


def _encode_neighbour(field: int, lane: LaneElement, row: int, elements: MapElements) -> bytes:
    from odscen.formats.recordings.protobuf_wire import message, whole

    if row < 0:
        return b""
    ends = len(lane.centre) - 1, len(elements.lanes[row].centre) - 1
    return message(
        field,
        whole(1, row + 1) + whole(2, 0) + whole(3, ends[0]) + whole(4, 0) + whole(5, ends[1]),
    )


def _encode_points(field: int, xyz: FloatArray) -> bytes:
    from odscen.formats.recordings.protobuf_wire import packed_messages

    return packed_messages(field, {k + 1: ("d", xyz[:, k]) for k in range(3)})


def line_type(line: LineElement) -> int:
    """Waymo's number of a marking, as ``RoadLineType`` has it; 0 for what it has no number for."""
    yellow = line.color in {"yellow", "orange"}
    types = {
        "broken": (1, 4),
        "botts dots": (1, 4),
        "solid": (2, 6),
        "solid solid": (3, 7),
        "broken broken": (1, 5),
        "solid broken": (0, 8),
        "broken solid": (0, 8),
    }
    return types.get(line.kind, (0, 0))[yellow]


FORMAT = Format(
    id="waymo",
    title="Waymo Open Motion",
    label="scenarios of 9.1 s of a run as Waymo Open Motion TFRecord",
    of=("run",),
    write=write_waymo_scenarios,
    options=WINDOW_OPTIONS,
    needs_roads=True,
)
