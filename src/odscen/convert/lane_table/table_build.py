"""Making the lane table: what each SUMO lane was laid on only has to be written down."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.base.ids import Roadside, SumoLaneId
from odscen.convert.lane_table.mapping_intervals import MappingInterval, monotone, simplified
from odscen.convert.lane_table.table import LaneTable, SumoEdge, SumoLane, SumoLight, SumoLink

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.base.ids import JunctionId, LaneKey
    from odscen.convert.model.lane_alignment import LaneAlignment, Line
    from odscen.convert.model.net import Net, NetLane
    from odscen.convert.model.walk_net import WalkNet
    from odscen.opendrive.lanes import RoadTable


def build_table(
    net: Net,
    table: RoadTable,
    laid: Sequence[tuple[NetLane, Line, LaneAlignment]],
    walks: WalkNet,
    xodr: Mapping[str, tuple[JunctionId, ...]],
) -> LaneTable:
    """Write down where the lanes of a network lie.

    Parameters
    ----------
    laid
        Lanes for vehicles, with the lines and alignments that they were laid on.
    xodr
        OpenDRIVE junctions that a SUMO junction stands for.
    """
    everything = [*laid, *((w.edge.lanes[0], w.line, w.alignment) for w in walks.lanes)]
    keys: dict[LaneKey | Roadside, int] = {}
    rows = {lane.id: row for row, lane in enumerate(x for e in net.edges for x in e.lanes)}
    intervals: list[MappingInterval] = []
    for lane, line, alignment in everything:
        scale = lane.length / max(line.length, 1e-9)
        for stretch, arc, s in zip(alignment, line.arc, line.s, strict=True):
            key: LaneKey | Roadside = table.lane_keys[stretch.row]
            if stretch.beside:
                key = Roadside(*key)
            row = keys.setdefault(key, len(keys))
            interval = MappingInterval(row, rows[lane.id], arc * scale, s, np.zeros(len(s)))
            kept = monotone(interval, growing=bool(s[-1] > s[0]))
            if kept is not None:
                intervals.append(simplified(kept))
    lanes = {
        lane.id: SumoLane(
            lane.id, edge.id, lane.index, lane.length, lane.speed, lane.width, lane.allowed
        )
        for edge in net.edges
        for lane in edge.lanes
    }
    ids = {edge.id: tuple(lane.id for lane in edge.lanes) for edge in net.edges}
    return LaneTable(
        lane_keys=tuple(keys),
        lanes=lanes,
        edges={
            edge.id: SumoEdge(
                edge.id, edge.function, edge.start, edge.end, edge.length, ids[edge.id]
            )
            for edge in net.edges
        },
        links=tuple(
            SumoLink(
                ids[link.source][link.source_lane],
                ids[link.target][link.target_lane],
                link.via or SumoLaneId(""),
                link.light,
            )
            for link in net.links
            if lanes[ids[link.target][link.target_lane]].allowed != frozenset({"pedestrian"})
        ),
        walk_links=walks.walk_links,
        intervals=tuple(intervals),
        net_offset=net.offset,
        boundary=net.boundary,
        lefthand=net.lefthand,
        counts=net.counts(),
        elevation=not net.flat,
        lights=tuple(
            SumoLight(
                light.id,
                xodr.get(light.id, ()),
                light.phases,
                light.offset,
                light.signals,
                light.links,
                light.conflicts,
            )
            for light in net.lights
        ),
    )
