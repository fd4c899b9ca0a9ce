"""Traffic that reproduces counts: routes through the region, and how often each is used.

Which routes there are comes from the lane graph; how often each is driven is chosen by SUMO's
routeSampler, a linear program for each slice of time. It is given the places of counting as edges
and, as routes, the places that a route passes, so that it needs no network. Turns and flows are
then counted alike.
"""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.atomic_folders import scratch_folder
from odscen.scenario.demand.count_stations import StationFinder
from odscen.scenario.demand.trips import FIRST, Trips, drawn_categories
from odscen.scenario.document.distributions import stream
from odscen.sumo.realize.sumo_tools import run_tool

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from odscen.base.arrays import Int32Array
    from odscen.scenario.demand.zones import TripEnds
    from odscen.scenario.document.scenario_document import Counts, Scenario

WAYS = 200_000
"""Ways that are looked at; where there are more, those between near places and some of the rest."""
OF_A_KIND = 8
"""Ways that are kept of those which pass the same places."""
KINDS_OF_A_PLACE = 40
"""Kinds of routes that are kept for each place: the most frequent, and the shortest."""
FEWER_VEHICLES = "0.05"
"""How much a vehicle weighs against one that is missing in a count: long routes win over short ones
where both meet the counts."""
USUAL_SPEED = 8.0
"""m/s at which vehicles are taken to get from their start to the places of counting."""

PassedStations = tuple[int, ...]
"""Places that a route passes, in order, by their number."""


class StationRoute(NamedTuple):
    """A route that passes count stations.

    Attributes
    ----------
    start, goal
        Nodes of the lane graph; vehicles start anywhere on the same stretch of lane as ``start``.
    segments
        Rows of the segments that are passed.
    lead
        Metres from the start to the middle of the counted places.
    """

    start: int
    goal: int
    segments: tuple[int, ...]
    lead: float


def counted_trips(
    scenario: Scenario,
    ground: TripEnds,
    counts: Counts,
    others: Mapping[tuple[str, float, float], float],
) -> Iterator[Trips]:
    """Yield the trips that make up for what other traffic leaves of the counts.

    Parameters
    ----------
    others
        Vehicles of the rest of the scenario by place, begin and end of the slice.
    """
    passing = StationFinder(ground.region.graph, [row[0] for row in counts.rows])
    kinds = routes_past(ground, counts, passing)
    wanted = [
        (place, begin, end, max(0.0, number - others.get((place, begin, end), 0.0)))
        for place, begin, end, number in counts.rows
    ]
    chosen = _choose_routes(list(kinds), passing, wanted, seed=scenario.seed) if kinds else []
    rng = stream(scenario.seed, "counts", counts.id)
    uniform = rng.random((len(chosen), 3))
    categories = drawn_categories(counts.mix, uniform[:, 0])
    routes = [
        kinds[kind][int(number * len(kinds[kind]))]
        for (kind, _), number in zip(chosen, uniform[:, 1].tolist(), strict=True)
    ]
    times = np.array([time for _, time in chosen]) - np.array([route.lead for route in routes]) / (
        USUAL_SPEED
    )
    yield Trips(
        name=counts.id,
        part=counts.id,
        categories=categories,
        starts=_draw_starts(ground, counts, routes, uniform[:, 2]),
        goals=np.array([route.goal for route in routes], dtype=np.int32),
        departs=np.maximum(np.round(times, 2), FIRST),
    )


