"""Automated generation: a scenario drawn from a configuration, with no user input (R46 to R48).

The same map graph, configuration and seed give the same document, byte for byte. Sampled vehicles
start on road lanes, never on junction lanes, where the lane bends so little that a rigid body keeps
to it, with a gap to every other body, and with a goal that can be reached.

What a scenario leaves open (members of flows and demand, open goals, speed factors, parameters of
driver sets) follows the seed anyway. Placed actors have all of it written down, so that seeds
hardly vary where most of the traffic is placed; this draws it again, by distributions that keep
what they have on average. Where they start is not drawn: places are checked for room.
"""

from __future__ import annotations

import math
from collections import Counter
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, get_args

import numpy as np

from odscen.base.categories import Category
from odscen.base.errors import ScenarioError
from odscen.lanegraph.graphs import LaneGraph
from odscen.scenario.checks.actor_checks import SPEED_MAX, SPEED_MIN
from odscen.scenario.document.distributions import Normal, Uniform, draw_key, draw_place, stream
from odscen.scenario.document.problems import validated
from odscen.scenario.document.scenario_document import (
    Actor,
    Environment,
    MapReference,
    Scenario,
    Simulation,
)
from odscen.scenario.placing.bodies import Box, Crowd, box_at
from odscen.scenario.placing.region import NodePlace, Region, Usable, name_of
from odscen.scenario.placing.sampled_places import place_at_random, vehicle_supply, walker_supply
from odscen.scenario.placing.spawn_room import LANE_MARGIN, Reach

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from odscen.base.arrays import BoolArray
    from odscen.base.categories import Body
    from odscen.base.ids import SegmentId
    from odscen.lanegraph.graphs import MapGraph, PedestrianGraph
    from odscen.scenario.document.sampling_config import (
        Behaviour,
        EnvironmentShares,
        MapFilter,
        SamplingConfig,
    )
    from odscen.scenario.placing.sampled_places import Spot, Supply


Redraw = Literal["open", "drivers", "traffic"]
"""What a seed draws.

``open``: what the scenario leaves open. ``drivers``: also departures, desired speeds and styles of
placed actors. ``traffic``: also their goals.
"""

REDRAWS: tuple[Redraw, ...] = get_args(Redraw)

DEPARTURE = Uniform(low=0.0, high=30.0)
"""Seconds that a placed actor departs later than the scenario says, if that is not at 0."""

SPEED = Normal(mean=1.0, std=0.08, low=0.8, high=1.2)
"""Times the desired speed that the scenario gives a placed actor."""


def redrawn(scenario: Scenario, what: Redraw) -> Scenario:
    """Draw what is random about placed actors by the scenario's seed.

    Departures by :data:`DEPARTURE`, desired speeds by :data:`SPEED` within what is plausible for
    the category; styles change hands within a category, so that their shares stay; goals are left
    open, so that they are drawn as open ones are. Whoever departs at 0 is on the road from the
    start, where the scenario says. The ego is what the scenario is about and stays as it is. What
    is drawn for one actor does not depend on the others, but for the styles.
    """
    if what == "open":
        return scenario
    styles = _dealt_styles(scenario)
    actors = [
        actor if actor.ego else _redraw_behaviour(actor, scenario.seed, styles[actor.id])
        for actor in scenario.actors
    ]
    if what == "traffic":
        actors = [
            actor if actor.ego else actor.model_copy(update={"goal": None}) for actor in actors
        ]
    return scenario.model_copy(update={"actors": tuple(actors)})


def _redraw_behaviour(actor: Actor, seed: int, style: str) -> Actor:
    fields: dict[str, object] = {"style": style}
    if actor.depart > 0:
        later = DEPARTURE.draw(stream(seed, "redrawn departure", actor.id))
        fields["depart"] = round(actor.depart + later, 1)
    if actor.speed is not None:
        low, high = SPEED_MIN[actor.category], SPEED_MAX[actor.category]
        # A speed that the scenario has beyond what is plausible is its own wish and stays one.
        low, high = min(low, actor.speed), max(high, actor.speed)
        factor = SPEED.draw(stream(seed, "redrawn speed", actor.id))
        fields["speed"] = round(min(max(factor * actor.speed, low), high), 2)
    return actor.model_copy(update=fields)


def _dealt_styles(scenario: Scenario) -> dict[str, str]:
    """Style of each actor: those of a category dealt out again."""
    dealt: dict[str, str] = {}
    for category in Category:
        group = [actor for actor in scenario.actors if actor.category is category and not actor.ego]
        styles = [actor.style for actor in group]
        order = stream(scenario.seed, "redrawn styles", category).permutation(len(group))
        dealt |= {user.id: styles[place] for user, place in zip(group, order.tolist(), strict=True)}
    return dealt


