"""Changes to flows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from odscen.scenario.checks.actor_checks import Subject
from odscen.scenario.document.scenario_document import (
    Flow,
    Scenario,
)
from odscen.scenario.document.validation import validated
from odscen.scenario.edits.edit_registry import edit
from odscen.scenario.edits.edited_parts import (
    changed_part,
    free_id,
    index_of,
    refuse_placement,
    replaced_at,
    with_fields,
)

if TYPE_CHECKING:
    from odscen.lanegraph.graphs import MapGraph


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
