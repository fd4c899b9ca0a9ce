"""The rules for rules: who and what they name, and who may act at once."""

from __future__ import annotations

from bisect import bisect_right
from collections import defaultdict
from heapq import merge
from itertools import islice
from math import comb
from typing import TYPE_CHECKING, NamedTuple

from odscen.base.categories import Category
from odscen.base.errors import OdscenError
from odscen.scenario.document.problems import (
    MOST_PAIRS,
    Problem,
    error,
    more_of_kind,
    warning,
)
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
    scenario: Scenario,
    region: Region,
    lights: Sequence[Light] | None = None,
    *,
    only: int | None = None,
    others: Mapping[str, Category] | None = None,
) -> Iterator[Problem]:
    """Yield everything wrong with the rules of a scenario (R74).

    Parameters
    ----------
    lights
        Traffic lights of the map for the rules on signals; without them those are left out.
    only
        Place of the rule that is looked at, besides the ids of all: an edit of one rule then takes
        the same time however many others there are. All of them if not given.
    others
        Who else may be named, such as vehicles of demand in a run that is under way.
    """
    ids: dict[str, int] = {}
    known = _KnownNames(
        {actor.id: actor.category for actor in scenario.actors},
        {flow.id for flow in scenario.flows},
        {} if others is None else others,
        ids,
    )
    for index, rule in enumerate(scenario.rules):
        ids.setdefault(rule.id, index)
    for index, rule in enumerate(scenario.rules):
        where = f"rules[{index}]"
        if (first := ids[rule.id]) < index:
            message = f"id {rule.id!r} is taken by rules[{first}].id; give one of them another"
            yield error("duplicate_id", f"{where}.id", message)
        if only is None or index == only:
            yield from _check_actor_name(rule.actor, f"{where}.actor", known)
            for part in rule_parts(rule, where):
                yield from _check_part(part, rule, known, region)
                yield from _check_signal(part, lights)
    if only is None:
        yield from _at_once(scenario)


class _KnownNames(NamedTuple):
    """Who and what rules may name: actors, flows, other road users, and ids of rules."""

    actors: Mapping[str, Category]
    flows: set[str]
    others: Mapping[str, Category]
    ids: Mapping[str, int]


def _check_part(
    found: RulePart, rule: StoryRule, known: _KnownNames, region: Region
) -> Iterator[Problem]:
    where, kind, part = found
    for name, actor in actors_of(part):
        yield from _check_actor_name(actor, f"{where}.{name}", known)
    for name, place in places_of(part):
        if isinstance(place, str) and region.place(place) is None:
            message = f"the map has no node {place!r}; pick one"
            yield error("unknown_place", f"{where}.{name}", message, nodes=[place])
    if kind == "own":
        yield from _check_package_kind(found)
    if kind == "rule" and (other := getattr(part, "id", None)) not in known.ids:
        message = f"there is no rule {other!r}; there are {_list_names(list(known.ids))}"
        yield error("unknown_rule", f"{where}.id", message)
    category = known.actors.get(rule.actor) or known.others.get(rule.actor)
    action = ACTIONS.get(kind)
    if ".then[" in where and action is not None and category is not None:
        on_foot = category is Category.PEDESTRIAN
        if (action.persons_only and not on_foot) or (action.vehicles_only and on_foot):
            who = "pedestrians" if action.persons_only else "vehicles"
            message = f"{kind!r} is for {who}; {rule.actor!r} is a {category}"
            yield error("action_not_possible", where, message)
        yield from _check_goal(found, rule.actor, region, on_foot=on_foot)
    if kind == "appear" and ".then[" in where and rule.actor not in known.actors:
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


def _check_actor_name(name: str, where: str, known: _KnownNames) -> Iterator[Problem]:
    flow, _, number = name.rpartition(".")
    if name in known.actors or name in known.others:
        return
    if flow in known.flows and number.isdigit():
        return
    message = f"there is no actor {name!r}; there are {_list_names(sorted(known.actors))}"
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
    """Yield pairs of rules that may take over the same actor at once: the later one then has it.

    The first of them, and how many more there are: as many pairs as there are of rules, counted
    without a look at each.
    """
    of_actor: dict[str, list[tuple[int, StoryRule]]] = defaultdict(list)
    first: dict[str, int] = {}
    for index, rule in enumerate(scenario.rules):
        of_actor[rule.actor].append((index, rule))
        first.setdefault(rule.id, index)
    listed: list[Problem] = []
    number = 0
    for rules in of_actor.values():
        clashes = _RuleClashes(rules, first)
        number += clashes.number()
        for one, other in islice(clashes.pairs(), MOST_PAIRS - len(listed)):
            ids = (scenario.rules[one].id, scenario.rules[other].id)
            message = (
                f"rules {ids[0]!r} and {ids[1]!r} both move {scenario.rules[one].actor!r}; if they "
                "do so at once, the one that fires later acts instead. Let one wait for the other "
                "with the condition 'rule' if that is not meant"
            )
            listed.append(warning("rules_at_once", f"rules[{other}]", message))
    yield from listed
    if number > len(listed):
        yield more_of_kind(listed[0], number - len(listed))


class _RuleClashes:
    """Pairs of the rules of one actor of which neither waits for the other, though both move it.

    Parameters
    ----------
    rules
        With their places in the document.
    first
        Place of the first rule with an id: for that one waits who names it.
    """

    def __init__(self, rules: Sequence[tuple[int, StoryRule]], first: Mapping[str, int]) -> None:
        self._takes = {
            index: frozenset(
                kinds
                for kinds in (_SPEED, _PLACE)
                if any(action.kind in kinds for item in rule.then for action in item.parts)
            )
            for index, rule in rules
        }
        self._waiting = {
            (min(index, other), max(index, other))
            for index, rule in rules
            for _, kind, part in rule_parts(rule, "")
            if kind == "rule"
            and (other := first.get(getattr(part, "id", ""), index)) != index
            and other in self._takes
            and self._takes[index] & self._takes[other]
        }

    def number(self) -> int:
        """How many pairs there are."""
        speed, place, both = (
            sum(these <= takes for takes in self._takes.values())
            for these in ({_SPEED}, {_PLACE}, {_SPEED, _PLACE})
        )
        # Who takes both clashes with another of those once, not twice.
        pairs = comb(speed, 2) + comb(place, 2) - comb(both, 2)
        return pairs - len(self._waiting)

    def pairs(self) -> Iterator[tuple[int, int]]:
        """Yield the places of both rules, in their order; what clashes with nothing is passed over.

        Each step looks at rules that clash only, but for those that wait.
        """
        of_kind = {
            kinds: [index for index, takes in self._takes.items() if kinds in takes]
            for kinds in (_SPEED, _PLACE)
        }
        for index, takes in self._takes.items():
            later = [_items_above(index, of_kind[kinds]) for kinds in takes]
            last = index
            for other in merge(*later):
                if other != last and (index, other) not in self._waiting:
                    yield index, other
                last = other


def _items_above(least: int, ordered: Sequence[int]) -> Iterator[int]:
    return (ordered[at] for at in range(bisect_right(ordered, least), len(ordered)))


def _list_names(names: Sequence[str]) -> str:
    shown = ", ".join(names[:_LISTED]) or "none"
    return shown if len(names) <= _LISTED else f"{shown}, ..."
