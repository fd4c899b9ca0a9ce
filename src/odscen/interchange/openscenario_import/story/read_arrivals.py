"""``SynchronizeAction``: two that are to be at their places at one instant."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from odscen.interchange.openscenario_import.import_report import RefusedError

if TYPE_CHECKING:
    from lxml.etree import _Element

    from odscen.interchange.openscenario_import.story.read_actions import ActionReader
    from odscen.interchange.openscenario_import.world.read_entities import ReadEntity

Made = dict[str, Any]


def arriving(read: ActionReader, kind: _Element, entity: ReadEntity) -> Made:
    """Action of a rule that a ``SynchronizeAction`` is.

    Raises
    ------
    RefusedError
        If it lacks a place, or its other entity is not an actor.
    """
    report = read.conditions.report
    name = kind.get("masterEntityRef", "")
    if name not in read.conditions.entities:
        raise RefusedError(kind, f"entity {name!r} is not among the actors")
    found = {}
    for field_name, tag, who in (
        ("when_at", "TargetPositionMaster", read.conditions.entities[name]),
        ("at", "TargetPosition", entity),
    ):
        place = report.child(kind, tag)
        if place is None:
            raise RefusedError(kind, f"{kind.tag} without {tag}")
        found[field_name] = read.conditions.point_or_node(place, ahead=who.ahead)
    found |= _on_arrival(read, kind, read.conditions.entities[name].id)
    return {"arrive": {**found, "to": read.conditions.entities[name].id}}


def _on_arrival(read: ActionReader, kind: _Element, other: str) -> Made:
    """Speed on arrival, and the metres before the place at which it is reached."""
    report = read.conditions.report
    final = report.child(kind, "FinalSpeed")
    target = None if final is None else report.child(final)
    if target is None:
        return {}
    value = report.number(target, "value")
    if target.tag == "RelativeSpeedToMaster":
        base = read.speeds.get(other, 0.0)
        words = f"relative to {base:g} m/s, the last speed that the file gives for {other!r}"
        report.mark(target, "approximated", words)
        value = base * value if target.get("speedTargetValueType") == "factor" else base + value
    value = min(max(value, 0.0), 100.0)
    state = report.child(target)
    if state is None:
        return {"speed": value}
    if value == 0:
        report.mark(state, "approximated", "it comes to a standstill at the place")
        return {"speed": value}
    by_time = state.tag == "TargetTimeSteadyState"
    metres = value * report.number(state, "time") if by_time else report.number(state, "distance")
    return {"speed": value, "steady": max(metres, 0.0)}
