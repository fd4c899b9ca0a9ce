"""How road users move with the road to themselves: body, driver, and speed along a path."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from odscen.base.categories import DEFAULT_BODY
from odscen.scenario.placing.bodies import ModelBodies, body_of
from odscen.sumo.realize.driving import driver, factor_of, kind_of
from odscen.sumo.realize.weather_effects import NO_EFFECT, weather_effect

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.base.arrays import FloatArray, Int32Array
    from odscen.base.categories import Body
    from odscen.lanegraph.graphs import MapGraph
    from odscen.scenario.document.scenario_document import Environment, Scenario
    from odscen.sumo.realize.driving import Driver
    from odscen.sumo.realize.road_user import RoadUser
    from odscen.sumo.realize.weather_effects import WeatherEffect

UNKNOWN_LIMIT = 13.89
"""Speed (m/s) that free-flow times assume where the map gives no limit: 50 km/h."""


class ModelSizes(ModelBodies, Protocol):
    """What realization asks of the asset catalogue."""

    def electric(self, model: str) -> bool:
        """Whether a model has no exhaust; false if there is no such model."""

    def weather(self, preset: str) -> Mapping[str, float] | None:
        """Parameters of a weather preset, ``None`` if there is no such preset."""


def environment_effect(environment: Environment, assets: ModelSizes | None) -> WeatherEffect:
    """What the weather of a scenario does to drivers."""
    if not environment.affects_driving:
        return NO_EFFECT
    preset = None if assets is None else assets.weather(environment.preset)
    return weather_effect({**(preset or {}), **environment.parameters})


class Motion(NamedTuple):
    """A path at the speed that a road user wants, alone on the road.

    Attributes
    ----------
    steps
        Distances between the nodes of the path, shape ``(K - 1,)``, metres.
    speeds
        Speed on each of them, shape ``(K - 1,)``, m/s.
    accel
        m/s^2 with which a vehicle that departs from rest reaches the first speed; infinite for
        pedestrians, and for those who drive in at speed.
    steady
        Whether the speed is the same all along, as that of pedestrians.
    """

    steps: FloatArray
    speeds: FloatArray
    accel: float
    steady: bool = False

    @property
    def duration(self) -> float | None:
        """Free-flow time, s: ``sum(ds / v) + v0 / (2 a)``; ``None`` without a path.

        The second term is what getting up to the first speed costs.
        """
        if not len(self.steps):
            return None
        if self.steady:
            return float(np.sum(self.steps)) / float(self.speeds[0])
        return float(np.sum(self.steps / self.speeds) + self.speeds[0] / (2.0 * self.accel))

    def times(self) -> FloatArray:
        """Seconds after the departure at each node, shape ``(K,)``, up to the free-flow time.

        With ``a`` and ``v0`` as in :attr:`duration` and ``d0 = v0**2 / (2 a)`` the metres that
        getting up to speed takes, a node at the distance ``d`` is passed at ``sqrt(2 d / a)`` as
        long as ``d < d0``, and at ``sum(ds / v) + v0 / (2 a)`` from there on. A limit that changes
        within ``d0`` does not bend the curve; times never fall.
        """
        if not len(self.steps):
            return np.zeros(1)
        first = float(self.speeds[0])
        gone = np.concatenate([[0.0], np.cumsum(self.steps)])
        at_speed = np.concatenate([[0.0], np.cumsum(self.steps / self.speeds)])
        times = at_speed + first / (2.0 * self.accel)
        if math.isfinite(self.accel):
            starting = gone < first**2 / (2.0 * self.accel)
            times[starting] = np.sqrt(2.0 * gone[starting] / self.accel)
        return np.minimum.accumulate(times[::-1])[::-1]


@dataclass(frozen=True, slots=True)
class FreeFlow:
    """Bodies, drivers and free-flow motion of the road users of one scenario.

    Attributes
    ----------
    graph, scenario
        Where and who; the seed of the scenario draws what drivers differ in.
    assets
        Knows the size of models; without it all bodies are their category's.
    effect
        Of the weather.
    step_length
        Of the run, s.
    """

    graph: MapGraph
    scenario: Scenario
    assets: ModelSizes | None
    effect: WeatherEffect
    step_length: float

    def body(self, user: RoadUser) -> Body:
        """Body of its own, of its model, or the usual one of its category."""
        if user.design.size is None and user.design.model is None:  # nearly all: a flow's have none
            return DEFAULT_BODY[user.category]
        return body_of(user.design, self.assets)

    def driver(self, user: RoadUser, body: Body) -> Driver:
        """How it drives, or walks."""
        limit = None if user.person else float(self.graph.lanes.speed_limit[user.spawn])
        kind = kind_of(user, self.scenario.drivers, self.scenario.seed)
        return driver(
            user,
            body,
            factor=factor_of(user, kind, self.scenario.seed),
            limit=limit if limit is not None and math.isfinite(limit) else None,
            weather=self.effect,
            electric=user.design.model is not None
            and self.assets is not None
            and self.assets.electric(user.design.model),
            drivers=self.scenario.drivers,
            step_length=self.step_length,
            kind=kind,
        )

    def motion(self, user: RoadUser, behaviour: Driver, path: Int32Array) -> Motion:
        """Motion along a path of the graph that it moves on.

        A vehicle goes at ``min(limit * speed_factor, max_speed)`` of its driver, a pedestrian at
        its ``max_speed``.
        """
        graph = self.graph.walks if user.person else self.graph.lanes
        steps = np.hypot(np.diff(graph.x[path]), np.diff(graph.y[path]))
        if user.person:
            return Motion(steps, np.full(len(steps), behaviour.max_speed), math.inf, steady=True)
        limit = self.graph.lanes.speed_limit[path[:-1]]
        limit = np.where(np.isfinite(limit), limit, UNKNOWN_LIMIT)
        speeds = np.minimum(limit * behaviour.speed_factor, behaviour.max_speed)
        return Motion(steps, speeds, math.inf if user.entering else behaviour.accel)
