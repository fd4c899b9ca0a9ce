"""From a road model to a SUMO network, the lane table and the conversion report.

The network is written by odscen itself, lane by lane from the road model; why not by netconvert:
``docs/decisions/0003-writing-the-network.md``.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import shapely

from odscen.base.ids import Roadside, SumoEdgeId, SumoLaneId
from odscen.convert.building.findings import CROSSING_REACH, findings
from odscen.convert.building.junctions import Passage, Surroundings, build_junction, outline
from odscen.convert.building.nodes import find_nodes, plain_ids
from odscen.convert.lane_table.sumo_network import SumoNetwork
from odscen.convert.lane_table.table import (
    LaneTable,
    MappingInterval,
    SumoEdge,
    SumoLane,
    SumoLight,
    SumoLink,
    monotone,
    simplified,
)
from odscen.convert.model.access import speed as lane_speed
from odscen.convert.model.access import vehicle_classes
from odscen.convert.model.connections import LostConnection, find_connections
from odscen.convert.model.conversion_report import ConversionReport, parser_entries
from odscen.convert.model.curve_speed import (
    BINDING,
    HEAVY,
    TURNING,
    comfortable_speed,
    sharpest_bend,
)
from odscen.convert.model.edge_plan import merge_gaps, plan_edges, side_gaps
from odscen.convert.model.lane_alignment import divided, evaluate
from odscen.convert.model.net import LEAST_LENGTH, NORMAL, Net, NetEdge, NetJunction, NetLane
from odscen.convert.model.net_ids import lane_id
from odscen.convert.model.net_xml import net_xml
from odscen.convert.model.right_of_way import OPPOSING, Movement, Sign, wrapped
from odscen.convert.pedestrian.crosswalks import place_crosswalks
from odscen.convert.pedestrian.pedestrian_network import build_walks
from odscen.convert.signals.map_signals import signal_control
from odscen.convert.signals.road_lights import cut_for_lights
from odscen.opendrive.objects import signal_kind
from odscen.opendrive.topology import folded_lanes, lane_successors, side_links

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.base.ids import JunctionId, LaneKey, RoadId
    from odscen.convert.building.junctions import BuiltJunction
    from odscen.convert.building.nodes import Nodes
    from odscen.convert.model.connections import PlannedConnection, PlannedConnections
    from odscen.convert.model.edge_plan import EdgePlan, RoadGap
    from odscen.convert.model.lane_alignment import LaneAlignment, Line
    from odscen.convert.pedestrian.pedestrian_network import WalkNet
    from odscen.convert.signals.acting_signals import Acting
    from odscen.convert.signals.map_signals import SignalControl
    from odscen.convert.signals.road_lights import RoadStop
    from odscen.lanegraph.graphs import PedestrianGraph
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.road_model import OpenDrive


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


LONGEST = 600.0
"""Metres around a roundabout, at most."""

MOST_EDGES = 60


def find_roundabouts(
    edges: Sequence[EdgePlan],
    connections: Sequence[PlannedConnection],
    lane_lines: Sequence[Sequence[Line]],
    connection_lines: Sequence[Line],
    *,
    lefthand: bool,
) -> tuple[tuple[int, ...], ...]:
    """Positions of the edges of each roundabout, in driving direction.

    Parameters
    ----------
    lane_lines, connection_lines
        The lanes of each edge, and each connection, evaluated.
    """
    sides: dict[int, set[bool]] = {}
    for edge in edges:
        sides.setdefault(edge.road, set()).add(edge.forward)
    one_way = [len(sides[edge.road]) == 1 for edge in edges]
    following: dict[int, dict[int, float]] = {}
    for connection, line in zip(connections, connection_lines, strict=True):
        if one_way[connection.source] and one_way[connection.target]:
            turn = _turned_angle(line)
            known = following.setdefault(connection.source, {})
            target = connection.target
            if target not in known or abs(turn) < abs(known[target]):
                known[target] = turn
    wanted = -2.0 * math.pi if lefthand else 2.0 * math.pi
    roundabouts: list[tuple[int, ...]] = []
    taken: set[int] = set()
    for start in sorted(following):
        if start in taken:
            continue
        roundabout = _walk_around_edges(start, following, lane_lines, wanted)
        if roundabout and not taken & set(roundabout):
            roundabouts.append(roundabout)
            taken |= set(roundabout)
    return tuple(roundabouts)


def _walk_around_edges(
    start: int,
    following: dict[int, dict[int, float]],
    lines: Sequence[Sequence[Line]],
    wanted: float,
) -> tuple[int, ...]:
    """The edges round from an edge back to it, inwards at every choice, or nothing."""
    side = math.copysign(1.0, wanted)
    roundabout = [start]
    turned, length = _turned_angle(lines[start][0]), lines[start][0].length
    while len(roundabout) <= MOST_EDGES and length <= LONGEST:
        choices = following.get(roundabout[-1], {})
        if not choices:
            return ()
        # The roundabout continues where the connection turns most to the inside.
        edge = max(choices, key=lambda n: (side * choices[n], -n))
        turned += choices[edge]
        if edge == start:
            return tuple(roundabout) if abs(turned - wanted) < 0.6 else ()
        if edge in roundabout:
            return ()
        roundabout.append(edge)
        turned += _turned_angle(lines[edge][0])
        length += lines[edge][0].length
    return ()


def _turned_angle(line: Line) -> float:
    """Change of heading along a line, summed over its vertices, radians."""
    steps = line.shape[1:, :2] - line.shape[:-1, :2]
    headings = [math.atan2(y, x) for x, y in steps.tolist()]
    return sum(wrapped(b - a) for a, b in pairwise(headings))


def build_network(odr: OpenDrive, table: RoadTable, walks: PedestrianGraph) -> SumoNetwork:
    """Make the SUMO network of a map.

    Parameters
    ----------
    odr, table
        The road model and its evaluation.
    walks
        The pedestrian graph of the map.
    """
    lefthand = _keeps_left(table)
    successors = lane_successors(odr)
    sides = side_links(odr)
    folded = folded_lanes(odr, table)
    crosswalks, under = place_crosswalks(odr, table)
    gaps: Mapping[RoadId, Sequence[RoadGap]] = merge_gaps(odr, under, side_gaps(sides))
    stops: Mapping[Acting, RoadStop] = {}
    while True:
        plans = plan_edges(odr, table, successors, gaps, lefthand=lefthand)
        followed = find_connections(table, successors, plans, sides, folded)
        found = _open_connections(odr, table, followed)
        nodes = find_nodes(odr, table, found, gaps, crosswalks, sides)
        on_foot = build_walks(walks, table, crosswalks, nodes.crosswalks)
        builder = _NetworkBuilder(odr, table, found, nodes, on_foot, stops, lefthand=lefthand)
        if stops or not builder.control.standing:
            break
        # Lights that stand on plain roads are known now: once more, with the roads cut for them.
        stops, gaps = cut_for_lights(odr, builder.control.standing, gaps)
        if not stops:
            break
    net = builder.net()
    lanes = build_table(net, table, builder.laid(), on_foot, nodes.xodr)
    entries, figures = findings(odr, table, net, lanes, found, builder.control, crosswalks)
    report = ConversionReport.of([*parser_entries(odr.notes), *entries], figures)
    return SumoNetwork(net_xml(net), lanes, report)


def shared_classes(
    odr: OpenDrive, table: RoadTable, edges: Sequence[EdgePlan], connection: PlannedConnection
) -> frozenset[str]:
    """Vehicle classes that may use both lanes of a connection, and by access all lanes between."""
    source = edges[connection.source].lanes[connection.source_lane]
    classes = source.allowed & edges[connection.target].lanes[connection.target_lane].allowed
    for stretch in connection.alignment:
        key = table.lane_keys[stretch.row]
        lane = odr.roads[key.road].sections[key.section].lanes[key.lane]
        if lane.access:
            classes &= vehicle_classes(lane, 0.5 * (stretch.start + stretch.end))
    return classes


def _open_connections(
    odr: OpenDrive, table: RoadTable, found: PlannedConnections
) -> PlannedConnections:
    """Leave out connections that no vehicle may use: for SUMO no permission is every permission."""
    kept, lost = [], []
    for connection in found.connections:
        if shared_classes(odr, table, found.edges, connection):
            kept.append(connection)
            continue
        last = found.edges[connection.source].lanes[connection.source_lane].alignment[-1]
        reason = "no vehicle class may use this lane and the one that it leads to"
        lost.append(LostConnection(table.lane_keys[last.row], reason))
    return replace(found, connections=tuple(kept), lost=(*found.lost, *lost)) if lost else found


def _keeps_left(table: RoadTable) -> bool:
    """Whether most of the roads, by length, keep left: SUMO's networks know only one side."""
    if not len(table.road_length):
        return False
    return float(table.road_length[~table.road_rht].sum()) > float(table.road_length.sum()) / 2.0


