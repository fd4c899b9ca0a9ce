"""JSON form of the lane table: columns instead of objects, lengths to a tenth of a millimetre."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from odscen.base.errors import GraphFormatError, InputError
from odscen.base.ids import JunctionId, LaneKey, RoadId, Roadside, SumoEdgeId, SumoLaneId
from odscen.base.stored_files import documents, read_json
from odscen.convert.lane_table.table import (
    VERSION,
    LaneTable,
    MappingInterval,
    SumoEdge,
    SumoLane,
    SumoLight,
    SumoLink,
)
from odscen.convert.model.net import LightLink, LinkConflict, Phase

_DIGITS = 4


def table_to_json(table: LaneTable) -> str:
    """One JSON document; the same table gives the same text."""
    return json.dumps(_table_to_data(table), separators=(",", ":"), allow_nan=False)


def table_from_json(text: str | bytes) -> LaneTable:
    """Inverse of :func:`table_to_json`.

    Raises
    ------
    GraphFormatError
        If the text is not a lane table of this version.
    """
    what = "a lane table"
    try:
        data = read_json(text, what=what)
        with documents(what):
            return _table_from_data(data)
    except InputError as error:
        raise GraphFormatError(error.problem) from error


def _table_to_data(table: LaneTable) -> dict[str, Any]:
    """Columns of a table, ready for JSON."""
    classes = _Classes()
    lanes = table.lane_list
    edge_row = {edge: row for row, edge in enumerate(table.edges)}
    lane_row = table.lane_row
    return {
        "version": VERSION,
        "net_offset": list(table.net_offset),
        "boundary": list(table.boundary),
        "lefthand": table.lefthand,
        "elevation": table.elevation,
        "counts": dict(table.counts),
        "lane_keys": [list(key) for key in table.lane_keys],
        "edges": {
            "id": [edge.id for edge in table.edges.values()],
            "function": [edge.function for edge in table.edges.values()],
            "from": [edge.from_junction for edge in table.edges.values()],
            "to": [edge.to_junction for edge in table.edges.values()],
            "length": [edge.length for edge in table.edges.values()],
        },
        "lanes": {
            "id": [lane.id for lane in lanes],
            "edge": [edge_row[lane.edge] for lane in lanes],
            "index": [lane.index for lane in lanes],
            "length": [lane.length for lane in lanes],
            "speed": [lane.speed for lane in lanes],
            "width": [lane.width for lane in lanes],
            "allowed": [classes.row(lane.allowed) for lane in lanes],
        },
        "classes": classes.listed,
        "links": [
            [lane_row[link.from_lane], lane_row[link.to_lane], lane_row.get(link.via, -1), link.tl]
            for link in table.links
        ],
        "walk_links": [[edge_row[one], edge_row[other]] for one, other in table.walk_links],
        "pieces": {
            "lane": [interval.lane for interval in table.intervals],
            "sumo": [interval.sumo for interval in table.intervals],
            "knots": [len(interval.pos) for interval in table.intervals],
            "pos": _rounded_column([interval.pos for interval in table.intervals]),
            "s": _rounded_column([interval.s for interval in table.intervals]),
            "deviation": _rounded_column([interval.deviation for interval in table.intervals]),
        },
        "lights": [
            {
                "id": light.id,
                "junctions": list(light.junctions),
                "offset": light.offset,
                "phases": [[p.duration, p.state, p.name, p.least, p.most] for p in light.phases],
                "signals": [list(signals) for signals in light.signals],
                "links": [
                    [*link[:4], list(link.crossed), [list(point) for point in link.path]]
                    for link in light.links
                ],
                "conflicts": [list(conflict) for conflict in light.conflicts],
            }
            for light in table.lights
        ],
    }


def _table_from_data(data: dict[str, Any]) -> LaneTable:
    """Inverse of :func:`_table_to_data`."""
    if data["version"] != VERSION:
        raise ValueError(f"version {data['version']!r}, not {VERSION}")
    edge_ids = [SumoEdgeId(edge) for edge in data["edges"]["id"]]
    lane_ids = [SumoLaneId(lane) for lane in data["lanes"]["id"]]
    lanes = _read_lanes(data["lanes"], lane_ids, edge_ids, data["classes"])
    return LaneTable(
        lane_keys=tuple(
            Roadside(RoadId(road), section, lane)
            if beside
            else LaneKey(RoadId(road), section, lane)
            for road, section, lane, *beside in data["lane_keys"]
        ),
        lanes=lanes,
        edges=_read_edges(data["edges"], edge_ids, lanes),
        links=tuple(
            SumoLink(
                lane_ids[one], lane_ids[other], lane_ids[via] if via >= 0 else SumoLaneId(""), tl
            )
            for one, other, via, tl in data["links"]
        ),
        walk_links=tuple((edge_ids[one], edge_ids[other]) for one, other in data["walk_links"]),
        intervals=_read_intervals(data["pieces"]),
        net_offset=tuple(data["net_offset"]),
        boundary=tuple(data["boundary"]),
        lefthand=data["lefthand"],
        counts=data["counts"],
        elevation=data["elevation"],
        lights=tuple(
            SumoLight(
                light["id"],
                tuple(JunctionId(junction) for junction in light["junctions"]),
                tuple(Phase(*phase) for phase in light["phases"]),
                light["offset"],
                tuple(tuple(signals) for signals in light["signals"]),
                tuple(
                    LightLink(
                        source, target, turn, speed, tuple(crossed), tuple((x, y) for x, y in path)
                    )
                    for source, target, turn, speed, crossed, path in light["links"]
                ),
                tuple(LinkConflict(*conflict) for conflict in light["conflicts"]),
            )
            for light in data["lights"]
        ),
    )


class _Classes:
    """Numbers the different sets of vehicle classes; ``None`` is -1."""

    def __init__(self) -> None:
        self.listed: list[list[str]] = []
        self._rows: dict[frozenset[str], int] = {}

    def row(self, classes: frozenset[str] | None) -> int:
        if classes is None:
            return -1
        if classes not in self._rows:
            self._rows[classes] = len(self.listed)
            self.listed.append(sorted(classes))
        return self._rows[classes]


def _read_lanes(
    data: dict[str, Any],
    lane_ids: list[SumoLaneId],
    edge_ids: list[SumoEdgeId],
    classes: list[list[str]],
) -> dict[SumoLaneId, SumoLane]:
    sets: list[frozenset[str] | None] = [*(frozenset(names) for names in classes), None]
    return {
        lane: SumoLane(lane, edge_ids[edge], index, length, speed, width, sets[allowed])
        for lane, edge, index, length, speed, width, allowed in zip(
            lane_ids,
            *(data[name] for name in ("edge", "index", "length", "speed", "width", "allowed")),
            strict=True,
        )
    }


def _read_edges(
    data: dict[str, Any], edge_ids: list[SumoEdgeId], lanes: dict[SumoLaneId, SumoLane]
) -> dict[SumoEdgeId, SumoEdge]:
    own: dict[SumoEdgeId, list[SumoLaneId]] = {edge: [] for edge in edge_ids}
    for lane in lanes.values():
        own[lane.edge].append(lane.id)
    return {
        edge: SumoEdge(edge, function, start, end, length, tuple(own[edge]))
        for edge, function, start, end, length in zip(
            edge_ids, *(data[name] for name in ("function", "from", "to", "length")), strict=True
        )
    }


def _read_intervals(data: dict[str, Any]) -> tuple[MappingInterval, ...]:
    if not data["lane"]:
        return ()
    ends = np.cumsum(np.array(data["knots"], dtype=np.int64))
    pos, s, deviation = (
        np.split(np.array(data[name], dtype=np.float64), ends[:-1])
        for name in ("pos", "s", "deviation")
    )
    return tuple(
        MappingInterval(*row)
        for row in zip(data["lane"], data["sumo"], pos, s, deviation, strict=True)
    )


def rounded(values: np.ndarray[Any, np.dtype[np.float64]]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Lengths as they are stored."""
    return np.round(values, _DIGITS) + 0.0


def _rounded_column(parts: list[np.ndarray[Any, np.dtype[np.float64]]]) -> list[float]:
    return rounded(np.concatenate(parts)).tolist() if parts else []
