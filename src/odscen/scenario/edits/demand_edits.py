"""Changes to the demand of a scenario."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, TypeVar

from odscen.base.errors import NotFoundError
from odscen.scenario.checks.demand_checks import demand_problems
from odscen.scenario.checks.scenario_checks import duplicate_ids
from odscen.scenario.document.document_parts import Identifier  # noqa: TC001 (read at run time)
from odscen.scenario.document.parking_document import TripParking
from odscen.scenario.document.problems import refuse_errors
from odscen.scenario.document.routes_document import RouteChoice
from odscen.scenario.document.scenario_document import (
    Background,
    Counts,
    Demand,
    Matrix,
    Profile,
    Scenario,
    VehicleInput,
    Zone,
)
from odscen.scenario.document.validation import validated
from odscen.scenario.edits.edit_registry import edit
from odscen.scenario.placing.region import Region

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.lanegraph.graphs import MapGraph

_Part = TypeVar("_Part", bound=Zone | Profile | VehicleInput | Matrix | Counts | Background)


@edit("Change the time of day at the start")
def set_clock(scenario: Scenario, *, clock: float) -> Scenario:
    """Set the time of day at the start of the run, seconds after midnight."""
    return _changed(scenario, clock=clock)


@edit("Routes of trips")
def set_routes(
    scenario: Scenario, graph: MapGraph, **fields: Annotated[Any, RouteChoice]
) -> Scenario:
    """Change how trips of the demand choose their routes.

    Parameters
    ----------
    fields
        Fields of :class:`~odscen.scenario.document.routes_document.RouteChoice`, such as ``by``;
        those not given stay as they are.

    Raises
    ------
    ScenarioError
        If a zone or segment is unknown or outside the region.
    """
    old = scenario.demand.routes
    kept = {name: getattr(old, name) for name in RouteChoice.model_fields}
    return _checked(_changed(scenario, routes=validated(RouteChoice, {**kept, **fields})), graph)


@edit("Parking of trips")
def set_parking(scenario: Scenario, **fields: Annotated[Any, TripParking]) -> Scenario:
    """Change which trips of the demand begin and end in parking places.

    Parameters
    ----------
    fields
        Fields of :class:`~odscen.scenario.document.parking_document.TripParking`, such as ``end``;
        those not given stay as they are.
    """
    old = scenario.demand.parking
    kept = {name: getattr(old, name) for name in TripParking.model_fields}
    return _changed(scenario, parking=validated(TripParking, {**kept, **fields}))


@edit("Zone {zone}")
def set_zone(
    scenario: Scenario, graph: MapGraph, *, zone: Identifier, segments: Sequence[str]
) -> Scenario:
    """Give segments a name that matrices can use; a zone of that name is replaced."""
    part = validated(Zone, {"id": zone, "segments": tuple(segments)})
    return _checked(_changed(scenario, zones=_put(scenario.demand.zones, part)), graph)


@edit("Day profile {profile}")
def set_profile(
    scenario: Scenario, graph: MapGraph, *, profile: Identifier, shares: Sequence[float]
) -> Scenario:
    """Give the scenario a day profile of its own; one of that name is replaced."""
    part = validated(Profile, {"id": profile, "shares": tuple(shares)})
    return _checked(_changed(scenario, profiles=_put(scenario.demand.profiles, part)), graph)


@edit("Vehicle input {inflow}")
def set_input(
    scenario: Scenario,
    graph: MapGraph,
    *,
    inflow: Identifier,
    **fields: Annotated[Any, VehicleInput],
) -> Scenario:
    """Add vehicles that drive in at the boundary of the region, or change those of that name.

    Parameters
    ----------
    fields
        Fields of a :class:`~odscen.scenario.document.scenario_document.VehicleInput`,
        such as ``segment``; those not given stay as they are, except that ``per_hour`` takes the
        place of ``volumes`` and the other way round.

    Raises
    ------
    ScenarioError
        If no lane leads into the region there, or to where the vehicles go, or the name is taken.
    """
    old = scenario.demand.inputs
    if {"per_hour", "volumes"} & fields.keys():
        fields = {"per_hour": None, "volumes": (), **fields}
    part = _part(VehicleInput, old, inflow, fields)
    return _checked(_changed(scenario, inputs=_put(old, part)), graph)


@edit("Trips {matrix}")
def set_matrix(
    scenario: Scenario, graph: MapGraph, *, matrix: Identifier, **fields: Annotated[Any, Matrix]
) -> Scenario:
    """Add trips from where to where, or change those of that name.

    Parameters
    ----------
    fields
        Fields of a :class:`~odscen.scenario.document.scenario_document.Matrix`,
        such as ``trips``; those not given stay as they are.

    Raises
    ------
    ScenarioError
        If an origin or destination is unknown or outside the region, or the name is taken.
    """
    old = scenario.demand.matrices
    part = _part(Matrix, old, matrix, fields)
    return _checked(_changed(scenario, matrices=_put(old, part)), graph)


@edit("Counts {counts}")
def set_counts(
    scenario: Scenario, graph: MapGraph, *, counts: Identifier, **fields: Annotated[Any, Counts]
) -> Scenario:
    """Add counts that traffic is to reproduce, or change those of that name.

    Counts that contradict each other are accepted;
    :func:`odscen.scenario.checks.scenario_checks.check` names them.

    Parameters
    ----------
    fields
        Fields of :class:`~odscen.scenario.document.scenario_document.Counts`,
        such as ``rows``; those not given stay as they are.

    Raises
    ------
    ScenarioError
        If a place is unknown or outside the region, or was counted twice.
    """
    old = scenario.demand.counts
    part = _part(Counts, old, counts, fields)
    return _checked(_changed(scenario, counts=_put(old, part)), graph)


@edit("Background traffic {background}")
def set_background(
    scenario: Scenario,
    graph: MapGraph,
    *,
    background: Identifier,
    **fields: Annotated[Any, Background],
) -> Scenario:
    """Add background traffic, or change that of this name.

    Parameters
    ----------
    fields
        Fields of :class:`~odscen.scenario.document.scenario_document.Background`,
        such as ``per_km``; those not given stay as they are, except that one amount takes the place
        of another.
    """
    old = scenario.demand.background
    amounts = {"fill", "per_km", "trips"}
    if amounts & fields.keys():
        fields = {**dict.fromkeys(amounts), **fields}
    part = _part(Background, old, background, fields)
    return _checked(_changed(scenario, background=_put(old, part)), graph)


@edit("Remove {part}")
def remove_demand(scenario: Scenario, graph: MapGraph, *, part: str) -> Scenario:
    """Remove a zone, profile, input, matrix, set of counts or background traffic by its name.

    Raises
    ------
    NotFoundError
        If there is none of that name.
    ScenarioError
        If another part of the demand, or a flow, uses it.
    """
    kinds = ("zones", "profiles", "inputs", "matrices", "counts", "background")
    for kind in kinds:
        ones = getattr(scenario.demand, kind)
        left = tuple(one for one in ones if one.id != part)
        if len(left) < len(ones):
            return _checked(_changed(scenario, **{kind: left}), graph)
    raise NotFoundError(
        "part of the demand",
        part,
        [one.id for kind in kinds for one in getattr(scenario.demand, kind)],
    )


def _part(model: type[_Part], ones: tuple[_Part, ...], name: str, fields: dict[str, Any]) -> _Part:
    """Part of that name with some fields changed, or a new one."""
    old = next((one for one in ones if one.id == name), None)
    kept = {} if old is None else {field: getattr(old, field) for field in model.model_fields}
    return validated(model, {**kept, **fields, "id": name})


def _put(ones: tuple[_Part, ...], part: _Part) -> tuple[_Part, ...]:
    """Put a part in the place of that with its name, or at the end."""
    if all(one.id != part.id for one in ones):
        return (*ones, part)
    return tuple(part if one.id == part.id else one for one in ones)


def _changed(scenario: Scenario, **changes: Any) -> Scenario:
    fields = {name: getattr(scenario.demand, name) for name in Demand.model_fields}
    demand = validated(Demand, {**fields, **changes})
    return scenario.model_copy(update={"demand": demand})


def _checked(scenario: Scenario, graph: MapGraph) -> Scenario:
    """Return the scenario if its demand can be right; what is only unusual passes."""
    region = Region.of(graph, scenario.roi)
    refuse_errors([*demand_problems(scenario, region), *duplicate_ids(scenario)])
    return scenario