class _NetworkBuilder:
    """Puts the parts together; the order of everything follows from the order of the file."""

    def __init__(
        self,
        odr: OpenDrive,
        table: RoadTable,
        found: PlannedConnections,
        nodes: Nodes,
        walks: WalkNet,
        stops: Mapping[Acting, RoadStop],
        *,
        lefthand: bool,
    ) -> None:
        self._odr = odr
        self._stops = stops
        self._table = table
        self._edges = found.edges
        self._connections = found.connections
        self._nodes = nodes
        self._walks = walks
        self._lefthand = lefthand
        alignments = [lane.alignment for edge in self._edges for lane in edge.lanes]
        lines = evaluate(
            [*alignments, *(connection.alignment for connection in self._connections)], table
        )
        self._lane_lines: list[list[Line]] = []
        start = 0
        for edge in self._edges:
            self._lane_lines.append(lines[start : start + len(edge.lanes)])
            start += len(edge.lanes)
        self._connection_lines = lines[start:]
        self._ids = self._edge_ids()
        self._net_edges = [self._build_edge(number) for number in range(len(self._edges))]
        self._by_node: dict[str, list[int]] = {}
        for number, connection in enumerate(self._connections):
            self._by_node.setdefault(nodes.ends[connection.source], []).append(number)
        self._roundabout_edges = find_roundabouts(
            self._edges,
            self._connections,
            self._lane_lines,
            self._connection_lines,
            lefthand=lefthand,
        )
        self._on_roundabouts = {
            edge for roundabout in self._roundabout_edges for edge in roundabout
        }
        self._controllers = {
            signal: controller.id
            for controller in odr.controllers.values()
            for signal, _ in controller.controls
        }
        self._starting = _positions_by_value(nodes.starts)
        self._ending = _positions_by_value(nodes.ends)
        self._walked: dict[str, list[SumoLaneId]] = {}
        for walk in walks.lanes:
            self._walked.setdefault(walk.edge.end, []).append(walk.edge.lanes[0].id)
        self.control = self._signal_control()
        self._walk_lights = self._place_walk_lights()
        self._via: dict[int, NetLane] = {}
        self._beyond: dict[int, tuple[NetLane, float]] = {}

    def laid(self) -> list[tuple[NetLane, Line, LaneAlignment]]:
        """SUMO lanes with the lines and the alignments that they are laid on."""
        found = []
        for number, edge in enumerate(self._edges):
            for index, lane in enumerate(edge.lanes):
                line = self._lane_lines[number][index]
                found.append((self._net_edges[number].lanes[index], line, lane.alignment))
        for number, inner in sorted(self._via.items()):
            line, alignment = self._connection_lines[number], self._connections[number].alignment
            if number not in self._beyond:
                found.append((inner, line, alignment))
                continue
            second, place = self._beyond[number]
            before, after = divided(line, alignment, place)
            found += [(inner, *before), (second, *after)]
        return found

    def net(self) -> Net:
        """Assemble everything."""
        built = [self._build_junction(name) for name in self._node_names()]
        walks = self._walks
        shapes = [lane.shape for edge in self._net_edges for lane in edge.lanes]
        shapes += [walk.line.shape for walk in walks.lanes]
        points = np.concatenate(shapes) if shapes else np.zeros((1, 3))
        low = points.min(axis=0)
        inner = [edge for part in built for edge in part.inner]
        return Net(
            offset=(-math.floor(float(low[0])) + 0.0, -math.floor(float(low[1])) + 0.0),
            lefthand=self._lefthand,
            edges=(*inner, *walks.areas, *self._net_edges, *(walk.edge for walk in walks.lanes)),
            links=(*(link for part in built for link in part.links), *walks.links),
            junctions=(*(part.junction for part in built), *self._walk_junctions()),
            lights=tuple(part.light for part in built if part.light),
            roundabouts=self._find_roundabouts(),
            flat=not points[:, 2].any(),
            inner_junctions=tuple(junction for part in built for junction in part.waiting),
        )

    def _node_names(self) -> list[str]:
        nodes = self._nodes
        return list(dict.fromkeys((*nodes.starts, *nodes.ends, *nodes.crosswalks)))

    # Junctions

    def _build_junction(self, name: str) -> BuiltJunction:
        numbers = sorted(self._by_node.get(name, ()), key=lambda n: self._connections[n][:4])
        crossings = self._walks.crossings.get(name, ())
        passages = [self._build_passage(number) for number in numbers]
        built = build_junction(name, passages, crossings, self._find_surroundings(name))
        for position, (number, lane) in enumerate(zip(numbers, built.lanes, strict=True)):
            self._via[number] = lane
            if position in built.beyond:
                self._beyond[number] = built.beyond[position]
        return built

    def _find_surroundings(self, name: str) -> Surroundings:
        starts, ends = self._starting.get(name, []), self._ending.get(name, [])
        lanes = [
            (lane.shape, lane.width, is_end)
            for edges, is_end in ((ends, True), (starts, False))
            for edge in edges
            for lane in self._net_edges[edge].lanes
        ]
        crossings = self._walks.crossings.get(name, ())
        lanes += [
            (c.walkway.axis, c.walkway.width, which) for c in crossings for which in (True, False)
        ]
        shape = outline(lanes)
        incoming = [lane.id for edge in ends for lane in self._net_edges[edge].lanes]
        x, y, z = (float(value) for value in shape.mean(axis=0))
        junctions = self._nodes.xodr.get(name, ())
        return Surroundings(
            (x, y, z),
            shape,
            (*incoming, *self._walked.get(name, ())),
            frozenset(
                (str(priority.high), str(priority.low))
                for junction in junctions
                for priority in self._odr.junctions[junction].priorities
            ),
            self._controllers,
            self._lefthand,
            " ".join(junctions),
            self._find_walk_signals(name) if crossings and not junctions else (),
        )

    def _find_walk_signals(self, name: str) -> tuple[str, ...]:
        """Ids of the pedestrian lights at the crosswalks of a plain road."""
        axes = [c.walkway.axis[:, :2] for c in self._walks.crossings.get(name, ())]
        line = shapely.MultiLineString(axes)
        return tuple(
            signal
            for signal, (x, y) in self._walk_lights.items()
            if line.distance(shapely.Point(x, y)) <= CROSSING_REACH
        )

    def _place_walk_lights(self) -> dict[str, tuple[float, float]]:
        """Where the pedestrian lights of roads outside junctions are, by their ids."""
        found: dict[str, tuple[float, float]] = {}
        for road in self._odr.roads.values():
            row = np.array([self._table.road_index[road.id]])
            for signal in road.signals if road.junction is None else ():
                if signal_kind(signal) == "pedestrian_light":
                    at = np.array([signal.s]), np.array([signal.t])
                    x, y, _ = self._table.points(row, *at)
                    found[signal.id] = (float(x[0]), float(y[0]))
        return found

    def _build_passage(self, number: int) -> Passage:
        connection, line = self._connections[number], self._connection_lines[number]
        source = self._net_edges[connection.source].lanes[connection.source_lane]
        target = self._net_edges[connection.target].lanes[connection.target_lane]
        before = self._lane_lines[connection.source][connection.source_lane]
        after = self._lane_lines[connection.target][connection.target_lane]
        table = self._table
        over = [table.road_ids[table.lane_road[stretch.row]] for stretch in connection.alignment]
        connecting = [road for road in over if self._odr.roads[road].junction is not None]
        incoming = table.road_ids[self._edges[connection.source].road]
        movement = Movement(
            source=(self._ids[connection.source], connection.source_lane),
            target=(self._ids[connection.target], connection.target_lane),
            shape=line.shape,
            width=min(source.width, target.width),
            heading_in=before.headings()[1],
            heading_out=after.headings()[0],
            speed=self._edges[connection.source].lanes[connection.source_lane].limit,
            sign=self.control.signs[number],
            in_roundabout=connection.source in self._on_roundabouts,
            roads=frozenset(str(road) for road in (incoming, *connecting)),
        )
        limits = [
            self._edges[connection.source].lanes[connection.source_lane].limit,
            self._edges[connection.target].lanes[connection.target_lane].limit,
        ]
        speed, heavy = self._internal_speeds(connection, line, around=min(limits))
        return Passage(
            movement,
            line.length,
            speed,
            shared_classes(self._odr, self._table, self._edges, connection),
            source.type,
            self._origin_lanes(connection.alignment),
            self.control.lights[number],
            heavy,
        )

    def _internal_speeds(
        self, connection: PlannedConnection, line: Line, *, around: float
    ) -> tuple[float, float]:
        """Speed of an internal lane: what the map says, or else the slower road; less in curves.

        The other is that of trucks and buses; infinite without a curve.
        """
        table = self._table
        rows = np.array([stretch.row for stretch in connection.alignment])
        middle = np.array([(stretch.start + stretch.end) / 2.0 for stretch in connection.alignment])
        limits = table.speed_limit(rows, middle)
        own = [
            lane_speed(float(limit), table.lane_type[row], "")
            for limit, row in zip(limits, rows, strict=True)
            if not math.isnan(limit)
        ]
        speed = min(own) if own else around
        bend = sharpest_bend(line.shape)
        curve, heavy = (
            float(comfortable_speed(bend, share=TURNING * share)) for share in (1.0, HEAVY)
        )
        if heavy >= BINDING * speed:
            return round(speed, 2), math.inf
        return round(min(speed, curve) if curve < BINDING * speed else speed, 2), round(heavy, 2)

    # Edges

    def _edge_ids(self) -> list[SumoEdgeId]:
        wanted = [
            f"{self._table.road_ids[edge.road]}.{edge.stretch}.{'f' if edge.forward else 'b'}"
            for edge in self._edges
        ]
        taken = plain_ids(wanted)
        return [SumoEdgeId(taken[name]) for name in wanted]

    def _build_edge(self, number: int) -> NetEdge:
        plan, lines = self._edges[number], self._lane_lines[number]
        length = max(float(np.mean([line.length for line in lines])), LEAST_LENGTH)
        edge = self._ids[number]
        lanes = tuple(
            NetLane(
                lane_id(edge, index),
                index,
                round(length, 4),
                lane.speed,
                round(max(line.widths[1], 0.5), 2),
                lane.allowed,
                line.shape,
                lane.type,
                lane.change_left,
                lane.change_right,
                self._origin_lanes(lane.alignment),
                lane.heavy_speed,
            )
            for index, (lane, line) in enumerate(zip(plan.lanes, lines, strict=True))
        )
        road = self._odr.roads[self._table.road_ids[plan.road]]
        start, end = self._nodes.starts[number], self._nodes.ends[number]
        return NetEdge(edge, NORMAL, lanes, start, end, road.name)

    def _origin_lanes(self, alignment: LaneAlignment) -> tuple[str, ...]:
        keys = [self._table.lane_keys[stretch.row] for stretch in alignment]
        return tuple(dict.fromkeys(f"{key.road}_{key.lane}" for key in keys))

    def _find_roundabouts(self) -> tuple[tuple[tuple[str, ...], tuple[SumoEdgeId, ...]], ...]:
        return tuple(
            (
                tuple(dict.fromkeys(self._nodes.ends[edge] for edge in roundabout)),
                tuple(self._ids[edge] for edge in roundabout),
            )
            for roundabout in self._roundabout_edges
        )

    # Signals

    def _signal_control(self) -> SignalControl:
        crossed = set(self._nodes.crosswalks)

        def is_junction(edge: int) -> bool:
            node = self._nodes.ends[edge]
            return node in self._nodes.xodr or node in crossed

        control = signal_control(
            self._odr, self._table, self._edges, self._connections, is_junction, self._stops
        )
        return self._obey_priority_signs(control)

    def _obey_priority_signs(self, control: SignalControl) -> SignalControl:
        """Let those give way who come to a junction where others alone have a sign: of priority.

        Where a sign to give way, a light or ``<priority>`` says who waits, that holds. A sign on
        one approach is for the one straight opposite as well: writers leave that out.
        """
        signs, acting = list(control.signs), []
        approaches: dict[str, set[int]] = {}
        for _, controlled in control.favoured:
            for number in controlled:
                source = self._connections[number].source
                approaches.setdefault(self._nodes.ends[source], set()).add(source)
        for node, favoured in approaches.items():
            numbers = self._by_node[node]
            junctions = [self._odr.junctions[name] for name in self._nodes.xodr.get(node, ())]
            settled = any(control.signs[n] or control.lights[n] for n in numbers)
            if settled or not junctions or any(junction.priorities for junction in junctions):
                continue
            first = favoured
            if len(favoured) == 1:
                first = favoured | self._find_opposite_edges(next(iter(favoured)), numbers)
            waiting = [n for n in numbers if self._connections[n].source not in first]
            for number in waiting:
                signs[number] = Sign.YIELD
            if waiting:
                acting.append(node)
        kept = tuple(
            (element, numbers)
            for element, numbers in control.favoured
            if any(self._nodes.ends[self._connections[n].source] in acting for n in numbers)
        )
        return control._replace(signs=tuple(signs), favoured=kept)

    def _find_opposite_edges(self, edge: int, numbers: Sequence[int]) -> set[int]:
        """Edges that come to a junction straight towards another one."""
        own = self._lane_lines[edge][0].headings()[1]
        others = {self._connections[n].source for n in numbers} - {edge}
        return {
            other
            for other in others
            if abs(wrapped(self._lane_lines[other][0].headings()[1] - own)) > OPPOSING
        }

    # Persons

    def _walk_junctions(self) -> list[NetJunction]:
        return [
            replace(junction, incoming=tuple(self._walked.get(junction.id, ())))
            for junction in self._walks.junctions
        ]


def _positions_by_value(values: Sequence[str]) -> dict[str, list[int]]:
    """Positions of each value."""
    found: dict[str, list[int]] = {}
    for position, value in enumerate(values):
        found.setdefault(value, []).append(position)
    return found
