"""Write ``src/odscen/maps/data/weather.json``: CARLA's presets and our own.

CARLA's values are read from its Python package; ours complete the table of kinds and times of day.
Run with ``python tools/make_weather.py`` where ``carla`` is installed.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import carla

TARGET = Path(__file__).parents[1] / "src" / "odscen" / "workspace" / "data" / "weather.json"
PARAMETERS = (
    "cloudiness",
    "precipitation",
    "precipitation_deposits",
    "wind_intensity",
    "sun_azimuth_angle",
    "sun_altitude_angle",
    "fog_density",
    "fog_distance",
    "fog_falloff",
    "wetness",
    "scattering_intensity",
    "mie_scattering_scale",
    "rayleigh_scattering_scale",
    "dust_storm",
)
SUN = {
    "day": {"sun_altitude_angle": 45.0, "sun_azimuth_angle": 0.0},
    "sunset": {"sun_altitude_angle": 5.0, "sun_azimuth_angle": 270.0},
    "night": {"sun_altitude_angle": -30.0, "sun_azimuth_angle": 0.0},
}
AIR = {
    "fog_falloff": 0.2,
    "scattering_intensity": 1.0,
    "mie_scattering_scale": 0.03,
    "rayleigh_scattering_scale": 0.0331,
}
OURS: dict[str, dict[str, float]] = {
    "fog": {"cloudiness": 60.0, "fog_density": 85.0, "fog_distance": 10.0, "wetness": 20.0},
    "dust": {"cloudiness": 40.0, "dust_storm": 80.0, "wind_intensity": 80.0, "fog_density": 10.0},
}
TIMES = {"Noon": "day", "Sunset": "sunset", "Night": "night"}
KINDS = {
    "Clear": "clear",
    "Cloudy": "cloudy",
    "Wet": "wet",
    "WetCloudy": "wet",
    "SoftRain": "rain_light",
    "MidRain": "rain_medium",
    "MidRainy": "rain_medium",
    "HardRain": "rain_heavy",
}


def main() -> None:
    presets = [*_carlas(), *_ours()]
    rows = ",\n    ".join(json.dumps(preset) for preset in presets)
    sources = [
        "carla: carla.WeatherParameters of the Python package carla 0.9.16; its preset Default, "
        "which stands for whatever the map has, is left out",
        "odscen: fog and dust by day, at sunset and by night, which CARLA has not; our choice",
    ]
    text = f'{{\n  "sources": {json.dumps(sources)},\n  "presets": [\n    {rows}\n  ]\n}}\n'
    TARGET.write_text(text, encoding="utf-8")


def _carlas() -> list[dict[str, Any]]:
    kind = carla.WeatherParameters
    presets = []
    for name in sorted(name for name in dir(kind) if isinstance(getattr(kind, name), kind)):
        if name == "Default":
            continue
        values = {key: round(getattr(getattr(kind, name), key), 4) for key in PARAMETERS}
        presets.append({"name": name, **_kind(name), "source": "carla", "parameters": values})
    return presets


def _kind(name: str) -> dict[str, str]:
    for ending, time in TIMES.items():
        if name.endswith(ending):
            return {"kind": KINDS[name.removesuffix(ending)], "time_of_day": time}
    return {"kind": "dust", "time_of_day": "day"}


def _ours() -> list[dict[str, Any]]:
    return [
        {
            "name": f"{kind.capitalize()}{ending}",
            "kind": kind,
            "time_of_day": time,
            "source": "odscen",
            "parameters": dict.fromkeys(PARAMETERS, 0.0) | AIR | SUN[time] | values,
        }
        for kind, values in OURS.items()
        for ending, time in TIMES.items()
    ]


if __name__ == "__main__":
    main()
