"""The environment at first: weather, time of day and road condition, as the weather of a scenario.

The numbers are those of the export (:mod:`odscen.formats.openscenario.xosc_weather`), read the
other way round; so an environment that is written and read again is the same but for what the file
has only roughly, such as clouds in eighths.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from odscen.base.errors import InputError
from odscen.formats.openscenario.dialect import Dialect
from odscen.formats.openscenario.xosc_weather import (
    DARK,
    FULL_WIND,
    HEAVIEST,
    OKTAS,
    SAID,
    environment,
)
from odscen.formats.openscenario_import.source.own_files import value_of
from odscen.sumo.realize.weather_effects import CLEAR, DENSE, WET_GRIP

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from lxml.etree import _Element

    from odscen.formats.openscenario_import.import_report import ImportReport

Made = dict[str, Any]
_TIME: Final = re.compile(
    r"-?(\d+)-(\d\d)-(\d\d)T(\d\d):(\d\d):(\d\d(?:\.\d+)?)(?:Z|[+-]\d\d:?\d\d)?"
)
_CLOUDS: Final = {"skyOff": 0.0, "free": 0.0, "cloudy": 25.0, "overcast": 60.0, "rainy": 100.0}
_WET: Final = {
    "dry": 0.0, "moist": 30.0, "wetWithPuddles": 60.0, "lowFlooded": 80.0, "highFlooded": 100.0,
}  # fmt: skip
_HIGHEST: Final = 60.0
"""Degrees above the horizon at noon, of a sun that follows from the time of day alone."""
_NIGHT: Final = -45.0
_BRIGHTER: Final = 0.15
"""Of the light of a sun upright: what a sun may differ from its height without a word."""
_DAY: Final = 86_400.0
STAYS: Final = "the weather of a scenario is the same from its start to its end"


@dataclass(frozen=True, slots=True)
class ReadEnvironment:
    """What a file says of its environment at first.

    Attributes
    ----------
    environment
        That of the document; empty if the file says nothing.
    clock
        Time of day at the start, s since midnight; ``None`` if the file does not say.
    day
        Days of the date, from any day on.
    runs
        Whether the time of day goes on with the simulation.
    """

    environment: Made = field(default_factory=dict)
    clock: float | None = None
    day: int = 0
    runs: bool = True


def read_environment(
    report: ImportReport,
    root: _Element,
    weather: Callable[[str], Mapping[str, float] | None],
    *,
    driven: bool,
    own: bool,
) -> ReadEnvironment:
    """Environment that ``Init`` sets; the last one if there are several.

    Parameters
    ----------
    weather
        Parameters of a preset, by its name.
    driven
        Whether SUMO drives an actor, so that weather is to act on driving.
    own
        Whether odscen wrote the file.
    """
    found = ReadEnvironment()
    for action in root.iterfind("Storyboard/Init/Actions/GlobalAction/EnvironmentAction"):
        element = action.find("Environment")
        if element is None:
            continue  # a catalog that is missing: said already
        for holder in (action.getparent(), action, element):
            if holder is not None:
                report.mark(holder, "taken")
        try:
            found = _read_weather(report, element, weather, driven=driven, own=own)
        except InputError as error:
            report.mark(element, "refused", f"left out: {error.element}: {error.problem}")
    return found


def _read_weather(
    report: ImportReport,
    element: _Element,
    weather: Callable[[str], Mapping[str, float] | None],
    *,
    driven: bool,
    own: bool,
) -> ReadEnvironment:
    time = report.child(element, "TimeOfDay")
    clock, day = (None, 0) if time is None else clock_of(report, time)
    runs = time is None or time.get("animation") != "false"
    if own:
        properties = _read_properties(element)
        if _is_written(report, element, properties, weather):
            report.take(element)
            return ReadEnvironment(properties["environment"], properties["clock"], day, runs)
    found = _Weather(report)
    sky = report.child(element, "Weather")
    if sky is not None:
        found.sky(sky)
    if clock is not None and "sun_altitude_angle" not in found.values and time is not None:
        height = _HIGHEST * -math.cos(2.0 * math.pi * clock / _DAY)
        found.values["sun_altitude_angle"] = round(height, 3)
        report.mark(time, "approximated", f"the sun is {height:.0f} degrees high at that time")
    road = report.child(element, "RoadCondition")
    if road is not None:
        found.road(road)
    made: Made = {"parameters": found.values, "affects_driving": driven}
    return ReadEnvironment(made if found.values else {}, clock, day, runs)


def clock_of(report: ImportReport, element: _Element) -> tuple[float, int]:
    """Seconds since midnight of a ``dateTime``, and its day as a number that grows by 1 a day.

    Raises
    ------
    InputError
        If it is no time.
    """
    text = report.word(element, "dateTime")
    match = _TIME.fullmatch(text.strip())
    if match is None:
        raise report.wrong(element, f"dateTime={text!r} is no date with a time")
    year, month, date = (int(group) for group in match.groups()[:3])
    hours, minutes, seconds = int(match[4]), int(match[5]), float(match[6])
    clock = (hours * 60 + minutes) * 60 + seconds
    if not 0 <= clock < _DAY:
        raise report.wrong(element, f"dateTime={text!r} is no time of a day")
    # A calendar of months of 31 days: differences across the end of a month are too long.
    return round(clock, 3), (year * 12 + month) * 31 + date


def _read_properties(element: _Element) -> Made:
    """What the properties say of the document that a file of odscen's was written from."""
    rows = {
        element.get("name", "").removeprefix(SAID): value_of(element.get("value", ""))
        for element in element.iterfind("RoadCondition/Properties/Property")
        if element.get("name", "").startswith(SAID)
    }
    clock = rows.pop("clock", None)
    return {"environment": rows, "clock": clock}


