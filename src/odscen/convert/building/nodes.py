"""Nodes: which ends of edges meet in one SUMO junction, and what it is called."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

from scipy.cluster.hierarchy import DisjointSet

from odscen.base.ids import JunctionId, RoadId
from odscen.convert.model.connections import NodeKey, first_members, join_groups
from odscen.convert.model.edge_plan import LEAST_EDGE, is_between_junctions

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from odscen.convert.model.connections import PlannedConnections
    from odscen.convert.model.edge_plan import RoadGap
    from odscen.convert.pedestrian.crosswalks import PlacedCrosswalk
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.road_model import OpenDrive, Road, RoadLink
    from odscen.opendrive.topology import SideLink

_PLAIN = re.compile(r"[^A-Za-z0-9_.-]+")


class Nodes(NamedTuple):
    """Junction ids at both ends of each edge and of each crosswalk, and what is behind each.

    ``xodr`` gives the OpenDRIVE junctions that a node stands for.
    """

    starts: tuple[str, ...]
    ends: tuple[str, ...]
    crosswalks: tuple[str, ...]
    xodr: Mapping[str, tuple[JunctionId, ...]]


def plain_ids(names: Iterable[str]) -> dict[str, str]:
    """Ids that SUMO takes, one for each name; letters that it does not take become ``_``."""
    used: dict[str, str] = {}
    taken: set[str] = set()
    for name in names:
        plain = _PLAIN.sub("_", name) or "_"
        number, unique = 2, plain
        while unique in taken:
            unique = f"{plain}_{number}"
            number += 1
        taken.add(unique)
        used[name] = unique
    return used


def find_nodes(
    odr: OpenDrive,
    table: RoadTable,
    found: PlannedConnections,
    gaps: Mapping[RoadId, Sequence[RoadGap]],
    crosswalks: Sequence[PlacedCrosswalk],
    sides: Sequence[SideLink] = (),
) -> Nodes:
    """Join the ends of edges: those of one OpenDRIVE junction, and those that connections join."""
    groups = _join_road_ends(odr, gaps)
    for side in sides:
        main = odr.roads[side.main.road]
        junction = odr.roads[side.other.road].junction
        for gap in gaps[main.id]:
            if gap.start <= side.s <= gap.end:
                join_groups(groups, ("junction", junction), _port_at(main, gap.start))
    walked = [_join_crosswalk(odr, groups, gaps, n, c) for n, c in enumerate(crosswalks)]
    roads = [odr.roads[table.road_ids[edge.road]] for edge in found.edges]
    heads = [_port_at(road, edge.end) for road, edge in zip(roads, found.edges, strict=True)]
    tails = [_port_at(road, edge.start) for road, edge in zip(roads, found.edges, strict=True)]
    for connection in found.connections:
        join_groups(groups, heads[connection.source], tails[connection.target])
        for stretch in connection.alignment:
            junction_of = odr.roads[table.road_ids[table.lane_road[stretch.row]]].junction
            if junction_of is not None:
                join_groups(groups, ("junction", junction_of), heads[connection.source])
    first = first_members(groups)
    ports = [first.get(port, port) for port in (*tails, *heads, *walked)]
    names = plain_ids(_name_node(port) for port in dict.fromkeys(ports))
    own_names = [names[_name_node(port)] for port in ports]
    xodr: dict[str, list[JunctionId]] = {}
    for junction in odr.junctions:
        root = _name_node(first[("junction", junction)])
        if root in names:
            xodr.setdefault(names[root], []).append(junction)
    count = len(found.edges)
    return Nodes(
        tuple(own_names[:count]),
        tuple(own_names[count : 2 * count]),
        tuple(own_names[2 * count :]),
        {name: tuple(junctions) for name, junctions in xodr.items()},
    )


def _join_road_ends(
    odr: OpenDrive, gaps: Mapping[RoadId, Sequence[RoadGap]]
) -> DisjointSet[NodeKey]:
    """Ends of roads joined as the roads' links say, and over crosswalks."""
    groups: DisjointSet[NodeKey] = DisjointSet()
    for junction in odr.junctions:
        groups.add(("junction", junction))
    for road in odr.roads.values():
        for end, link in (("start", road.predecessor), ("end", road.successor)):
            _join_link(odr, groups, road, end, link)
        for gap in gaps.get(road.id, ()):
            join_groups(groups, _port_at(road, gap.start), _port_at(road, gap.end))
    return groups


def _join_crosswalk(
    odr: OpenDrive,
    groups: DisjointSet[NodeKey],
    gaps: Mapping[RoadId, Sequence[RoadGap]],
    number: int,
    placed: PlacedCrosswalk,
) -> NodeKey:
    own: NodeKey = ("crosswalk", number)
    groups.add(own)
    junctions = dict.fromkeys(odr.roads[road_id].junction for road_id in placed.connecting)
    for road_id, s in placed.roads:
        road = odr.roads[road_id]
        over = [gap for gap in gaps[road_id] if gap.start <= s <= gap.end]
        # A road that all lies under crosswalks keeps an edge: they belong to the nearer end of it.
        for gap in over or [min(gaps[road_id], key=lambda g: max(g.start - s, s - g.end))]:
            port = _port_at(road, gap.start)
            join_groups(groups, port, own)
            # Its own edge keeps both junctions apart, even if the crosswalk reaches over both.
            if len(junctions) > 1 and is_between_junctions(road):
                link = road.predecessor if port[-1] == "start" else road.successor
                if link is not None and link.element_id in junctions:
                    junctions = {JunctionId(link.element_id): None}
    for junction in junctions:
        join_groups(groups, ("junction", junction), own)
    return own


def _name_node(port: NodeKey) -> str:
    """What a node is called: after its junction, or after the end of a road."""
    kind, *rest = port
    if kind == "junction":
        return f"J{rest[0]}"
    if kind == "crosswalk":
        return f"X{rest[0]}"
    return "N" + ".".join(str(part) for part in rest)


def _join_link(
    odr: OpenDrive, groups: DisjointSet[NodeKey], road: Road, end: str, link: RoadLink | None
) -> None:
    if link is None:
        return
    here: NodeKey = ("road", road.id, end)
    if road.junction is not None:
        here = ("junction", road.junction)
    if link.element_type == "junction":
        if link.element_id in odr.junctions:
            join_groups(groups, ("junction", link.element_id), here)
        return
    other = odr.roads.get(RoadId(link.element_id))
    if other is None or link.contact_point is None:
        return
    if other.junction is not None:
        join_groups(groups, ("junction", other.junction), here)
    else:
        join_groups(groups, here, ("road", other.id, link.contact_point))


def _port_at(road: Road, s: float) -> NodeKey:
    if s <= LEAST_EDGE:
        return ("road", road.id, "start")
    if s >= road.length - LEAST_EDGE:
        return ("road", road.id, "end")
    return ("cut", road.id, round(s, 3))
