"""Junctions: nodes that are one place, how far streets end before it, and who may turn where."""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import shapely

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from odscen.maps.importers.osm.street_line import Pose, StreetLine
    from odscen.maps.importers.osm.street_network import Street, StreetNetwork
    from odscen.maps.importers.osm.street_tags import CrossSection, StreetLane

REACH = 70.0
"""Metres of a street from a junction that are looked at."""
MOST_CUT = 45.0
"""Metres before a junction where its street ends at most."""
LEAST_CUT = 2.0
SHORTEST = 3.0
"""Metres of a street that stay between two junctions."""
JOINED_WITHIN = 35.0
"""Metres of a street between two junctions that may become one."""
LIT_WITHIN = 30.0
"""The same where both have lights."""
WIDEST = 75.0
"""Metres between nodes of one junction at most."""
CORNER_RADIUS = 6.0
"""Metres, of the kerb at corners."""
STRAIGHT_ON = math.radians(40)
"""Turns by less than this count as straight on."""
BACK = math.radians(150)
"""Turns by more than this lead back."""


class Leg(NamedTuple):
    """The end of a street at a junction."""

    street: int
    at_end: bool


@dataclass(eq=False, slots=True)
class Junction:
    """Nodes that are one place.

    Attributes
    ----------
    inner
        Streets between its nodes, which become part of it.
    legs
        Ends of the other streets there, counter-clockwise.
    """

    number: int
    nodes: set[int]
    inner: list[int] = field(default_factory=list)
    legs: list[Leg] = field(default_factory=list)


@dataclass(eq=False, slots=True)
class Layout:
    """Junctions of a network, and what they leave of its streets.

    Attributes
    ----------
    cuts
        By leg: metres between its node and the end of its road.
    bare
        The same without the rounding of corners: it cannot be less.
    """

    junctions: list[Junction]
    cuts: dict[Leg, float]
    bare: dict[Leg, float]


def is_ring(network: StreetNetwork, street: Street) -> bool:
    """Whether a street is of a roundabout."""
    tags = network.ways[street.stretches[0].way].tags
    return tags.get("junction") in ("roundabout", "circular")


def _level_of(network: StreetNetwork, street: Street) -> tuple[str, ...]:
    tags = network.ways[street.stretches[0].way].tags
    return tuple(tags.get(key, "") for key in ("layer", "bridge", "tunnel"))


def end_section(network: StreetNetwork, street: Street, *, at_end: bool) -> CrossSection:
    """The cross-section at an end of a street, as the street runs."""
    return network.section(street.stretches[-1 if at_end else 0])


def lay_out(
    network: StreetNetwork, *, lit: Iterable[int], keep: Callable[[Street], bool]
) -> Layout:
    """Join nodes to junctions and cut streets back before them.

    Streets so short that nothing is left of them between two junctions become part of one.

    Parameters
    ----------
    lit
        Nodes with traffic signals, or just behind one.
    keep
        Whether a street must stay a street however short it is.
    """
    lights = set(lit)
    parent = {node: node for node in network.ends}

    def find(node: int) -> int:
        while parent[node] != node:
            parent[node] = parent[parent[node]]
            node = parent[node]
        return node

    extent = {node: [network.places[node]] for node in network.ends}
    degree = {node: len(ends) for node, ends in network.ends.items()}

    def join(first: int, second: int) -> bool:
        """Make two junctions one, unless that is too large."""
        a, b = sorted((find(first), find(second)))
        if a == b:
            return False
        both = np.array(extent[a] + extent[b])
        if np.hypot(*np.ptp(both, axis=0)) > WIDEST:
            return False
        parent[b] = a
        extent[a] += extent.pop(b)
        return True

    known: dict[frozenset[int], tuple[Junction, dict[Leg, tuple[float, float]]]] = {}
    while True:
        layout = _cut_streets(network, find, known)
        joined = False
        for street in network.streets:
            first, last = street.nodes[0], street.nodes[-1]
            if find(first) == find(last) or keep(street) or is_ring(network, street):
                continue
            if degree[first] < 3 or degree[last] < 3:
                continue
            if any(_level_of(network, street)):
                continue
            length = street.line.length
            needs = [min(layout.cuts[Leg(street.number, at_end)], 18.0) for at_end in (False, True)]
            both_lit = first in lights and last in lights and length < LIT_WITHIN
            if length < JOINED_WITHIN and (length < sum(needs) + SHORTEST or both_lit):
                joined |= join(first, last)
        if not joined:
            break

    # What two junctions take of a street that stays must leave some of it.
    for street in network.streets:
        legs = [Leg(street.number, False), Leg(street.number, True)]
        if not all(leg in layout.cuts for leg in legs):
            continue
        taken = sum(layout.cuts[leg] for leg in legs)
        room = max(street.line.length - SHORTEST, 0.4 * street.line.length)
        if taken > room:
            for leg in legs:
                layout.cuts[leg] *= room / taken
    return layout


