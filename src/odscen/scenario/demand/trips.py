"""The trips of matrices and of background traffic, each drawn on its own (R44, R46 to R48).

Members of a matrix row, and of background traffic, are drawn from a stream of random numbers named
by the scenario's seed and the row: adding rows, actors or flows changes nothing for the others, and
more trips in a row leave its first ones as they were.

When a trip begins is random; where it begins and ends in its zones is spread evenly
(:class:`EvenShares`). A quarter of an hour has one or two trips of a row, and drawn each on its own
they would lie on other roads with each seed, by more than the counts of these roads may be off.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from odscen.scenario.demand.day_profiles import curve
from odscen.scenario.demand.zones import segments_of
from odscen.scenario.document.named_random import stream
from odscen.scenario.document.sampling_config import PlacingRules
from odscen.scenario.placing.bodies import Crowd, box_at
from odscen.scenario.placing.random_places import place_at_random
from odscen.scenario.placing.supply import vehicle_supply

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from odscen.base.arrays import FloatArray, Int32Array
    from odscen.base.categories import Category
    from odscen.scenario.demand.zones import TripEnds
    from odscen.scenario.document.scenario_document import Background, Matrix, Scenario, Window
    from odscen.scenario.placing.region import Region
    from odscen.scenario.placing.usable_nodes import Usable

FIRST = 0.01
"""Seconds after the start at which trips begin at the earliest: at 0 the placed actors appear."""

SLOWER = 1.6
"""Times the free-flow time that a trip of background traffic is taken to last."""

SAMPLE = 400
"""Trips from which the usual length of one is estimated."""


STARTS = (0.7548776662, 0.4142135624, 0.7320508076, 0.2360679775)
"""Steps of the places where trips begin: from trip to trip of a row, from origin to origin, from
destination to destination, from quarter to quarter of an hour. The first of it and of
:data:`GOALS` are those of Roberts' R2 sequence, the others roots whose ratios are irrational."""
GOALS = (0.5698402910, 0.6457513111, 0.3166247904, 0.6055512755)
PARTS = (0.0, 0.1231056256, 0.3588989435, 0.7958315233)
"""Steps of the number that decides whether a part of a trip is one."""
QUARTER = 900.0


@dataclass(frozen=True, slots=True)
class EvenShares:
    """Numbers from 0 to 1 that fill the interval evenly, over the trips of many rows.

    Kronecker sequences: each trip, row and quarter of an hour is an irrational step further, modulo
    1, from a number that the seed draws. So the trips that leave a zone in an hour lie evenly over
    its places, however few each row has, and each row on its own has places that depend on no
    other.

    Attributes
    ----------
    first
        Of the start, the goal and the part of a trip, before any step.
    row
        Steps between rows: of the origin, the destination and the quarter of an hour.
    """

    first: tuple[float, float, float]
    row: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def places(self, count: int) -> tuple[FloatArray, FloatArray]:
        """Return numbers for the starts and the goals of the first trips, shapes ``(count,)``."""
        trips = np.arange(count, dtype=np.float64)
        return (
            (self._at(0, STARTS) + trips * STARTS[0]) % 1.0,
            (self._at(1, GOALS) + trips * GOALS[0]) % 1.0,
        )

    def whole(self, number: float) -> int:
        """Trips of a row: whole, and on average over rows the number asked for."""
        return int(number) + int(self._at(2, PARTS) % 1.0 < number % 1.0)

    def _at(self, which: int, steps: Sequence[float]) -> float:
        far = sum(step * times for step, times in zip(steps[1:], self.row, strict=True))
        return self.first[which] + far


@dataclass(frozen=True, slots=True)
class Trips:
    """Trips of one row or part, in the order of their numbers, arrays of shape ``(n,)``.

    Attributes
    ----------
    name
        Names of the trips are ``<name>.<number>``.
    part
        Id of the part of the demand that they belong to.
    categories
        Of each trip.
    starts, goals
        Node indices: of the pedestrian graph for pedestrians, else of the lane graph.
    departs
        Seconds.
    unmet
        Trips that have no place to start or no path, and why.
    entering
        Whether they drive in at the boundary, instead of setting off from a standstill.
    """

    name: str
    part: str
    categories: Sequence[Category]
    starts: Int32Array
    goals: Int32Array
    departs: FloatArray
    unmet: int = 0
    why: str = ""
    entering: bool = False


