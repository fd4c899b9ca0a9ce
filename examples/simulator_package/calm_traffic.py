"""A simulator with models and weather of its own: all follow whom they have ahead on their route.

``pip install ./examples/simulator_package``, then ``odscen run S --simulator calm``. Vehicles keep
gaps by the Intelligent Driver Model (Treiber, Hennecke and Helbing 2000); wet roads and fog make
them slower. Lights, signs and who crosses mean nothing to them, and it says so before the run.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from odscen.base.categories import Body, Category
from odscen.scenario.document.problems import warning
from odscen.simulators.assets import AssetSource, Blueprint, WeatherPreset
from odscen.simulators.base import RoutedRun, Simulator
from odscen.simulators.positions import Position, PositionRecord

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from odscen.records.run_plan import PlannedActor
    from odscen.runs.new_run import SimulationOutcome
    from odscen.runs.reporter import Reporter
    from odscen.runs.run_settings import RunSettings
    from odscen.scenario.document.problems import Problem
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.simulators.base import Route, SimulatedMap

ACCELERATION, BRAKING, STANDSTILL = 1.5, 2.5, 2.0
"""m/s2 and m/s2 on dry roads, and metres to whom is ahead in a queue."""


class CalmAssets(AssetSource):
    """A minibus, and weather in which nobody likes to drive."""

    def models(self) -> list[Blueprint]:
        """Offer the minibus."""
        return [Blueprint(id="calm.minibus", category=Category.BUS, body=Body(7.0, 2.2, 2.7))]

    def weather(self) -> list[WeatherPreset]:
        """Offer water on the road, and fog."""
        parameters = {"wetness": 100.0, "precipitation_deposits": 100.0, "fog_density": 80.0}
        return [WeatherPreset(name="CalmSeaFog", kind="fog", parameters=parameters)]


@dataclass(frozen=True, slots=True, kw_only=True)
class CalmRun(RoutedRun):
    """A run with what the weather leaves of grip (share), and of sight (metres)."""

    grip: float
    sight: float


@dataclass(slots=True)
class _Driver:
    """A road user under way: metres along its route, and m/s."""

    actor: PlannedActor
    route: Route
    along: np.ndarray
    place: dict[str, int]
    s: float = 0.0
    speed: float = 0.0
    asked: float = field(default=0.0, init=False)

    @classmethod
    def at_start(cls, actor: PlannedActor, route: Route) -> _Driver:
        """Put a road user at the begin of its route."""
        steps = np.hypot(*np.diff(route.points[:, :2], axis=0).T)
        place = {node: index for index, node in enumerate(route.nodes)}
        return cls(actor, route, np.concatenate([[0.0], np.cumsum(steps)]), place)

    @property
    def at(self) -> int:
        """The node of its route that it has passed last."""
        return min(int(np.searchsorted(self.along, self.s, side="right")), len(self.along) - 1) - 1

    @property
    def walks(self) -> bool:
        """Whether it is a pedestrian."""
        return self.actor.category == Category.PEDESTRIAN

    def gap_to(self, other: _Driver) -> float:
        """Metres between both bodies along its route; infinite if the other is not ahead there."""
        index = self.place.get(other.route.nodes[other.at])
        if index is None or other.walks != self.walks:
            return float("inf")
        apart = float(self.along[index] + other.s - other.along[other.at] - self.s)
        between = apart - 0.5 * (self.actor.length + other.actor.length)
        return between if apart > 0.0 else float("inf")

    def position(self) -> Position:
        """Where its body is."""
        x, y, z = (float(np.interp(self.s, self.along, part)) for part in self.route.points.T)
        hdg = float(np.interp(self.s, self.along, np.unwrap(self.route.hdg)))
        return Position(self.actor.id, x, y, hdg, speed=self.speed, z=z)


class CalmTraffic(Simulator[CalmRun]):
    """Traffic that keeps its distance, on wet roads and in fog too.

    Parameters
    ----------
    headway
        Seconds to whom is ahead.
    """

    label = "Calm traffic"
    options: ClassVar = {
        "type": "object",
        "properties": {
            "headway": {"type": "number", "title": "Headway, s", "default": 1.5, "minimum": 0.5}
        },
    }

    def __init__(self, headway: float = 1.5) -> None:
        self.headway = headway

    def unsupported(self, scenario: Scenario, on: SimulatedMap) -> Iterator[Problem]:
        """List what it leaves out."""
        del on
        words = "sees no light, sign, right of way or merge: where ways meet, bodies may overlap"
        yield warning("calm", "map", f"Calm traffic {words}")
        for index, rule in enumerate(scenario.rules):
            words = f"Calm traffic does not follow rule {rule.id} of {rule.actor}"
            yield warning("calm", f"rules[{index}]", words)

    def prepare(
        self, scenario: Scenario, on: SimulatedMap, settings: RunSettings, reporter: Reporter
    ) -> CalmRun:
        """Plan the run, and look up what its weather is like."""
        del reporter
        routed = on.routed_run(scenario, settings)
        sky = scenario.environment
        weather = {**(on.assets.weather(sky.preset) or {}), **sky.parameters}
        share = {name: 0.01 * weather.get(name, 0.0) for name in ("wetness", "fog_density")}
        given = {part.name: getattr(routed, part.name) for part in fields(routed)}
        sight = 300.0 * (1.0 - share["fog_density"]) + 20.0
        return CalmRun(**given, grip=1.0 - 0.4 * share["wetness"], sight=sight)

    def run(self, prepared: CalmRun, folder: Path, reporter: Reporter) -> SimulationOutcome:
        """Move all, step by step."""
        record, under_way = PositionRecord(prepared), list[_Driver]()
        waiting = sorted(
            (a for a in prepared.plan.actors if a.id in prepared.routes), key=lambda a: a.depart
        )
        for time in record.times(reporter):
            for actor in [actor for actor in waiting if actor.depart <= time]:
                new = _Driver.at_start(actor, prepared.routes[actor.id])
                if all(min(new.gap_to(d), d.gap_to(new)) > STANDSTILL for d in under_way):
                    waiting.remove(actor)
                    under_way.append(new)
            record.add(time, [driver.position() for driver in under_way])
            for driver in under_way:
                driver.asked = self.acceleration(driver, under_way, prepared)
            for driver in under_way:
                step = prepared.plan.step_length
                driver.speed = max(0.0, driver.speed + driver.asked * step)
                driver.s += driver.speed * step
            under_way = [driver for driver in under_way if driver.s < driver.along[-1]]
        return record.write(folder)

    def acceleration(self, driver: _Driver, others: list[_Driver], run: CalmRun) -> float:
        """What a driver does, m/s2: a = A (1 - (v / v0)^4 - (s* / s)^2)."""
        most, brake = ACCELERATION * run.grip, BRAKING * run.grip
        # One can stop within what one sees.
        wanted = min(float(driver.route.speed[driver.at]), (2.0 * brake * run.sight) ** 0.5)
        asked = most * (1.0 - (driver.speed / wanted) ** 4)
        gap, ahead = min(((driver.gap_to(o), o.speed) for o in others), default=(np.inf, 0.0))
        closing = driver.speed * (driver.speed - ahead) / (2.0 * (most * brake) ** 0.5)
        kept = STANDSTILL + max(0.0, driver.speed * self.headway / run.grip + closing)
        if np.isfinite(gap):
            asked -= most * (kept / max(gap, 0.1)) ** 2
        return float(np.clip(asked, -2.0 * brake, most))