def draw_behaviour(
    behaviour: Behaviour,
    graph: LaneGraph | PedestrianGraph,
    spot: Spot,
    body: Body,
    rng: np.random.Generator,
) -> dict[str, Any]:
    """Draw the fields of an actor that say how it moves; speeds and offsets to the centimetre."""
    room = (float(graph.width[spot.node]) - body.width) / 2 - LANE_MARGIN
    fields: dict[str, Any] = {
        "speed": _draw_speed(behaviour, graph, spot, rng),
        "lateral_offset": _cut_offset(behaviour.lateral_offset.draw(rng), max(room, 0.0)),
        "depart": round(max(behaviour.depart.draw(rng), 0.0), 1),
    }
    if spot.category is Category.PEDESTRIAN:
        fields["crosses_anywhere"] = bool(rng.random() < behaviour.crosses_anywhere)
        fields["ignores_red"] = bool(rng.random() < behaviour.ignores_red)
    else:
        fields["style"] = draw_key(behaviour.styles, rng)
    return fields


def _draw_speed(
    behaviour: Behaviour,
    graph: LaneGraph | PedestrianGraph,
    spot: Spot,
    rng: np.random.Generator,
) -> float:
    limit = behaviour.unlimited_speed
    if isinstance(graph, LaneGraph) and 0 < graph.speed_limit[spot.node] < math.inf:
        limit = float(graph.speed_limit[spot.node])
    if spot.category is Category.PEDESTRIAN:
        speed = behaviour.walking_speed.draw(rng)
    elif spot.category is Category.BICYCLE:
        speed = min(behaviour.bicycle_speed.draw(rng), limit)
    else:
        speed = behaviour.speed_factor.draw(rng) * limit
    low, high = SPEED_MIN[spot.category], SPEED_MAX[spot.category]
    return min(max(round(speed, 2), low), high)


def _cut_offset(offset: float, room: float) -> float:
    """``offset`` cut to ``room`` either side, towards zero to whole centimetres."""
    return math.trunc(max(-room, min(room, offset)) * 100) / 100


ATTEMPTS = 20
"""Regions that are tried before a map counts as having no place for an actor."""


def choose_map(maps: MapFilter, statistics: Mapping[str, Mapping[str, Any]], *, seed: int) -> str:
    """Draw a map by its statistics (R19).

    Parameters
    ----------
    statistics
        For each map of the catalogue, its statistics by name; those that are numbers count.

    Raises
    ------
    ScenarioError
        If a statistic is unknown or no map passes the filter.
    """
    used = {*maps.where, *([maps.weight_by] if maps.weight_by else [])}
    numbers = {name: _numeric_statistics(of_map) for name, of_map in statistics.items()}
    known = {name for of_map in numbers.values() for name in of_map}
    if statistics and (unknown := sorted(used - known)):
        raise ScenarioError(
            f"no statistic {unknown[0]!r}; there are {', '.join(sorted(known))}", element="maps"
        )
    weights = {
        name: weight
        for name in sorted(numbers)
        if (weight := _map_weight(maps, name, numbers[name])) > 0
    }
    if not weights:
        raise ScenarioError(
            f"none of the {len(statistics)} maps passes the filter; widen it or add maps",
            element="maps",
        )
    return draw_key(weights, stream(seed, "map"))


def passes_by_name(maps: MapFilter, name: str) -> bool:
    """Whether a map of that name may be drawn, if its statistics allow it, too."""
    return any(fnmatchcase(name, pattern) for pattern in maps.names) and not any(
        fnmatchcase(name, pattern) for pattern in maps.exclude
    )


def sample_roi(
    graph: MapGraph,
    size: int,
    rng: np.random.Generator,
    *,
    exclude: Iterable[str] = (),
) -> tuple[SegmentId, ...]:
    """Grow a connected region from a random segment by random neighbours, up to ``size`` segments.

    Fewer if the base segment is not connected to so many.

    Raises
    ------
    ScenarioError
        If no segment with lanes is left.
    """
    barred = set(exclude)
    with_lanes = np.unique(graph.lanes.segment)
    bases = [graph.segments.ids[row] for row in with_lanes if graph.segments.ids[row] not in barred]
    if not bases:
        raise ScenarioError(f"map {graph.map_name!r} has no segment to start from")
    region = dict.fromkeys([bases[int(rng.integers(len(bases)))]])
    beside = _neighbour_table(graph)
    eligible: dict[SegmentId, None] = {}
    latest = next(iter(region))
    while len(region) < size:
        fresh = (name for name in beside[latest] if name not in barred and name not in region)
        eligible.update(dict.fromkeys(fresh))
        if not eligible:
            break
        latest = list(eligible)[int(rng.integers(len(eligible)))]
        del eligible[latest]
        region[latest] = None
    return tuple(region)


