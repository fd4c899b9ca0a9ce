"""The ego that another program drives in CARLA: SUMO's ego is put where that one is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Self

from odscen.base.frames import CarlaPose, XodrPose, xodr_to_carla
from odscen.carla.mirror.foreign_actors import front_of
from odscen.carla.server.batch import HEROES, ActorPlace
from odscen.sumo.worker.protocol import EgoPose as SumoPlace

if TYPE_CHECKING:
    from odscen.carla.server.carla_server import Server
    from odscen.records.run_plan import Plan
    from odscen.sumo.runner.in_step import Step

LIFT = 0.3
"""Metres above the road at which a hero of ours is made; it has physics and comes down."""


class ExternalEgo:
    """The hero on the server.

    Attributes
    ----------
    row
        Row of the plan of SUMO's ego.
    hero
        Its actor.
    """

    def __init__(self, server: Server, plan: Plan, row: int, hero: int, ahead: float) -> None:
        self.row = row
        self._server = server
        self._offset = plan.net_offset
        self._length = plan.actors[row].length
        self.hero = hero
        self._ahead = ahead

    @classmethod
    def take(cls, server: Server, plan: Plan, row: int, blueprint: str) -> Self:
        """Take the hero that is there; make one at the ego's spawn if there is none.

        One that we make has physics and no driver: the program that is to drive it finds it by
        its role. It is taken away at the end; one that was there stays.
        """
        hero = server.find_role(*HEROES)
        if hero is None:
            actor = plan.actors[row]
            pose = xodr_to_carla(XodrPose(actor.x, actor.y, actor.z, actor.hdg))
            at = ActorPlace(
                float(pose.x), float(pose.y), float(pose.z) + LIFT, 0.0, float(pose.yaw_deg)
            )
            hero = server.spawn_free(blueprint, HEROES[0], at)
        return cls(server, plan, row, hero, server.shape(hero).centre[0])

    def place(self) -> tuple[float, float, float]:
        """Where the hero is in the newest state; metres, OpenDRIVE frame."""
        at = self._server.place(self.hero)
        return at.x, -at.y, at.z

    def driven(self, step: Step) -> SumoPlace | None:
        """Where the hero is now, as SUMO has it; ``None`` while SUMO's ego is not on the road."""
        if self.row not in step.index:
            return None
        at = self._server.place(self.hero)
        front = front_of(
            CarlaPose(at.x, at.y, at.z, at.yaw, at.pitch),
            ahead=self._ahead,
            length=self._length,
            net_offset=self._offset,
        )
        speed = self._server.speed(self.hero, at)
        return SumoPlace(float(front.x), float(front.y), float(front.angle_deg), speed)
