"""Arrays of a scenario as a ``HeteroData`` of PyTorch Geometric, and back.

Every array travels whole in the data, under its own name, so that the way back loses nothing; what
models read (``pos``, ``x``, ``edge_index``, ``edge_attr``) is made of them beside.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.lanegraph.graphs import Relation, WalkKind

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from odscen.base.arrays import BoolArray, FloatArray
    from odscen.base.given_arrays import Array

    Ends = tuple[str, str, str]

TABLES = {
    "node": "node_x", "walk": "walk_node_x", "lane": "lane_lengths", "segment": "segment_lengths",
    "actor": "actor_id", "flow": "flow_id",
}  # fmt: skip
"""Node types, and an array with a value for each of their nodes."""
_PREFIXES = {name: f"{name}_" for name in TABLES} | {"walk": "walk_node_"}
_DERIVED = frozenset({"pos", "x", "edge_index", "edge_attr", "origin", "num_nodes"})
_CATEGORIES = 7
_PEDESTRIAN = 6
_ROAD_COLUMNS = ("curvature", "width", "speed_limit")
"""Features of nodes of the lane graph, beside cosine and sine of the heading."""


def scenario_hetero_data(arrays: Mapping[str, Array]) -> Any:
    """Make a ``HeteroData`` of the arrays of a scenario; see ``docs/learning-formats.md``."""
    import torch
    from torch_geometric.data import HeteroData

    def real(values: Array) -> Any:
        return torch.from_numpy(np.ascontiguousarray(values, dtype=np.float32))

    data = HeteroData()
    places = np.column_stack([arrays["node_x"], arrays["node_y"], arrays["node_z"]])
    origin = places[:, :2].mean(axis=0) if len(places) else np.zeros(2)
    data.origin = torch.from_numpy(origin)
    for kind, (position, features) in _node_features(arrays, places).items():
        data[kind].x = real(features)
        if position is not None:
            data[kind].pos = real(position - np.append(origin, 0.0))
    for ends, index, lengths in _edge_features(arrays):
        data[ends].edge_index = torch.from_numpy(np.ascontiguousarray(index, dtype=np.int64))
        if lengths is not None:
            data[ends].edge_attr = real(lengths[:, None])
    for name, values in arrays.items():
        store = _store_of(name, values, arrays)
        (data if store is None else data[store])[name] = _to_tensor(values, torch)
    return data


def scenario_arrays_of(data: Any) -> dict[str, Array]:
    """Arrays of a scenario's ``HeteroData``: inverse of :func:`scenario_hetero_data`.

    Columns are read from their own names (``data["actor"].actor_speed``); what was made of them,
    such as ``x``, is not looked at.
    """
    found: dict[str, Array] = {}
    for store in data.stores:
        for name, value in store.items():
            if name not in _DERIVED:
                found[name] = _from_tensor(value)
    return found


def _to_tensor(values: Array, torch: Any) -> Any:
    if values.dtype.kind == "U":
        return values.tolist()  # of no dimension it is a text, else a list of texts
    return torch.from_numpy(values.copy())


def _from_tensor(value: Any) -> Array:
    if isinstance(value, list):
        return np.array(value, dtype=np.str_) if value else np.empty(0, dtype="<U1")
    return np.array(value) if isinstance(value, str) else np.asarray(value.numpy())


def _store_of(name: str, values: Array, arrays: Mapping[str, Array]) -> str | None:
    """Node type whose nodes have a value each in this array."""
    for kind, prefix in _PREFIXES.items():
        if name.startswith(prefix) and values.ndim and len(values) == len(arrays[TABLES[kind]]):
            return kind
    return None


def _node_features(
    arrays: Mapping[str, Array], places: FloatArray
) -> dict[str, tuple[FloatArray | None, FloatArray]]:
    """Positions (x, y, z, m) and features of each node type."""
    walks = np.column_stack([arrays[f"walk_node_{axis}"] for axis in "xyz"])
    inside = np.isin(np.arange(len(arrays["segment_ids"])), arrays["roi"])
    return {
        "node": (places, _pose_features(arrays, "node_", _ROAD_COLUMNS)),
        "walk": (walks, _pose_features(arrays, "walk_node_", ("width",))),
        "lane": (None, _stack_columns(arrays, "lane_", ("lengths", "forward", "in_junction"))),
        "segment": (
            None,
            np.column_stack(
                [arrays["segment_lengths"], arrays["segment_kinds"] == "junction", inside]
            ),
        ),
        "actor": (
            _start_places(arrays, "actor", _mask_of_walkers(arrays, "actor"), places, walks),
            np.column_stack([_one_hot(arrays["actor_category"]), _actor_numbers(arrays)]),
        ),
        "flow": (
            _start_places(arrays, "flow", _mask_of_walkers(arrays, "flow"), places, walks),
            np.column_stack(
                [arrays["flow_mix"], _stack_columns(arrays, "flow_", ("per_hour", "begin", "end"))]
            ),
        ),
    }


def _actor_numbers(arrays: Mapping[str, Array]) -> FloatArray:
    columns = ("speed", "initial_speed", "lateral_offset", "depart", "ego")
    return _stack_columns(arrays, "actor_", columns)


def _pose_features(
    arrays: Mapping[str, Array], prefix: str, columns: tuple[str, ...]
) -> FloatArray:
    hdg = arrays[f"{prefix}hdg"]
    return np.column_stack([np.cos(hdg), np.sin(hdg), _stack_columns(arrays, prefix, columns)])


def _stack_columns(
    arrays: Mapping[str, Array], prefix: str, columns: tuple[str, ...]
) -> FloatArray:
    """Columns side by side, -1 for what is not known or open."""
    values = np.column_stack([arrays[prefix + name].astype(np.float64) for name in columns])
    return np.nan_to_num(values, nan=-1.0, posinf=-1.0)


def _one_hot(category: Array) -> FloatArray:
    return np.eye(_CATEGORIES)[category.astype(np.int64)]


def _mask_of_walkers(arrays: Mapping[str, Array], table: str) -> BoolArray:
    """Whose nodes are of the pedestrian graph."""
    if table == "flow":
        return arrays["flow_on_foot"]
    found: BoolArray = arrays["actor_category"] == _PEDESTRIAN
    return found


def _start_places(
    arrays: Mapping[str, Array], table: str, on_foot: BoolArray, roads: Array, walks: Array
) -> FloatArray:
    """Where each starts; the origin of the map for those whose start has no node."""
    node = arrays[f"{table}_node"]
    found = np.zeros((len(node), 3))
    for own, graph in ((on_foot, walks), (~on_foot, roads)):
        known = own & (node >= 0)
        found[known] = graph[node[known]]
    return found


def _edge_features(arrays: Mapping[str, Array]) -> Iterator[tuple[Ends, Array, Array | None]]:
    """Kind, ends and lengths of edges."""
    pairs = np.stack([arrays["edge_source"], arrays["edge_target"]])
    for relation in Relation:
        own = arrays["edge_relation"] == relation
        kind = ("node", relation.name.lower(), "node")
        yield kind, pairs[:, own], arrays["edge_length"][own]
    walks = np.stack([arrays["walk_edge_source"], arrays["walk_edge_target"]])
    for walk_kind in WalkKind:
        own = arrays["walk_edge_kind"] == walk_kind
        both = np.concatenate([walks[:, own], walks[::-1, own]], axis=1)
        length = arrays["walk_edge_length"][own]
        yield ("walk", walk_kind.name.lower(), "walk"), both, np.concatenate([length, length])
    yield ("node", "in", "segment"), _number_rows(arrays["node_segment"]), None
    yield ("walk", "in", "segment"), _number_rows(arrays["walk_node_segment"]), None
    yield ("node", "on", "lane"), _number_rows(arrays["node_lane"]), None
    beside = arrays["segment_adjacency"].T
    yield ("segment", "beside", "segment"), np.concatenate([beside, beside[::-1]], axis=1), None
    for table in ("actor", "flow"):
        on_foot = _mask_of_walkers(arrays, table)
        for word, column in (("starts_at", "node"), ("goes_to", "goal")):
            ends = _number_rows(arrays[f"{table}_{column}"])
            known = ends[1] >= 0
            yield (table, word, "node"), ends[:, known & ~on_foot], None
            yield (table, word, "walk"), ends[:, known & on_foot], None


def _number_rows(rows: Array) -> Array:
    return np.stack([np.arange(len(rows)), rows])
