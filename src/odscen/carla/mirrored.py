"""The road users of a plan with the bodies that they have on a CARLA server."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from odscen.base.errors import InputError
from odscen.carla.blueprints import choose_blueprints, size_differences
from odscen.carla.ego import ExternalEgo
from odscen.carla.environment import vehicle_lights, weather_parameters
from odscen.carla.mirror import Mirror

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.app.runs import CheckedRun
    from odscen.carla.blueprints import Shape
    from odscen.carla.carla_server import Server
    from odscen.carla.cosim_options import CosimOptions
    from odscen.results.records.run_records import Plan


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
    sizes
        Metres by which the length of a blueprint differs from the road user it represents.
    """

    mirror: Mirror
    blueprints: tuple[str, ...]
    shapes: Mapping[str, Shape]
    ego: ExternalEgo | None
    sizes: dict[str, float]

    @classmethod
    def on(cls, server: Server, run: CheckedRun, plan: Plan, options: CosimOptions) -> MirroredPlan:
        """Choose bodies, under the scenario's sky; none is spawned yet.

        Raises
        ------
        InputError
            If the ego is to be driven in CARLA and there is none.
        """
        sky = weather_parameters(run.scenario.environment, run.assets)
        server.set_weather(sky)
        blueprints = choose_blueprints(plan.actors, run.assets, server.library())
        shapes = server.shapes(blueprints)
        sizes = size_differences(plan.actors, blueprints, shapes)
        ego = _external_ego(plan, server, blueprints) if options.external_ego else None
        mirror = Mirror(
            plan,
            blueprints,
            shapes,
            nearby=options.nearby,
            lights=vehicle_lights(sky),
            left_out=ego.row if ego else None,
        )
        return cls(mirror, blueprints, shapes, ego, sizes)


def _external_ego(plan: Plan, server: Server, blueprints: tuple[str, ...]) -> ExternalEgo:
    row = next((row for row, actor in enumerate(plan.actors) if actor.ego), None)
    if row is None:
        msg = "the scenario has no ego that could be driven in CARLA; mark one of its road users"
        raise InputError(msg)
    return ExternalEgo.take(server, plan, row, blueprints[row])
