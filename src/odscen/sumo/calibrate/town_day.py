"""A day of traffic on a whole town, as much as its junctions carry.

Trips are drawn anywhere; of those whose route leads past a junction that would be too busy in the
busiest hour, fewer are made, and more of the others.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy import sparse

from odscen.base.errors import InputError
from odscen.lanegraph.segments import segment_name
from odscen.scenario.demand.count_stations import StationFinder, transitions
from odscen.scenario.demand.day_profiles import DAY, Curve, known_profiles
from odscen.scenario.document.scenario_document import Background, Demand
from odscen.scenario.placing.region import Region
from odscen.sumo.realize.lights.light_views import scenario_lights
from odscen.sumo.realize.passages import each_passing
from odscen.sumo.realize.realization import all_road_users

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.base.arrays import FloatArray
    from odscen.base.categories import Category
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.realize.road_user import RoadUser
    from odscen.sumo.realize.sumo_map import SumoMap

TOWN_MIX = {"car": 80, "van": 8, "truck": 4, "bus": 2, "motorcycle": 3, "bicycle": 3}
"""Vehicles of a town by kind, per cent: cars by far, set by hand."""

SAMPLE = 12_000
"""Trips anywhere whose routes are looked at."""
SATURATION = 1800.0
"""Vehicles per hour that a lane lets off while it has green, the textbook's value."""
LOST = 0.2
"""Share of the time in which no approach has green, or no vehicle uses a gap."""
MEETING = 600.0
"""Vehicles per hour that a junction without a light carries in all if its approaches have one lane
each: above that, approaches of which none has priority gridlock in SUMO."""
SPARE = 0.7
"""Share of what an approach to a junction carries that a day's demand uses of it at most."""
ROUNDS = 200
"""Rounds of making fewer trips past busy junctions and more elsewhere."""
OFTEN = 5.0
"""Times as often as on average that a trip is made at most, however free its route is."""
STEP = 0.9
"""Times the trips, if the junctions do not carry so many."""
_MOST = 20_000.0
"""Trips an hour anywhere at most, where no junction limits them."""


class Load(NamedTuple):
    """How much a day's demand asks of the busiest approach to a junction, in the busiest hour.

    ``volume`` and ``capacity`` are vehicles per hour at ``place``.
    """

    trips: float
    peak_trips: float
    place: str
    volume: float
    capacity: float

    def times(self, factor: float) -> Load:
        """What so many times the trips ask."""
        return self._replace(
            trips=self.trips * factor,
            peak_trips=self.peak_trips * factor,
            volume=self.volume * factor,
        )


def town_day(
    scenario: Scenario, sumo_map: SumoMap, *, trips: float, day: str
) -> tuple[tuple[tuple[str, str, float], ...], Load]:
    """Trips of a day between the segments of a scenario's region.

    Parameters
    ----------
    trips
        How many are wanted; fewer are made if the junctions do not carry so many: if no approach to
        a junction may get more than :data:`SPARE` of what it carries in the busiest hour.
    day
        A built-in day profile.

    Returns
    -------
    Origin, destination and number, sorted, and the load.

    Raises
    ------
    InputError
        If no trips are possible on the map.
    """
    users, uses, capacity, places = _sample_day(scenario, sumo_map, TOWN_MIX)
    share = peak_share(day)
    weights = balanced(uses, SPARE * capacity, trips * share)
    while weights is None:
        trips = round(STEP * trips, -2)
        weights = balanced(uses, SPARE * capacity, trips * share)
    volume = uses.T @ weights
    busiest = int(np.argmax(volume / capacity))
    load = Load(
        trips,
        trips * share,
        places[busiest],
        float(volume[busiest]),
        float(capacity[busiest]),
    )
    ids, segment = sumo_map.graph.segments.ids, sumo_map.graph.lanes.segment
    numbers: Counter[tuple[str, str]] = Counter()
    for user, weight in zip(users, weights.tolist(), strict=True):
        numbers[str(ids[segment[user.spawn]]), str(ids[segment[user.goal]])] += weight / share
    rows = ((*pair, round(number, 2)) for pair, number in sorted(numbers.items()))
    return tuple(row for row in rows if row[2] > 0), load


def carried_background(
    scenario: Scenario, sumo_map: SumoMap, *, mix: Mapping[Category, float]
) -> float:
    """Random trips an hour with which no approach gets more than :data:`SPARE` of its capacity.

    Raises
    ------
    InputError
        If no trips are possible in the region.
    """
    users, uses, capacity, _ = _sample_day(scenario, sumo_map, mix)
    passed = uses.sum(axis=0) / len(users)
    return SPARE * float(np.min(capacity[passed > 0] / passed[passed > 0], initial=_MOST))


class _SampledTrips(NamedTuple):
    """Trips anywhere in a region.

    ``uses`` is how often each passes each approach to a junction, shape ``(trips, places)``;
    ``capacity`` and ``places`` are those of the approaches.
    """

    users: list[RoadUser]
    uses: sparse.csr_array
    capacity: FloatArray
    places: Sequence[str]


