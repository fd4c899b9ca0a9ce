"""Changes to the measures of a scenario."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.errors import NotFoundError
from odscen.scenario.checks.measure_checks import measure_problems
from odscen.scenario.checks.scenario_checks import duplicate_ids
from odscen.scenario.document.measures_document import Measure  # noqa: TC001 (read at run time)
from odscen.scenario.document.problems import refuse_errors
from odscen.scenario.edits.edit_registry import edit
from odscen.scenario.edits.edited_parts import with_fields
from odscen.scenario.placing.region import Region

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.lanegraph.graphs import MapGraph
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.signals.light import Light


@edit("Measure {measure.id}")
def set_measure(
    scenario: Scenario, graph: MapGraph, lights: Sequence[Light] | None = None, *, measure: Measure
) -> Scenario:
    """Add a measure, or put it in the place of that with its id; of another kind, too.

    Parameters
    ----------
    lights
        Traffic lights of the map, for the rules on outages.

    Raises
    ------
    ScenarioError
        If the map has no such place or light, or the id is taken.
    """
    old = scenario.measures
    if all(one.id != measure.id for one in old):
        return _checked(scenario, graph, lights, (*old, measure))
    return _checked(
        scenario, graph, lights, tuple(measure if one.id == measure.id else one for one in old)
    )


@edit("Remove {measure}")
def remove_measure(scenario: Scenario, *, measure: str) -> Scenario:
    """Remove a measure by its id.

    Raises
    ------
    NotFoundError
        If there is none.
    """
    left = tuple(one for one in scenario.measures if one.id != measure)
    if len(left) == len(scenario.measures):
        what = "measure"
        raise NotFoundError(what, measure, [one.id for one in scenario.measures])
    return with_fields(scenario, measures=left)


def _checked(
    scenario: Scenario,
    graph: MapGraph,
    lights: Sequence[Light] | None,
    measures: tuple[Measure, ...],
) -> Scenario:
    """Return the scenario if its measures can act; what is only unusual passes."""
    scenario = with_fields(scenario, measures=measures)
    region = Region.of(graph, scenario.roi)
    refuse_errors([*measure_problems(scenario, region, lights), *duplicate_ids(scenario)])
    return scenario
