"""The trips of matrices and of background traffic, each drawn on its own (R44, R46 to R48).

Members of a matrix row, and of background traffic, are drawn from a stream of random numbers named
by the scenario's seed and the row: adding rows, actors or flows changes nothing for the others, and
more trips in a row leave its first ones as they were.

When a trip begins is random, and with arrivals at random the number of trips of a row, too. Where
it begins and ends in its zones is spread evenly (:class:`EvenShares`): a quarter of an hour has one
or two trips of a row, and drawn each on its own they would lie on other roads with each seed, by
more than the counts of these roads may be off.

Drawn for each trip by the seed and its id, so that other trips change nothing, but for one thing:
where no place is left for a car to begin from, it begins elsewhere.

Places are dealt out to cars that begin and cars that end in the area, in proportion to the shares
of both: a place that is promised to a trip must not be taken by another when it is due.
"""

from __future__ import annotations

from bisect import bisect_right, insort
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.scenario.demand.day_profiles import curve
from odscen.scenario.demand.expected_users import refuse_too_many
from odscen.scenario.demand.zones import zone_segments
from odscen.scenario.document.distributions import stream
from odscen.scenario.document.sampling_config import PlacingRules
from odscen.scenario.placing.bodies import Crowd, body_of, box_at
from odscen.scenario.placing.sampled_places import place_at_random, vehicle_supply

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from odscen.base.arrays import BoolArray, FloatArray, Int32Array
    from odscen.base.categories import Category
    from odscen.lanegraph.graphs import LaneGraph
    from odscen.lanegraph.parking_areas import ParkingArea
    from odscen.lanegraph.shortest_paths import Router
    from odscen.scenario.demand.zones import TripEnds
    from odscen.scenario.document.scenario_document import (
        Background,
        Matrix,
        Scenario,
        TripParking,
        Window,
    )
    from odscen.scenario.placing.region import Region, Usable


LEAST_STAY = 1.0
"""Seconds: SUMO needs a step to park in."""


class Parked(NamedTuple):
    """An area of the map, and seconds that a car stays in it."""

    area: ParkingArea
    stay: float


class ParkableTrip(NamedTuple):
    """A trip by car that may park.

    Attributes
    ----------
    start, goal
        Nodes of the lane graph.
    depart
        Seconds.
    begins, ends
        Whether it may begin, and end, in a parking place.
    near_start, near_goal
        Whether that has to be near its start, and its goal.
    """

    id: str
    start: int
    goal: int
    depart: float
    begins: bool
    ends: bool
    near_start: bool
    near_goal: bool


class ParkedTrip(NamedTuple):
    """Where a trip begins and ends parked; ``missed`` counts ends for which there was no place."""

    begin: Parked | None = None
    end: Parked | None = None
    missed: int = 0


