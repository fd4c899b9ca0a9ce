"""Rules: when this holds, then the actor does that."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, NamedTuple

from pydantic import Field

from odscen.scenario.document.actions_document import (
    Action,
    Appearing,
    LaneChange,
    LateralMove,
    NewGoal,
    PathFollowing,
    SpeedChange,
    Walking,
)
from odscen.scenario.document.conditions_document import Condition, RulePlace
from odscen.scenario.document.document_parts import Identifier, Part

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator


class StoryRule(Part):
    """When a condition holds, an actor does something; items of ``then`` follow one another.

    A rule fires ``times`` times at most: again when its condition comes true anew after what it
    does is over.
    """

    id: Identifier
    actor: Identifier
    when: Condition
    then: Annotated[tuple[Action, ...], Field(min_length=1)]
    times: Annotated[int, Field(ge=1, le=100_000)] = 1


class RulePart(NamedTuple):
    """A condition or an action with its place in the document: ``rules[0].when.all[1].ttc``."""

    where: str
    kind: str
    part: Part


def rule_parts(rule: StoryRule, where: str) -> Iterator[RulePart]:
    """All conditions and actions of a rule that are not combinations, in order."""
    yield from _conditions(rule.when, f"{where}.when")
    for index, item in enumerate(rule.then):
        for number, one in enumerate(item.parts):
            inside = f".together[{number}]" if item.together else ""
            place = f"{where}.then[{index}]{inside}.{one.kind}"
            yield RulePart(place, one.kind, getattr(one, one.kind))


def _conditions(condition: Condition, where: str) -> Iterator[RulePart]:
    kind = condition.kind
    if kind == "not_" and condition.not_ is not None:
        yield from _conditions(condition.not_, f"{where}.not")
    elif kind in ("all", "any"):
        for index, one in enumerate(getattr(condition, kind)):
            yield from _conditions(one, f"{where}.{kind}[{index}]")
    else:
        yield RulePart(f"{where}.{kind}", kind, getattr(condition, kind))


def places_of(part: Part) -> Iterator[tuple[str, RulePlace]]:
    """Places that a condition or action names, with the names of their fields."""
    if isinstance(part, Appearing):  # an exact pose, no place of the map
        return
    if isinstance(part, PathFollowing) and part.relative_to is not None:
        return
    for name in ("place", "to", "at", "when_at"):
        value = getattr(part, name, None)
        if value is not None and not (name == "to" and _to_is_actor(part)):
            yield name, value
    for name in ("through", "points"):
        for index, value in enumerate(getattr(part, name, ())):
            yield f"{name}[{index}]", value


def actors_of(part: Part) -> Iterator[tuple[str, str]]:
    """Actors that a condition or action names, with the names of their fields."""
    for name in ("of", "to", "relative_to"):
        value = getattr(part, name, None)
        if isinstance(value, str) and (name != "to" or _to_is_actor(part)):
            yield name, value


def appearing_actors(rules: Iterable[StoryRule]) -> frozenset[str]:
    """Actors that rules let appear, and that are not on the road before."""
    return frozenset(
        rule.actor
        for rule in rules
        for item in rule.then
        if any(one.appear is not None for one in item.parts)
    )


def _to_is_actor(part: Part) -> bool:
    """Whether ``to`` is an actor: it is a place, a speed or an offset in some."""
    return not isinstance(part, Walking | SpeedChange | LateralMove | LaneChange | NewGoal)
