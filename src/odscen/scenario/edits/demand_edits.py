"""Changes to the demand of a scenario, to its flows, and to its public transport."""

from __future__ import annotations

from contextlib import contextmanager
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar

from odscen.base.errors import NotFoundError, ScenarioError
from odscen.scenario.checks.actor_checks import Subject
from odscen.scenario.checks.demand_checks import demand_problems, transit_problems
from odscen.scenario.checks.scenario_checks import duplicate_ids
from odscen.scenario.document.document_parts import Identifier  # noqa: TC001 (read at run time)
from odscen.scenario.document.problems import refuse_errors, validated
from odscen.scenario.document.scenario_document import (
    Background,
    Counts,
    Demand,
    Flow,
    Matrix,
    Profile,
    RouteChoice,
    Scenario,
    TransitLine,
    TransitStop,
    TripParking,
    VehicleInput,
    Window,
    Zone,
)
from odscen.scenario.edits.edit_registry import (
    changed_part,
    edit,
    free_id,
    index_of,
    refuse_placement,
    replaced_at,
    with_fields,
)
from odscen.scenario.placing.region import Region

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from odscen.lanegraph.graphs import MapGraph


_Part = TypeVar("_Part", bound=Profile | Counts | Background)


@edit("Change the time of day at the start")
def set_clock(scenario: Scenario, *, clock: float) -> Scenario:
    """Set the time of day at the start of the run, seconds after midnight."""
    return _change_demand(scenario, clock=clock)


@edit("Routes of trips")
def set_routes(
    scenario: Scenario, graph: MapGraph, **fields: Annotated[Any, RouteChoice]
) -> Scenario:
    """Change how trips of the demand choose their routes.

    Parameters
    ----------
    fields
        Fields of :class:`~odscen.scenario.document.scenario_document.RouteChoice`, such as ``by``;
        those not given stay as they are.

    Raises
    ------
    ScenarioError
        If a zone or segment is unknown or outside the region.
    """
    old = scenario.demand.routes
    kept = {name: getattr(old, name) for name in RouteChoice.model_fields}
    return _check_demand(
        _change_demand(scenario, routes=validated(RouteChoice, {**kept, **fields})), graph
    )


@edit("Parking of trips")
def set_parking(scenario: Scenario, **fields: Annotated[Any, TripParking]) -> Scenario:
    """Change which trips of the demand begin and end in parking places.

    Parameters
    ----------
    fields
        Fields of :class:`~odscen.scenario.document.scenario_document.TripParking`, such as ``end``;
        those not given stay as they are.
    """
    old = scenario.demand.parking
    kept = {name: getattr(old, name) for name in TripParking.model_fields}
    return _change_demand(scenario, parking=validated(TripParking, {**kept, **fields}))


@edit("Zone {zone}")
def set_zone(
    scenario: Scenario, graph: MapGraph, *, zone: Identifier, segments: Sequence[str]
) -> Scenario:
    """Give segments a name that matrices can use; a zone of that name is replaced."""
    return put_parts(scenario, graph, "zones", {zone: {"segments": tuple(segments)}})


@edit("Day profile {profile}")
def set_profile(
    scenario: Scenario,
    graph: MapGraph,
    *,
    profile: Identifier,
    shares: Sequence[float],
    begin: float | None = None,
    end: float | None = None,
) -> Scenario:
    """Give the scenario a day profile of its own; one of that name is replaced.

    Parameters
    ----------
    shares
        Relative shares of equal slices of the time from ``begin`` to ``end``.
    begin, end
        Seconds after midnight, whole minutes; the whole day if not given.
    """
    fields = {"id": profile, "shares": tuple(shares), "begin": begin, "end": end}
    part = validated(Profile, fields)
    return _check_demand(
        _change_demand(scenario, profiles=_put_part(scenario.demand.profiles, part)), graph
    )


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
    return put_parts(scenario, graph, "inputs", {inflow: fields})


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
    return put_parts(scenario, graph, "matrices", {matrix: fields})


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
    part = _change_or_make_part(Counts, old, counts, fields)
    return _check_demand(_change_demand(scenario, counts=_put_part(old, part)), graph)


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
    part = _change_or_make_part(Background, old, background, fields)
    return _check_demand(_change_demand(scenario, background=_put_part(old, part)), graph)


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
        left = tuple(known_part for known_part in ones if known_part.id != part)
        if len(left) < len(ones):
            return _check_demand(_change_demand(scenario, **{kind: left}), graph)
    raise NotFoundError(
        "part of the demand",
        part,
        [known_part.id for kind in kinds for known_part in getattr(scenario.demand, kind)],
    )