class ParkingChoice:
    """Chooses areas for the trips of a scenario.

    Parameters
    ----------
    areas
        Those that the simulator has.
    lanes
        The lane graph.
    router
        Paths inside the region that the simulator has.
    """

    def __init__(
        self, scenario: Scenario, areas: Iterable[ParkingArea], lanes: LaneGraph, router: Router
    ) -> None:
        self._scenario = scenario
        self._lanes = lanes
        self._how = scenario.demand.parking
        self._router = router
        self.areas = tuple(area for area in areas if router.mask[area.node])
        self._nodes = np.array([area.node for area in self.areas], dtype=np.int32)
        places = np.array([len(area.places) for area in self.areas], dtype=np.int32)
        self._first = _places_to_begin(places, self._how)
        self._last = places - self._first if self._how.end else 0 * places
        self._left: list[list[float]] = [[] for _ in self.areas]

    def choose(self, trips: Sequence[ParkableTrip]) -> dict[str, ParkedTrip]:
        """Choose for all trips, in the order of their departure; those that park, by id."""
        if not self.areas or not trips:
            return {}
        starts, goals = (
            np.array([getattr(trip, key) for trip in trips], dtype=np.int32)
            for key in ("start", "goal")
        )
        onto, from_starts = self._router.reach(starts, self._nodes)
        rows, table = self._router.reach(self._nodes, np.unique(goals))
        to_goals = table[rows]
        columns = np.searchsorted(np.unique(goals), goals)
        rows, table = self._router.reach(self._nodes, self._nodes)
        between = table[rows]
        parked_trips: dict[str, ParkedTrip] = {}
        for at in sorted(range(len(trips)), key=lambda at: (trips[at].depart, trips[at].id)):
            parked_trip = self._choose_for_trip(
                trips[at], from_starts[onto[at]], to_goals[:, columns[at]], between
            )
            if parked_trip != ParkedTrip():
                parked_trips[trips[at].id] = parked_trip
        return parked_trips

    def _choose_for_trip(
        self, trip: ParkableTrip, reached: BoolArray, leads: BoolArray, between: BoolArray
    ) -> ParkedTrip:
        rng = stream(self._scenario.seed, "parking", trip.id)
        uniform = rng.random(4).tolist()
        stays = [max(round(self._how.stay.draw(rng), 1), LEAST_STAY) for _ in range(2)]
        first = last = None
        missed = 0
        if trip.begins and uniform[0] < self._how.begin:
            near = self._areas_near(trip.start) if trip.near_start else True
            free = np.array([self._has_room(k, trip.depart - stays[0]) for k in range(len(leads))])
            first = self._draw_area(leads & near & free, uniform[1], self._first)
            missed += first is None
            if first is not None:
                insort(self._left[first], trip.depart)
        if trip.ends and uniform[2] < self._how.end:
            good = reached.copy() if first is None else between[first].copy()
            good &= self._areas_near(trip.goal) if trip.near_goal else True
            if first is not None:
                good[first] = False
            last = self._draw_area(good, uniform[3], self._last)
            missed += last is None
        return ParkedTrip(
            None if first is None else Parked(self.areas[first], stays[0]),
            None if last is None else Parked(self.areas[last], stays[1]),
            missed,
        )

    def _has_room(self, row: int, since: float) -> bool:
        """Whether a place is free from ``since`` on of cars that leave later than that."""
        there = self._left[row]
        return len(there) - bisect_right(there, since) < int(self._first[row])

    def _areas_near(self, node: int) -> BoolArray:
        lanes = self._lanes
        away = np.hypot(lanes.x[self._nodes] - lanes.x[node], lanes.y[self._nodes] - lanes.y[node])
        near: BoolArray = np.less_equal(away, self._how.within)
        return near

    @staticmethod
    def _draw_area(good: BoolArray, uniform: float, places: Int32Array) -> int | None:
        """Draw one of the areas, by the number of their places."""
        sums = np.cumsum(np.where(good, places, 0))
        if sums[-1] <= 0:
            return None
        return int(np.searchsorted(sums, uniform * sums[-1], side="right"))


def _places_to_begin(places: Int32Array, how: TripParking) -> Int32Array:
    """Places of each area that cars may begin in; one at least is left to those that end."""
    if how.begin <= 0.0:
        return 0 * places
    share = how.begin / (how.begin + how.end)
    own = np.ceil(places * share).astype(np.int32)
    return np.minimum(own, places - 1) if how.end > 0.0 else places


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
            (self._share_at(0, STARTS) + trips * STARTS[0]) % 1.0,
            (self._share_at(1, GOALS) + trips * GOALS[0]) % 1.0,
        )

    def whole(self, number: float) -> int:
        """Trips of a row: whole, and on average over rows the number asked for."""
        return int(number) + int(self._share_at(2, PARTS) % 1.0 < number % 1.0)

    def _share_at(self, which: int, steps: Sequence[float]) -> float:
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
    zones = zone_segments(scenario.demand)
    names = [
        *(zone.id for zone in scenario.demand.zones),
        *map(str, ground.region.graph.segments.ids),
    ]
    order = {name: row for row, name in reversed(tuple(enumerate(names)))}
    mix = ",".join(sorted(matrix.mix))
    (part,) = stream(scenario.seed, "parts", mix).random(1).tolist()
    for origin, destination, number in matrix.trips:
        rng = stream(scenario.seed, "trips", matrix.id, origin, destination)
        start = stream(scenario.seed, "starts", mix, origin).random()
        goal = stream(scenario.seed, "goals", mix, destination).random()
        row = (order.get(origin, 0), order.get(destination, 0), matrix.begin / QUARTER)
        yield _draw_trips(
            scenario,
            ground,
            matrix,
            rng,
            EvenShares((start, goal, part), row),
            name=f"{matrix.id}.{origin}-{destination}",
            number=number,
            between=(zones.get(origin, (origin,)), zones.get(destination, (destination,))),
        )


