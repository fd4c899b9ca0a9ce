"""ScenarioNet: a ``ScenarioDescription`` of MetaDrive in a pickle, and the two indexes of a folder.

https://github.com/metadriverse/metadrive, ``metadrive/scenario/scenario_description.py``. Arrays
are pickled by their shape, type and bytes, so that any version of NumPy reads the file.
"""

from __future__ import annotations

import io
import math
import pickle
from typing import TYPE_CHECKING, Any

from odscen.formats.base import WINDOW_OPTIONS, Format

if TYPE_CHECKING:
    from odscen.base.arrays import FloatArray
    from odscen.formats.base import ExportFiles, ExportSource
    from odscen.formats.recordings.run_recording import (
        LaneElement,
        MapElements,
        RunRecording,
        Tracks,
    )

VERSION = "MetaDrive v0.4.3"
DATASET = "odscen"
_PROTOCOL = 4
_KMH = 3.6
_TYPES = {"pedestrian": "PEDESTRIAN", "bicycle": "CYCLIST"}
_STATES = ("LANE_STATE_UNKNOWN", "LANE_STATE_STOP", "LANE_STATE_CAUTION", "LANE_STATE_GO")
_LINES = {
    "broken": "BROKEN_SINGLE",
    "botts dots": "BROKEN_SINGLE",
    "solid": "SOLID_SINGLE",
    "solid solid": "SOLID_DOUBLE",
    "broken broken": "BROKEN_DOUBLE",
    "solid broken": "PASSING_DOUBLE",
    "broken solid": "PASSING_DOUBLE",
}
_ONLY_YELLOW = frozenset({"BROKEN_DOUBLE", "PASSING_DOUBLE"})


def write_scenario_descriptions(source: ExportSource) -> ExportFiles:
    """A folder that ScenarioNet and MetaDrive take as a data set of one scenario.

    Raises
    ------
    InputError
        If there are no road users, or too much, in the run.
    """
    from odscen.formats.recordings.record import recording_of

    recording = recording_of(source)
    features = source.of_map.made("scenarionet", lambda: _describe_features(recording.elements))
    description = _describe_scenario(recording, features)
    name = f"sd_{DATASET}_{description['version'].replace(' ', '_')}_{description['id']}.pkl"
    return {
        name: pickled(description),
        "dataset_summary.pkl": pickled({name: description["metadata"]}),
        "dataset_mapping.pkl": pickled({name: ""}),
    }


def pickled(value: object) -> bytes:
    """Bytes of a pickle that any version of NumPy reads; equal values give equal bytes."""
    import numpy as np

    class Portable(pickle.Pickler):
        def reducer_override(self, given: object) -> Any:
            if isinstance(given, np.ndarray):
                flat = np.ascontiguousarray(given)
                return np.ndarray, (flat.shape, flat.dtype.str, bytearray(flat.tobytes()))
            return NotImplemented

    buffer = io.BytesIO()
    Portable(buffer, protocol=_PROTOCOL).dump(value)
    return buffer.getvalue()


def _describe_scenario(recording: RunRecording, features: dict[str, Any]) -> dict[str, Any]:
    import numpy as np

    tracks, length = recording.tracks, len(recording.times)
    velocity = tracks.velocity
    leading = tracks.ids[max(tracks.leading(0), 0)]
    objects = {
        name: _describe_track(tracks, row, velocity[row]) for row, name in enumerate(tracks.ids)
    }
    return {
        "id": recording.name,
        "version": VERSION,
        "length": length,
        "metadata": {
            "ts": (recording.times - recording.times[0]).astype(np.float32),
            "metadrive_processed": False,
            "coordinate": "metadrive",
            "dataset": DATASET,
            "source_file": recording.name,
            "scenario_id": recording.name,
            "id": recording.name,
            "sdc_id": leading,
            "scenario": recording.scenario,
            "map": recording.map_name,
            "map_sha256": recording.map_sha256,
            "seed": recording.seed,
            "sample_rate": 0.1,
            "begin": float(recording.times[0]),
            "recorded_step": float(recording.recorded_step),
            "interpolated": bool(recording.interpolated),
            "tracks_length": length,
            "number_summary": _count_objects(recording),
            "object_summary": {
                name: _summarize_track(tracks, row) for row, name in enumerate(tracks.ids)
            },
        },
        "tracks": objects,
        "dynamic_map_states": _describe_lights(recording),
        "map_features": features,
    }


def _describe_track(tracks: Tracks, row: int, velocity: FloatArray) -> dict[str, Any]:
    import numpy as np

    valid = tracks.valid[row]
    kind = _TYPES.get(tracks.categories[row], "VEHICLE")
    height = float(tracks.height[row])
    z = np.where(valid, tracks.z[row] + 0.5 * height, 0.0)

    def sized(value: float) -> Any:
        return np.where(valid, value, 0.0).astype(np.float32)

    return {
        "type": kind,
        "state": {
            "position": np.stack([tracks.x[row], tracks.y[row], z], axis=-1),
            "heading": tracks.hdg[row],
            "velocity": velocity,
            "length": sized(float(tracks.length[row])),
            "width": sized(float(tracks.width[row])),
            "height": sized(height),
            "valid": valid,
        },
        "metadata": {
            "type": kind,
            "object_id": tracks.ids[row],
            "track_length": len(valid),
            "dataset": DATASET,
            "category": tracks.categories[row],
        },
    }