def _cut_streets(
    network: StreetNetwork,
    find: Callable[[int], int],
    known: dict[frozenset[int], tuple[Junction, dict[Leg, tuple[float, float]]]],
) -> Layout:
    """Make the junctions of groups of nodes; ``known`` keeps them from one time to the next."""
    groups: dict[int, set[int]] = defaultdict(set)
    for node in network.ends:
        groups[find(node)].add(node)
    junctions: list[Junction] = []
    cuts: dict[Leg, float] = {}
    bare: dict[Leg, float] = {}
    for number, (_, nodes) in enumerate(sorted(groups.items())):
        key = frozenset(nodes)
        if key not in known:
            known[key] = _make_junction(network, nodes)
        junction, ends = known[key]
        junction.number = number
        for leg, (cut, least) in ends.items():
            cuts[leg], bare[leg] = cut, least
        junctions.append(junction)
    return Layout(junctions, cuts, bare)


def _make_junction(
    network: StreetNetwork, nodes: set[int]
) -> tuple[Junction, dict[Leg, tuple[float, float]]]:
    junction = Junction(0, nodes)
    for node in sorted(nodes):
        for street_number, at_end in network.ends[node]:
            street = network.streets[street_number]
            inside = {street.nodes[0], street.nodes[-1]} <= nodes
            if inside and street.nodes[0] != street.nodes[-1] and not is_ring(network, street):
                if not at_end:
                    junction.inner.append(street_number)
            else:
                junction.legs.append(Leg(street_number, at_end))
    _order_legs(network, junction)
    return junction, _cut_legs(network, junction)


def _pose_outward(network: StreetNetwork, leg: Leg, distance: float) -> Pose:
    """The pose of a street so far from its node, looking away from the junction."""
    line = network.streets[leg.street].line
    if leg.at_end:
        return line.pose(line.length - distance).back()
    return line.pose(distance)


def _order_legs(network: StreetNetwork, junction: Junction) -> None:
    """Order legs counter-clockwise around the middle of the junction."""
    middle = np.mean([network.places[node] for node in sorted(junction.nodes)], axis=0)

    def angle(leg: Leg) -> tuple[float, Leg]:
        length = network.streets[leg.street].line.length
        pose = _pose_outward(network, leg, min(15.0, 0.6 * length))
        if len(junction.nodes) == 1:
            start = _pose_outward(network, leg, 0.0)
            return math.atan2(pose.y - start.y, pose.x - start.x), leg
        return math.atan2(pose.y - middle[1], pose.x - middle[0]), leg

    junction.legs.sort(key=angle)


def _strip_of_leg(network: StreetNetwork, leg: Leg) -> shapely.Polygon:
    """The carriageway of a leg up to :data:`REACH`, without sidewalks, from its node outwards."""
    street = network.streets[leg.street]
    right, left = carriageway_edges(end_section(network, street, at_end=leg.at_end))
    length = min(REACH, street.line.length)
    s = np.linspace(0.0, length, max(2, int(length / 2.0) + 1))
    if leg.at_end:
        s = street.line.length - s
    low, high = street.line.places(s, right), street.line.places(s, left)
    return shapely.Polygon(np.vstack([low, high[::-1]])).buffer(0)


def carriageway_edges(section: CrossSection) -> tuple[float, float]:
    """The right and the left edge of what vehicles use, from the line of the way."""
    beside = ("sidewalk", "parking")  # parking ends before junctions
    right = sum(lane.width for lane in section.right if lane.kind not in beside)
    left = sum(lane.width for lane in section.left if lane.kind not in beside)
    return section.offset - right, section.offset + left