def matrix_trips(scenario: Scenario, ground: TripEnds, matrix: Matrix) -> Iterable[Trips]:
    """Yield the trips of each row of a matrix."""
    zones = [zone.id for zone in scenario.demand.zones]
    names = [*zones, *map(str, ground.region.graph.segments.ids)]
    order = {name: row for row, name in reversed(tuple(enumerate(names)))}
    mix = ",".join(sorted(matrix.mix))
    (part,) = stream(scenario.seed, "parts", mix).random(1).tolist()
    for origin, destination, number in matrix.trips:
        rng = stream(scenario.seed, "trips", matrix.id, origin, destination)
        start = stream(scenario.seed, "starts", mix, origin).random()
        goal = stream(scenario.seed, "goals", mix, destination).random()
        row = (order.get(origin, 0), order.get(destination, 0), matrix.begin / QUARTER)
        yield _drawn(
            scenario,
            ground,
            matrix,
            rng,
            EvenShares((start, goal, part), row),
            name=f"{matrix.id}.{origin}-{destination}",
            number=number,
            between=(
                segments_of(scenario.demand, origin),
                segments_of(scenario.demand, destination),
            ),
        )


def background_trips(
    scenario: Scenario, ground: TripEnds, background: Background, usable: Usable
) -> Iterable[Trips]:
    """Yield the trips of background traffic: those on the road at its start, then those to come."""
    rng = stream(scenario.seed, "background", background.id)
    if background.trips is not None:
        number = background.trips
    else:
        standing = _standing(ground, background, usable)
        if background.begin == 0:
            yield _first_crowd(scenario, ground, background, usable, standing)
        begin, end = window(scenario, background)
        day = curve(scenario.demand, background.profile)
        passed = day.amount(end) - day.amount(begin)
        number = standing * passed / usual_duration(ground, background.mix)
    first = tuple(stream(scenario.seed, "places", background.id).random(3).tolist())
    even = EvenShares(first)
    yield _drawn(scenario, ground, background, rng, even, name=background.id, number=number)


def window(scenario: Scenario, part: Window) -> tuple[float, float]:
    """Begin and end of a part of the demand, seconds."""
    end = scenario.simulation.duration if part.end is None else part.end
    return part.begin, end


