"""Another day of the same traffic: what is random about placed actors, drawn anew by a seed.

What a scenario leaves open (members of flows and demand, open goals, speed factors, parameters of
driver sets) follows the seed anyway. Placed actors have all of it written down, so that seeds
hardly vary where most of the traffic is placed; this draws it again, by distributions that keep
what they have on average. Where they start is not drawn: places are checked for room.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, get_args

from odscen.base.categories import Category
from odscen.scenario.checks.actor_checks import SPEED_MAX, SPEED_MIN
from odscen.scenario.document.distributions import Normal, Uniform
from odscen.scenario.document.named_random import stream

if TYPE_CHECKING:
    from odscen.scenario.document.scenario_document import Actor, Scenario

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
        actor if actor.ego else _redrawn(actor, scenario.seed, styles[actor.id])
        for actor in scenario.actors
    ]
    if what == "traffic":
        actors = [one if one.ego else one.model_copy(update={"goal": None}) for one in actors]
    return scenario.model_copy(update={"actors": tuple(actors)})


def _redrawn(actor: Actor, seed: int, style: str) -> Actor:
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
        group = [one for one in scenario.actors if one.category is category and not one.ego]
        styles = [one.style for one in group]
        order = stream(scenario.seed, "redrawn styles", category).permutation(len(group))
        dealt |= {one.id: styles[place] for one, place in zip(group, order.tolist(), strict=True)}
    return dealt
