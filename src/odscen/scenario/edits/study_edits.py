"""Changes to what of a run is analysed, and to where it is measured besides."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from odscen.scenario.checks.study_checks import study_problems
from odscen.scenario.document.problems import refuse_errors
from odscen.scenario.document.study_document import Study
from odscen.scenario.edits.edit_registry import edit
from odscen.scenario.edits.edited_parts import changed_part, with_fields

if TYPE_CHECKING:
    from odscen.lanegraph.graphs import MapGraph
    from odscen.scenario.document.scenario_document import Scenario


@edit("Study")
def set_study(scenario: Scenario, graph: MapGraph, **fields: Annotated[Any, Study]) -> Scenario:
    """Change the warm-up, the analysis interval, or the stations.

    Parameters
    ----------
    fields
        Fields of :class:`~odscen.scenario.document.study_document.Study`; those not given stay as
        they are. Stations are given as the whole list of their kind.

    Raises
    ------
    ScenarioError
        If a station lies on no lane for vehicles of the map, or an id is there twice.
    """
    scenario = with_fields(scenario, study=changed_part(scenario.study, fields))
    refuse_errors(list(study_problems(scenario, graph)))
    return scenario