def _cut_legs(network: StreetNetwork, junction: Junction) -> dict[Leg, tuple[float, float]]:
    """How far before a junction the road of each leg ends, with and without rounded corners."""
    legs = junction.legs
    if len(legs) + len(junction.inner) <= 1:
        return dict.fromkeys(legs, (0.0, 0.0))
    strips = [_strip_of_leg(network, leg) for leg in legs]
    inner = [network.streets[number] for number in junction.inner]
    inner_area = shapely.union_all(
        [
            shapely.LineString(street.line.places(np.linspace(0, street.line.length, 9))).buffer(
                1.5
            )
            for street in inner
        ]
    )
    cuts = {}
    for i, leg in enumerate(legs):
        line = network.streets[leg.street].line
        cut = least = LEAST_CUT

        own = _pose_outward(network, leg, 12.0)
        for j, other in enumerate(legs):
            if i == j:
                continue
            there = _pose_outward(network, other, 12.0)
            between = abs(math.remainder(own.hdg - there.hdg, 2 * math.pi))
            area = strips[i].intersection(strips[j])
            far = _reach_along(line, leg, area) if area.area > 0.05 else 0.0
            least = max(least, far)
            # Neighbours have a corner between them.
            neighbours = abs(i - j) in (1, len(legs) - 1)
            if neighbours and far > 0.0 and math.radians(20) < between < math.radians(150):
                far += min(CORNER_RADIUS / math.tan(between / 2), 9.0)
            cut = max(cut, far)
        if inner:
            least = max(least, _reach_along(line, leg, strips[i].intersection(inner_area)) + 1.0)
        cuts[leg] = (min(max(cut, least), MOST_CUT), min(least, MOST_CUT))
    return cuts


def _reach_along(line: StreetLine, leg: Leg, area: shapely.Geometry) -> float:
    """How far along a leg, from its node, an area extends."""
    if area.is_empty:
        return 0.0
    s = line.project_all(shapely.get_coordinates(area))
    return line.length - float(s.min()) if leg.at_end else float(s.max())


# ------------------------------------------------------------------ movements


class Approach(NamedTuple):
    """A leg with traffic to or from a junction.

    Attributes
    ----------
    lanes
        That arrive (or leave), from the divider outwards: position in the list of the side, and the
        lane.
    pose
        Of the divider at the end of the road, as traffic there looks.
    """

    leg: Leg
    lanes: tuple[StreetLane, ...]
    pose: Pose

    def centre(self, index: int) -> Pose:
        """The pose of the middle of a lane."""
        before = sum(lane.width for lane in self.lanes[:index])
        return self.pose.left(-(before + self.lanes[index].width / 2))


class Movement(NamedTuple):
    """A lane to a lane, by their places from the divider outwards.

    Attributes
    ----------
    turn
        Radians, positive to the left.
    through
        Nodes inside the junction that it passes, first and last ones too.
    """

    start: Approach
    lane: int
    end: Approach
    target: int
    turn: float
    through: tuple[int, ...]


class Refusal(NamedTuple):
    """A relation that forbade a turn here."""

    relation: int


def leg_node(network: StreetNetwork, leg: Leg) -> int:
    """The node at which a leg ends."""
    street = network.streets[leg.street]
    return street.nodes[-1 if leg.at_end else 0]


def leg_way(network: StreetNetwork, leg: Leg) -> int:
    """The way that a leg ends with."""
    street = network.streets[leg.street]
    return street.stretches[-1 if leg.at_end else 0].way


class _Step(NamedTuple):
    """A drive along a street inside a junction, or onto a leg out of it."""

    way: int
    node: int
    street: int
    last: bool


