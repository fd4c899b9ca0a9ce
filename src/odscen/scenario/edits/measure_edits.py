"""Changes to the measures of a scenario."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.scenario.checks.measure_checks import measure_problems
from odscen.scenario.checks.scenario_checks import duplicate_ids
from odscen.scenario.document.measures_document import Measure  # noqa: TC001 (read at run time)
from odscen.scenario.document.problems import refuse_errors
from odscen.scenario.edits.edit_registry import edit
from odscen.scenario.edits.edited_parts import drop_part, put_part, with_fields
from odscen.scenario.placing.region import Region

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.lanegraph.graphs import MapGraph
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.signals.light import Light

_WHAT = "measure"


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
    measures, _ = put_part(scenario.measures, measure, what=_WHAT, instead_of=instead_of)
    scenario = with_fields(scenario, measures=measures)
    region = Region.of(graph, scenario.roi)
    refuse_errors([*measure_problems(scenario, region, lights), *duplicate_ids(scenario)])
    return scenario


@edit("Remove {measure}")
def remove_measure(scenario: Scenario, *, measure: str) -> Scenario:
    """Remove a measure by its id.

    Raises
    ------
    NotFoundError
        If there is none.
    """
    return with_fields(scenario, measures=drop_part(scenario.measures, _WHAT, measure))