_NEW: Mapping[str, Any] = MappingProxyType({"arrivals": "random"})
"""Of inputs, trips and background traffic that are made new; documents without it are even."""

_MODELS: Mapping[str, type[Zone | VehicleInput | Matrix]] = MappingProxyType(
    {"zones": Zone, "inputs": VehicleInput, "matrices": Matrix}
)


def put_parts(
    scenario: Scenario,
    graph: MapGraph,
    kind: Literal["zones", "inputs", "matrices"],
    parts: Mapping[str, Mapping[str, Any]],
) -> Scenario:
    """Put many parts into the demand, all or none; each as the edit of its kind does.

    The whole demand is checked once, and not once for each of them.

    Parameters
    ----------
    parts
        Fields of each, by its id; those not given stay as they are where the demand has it already.

    Raises
    ------
    ScenarioError
        With the places of what is wrong, as ``demand.inputs[4].segment``.
    """
    model = _MODELS[kind]
    known = getattr(scenario.demand, kind)
    index_of_part = {part.id: index for index, part in reversed([*enumerate(known)])}
    changed = list(known)
    for name, fields in parts.items():
        index = index_of_part.get(name, len(changed))
        old = changed[index] if index < len(changed) else None
        kept: dict[str, Any] = {}
        if old is not None:
            kept = {field: getattr(old, field) for field in model.model_fields}
        elif kind != "zones":
            kept = dict(_NEW)
        if kind == "inputs" and {"per_hour", "volumes"} & fields.keys():
            kept |= {"per_hour": None, "volumes": ()}
        with _add_place_to_error(f"demand.{kind}[{index}]", when=len(parts) > 1):
            part = validated(model, {**kept, **fields, "id": name})
        if old is None:
            changed.append(part)
        else:
            changed[index] = part
    return _check_demand(_change_demand(scenario, **{kind: tuple(changed)}), graph)


@contextmanager
def _add_place_to_error(where: str, *, when: bool) -> Iterator[None]:
    """Add its place to what is wrong with one of several parts."""
    try:
        yield
    except ScenarioError as failed:
        if when:
            failed.element = where
        raise


def _change_or_make_part(
    model: type[_Part], ones: tuple[_Part, ...], name: str, fields: dict[str, Any]
) -> _Part:
    """Part of that name with some fields changed, or a new one."""
    old = next((known_part for known_part in ones if known_part.id == name), None)
    kept: dict[str, Any] = {}
    if old is not None:
        kept = {field: getattr(old, field) for field in model.model_fields}
    elif issubclass(model, Window):
        kept = dict(_NEW)
    return validated(model, {**kept, **fields, "id": name})


def _put_part(ones: tuple[_Part, ...], part: _Part) -> tuple[_Part, ...]:
    """Put a part in the place of that with its name, or at the end."""
    if all(known_part.id != part.id for known_part in ones):
        return (*ones, part)
    return tuple(part if known_part.id == part.id else known_part for known_part in ones)


def _change_demand(scenario: Scenario, **changes: Any) -> Scenario:
    fields = {name: getattr(scenario.demand, name) for name in Demand.model_fields}
    demand = validated(Demand, {**fields, **changes})
    return scenario.model_copy(update={"demand": demand})


def _check_demand(scenario: Scenario, graph: MapGraph) -> Scenario:
    """Return the scenario if its demand can be right; what is only unusual passes."""
    region = Region.of(graph, scenario.roi)
    refuse_errors([*demand_problems(scenario, region), *duplicate_ids(scenario)])
    return scenario


_One = TypeVar("_One", bound=TransitStop | TransitLine)