def find_paths(
    network: StreetNetwork, junction: Junction, start: Leg, applied: set[int]
) -> dict[Leg, tuple[int, ...]]:
    """The legs that traffic of a leg can reach, each with the nodes on the shortest path.

    Restrictions hold along the path. ``applied`` gets the relations that forbade something.
    """
    first = leg_way(network, start)
    begin = leg_node(network, start)
    # Ways with one direction are driven along it only.
    steps: dict[int, list[tuple[_Step, float]]] = defaultdict(list)
    for number in junction.inner:
        street = network.streets[number]
        section = end_section(network, street, at_end=False)
        ends = (street.nodes[0], street.nodes[-1])
        for lanes, (a, b) in ((section.right, ends), (section.left, ends[::-1])):
            if any(lane.carries_cars for lane in lanes):
                way = street.stretches[0 if a == ends[0] else -1].way
                steps[a].append((_Step(way, b, number, False), street.line.length))
    for leg in junction.legs:
        street = network.streets[leg.street]
        section = end_section(network, street, at_end=leg.at_end)
        leaving = section.left if leg.at_end else section.right
        if any(lane.carries_cars for lane in leaving):
            node = leg_node(network, leg)
            steps[node].append((_Step(leg_way(network, leg), node, leg.street, True), 0.0))
    found: dict[Leg, tuple[int, ...]] = {}
    # Paths in order of their length; few nodes, so that all of them may be looked at.
    open_paths: list[tuple[float, tuple[int, ...], tuple[int, ...], tuple[int, ...]]] = [
        (0.0, (begin,), (first,), (start.street,))
    ]
    tried = 0
    while open_paths and tried < 2000:
        open_paths.sort()
        length, nodes, ways, streets = open_paths.pop(0)
        tried += 1
        for step, metres in steps[nodes[-1]]:
            new_ways = (*ways, step.way)
            if step.last and step.street == start.street:
                continue
            blocked = _find_forbidding_way(network, new_ways, nodes)
            if blocked is not None:
                applied.add(blocked)
                continue
            if step.last:
                reached = [
                    leg
                    for leg in junction.legs
                    if leg.street == step.street and leg_node(network, leg) == step.node
                ]
                for leg in reached:
                    found.setdefault(leg, nodes)
            elif step.node not in nodes:
                open_paths.append(
                    (length + metres, (*nodes, step.node), new_ways, (*streets, step.street))
                )
    return found


def _find_forbidding_way(
    network: StreetNetwork, ways: Sequence[int], nodes: Sequence[int]
) -> int | None:
    """The restriction against the last step of a path; ``nodes`` lie between its ways."""
    for turn in network.turns:
        if turn.via_node is not None:
            if ways[-2] in turn.origin and nodes[-1] == turn.via_node:
                if turn.only and ways[-1] not in turn.target and ways[-1] != ways[-2]:
                    return turn.relation
                if not turn.only and ways[-1] in turn.target:
                    return turn.relation
        else:
            chain = _without_repeats(ways)
            size = len(turn.via_ways)
            if len(chain) >= size + 2 and chain[-size - 2] in turn.origin:
                same = tuple(chain[-size - 1 : -1]) in (turn.via_ways, turn.via_ways[::-1])
                if same and turn.only and chain[-1] not in turn.target:
                    return turn.relation
                if same and not turn.only and chain[-1] in turn.target:
                    return turn.relation
    return None


def _without_repeats(ways: Sequence[int]) -> list[int]:
    return [way for i, way in enumerate(ways) if i == 0 or way != ways[i - 1]]


_IDEAL = {
    "reverse": 170.0,
    "sharp_left": 130.0,
    "left": 85.0,
    "slight_left": 35.0,
    "through": 0.0,
    "none": 0.0,
    "merge_to_left": 0.0,
    "merge_to_right": 0.0,
    "slight_right": -35.0,
    "right": -85.0,
    "sharp_right": -130.0,
}
"""Turns in degrees, positive to the left, by the values of ``turn:lanes``."""