def background_trips(
    scenario: Scenario, ground: TripEnds, background: Background, usable: Usable
) -> Iterable[Trips]:
    """Yield the trips of background traffic: those on the road at its start, then those to come."""
    rng = stream(scenario.seed, "background", background.id)
    if background.trips is not None:
        number = background.trips
    else:
        standing = _standing_number(ground, background, usable)
        if background.begin == 0:
            yield _first_crowd(scenario, ground, background, usable, standing)
        begin, end = window(scenario, background)
        day = curve(scenario.demand, background.profile)
        passed = day.amount(end) - day.amount(begin)
        number = standing * passed / usual_duration(ground, background.mix)
        refuse_too_many({f"background traffic {background.id!r}": number})
    first = tuple(stream(scenario.seed, "places", background.id).random(3).tolist())
    even = EvenShares(first)
    yield _draw_trips(scenario, ground, background, rng, even, name=background.id, number=number)


def poisson_number(uniform: float, mean: float) -> int:
    """Number of a Poisson distribution that a share of it, from 0 to 1, lies at.

    With the same share a larger mean has no smaller number: more trips leave the first ones be.
    """
    from scipy.special import pdtr, pdtrik

    if mean <= 0.0:
        return 0
    # SciPy's inverse is of a continuous number of trips, and undefined at the smallest shares.
    near = float(pdtrik(uniform, mean))
    number = int(near) if near == near else 0
    while pdtr(number, mean) < uniform:
        number += 1
    while number and pdtr(number - 1, mean) >= uniform:
        number -= 1
    return number


def window(scenario: Scenario, part: Window) -> tuple[float, float]:
    """Begin and end of a part of the demand, seconds."""
    end = scenario.simulation.duration if part.end is None else part.end
    return part.begin, end


def usual_duration(ground: TripEnds, mix: Mapping[Category, float]) -> float:
    """Seconds that a trip across the region usually takes, roughly.

    The mean path between random places at the mean limit, times :data:`SLOWER`.
    """
    rng = np.random.default_rng(0)
    category = max(mix, key=lambda category: mix[category])
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


def _draw_trips(
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
    if part.arrivals == "random":
        # A Poisson number of trips, each at a time of its own, is a Poisson process.
        count = poisson_number(float(stream(scenario.seed, "arrivals", name).random()), number)
    else:
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
        mine = np.array([drawn is category for drawn in categories], dtype=np.bool_)
        reach = ground.reachable_ends(category, *between)
        if len(reach.starts):
            picked = (at_start[mine] * len(reach.starts)).astype(np.intp)
            starts[mine], goals[mine] = reach.starts[picked], reach.goals(picked, at_goal[mine])
    met = goals >= 0
    return Trips(
        name=name,
        part=part.id,
        categories=[category for category, ok in zip(categories, met.tolist(), strict=True) if ok],
        starts=starts[met],
        goals=goals[met],
        departs=departs[met],
        unmet=int(np.sum(~met)),
        why="" if met.all() else "there is no place to start or no path",
    )


def _standing_number(ground: TripEnds, background: Background, usable: Usable) -> float:
    """Vehicles that background traffic is to keep on the road, on average."""
    if background.fill is not None:
        supply = vehicle_supply(ground.region, PlacingRules(), background.mix, usable)
        return background.fill * len(supply.fit)
    lanes = ground.region.graph.lanes
    kilometres = len(
        ground.starts(max(background.mix, key=lambda category: background.mix[category]))
    )
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
    placed = _gather_placed_crowd(scenario, ground.region, usable)
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


def _gather_placed_crowd(scenario: Scenario, region: Region, usable: Usable) -> Crowd:
    """Placed actors who are there from the start, with a gap about them."""
    placed = [
        (place, actor, body_of(actor) if actor.size else usable.bodies[actor.category])
        for actor in scenario.actors
        if actor.depart < FIRST and (place := region.place(actor.spawn)) is not None
    ]
    bodies = (*usable.bodies.values(), *(body for _, _, body in placed))
    crowd = Crowd(2 * max(body.length + body.width for body in bodies))
    for number, (place, actor, body) in enumerate(placed):
        box = box_at(
            region.nodes_of(place),
            place.node,
            body,
            lateral_offset=actor.lateral_offset,
            longitudinal_offset=actor.longitudinal_offset,
            gap=PlacingRules().minimum_gap,
        )
        crowd.add(number, box)
    return crowd