def sample_scenario(
    graph: MapGraph,
    config: SamplingConfig,
    *,
    seed: int,
    name: str,
    usable: Usable | None = None,
    roi: Iterable[str] | None = None,
    place: Callable[[Region, WantedUsers], tuple[Actor, ...]] | None = None,
) -> Scenario:
    """Sample a scenario.

    Parameters
    ----------
    usable
        What the simulator that will run it can use of the map; everything if not given.
    roi
        Segments of the region of interest; drawn by the configuration if not given.
    place
        Places the actors in a region; they are placed at random if not given.

    Raises
    ------
    ScenarioError
        If no actor fits anywhere: the region or the configuration leaves no place.
    """
    usable = Usable() if usable is None else usable
    fill = config.fill.draw(stream(seed, "fill"))
    attempts = ATTEMPTS if roi is None else 1
    for attempt in range(attempts):
        segments = tuple(roi) if roi is not None else _draw_roi(graph, config, seed, attempt)
        region = Region.of(graph, segments)
        crew = wanted_users(region, config, usable, fill=fill)
        if place is not None and (crew.vehicles or crew.walkers or fill == 0):
            actors = place(region, crew)
            break
        actors = _sample_actors(region, config, usable, crew, seed)
        if actors or fill == 0:
            break
    else:
        raise ScenarioError(
            f"no actor fits on map {graph.map_name!r} in {attempts} regions; allow more segments, "
            "other categories, a shorter minimum_trip or a smaller minimum_gap"
        )
    fields = {
        "name": name,
        "map": MapReference(
            name=graph.map_name, sha256=graph.map_sha256, spacing=graph.lanes.spacing
        ),
        "seed": seed,
        "roi": segments,
        "environment": _draw_environment(config.environment, stream(seed, "environment")),
        "actors": actors,
        "simulation": Simulation(duration=config.duration, step_length=config.step_length),
    }
    return validated(Scenario, fields)


def numbers_to_place(
    fill: float, vehicles: int, walkers: int, *, pedestrian_share: float, most: int | None = None
) -> tuple[int, int]:
    """Vehicles and pedestrians that a fill share amounts to (R47).

    The largest number of actors that fit is the ``vehicles`` that fit and as many of the
    ``walkers`` that fit as their share allows; ``fill`` of each are placed, at least one vehicle if
    any fits.
    """
    walkers = min(walkers, int(vehicles * pedestrian_share / (1 - pedestrian_share)))
    cars, people = math.floor(fill * vehicles + 0.5), math.floor(fill * walkers + 0.5)
    if most is not None and cars + people > most:
        people = math.floor(people * most / (cars + people))
        cars = most - people
    if fill > 0 and vehicles > 0 and cars + people == 0 and most != 0:
        cars = 1
    return cars, people


def _numeric_statistics(statistics: Mapping[str, Any]) -> dict[str, float]:
    return {
        name: float(value)
        for name, value in statistics.items()
        if isinstance(value, (int, float)) and not isinstance(value, bool)
    }


def _map_weight(maps: MapFilter, name: str, statistics: Mapping[str, float]) -> float:
    """Weight of a map, 0 if it does not pass the filter; a missing number passes no bounds."""
    if not passes_by_name(maps, name):
        return 0.0
    for statistic, bounds in maps.where.items():
        value = statistics.get(statistic)
        if value is None or not bounds.holds(value):
            return 0.0
    return 1.0 if maps.weight_by is None else max(statistics.get(maps.weight_by, 0.0), 0.0)


def _neighbour_table(graph: MapGraph) -> dict[SegmentId, tuple[SegmentId, ...]]:
    ids = graph.segments.ids
    table: dict[SegmentId, list[SegmentId]] = {name: [] for name in ids}
    for one, other in graph.segments.adjacency.tolist():
        table[ids[one]].append(ids[other])
        table[ids[other]].append(ids[one])
    return {name: tuple(beside) for name, beside in table.items()}


def _draw_roi(
    graph: MapGraph, config: SamplingConfig, seed: int, attempt: int
) -> tuple[SegmentId, ...]:
    rng = stream(seed, "roi", str(attempt))
    size = max(1, round(config.roi.segments.draw(rng)))
    return sample_roi(graph, size, rng, exclude=config.places.exclude_segments)


def _draw_environment(shares: EnvironmentShares, rng: np.random.Generator) -> Environment:
    preset = draw_key(shares.presets, rng)
    parameters = {name: round(of.draw(rng), 4) for name, of in shares.parameters.items()}
    return Environment(preset=preset, parameters=parameters)


class _ScenarioDraft(NamedTuple):
    """An actor to be: where it starts, what it is, where it goes, how it moves."""

    spot: Spot
    walk: bool
    goal: int
    fields: dict[str, object]


class WantedUsers(NamedTuple):
    """How many road users are wanted in a region, and where they may be."""

    vehicles: int
    walkers: int
    road_places: Supply
    walk_places: Supply


