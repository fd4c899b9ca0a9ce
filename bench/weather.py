"""What weather does to saturation flow and free speed, against the Highway Capacity Manual (HCM).

Saturation flow at a stop line as in ``bench saturation``; free speed of single cars, 60 s apart, on
a straight lane limited to 50 km/h and to 105 km/h (65 mph). Weather is that of the presets, as it
acts on driving. HCM: capacity reductions of HCM 2010, exhibit 10-15, as FHWA-HOP-13-042, appendix
A, gives them, for rain up to 0.10, up to 0.25 and above 0.25 inches an hour; they are of freeways.
``ODSCEN_BENCH_STEPS`` (0.5) and ``ODSCEN_BENCH_SEEDS`` (1,2,3).
"""

from __future__ import annotations

import os
import statistics
import tempfile
from pathlib import Path
from xml.etree import ElementTree as ET

from bench.saturation import run_cars, saturation_flow, straight_road
from odscen.scenario.document.drivers_document import Drivers
from odscen.simulators.assets import shipped_assets
from odscen.sumo.realize.weather_effects import WeatherEffect, weather_effect

PRESETS = {
    "ClearNoon": "0",
    "WetNoon": "",
    "SoftRainNoon": "2.0",
    "MidRainyNoon": "7.2",
    "HardRainNoon": "14.1",
    "HardRainNight": "14.1",
    "FogNoon": "",
}
"""Presets, and by how many per cent the HCM says that capacity falls, where it says so."""
LIMITS = (13.89, 29.06)
DETECTOR = 600.0
"""Metres from the start of the lane."""


def main() -> None:
    step = os.environ.get("ODSCEN_BENCH_STEPS", "0.5").split(",")[0]
    seeds = [int(seed) for seed in os.environ.get("ODSCEN_BENCH_SEEDS", "1,2,3").split(",")]
    columns = " | ".join(f"free speed at {limit * 3.6:.0f} km/h" for limit in LIMITS)
    print(f"| weather | saturation flow, veh/h | change | HCM's, capacity | {columns} |")
    print("|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        nets = {limit: folder / f"{limit}.net.xml" for limit in LIMITS}
        for limit, net in nets.items():
            straight_road(net, limit=limit)
        dry: list[float] = []
        for preset, hcm in PRESETS.items():
            effect = weather_effect(shipped_assets().weather(preset) or {})
            found = [_flow(folder, nets[LIMITS[0]], step, seeds, effect)]
            found += [_speed(folder, net, step, seeds, effect) for net in nets.values()]
            dry = dry or found
            pairs = zip(found, dry, strict=True)
            shares = [f"{100 * (one / base - 1):+.1f} %" for one, base in pairs]
            speeds = " | ".join(
                f"{one * 3.6:.1f} km/h ({share})"
                for one, share in zip(found[1:], shares[1:], strict=True)
            )
            said = f"-{hcm} %" if hcm not in ("", "0") else "-"
            print(f"| {preset} | {found[0]:.0f} | {shares[0]} | {said} | {speeds} |", flush=True)


def _flow(folder: Path, net: Path, step: str, seeds: list[int], weather: WeatherEffect) -> float:
    return statistics.fmean(
        saturation_flow(folder, net, "in out", "in_0", step, seed, Drivers(), weather)
        for seed in seeds
    )


def _speed(folder: Path, net: Path, step: str, seeds: list[int], weather: WeatherEffect) -> float:
    """Mean speed (m/s) of single cars; the light is green."""
    light = next(one for one in ET.parse(net).getroot().iter("tlLogic"))
    width = len(light.find("phase").get("state", ""))  # type: ignore[union-attr]
    loop = folder / "speed.xml"
    (folder / "extra.xml").write_text(
        f'<additional><tlLogic id="{light.get("id")}" type="static" programID="go" offset="0">'
        f'<phase duration="9999" state="{"G" * width}"/></tlLogic>'
        f'<inductionLoop id="line" lane="in_0" pos="{DETECTOR}" period="9999" file="{loop}"/>'
        "</additional>"
    )
    speeds = []
    for seed in seeds:
        cars = [(60.0 * number, "in out", "0") for number in range(100)]
        run_cars(folder, net, cars, seed=seed, step=step, end=6200.0, weather=weather)
        row = next(iter(ET.parse(loop).getroot()))
        speeds.append(float(row.get("speed", 0)))
    return statistics.fmean(speeds)