def _sample_day(scenario: Scenario, sumo_map: SumoMap, mix: Mapping[Any, float]) -> _SampledTrips:
    region = Region.of(sumo_map.graph, scenario.roi)
    carried = approach_capacities(sumo_map)
    passing = StationFinder(sumo_map.graph, sorted(carried))
    sample = Background.model_validate({"id": "sample", "trips": SAMPLE, "mix": mix})
    drawn = scenario.model_copy(update={"demand": Demand(background=(sample,))})
    users, _ = all_road_users(drawn, sumo_map, region, until=DAY)
    drivable = region.router_over(sumo_map.drivable)
    routes = sorted(each_passing(users, region, drivable, passing), key=lambda route: route[0].id)
    if not routes:
        raise InputError("no trips are possible on this map")
    uses = sparse.csr_array(
        (
            np.ones(sum(len(passed) for _, passed in routes)),
            [place for _, passed in routes for place, _ in passed],
            np.cumsum([0, *(len(passed) for _, passed in routes)]),
        ),
        shape=(len(routes), len(passing.places)),
    )
    capacity = np.array([carried[place] for place in passing.places])
    return _SampledTrips([user for user, _ in routes], uses, capacity, passing.places)


def balanced(uses: sparse.csr_array, most: FloatArray, total: float) -> FloatArray | None:
    """Weights of trips, ``total`` in sum, with which no place is passed by more than it may be.

    In each round trips are made fewer by how much their busiest place is above its limit, and then
    all are scaled to the total.

    Parameters
    ----------
    uses
        Shape ``(trips, places)``: how often each trip passes each place.
    most
        Shape ``(places,)``.

    Returns
    -------
    Shape ``(trips,)``; ``None`` if that many cannot be reached.
    """
    even = total / uses.shape[0]
    weights = np.full(uses.shape[0], even)
    passes = np.flatnonzero(np.diff(uses.indptr))
    for _ in range(ROUNDS):
        room = most / np.maximum(uses.T @ weights, 1e-9)
        if room.min() >= 1.0 / 1.01 and weights.sum() >= 0.99 * total:
            return weights
        limits = np.ones(len(weights))
        limits[passes] = np.minimum.reduceat(
            np.minimum(room, 1.0)[uses.indices], uses.indptr[passes]
        )
        weights = weights * limits
        weights = np.minimum(weights * (total / weights.sum()), OFTEN * even)
    return None


def peak_share(day: str) -> float:
    """Share of a day's demand that comes in its busiest hour.

    Raises
    ------
    InputError
        If there is no such built-in day profile.
    """
    known = known_profiles(Demand())
    if day not in known:
        raise InputError(f"there is no day profile {day!r}; there are {', '.join(known)}")
    curve = Curve(known[day])
    starts = (60.0 * minute for minute in range(1381))
    return max(curve.amount(start + 3600.0) - curve.amount(start) for start in starts) / DAY


def approach_capacities(sumo_map: SumoMap) -> dict[str, float]:
    """Vehicles per hour that each approach to a junction carries, by its place.

    A lane lets off :data:`SATURATION` vehicles per hour of green, and the stages of a light share
    the time that is not lost. Where three approaches or more meet without a light they share
    :data:`MEETING`; two simply take turns.
    """
    graph = sumo_map.graph
    ids, kinds = graph.segments.ids, graph.segments.kinds
    junctions = {str(name) for name, kind in zip(ids, kinds, strict=True) if kind == "junction"}
    lights = scenario_lights(sumo_map)
    stages = {
        segment_name("junction", name): len(light.green) for light in lights for name in light.names
    }
    before: dict[str, list[str]] = {name: [] for name in junctions}
    for segment, others in transitions(graph).items():
        for other in others & junctions:
            before[other].append(segment)
    lanes = _lanes_between(sumo_map)
    carried: dict[str, float] = {}
    for junction, ones in before.items():
        shared = SATURATION * (1.0 - LOST) / max(stages.get(junction, len(ones)), 1)
        for approach in ones:
            own = lanes[approach, junction] * shared
            if junction not in stages and len(ones) > 2:
                own = lanes[approach, junction] * MEETING / len(ones)
            carried[f"{approach}>{junction}"] = own
    return carried


def _lanes_between(sumo_map: SumoMap) -> Counter[tuple[str, str]]:
    """How many lanes lead from each segment into each other."""
    graph = sumo_map.graph
    lanes, ids = graph.lanes, graph.segments.ids
    crosses = lanes.segment[lanes.source] != lanes.segment[lanes.target]
    source, target = lanes.source[crosses], lanes.target[crosses]
    rows = np.stack([lanes.segment[source], lanes.segment[target], lanes.lane[source]], axis=1)
    pairs = np.unique(rows, axis=0)[:, :2].tolist()
    return Counter((str(ids[one]), str(ids[other])) for one, other in pairs)
