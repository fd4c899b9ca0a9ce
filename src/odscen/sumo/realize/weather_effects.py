"""What weather does to driving: factors on speed, grip and headway, and a limit set by sight.

The factors go into vType attributes, so that they work with plain ``sumo -c`` and survive a saved
state; SUMO's friction device would need a changed network. Parameters have CARLA's names and ranges
(``WeatherParameters``, 0 to 100 unless said otherwise). Night has no effect: drivers are known to
keep their speed. ``docs/runs.md`` discusses the numbers.

===================== ============================================================================
number                source
===================== ============================================================================
RAIN_SPEED_LOSS       3 % in any rain: Smith et al. 2004, "An Investigation into the Impact of
                      Rainfall on Freeway Traffic Flow" (3 to 5 %)
HEAVY_SPEED_LOSS      8.4 % in very heavy rain: "Impact of Rain Intensity on Interstate Traffic
                      Speeds Using Connected Vehicle Data", Vehicles 2023, 5(1), 133-155
HEAVY_CAPACITY_LOSS   14.13 % above 0.25 in/h: HCM 2010 Exhibit 10-15, in FHWA-HOP-13-042 App. A
WET_GRIP              share of dry grip on wet asphalt; our choice within the usual 0.6 to 0.8
REACTION, BRAKING     stopping sight distance with 2.5 s and 3.4 m/s^2: AASHTO Green Book
CLEAR, DENSE          our choice: CARLA's fog density has no unit
===================== ============================================================================
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

RAIN_SPEED_LOSS = 0.03
HEAVY_SPEED_LOSS = 0.084
HEAVY_CAPACITY_LOSS = 0.1413
WET_GRIP = 0.7
REACTION = 2.5
"""Seconds."""
BRAKING = 3.4
"""m/s^2, on a dry road."""
CLEAR = 10_000.0
"""Metres one sees at fog density 0."""
DENSE = 50.0
"""Metres one sees at fog density 100."""


@dataclass(frozen=True, slots=True)
class WeatherEffect:
    """Factors on a driver's parameters; 1 and infinity where the weather does nothing.

    Attributes
    ----------
    speed
        Times desired speed and speed factor.
    grip
        Times acceleration and braking.
    headway
        Times the time headway.
    sight_speed
        Highest speed (m/s) at which one can stop within what one sees.
    """

    speed: float = 1.0
    grip: float = 1.0
    headway: float = 1.0
    sight_speed: float = math.inf


NO_EFFECT = WeatherEffect()


def weather_effect(parameters: Mapping[str, float]) -> WeatherEffect:
    """Effect of CARLA-style weather parameters; missing ones count as 0.

    - rain ``p`` (0 to 1): ``speed = 1 - (0.03 + 0.054 p)`` if it rains at all, ``headway = 1 / (1 -
      0.1413 p)``: a capacity lost is a headway gained;
    - wetness ``w`` (0 to 1; the larger of wetness and puddles): ``grip = 1 - 0.3 w``;
    - fog or dust of density ``d`` (0 to 1): sight ``V = 10 km (50 m / 10 km)^d``, plus the distance
      at which the fog begins; ``v REACTION + v^2 / (2 BRAKING grip) = V``.
    """
    rain = _share_of_parameter(parameters, "precipitation")
    wet = max(
        _share_of_parameter(parameters, "wetness"),
        _share_of_parameter(parameters, "precipitation_deposits"),
    )
    haze = max(
        _share_of_parameter(parameters, "fog_density"),
        _share_of_parameter(parameters, "dust_storm"),
    )
    grip = 1.0 - (1.0 - WET_GRIP) * wet
    loss = RAIN_SPEED_LOSS + (HEAVY_SPEED_LOSS - RAIN_SPEED_LOSS) * rain if rain > 0 else 0.0
    sight_speed = math.inf
    if haze > 0:
        sight_speed = stopping_speed(visibility(parameters), grip=grip)
    return WeatherEffect(
        speed=1.0 - loss,
        grip=grip,
        headway=1.0 / (1.0 - HEAVY_CAPACITY_LOSS * rain),
        sight_speed=sight_speed,
    )


def visibility(parameters: Mapping[str, float]) -> float:
    """Metres one sees, as :func:`weather_effect` has it."""
    haze = max(
        _share_of_parameter(parameters, "fog_density"),
        _share_of_parameter(parameters, "dust_storm"),
    )
    return CLEAR * math.pow(DENSE / CLEAR, haze) + max(0.0, parameters.get("fog_distance", 0.0))


def stopping_speed(sight: float, *, grip: float = 1.0) -> float:
    """Speed (m/s) from which one just stops within ``sight`` metres.

    Positive root of ``v REACTION + v^2 / (2 b) = sight`` with ``b = BRAKING grip``.
    """
    b = BRAKING * grip
    return b * (math.sqrt(REACTION**2 + 2.0 * sight / b) - REACTION)


def _share_of_parameter(parameters: Mapping[str, float], name: str) -> float:
    return min(1.0, max(0.0, parameters.get(name, 0.0) / 100.0))
