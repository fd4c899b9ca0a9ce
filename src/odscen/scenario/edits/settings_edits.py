"""A new scenario, and changes to its name, seed, run and environment."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from odscen.scenario.checks.scenario_checks import roi_problems
from odscen.scenario.document.problems import refuse_errors
from odscen.scenario.document.scenario_document import Environment, MapReference, Scenario
from odscen.scenario.document.validation import validated
from odscen.scenario.edits.edit_registry import edit
from odscen.scenario.edits.edited_parts import (
    changed_part,
    with_fields,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from odscen.lanegraph.graphs import MapGraph
    from odscen.scenario.document.drivers_document import Drivers
    from odscen.scenario.document.scenario_document import Criterion, Simulation


def new_scenario(
    graph: MapGraph, *, name: str, roi: Iterable[str] = (), seed: int = 0, description: str = ""
) -> Scenario:
    """Start an empty scenario on a map.

    Parameters
    ----------
    roi
        Segments of the region of interest, connected; may be left empty and grown later.

    Raises
    ------
    ScenarioError
        If a segment is unknown or the region is in several pieces.
    """
    fields = {
        "name": name,
        "description": description,
        "seed": seed,
        "map": MapReference(
            name=graph.map_name, sha256=graph.map_sha256, spacing=graph.lanes.spacing
        ),
        "roi": tuple(roi),
    }
    scenario = validated(Scenario, fields)
    if scenario.roi:
        refuse_errors(roi_problems(scenario, graph))
    return scenario


@edit("Rename to {name}")
def rename(scenario: Scenario, *, name: str, description: str | None = None) -> Scenario:
    """Give the scenario another name and, if given, another description."""
    changes = {"name": name} if description is None else {"name": name, "description": description}
    return with_fields(scenario, **changes)


@edit("Change the seed")
def set_seed(scenario: Scenario, *, seed: int) -> Scenario:
    """Set the random seed of the open goals and of the run."""
    return with_fields(scenario, seed=seed)


@edit("Change the criteria")
def set_criteria(scenario: Scenario, *, criteria: Sequence[Criterion]) -> Scenario:
    """Say what must come out of a run for it to pass; the whole list, in its order."""
    return with_fields(scenario, criteria=tuple(criteria))


@edit("Change the run's settings")
def set_simulation(scenario: Scenario, **fields: Annotated[Any, Simulation]) -> Scenario:
    """Change fields of :class:`~odscen.scenario.document.scenario_document.Simulation`."""
    return with_fields(scenario, simulation=changed_part(scenario.simulation, fields))


@edit("Change weather and time")
def set_environment(
    scenario: Scenario,
    *,
    preset: str | None = None,
    parameters: Mapping[str, float] | None = None,
    affects_driving: bool | None = None,
) -> Scenario:
    """Change weather and time of day; a new preset drops the old parameters (R33)."""
    fields: dict[str, Any] = {}
    if preset is not None:
        fields = {"preset": preset, "parameters": {}}
    if parameters is not None:
        fields["parameters"] = dict(parameters)
    if affects_driving is not None:
        fields["affects_driving"] = affects_driving
    environment: Environment = changed_part(scenario.environment, fields)
    return with_fields(scenario, environment=environment)


@edit("Change how drivers drive")
def set_drivers(scenario: Scenario, **fields: Annotated[Any, Drivers]) -> Scenario:
    """Change fields of :class:`~odscen.scenario.document.scenario_document.Drivers`."""
    return with_fields(scenario, drivers=changed_part(scenario.drivers, fields))