def choose_exits(
    lanes: Sequence[StreetLane], turns: Sequence[float], counts: Sequence[int]
) -> tuple[list[set[int]], bool]:
    """Which exits each lane leads to.

    Parameters
    ----------
    lanes
        Lanes for cars that arrive, from the left to the right.
    turns
        Of the exits, radians, positive to the left, in descending order.
    counts
        Lanes for cars of each exit.

    Returns
    -------
    tuple
        For each lane the exits, and whether ``turn:lanes`` decided.
    """
    exits = list(range(len(turns)))
    if not exits:
        return [set() for _ in lanes], False
    tokens = [lane.turns for lane in lanes]
    if set().union(*tokens) - {"none", "merge_to_left", "merge_to_right"}:
        values = sorted(set().union(*tokens), key=lambda token: -_IDEAL.get(token, 0.0))
        chosen: dict[str, set[int]] = {value: set() for value in values}
        for place in exits:
            degrees = math.degrees(turns[place])
            # The value whose turn is the nearest; the same turns stay in the order left to right.
            value = min(values, key=lambda v: abs(_IDEAL.get(v, 0.0) - degrees))
            if abs(_IDEAL.get(value, 0.0) - degrees) <= 65.0:
                chosen[value].add(place)
        for value in values:
            if not chosen[value] and value != "reverse":
                # An arrow without a street that fits: the nearest, if it is not absurd.
                place = min(
                    exits, key=lambda e: abs(_IDEAL.get(value, 0.0) - math.degrees(turns[e]))
                )
                if abs(_IDEAL.get(value, 0.0) - math.degrees(turns[place])) <= 100.0:
                    chosen[value].add(place)
        result = [
            set().union(*(chosen[token] for token in lane)) if lane else set() for lane in tokens
        ]
        for i, exits_of_lane in enumerate(result):
            if not exits_of_lane:
                result[i] = {min(exits, key=lambda e: abs(turns[e]))}
        return result, True

    count = len(lanes)
    straight = [e for e in exits if abs(turns[e]) <= STRAIGHT_ON]
    left = [e for e in exits if turns[e] > STRAIGHT_ON]
    right = [e for e in exits if turns[e] < -STRAIGHT_ON]
    result = [set[int]() for _ in lanes]
    if count == 1:
        return [set(exits)], False
    if straight:
        # Straight on from as many lanes as go on there; the others turn.
        room = sum(counts[e] for e in straight)
        most = max(counts[e] for e in straight)
        spare = max(0, count - max(room if len(straight) > 1 else most, 1))
        from_left = spare if left else 0
        if left and right and spare > 1:
            from_left = spare // 2 + spare % 2
        from_right = spare - from_left if right else 0
        for i in range(count):
            if i < from_left:
                result[i] |= set(left)
            elif i >= count - from_right:
                result[i] |= set(right)
            else:
                result[i] |= set(straight)
        result[0] |= set(left)
        result[-1] |= set(right)
        if len(straight) > 1:
            _share_fork(result, straight, counts)
    elif left and right:
        half = count / 2
        for i in range(count):
            result[i] |= set(left) if i + 0.5 < half else set(right)
            if i + 0.5 == half:
                result[i] |= set(left)
    else:
        for i in range(count):
            result[i] |= set(left or right)
        # Only so many lanes as there are turn; the others would lead nowhere, so they merge.
    return result, False


def _share_fork(result: list[set[int]], straight: Sequence[int], counts: Sequence[int]) -> None:
    """Where a road forks, lanes go to the branches from the left to the right."""
    going = [i for i, exits in enumerate(result) if exits & set(straight)]
    total = sum(counts[e] for e in straight)
    bounds = np.cumsum([0, *(counts[e] for e in straight)]) * len(going) / max(total, 1)
    for position, i in enumerate(going):
        own = {
            e
            for k, e in enumerate(straight)
            if bounds[k] < position + 1 - 1e-6 and bounds[k + 1] > position + 1e-6
        }
        result[i] = (result[i] - set(straight)) | own


def match_lanes(
    coming: Sequence[int], going: Sequence[int], turn: float, *, from_left: bool
) -> list[tuple[int, int]]:
    """Pairs of lanes that a movement joins, both listed from the left to the right.

    Left turns keep to the left, right turns to the right; where more lanes arrive than leave, the
    last ones merge.
    """
    count, room = len(coming), len(going)
    if not count or not room:
        return []
    if turn > STRAIGHT_ON or (abs(turn) <= STRAIGHT_ON and from_left):
        return [(lane, going[min(i, room - 1)]) for i, lane in enumerate(coming)]
    shift = room - count
    return [(lane, going[max(i + shift, 0)]) for i, lane in enumerate(coming)]
