"""Trajectories and teleports of the story as paths and recordings."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Any, Final

from odscen.base.categories import Category
from odscen.formats.openscenario.xosc_lines import TrackedPoint, tracked_point
from odscen.formats.openscenario_import.import_report import RefusedError
from odscen.formats.openscenario_import.places.map_points import MapPoint, MovingFrame
from odscen.formats.openscenario_import.places.read_trajectories import read_trajectory

if TYPE_CHECKING:
    from collections.abc import Container

    from lxml.etree import _Element

    from odscen.formats.openscenario_import.import_report import ImportReport
    from odscen.formats.openscenario_import.story.read_conditions import ConditionReader
    from odscen.formats.openscenario_import.world.read_entities import ReadEntity

Made = dict[str, Any]
JUMP: Final = 0.1
"""Seconds that a teleport takes."""


def put_there(centre: MapPoint, speed: float, *, seconds: float = JUMP) -> Made:
    """Recording that puts the centre of an actor at a place, with its heading there."""
    after = centre.moved(seconds * speed)
    rows = [
        [time, round(float(at.x), 4), round(float(at.y), 4), round(float(at.hdg), 6)]
        for time, at in ((0.0, centre), (seconds, after))
    ]
    return {"replay": {"rows": rows}}


def stays(report: ImportReport, kind: _Element, names: Container[str]) -> bool:
    """Whether a teleport leads to where the actor is, as of one that is lifted or lies down.

    ``names`` are those of the actor.
    """
    place = kind.find("Position/RelativeObjectPosition")
    if place is None or place.get("entityRef") not in names:
        return False
    if any(report.number(place, name, 0.0) for name in ("dx", "dy")):
        return False
    for element in kind.iter("*"):
        report.mark(element, "approximated", "it stays where it is: odscen has no height or tilt")
    return True


def lines_up(report: ImportReport, kind: _Element, names: Container[str]) -> bool:
    """Whether a teleport leads to the middle of the lane in which the actor is, along it."""
    place = kind.find("Position/RelativeLanePosition")
    if place is None or place.get("entityRef") not in names:
        return False
    if any(report.number(place, name, 0.0) for name in ("dLane", "ds", "dsLane", "offset")):
        return False
    for element in kind.iter("*"):
        report.mark(element, "approximated", f"to the middle of its lane within {JUMP:g} s")
    return True


def followed(conditions: ConditionReader, kind: _Element, entity: ReadEntity) -> Made:
    """Path of the reference point of an actor along a trajectory.

    Of a file of odscen it is that of the point which the name of the trajectory says.

    Raises
    ------
    RefusedError
        If the trajectory or its times have no counterpart.
    """
    report, positions = conditions.report, conditions.positions
    front = 0.0 if entity.category is Category.PEDESTRIAN else entity.ahead + entity.length / 2
    entities = conditions.entities
    own = next(
        (name for name, known_entity in entities.items() if known_entity is entity), entity.id
    )
    frame = MovingFrame(report, MapPoint(0.0, 0.0, 0.0), positions.side, own)
    with positions.exactly(frame):
        found = read_trajectory(report, positions, kind)
    base = frame.base(kind, entities)
    if base is not None:
        found = [point._replace(at=point.at._replace(x=point.at.x - entities[base].ahead))
                 for point in found]  # fmt: skip
        if base == own and math.cos(found[0].at.hdg) < 0.0:
            raise RefusedError(kind, "a trajectory that begins backwards: actors do not reverse")
    how = _own_tracking(kind) if conditions.own else TrackedPoint(front, backwards=False)
    ahead = front - how.behind
    vertices = [
        (point.time, round(at.x, 4), round(at.y, 4))
        for point in found
        for at in (point.at.moved(-ahead if how.backwards else ahead),)
    ]
    walks = entity.category is Category.PEDESTRIAN
    words = "followed from where the walker is, who stays at its end"
    report.mark(kind, "approximated", words if walks else "followed from where the actor is")
    path = _timed_points(conditions, kind, vertices[1:])
    path |= {} if base is None else {"relative_to": entities[base].id}
    path |= {"behind": round(how.behind, 4)} if how.behind else {}
    path |= {"backwards": True} if how.backwards else {}
    return {"path": path}


def _own_tracking(kind: _Element) -> TrackedPoint:
    line = next(kind.iter("Trajectory"), None)
    return tracked_point("" if line is None else line.get("name", ""))


def _timed_points(
    conditions: ConditionReader, kind: _Element, vertices: list[tuple[float, float, float]]
) -> Made:
    """Points of a path, with their times where the file has timing."""
    report = conditions.report
    reference = report.child(kind, "TimeReference")
    timing = None if reference is None else report.child(reference, "Timing", "None")
    report.child(kind, "TrajectoryFollowingMode")
    points = [list(vertex[1:]) for vertex in vertices]
    if timing is None or timing.tag != "Timing":
        return {"points": points}
    scale, offset = report.number(timing, "scale", 1.0), report.number(timing, "offset", 0.0)
    times = [scale * vertex[0] + offset for vertex in vertices]
    if times[0] <= 0 or any(one >= other for one, other in itertools.pairwise(times)):
        raise RefusedError(timing, "times of vertices that do not grow")
    if not conditions.own:
        words = "at an even speed from time to time; a player may change it in between"
        report.mark(timing, "approximated", words)
    return {"points": points, "times": times}


def teleported(
    conditions: ConditionReader, kind: _Element, entity: ReadEntity, speed: float
) -> Made:
    """Put an actor somewhere: by a recording of 0.1 s there, after which it drives on."""
    report, positions = conditions.report, conditions.positions
    with positions.exactly():
        centre = positions.point(report.only(kind)).moved(entity.ahead)
    report.mark(kind, "approximated", f"it is led there for {JUMP:g} s, and drives on")
    return put_there(centre, speed)