def _describe_lights(recording: RunRecording) -> dict[str, Any]:
    signals, length = recording.signals, len(recording.times)
    found = {}
    for row, (lane, stop) in enumerate(zip(signals.lane.tolist(), signals.stop, strict=True)):
        name = _lane_id(lane)
        found[name] = {
            "type": "TRAFFIC_LIGHT",
            "lane": name,
            "stop_point": stop,
            "state": {"object_state": [_STATES[color] for color in signals.color[row].tolist()]},
            "metadata": {
                "type": "TRAFFIC_LIGHT",
                "object_id": name,
                "track_length": length,
                "dataset": DATASET,
            },
        }
    return found


def _lane_id(row: int) -> str:
    return f"lane_{row}"


def _describe_features(elements: MapElements) -> dict[str, Any]:
    found = {
        _lane_id(row): _describe_lane(lane, elements) for row, lane in enumerate(elements.lanes)
    }
    for row, line in enumerate(elements.lines):
        found[f"line_{row}"] = {"type": line_name(line.kind, line.color), "polyline": line.points}
    for row, edge in enumerate(elements.edges):
        found[f"edge_{row}"] = {"type": "ROAD_EDGE_BOUNDARY", "polyline": edge}
    for row, walk in enumerate(elements.crosswalks):
        found[f"crosswalk_{row}"] = {"type": "CROSSWALK", "polygon": walk.corners[:, :2]}
    return found


def _describe_lane(lane: LaneElement, elements: MapElements) -> dict[str, Any]:
    import numpy as np

    gaps = np.linalg.norm(lane.left[:, :2] - lane.right[:, :2], axis=1)
    half = np.stack([0.5 * gaps, 0.5 * gaps], axis=-1)
    limited = math.isfinite(lane.speed_limit)
    return {
        "type": "LANE_FREEWAY" if lane.road_type == "motorway" else "LANE_SURFACE_STREET",
        "polyline": lane.centre,
        # In the plane, or MetaDrive cannot raise it to the ground.
        "polygon": np.concatenate([lane.left, lane.right[::-1]])[:, :2],
        "width": half,
        "interpolating": bool(lane.junction),
        "entry_lanes": [_lane_id(row) for row in lane.entries],
        "exit_lanes": [_lane_id(row) for row in lane.exits],
        "left_neighbor": _describe_neighbour(lane, lane.left_lane, elements),
        "right_neighbor": _describe_neighbour(lane, lane.right_lane, elements),
        "odr_lane": lane.key,
        # MetaDrive wants a number, or no entry at all.
        **({"speed_limit_kmh": lane.speed_limit * _KMH} if limited else {}),
    }


def _describe_neighbour(lane: LaneElement, row: int, elements: MapElements) -> list[dict[str, Any]]:
    if row < 0:
        return []
    return [
        {
            "feature_id": _lane_id(row),
            "self_start_index": 0,
            "self_end_index": len(lane.centre) - 1,
            "neighbor_start_index": 0,
            "neighbor_end_index": len(elements.lanes[row].centre) - 1,
        }
    ]


def line_name(kind: str, color: str) -> str:
    """MetaDrive's name of a marking; what it has no name for in white is named as if yellow."""
    name = _LINES.get(kind)
    if name is None:
        return "UNKNOWN_LINE"
    yellow = color in {"yellow", "orange"} or name in _ONLY_YELLOW
    return f"ROAD_LINE_{name}_{'YELLOW' if yellow else 'WHITE'}"


def _count_objects(recording: RunRecording) -> dict[str, Any]:
    tracks = recording.tracks
    kinds = [_TYPES.get(category, "VEHICLE") for category in tracks.categories]
    moving = [_distance_moved(tracks, row) > 1.0 for row in range(len(kinds))]
    return {
        "num_objects": len(kinds),
        "object_types": sorted(set(kinds)),
        "num_objects_each_type": {kind: kinds.count(kind) for kind in sorted(set(kinds))},
        "num_moving_objects": sum(moving),
        "num_moving_objects_each_type": {
            object_type: sum(
                here and kind == object_type for kind, here in zip(kinds, moving, strict=True)
            )
            for object_type in sorted(set(kinds))
        },
        "num_traffic_lights": len(recording.signals.lane),
        "num_map_features": sum(
            len(getattr(recording.elements, name))
            for name in ("lanes", "lines", "edges", "crosswalks")
        ),
    }


def _summarize_track(tracks: Tracks, row: int) -> dict[str, Any]:
    valid = tracks.valid[row]
    return {
        "type": _TYPES.get(tracks.categories[row], "VEHICLE"),
        "object_id": tracks.ids[row],
        "track_length": len(valid),
        "moving_distance": _distance_moved(tracks, row),
        "valid_length": int(valid.sum()),
        "continuous_valid_length": int(valid.sum()),
    }


def _distance_moved(tracks: Tracks, row: int) -> float:
    import numpy as np

    at = np.flatnonzero(tracks.valid[row])
    return float(np.hypot(np.diff(tracks.x[row, at]), np.diff(tracks.y[row, at])).sum())


FORMAT = Format(
    id="scenarionet",
    title="ScenarioNet",
    label="a run as a ScenarioDescription of ScenarioNet and MetaDrive",
    of=("run",),
    write=write_scenario_descriptions,
    options=WINDOW_OPTIONS,
    needs_roads=True,
)
