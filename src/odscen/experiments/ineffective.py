"""Variables that change nothing, found in the document before a case of them is run.

Only what is certain is said: a variable of which nothing is known here may still have no effect.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.categories import Category
from odscen.base.errors import OdscenError
from odscen.scenario.document.formulas import evaluate, names_in
from odscen.scenario.document.json_form import with_values
from odscen.scenario.sweeps.sweep_plan import Range

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from odscen.scenario.document.rules_document import StoryRule
    from odscen.scenario.document.scenario_document import Actor, Scenario
    from odscen.scenario.sweeps.sweep_plan import SweepPlan, Table

_TRIED = 9
"""Values of a range that are tried, both ends included."""
_MOST_ROWS = 50
"""Rows of a table that are tried."""

_WEATHER = frozenset(
    {"precipitation", "wetness", "precipitation_deposits", "fog_density", "dust_storm",
     "fog_distance"}
)  # fmt: skip
"""Parameters of weather that act on SUMO's drivers:
:func:`odscen.sumo.realize.weather_effects.weather_effect`."""
_KEEP_SPEED = frozenset({"speed", "lane", "offset", "lights", "horn", "signal", "ignore", "replay"})
"""Actions of which none gives the desired speed back."""


def variables_without_effect(scenario: Scenario, plan: SweepPlan) -> dict[str, str]:
    """Reason by name of each varied parameter that changes nothing in a run in SUMO.

    A place of the document has no effect if it has none for every value that is tried: nine of a
    range, the first fifty rows of a table.
    """
    reasons = {}
    for axis in plan.axes:
        for column, name in enumerate(axis.names):
            if name in scenario.parameters:
                reason = _find_reason(scenario, name, _values_of(axis, column))
                if reason is not None:
                    reasons[name] = reason
    return reasons


def _values_of(axis: Range | Table, column: int) -> list[float]:
    if isinstance(axis, Range):
        return [axis.at(step / (_TRIED - 1))[0] for step in range(_TRIED)]
    return [row[column] for row in axis.rows[:_MOST_ROWS]]


def _find_reason(scenario: Scenario, name: str, values: list[float]) -> str | None:
    used = _computed_from(scenario.formulas, name)
    places = sorted(place for place in used if not place.startswith("parameters/"))
    if not places:
        return "no number of the scenario is computed from it"
    cases = list(_make_cases(scenario, name, values))
    if not cases:
        return None
    if len(values) > 1 and all(_is_constant(place, scenario, cases) for place in places):
        return f"{scenario.formulas[places[0]]} is the same for all its values"
    reasons = []
    for place in places:
        each = [_reason_of_place(case, place) for case in cases]
        if any(reason is None for reason in each):
            return None
        reasons.append(each[0])
    return reasons[0]


def _computed_from(formulas: Mapping[str, str], name: str) -> set[str]:
    """Places whose formulas use a parameter, or one that is computed from it."""
    names = {name}
    places: set[str] = set()
    while True:
        more = {place for place, text in formulas.items() if names_in(text) & names} - places
        if not more:
            return places
        places |= more
        parts = [place.split("/") for place in more]
        names |= {part[1] for part in parts if part[0] == "parameters"}


def _make_cases(scenario: Scenario, name: str, values: list[float]) -> Iterator[Scenario]:
    """The scenario with each value that is possible; a sweep refuses the others."""
    for value in dict.fromkeys(values):
        try:
            yield with_values(scenario, {name: value})
        except OdscenError:
            continue


def _is_constant(place: str, scenario: Scenario, cases: list[Scenario]) -> bool:
    text = scenario.formulas[place]
    results = {
        evaluate(text, {key: parameter.value for key, parameter in case.parameters.items()})
        for case in cases
    }
    return len(results) == 1


def _reason_of_place(scenario: Scenario, place: str) -> str | None:
    kind, *rest = place.split("/")
    end = scenario.simulation.duration
    if kind == "environment":
        return _reason_of_weather(scenario, rest)
    if kind == "actors" and rest:
        actor = next((actor for actor in scenario.actors if actor.id == rest[0]), None)
        return None if actor is None else _reason_of_actor(scenario, actor, rest[1:], end)
    if kind == "rules" and rest:
        for rule in scenario.rules:
            if rule.id == rest[0] and rule.when.time and rule.when.time.after >= end:
                begin = rule.when.time.after
                return f"rule {rule.id} begins at {begin:g} s, the run ends at {end:g} s"
    if kind in ("measures", "flows") and rest:
        for part in getattr(scenario, kind):
            if part.id == rest[0] and part.begin >= end:
                return f"{part.id} begins at {part.begin:g} s, the run ends at {end:g} s"
    return None


def _reason_of_weather(scenario: Scenario, rest: list[str]) -> str | None:
    if not scenario.environment.affects_driving:
        return "weather does not affect driving in this scenario"
    if len(rest) == 2 and rest[0] == "parameters" and rest[1] not in _WEATHER:
        return f"drivers in SUMO do not react to {rest[1]}"
    return None


def _reason_of_actor(scenario: Scenario, actor: Actor, rest: list[str], end: float) -> str | None:
    if actor.depart >= end:
        return f"{actor.id} departs at {actor.depart:g} s, the run ends at {end:g} s"
    field = rest[0] if rest else ""
    if field == "initial_speed" and actor.category is Category.PEDESTRIAN:
        return f"{actor.id} is a pedestrian, who starts without a speed"
    if field not in ("speed", "initial_speed") or actor.depart > 0.0:
        return None
    own = [rule for rule in scenario.rules if rule.actor == actor.id]
    if any(
        part.kind not in _KEEP_SPEED for rule in own for item in rule.then for part in item.parts
    ):
        return None
    first = [rule for rule in own if _fires_at_once(rule)]
    for rule in first:
        kinds = {part.kind: part for part in rule.then[0].parts}
        if "replay" in kinds:
            return f"rule {rule.id} moves {actor.id} as it was recorded"
        change = kinds["speed"].speed if "speed" in kinds else None
        if change is not None and (field == "speed" or change.shape == "step"):
            return f"rule {rule.id} sets the speed"
    if field == "speed" and actor.driver == "story":
        return f"the story drives {actor.id}, which keeps its initial speed"
    return None


def _fires_at_once(rule: StoryRule) -> bool:
    when = rule.when
    return (
        when.time is not None
        and when.time.after <= 0.0
        and when.delay <= 0.0
        and when.edge == "none"
    )
