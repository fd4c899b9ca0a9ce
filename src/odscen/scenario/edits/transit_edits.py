"""Changes to the public transport of a scenario."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, TypeVar

from odscen.base.errors import NotFoundError
from odscen.scenario.checks.scenario_checks import duplicate_ids
from odscen.scenario.checks.transit_checks import transit_problems
from odscen.scenario.document.document_parts import Identifier  # noqa: TC001 (read at run time)
from odscen.scenario.document.problems import refuse_errors
from odscen.scenario.document.transit_document import TransitLine, TransitStop
from odscen.scenario.document.validation import validated
from odscen.scenario.edits.edit_registry import edit
from odscen.scenario.edits.edited_parts import changed_part
from odscen.scenario.placing.region import Region

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.lanegraph.graphs import MapGraph
    from odscen.scenario.document.scenario_document import Scenario

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
        Fields of :class:`~odscen.scenario.document.transit_document.TransitStop`, such as
        ``node``; those not given stay as they are.

    Raises
    ------
    ScenarioError
        If there can be no stop, or a line cannot be driven any more.
    """
    stops = _put(scenario.transit.stops, TransitStop, stop, fields)
    return _checked(scenario, graph, "stops", stops)


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
        Fields of :class:`~odscen.scenario.document.transit_document.TransitLine`, such as
        ``stops``; those not given stay as they are, except that ``headway`` takes the place of
        ``departures`` and the other way round.

    Raises
    ------
    ScenarioError
        If a stop is unknown, or no way leads from one to the next.
    """
    if {"headway", "departures"} & fields.keys():
        fields = {"headway": None, "departures": (), **fields}
    lines = _put(scenario.transit.lines, TransitLine, line, fields)
    return _checked(scenario, graph, "lines", lines)


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
        left = tuple(one for one in ones if one.id != part)
        if len(left) < len(ones):
            return _checked(scenario, graph, kind, left)
    what = "stop or line"
    known = [line.id for line in scenario.transit.lines]
    raise NotFoundError(what, part, [*known, *(stop.id for stop in scenario.transit.stops)])


def _put(ones: tuple[_One, ...], model: type[_One], name: str, fields: Any) -> list[_One]:
    """Change the one of that name, or add it at the end."""
    if all(one.id != name for one in ones):
        return [*ones, validated(model, {**fields, "id": name})]
    return [changed_part(one, fields) if one.id == name else one for one in ones]


def _checked(
    scenario: Scenario, graph: MapGraph, kind: str, ones: Sequence[TransitStop | TransitLine]
) -> Scenario:
    transit = changed_part(scenario.transit, {kind: tuple(ones)})
    scenario = scenario.model_copy(update={"transit": transit})
    region = Region.of(graph, scenario.roi)
    refuse_errors([*transit_problems(scenario, region), *duplicate_ids(scenario)])
    return scenario
