"""Large answers: made once per map, compressed once, sent as they are."""

from __future__ import annotations

import gzip
import hashlib
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import orjson
from starlette.responses import Response

from odscen.app.map_names import map_names
from odscen.app.maps import load_map
from odscen.lanegraph.node_heights import node_heights
from odscen.reports.place_names import compass_point
from odscen.web.wire.media_types import Responses

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from starlette.requests import Request

    from odscen.maps.map_entry import MapEntry


UNCHANGED: Responses = {304: {"description": "What the client has is right."}}
"""What a packed answer may be instead, for the schema."""


class PackedAnswer(NamedTuple):
    """Bytes, compressed, and a tag that changes with them."""

    content: bytes
    tag: str


def pack(content: bytes) -> PackedAnswer:
    """Compress; the tag is a hash of the content."""
    tag = f'"{hashlib.sha256(content).hexdigest()[:24]}"'
    return PackedAnswer(gzip.compress(content, 5, mtime=0), tag)


def answer(request: Request, packed: PackedAnswer) -> Response:
    """Send it, or only say that what the browser has is still right."""
    headers = {"ETag": packed.tag, "Cache-Control": "no-cache", "Vary": "Accept-Encoding"}
    if request.headers.get("if-none-match") == packed.tag:
        return Response(status_code=304, headers=headers)
    content = packed.content
    if "gzip" in request.headers.get("accept-encoding", ""):
        headers["Content-Encoding"] = "gzip"
    else:
        content = gzip.decompress(content)
    return Response(content, media_type="application/json", headers=headers)


@lru_cache(maxsize=8)
def packed_drawing(entry: MapEntry) -> PackedAnswer:
    """``drawing.json`` of a map."""
    return pack(entry.read("drawing"))


@lru_cache(maxsize=8)
def packed_graph(entry: MapEntry) -> PackedAnswer:
    """Columns of a map's graphs."""
    return pack(orjson.dumps(graph_columns(entry), option=orjson.OPT_SERIALIZE_NUMPY))


def graph_columns(entry: MapEntry) -> dict[str, Any]:
    """The lane graph, the segments and the pedestrian graph as columns.

    Places to the millimetre, headings to 1e-5 rad; a missing speed limit is null. ``spawnable`` and
    ``walkable`` are 1 where the simulator can place a road user exactly.
    """
    loaded = load_map(entry)
    graph, usable = loaded.sumo.graph, loaded.usable
    lanes, segments, walks = graph.lanes, graph.segments, graph.walks
    beside: list[list[int]] = [[] for _ in segments.ids]
    for one, other in segments.adjacency.tolist():
        beside[one].append(other)
        beside[other].append(one)
    return {
        "spacing": lanes.spacing,
        "lane_keys": [str(key) for key in lanes.lanes.keys],
        "lane_types": lanes.lanes.types,
        "lane_junctions": lanes.lanes.junctions,
        "first_node": lanes.lanes.first_node,
        "lane": lanes.lane,
        "s": np.round(lanes.s, 3),
        **_pack_places(lanes.x, lanes.y, lanes.hdg, lanes.width),
        "speed_limit": [None if np.isnan(v) else round(v, 3) for v in lanes.speed_limit.tolist()],
        "segment": lanes.segment,
        "left_lane": lanes.left_lane,
        "right_lane": lanes.right_lane,
        "spawnable": _pack_mask(usable.spawnable, len(lanes.x)),
        "edges": {
            "source": lanes.source,
            "target": lanes.target,
            "relation": lanes.relation.astype(np.int32),
        },
        "segments": [
            {"id": name, "kind": kind, "neighbours": sorted(others)}
            for name, kind, others in zip(segments.ids, segments.kinds, beside, strict=True)
        ],
        "walks": {
            "lane_keys": [str(key) for key in walks.lane_keys],
            "first_node": walks.first_node,
            "lane": walks.lane,
            **_pack_places(walks.x, walks.y, walks.hdg, walks.width),
            "segment": walks.segment,
            "walkable": _pack_mask(usable.walkable, len(walks.x)),
            "source": walks.source,
            "target": walks.target,
            "kind": walks.kind.astype(np.int32),
        },
    }


@lru_cache(maxsize=8)
def packed_heights(entry: MapEntry) -> PackedAnswer:
    """Heights of the nodes of a map's graphs, which only a view in three dimensions needs."""
    lanes, walks = node_heights(load_map(entry).sumo.graph)
    columns = {"z": np.round(lanes, 3), "walks": np.round(walks, 3)}
    return pack(orjson.dumps(columns, option=orjson.OPT_SERIALIZE_NUMPY))


@lru_cache(maxsize=8)
def packed_names(entry: MapEntry) -> PackedAnswer:
    """What the names of a map's junctions and roads are made of."""
    names = map_names(load_map(entry))
    junctions = [
        {
            "id": junction,
            "streets": name.streets,
            "which": name.which,
            "legs": [
                {"segment": segment, "side": compass_point(direction)}
                for segment, direction in names.legs[junction].items()
            ],
        }
        for junction, name in names.junction_names.items()
    ]
    roads = [
        {
            "id": segment,
            "street": name.street,
            "ends": [{"junction": junction, "street": street} for junction, street in name.ends],
            "side": name.side,
        }
        for segment, name in names.road_names.items()
    ]
    return pack(orjson.dumps({"junctions": junctions, "roads": roads}))


def _pack_places(*columns: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    x, y, hdg, width = columns
    return {
        "x": np.round(x, 3),
        "y": np.round(y, 3),
        "hdg": np.round(hdg, 5),
        "width": np.round(width, 3),
    }


def _pack_mask(mask: NDArray[np.bool_] | None, count: int) -> NDArray[np.int32]:
    return np.ones(count, dtype=np.int32) if mask is None else mask.astype(np.int32)
