"""Lines that actors follow: paths and recordings as trajectories."""

from __future__ import annotations

import itertools
import math
import re
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Protocol

from odscen.base.categories import Category
from odscen.formats.openscenario.dialect import xml
from odscen.formats.openscenario.xosc_places import GroundPose, RelativePose
from odscen.formats.openscenario.xosc_presence import private, speed_action
from odscen.formats.openscenario.xosc_triggers import CannotSayError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from lxml.etree import _Element

    from odscen.formats.base import ExportNotes
    from odscen.formats.openscenario.dialect import Dialect
    from odscen.formats.openscenario.xosc_places import Places
    from odscen.scenario.document.rules_document import StoryRule
    from odscen.scenario.document.scenario_document import Actor

_USUAL_SPEED: Final = 10.0
"""m/s of paths without a speed."""
_JUMP: Final = 0.1
"""Seconds that a recording takes which only puts an actor somewhere."""
_RUN_UP: Final = 0.1
"""Metres by which a line begins before its first point, of who is elsewhere by then."""
_ON_IT: Final = 1e-3
"""Metres from a path at which a point is on it."""
_STAYS: Final = frozenset({"appear", "stop", "brake", "lights", "horn", "signal", "ignore"})
"""Actions after which a standing actor is where it was, or where it appears."""


class TrackedPoint(NamedTuple):
    """Metres behind its front of the point of a vehicle on a path, and whether it is reversed."""

    behind: float = 0.0
    backwards: bool = False


_TRACKED: Final = re.compile(r", (-?[\d.]+) m behind the front(, backwards)?$")


def name_of_path(name: str, tracked: TrackedPoint) -> str:
    """Name of a trajectory that says which point of a vehicle follows it, if not the front."""
    if tracked == TrackedPoint():
        return name
    back = ", backwards" if tracked.backwards else ""
    return f"{name}, {tracked.behind!r} m behind the front{back}"


def tracked_point(name: str) -> TrackedPoint:
    """Inverse of :func:`name_of_path`."""
    match = _TRACKED.search(name)
    if match is None:
        return TrackedPoint()
    return TrackedPoint(float(match[1]), backwards=bool(match[2]))


class ActionWriter(Protocol):
    """What makes the actions of rules, as lines need it."""

    @property
    def places(self) -> Places:
        """Nodes and bodies."""

    @property
    def dialect(self) -> Dialect:
        """Of the file."""

    @property
    def notes(self) -> ExportNotes:
        """What is only approximated."""

    @property
    def actors(self) -> Mapping[str, Actor]:
        """Actors of the scenario by id."""

    @property
    def rules(self) -> Sequence[StoryRule]:
        """Rules of the scenario."""

    def before(self, part: Any, actor: str) -> Iterator[Any]:
        """Actions of an actor that stand before one."""

    def trajectory(
        self, name: str, spots: Sequence[GroundPose], times: Sequence[float], *, timed: bool
    ) -> _Element:
        """``RoutingAction`` that leads along points."""


def follow_line(
    dialect: Dialect,
    name: str,
    spots: Sequence[GroundPose],
    times: Sequence[float],
    *,
    clock: str | None,
) -> _Element:
    """``PrivateAction`` that leads along points.

    ``clock``: whether ``times`` (s) are ``absolute``, ``relative`` to its begin, or do not count.
    """
    vertices = [
        xml("Vertex", spot.element(), time=float(time))
        for spot, time in zip(spots, times, strict=True)
    ]
    shape = xml("Shape", xml("Polyline", *vertices))
    line = xml("Trajectory", xml("ParameterDeclarations"), shape, name=name, closed=False)
    timing = xml("None")
    if clock is not None:
        timing = xml("Timing", domainAbsoluteRelative=clock, scale=1.0, offset=0.0)
    follow = xml(
        "FollowTrajectoryAction",
        line if dialect.minor == 0 else None,
        xml("TimeReference", timing),
        xml("TrajectoryFollowingMode", followingMode="position"),
        None if dialect.minor == 0 else xml("TrajectoryRef", line),
    )
    return private(xml("RoutingAction", follow))


