"""A map graph as one .npz file: what commands load. Plain arrays only, no pickles.

Equal graphs give equal bytes: numpy stamps the members of the archive with a fixed date.
"""

from __future__ import annotations

import io
import zipfile
import zlib
from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.base.errors import GraphFormatError
from odscen.base.given_arrays import npz_bytes
from odscen.base.ids import JunctionId, LaneKey, RoadId, SegmentId
from odscen.lanegraph.columns import (
    EDGE_COLUMNS,
    LANE_COLUMNS,
    NODE_COLUMNS,
    WALK_EDGE_COLUMNS,
    WALK_NODE_COLUMNS,
    Array,
    check_map_graph,
)
from odscen.lanegraph.graphs import (
    LaneGraph,
    Lanes,
    MapGraph,
    PedestrianGraph,
    SegmentPart,
    Segments,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

FORMAT = "odscen-map-graph"
VERSION = 1


def graph_arrays(graph: MapGraph) -> dict[str, Array]:
    """All of a map graph as named arrays, those of the file."""
    return {
        "format": _string_array([FORMAT]),
        "version": np.array([VERSION], dtype=np.int32),
        "map": _string_array([graph.map_name, graph.map_sha256]),
        **_segment_arrays(graph.segments),
        **_lane_arrays(graph.lanes),
        **_walk_arrays(graph.walks),
    }


def to_npz_bytes(graph: MapGraph) -> bytes:
    """Write the graph as an .npz file; the same graph gives the same bytes."""
    return npz_bytes(graph_arrays(graph))


def from_npz_bytes(data: bytes, *, file: str | None = None) -> MapGraph:
    """Inverse of :func:`to_npz_bytes`.

    Raises
    ------
    GraphFormatError
        If the bytes are not such a file, or one of another version.
    """
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            if not isinstance(archive, np.lib.npyio.NpzFile):
                raise GraphFormatError("it is a single array, not a map graph", file=file)
            arrays = {name: archive[name] for name in archive.files}
    except (zipfile.BadZipFile, zlib.error, EOFError, OSError, MemoryError) as err:
        raise GraphFormatError("it cannot be read as an .npz file", file=file) from err
    except (ValueError, TypeError, SyntaxError, NotImplementedError) as err:
        raise GraphFormatError(f"an array is malformed: {err}", file=file) from err
    return graph_from_arrays(arrays, file=file)


def graph_from_arrays(arrays: Mapping[str, Array], *, file: str | None = None) -> MapGraph:
    """Inverse of :func:`graph_arrays`; other arrays may be among them.

    Raises
    ------
    GraphFormatError
        If they are not those of a map graph, or of one of another version.
    """
    try:
        return check_map_graph(_read_graph(arrays))
    except GraphFormatError as error:
        error.file = error.file or file
        raise
    except KeyError as err:
        raise GraphFormatError(f"an array is missing: {err.args[0]}", file=file) from err
    except (ValueError, TypeError, IndexError) as err:
        raise GraphFormatError(f"an array is malformed: {err}", file=file) from err


def _read_graph(arrays: Mapping[str, Array]) -> MapGraph:
    if _read_texts(arrays, "format") != (FORMAT,):
        raise GraphFormatError("it is not an odscen map graph")
    version = _read_column(arrays, "version", np.int32).tolist()
    if version != [VERSION]:
        raise GraphFormatError(f"version is {version}; this odscen reads {VERSION}")
    name, sha256 = _read_texts(arrays, "map")
    return MapGraph(
        map_name=name,
        map_sha256=sha256,
        lanes=_lane_graph(arrays),
        segments=_read_segments(arrays),
        walks=_read_walks(arrays),
    )


def _segment_arrays(segments: Segments) -> dict[str, Array]:
    parts = [part for of in segments.parts for part in of]
    return {
        "segment_ids": _string_array(segments.ids),
        "segment_kinds": _string_array(segments.kinds),
        "segment_lengths": segments.lengths,
        "segment_adjacency": segments.adjacency.reshape(-1, 2),
        "segment_part_counts": np.array([len(of) for of in segments.parts], dtype=np.int32),
        "segment_part_roads": _string_array([part.road for part in parts]),
        "segment_part_s": np.array([(part.s_from, part.s_to) for part in parts]).reshape(-1, 2),
    }


def _read_segments(arrays: Mapping[str, Array]) -> Segments:
    roads = _read_texts(arrays, "segment_part_roads")
    stretches = _read_column(arrays, "segment_part_s", np.float64, dimensions=2).tolist()
    parts = [
        SegmentPart(RoadId(road), s_from, s_to)
        for road, (s_from, s_to) in zip(roads, stretches, strict=True)
    ]
    ends = np.cumsum(_read_column(arrays, "segment_part_counts", np.int32)).tolist()
    if (ends[-1] if ends else 0) != len(parts):
        raise GraphFormatError("the counts of parts do not add up", element="segments")
    return Segments(
        ids=tuple(map(SegmentId, _read_texts(arrays, "segment_ids"))),
        kinds=_read_texts(arrays, "segment_kinds"),  # type: ignore[arg-type]  # checked afterwards
        parts=tuple(
            tuple(parts[start:end]) for start, end in zip([0, *ends[:-1]], ends, strict=True)
        )
        if ends
        else (),
        lengths=_read_column(arrays, "segment_lengths", np.float64),
        adjacency=_read_column(arrays, "segment_adjacency", np.int32, dimensions=2),
    )


def _lane_arrays(lanes: LaneGraph) -> dict[str, Array]:
    table = lanes.lanes
    return {
        "spacing": np.array([lanes.spacing]),
        **_key_arrays("lane", table.keys),
        "lane_types": _string_array(table.types),
        "lane_in_junction": np.array([name is not None for name in table.junctions], np.bool_),
        "lane_junctions": _string_array([name or "" for name in table.junctions]),
        "lane_first_node": table.first_node,
        **{f"lane_{name}": getattr(table, name) for name in LANE_COLUMNS},
        **{f"node_{name}": getattr(lanes, name) for name in NODE_COLUMNS},
        **{f"node_{name}": getattr(lanes, name) for name in _NODE_ROWS},
        **{f"edge_{name}": getattr(lanes, name) for name in EDGE_COLUMNS},
    }


_NODE_ROWS = ("lane", "left_lane", "right_lane", "segment")


def _lane_graph(arrays: Mapping[str, Array]) -> LaneGraph:
    in_junction = _read_column(arrays, "lane_in_junction", np.bool_)
    names = _read_texts(arrays, "lane_junctions")
    table = Lanes(
        keys=_read_keys("lane", arrays),
        types=_read_texts(arrays, "lane_types"),
        junctions=tuple(
            JunctionId(name) if inside else None
            for inside, name in zip(in_junction.tolist(), names, strict=True)
        ),
        first_node=_read_column(arrays, "lane_first_node", np.int32),
        **{name: _read_column(arrays, f"lane_{name}", kind) for name, kind in LANE_COLUMNS.items()},
    )
    (spacing,) = _read_column(arrays, "spacing", np.float64).tolist()
    return LaneGraph(
        spacing=spacing,
        lanes=table,
        **{name: _read_column(arrays, f"node_{name}", np.int32) for name in _NODE_ROWS},
        **{name: _read_column(arrays, f"node_{name}", kind) for name, kind in NODE_COLUMNS.items()},
        **{name: _read_column(arrays, f"edge_{name}", kind) for name, kind in EDGE_COLUMNS.items()},
    )


def _walk_arrays(walks: PedestrianGraph) -> dict[str, Array]:
    crossings = [edge for edge, name in enumerate(walks.crosswalk) if name]
    return {
        "walk_spacing": np.array([walks.spacing]),
        **_key_arrays("walk", walks.lane_keys),
        "walk_roadside": walks.roadside,
        "walk_first_node": walks.first_node,
        "walk_node_lane": walks.lane,
        "walk_node_segment": walks.segment,
        **{f"walk_node_{name}": getattr(walks, name) for name in WALK_NODE_COLUMNS},
        **{f"walk_edge_{name}": getattr(walks, name) for name in WALK_EDGE_COLUMNS},
        "crossing_edges": np.array(crossings, dtype=np.int32),
        "crossing_ids": _string_array([walks.crosswalk[edge] for edge in crossings]),
    }


def _read_walks(arrays: Mapping[str, Array]) -> PedestrianGraph:
    crosswalk = [""] * len(arrays["walk_edge_source"])
    edges = _read_column(arrays, "crossing_edges", np.int32).tolist()
    for edge, name in zip(edges, _read_texts(arrays, "crossing_ids"), strict=True):
        crosswalk[edge] = name
    (spacing,) = _read_column(arrays, "walk_spacing", np.float64).tolist()
    nodes = WALK_NODE_COLUMNS.items()
    edge_columns = WALK_EDGE_COLUMNS.items()
    return PedestrianGraph(
        spacing=spacing,
        lane_keys=_read_keys("walk", arrays),
        roadside=_read_column(arrays, "walk_roadside", np.bool_),
        first_node=_read_column(arrays, "walk_first_node", np.int32),
        lane=_read_column(arrays, "walk_node_lane", np.int32),
        segment=_read_column(arrays, "walk_node_segment", np.int32),
        crosswalk=tuple(crosswalk),
        **{name: _read_column(arrays, f"walk_node_{name}", kind) for name, kind in nodes},
        **{name: _read_column(arrays, f"walk_edge_{name}", kind) for name, kind in edge_columns},
    )


def _key_arrays(prefix: str, keys: Sequence[LaneKey]) -> dict[str, Array]:
    return {
        f"{prefix}_road": _string_array([key.road for key in keys]),
        f"{prefix}_section": np.array([key.section for key in keys], dtype=np.int32),
        f"{prefix}_lane": np.array([key.lane for key in keys], dtype=np.int32),
    }


def _read_keys(prefix: str, arrays: Mapping[str, Array]) -> tuple[LaneKey, ...]:
    return tuple(
        LaneKey(RoadId(road), section, lane)
        for road, section, lane in zip(
            _read_texts(arrays, f"{prefix}_road"),
            _read_column(arrays, f"{prefix}_section", np.int32).tolist(),
            _read_column(arrays, f"{prefix}_lane", np.int32).tolist(),
            strict=True,
        )
    )


def _string_array(values: Sequence[str]) -> Array:
    return np.array(values, dtype=np.str_) if values else np.empty(0, dtype="<U1")


def _read_texts(arrays: Mapping[str, Array], name: str) -> tuple[str, ...]:
    values = arrays[name]
    if values.dtype.kind != "U" or values.ndim != 1:
        raise GraphFormatError("it is not a list of strings", element=f"array {name}")
    texts: list[str] = values.tolist()
    return tuple(texts)


def _read_column(arrays: Mapping[str, Array], name: str, kind: type, *, dimensions: int = 1) -> Any:
    values = arrays[name]
    if values.dtype != np.dtype(kind) or values.ndim != dimensions:
        raise GraphFormatError(
            f"it has type {values.dtype} and {values.ndim} dimensions", element=f"array {name}"
        )
    return values