def routes_past(
    ground: TripEnds, counts: Counts, passing: StationFinder
) -> dict[PassedStations, list[StationRoute]]:
    """Ways through the region that pass a place of counting, by the places that they pass."""
    segment = ground.region.graph.lanes.segment
    usual = max(counts.mix, key=lambda category: counts.mix[category])
    ends, first = ground.ends(usual), _stretch_starts(ground, ground.starts(usual))
    kinds: dict[PassedStations, list[StationRoute]] = {}
    often: dict[PassedStations, int] = defaultdict(int)
    if not len(ends) or not len(first):
        return {}
    per_goal = max(10, WAYS // len(ends))
    for goal in ends.tolist():
        paths = ground.router.paths_to(goal)
        metres = paths.distance(first)
        near = np.flatnonzero(np.isfinite(metres) & (metres > 0))
        near = near[np.argsort(metres[near], kind="stable")]
        rest = near[per_goal // 2 :]
        thin = max(1, -(-len(rest) // (per_goal - per_goal // 2)))
        sources = first[np.concatenate([near[: per_goal // 2], rest[::thin]])]
        marks, nodes = paths.stretches(sources, segment)
        for start, row, entered in zip(sources.tolist(), marks.tolist(), nodes, strict=True):
            segments = tuple(row[: row.index(-1)] if -1 in row else row)
            found = passing.of(segments)
            kind = tuple(dict.fromkeys(place for place, _ in found))
            if kind:
                often[kind] += 1
                kept = kinds.setdefault(kind, [])
                if len(kept) < OF_A_KIND:
                    middle = entered[found[len(found) // 2][1]]
                    lead = paths.distance(np.array([start, middle]))
                    kept.append(StationRoute(start, goal, segments, float(lead[0] - lead[1])))
    return {kind: kinds[kind] for kind in _select_kinds(often, len(passing.places))}


def _select_kinds(often: Mapping[PassedStations, int], places: int) -> list[PassedStations]:
    """Kinds of routes to choose from, sorted: for each place the most frequent and the shortest."""
    of_place: list[list[PassedStations]] = [[] for _ in range(places)]
    for kind in sorted(often):
        for place in kind:
            of_place[place].append(kind)
    half = KINDS_OF_A_PLACE // 2
    kept: set[PassedStations] = set()
    for mine in of_place:
        kept.update(sorted(mine, key=lambda kind: (-often[kind], kind))[:half])
        kept.update(sorted(mine, key=lambda kind: (len(kind), -often[kind], kind))[:half])
    return sorted(kept)


def _choose_routes(
    kinds: Sequence[PassedStations],
    passing: StationFinder,
    wanted: Sequence[tuple[str, float, float, float]],
    *,
    seed: int,
) -> list[tuple[PassedStations, float]]:
    """Let routeSampler choose: the kind of each vehicle's route, and when it passes, seconds."""
    from lxml import etree

    with scratch_folder() as folder:
        (folder / "ways.rou.xml").write_text(_routes_xml(kinds), encoding="utf-8")
        (folder / "counts.xml").write_text(_counts_xml(passing, wanted), encoding="utf-8")
        run_tool(
            "routeSampler.py",
            [
                *("--route-files", "ways.rou.xml", "--edgedata-files", "counts.xml"),
                *("--output-file", "chosen.rou.xml", "--seed", str(seed), "--optimize", "full"),
                *("--minimize-vehicles", FEWER_VEHICLES),
            ],
            folder=folder,
        )
        chosen = []
        for _, vehicle in etree.iterparse(str(folder / "chosen.rou.xml"), tag="vehicle"):
            edges = vehicle[0].get("edges", "").split()
            kind = tuple(int(edge[1:]) for edge in edges)
            chosen.append((kind, float(vehicle.get("depart", "0"))))
            vehicle.clear()
    return chosen


def _routes_xml(kinds: Sequence[PassedStations]) -> str:
    rows = (
        f'    <route id="{index}" edges="{" ".join(f"p{place}" for place in kind)}"/>'
        for index, kind in enumerate(kinds)
    )
    return "\n".join(["<routes>", *rows, "</routes>", ""])


def _counts_xml(passing: StationFinder, wanted: Sequence[tuple[str, float, float, float]]) -> str:
    number = {place: index for index, place in enumerate(passing.places)}
    slices: dict[tuple[float, float], list[str]] = defaultdict(list)
    for place, begin, end, vehicles in wanted:
        edge = f'        <edge id="p{number[place]}" entered="{vehicles:g}"/>'
        slices[begin, end].append(edge)
    lines = ["<data>"]
    for (begin, end), edges in sorted(slices.items()):
        lines += [f'    <interval id="counts" begin="{begin:g}" end="{end:g}">', *edges]
        lines.append("    </interval>")
    return "\n".join([*lines, "</data>", ""])


def _stretch_starts(ground: TripEnds, starts: Int32Array) -> Int32Array:
    """First start of each lane in each segment."""
    lanes = ground.region.graph.lanes
    pairs = np.stack([lanes.lane[starts], lanes.segment[starts]], axis=1)
    _, first = np.unique(pairs, axis=0, return_index=True)
    return starts[np.sort(first)]


def _draw_starts(
    ground: TripEnds, counts: Counts, routes: Sequence[StationRoute], uniform: np.ndarray
) -> Int32Array:
    """Draw a start for each route: on its stretch of lane, of the same route through segments."""
    lanes = ground.region.graph.lanes
    usual = max(counts.mix, key=lambda category: counts.mix[category])
    starts = ground.starts(usual)
    of_goal: dict[int, set[StationRoute]] = defaultdict(set)
    for route in routes:
        of_goal[route.goal].add(route)
    possible: dict[StationRoute, Int32Array] = {}
    for goal, mine in sorted(of_goal.items()):
        to_goal = ground.router.paths_to(goal)
        for route in sorted(mine):
            beside = lanes.lane[starts] == lanes.lane[route.start]
            beside &= lanes.segment[starts] == lanes.segment[route.start]
            marks, _ = to_goal.stretches(starts[beside], lanes.segment)
            due = np.full(marks.shape[1], -1)
            due[: len(route.segments)] = route.segments[: len(due)]
            same = np.all(marks == due, axis=1)
            possible[route] = starts[beside][same]
    return np.array(
        [
            possible[route][int(number * len(possible[route]))]
            for route, number in zip(routes, uniform.tolist(), strict=True)
        ],
        dtype=np.int32,
    )