def path(made: ActionWriter, part: Any, actor: str, where: str) -> list[_Element]:
    """Trajectory of the reference point of an actor, a point of which follows a path."""
    spots, times = _spots_of_path(made, part), list(part.times or ())
    base = part.relative_to and made.actors.get(part.relative_to)
    own = made.actors[actor]
    walks = own.category is Category.PEDESTRIAN
    tracked = TrackedPoint() if walks else TrackedPoint(part.behind, part.backwards)
    front = 0.0 if walks else made.places.centre_ahead(own) + made.places.body(own).length / 2.0
    front -= tracked.behind
    if tracked.backwards:  # along the line the reference point is then on the other side
        front = -front
        made.notes.approximated.append((where, "it is driven forwards there"))
    begin = _start_of_path(made, part, actor)
    if base:
        begin = GroundPose(0.0, 0.0, 0.0, 0.0).back(made.places.centre_ahead(base))
        begin = begin if base is own else None
    elif begin is None and len(spots) == 1:  # a line of one point is none
        made.notes.approximated.append((where, "it leads there from where the actor begins"))
        begin = made.places.start(own)
    first = spots[0] if begin is None else begin.back(-front)
    line = _add_headings([first, *spots])
    if begin is None:
        line = [line[1].back(_RUN_UP), *_add_headings(spots)]
        made.notes.approximated.append((where, "the actor is put to its first point"))
    if begin is None or abs(front) > _ON_IT:
        made.notes.approximated.append((where, "the reference point follows, not the front"))
    vertices = [begin or line[0].back(front), *(spot.back(front) for spot in line[1:])]
    if base:
        ahead = made.places.centre_ahead(base)
        vertices = [
            RelativePose(vertex.x + ahead, vertex.y, 0.0, vertex.hdg, base.id)
            for vertex in vertices
        ]
    name = name_of_path(f"{actor}: {where}", tracked)
    if times:
        before = 0.0 if begin is not None else 0.99 * times[0]
        return [made.trajectory(name, vertices, [before, *times], timed=True)]
    if part.speeds:
        made.notes.approximated.append((where, "speeds at the points are left out"))
    found = made.trajectory(name, *timed(vertices, part.speed or _USUAL_SPEED), timed=False)
    return [found] if part.speed is None else [found, speed_action(part.speed, "step", "time", 0.0)]


def _spots_of_path(made: ActionWriter, part: Any) -> list[GroundPose]:
    if part.relative_to is None:
        return [made.places.spot(place) for place in part.points]
    if made.dialect.for_scenario_runner:
        raise CannotSayError(
            "a path relative to an actor, which ScenarioRunner does not turn with it"
        )
    if part.relative_to not in made.actors:
        raise CannotSayError(f"a path relative to {part.relative_to!r}, a vehicle of a flow")
    return [GroundPose(x, y, 0.0, 0.0) for x, y in part.points]


def timed(spots: Sequence[GroundPose], speed: float) -> tuple[list[GroundPose], list[float]]:
    """Points of a line, two at least, and seconds after which they are reached at a speed."""
    steps = [math.hypot(b.x - a.x, b.y - a.y) / speed for a, b in itertools.pairwise(spots)]
    times = [0.0, *itertools.accumulate(steps)]
    if len(spots) == 1:  # a line has two points at least
        return [*spots, *spots], [0.0, 1.0]
    return list(spots), times


def replay(made: ActionWriter, part: Any, actor: str, where: str) -> list[_Element]:
    """Trajectory of a recording; a jump if it only puts the actor somewhere."""
    back = made.places.centre_ahead(made.actors[actor])
    level = made.places.start(made.actors[actor]).z
    spots = [GroundPose(x, y, level, hdg).back(back) for _, x, y, hdg in part.rows]
    times = [row[0] for row in part.rows]
    if len(spots) == 2 and times[1] - times[0] <= _JUMP:
        return [private(xml("TeleportAction", spots[0].element()))]
    made.notes.approximated.append((where, "a trajectory, which odscen reads as a path"))
    return [made.trajectory(f"{actor}: {where}", spots, times, timed=True)]


def _start_of_path(made: ActionWriter, part: Any, actor: str) -> GroundPose | None:
    """Where the reference point of an actor is when it begins a path, if that is known.

    It is known at first, and of who stands until then.
    """
    own = made.actors[actor]
    spot: GroundPose | None = made.places.start(own)
    moves = (own.initial_speed or 0.0) > 0.0
    rule = next(
        (rule for rule in made.rules for item in rule.then for p in item.parts if p.path is part),
        None,
    )
    for earlier in made.before(part, actor):
        back = made.places.centre_ahead(own)
        level = made.places.start(own).z
        if earlier.appear is not None and earlier.appear.at is not None:
            x, y, hdg = earlier.appear.at
            spot, moves = GroundPose(x, y, level, hdg).back(back), False
        elif earlier.replay is not None:
            _, x, y, hdg = earlier.replay.rows[-1]
            spot, moves = GroundPose(x, y, level, hdg).back(back), False
        elif earlier.speed is not None:
            moves = moves or earlier.speed.to > 0.0
        elif earlier.kind not in _STAYS:
            moves = True
    at_once = (
        rule is not None
        and rule.when.time is not None
        and not (rule.when.time.after or rule.when.delay)
    )
    return spot if at_once or not moves else None


def _add_headings(spots: Sequence[GroundPose]) -> list[GroundPose]:
    """Spots with the heading of the line through them."""
    poses: list[GroundPose] = []
    for row, spot in enumerate(spots):
        before, after = spots[max(row - 1, 0)], spots[min(row + 1, len(spots) - 1)]
        dx, dy = after.x - before.x, after.y - before.y
        hdg = poses[-1].hdg if poses else spot.hdg  # who stands at a place keeps looking there
        hdg = math.atan2(dy, dx) if math.hypot(dx, dy) > 0.0 else hdg
        poses.append(GroundPose(spot.x, spot.y, spot.z, hdg))
    return poses