def wanted_users(
    region: Region, config: SamplingConfig, usable: Usable, *, fill: float
) -> WantedUsers:
    """Find the places of a region, and how many road users a share of them amounts to."""
    supply = vehicle_supply(region, config.places, config.vehicles, usable)
    walkers = walker_supply(region, usable)
    cars, people = numbers_to_place(
        fill,
        len(supply.fit),
        len(walkers.fit),
        pedestrian_share=config.pedestrian_share,
        most=config.actors_max,
    )
    return WantedUsers(cars, people, supply, walkers)


def _sample_actors(
    region: Region, config: SamplingConfig, usable: Usable, crew: WantedUsers, seed: int
) -> tuple[Actor, ...]:
    cars, people, supply, walkers = crew
    rng = stream(seed, "places")
    drafts = [
        *_draft_actors(
            region, config, usable, place_at_random(supply, cars, rng), supply, seed=seed
        ),
        *_draft_actors(
            region, config, usable, place_at_random(walkers, people, rng), walkers, seed=seed
        ),
    ]
    drafts, offsets = _settle_offsets(region, drafts, usable)
    ego = _draw_ego(drafts, stream(seed, "ego")) if config.ego else None
    counter: Counter[Category] = Counter()
    actors = []
    for index, (draft, offset) in enumerate(zip(drafts, offsets, strict=True)):
        category = draft.spot.category
        counter[category] += 1
        actors.append(
            validated(
                Actor,
                draft.fields
                | {
                    "id": f"{category}-{counter[category]}",
                    "category": category,
                    "spawn": name_of(region.graph, NodePlace(draft.walk, draft.spot.node)),
                    "goal": name_of(region.graph, NodePlace(draft.walk, draft.goal)),
                    "lateral_offset": offset,
                    "ego": index == ego,
                },
            )
        )
    return tuple(actors)


def _draft_actors(
    region: Region,
    config: SamplingConfig,
    usable: Usable,
    spots: Sequence[Spot],
    supply: Supply,
    *,
    seed: int,
) -> list[_ScenarioDraft]:
    """Give each spot a goal and a behaviour; a spot without a goal that can be used is dropped."""
    walk = bool(spots) and spots[0].category is Category.PEDESTRIAN
    rng = stream(seed, "walkers" if walk else "vehicles")
    among: Callable[[int], BoolArray] | None = None
    if walk:
        among = None if (walkable := usable.walkable) is None else lambda _: walkable
    elif usable.drivable is not None:
        among = Reach(region.graph.lanes, region.lanes & usable.drivable).of
    drafts = []
    router = region.walk_router if walk else region.router
    candidates = router.each_candidates([spot.node for spot in spots], among)
    for spot, goals in zip(spots, candidates, strict=True):
        if len(goals):
            goal = int(goals[int(rng.integers(len(goals)))])
            body = supply.bodies[spot.category]
            fields = draw_behaviour(config.behaviour, supply.graph, spot, body, rng)
            drafts.append(_ScenarioDraft(spot, walk, goal, fields))
    return drafts


def _settle_offsets(
    region: Region, drafts: Sequence[_ScenarioDraft], usable: Usable
) -> tuple[list[_ScenarioDraft], list[float]]:
    """Lateral offsets with which no bodies touch, and the drafts that can stay.

    Bodies that would touch go back to the middle of their lanes, where vehicles keep a gap; a
    pedestrian beside a lane who touches a vehicle even then is left out.
    """
    offsets = [float(str(draft.fields["lateral_offset"])) for draft in drafts]
    bodies = [usable.bodies[draft.spot.category] for draft in drafts]
    reach = max((2 * (body.length + body.width) for body in bodies), default=1.0)
    while True:
        crowd = Crowd(reach)
        clashing: set[int] = set()
        for index, draft in enumerate(drafts):
            graph = region.graph.walks if draft.walk else region.graph.lanes
            box: Box = box_at(graph, draft.spot.node, bodies[index], lateral_offset=offsets[index])
            for other in crowd.touching(box):
                clashing |= {index, other}
            crowd.add(index, box)
        moved = [index for index in sorted(clashing) if offsets[index] != 0.0]
        if not moved:
            kept = [i for i, draft in enumerate(drafts) if i not in clashing or not draft.walk]
            return [drafts[i] for i in kept], [offsets[i] for i in kept]
        for index in moved:
            offsets[index] = 0.0


def _draw_ego(drafts: Sequence[_ScenarioDraft], rng: np.random.Generator) -> int | None:
    """Index of a car, or of any vehicle if there is no car."""
    vehicles = [index for index, draft in enumerate(drafts) if not draft.walk]
    cars = [index for index in vehicles if drafts[index].spot.category is Category.CAR]
    choices = cars or vehicles
    return choices[draw_place([1.0] * len(choices), rng)] if choices else None
