"""Who acts when an action begins or goes further, and why it may not be able to."""

from __future__ import annotations

import math
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.scenario.story.channels import Channel
    from odscen.scenario.story.road_view import ActorView, Point, RoadView


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
        one = self.actor
        return one.x + ahead * math.cos(one.hdg), one.y + ahead * math.sin(one.hdg)
