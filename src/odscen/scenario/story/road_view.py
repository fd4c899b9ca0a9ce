"""What rules see of a run at one instant: the actors that they name, and little else.

Positions are centres of bodies in the OpenDRIVE frame; metres, radians, seconds, m/s.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Protocol

if TYPE_CHECKING:
    from collections.abc import Sequence

Point = tuple[float, float]
MOST_GAIN = 10.0
"""m/s²; what SUMO drives accelerates less."""
_LEAP = 30.0
"""m/s²; nobody gains or brakes so hard but in a step of the speed."""
_ASIDE = 1.0
"""Metres that nobody comes aside of where he looks in one step, but by a change of lanes."""


class LastPose(NamedTuple):
    """Where an actor was: centre of the body, where it looked, and its speed, m/s, if known."""

    x: float
    y: float
    hdg: float
    speed: float | None = None


@dataclass(slots=True)  # not frozen: many are made in each step, and that takes three times as long
class ActorView:
    """An actor on the road.

    Attributes
    ----------
    x, y, hdg
        Centre of the body and where it looks.
    speed, acceleration
        Along ``hdg``.
    travelled
        Metres since it departed.
    standing
        Instant since which it has been standing; ``None`` while it moves.
    off_road
        Whether its centre is on no lane.
    gain
        Most that its speed grows where no rule moves it, m/s².
    """

    id: str
    x: float
    y: float
    hdg: float
    speed: float
    acceleration: float
    length: float
    width: float
    travelled: float
    person: bool
    standing: float | None = None
    off_road: bool = False
    gain: float = MOST_GAIN

    @property
    def velocity(self) -> Point:
        """Along x and y."""
        return self.speed * math.cos(self.hdg), self.speed * math.sin(self.hdg)

    @property
    def corners(self) -> tuple[Point, ...]:
        """Corners of the body, counter-clockwise."""
        along, across = self.length / 2.0, self.width / 2.0
        c, s = math.cos(self.hdg), math.sin(self.hdg)
        return tuple(
            (self.x + a * c - b * s, self.y + a * s + b * c)
            for a, b in (
                (along, across),
                (-along, across),
                (-along, -across),
                (along, -across),
            )
        )


def leapt(before: ActorView | LastPose, now: ActorView, step: float) -> bool:
    """Whether an actor was put aside between two steps, or given another speed at once.

    SUMO changes lanes within one step, and rules speeds. Who follows a bend comes in the middle
    between where he looked and where he looks.
    """
    if before.speed is not None and abs(now.speed - before.speed) > _LEAP * step:
        return True
    hdg = before.hdg + math.remainder(now.hdg - before.hdg, math.tau) / 2.0
    aside = (now.y - before.y) * math.cos(hdg) - (now.x - before.x) * math.sin(hdg)
    return abs(aside) > _ASIDE


class RoadView(Protocol):
    """What conditions ask."""

    @property
    def time(self) -> float:
        """Seconds."""

    def actor(self, name: str) -> ActorView | None:
        """Return an actor, ``None`` if it is not on the road."""

    def gone(self, name: str) -> bool:
        """Whether an actor has left the road for good."""

    def leapt(self, name: str) -> bool:
        """Whether an actor who was there a step before has leapt since, :func:`leapt`."""

    def named(self) -> Sequence[ActorView]:
        """All actors on the road that rules name."""

    def place(self, place: str | Point) -> Point:
        """X and y of a place."""

    def lane_distance(self, actor: str, to: str | Point) -> float | None:
        """Metres along the lanes from the centre of an actor to another's, or to a place.

        ``None`` if its route does not lead there.
        """

    def lane_line(self, actor: str, by: int) -> tuple[Point, ...] | None:
        """Centre line of the lane ``by`` lanes to the left of an actor's, and of where it leads.

        ``None`` if there is no such lane for it. The line ends where the lanes do.
        """

    def lane_line_to(self, actor: str, place: str | Point) -> tuple[Point, ...] | None:
        """Centre line of the lane beside an actor, or its own, that leads to a place.

        ``None`` if none does.
        """

    def walking_speed(self, actor: str) -> float:
        """Speed at which a person walks if no rule says otherwise, m/s."""

    def signal(self, light: str, movement: str) -> str | None:
        """Letter that a movement shows."""

    def rule_changes(self, rule: str, has: str) -> tuple[float, ...]:
        """Instants at which a rule has started, or ended."""
