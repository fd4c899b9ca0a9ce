"""Changes to the rules of a scenario: when this, then that."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.errors import NotFoundError
from odscen.scenario.checks.rule_checks import rule_problems
from odscen.scenario.document.problems import refuse_errors
from odscen.scenario.document.rules_document import StoryRule  # noqa: TC001 (read at run time)
from odscen.scenario.edits.edit_registry import edit
from odscen.scenario.edits.edited_parts import with_fields
from odscen.scenario.placing.region import Region

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.lanegraph.graphs import MapGraph
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.signals.light import Light


@edit("Rule {rule.id}")
def set_rule(
    scenario: Scenario, graph: MapGraph, lights: Sequence[Light] | None = None, *, rule: StoryRule
) -> Scenario:
    """Add a rule, or put it in the place of that with its id.

    Parameters
    ----------
    lights
        Traffic lights of the map, for the checks of signals.

    Raises
    ------
    ScenarioError
        If the rule names an actor, place, light or rule that is not there. What is wrong with other
        rules is left to the checks, so that they can be mended one after another.
    """
    ids = [one.id for one in scenario.rules]
    index = ids.index(rule.id) if rule.id in ids else len(ids)
    rules = (*scenario.rules[:index], rule, *scenario.rules[index + 1 :])
    scenario = with_fields(scenario, rules=rules)
    problems = rule_problems(scenario, Region.of(graph, scenario.roi), lights)
    refuse_errors([one for one in problems if one.where.startswith(f"rules[{index}]")])
    return scenario


@edit("Remove {rule}")
def remove_rule(scenario: Scenario, *, rule: str) -> Scenario:
    """Remove a rule by its id; a rule that waits for it then has an error in the checks.

    Raises
    ------
    NotFoundError
        If there is none.
    """
    left = tuple(one for one in scenario.rules if one.id != rule)
    if len(left) == len(scenario.rules):
        what = "rule"
        raise NotFoundError(what, rule, [one.id for one in scenario.rules])
    return with_fields(scenario, rules=left)
