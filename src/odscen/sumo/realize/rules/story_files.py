"""Rules as the run reads them: with the places and signals that they name looked up."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from odscen.base.categories import Category
from odscen.base.errors import ScenarioError
from odscen.base.stored_files import stored_document
from odscen.scenario.document.rules_document import StoryRule, places_of, rule_parts
from odscen.scenario.placing.region import place_of
from odscen.scenario.signals.light import find_light, find_movements
from odscen.sumo.realize.lights.light_views import scenario_lights
from odscen.sumo.realize.routes_file import HeldActor

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.realize.sumo_map import SumoMap

FORMAT = "odscen-story"
VERSION = 1


class StoryPlace(NamedTuple):
    """A node that a rule names: OpenDRIVE x and y, and where it is on SUMO's network, if it is."""

    x: float
    y: float
    edge: str | None = None
    pos: float = 0.0
    lane: int = 0


@dataclass(frozen=True, slots=True)
class StoryPlan:
    """Rules, and what they name.

    Attributes
    ----------
    places
        By node.
    signals
        SUMO's light and the letter in its states, by light and movement of the document; -1 for
        the whole light, which has no movement.
    held
        Road users that rules let appear.
    by_story
        Speeds, m/s, at which the story alone begins to drive vehicles, by their ids; ``None`` is
        that at which one appears.
    without_goal
        Vehicles that rules move and that have no goal of their own: where they end up decides. And
        pedestrians of recordings, who follow their track and vanish.
    """

    rules: tuple[StoryRule, ...]
    places: dict[str, StoryPlace] = field(default_factory=dict)
    signals: dict[tuple[str, str], tuple[str, int]] = field(default_factory=dict)
    held: Mapping[str, HeldActor] = field(default_factory=dict)
    by_story: Mapping[str, float | None] = field(default_factory=dict)
    without_goal: tuple[str, ...] = ()

    def to_json(self) -> str:
        """One rule a line; the same plan gives the same text."""
        rules = [
            json.dumps(rule.model_dump(mode="json", exclude_defaults=True), ensure_ascii=False)
            for rule in self.rules
        ]
        signals = [[*key, *value] for key, value in self.signals.items()]
        places = {name: list(place) for name, place in self.places.items()}
        head = {"format": FORMAT, "version": VERSION, "places": places, "signals": signals}
        if self.held:
            head["held"] = {name: asdict(insertion) for name, insertion in self.held.items()}
        if self.by_story:
            head["by_story"] = dict(self.by_story)
        if self.without_goal:
            head["without_goal"] = list(self.without_goal)
        lines = [f"  {json.dumps(key)}: {json.dumps(value)}" for key, value in head.items()]
        body = ",\n    ".join(rules)
        return "{\n" + ",\n".join(lines) + f',\n  "rules": [\n    {body}\n  ]\n}}\n'

    @classmethod
    def from_json(cls, text: str) -> StoryPlan:
        """Inverse of :meth:`to_json`.

        Raises
        ------
        InputError
            If it is something else.
        """
        with stored_document(text, form=FORMAT, version=VERSION, what="the rules of a run") as data:
            return cls(
                tuple(StoryRule.model_validate_json(json.dumps(rule)) for rule in data["rules"]),
                {name: StoryPlace(*place) for name, place in data["places"].items()},
                {(light, name): (tl, link) for light, name, tl, link in data["signals"]},
                {
                    name: HeldActor(
                        tuple(insertion["edges"]), insertion["attributes"], insertion["person"]
                    )
                    for name, insertion in data.get("held", {}).items()
                },
                data.get("by_story", {}),
                tuple(data.get("without_goal", ())),
            )


def _follows_only_track(rules: Sequence[StoryRule]) -> bool:
    actions = [action for rule in rules for action in rule.then]
    follows, vanishes, leaves = (
        any(getattr(action, kind, None) is not None for action in actions)
        for kind in ("replay", "vanish", "release")
    )
    return follows and vanishes and not leaves


def story_plan(
    scenario: Scenario, sumo_map: SumoMap, held: Mapping[str, HeldActor] | None = None
) -> StoryPlan:
    """Look up what the rules of a scenario name.

    Raises
    ------
    ScenarioError
        If a node or a movement is not on the map.
    """
    held = held or {}
    speeds = {
        actor.id: None if actor.id in held else actor.initial_speed or 0.0
        for actor in scenario.by_story
    }
    moved: dict[str, list[StoryRule]] = {}
    for rule in scenario.rules:
        moved.setdefault(rule.actor, []).append(rule)
    free = tuple(
        actor.id
        for actor in scenario.actors
        if actor.id in moved
        and actor.goal is None
        and (actor.category is not Category.PEDESTRIAN or _follows_only_track(moved[actor.id]))
    )
    plan = StoryPlan(scenario.rules, held=held, by_story=speeds, without_goal=free)
    for index, rule in enumerate(scenario.rules):
        for where, _, part in rule_parts(rule, f"rules[{index}]"):
            for name, place in places_of(part):
                if isinstance(place, str):
                    plan.places[place] = _story_place(place, sumo_map, f"{where}.{name}")
            light, movement = getattr(part, "light", None), getattr(part, "movement", None) or ""
            if light is not None:
                plan.signals[light, movement] = _signal_link(light, movement, sumo_map, where)
    return plan


def _story_place(node: str, sumo_map: SumoMap, where: str) -> StoryPlace:
    graph = sumo_map.graph
    place = place_of(graph, node)
    if place is None:
        raise ScenarioError(f"the map has no node {node!r}", element=where)
    nodes = graph.walks if place.walk else graph.lanes
    x, y = float(nodes.x[place.node]), float(nodes.y[place.node])
    at = (sumo_map.walk_places if place.walk else sumo_map.lane_places).of(place.node)
    if at is None:
        return StoryPlace(x, y)
    lane = sumo_map.net.lanes[at[0]]
    return StoryPlace(x, y, lane.edge, at[1], lane.index)


def _signal_link(light: str, movement: str, sumo_map: SumoMap, where: str) -> tuple[str, int]:
    lights = scenario_lights(sumo_map)
    found = find_light(lights, light)
    if found is None:
        raise ScenarioError(f"the map has no traffic light {light!r}", element=where)
    if not movement:
        return sumo_map.lights[lights.index(found)].id, -1
    links = find_movements(movement, found.movements)
    if not links:
        raise ScenarioError(f"light {light!r} has no movement {movement!r}", element=where)
    return sumo_map.lights[lights.index(found)].id, min(links)
