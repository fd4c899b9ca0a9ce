"""Weather, time of day and the lights that vehicles have on, from a scenario's environment."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.carla.server.batch import FOG, LOW_BEAM, POSITION

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.scenario.document.scenario_document import Environment
    from odscen.simulators.assets import Assets

DUSK = 5.0
"""Degrees of the sun above the horizon below which one drives with lights."""
RAIN = 40.0
"""Precipitation (0 to 100) from which one does."""
HAZE = 40.0
"""Fog density or dust (0 to 100) from which fog lights are on too."""


def weather_parameters(environment: Environment, assets: Assets) -> dict[str, float]:
    """All parameters of CARLA's weather: the preset's, and those that the scenario changes."""
    return {**assets.preset(environment.preset).parameters, **environment.parameters}


def vehicle_lights(parameters: Mapping[str, float]) -> int:
    """Bits of ``VehicleLightState`` that every vehicle has on in this weather."""
    haze = max(parameters.get("fog_density", 0.0), parameters.get("dust_storm", 0.0))
    dark = parameters.get("sun_altitude_angle", 90.0) < DUSK
    flags = 0
    if dark or haze >= HAZE or parameters.get("precipitation", 0.0) >= RAIN:
        flags |= POSITION | LOW_BEAM
    # CARLA's night presets have dense fog to look dark.
    if haze >= HAZE and not dark:
        flags |= FOG
    return flags
