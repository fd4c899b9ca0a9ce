"""``SynchronizeAction``: two that are to be at their places at one instant."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from odscen.formats.openscenario_import.import_report import RefusedError

if TYPE_CHECKING:
    from collections.abc import Container, Mapping

    from lxml.etree import _Element

    from odscen.formats.openscenario_import.import_report import ImportReport
    from odscen.formats.openscenario_import.story.read_conditions import ConditionReader
    from odscen.formats.openscenario_import.world.read_entities import ReadEntity

Made = dict[str, Any]


def arriving(
    conditions: ConditionReader,
    kind: _Element,
    entity: ReadEntity,
    speeds: Mapping[str, float],
    reversing: Container[str],
) -> Made:
    """Action of a rule that a ``SynchronizeAction`` is.

    ``speeds`` are the last ones that actors were asked for, m/s; ``reversing`` those that head
    against their trajectories.

    Raises
    ------
    RefusedError
        If it lacks a place, or its other entity is not an actor.
    """
    report = conditions.report
    name = kind.get("masterEntityRef", "")
    if name not in conditions.entities:
        raise RefusedError(kind, f"entity {name!r} is not among the actors")
    found = {}
    for field_name, tag, who in (
        ("when_at", "TargetPositionMaster", conditions.entities[name]),
        ("at", "TargetPosition", entity),
    ):
        place = report.child(kind, tag)
        if place is None:
            raise RefusedError(kind, f"{kind.tag} without {tag}")
        against = who.id in reversing and place.find("TrajectoryPosition") is not None
        ahead = -who.ahead if against else who.ahead
        found[field_name] = conditions.point_or_node(place, ahead=ahead)
    words = "how its speed goes on the way is not in the standard: players differ by up to 1 m"
    report.mark(kind, "approximated", words)
    found |= _read_arrival_speed(conditions.report, kind, conditions.entities[name].id, speeds)
    return {"arrive": {**found, "to": conditions.entities[name].id}}


def _read_arrival_speed(
    report: ImportReport, kind: _Element, other: str, speeds: Mapping[str, float]
) -> Made:
    """Speed on arrival, and the metres before the place at which it is reached."""
    final = report.child(kind, "FinalSpeed")
    target = None if final is None else report.child(final)
    if target is None:
        return {}
    value = report.number(target, "value")
    if target.tag == "RelativeSpeedToMaster":
        base = speeds.get(other, 0.0)
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