def usual_duration(ground: TripEnds, mix: Mapping[Category, float]) -> float:
    """Seconds that a trip across the region usually takes, roughly.

    The mean path between random places at the mean limit, times :data:`SLOWER`.
    """
    rng = np.random.default_rng(0)
    category = max(mix, key=lambda one: mix[one])
    starts, ends = ground.starts(category), ground.ends(category)
    router = ground.router_of(category)
    found: list[float] = []
    if len(starts):
        for goal in rng.choice(ends, size=min(len(ends), 20), replace=False).tolist():
            lengths = router.paths_to(goal).distance(rng.choice(starts, size=SAMPLE // 20))
            found += lengths[np.isfinite(lengths)].tolist()
    limits = ground.region.graph.lanes.speed_limit
    limit = float(np.nanmean(limits)) if np.isfinite(limits).any() else 13.89
    return max(SLOWER * float(np.mean(found or [500.0])) / limit, 1.0)


def drawn_categories(mix: Mapping[Category, float], uniform: FloatArray) -> list[Category]:
    """Categories with the shares of a mix, for random numbers from 0 to 1."""
    categories = sorted(mix)
    bounds = np.cumsum([mix[category] for category in categories])
    rows = np.searchsorted(bounds, uniform * bounds[-1], side="right")
    return [categories[min(row, len(categories) - 1)] for row in rows.tolist()]


def _drawn(
    scenario: Scenario,
    ground: TripEnds,
    part: Window,
    rng: np.random.Generator,
    even: EvenShares,
    *,
    name: str,
    number: float,
    between: tuple[tuple[str, ...], tuple[str, ...]] | tuple[()] = (),
) -> Trips:
    count = even.whole(number)
    uniform = rng.random((count, 2))
    at_start, at_goal = even.places(count)
    begin, end = window(scenario, part)
    times = curve(scenario.demand, part.profile).draw(uniform[:, 0], begin=begin, end=end)
    departs = np.maximum(np.round(times, 2), FIRST)
    categories = drawn_categories(part.mix, uniform[:, 1])
    starts = np.full(count, -1, dtype=np.int32)
    goals = np.full(count, -1, dtype=np.int32)
    for category in set(categories):
        mine = np.array([one is category for one in categories], dtype=np.bool_)
        reach = ground.reachable_ends(category, *between)
        if len(reach.starts):
            picked = (at_start[mine] * len(reach.starts)).astype(np.intp)
            starts[mine], goals[mine] = reach.starts[picked], reach.goals(picked, at_goal[mine])
    met = goals >= 0
    return Trips(
        name=name,
        part=part.id,
        categories=[one for one, ok in zip(categories, met.tolist(), strict=True) if ok],
        starts=starts[met],
        goals=goals[met],
        departs=departs[met],
        unmet=int(np.sum(~met)),
        why="" if met.all() else "there is no place to start or no path",
    )


def _standing(ground: TripEnds, background: Background, usable: Usable) -> float:
    """Vehicles that background traffic is to keep on the road, on average."""
    if background.fill is not None:
        supply = vehicle_supply(ground.region, PlacingRules(), background.mix, usable)
        return background.fill * len(supply.fit)
    lanes = ground.region.graph.lanes
    kilometres = len(ground.starts(max(background.mix, key=lambda one: background.mix[one])))
    return (background.per_km or 0.0) * kilometres * lanes.spacing / 1000.0


def _first_crowd(
    scenario: Scenario,
    ground: TripEnds,
    background: Background,
    usable: Usable,
    standing: float,
) -> Trips:
    """Vehicles that are on the road at the start, clear of the placed actors."""
    day = curve(scenario.demand, background.profile)
    now = standing * (day.amount(60.0) - day.amount(0.0)) / 60.0
    rng = stream(scenario.seed, "standing", background.id)
    supply = vehicle_supply(ground.region, PlacingRules(), background.mix, usable)
    spots = place_at_random(supply, round(now), rng)
    numbers = rng.random(len(spots))
    lanes = ground.region.graph.lanes
    placed = _placed_crowd(scenario, ground.region, usable)
    categories, starts, goals = [], [], []
    for spot, number in zip(spots, numbers, strict=True):
        reach = ground.reachable_ends(spot.category)
        picked = np.flatnonzero(reach.starts == spot.node)
        goal = int(reach.goals(picked, np.array([number]))[0]) if len(picked) else -1
        box = box_at(lanes, spot.node, usable.bodies[spot.category])
        if goal >= 0 and placed.is_free(box):
            categories.append(spot.category)
            starts.append(spot.node)
            goals.append(goal)
    return Trips(
        name=f"{background.id}.first",
        part=background.id,
        categories=categories,
        starts=np.array(starts, dtype=np.int32),
        goals=np.array(goals, dtype=np.int32),
        departs=np.zeros(len(starts)),
    )


def _placed_crowd(scenario: Scenario, region: Region, usable: Usable) -> Crowd:
    """Placed actors who are there from the start, with a gap about them."""
    crowd = Crowd(2 * max(body.length + body.width for body in usable.bodies.values()))
    for number, actor in enumerate(scenario.actors):
        place = region.place(actor.spawn)
        if place is not None and actor.depart < FIRST:
            body, offset = usable.bodies[actor.category], actor.lateral_offset
            gap = PlacingRules().minimum_gap
            graph = region.nodes_of(place)
            crowd.add(number, box_at(graph, place.node, body, lateral_offset=offset, gap=gap))
    return crowd
