"""Weather and time of day as an environment."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any, Final

from odscen.formats.openscenario.dialect import xml
from odscen.sumo.realize.weather_effects import visibility, weather_effect

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lxml.etree import _Element

    from odscen.formats.openscenario.dialect import Dialect
    from odscen.scenario.document.scenario_document import Scenario

_CLOUDS = ((10.0, "free"), (40.0, "cloudy"), (80.0, "overcast"), (100.1, "rainy"))
OKTAS: Final = tuple(
    f"{number}Oktas"
    for number in ("zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine")
)
"""Eighths of the sky under clouds; nine: the sky cannot be seen."""
HEAVIEST: Final = 50.0
"""mm/h at a precipitation of 100 %."""
FULL_WIND: Final = 30.0
"""m/s at a wind of 100 %: our choice, a violent storm."""
DARK: Final = 10.0
"""Lux below which it is night."""
SAID: Final = "odscen."
"""How properties begin that say what a file was written from."""
_BRIGHTEST = 100_000.0
"""Lux with the sun upright."""
_DAY = "2026-06-21"
_SUN = 45.0
"""Degrees above the horizon, of a weather that does not say."""
_HOURS = ((0.0, 0), (20.0, 18), (90.0, 12))
"""Hour of the day up to these heights of the sun, degrees."""


def environment(
    parameters: Mapping[str, float], clock: float, dialect: Dialect, fields: Mapping[str, Any]
) -> _Element:
    """``Environment``.

    Parameters
    ----------
    parameters
        Of CARLA's weather.
    clock
        Time of day at the start, seconds; of 0, as in a scenario without one, that of the sun.
    fields
        What the document says itself, written as properties so that it can be read again.
    """
    minutes, seconds = divmod(int(clock or _hour_of_sun(parameters) * 3600), 60)
    time = f"{_DAY}T{minutes // 60:02}:{minutes % 60:02}:{seconds:02}"
    return xml(
        "Environment",
        xml("ParameterDeclarations") if dialect.minor == 0 else None,
        xml("TimeOfDay", animation=False, dateTime=time),
        _write_weather(parameters, dialect),
        xml(
            "RoadCondition",
            xml("Properties", *(_write_property(*row) for row in fields.items()))
            if fields
            else None,
            frictionScaleFactor=weather_effect(parameters).grip,
            **_wetness_attributes(parameters, dialect),
        ),
        name="environment",
    )


def said_of(scenario: Scenario) -> dict[str, Any]:
    """What a scenario says of weather and time, but for what is the same in every new one."""
    fields = scenario.environment.model_dump(mode="json", exclude_defaults=True)
    return fields | ({"clock": scenario.demand.clock} if scenario.demand.clock else {})


def _write_property(name: str, value: Any) -> _Element:
    return xml("Property", name=f"{SAID}{name}", value=json.dumps(value, sort_keys=True))


def _wetness_attributes(parameters: Mapping[str, float], dialect: Dialect) -> dict[str, str]:
    """Words that 1.2 has for water on the road."""
    puddles = parameters.get("precipitation_deposits", 0.0)
    wet = max(puddles, parameters.get("wetness", 0.0))
    if dialect.minor < 2 or wet < 10.0:
        return {}
    return {"wetness": "wetWithPuddles" if puddles >= 50.0 else "moist"}


def _hour_of_sun(parameters: Mapping[str, float]) -> int:
    """Hour at which the sun stands about as high as the weather says, in the evening if low."""
    height = parameters.get("sun_altitude_angle", _SUN)
    return next(hour for limit, hour in _HOURS if height <= limit)


def _write_weather(parameters: Mapping[str, float], dialect: Dialect) -> _Element:
    rain = parameters.get("precipitation", 0.0)
    cloudiness = parameters.get("cloudiness", 0.0)
    clouds = next(word for limit, word in _CLOUDS if cloudiness < limit)
    height = math.radians(parameters.get("sun_altitude_angle", _SUN))
    bright = max(0.0, math.sin(height))
    about: dict[str, Any] = {}
    light: dict[str, Any] = {"intensity": bright}
    wet: dict[str, Any] = {"intensity": rain / 100.0}
    if dialect.minor >= 1:
        wet = {"precipitationIntensity": rain / 100.0 * HEAVIEST}
    if dialect.minor >= 2:
        about = {"fractionalCloudCover": OKTAS[round(min(cloudiness, 100.0) / 12.5)]}
        light = {"illuminance": bright * _BRIGHTEST}
    else:
        about = {"cloudState": clouds}
    azimuth = math.radians(parameters.get("sun_azimuth_angle", 0.0)) % (2.0 * math.pi)
    wind = parameters.get("wind_intensity", 0.0) / 100.0 * FULL_WIND
    return xml(
        "Weather",
        xml("Sun", azimuth=azimuth, elevation=height, **light),
        xml("Fog", visualRange=visibility(parameters)),
        xml("Precipitation", precipitationType="rain" if rain else "dry", **wet),
        xml("Wind", direction=0.0, speed=wind) if dialect.minor >= 1 else None,
        **about,
    )
