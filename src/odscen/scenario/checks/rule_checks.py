"""The rules for rules: who and what they name, and who may act at once."""

from __future__ import annotations

from collections import defaultdict
from itertools import combinations
from typing import TYPE_CHECKING

from odscen.base.categories import Category
from odscen.base.errors import OdscenError
from odscen.scenario.document.problems import Problem, error, warning
from odscen.scenario.document.rules_document import actors_of, places_of, rule_parts
from odscen.scenario.signals.light import find_light, find_movements, known_names
from odscen.scenario.story.action_kinds import ACTIONS
from odscen.scenario.story.own_kinds import (
    own_action,
    own_actions,
    own_condition,
    own_conditions,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from odscen.scenario.document.rules_document import RulePart, StoryRule
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.placing.region import Region
    from odscen.scenario.signals.light import Light

_SPEED = frozenset({"speed", "brake", "stop", "keep_gap", "arrive", "replay"})
_PLACE = frozenset({"lane", "cut_in", "offset", "walk", "path", "replay"})
_LISTED = 8
"""Names that a message lists at most."""


def rule_problems(
    scenario: Scenario, region: Region, lights: Sequence[Light] | None = None
) -> Iterator[Problem]:
    """Yield everything wrong with the rules of a scenario (R74)."""
    known = {actor.id: actor.category for actor in scenario.actors}
    flows = {flow.id for flow in scenario.flows}
    ids = [rule.id for rule in scenario.rules]
    for index, rule in enumerate(scenario.rules):
        where = f"rules[{index}]"
        if rule.id in ids[:index]:
            first = ids.index(rule.id)
            message = f"id {rule.id!r} is taken by rules[{first}].id; give one of them another"
            yield error("duplicate_id", f"{where}.id", message)
        yield from _check_actor_name(rule.actor, f"{where}.actor", known, flows)
        for part in rule_parts(rule, where):
            yield from _check_part(part, rule, known, flows, ids, region)
            yield from _check_signal(part, lights)
    yield from _at_once(scenario)


def _check_part(
    found: RulePart,
    rule: StoryRule,
    known: Mapping[str, Category],
    flows: set[str],
    ids: Sequence[str],
    region: Region,
) -> Iterator[Problem]:
    where, kind, part = found
    for name, actor in actors_of(part):
        yield from _check_actor_name(actor, f"{where}.{name}", known, flows)
    for name, place in places_of(part):
        if isinstance(place, str) and region.place(place) is None:
            message = f"the map has no node {place!r}; pick one"
            yield error("unknown_place", f"{where}.{name}", message, nodes=[place])
    if kind == "own":
        yield from _check_package_kind(found)
    if kind == "rule" and (other := getattr(part, "id", None)) not in ids:
        message = f"there is no rule {other!r}; there are {_list_names(ids)}"
        yield error("unknown_rule", f"{where}.id", message)
    category, action = known.get(rule.actor), ACTIONS.get(kind)
    if ".then[" in where and action is not None and category is not None:
        on_foot = category is Category.PEDESTRIAN
        if (action.persons_only and not on_foot) or (action.vehicles_only and on_foot):
            who = "pedestrians" if action.persons_only else "vehicles"
            message = f"{kind!r} is for {who}; {rule.actor!r} is a {category}"
            yield error("action_not_possible", where, message)
        yield from _check_goal(found, rule.actor, region, on_foot=on_foot)
    if kind == "appear" and ".then[" in where and rule.actor not in known:
        message = f"{rule.actor!r} is of a flow, which says when it departs; let an actor appear"
        yield error("action_not_possible", where, message)


def _check_package_kind(found: RulePart) -> Iterator[Problem]:
    """Yield that no installed package gives a kind, or what it finds wrong with its values."""
    name = str(getattr(found.part, "kind", ""))
    acts = ".then[" in found.where
    try:
        kind = own_action(name) if acts else own_condition(name)
        wrong = None if kind is None or kind.check is None else kind.check(found.part)
    except OdscenError as failed:
        yield error("own_kind", found.where, str(failed))
        return
    if kind is None:
        names = own_actions() if acts else own_conditions()
        message = f"no installed package gives {name!r}; there are {_list_names(names)}"
        yield error("own_kind", f"{found.where}.kind", message)
    elif wrong is not None:
        yield error("own_kind", found.where, f"{name!r}: {wrong}")


def _check_goal(found: RulePart, actor: str, region: Region, *, on_foot: bool) -> Iterator[Problem]:
    """Yield that a new goal is not where the actor can go."""
    node = getattr(found.part, "to", None)
    place = region.place(node) if found.kind == "goal" and isinstance(node, str) else None
    if place is not None and place.walk != on_foot:
        where, other = ("on a sidewalk", "a lane") if on_foot else ("on a lane", "a sidewalk")
        message = f"the goal of {actor!r} has to be {where}; {node!r} is on {other}"
        yield error("action_not_possible", f"{found.where}.to", message, nodes=[str(node)])


def _check_actor_name(
    name: str, where: str, known: Mapping[str, Category], flows: set[str]
) -> Iterator[Problem]:
    flow, _, number = name.rpartition(".")
    if name in known or (flow in flows and number.isdigit()):
        return
    message = f"there is no actor {name!r}; there are {_list_names(sorted(known))}"
    yield error("unknown_actor", where, message)


def _check_signal(found: RulePart, lights: Sequence[Light] | None) -> Iterator[Problem]:
    where, kind, part = found
    if kind != "signal" or lights is None:
        return
    name, movement = getattr(part, "light", ""), getattr(part, "movement", "")
    light = find_light(lights, name)
    if light is None:
        names = [light.names[0] for light in lights if light.names]
        message = f"the map has no traffic light {name!r}; there are {_list_names(names)}"
        yield error("unknown_light", f"{where}.light", message)
    elif movement is not None and not find_movements(movement, light.movements):
        names = list(known_names(light.movements))
        message = f"light {name!r} has no movement {movement!r}; there are {_list_names(names)}"
        yield error("unknown_movement", f"{where}.movement", message)


def _at_once(scenario: Scenario) -> Iterator[Problem]:
    """Yield pairs of rules that may take over the same actor at once: the later one then has it."""
    of_actor: dict[str, list[tuple[int, StoryRule]]] = defaultdict(list)
    for index, rule in enumerate(scenario.rules):
        of_actor[rule.actor].append((index, rule))
    for rules in of_actor.values():
        for (_, one), (index, other) in combinations(rules, 2):
            if _waits_for_rule(other, one) or _waits_for_rule(one, other):
                continue
            first, second = _kinds_taken(one), _kinds_taken(other)
            if any(first & these and second & these for these in (_SPEED, _PLACE)):
                message = (
                    f"rules {one.id!r} and {other.id!r} both move {one.actor!r}; if they do so at "
                    "once, the one that fires later acts instead. Let one wait for the other with "
                    "the condition 'rule' if that is not meant"
                )
                yield warning("rules_at_once", f"rules[{index}]", message)


def _kinds_taken(rule: StoryRule) -> set[str]:
    return {part.kind for item in rule.then for part in item.parts}


def _waits_for_rule(rule: StoryRule, other: StoryRule) -> bool:
    parts = (part for _, kind, part in rule_parts(rule, "") if kind == "rule")
    return any(getattr(part, "id", None) == other.id for part in parts)


def _list_names(names: Sequence[str]) -> str:
    shown = ", ".join(names[:_LISTED]) or "none"
    return shown if len(names) <= _LISTED else f"{shown}, ..."
