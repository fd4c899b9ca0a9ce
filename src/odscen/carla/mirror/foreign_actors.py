"""Vehicles and pedestrians on the server that are not ours: SUMO's traffic is to see them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.base.categories import Category
from odscen.base.frames import CarlaPose, SumoPose, XodrPose, carla_to_xodr, xodr_to_sumo
from odscen.carla.server.batch import ROLE
from odscen.carla.server.server_models import category_of
from odscen.sumo.realize.driving import KINDS
from odscen.sumo.worker.protocol import ForeignUser

if TYPE_CHECKING:
    from odscen.carla.server.blueprints import Shape
    from odscen.carla.server.carla_server import Server
    from odscen.simulators.assets import Assets

_BODIES = ("vehicle.", "walker.")
_HEIGHT_MARGIN = 20.0
"""Metres below the lowest and above the highest lane beyond which nobody is in the traffic."""
_LEAST_SPEED = 0.01
"""m/s below which an actor reports no speed: without physics all do, and displacement tells it."""


class ForeignRoles(NamedTuple):
    """Whom SUMO is to see: everybody that is not ours, or those with some roles only.

    Attributes
    ----------
    names
        ``role_name`` of those who are seen; ``None`` for all.
    """

    names: tuple[str, ...] | None = None

    def has(self, role_name: str) -> bool:
        """Whether one with a role is seen."""
        return self.names is None or role_name in self.names


class _KnownActor(NamedTuple):
    type_id: str
    role_name: str
    kind: str
    shape: Shape


class ForeignActors:
    """Those that are on the server in its newest state.

    Parameters
    ----------
    net_offset
        Of SUMO's network.
    assets
        Say what a model is, where the server does not.
    heights
        Lowest and highest lane of the map, m: servers keep who is to be away far below.
    left_out
        Actor that is seen already, as SUMO's ego.

    Attributes
    ----------
    seen
        Type and role of all that have been seen, by actor.
    """

    def __init__(
        self,
        server: Server,
        net_offset: tuple[float, float],
        assets: Assets,
        roles: ForeignRoles,
        *,
        heights: tuple[float, float],
        left_out: int | None = None,
    ) -> None:
        self._lowest, self._highest = heights[0] - _HEIGHT_MARGIN, heights[1] + _HEIGHT_MARGIN
        self.seen: dict[int, tuple[str, str]] = {}
        self._server = server
        self._offset = net_offset
        self._assets = assets
        self._roles = roles
        self._known: dict[int, _KnownActor | None] = (
            {left_out: None} if left_out is not None else {}
        )
        self._last: dict[int, tuple[float, float]] = {}
        self._time: float | None = None

    def users(self) -> list[ForeignUser]:
        """All of them, by the number of their actor; front, SUMO frame.

        Raises
        ------
        CarlaError
            If the server does not answer.
        """
        snapshot = self._server.world.get_snapshot()
        ours = self._server.ours
        there = [actor for actor in snapshot if actor.id not in ours]
        fresh = [actor.id for actor in there if actor.id not in self._known]
        if fresh:  # what an actor is never changes, so it is asked for once
            self._register_fresh(fresh)
        now = float(snapshot.timestamp.elapsed_seconds)
        passed = now - self._time if self._time is not None else 0.0
        users, places = [], {}
        for actor in sorted(there, key=lambda actor: actor.id):
            known = self._known[actor.id]
            if known is None:
                continue
            if self._lowest <= actor.get_transform().location.z <= self._highest:
                user, place = self._describe_user(actor, known, passed)
                users.append(user)
                places[actor.id] = place
        self._last, self._time = places, now
        return users

    def _register_fresh(self, fresh: list[int]) -> None:
        self._known.update(dict.fromkeys(fresh))
        for actor in self._server.actors(fresh):
            role = actor.attributes.get("role_name", "")
            if not actor.type_id.startswith(_BODIES) or role.startswith(ROLE):
                continue
            if self._roles.has(role):
                kind = self._find_kind(actor)
                self._known[actor.id] = _KnownActor(
                    actor.type_id, role, kind, self._server.shape(actor.id)
                )
                self.seen[actor.id] = actor.type_id, role

    def _find_kind(self, actor: Any) -> str:
        model = self._assets.blueprints.get(actor.type_id)
        category = category_of(actor.type_id, actor.attributes) if model is None else model.category
        return KINDS[Category(category)].vclass

    def _describe_user(
        self, actor: Any, known: _KnownActor, passed: float
    ) -> tuple[ForeignUser, tuple[float, float]]:
        at, velocity = actor.get_transform(), actor.get_velocity()
        where, turn = at.location, at.rotation
        length = 2.0 * known.shape.extent[0]
        front = front_of(
            CarlaPose(where.x, where.y, where.z, turn.yaw, turn.pitch),
            ahead=known.shape.centre[0],
            length=length,
            net_offset=self._offset,
        )
        vx, vy = velocity.x, velocity.y
        place, last = (where.x, where.y), self._last.get(actor.id)
        if math.hypot(vx, vy) < _LEAST_SPEED and last is not None and passed > 0.0:
            vx, vy = (place[0] - last[0]) / passed, (place[1] - last[1]) / passed
        yaw = math.radians(turn.yaw)
        speed = max(0.0, vx * math.cos(yaw) + vy * math.sin(yaw))
        x, y, angle = float(front.x), float(front.y), float(front.angle_deg)
        width = 2.0 * known.shape.extent[1]
        return ForeignUser(str(actor.id), known.kind, x, y, angle, speed, length, width), place


def front_of(
    origin: CarlaPose, *, ahead: float, length: float, net_offset: tuple[float, float]
) -> SumoPose:
    """Front of a body in SUMO's frame, from its actor's origin.

    Parameters
    ----------
    ahead
        Metres that the middle of the box is ahead of the origin.
    """
    pose = carla_to_xodr(origin)
    # As far ahead of the origin as a front is of a centre, in a body twice as long.
    centre = xodr_to_sumo(pose, length=2.0 * ahead)
    return xodr_to_sumo(
        XodrPose(centre.x, centre.y, centre.z, pose.hdg, pose.pitch),
        length=length,
        net_offset=net_offset,
    )
