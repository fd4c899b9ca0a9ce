"""Where vehicles can drive into a region, and those that do: when, on which lane, where to."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from odscen.base.categories import Category
from odscen.lanegraph.graphs import Relation
from odscen.scenario.demand.day_profiles import curve
from odscen.scenario.demand.trips import (
    FIRST,
    Trips,
    drawn_categories,
    poisson_number,
    window,
)
from odscen.scenario.demand.zones import segments_of
from odscen.scenario.document.distributions import stream

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from odscen.base.arrays import FloatArray, Int32Array
    from odscen.scenario.demand.day_profiles import Curve
    from odscen.scenario.demand.zones import TripEnds
    from odscen.scenario.document.scenario_document import Scenario, VehicleInput
    from odscen.scenario.placing.region import Region


Direction = Literal["forward", "backward"]


class EntryLane(NamedTuple):
    """A lane that leads into the region.

    Attributes
    ----------
    lane
        Its OpenDRIVE id.
    node
        Its first node in the region.
    """

    lane: int
    node: int


class Entry(NamedTuple):
    """The lanes of one direction that lead into the region on one segment.

    Attributes
    ----------
    direction
        ``forward`` with growing s of the road.
    lanes
        From the outer edge of the road inwards.
    """

    segment: str
    direction: Direction
    lanes: tuple[EntryLane, ...]


def entries(region: Region) -> tuple[Entry, ...]:
    """Find all entries of a region, by segment (in the order of the map), forward first.

    A lane leads into the region where its node has no predecessor inside, and the lanes beside it
    have none there either: one that begins where the road widens is no entry. Junctions have none.
    Where no lane leads into the region, as in a closed town, lanes that begin behind a junction
    are entries, as of vehicles that come from the ground beside the road. They are found once for
    all that ask for those of a region.
    """
    return region.remembered("entries", lambda: _find_entries(region))


def _find_entries(region: Region) -> tuple[Entry, ...]:
    graph = region.graph
    lanes, ids = graph.lanes, graph.segments.ids
    found: dict[tuple[int, bool], list[EntryLane]] = defaultdict(list)
    at_boundary = _first_nodes(region)
    for group in (at_boundary or _first_nodes(region, behind_junctions=True)).values():
        for node in group:
            if _begin_alone(region, node, group):
                row = int(lanes.lane[node])
                key = int(lanes.segment[node]), bool(lanes.lanes.forward[row])
                found[key].append(EntryLane(lanes.lanes.keys[row].lane, node))
    return tuple(
        Entry(
            str(ids[segment]),
            "forward" if forward else "backward",
            tuple(sorted(found[segment, forward], key=lambda entry_lane: -abs(entry_lane.lane))),
        )
        for segment, forward in sorted(found, key=lambda key: (key[0], not key[1]))
    )


def entries_of(part: VehicleInput, every: Iterable[Entry]) -> list[Entry]:
    """Entries that an input may mean: those of its segment and, if it has one, its direction."""
    return [
        entry
        for entry in every
        if entry.segment == part.segment and part.direction in (None, entry.direction)
    ]


def entry_lanes(part: VehicleInput, entry: Entry) -> tuple[EntryLane, ...]:
    """Lanes of an entry that an input uses, from the outer edge of the road inwards."""
    if not part.lanes:
        return entry.lanes
    return tuple(lane for lane in entry.lanes if lane.lane in part.lanes)


def _first_nodes(
    region: Region, *, behind_junctions: bool = False
) -> dict[tuple[int, bool], list[int]]:
    """Nodes outside junctions without predecessor inside, by section of a road and direction.

    The key is the first row of the lanes of the section. ``behind_junctions`` are those whose
    predecessors inside are in junctions.
    """
    lanes = region.graph.lanes
    inside = region.lanes
    led_to = np.zeros(len(inside), dtype=np.bool_)
    follows = (lanes.relation == Relation.SUCCESSOR) & inside[lanes.source]
    if behind_junctions:
        road = np.array([junction is None for junction in lanes.lanes.junctions], dtype=np.bool_)
        follows &= road[lanes.lane[lanes.source]]
    led_to[lanes.target[follows]] = True
    sections: dict[tuple[str, int], int] = {}
    found: dict[tuple[int, bool], list[int]] = defaultdict(list)
    for node in np.flatnonzero(inside & ~led_to).tolist():
        row = int(lanes.lane[node])
        if lanes.lanes.junctions[row] is None:
            key = lanes.lanes.keys[row]
            section = sections.setdefault((key.road, key.section), len(sections))
            found[section, bool(lanes.lanes.forward[row])].append(node)
    return found


def _begin_alone(region: Region, node: int, firsts: Sequence[int]) -> bool:
    """Whether all lanes beside a first node begin there, too."""
    lanes = region.graph.lanes
    near = 1.5 * lanes.spacing
    begin = {int(lanes.lane[n]) for n in firsts if abs(lanes.s[n] - lanes.s[node]) <= near}
    return all(
        row in begin or not _lane_passes(region, row, float(lanes.s[node]), near)
        for row in _lanes_beside(region, int(lanes.lane[node]))
    )


def _lanes_beside(region: Region, row: int) -> Iterable[int]:
    """Rows of the lanes of the same section and direction."""
    lanes = region.graph.lanes.lanes
    own = lanes.keys[row]
    for step in (-1, 1):
        other = row + step
        while 0 <= other < len(lanes.keys) and lanes.keys[other][:2] == own[:2]:
            if lanes.forward[other] == lanes.forward[row]:
                yield other
            other += step


def _lane_passes(region: Region, row: int, s: float, near: float) -> bool:
    """Whether a lane has a node of the region near ``s``."""
    lanes = region.graph.lanes
    nodes = slice(int(lanes.lanes.first_node[row]), int(lanes.lanes.first_node[row + 1]))
    return bool(np.any(region.lanes[nodes] & (np.abs(lanes.s[nodes] - s) <= near)))


SLICE = 900.0
"""Seconds of the slices in which the vehicles of ``per_hour`` are drawn."""

PEAK_QUARTER = 1
"""Of each hour of an input, counted from 0: the busiest one with a peak hour factor."""

LEAST_HEADWAY = 0.8
"""Seconds between two vehicles on a lane at least; on a lane with more than 2,250 vehicles an hour
half of their mean headway."""

SLOW = frozenset({Category.TRUCK, Category.BUS, Category.BICYCLE})
"""Categories that come on the outermost lane of an input."""


class _Slice(NamedTuple):
    """Slice of time, seconds, and vehicles to come in it."""

    begin: float
    end: float
    number: float


class _InputGoals(NamedTuple):
    """Where the vehicles of an input may go to: nodes, and the share of each."""

    nodes: Int32Array
    shares: FloatArray


def input_trips(scenario: Scenario, ground: TripEnds, part: VehicleInput) -> Iterator[Trips]:
    """Yield the trips of an input, one for each slice of time.

    In each slice as many vehicles come as it says (a fraction is a probability), or with arrivals
    at random as many as a Poisson distribution of that mean has; on all lanes alike, those of
    :data:`SLOW` on the outermost. Headways on a lane are exponential beyond :data:`LEAST_HEADWAY`.
    """
    lanes = _depart_lanes(ground, part)
    for number, piece in enumerate(_slice_input(scenario, part)):
        rng = stream(scenario.seed, "input", part.id, str(number))
        yield _draw_trips(scenario, ground, part, piece, lanes, rng, name=f"{part.id}.{number}")


def _slice_input(scenario: Scenario, part: VehicleInput) -> Iterator[_Slice]:
    """Whole slices, whenever the run ends: a shorter one has the same vehicles up to its end."""
    begin, end = window(scenario, part)
    day = curve(scenario.demand, part.profile)
    length = part.interval if part.volumes else SLICE
    for number, start in enumerate(np.arange(begin, end, length).tolist()):
        stop = start + length
        if not part.volumes:
            passed = day.amount(stop) - day.amount(start)
            if part.peak_hour_factor is not None:
                passed = _quarter_of_hour(day, begin, number, part.peak_hour_factor)
            yield _Slice(start, stop, (part.per_hour or 0.0) * passed / 3600.0)
        elif number < len(part.volumes):
            yield _Slice(start, stop, part.volumes[number])


def _quarter_of_hour(day: Curve, begin: float, number: int, peak_hour_factor: float) -> float:
    """Amount of a quarter: that of its hour, dealt out by the peak hour factor."""
    hour, quarter = divmod(number, 4)
    first = begin + hour * 4 * SLICE
    whole = day.amount(first + 4 * SLICE) - day.amount(first)
    busiest = 0.25 / peak_hour_factor
    return whole * (busiest if quarter == PEAK_QUARTER else (1.0 - busiest) / 3.0)


def _depart_lanes(ground: TripEnds, part: VehicleInput) -> dict[Category, Int32Array]:
    """First node with room for a body on each lane of the input, from the outer lane inwards."""
    mine = entries_of(part, entries(ground.region))
    lanes = ground.region.graph.lanes
    found: dict[Category, Int32Array] = {}
    for category in part.mix:
        starts = ground.starts(category)
        nodes: list[int] = []
        for entry_lane in entry_lanes(part, mine[0]) if mine else ():
            here = starts[
                (lanes.lane[starts] == lanes.lane[entry_lane.node]) & (starts >= entry_lane.node)
            ]
            nodes += here[:1].tolist()
        outermost = nodes[:1] if category in SLOW else nodes
        found[category] = np.array(outermost, dtype=np.int32)
    return found


def _draw_trips(
    scenario: Scenario,
    ground: TripEnds,
    part: VehicleInput,
    piece: _Slice,
    lanes: dict[Category, Int32Array],
    rng: np.random.Generator,
    *,
    name: str,
) -> Trips:
    uniform = float(rng.random())
    if part.arrivals == "random":
        count = poisson_number(uniform, piece.number)
    else:
        count = int(piece.number) + int(uniform < piece.number % 1.0)
    categories = drawn_categories(part.mix, rng.random(count))
    starts = _deal_starts(categories, lanes, rng)
    departs = _spread_departures(starts, piece, rng)
    goals = _draw_goals(scenario, ground, part, categories, starts, rng.random(count))
    in_time = departs < window(scenario, part)[1]
    met = np.flatnonzero((goals >= 0) & in_time)
    order = met[np.lexsort((met, departs[met]))]
    unmet = int(np.sum((goals < 0) & in_time))
    return Trips(
        name=name,
        part=part.id,
        categories=[categories[index] for index in order.tolist()],
        starts=starts[order],
        goals=goals[order],
        departs=departs[order],
        unmet=unmet,
        why="" if not unmet else "there is no place to enter or no path",
        entering=True,
    )


def _deal_starts(
    categories: Sequence[Category],
    lanes: dict[Category, Int32Array],
    rng: np.random.Generator,
) -> Int32Array:
    """Start of each vehicle; -1 without any. Each goes where fewest have been sent so far."""
    sent: dict[int, int] = {}
    starts = np.full(len(categories), -1, dtype=np.int32)
    slow_first = sorted(range(len(categories)), key=lambda index: categories[index] not in SLOW)
    ties = rng.random((len(categories), 1 + max(map(len, lanes.values()), default=0)))
    for index in slow_first:
        nodes = lanes[categories[index]].tolist()
        if nodes:
            tie = ties[index].tolist()
            lane = min(range(len(nodes)), key=lambda at: (sent.get(nodes[at], 0), tie[at]))
            starts[index] = nodes[lane]
            sent[nodes[lane]] = sent.get(nodes[lane], 0) + 1
    return starts


def _spread_departures(starts: Int32Array, piece: _Slice, rng: np.random.Generator) -> FloatArray:
    """Departures in a slice, lane by lane: random, with a least headway."""
    departs = np.zeros(len(starts))
    length = piece.end - piece.begin
    for start in np.unique(starts).tolist():
        mine = np.flatnonzero(starts == start)
        headway = min(LEAST_HEADWAY, 0.5 * length / len(mine))
        free = np.sort(rng.random(len(mine))) * (length - headway * len(mine))
        departs[rng.permutation(mine)] = piece.begin + free + headway * np.arange(len(mine))
    return np.maximum(np.round(departs, 2), FIRST)


def _draw_goals(
    scenario: Scenario,
    ground: TripEnds,
    part: VehicleInput,
    categories: Sequence[Category],
    starts: Int32Array,
    uniform: FloatArray,
) -> Int32Array:
    """Goal of each vehicle: an end of the region, or of the input's destinations; else -1."""
    goals = np.full(len(starts), -1, dtype=np.int32)
    kinds = np.array([list(Category).index(category) for category in categories], dtype=np.intp)
    for start in np.unique(starts[starts >= 0]).tolist():
        reached = ground.router.reachable(start)
        for kind in np.unique(kinds[starts == start]).tolist():
            mine = (starts == start) & (kinds == kind)
            ends = _possible_ends(scenario, ground, part, list(Category)[kind], start)
            shares = np.where(reached[ends.nodes] & (ends.nodes != start), ends.shares, 0.0)
            sums = np.cumsum(shares)
            if len(sums) and sums[-1] > 0:
                picked = np.searchsorted(sums, uniform[mine] * sums[-1], side="right")
                goals[mine] = ends.nodes[np.minimum(picked, len(sums) - 1)]
    return goals


def _possible_ends(
    scenario: Scenario, ground: TripEnds, part: VehicleInput, category: Category, start: int
) -> _InputGoals:
    if not part.to:
        candidates = ground.router.goal_candidates(start)
        return _InputGoals(candidates, np.ones(len(candidates)))
    ends = [ground.ends(category, segments_of(scenario.demand, name)) for name, _ in part.to]
    shares = [
        np.full(len(nodes), share / max(len(nodes), 1))
        for nodes, (_, share) in zip(ends, part.to, strict=True)
    ]
    return _InputGoals(np.concatenate(ends), np.concatenate(shares))
