"""Arrays of runs and scenarios as a ``HeteroData`` of PyTorch Geometric, and back.

``pip install 'odscen[torch]'`` has PyTorch and PyTorch Geometric; ``pip install torch --index-url
https://download.pytorch.org/whl/cpu`` before it takes the build without CUDA, a tenth of the size.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.base.errors import InputError
from odscen.base.given_arrays import MOST_UNPACKED, arrays_from_npz
from odscen.base.given_files import as_path, read_given
from odscen.lanegraph.graphs import Relation, WalkKind
from odscen.learning.scenario_hetero_data import scenario_arrays_of, scenario_hetero_data
from odscen.learning.shared_maps import LIGHT_VERSION, about_of, named_map, read_shared_map

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from odscen.base.arrays import FloatArray
    from odscen.base.given_arrays import Array
    from odscen.base.given_files import GivenPath

_KNOWN = (("odscen-arrays", 1), ("odscen-arrays", LIGHT_VERSION), ("odscen-scenario-arrays", 1))
"""Formats of arrays, of a run and of a scenario, and their versions."""


def read_arrays(path: GivenPath) -> dict[str, Array]:
    """Read the arrays of a run or of a scenario, as ``odscen export`` wrote them.

    Nothing in the file is run; each array has the size that its header says. The map of a run of a
    dataset is read from the file in ``maps`` beside it.

    Parameters
    ----------
    path
        An .npz file of ``--to pyg`` or ``--to arrays``, or of a dataset.

    Returns
    -------
    dict of str to numpy.ndarray
        All arrays by name, see docs/learning-formats.md.

    Raises
    ------
    InputError
        If the file cannot be read, is no such file or one of another version, or has a malformed
        array, or its map is not there or another one; names it.
    """
    file = as_path(path)
    arrays = own_arrays(read_given(file, most=MOST_UNPACKED), file=str(path))
    named = named_map(arrays, file=str(path))
    if named is None:
        return arrays
    return read_shared_map(file.parent, named, run=str(path)) | arrays


def own_arrays(content: bytes, *, file: str) -> dict[str, Array]:
    """Arrays of the content of a file, without a map that it names.

    Raises
    ------
    InputError
        If it is no such file, or of another version; names ``file``.
    """
    arrays = arrays_from_npz(content, file=file)
    known = _format_and_version(arrays)
    if known is None:
        raise InputError("these are no arrays of a run or a scenario", file=file)
    if known not in _KNOWN:
        offered = ", ".join(f"{name} {version}" for name, version in _KNOWN)
        raise InputError(f"it is {known[0]} {known[1]}; this odscen reads {offered}", file=file)
    return arrays


def _format_and_version(arrays: Mapping[str, Array]) -> tuple[str, int] | None:
    """Format and version that arrays say they are of."""
    about = about_of(arrays) or {}
    try:
        return str(about["format"]), int(about["version"])
    except (ValueError, KeyError, TypeError, OverflowError):
        return None


def hetero_data(arrays: Mapping[str, Array]) -> Any:
    """Make a ``torch_geometric.data.HeteroData``.

    Parameters
    ----------
    arrays
        Of a run or of a scenario, see ``docs/learning-formats.md``.

    Returns
    -------
    HeteroData
        Of a run: node types ``node`` and ``walk`` (the graphs of the map), ``lane``, ``agent``,
        ``light``; edge types ``(node, successor | left | right, node)``, ``(walk, sidewalk |
        roadside | crosswalk | joint, walk)`` both ways, ``(node, on, lane)``, ``(lane, successor,
        lane)``, ``(light, controls, lane)``, ``(agent, starts_at, node)``. Of a scenario:
        ``segment``, ``actor`` and ``flow`` in place of the last two, and their edges. Reals are
        float32 and positions relative to ``data.origin`` (x and y, float64), for single precision
        is half a metre at projected coordinates.

    Raises
    ------
    ModuleNotFoundError
        If torch or torch_geometric is not installed.
    """
    if _format_and_version(arrays) == ("odscen-scenario-arrays", 1):
        return scenario_hetero_data(arrays)
    return _run_data(arrays)


def arrays_of(data: Any) -> dict[str, Array]:
    """Arrays of a scenario from its ``HeteroData``, for ``odscen.scenario_from_arrays``.

    The same as those that it was made of, but for what was changed in the columns; see
    :func:`~odscen.learning.scenario_hetero_data.scenario_arrays_of`.

    Raises
    ------
    InputError
        If it is not of a scenario: what happened in a run is not made again from numbers.
    """
    if "actor" not in data.node_types:
        raise InputError("it has no actors: only the data of a scenario goes back to arrays")
    return scenario_arrays_of(data)


def _run_data(arrays: Mapping[str, Array]) -> Any:
    import torch
    from torch_geometric.data import HeteroData

    def real(values: Array) -> Any:
        return torch.from_numpy(np.ascontiguousarray(values, dtype=np.float32))

    data = HeteroData()
    origin = arrays["node"][:, :2].mean(axis=0) if len(arrays["node"]) else np.zeros(2)
    data.origin = torch.from_numpy(origin)
    data.time = torch.from_numpy(arrays["time"])
    for kind, pos, features in _node_features(arrays, origin):
        data[kind].pos = real(pos)
        data[kind].x = real(features)
    data["agent"].state = real(_move_points(arrays["agent_state"], origin))
    data["agent"].valid = torch.from_numpy(arrays["agent_valid"])
    data["light"].color = torch.from_numpy(arrays["light_color"].astype(np.int64))
    for ends, index, lengths in _edge_features(arrays):
        data[ends].edge_index = torch.from_numpy(np.ascontiguousarray(index, dtype=np.int64))
        if lengths is not None:
            data[ends].edge_attr = real(lengths)
    return data


def _move_points(points: FloatArray, origin: FloatArray) -> FloatArray:
    moved = points.copy()
    moved[..., :2] -= origin
    return moved


def _node_features(
    arrays: Mapping[str, Array], origin: FloatArray
) -> Iterator[tuple[str, FloatArray, FloatArray]]:
    """Kind, positions (x, y, z) and features of nodes."""
    node, walk = arrays["node"], arrays["walk"]
    limit = np.nan_to_num(arrays["node_speed_limit"], nan=-1.0, posinf=-1.0)
    turned = np.column_stack([np.cos(node[:, 3]), np.sin(node[:, 3]), node[:, 4:], limit])
    yield "node", _move_points(node[:, :3], origin), turned
    beside = np.column_stack([np.cos(walk[:, 3]), np.sin(walk[:, 3]), walk[:, 4]])
    yield "walk", _move_points(walk[:, :3], origin), beside
    start = arrays["lane_point_start"]
    middle = arrays["lane_point"][(start[:-1] + start[1:]) // 2, :3]
    lane_limit = np.nan_to_num(arrays["lane_speed_limit"], nan=-1.0, posinf=-1.0)
    yield (
        "lane",
        _move_points(middle, origin),
        np.column_stack([lane_limit, arrays["lane_in_junction"]]),
    )
    first = np.argmax(arrays["agent_valid"], axis=1)
    state = arrays["agent_state"][np.arange(len(first)), first]
    ego = arrays["agent_is_ego"][:, None]
    yield "agent", _move_points(state[:, :3], origin), np.hstack([arrays["agent_size"], ego])
    yield "light", _move_points(arrays["light_stop"], origin), arrays["light_color"][:, :1]


def _edge_features(
    arrays: Mapping[str, Array],
) -> Iterator[tuple[tuple[str, str, str], Array, Array | None]]:
    """Kind, ends and lengths of edges."""
    for relation in Relation:
        own = arrays["node_edge_relation"] == relation
        kind = ("node", relation.name.lower(), "node")
        yield kind, arrays["node_edge"][:, own], arrays["node_edge_length"][own, None]
    for walk_kind in WalkKind:
        own = arrays["walk_edge_kind"] == walk_kind
        pairs, length = arrays["walk_edge"][:, own], arrays["walk_edge_length"][own, None]
        both = np.concatenate([pairs, pairs[::-1]], axis=1)
        yield ("walk", walk_kind.name.lower(), "walk"), both, np.concatenate([length, length])
    lane = arrays["node_lane"]
    yield ("node", "on", "lane"), np.stack([np.arange(len(lane)), lane]), None
    yield ("lane", "successor", "lane"), arrays["lane_edge"], None
    agent = np.flatnonzero(arrays["agent_node"] >= 0)
    yield ("agent", "starts_at", "node"), np.stack([agent, arrays["agent_node"][agent]]), None
    light = arrays["light_lane"]
    yield ("light", "controls", "lane"), np.stack([np.arange(len(light)), light]), None
