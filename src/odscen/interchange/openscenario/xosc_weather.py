"""Weather and time of day as an environment."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from odscen.interchange.openscenario.dialect import xml
from odscen.sumo.realize.weather_effects import visibility, weather_effect

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lxml.etree import _Element

    from odscen.interchange.openscenario.dialect import Dialect

_CLOUDS = ((10.0, "free"), (40.0, "cloudy"), (80.0, "overcast"), (100.1, "rainy"))
_CLOUDS_LATER = {"free": "zeroOktas", "cloudy": "threeOktas", "overcast": "sixOktas"}
_HEAVIEST = 50.0
"""mm/h at a precipitation of 100 %."""
_BRIGHTEST = 100_000.0
"""Lux with the sun upright."""
_DAY = "2026-06-21"
_SUN = 45.0
"""Degrees above the horizon, of a weather that does not say."""
_HOURS = ((0.0, 0), (20.0, 18), (90.0, 12))
"""Hour of the day up to these heights of the sun, degrees."""


def environment(parameters: Mapping[str, float], clock: float, dialect: Dialect) -> _Element:
    """``Environment``.

    Parameters
    ----------
    parameters
        Of CARLA's weather.
    clock
        Time of day at the start, seconds; of 0, as in a scenario without one, that of the sun.
    """
    minutes, seconds = divmod(int(clock or _hour(parameters) * 3600), 60)
    time = f"{_DAY}T{minutes // 60:02}:{minutes % 60:02}:{seconds:02}"
    return xml(
        "Environment",
        xml("ParameterDeclarations") if dialect.minor == 0 else None,
        xml("TimeOfDay", animation=False, dateTime=time),
        _weather(parameters, dialect),
        xml("RoadCondition", frictionScaleFactor=weather_effect(parameters).grip),
        name="environment",
    )


def _hour(parameters: Mapping[str, float]) -> int:
    """Hour at which the sun stands about as high as the weather says, in the evening if low."""
    height = parameters.get("sun_altitude_angle", _SUN)
    return next(hour for limit, hour in _HOURS if height <= limit)


def _weather(parameters: Mapping[str, float], dialect: Dialect) -> _Element:
    rain = parameters.get("precipitation", 0.0)
    cloudiness = parameters.get("cloudiness", 0.0)
    clouds = next(word for limit, word in _CLOUDS if cloudiness < limit)
    height = math.radians(parameters.get("sun_altitude_angle", _SUN))
    bright = max(0.0, math.sin(height))
    about: dict[str, Any] = {}
    light: dict[str, Any] = {"intensity": bright}
    wet: dict[str, Any] = {"intensity": rain / 100.0}
    if dialect.minor >= 1:
        wet = {"precipitationIntensity": rain / 100.0 * _HEAVIEST}
    if dialect.minor >= 2:
        about = {"fractionalCloudCover": _CLOUDS_LATER.get(clouds, "eightOktas")}
        light = {"illuminance": bright * _BRIGHTEST}
    else:
        about = {"cloudState": clouds}
    azimuth = math.radians(parameters.get("sun_azimuth_angle", 0.0)) % (2.0 * math.pi)
    return xml(
        "Weather",
        xml("Sun", azimuth=azimuth, elevation=height, **light),
        xml("Fog", visualRange=visibility(parameters)),
        xml("Precipitation", precipitationType="rain" if rain else "dry", **wet),
        **about,
    )
