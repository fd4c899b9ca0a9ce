"""What rules have taken over of an actor, and who acts when an action begins.

What is not taken over is SUMO's. In a step several laws may follow one another; the metres of the
step are the sum of theirs, so that motion begins and ends at the instant and not with the step.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.scenario.story.motion_laws import (
    SideLaw,
    heading_on,
    law_from_state,
    line_length,
    point_on,
    steady,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.scenario.story.motion_laws import AnyLaw
    from odscen.scenario.story.road_view import ActorView, Point, RoadView


_BEND = 5.0
"""Metres before and behind a place of a line between which its curvature is taken."""
_SLOWEST = 0.2
"""Least pace on the ground over that along the line: inside a bend as tight as the offset."""
_HALVINGS = 60


class Pose(NamedTuple):
    """Where an actor is put: the front of a vehicle, the centre of a person; OpenDRIVE frame."""

    x: float
    y: float
    hdg: float


@dataclass(frozen=True, slots=True)
class WantedMove:
    """What is wanted of an actor in a step.

    Attributes
    ----------
    speed
        Mean speed over the step, m/s; ``None`` if SUMO chooses it.
    exact
        Whether that speed is taken whatever SUMO's driver would do; otherwise the driver may go
        slower: for who is ahead, for red and right of way.
    pose
        Where the actor is at the end of the step; ``None`` if it follows its lane or walk.
    ignore_red, ignore_right_of_way
        What the driver does not heed.
    keeps_lane
        Whether it changes lanes only where its route needs it.
    follows_lane
        Whether it goes where its lane leads, if that is off its route and it is there.
    rejoins
        Whether a person is back on foot: SUMO leads it on to its goal.
    vanishes
        Whether it leaves the simulation.
    goal
        Node that it goes to from now on; ``None`` leaves its goal.
    lights
        Lights that are on, and no others; ``None`` leaves them to the driver.
    """

    speed: float | None = None
    exact: bool = False
    pose: Pose | None = None
    ignore_red: bool = False
    ignore_right_of_way: bool = False
    keeps_lane: bool = False
    follows_lane: bool = False
    rejoins: bool = False
    vanishes: bool = False
    goal: str | None = None
    lights: tuple[str, ...] | None = None


@dataclass(slots=True)
class Channel:
    """What is taken over of one actor.

    Attributes
    ----------
    law, exact
        How its speed goes, and whether exactly so; ``None`` is SUMO's.
    borrowed
        Whether the law is there only because the actor is moved along a line.
    line, along, side
        Where it is moved along: how far it has come, metres, and the offset.
    headings
        Where the actor looks at each point of the line; along the line without.
    behind, backwards
        How far behind the front of a vehicle the point is that is on the line, metres, and whether
        it heads against it.
    held
        Whether a person stays at the end of its line.
    leaves
        Whether the line is over with this step; SUMO leads a person on from there.
    settles
        Whether the law has ended in this step, so that its last speed is reached in the next.
    speed_owner, line_owner
        Who has taken over speed and place: rule and number of the action.
    by_story, usually_by_story
        Whether the story alone drives the vehicle now, and whenever no rule says who does: what no
        rule moves then keeps its speed and lane, whatever is in the way.
    """

    law: AnyLaw | None = None
    exact: bool = False
    borrowed: bool = False
    line: tuple[Point, ...] | None = None
    headings: tuple[float, ...] | None = None
    along: float = 0.0
    side: SideLaw | None = None
    behind: float = 0.0
    backwards: bool = False
    held: bool = False
    leaves: bool = False
    settles: bool = False
    rejoins: bool = False
    vanishes: bool = False
    ignore_red: bool = False
    ignore_right_of_way: bool = False
    keeps_lane: bool = False
    goal: str | None = None
    lights: tuple[str, ...] | None = None
    speed_owner: str | None = None
    line_owner: str | None = None
    by_story: bool = False
    usually_by_story: bool = False
    _laws: list[tuple[float, AnyLaw]] = field(default_factory=list)
    _forced: bool = False

    @property
    def idle(self) -> bool:
        """Whether nothing is taken over, nor will be: another one would do as well."""
        if self.by_story or self.usually_by_story:
            return False
        return self.law is None and self.line is None and not (self.leaves or self.settles)

    def begin_step(self, view: ActorView, time: float) -> None:
        """Begin a step at ``time``: from here on laws follow one another."""
        if self.leaves:
            self.release_line()
            if view.person:
                self.law, self.exact, self.rejoins = None, False, True
        self._forced = self.law is not None and (self.exact or self.settles)
        self.settles = False
        own = self.law if self.law is not None and self._forced else steady(time, view.speed)
        self._laws = [(time, own)]

    def speed(self, instant: float) -> float:
        """Speed at an instant of this step."""
        return self._laws[-1][1].speed(instant)

    def metres(self, begin: float, end: float) -> float:
        """Metres between two instants of this step, or from the last law on beyond it."""
        total = 0.0
        stops = [start for start, _ in self._laws[1:]] + [math.inf]
        for (start, law), stop in zip(self._laws, stops, strict=True):
            first, last = max(begin, start), min(end, stop)
            if last > first:
                total += law.metres(first, last)
        return total

    def take_speed(self, law: AnyLaw, owner: str | None, *, exact: bool = True) -> None:
        """Take over the speed from the beginning of a law on."""
        if law.begin <= self._laws[-1][0]:
            self._laws.pop()
        self._laws.append((law.begin, law))
        self.law, self.exact, self.speed_owner, self.borrowed = law, exact, owner, False
        self._forced = self._forced or exact

    def keep_speed(self) -> None:
        """Let the driver keep the last speed of the law, as far as traffic allows."""
        self.speed_owner = None
        self.exact = self.by_story or self.line is not None
        self.settles = True

    def release_speed(self, instant: float) -> None:
        """Give the speed back to SUMO; in what is left of the step it stays.

        If the story alone drives, it stays for longer.
        """
        law = steady(instant, self.speed(instant))
        self.take_speed(law, None, exact=self.by_story)
        if self.by_story:
            return
        self.law = None
        if self.line is not None:
            self.law, self.borrowed, self.exact = law, True, True

    def take_line(
        self,
        line: tuple[Point, ...],
        along: float,
        side: SideLaw | None,
        owner: str,
        instant: float,
        *,
        headings: tuple[float, ...] | None = None,
        behind: float = 0.0,
        backwards: bool = False,
    ) -> None:
        """Lead the actor along a line, on which it has come ``along`` metres at ``instant``."""
        self.line, self.side, self.line_owner, self.headings = line, side, owner, headings
        self.behind, self.backwards = behind, backwards
        self.held = self.leaves = self.rejoins = False
        # What is covered in this step before the instant is added at its end.
        self.along = along - self.metres(self._laws[0][0], instant)
        if self.law is None:
            self.take_speed(steady(instant, self.speed(instant)), None)
            self.borrowed = True
        self.exact = self._forced = True

    def release_line(self) -> None:
        """Leave the line."""
        self.line = self.side = self.line_owner = self.headings = None
        self.behind, self.backwards = 0.0, False
        self.held = self.leaves = False
        if self.by_story:
            self.borrowed, self.exact = False, True
            return
        if self.borrowed:
            self.law, self.borrowed = None, False
        self.exact = self.law is not None and self.speed_owner is not None

    def drive_by_story(self, time: float, speed: float | None = None) -> None:
        """Let the story alone drive from an instant of this step on, at a speed or at its own."""
        self.by_story = True
        if self.law is None or speed is not None:
            own = self.speed(time) if speed is None else speed
            self.take_speed(steady(time, own), None)
        self.exact = self._forced = True

    def drive_by_sumo(self, instant: float) -> None:
        """Let SUMO drive from an instant of this step on: no rule has its speed or lane."""
        self.by_story = self.keeps_lane = False
        self.release_line()
        self.release_speed(instant)

    def reaches_end(self, time: float, until: float) -> float | None:
        """Instant in this step at which the end of the line is reached, if it is."""
        return None if self.line is None else self.reaches(line_length(self.line), time, until)

    def reaches(self, along: float, time: float, until: float) -> float | None:
        """Instant in this step, begun at ``time``, at which so many metres of the line are reached.

        ``None`` if they are not.
        """
        rest = along - self.along
        if self.metres(time, until) < rest - 1e-9:
            return None
        early, late = time, until
        for _ in range(_HALVINGS):
            middle = (early + late) / 2.0
            if self.metres(time, middle) < rest:
                early = middle
            else:
                late = middle
        return late

    def end_step(self, time: float, step: float, *, person: bool) -> WantedMove:
        """What is wanted in the step that began at ``time``."""
        metres = self.metres(time, time + step)
        pose = None
        if self.line is not None:
            if self.held:
                self.along = line_length(self.line)
            else:
                self.along += metres * self._pace_along()
            pose = self._pose_at(time + step, person=person)
        speed = metres / step if self._forced else None
        if speed is None and self.law is not None:
            speed = self.law.v1
        move = WantedMove(
            speed=speed,
            exact=self._forced,
            pose=pose,
            ignore_red=self.ignore_red,
            ignore_right_of_way=self.ignore_right_of_way,
            keeps_lane=self.keeps_lane or self.by_story,
            follows_lane=self.by_story and pose is None,
            rejoins=self.rejoins,
            vanishes=self.vanishes,
            goal=self.goal,
            lights=self.lights,
        )
        self.rejoins, self.goal = False, None
        return move

    def _pace_along(self) -> float:
        """Metres of the line for each that the actor covers: beside a bend it is 1/(1 - k e).

        k is the curvature of the line there, 1/m, positive to the left, and e the offset.
        """
        line, side = self.line or (), self.side
        if side is None or len(line) < 3:
            return 1.0
        ahead, behind = (point_on(line, self.along + way * _BEND).hdg for way in (1.0, -1.0))
        curvature = math.remainder(ahead - behind, math.tau) / (2.0 * _BEND)
        left = side.offset(self._laws[0][0], self.along)
        return 1.0 / max(1.0 - curvature * left, _SLOWEST)

    def centre_along(self, actor: ActorView) -> float:
        """Metres along the line at which the centre of an actor's body is."""
        ahead = 0.0 if actor.person else self.behind - actor.length / 2.0
        return self.along + (-ahead if self.backwards else ahead)

    def _pose_at(self, instant: float, *, person: bool) -> Pose:
        line = self.line or ()
        along = min(self.along, line_length(line)) if person else self.along
        left = self.side.offset(instant, along) if self.side else 0.0
        found = point_on(line, along, left=left)
        if self.headings is not None:
            return Pose(found.x, found.y, heading_on(line, self.headings, along))
        speed = self.speed(instant)
        aside = self.side.sideways(instant, along, speed) if self.side else 0.0
        turned = math.atan2(aside, speed) if speed else 0.0
        hdg = found.hdg + turned + (math.pi if self.backwards else 0.0)
        ahead = self.behind
        return Pose(found.x + ahead * math.cos(hdg), found.y + ahead * math.sin(hdg), hdg)

    def state(self) -> dict[str, Any]:
        """What has to be remembered, for JSON."""
        data = asdict(self)
        return {key: value for key, value in data.items() if not key.startswith("_")}

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> Channel:
        """Inverse of :meth:`state`."""
        data = dict(state)
        data["law"] = law_from_state(data["law"])
        data["side"] = None if data["side"] is None else SideLaw(**data["side"])
        if data["line"] is not None:
            data["line"] = tuple((float(x), float(y)) for x, y in data["line"])
        for name in ("headings", "lights"):
            data[name] = None if data[name] is None else tuple(data[name])
        return cls(**data)


class CannotAct(Exception):  # noqa: N818 - a reason, caught by the story
    """Why an actor cannot do what a rule says."""


class ActingActor(NamedTuple):
    """Who acts, from when on, and what is seen.

    ``instant`` lies in the step that begins at ``view.time`` and lasts ``step`` seconds; ``owner``
    is rule and number of the action. ``channels`` are what rules have taken over of all actors.
    """

    view: RoadView
    actor: ActorView
    channel: Channel
    instant: float
    step: float
    owner: str
    channels: Mapping[str, Channel] = MappingProxyType({})

    @property
    def speed(self) -> float:
        """Speed of the actor at the instant."""
        return self.channel.speed(self.instant)

    def spot(self) -> Point:
        """Where the actor's centre is at the instant, if it goes straight on."""
        ahead = self.channel.metres(self.view.time, self.instant)
        if self.channel.held:
            ahead = 0.0
        view = self.actor
        return view.x + ahead * math.cos(view.hdg), view.y + ahead * math.sin(view.hdg)
