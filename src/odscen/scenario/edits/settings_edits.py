"""A new scenario, and changes to its name, seed, run, environment, study and parameters."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Annotated, Any

from pydantic_core import from_json

from odscen.base.errors import NotFoundError, ScenarioError
from odscen.scenario.checks.scenario_checks import roi_problems, study_problems
from odscen.scenario.document.formulas import evaluate, names_in, put_formula
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.document.problems import refuse_errors, validated
from odscen.scenario.document.scenario_document import (
    Environment,
    MapReference,
    Parameter,
    Scenario,
    Study,
)
from odscen.scenario.edits.edit_registry import changed_part, edit, with_fields

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from odscen.lanegraph.graphs import MapGraph
    from odscen.scenario.document.drivers_document import Drivers
    from odscen.scenario.document.scenario_document import Criterion, Simulation


_WHAT = "parameter"


@edit("Parameter {parameter}")
def set_parameter(
    scenario: Scenario,
    *,
    parameter: str,
    instead_of: str | None = None,
    **fields: Annotated[Any, Parameter],
) -> Scenario:
    """Add a parameter, or change one; every number that is computed from it follows.

    Parameters
    ----------
    parameter
        Its name.
    instead_of
        Name that it has now, if it is renamed; formulas then use the new one.
    fields
        Fields of :class:`~odscen.scenario.document.scenario_document.Parameter`; those not given
        stay as they are, ``None`` takes a bound away. A new one needs a ``value``.

    Raises
    ------
    NotFoundError
        If there is no parameter ``instead_of``.
    ScenarioError
        If the name is taken, the value is outside the bounds, or what follows from it is not
        possible; names each place.
    """
    if instead_of is not None and instead_of != parameter:
        scenario = _rename_parameter_uses(scenario, instead_of, parameter)
    data = from_json(dumps(scenario))
    declaration = data.setdefault("parameters", {}).setdefault(parameter, {})
    declaration |= {name: value for name, value in fields.items() if value is not None}
    for name, value in fields.items():
        if value is None:
            declaration.pop(name, None)
    return loads(json.dumps(data))


@edit("Remove parameter {parameter}")
def remove_parameter(scenario: Scenario, *, parameter: str) -> Scenario:
    """Remove a parameter; numbers that were computed from it stay as they are, without formulas.

    Raises
    ------
    NotFoundError
        If there is none of that name.
    """
    _refuse_unknown(scenario, parameter)
    left = {
        name: declaration for name, declaration in scenario.parameters.items() if name != parameter
    }
    kept = {
        place: text
        for place, text in scenario.formulas.items()
        if parameter not in names_in(text) and place != _value_of(parameter)
    }
    return loads(dumps(scenario.model_copy(update={"parameters": left, "formulas": kept})))


@edit("Formula of {place}")
def set_formula(scenario: Scenario, *, place: str, formula: str | None) -> Scenario:
    """Compute a number of the document from parameters, or let it be a number again.

    Parameters
    ----------
    place
        Of the number, as in ``formulas`` of the document: ``rules/cut-in/when/ttc/below``.
    formula
        Arithmetic with parameters, ``2 * $gap``; ``None`` keeps the number that there is.

    Raises
    ------
    NotFoundError
        If the document has no such place.
    ScenarioError
        If the formula has no value, or one that is not possible there.
    InputError
        If the formula names what is no parameter.
    """
    others = {where: text for where, text in scenario.formulas.items() if where != place}
    alone = scenario.model_copy(update={"formulas": others})
    data = from_json(dumps(alone))
    if formula is None:
        return loads(json.dumps(data))
    evaluate(formula, {name: parameter.value for name, parameter in scenario.parameters.items()})
    if not names_in(formula):
        raise ScenarioError(
            f"{place}: the formula {formula!r} names no parameter; write $gap for one called gap"
        )
    put_formula(data, scenario.model_dump(mode="json"), place, formula)
    return loads(json.dumps(data))


def _rename_parameter_uses(scenario: Scenario, old: str, new: str) -> Scenario:
    _refuse_unknown(scenario, old)
    if new in scenario.parameters:
        raise ScenarioError(f"there is a parameter {new!r} already")
    parameters = {new if name == old else name: p for name, p in scenario.parameters.items()}
    named = re.compile(rf"\${re.escape(old)}(?![A-Za-z0-9_])")
    formulas = {
        _value_of(new) if place == _value_of(old) else place: named.sub(f"${new}", text)
        for place, text in scenario.formulas.items()
    }
    return scenario.model_copy(update={"parameters": parameters, "formulas": formulas})


def _value_of(parameter: str) -> str:
    """Place of its value."""
    return f"parameters/{parameter}/value"


def _refuse_unknown(scenario: Scenario, name: str) -> None:
    if name not in scenario.parameters:
        raise NotFoundError(_WHAT, name, list(scenario.parameters))


@edit("Study")
def set_study(scenario: Scenario, graph: MapGraph, **fields: Annotated[Any, Study]) -> Scenario:
    """Change the warm-up, the analysis interval, or the stations.

    Parameters
    ----------
    fields
        Fields of ``Study`` of the document; those not given stay as
        they are. Stations are given as the whole list of their kind.

    Raises
    ------
    ScenarioError
        If a station lies on no lane for vehicles of the map, or an id is there twice.
    """
    scenario = with_fields(scenario, study=changed_part(scenario.study, fields))
    refuse_errors(list(study_problems(scenario, graph)))
    return scenario


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