@edit("Stop {stop}")
def set_stop(
    scenario: Scenario,
    graph: MapGraph,
    *,
    stop: Identifier,
    **fields: Annotated[Any, TransitStop],
) -> Scenario:
    """Add a stop, or change that of this name.

    Parameters
    ----------
    fields
        Fields of :class:`~odscen.scenario.document.scenario_document.TransitStop`, such as
        ``node``; those not given stay as they are.

    Raises
    ------
    ScenarioError
        If there can be no stop, or a line cannot be driven any more.
    """
    stops = _with_transit_part(scenario.transit.stops, TransitStop, stop, fields)
    return _checked_transit(scenario, graph, "stops", stops)


@edit("Line {line}")
def set_line(
    scenario: Scenario,
    graph: MapGraph,
    *,
    line: Identifier,
    **fields: Annotated[Any, TransitLine],
) -> Scenario:
    """Add a line, or change that of this name.

    Parameters
    ----------
    fields
        Fields of :class:`~odscen.scenario.document.scenario_document.TransitLine`, such as
        ``stops``; those not given stay as they are, except that ``headway`` takes the place of
        ``departures`` and the other way round.

    Raises
    ------
    ScenarioError
        If a stop is unknown, or no way leads from one to the next.
    """
    if {"headway", "departures"} & fields.keys():
        fields = {"headway": None, "departures": (), **fields}
    lines = _with_transit_part(scenario.transit.lines, TransitLine, line, fields)
    return _checked_transit(scenario, graph, "lines", lines)


@edit("Remove {part}")
def remove_transit(scenario: Scenario, graph: MapGraph, *, part: str) -> Scenario:
    """Remove a stop or a line by its name.

    Raises
    ------
    NotFoundError
        If there is none of that name.
    ScenarioError
        If a line serves the stop.
    """
    for kind in ("lines", "stops"):
        ones = getattr(scenario.transit, kind)
        left = tuple(known_part for known_part in ones if known_part.id != part)
        if len(left) < len(ones):
            return _checked_transit(scenario, graph, kind, left)
    what = "stop or line"
    known = [line.id for line in scenario.transit.lines]
    raise NotFoundError(what, part, [*known, *(stop.id for stop in scenario.transit.stops)])


def _with_transit_part(
    ones: tuple[_One, ...], model: type[_One], name: str, fields: Any
) -> list[_One]:
    """Change the one of that name, or add it at the end."""
    if all(known_part.id != name for known_part in ones):
        return [*ones, validated(model, {**fields, "id": name})]
    return [
        changed_part(known_part, fields) if known_part.id == name else known_part
        for known_part in ones
    ]


def _checked_transit(
    scenario: Scenario, graph: MapGraph, kind: str, ones: Sequence[TransitStop | TransitLine]
) -> Scenario:
    transit = changed_part(scenario.transit, {kind: tuple(ones)})
    scenario = scenario.model_copy(update={"transit": transit})
    region = Region.of(graph, scenario.roi)
    refuse_errors([*transit_problems(scenario, region), *duplicate_ids(scenario)])
    return scenario


@edit("Add a stream")
def add_flow(
    scenario: Scenario,
    graph: MapGraph,
    *,
    spawn: str,
    per_hour: float,
    id: str | None = None,  # noqa: A002 - the document's word
    **fields: Annotated[Any, Flow],
) -> Scenario:
    """Put a flow on a node (R44); ``fields`` are further fields of ``Flow``."""
    fields |= {"spawn": spawn, "per_hour": per_hour, "id": id or free_id(scenario, "flow")}
    flow = validated(Flow, fields)
    changed = with_fields(scenario, flows=(*scenario.flows, flow))
    refuse_placement(changed, graph, Subject.flow, len(scenario.flows))
    return changed


@edit("Change {flow}")
def change_flow(
    scenario: Scenario, graph: MapGraph, flow: str, **fields: Annotated[Any, Flow]
) -> Scenario:
    """Change any fields of a flow."""
    index = index_of(scenario.flows, flow)
    new = changed_part(scenario.flows[index], fields)
    changed = with_fields(scenario, flows=replaced_at(scenario.flows, index, new))
    refuse_placement(changed, graph, Subject.flow, index)
    return changed


@edit("Remove {flow}")
def remove_flow(scenario: Scenario, flow: str) -> Scenario:
    """Remove a flow."""
    index = index_of(scenario.flows, flow)
    return with_fields(scenario, flows=scenario.flows[:index] + scenario.flows[index + 1 :])
