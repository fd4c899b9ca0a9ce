"""The road users of a plan with the bodies that they have on a CARLA server."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from odscen.base.errors import InputError
from odscen.carla.mirror.actor_mirror import Mirror
from odscen.carla.mirror.doors import Doors
from odscen.carla.mirror.ego import ExternalEgo
from odscen.carla.mirror.foreign_actors import ForeignActors
from odscen.carla.mirror.lane_surface import LaneSurface
from odscen.carla.mirror.walking_ground import WalkingGround
from odscen.carla.mirror.wheels import Wheels
from odscen.carla.server.batch import HEROES
from odscen.carla.server.blueprints import choose_blueprints, size_differences
from odscen.carla.server.environment import vehicle_lights, weather_parameters

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.carla.mirror.cosim_options import CosimOptions
    from odscen.carla.server.blueprints import Shape
    from odscen.carla.server.carla_server import Server
    from odscen.records.run_plan import Plan
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.realize.run_map import RunMap


WAKE = 0.9
"""Share of the distance within which actors are awake that pedestrians are shown in."""


@dataclass(frozen=True, slots=True)
class MirroredPlan:
    """A plan that is to be shown on a server.

    Attributes
    ----------
    mirror
        Shows its steps.
    blueprints
        Of each road user, in the plan's order.
    shapes
        Boxes of the blueprints.
    ego
        Who is driven in CARLA.
    foreign
        Who else is on the server and is to be seen by SUMO's traffic.
    ground
        Where pedestrians walk on the server.
    wheels
        How wheels are turned, if the server turns any.
    doors
        How doors are opened, if vehicles have no physics.
    sizes
        Metres by which the length of a blueprint differs from the road user it represents.
    """

    mirror: Mirror
    blueprints: tuple[str, ...]
    shapes: Mapping[str, Shape]
    ego: ExternalEgo | None
    foreign: ForeignActors | None
    ground: WalkingGround
    wheels: Wheels | None
    doors: Doors | None
    sizes: dict[str, float]

    @classmethod
    def on(
        cls, server: Server, scenario: Scenario, on: RunMap, plan: Plan, options: CosimOptions
    ) -> MirroredPlan:
        """Choose bodies, under the scenario's sky; none is spawned yet.

        Raises
        ------
        InputError
            If the ego is to be driven in CARLA and there is none.
        """
        sky = weather_parameters(scenario.environment, on.assets)
        server.set_weather(sky)
        blueprints = choose_blueprints(plan.actors, on.assets, server.library())
        shapes = server.shapes(blueprints)
        sizes = size_differences(plan.actors, blueprints, shapes)
        ego = _external_ego(plan, server, blueprints) if options.external_ego else None
        free = ego is None and server.find_role(*HEROES) is None
        if free:
            server.roles.add(HEROES[0])
        walks = np.array([actor.person for actor in plan.actors], dtype=np.bool_)
        ground = WalkingGround(server, walks, lambda: LaneSurface.of(on.file("xodr").read_bytes()))
        mirror = Mirror(
            plan,
            blueprints,
            shapes,
            nearby=options.nearby,
            lights=vehicle_lights(sky),
            left_out=ego.row if ego else None,
            ego_role=HEROES[0] if free else None,
            walkers_within=WAKE * server.active_distance(),
            spectator=_spectator_position(server) if free else None,
            on_ground=ground.between,
        )
        foreign = None
        if options.foreign is not None:
            hero = ego.hero if ego else None
            foreign = ForeignActors(
                server, plan.net_offset, on.assets, options.foreign, left_out=hero
            )
        wheels = doors = None
        if not options.sensed_speed and options.wheel_calls:
            able = server.with_doors(blueprints)
            doors = Doors(
                plan,
                np.array([name in able for name in blueprints], dtype=np.bool_),
                calls=options.wheel_calls,
            )
            if server.release.turns_wheels:
                wheels = Wheels(plan, calls=options.wheel_calls)
        return cls(mirror, blueprints, shapes, ego, foreign, ground, wheels, doors, sizes)


def _spectator_position(server: Server) -> tuple[float, float]:
    """X and y of where the server's window looks from, OpenDRIVE frame."""
    at = server.spectator_place()
    return at.x, -at.y


def _external_ego(plan: Plan, server: Server, blueprints: tuple[str, ...]) -> ExternalEgo:
    row = next((row for row, actor in enumerate(plan.actors) if actor.ego), None)
    if row is None:
        raise InputError(
            "the scenario has no ego that could be driven in CARLA; mark one of its road users"
        )
    return ExternalEgo.take(server, plan, row, blueprints[row])
