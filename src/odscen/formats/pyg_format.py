"""Arrays for graph learning in an .npz without pickles, which PyTorch Geometric's data is made of.

Names, units and types are in ``docs/learning-formats.md``;
:func:`odscen.learning.hetero_data.hetero_data` makes a ``HeteroData`` of them.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.base.checksums import digest
from odscen.formats.arrays_format import write_scenario_arrays
from odscen.formats.base import WINDOW_OPTIONS, Format
from odscen.maps.folder_names import plain_name

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np

    from odscen.base.arrays import FloatArray
    from odscen.formats.base import ExportFiles, ExportSource, Kept
    from odscen.formats.recordings.run_recording import MapElements, RunRecording
    from odscen.lanegraph.graphs import MapGraph
    from odscen.opendrive.road_model import OpenDrive
    from odscen.sumo.realize.sumo_map import SumoMap

    Arrays = dict[str, np.ndarray[Any, np.dtype[Any]]]

ABOUT_FORMAT = "odscen-arrays"
ABOUT_VERSION = 1
LIGHT_VERSION = 2
"""Of a file that names its map in place of having it."""
SHARED_FORMAT = "odscen-map-arrays"
MAPS_FOLDER = "maps"
STATE_STEPS = 16384
"""States of such a file are whole multiples of one over this: 0.06 mm, which deflates well."""


def write_run_arrays(source: ExportSource) -> ExportFiles:
    """One .npz file: the graphs of the map, its elements, tracks and signal states.

    Raises
    ------
    InputError
        If there are no road users, or too much, in the run.
    """
    from odscen.base.given_arrays import npz_bytes
    from odscen.formats.recordings.record import recording_of

    recording = recording_of(source)
    of_map = source.of_map.made(
        "pyg", lambda: _map_arrays(source.sumo_map.graph, recording.elements)
    )
    arrays = {
        **_describe_recording(recording, ABOUT_VERSION),
        **of_map,
        **_track_arrays(recording),
        "agent_node": _first_nodes(recording, source),
    }
    return {f"{recording.name}.npz": npz_bytes(arrays)}


class SharedMap(NamedTuple):
    """Arrays of a map that several runs share; ``file`` is relative to the folder of the runs."""

    file: str
    content: bytes
    sha256: str


def shared_map(name: str, of_map: Kept, sumo_map: SumoMap, roads: OpenDrive) -> SharedMap:
    """File with the arrays of a map, made once; the same map gives the same bytes.

    Parameters
    ----------
    name
        Of the map; with the beginning of its SHA-256 it names the file.
    """

    def make() -> SharedMap:
        import numpy as np

        from odscen.base.given_arrays import npz_bytes

        sha256 = sumo_map.graph.map_sha256
        about = {"format": SHARED_FORMAT, "version": 1, "map": name, "map_sha256": sha256}
        arrays = _map_arrays(sumo_map.graph, elements_of(of_map, sumo_map, roads))
        arrays["map_about"] = np.array(json.dumps(about, ensure_ascii=False))
        content = npz_bytes(arrays, deflated=True)
        plain = plain_name(name) or "map"
        return SharedMap(f"{MAPS_FOLDER}/{plain}-{sha256[:12]}.npz", content, digest(content))

    from odscen.formats.recordings.record import elements_of

    return of_map.made(("shared map", name), make)


def write_light_run_arrays(source: ExportSource) -> ExportFiles:
    """One .npz file as of :func:`write_run_arrays` that names its map in place of having it.

    It is deflated, and states are whole multiples of ``1 / STATE_STEPS``. Errors are those of
    :func:`write_run_arrays`.
    """
    import numpy as np

    from odscen.base.given_arrays import npz_bytes
    from odscen.formats.recordings.record import recording_of

    recording = recording_of(source)
    assert source.roads is not None  # there is no recording without
    shared = shared_map(recording.map_name, source.of_map, source.sumo_map, source.roads)
    named = {"map_file": shared.file, "map_file_sha256": shared.sha256}
    arrays = {
        **_describe_recording(recording, LIGHT_VERSION, **named),
        **_track_arrays(recording),
        "agent_node": _first_nodes(recording, source),
    }
    arrays["agent_state"] = np.round(arrays["agent_state"] * STATE_STEPS) / STATE_STEPS
    return {f"{recording.name}.npz": npz_bytes(arrays, deflated=True)}


def _describe_recording(recording: RunRecording, version: int, **more: str) -> Arrays:
    import numpy as np

    about = {
        "format": ABOUT_FORMAT,
        "version": version,
        "run": recording.name,
        "scenario": recording.scenario,
        "map": recording.map_name,
        "map_sha256": recording.map_sha256,
        "seed": recording.seed,
        "recorded_step": recording.recorded_step,
        "interpolated": recording.interpolated,
        **more,
    }
    return {"about": np.array(json.dumps(about, ensure_ascii=False)), "time": recording.times}


def _map_arrays(graph: MapGraph, elements: MapElements) -> Arrays:
    return {**_graph_arrays(graph), **_element_arrays(elements)}


def _graph_arrays(graph: MapGraph) -> Arrays:
    import numpy as np

    lanes, walks = graph.lanes, graph.walks
    nodes = np.stack(
        [getattr(lanes, name) for name in ("x", "y", "z", "hdg", "curvature", "width")], axis=1
    )
    return {
        "node": nodes,
        "node_speed_limit": lanes.speed_limit,
        "node_lane": lanes.lane.astype(np.int64),
        "node_edge": np.stack([lanes.source, lanes.target]).astype(np.int64),
        "node_edge_relation": lanes.relation,
        "node_edge_length": lanes.length,
        "walk": np.stack(
            [getattr(walks, name) for name in ("x", "y", "z", "hdg", "width")], axis=1
        ),
        "walk_edge": np.stack([walks.source, walks.target]).astype(np.int64),
        "walk_edge_kind": walks.kind,
        "walk_edge_length": walks.length,
    }


def _element_arrays(elements: MapElements) -> Arrays:
    import numpy as np

    lanes = elements.lanes
    pairs = [(row, after) for row, lane in enumerate(lanes) for after in lane.exits]
    return {
        "lane_key": np.array([lane.key for lane in lanes], dtype=np.str_),
        "lane_type": np.array([lane.kind for lane in lanes], dtype=np.str_),
        "lane_speed_limit": np.array([lane.speed_limit for lane in lanes]),
        "lane_in_junction": np.array([bool(lane.junction) for lane in lanes], dtype=np.bool_),
        "lane_left": np.array([lane.left_lane for lane in lanes], dtype=np.int64),
        "lane_right": np.array([lane.right_lane for lane in lanes], dtype=np.int64),
        "lane_opposite": np.array([lane.opposite for lane in lanes], dtype=np.int64),
        "lane_edge": np.array(pairs, dtype=np.int64).reshape(-1, 2).T,
        **_ragged_arrays("lane_point", [np.hstack([x.centre, x.left, x.right]) for x in lanes], 9),
        "line_type": np.array([line.kind for line in elements.lines], dtype=np.str_),
        "line_color": np.array([line.color for line in elements.lines], dtype=np.str_),
        **_ragged_arrays("line_point", [line.points for line in elements.lines], 3),
        **_ragged_arrays("road_edge_point", elements.edges, 3),
        **_ragged_arrays(
            "crosswalk_point", [crosswalk.corners for crosswalk in elements.crosswalks], 3
        ),
    }


def _ragged_arrays(name: str, parts: Sequence[FloatArray], columns: int) -> Arrays:
    """All points one after the other, and where those of each element begin."""
    import numpy as np

    from odscen.base.arrays import offsets

    points = np.concatenate(parts) if parts else np.empty((0, columns))
    return {name: points, f"{name}_start": offsets(len(part) for part in parts)}


def _track_arrays(recording: RunRecording) -> Arrays:
    import numpy as np

    tracks, signals = recording.tracks, recording.signals
    state = [tracks.x, tracks.y, tracks.z, tracks.hdg, tracks.speed]
    return {
        "agent_id": np.array(tracks.ids, dtype=np.str_),
        "agent_category": np.array(tracks.categories, dtype=np.str_),
        "agent_size": np.stack([tracks.length, tracks.width, tracks.height], axis=1),
        "agent_is_ego": np.arange(len(tracks.ids)) == tracks.ego,
        "agent_state": np.stack(state, axis=-1),
        "agent_valid": tracks.valid,
        "light_lane": signals.lane,
        "light_approach": signals.approach,
        "light_stop": signals.stop,
        "light_turn": np.array(signals.turn, dtype=np.str_),
        "light_color": signals.color,
    }


def _first_nodes(
    recording: RunRecording, source: ExportSource
) -> np.ndarray[Any, np.dtype[np.int64]]:
    """Node of the lane graph that each vehicle is nearest to at first; -1 for pedestrians."""
    import numpy as np
    from scipy.spatial import cKDTree

    tracks = recording.tracks
    first = np.argmax(tracks.valid, axis=1)
    rows = np.arange(len(first))
    places = np.stack([tracks.x[rows, first], tracks.y[rows, first]], axis=1)
    lanes = source.sumo_map.graph.lanes
    tree = source.of_map.made("node tree", lambda: cKDTree(np.stack([lanes.x, lanes.y], axis=1)))
    nearest = tree.query(places)[1].astype(np.int64)
    walks = np.array([category == "pedestrian" for category in tracks.categories], dtype=np.bool_)
    return np.where(walks, np.int64(-1), nearest)


def write_pyg_arrays(source: ExportSource) -> ExportFiles:
    """Arrays of a run; of a scenario, those of the format ``arrays``."""
    return write_scenario_arrays(source) if source.recorded is None else write_run_arrays(source)


FORMAT = Format(
    id="pyg",
    title="PyTorch Geometric (.npz)",
    label="arrays of a run, or of a scenario, for PyTorch Geometric (.npz)",
    description="Arrays that odscen makes a HeteroData of PyTorch Geometric of.",
    of=("scenario", "run"),
    write=write_pyg_arrays,
    options=WINDOW_OPTIONS,
    checked=False,
    needs_roads=True,
)
