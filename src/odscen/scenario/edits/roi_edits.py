"""Changes to the region of interest."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from odscen.base.errors import NotFoundError, ScenarioError
from odscen.base.ids import SegmentId
from odscen.lanegraph.query import is_connected, neighbours, removable
from odscen.scenario.checks.actor_checks import vias
from odscen.scenario.edits.edit_registry import (
    PlacedOne,
    all_placed,
    changed_part,
    edit,
    with_fields,
)
from odscen.scenario.placing.region import Region

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.lanegraph.graphs import MapGraph
    from odscen.scenario.document.scenario_document import (
        Actor,
        Flow,
        Scenario,
    )


def eligible_segments(scenario: Scenario, graph: MapGraph) -> tuple[SegmentId, ...]:
    """Segments that :func:`grow_roi` accepts now: every one for the first, then all neighbours."""
    if not scenario.roi:
        return graph.segments.ids
    return tuple(neighbours(graph.segments, [SegmentId(name) for name in scenario.roi]))


def removable_segments(scenario: Scenario, graph: MapGraph) -> tuple[SegmentId, ...]:
    """Segments without which the region stays in one piece: no other can be taken out."""
    return removable(graph.segments, scenario.roi)


@edit("Add segment {segment}")
def grow_roi(scenario: Scenario, graph: MapGraph, segment: str) -> Scenario:
    """Add a segment to the region of interest (R29).

    Raises
    ------
    ScenarioError
        If the segment is inside already, or touches no segment of the region.
    NotFoundError
        If the map has no such segment.
    """
    _require_segment(graph, segment)
    if segment in scenario.roi:
        raise ScenarioError(f"segment {segment!r} is in the region of interest already")
    if segment not in eligible_segments(scenario, graph):
        raise ScenarioError(
            f"segment {segment!r} does not touch the region of interest; add one between first"
        )
    return with_fields(scenario, roi=(*scenario.roi, segment))


@edit("Extend the region")
def extend_roi(scenario: Scenario, graph: MapGraph, segments: Sequence[str]) -> Scenario:
    """Add several segments to the region of interest at once, in any order (R29).

    Parameters
    ----------
    segments
        Those that are inside already change nothing.

    Raises
    ------
    ScenarioError
        If the region would then be in several pieces, or if nothing is added.
    NotFoundError
        If the map has no such segment.
    """
    for segment in segments:
        _require_segment(graph, segment)
    roi = tuple(dict.fromkeys((*scenario.roi, *segments)))
    if len(roi) == len(scenario.roi):
        raise ScenarioError("all of these segments are in the region of interest already")
    if not is_connected(graph.segments, roi):
        raise ScenarioError("with these segments the region of interest would be in several pieces")
    return with_fields(scenario, roi=roi)


@edit("Remove segment {segment}")
def shrink_roi(
    scenario: Scenario, graph: MapGraph, segment: str, *, with_actors: bool = False
) -> Scenario:
    """Take a segment out of the region of interest (R29).

    Parameters
    ----------
    with_actors
        Also remove the actors and flows that start in the segment, open goals that lie in it
        (they are then drawn), and let no route lead through places in it. Without, the segment
        must be free of all of them.

    Raises
    ------
    ScenarioError
        If the segment is not inside, if the rest would be in several pieces, or if actors or flows
        use it.
    """
    _require_segment(graph, segment)
    if segment not in scenario.roi:
        raise ScenarioError(f"segment {segment!r} is not in the region of interest")
    if segment not in removable_segments(scenario, graph):
        raise ScenarioError(
            f"without segment {segment!r} the region of interest would be in several pieces"
        )
    region = Region.of(graph, [segment])
    users = [placed for placed in all_placed(scenario) if _uses_region(region, placed)]
    if users and not with_actors:
        names = ", ".join(repr(user.id) for user in users)
        raise ScenarioError(
            f"segment {segment!r} is where {names} start or go; remove or move them first"
        )
    return with_fields(
        scenario,
        roi=tuple(name for name in scenario.roi if name != segment),
        actors=_clear_from_region(region, scenario.actors),
        flows=_clear_from_region(region, scenario.flows),
    )


def _require_segment(graph: MapGraph, segment: str) -> None:
    if segment not in graph.segments.ids:
        raise NotFoundError("segment", segment, graph.segments.ids)


def _node_inside(region: Region, node: str | None) -> bool:
    place = None if node is None else region.place(node)
    return place is not None and region.holds(place)


def _uses_region(region: Region, actor: Actor | Flow) -> bool:
    return any(_node_inside(region, node) for node in (actor.spawn, actor.goal, *vias(actor)))


def _clear_from_region(region: Region, ones: tuple[PlacedOne, ...]) -> tuple[PlacedOne, ...]:
    """Those that do not start in the region, without goals and places to pass in it."""
    return tuple(
        changed_part(placed, _fields_without_region(region, placed))
        if _uses_region(region, placed)
        else placed
        for placed in ones
        if not _node_inside(region, placed.spawn)
    )


def _fields_without_region(region: Region, actor: Actor | Flow) -> dict[str, Any]:
    changes: dict[str, Any] = {"goal": None} if _node_inside(region, actor.goal) else {}
    kept = tuple(node for node in vias(actor) if not _node_inside(region, node))
    return changes if kept == vias(actor) else changes | {"via": kept}
