"""Max-pressure control of traffic lights (Varaiya, 2013)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from odscen.learning.behaviour.light_model import DECISION_INTERVAL, KEEP
from odscen.learning.offered_options import offered

if TYPE_CHECKING:
    from odscen.base.arrays import FloatArray
    from odscen.learning.behaviour.light_model import (
        LightFacts,
        LightObservation,
        LightScene,
        LightsObservation,
    )


def stage_pressure(facts: LightFacts, seen: LightObservation) -> FloatArray:
    """Pressure of each stage, ``(P,)`` vehicles.

    Of a stage: vehicles on the approaches that it serves, less those on the lanes that its
    movements lead to, of which a vehicle can only take one: they count by their mean.
    """
    serves = np.array(facts.serves, dtype=np.float64)
    leads = np.array(facts.leads, dtype=np.float64)
    behind = leads @ seen.leaving / np.maximum(leads.sum(axis=1), 1.0)
    pressure: FloatArray = serves @ seen.vehicles - behind
    return pressure


@dataclass(frozen=True, slots=True)
class MaxPressure:
    """Traffic lights by max-pressure: green for the stage with most vehicles before it.

    Attributes
    ----------
    interval
        Seconds between two choices.
    hold
        Vehicles by which another stage must have more, for a change costs green.
    """

    interval: float = offered(DECISION_INTERVAL, "Seconds between choices", low=1.0, high=60.0)
    hold: float = offered(2.0, "Vehicles more for a change", low=0.0, high=50.0)

    def init_lights(self, rng: np.random.Generator, scene: LightScene) -> LightScene:
        """Keep the scene."""
        del rng
        return scene

    def switch(self, observation: LightsObservation, state: LightScene) -> list[int]:
        """Choose the stage with most pressure, or keep the present one."""
        chosen = []
        for facts, seen in zip(state.lights, observation.lights, strict=True):
            pressure = stage_pressure(facts, seen)
            best = int(np.argmax(pressure))
            worth = seen.stage >= 0 and pressure[best] > pressure[seen.stage] + self.hold
            chosen.append(best if worth else KEEP)
        return chosen