def _is_written(
    report: ImportReport,
    element: _Element,
    properties: Made,
    weather: Callable[[str], Mapping[str, float] | None],
) -> bool:
    """Whether an element is still the one that odscen writes of what its properties say."""
    given = properties["environment"]
    preset = weather(given.get("preset", "ClearNoon"))
    if preset is None or not isinstance(given.get("parameters", {}), dict):
        return False
    header = element.getroottree().getroot().find("FileHeader")
    minor = 2 if header is None else int(report.number(header, "revMinor", 2.0))
    whole = {**preset, **given.get("parameters", {})}
    written = environment(whole, properties["clock"] or 0.0, Dialect(minor), {})
    here, there = ([(element.tag, dict(element.attrib)) for element in tree.iter("*")
                    if element.tag not in ("Properties", "Property")]
                   for tree in (element, written))  # fmt: skip
    return here == there


class _Weather:
    """Parameters of CARLA's weather, by their names."""

    def __init__(self, report: ImportReport) -> None:
        self.values: dict[str, float] = {}
        self._report = report

    def _set_value(self, name: str, value: float) -> None:
        self.values[name] = round(float(value), 3) + 0.0

    def sky(self, weather: _Element) -> None:
        """Read ``Weather``."""
        report = self._report
        oktas, state = weather.get("fractionalCloudCover"), weather.get("cloudState")
        if oktas in OKTAS:
            self._set_value("cloudiness", min(OKTAS.index(oktas) * 12.5, 100.0))
        elif state is not None:
            self._set_value("cloudiness", _CLOUDS.get(state, 0.0))
            words = f"clouds over {self.values['cloudiness']:g} % of the sky"
            report.mark(weather, "approximated", words)
        if weather.get("temperature") or weather.get("atmosphericPressure"):
            report.mark(weather, "approximated", "without temperature and pressure of the air")
        readers = {
            "Sun": self._read_sun, "Fog": self._read_fog,
            "Precipitation": self._read_rain, "Wind": self._read_wind,
        }  # fmt: skip
        for element in weather.iterchildren("*"):
            if str(element.tag) in readers:
                report.mark(element, "taken")
                readers[str(element.tag)](element)

    def _read_sun(self, sun: _Element) -> None:
        report = self._report
        height = math.degrees(report.number(sun, "elevation", 0.0))
        turn = math.degrees(report.number(sun, "azimuth", 0.0)) % 360.0
        if report.number(sun, "illuminance", 1e5) < DARK:
            height = _NIGHT
            report.mark(sun, "approximated", f"night, for it gives less than {DARK:g} lux")
        else:
            light = report.number(sun, "illuminance", 1e5 * report.number(sun, "intensity", -1.0))
            if light >= 0 and abs(light / 1e5 - math.sin(math.radians(height))) > _BRIGHTER:
                report.mark(sun, "approximated", "as bright as it is high")
        self._set_value("sun_altitude_angle", min(max(height, -90.0), 90.0))
        self._set_value("sun_azimuth_angle", turn)

    def _read_fog(self, fog: _Element) -> None:
        report = self._report
        sight = report.number(fog, "visualRange")
        share = math.log(max(sight, 1e-3) / CLEAR) / math.log(DENSE / CLEAR)
        if share > 1.0:
            report.mark(fog, "approximated", f"one sees {DENSE:g} m: the densest fog that there is")
        self._set_value("fog_density", 100.0 * min(max(share, 0.0), 1.0))
        self._set_value("fog_distance", 0.0)
        for box in fog.iterchildren("BoundingBox"):
            report.ignore(box, "fog is everywhere")

    def _read_rain(self, rain: _Element) -> None:
        report, kind = self._report, rain.get("precipitationType", "dry")
        if rain.get("precipitationIntensity") is not None:
            share = report.number(rain, "precipitationIntensity") / HEAVIEST
        else:
            share = report.number(rain, "intensity", 0.0)
        if kind == "dry":
            share = 0.0
        if kind == "snow" and share > 0:
            report.mark(rain, "approximated", "rain of as much water")
        elif share > 1.0:
            report.mark(rain, "approximated", f"the heaviest rain is {HEAVIEST:g} mm/h")
        self._set_value("precipitation", 100.0 * min(max(share, 0.0), 1.0))

    def _read_wind(self, wind: _Element) -> None:
        share = self._report.number(wind, "speed") / FULL_WIND
        self._set_value("wind_intensity", 100.0 * min(max(share, 0.0), 1.0))
        words = f"from any direction; {FULL_WIND:g} m/s is the strongest"
        self._report.mark(wind, "approximated", words)

    def road(self, road: _Element) -> None:
        """Read ``RoadCondition``: friction below that of a dry road is that of a wet one."""
        report = self._report
        friction, wetness = report.number(road, "frictionScaleFactor", 1.0), road.get("wetness")
        wet = 100.0 * (1.0 - friction) / (1.0 - WET_GRIP)
        if not WET_GRIP <= friction <= 1.0:
            words = f"grip is {WET_GRIP:g} to 1 times that of a dry road"
            report.mark(road, "approximated", words)
        self._set_value("wetness", min(max(wet, 0.0), 100.0))
        puddles = _WET.get(wetness or "dry", 0.0) if wetness != "moist" else 0.0
        if wetness is not None and puddles > self.values["wetness"]:
            report.mark(road, "approximated", f"{wetness!r} by its friction alone")
            puddles = self.values["wetness"]
        self._set_value("precipitation_deposits", puddles)
