"""Changes to the rules of a scenario, and to its measures."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.scenario.checks.measure_checks import measure_errors
from odscen.scenario.checks.rule_checks import rule_problems
from odscen.scenario.checks.scenario_checks import duplicate_ids
from odscen.scenario.document.measures_document import Measure  # noqa: TC001 (read at run time)
from odscen.scenario.document.problems import refuse_errors
from odscen.scenario.document.rules_document import StoryRule  # noqa: TC001 (read at run time)
from odscen.scenario.edits.edit_registry import changed_part, drop_part, edit, put_part, with_fields
from odscen.scenario.placing.region import Region

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.lanegraph.graphs import MapGraph
    from odscen.scenario.document.rules_document import Condition
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.signals.light import Light


_RULE = "rule"


@edit("Rule {rule.id}")
def set_rule(
    scenario: Scenario,
    graph: MapGraph,
    lights: Sequence[Light] | None = None,
    *,
    rule: StoryRule,
    instead_of: str | None = None,
) -> Scenario:
    """Add a rule, or put it in the place of that with its id.

    Parameters
    ----------
    lights
        Traffic lights of the map, for the checks of signals.
    instead_of
        Id of the rule that it replaces, if that has another one: it is renamed, and rules that wait
        for it do so by the new name.

    Raises
    ------
    ScenarioError
        If the rule names an actor, place, light or rule that is not there, or its id is taken.
        What is wrong with other rules is left to the checks, so that they can be mended one after
        another.
    NotFoundError
        If there is no rule ``instead_of``.
    """
    rules, index = put_part(scenario.rules, rule, what=_RULE, instead_of=instead_of)
    if instead_of is not None:
        rules = tuple(
            changed_part(
                story_rule, {"when": _rename_awaited_rule(story_rule.when, instead_of, rule.id)}
            )
            for story_rule in rules
        )
    scenario = with_fields(scenario, rules=rules)
    refuse_errors(rule_problems(scenario, Region.of(graph, scenario.roi), lights, only=index))
    return scenario


@edit("Remove {rule}")
def remove_rule(scenario: Scenario, *, rule: str) -> Scenario:
    """Remove a rule by its id; a rule that waits for it then has an error in the checks.

    Raises
    ------
    NotFoundError
        If there is none.
    """
    return with_fields(scenario, rules=drop_part(scenario.rules, _RULE, rule))


def _rename_awaited_rule(condition: Condition, old: str, new: str) -> Condition:
    """Copy of a condition that waits for the rule ``new`` wherever it waited for ``old``."""
    changes: dict[str, object] = {}
    if condition.rule is not None and condition.rule.id == old:
        changes["rule"] = changed_part(condition.rule, {"id": new})
    if condition.not_ is not None:
        changes["not_"] = _rename_awaited_rule(condition.not_, old, new)
    for join in ("all", "any"):
        if (parts := getattr(condition, join)) is not None:
            changes[join] = tuple(_rename_awaited_rule(part, old, new) for part in parts)
    return changed_part(condition, changes)


_MEASURE = "measure"


@edit("Measure {measure.id}")
def set_measure(
    scenario: Scenario,
    graph: MapGraph,
    lights: Sequence[Light] | None = None,
    *,
    measure: Measure,
    instead_of: str | None = None,
) -> Scenario:
    """Add a measure, or put it in the place of that with its id; of another kind, too.

    Parameters
    ----------
    lights
        Traffic lights of the map, for the rules on outages.
    instead_of
        Id of the measure that it replaces, if that has another one: it is renamed.

    Raises
    ------
    ScenarioError
        If the map has no such place or light, or the id is taken.
    NotFoundError
        If there is no measure ``instead_of``.
    """
    measures, _ = put_part(scenario.measures, measure, what=_MEASURE, instead_of=instead_of)
    scenario = with_fields(scenario, measures=measures)
    region = Region.of(graph, scenario.roi)
    refuse_errors([*measure_errors(scenario, region, lights), *duplicate_ids(scenario)])
    return scenario


@edit("Remove {measure}")
def remove_measure(scenario: Scenario, *, measure: str) -> Scenario:
    """Remove a measure by its id.

    Raises
    ------
    NotFoundError
        If there is none.
    """
    return with_fields(scenario, measures=drop_part(scenario.measures, _MEASURE, measure))
