"""How odscen's drivers move beside what was measured of people; docs/runs.md has the table.

A motorway of two lanes at 120 km/h with cars that come at random, seen at 2 km: flow, speed,
density, headways and changes of lanes. The shipped suite's crossings with lights: deceleration of
those who stop, and room in queues. A right angle of 10 m radius: speed and what is felt of it.
Three lanes of which one ends, with more and more cars: flow before and after the breakdown, and how
fast the queue's waves go upstream.
"""

from __future__ import annotations

import math
import tempfile
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from odscen.app.generation import generate
from odscen.app.running.runs import run
from odscen.app.scenarios import read_scenario
from odscen.maps.shipped import shipped_maps
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.scenario_document import Flow
from odscen.scenario.sampling.generation_settings import GenerationSettings

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.base.arrays import FloatArray
    from odscen.runs.finished_run import Run

SUITES = Path(__file__).parents[1] / "suites" / "scenarios"
Place = tuple[float, float, float]
"""x, y and heading."""
INFLOWS = (500.0, 1000.0, 1500.0, 2000.0, 2600.0)
"""Vehicles per hour and lane."""
SEEN_AT = 2000.0
WARM_UP, UNTIL = 180.0, 900.0
LANE = '<lane id="{}" type="driving"><width sOffset="0" a="3.75" b="0" c="0" d="0"/></lane>'


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        store = Workspace.open(folder / "workspace")
        print_motorway(store, folder)
        print_lights(store, folder)
        print_curve(store, folder)
        print_breakdown(store, folder)


def own_map(
    store: Workspace, folder: Path, name: str, plan: str, length: float, lanes: int
) -> None:
    """Add a map of one road with lanes to the right."""
    limit = 120 if lanes > 1 else 50
    text = "".join(LANE.format(-number) for number in range(1, lanes + 1))
    file = folder / f"{name}.xodr"
    file.write_text(
        f'<OpenDRIVE><header revMajor="1" revMinor="6"/><road id="1" length="{length!r}" '
        f'junction="-1"><link/><type s="0" type="motorway"><speed max="{limit}" unit="km/h"/>'
        f'</type><planView>{plan}</planView><lanes><laneSection s="0"><center>'
        f'<lane id="0" type="none"/></center><right>{text}</right>'
        "</laneSection></lanes></road></OpenDRIVE>"
    )
    store.add_map(file)


def flow_run(
    store: Workspace, name: str, ends: Sequence[tuple[Place, Place]], rate: float, out: Path
) -> Run:
    """Let ``rate`` cars an hour go from each place to its goal."""
    entry = store.map(name)
    (path,) = generate(
        store, settings=GenerationSettings(map_name=name, fill=0.0, roi_segments=100)
    )
    flows = tuple(
        Flow(
            id=f"lane{k}", spawn=entry.nearest(*begin).id, goal=entry.nearest(*end).id,
            per_hour=rate, end=UNTIL, initial_speed=25.0 if len(ends) > 1 else 10.0,
        )
        for k, (begin, end) in enumerate(ends)
    )  # fmt: skip
    scenario = read_scenario(path).model_copy(update={"actors": (), "flows": flows})
    return run(store, scenario, settings=RunSettings(until=UNTIL), out=out)


def print_motorway(store: Workspace, folder: Path) -> None:
    plan = '<geometry s="0" x="0" y="0" hdg="0" length="3000"><line/></geometry>'
    own_map(store, folder, "motorway", plan, 3000.0, 2)
    print(
        "| inflow, veh/h/lane | passed | speed, km/h | density, veh/km/lane | headway, percentiles "
        "5, 15, 50, 85, s | below 1 s | changes of lanes per veh-km |"
    )
    print("|---|---|---|---|---|---|---|")
    ends = [((10.0, y, 0.0), (2990.0, y, 0.0)) for y in (-1.875, -5.625)]
    for rate in INFLOWS:
        done = flow_run(store, "motorway", ends, rate, folder / f"inflow-{rate:.0f}")
        rows = done.trajectories().sort("id", "time")
        passed = passages(rows)
        hours = (UNTIL - WARM_UP) / 3600.0
        flow = len(passed) / hours / 2.0
        speed = 3.6 * len(passed) / float(np.sum(1.0 / passed["speed"].to_numpy()))
        times = [np.sort(part["at"].to_numpy()) for part in passed.partition_by("lane")]
        gaps = np.concatenate([np.diff(at) for at in times])
        shares = ", ".join(f"{value:.2f}" for value in np.percentile(gaps, [5, 15, 50, 85]))
        lane, user = pl.col("lane"), pl.col("id")
        changed = rows.filter((lane != lane.shift(1)) & (user == user.shift(1)))
        driven = float((rows["speed"] * 0.5).sum()) / 1000.0
        print(
            f"| {rate:.0f} | {flow:.0f} | {speed:.0f} | {flow / speed:.1f} | {shares} | "
            f"{100.0 * np.mean(gaps < 1.0):.0f} % | {len(changed) / driven:.2f} |",
            flush=True,
        )


def passages(rows: pl.DataFrame) -> pl.DataFrame:
    """When each vehicle's centre was at :data:`SEEN_AT`, on which lane, and how fast."""
    x, before = pl.col("x"), pl.col("x").shift(1)
    return (
        rows.with_columns(
            at=pl.col("time") - (x - SEEN_AT) / pl.col("speed"),
            here=(x >= SEEN_AT) & (before < SEEN_AT) & (pl.col("id") == pl.col("id").shift(1)),
        )
        .filter(pl.col("here") & (pl.col("at") >= WARM_UP))
        .select("id", "lane", "speed", "at")
    )


def print_lights(store: Workspace, folder: Path) -> None:
    found, room = [], []
    for source in shipped_maps():
        if source.stem in ("signal_crossing", "town_5x5"):
            store.add_map(source)
            scenario = read_scenario(SUITES / f"{source.stem}.scenario.json")
            rows = run(store, scenario, out=folder / source.stem).trajectories()
            cars = rows.filter(pl.col("category") == "car").sort("id", "time")
            for part in cars.partition_by("id"):
                found += stops(part["time"].to_numpy(), part["speed"].to_numpy())
            room += queue_room(cars)
    rates = ", ".join(f"{value:.1f}" for value in np.percentile(found, [15, 50, 85]))
    print(
        f"\nstops from 30 km/h and more: {len(found)}; mean deceleration 15, 50, 85 %: {rates} m/s2"
    )
    print(f"queues: {len(room)} pairs of cars, {np.median(room):.1f} m front to front (median)")


def stops(time: FloatArray, speed: FloatArray) -> list[float]:
    """Mean deceleration of each stop, from where braking begins to standstill, m/s2."""
    found = []
    for last in np.flatnonzero((speed[1:] < 0.1) & (speed[:-1] >= 0.1)) + 1:
        first = last
        while first > 0 and speed[first - 1] > speed[first] + 0.1:
            first -= 1
        if speed[first] >= 30.0 / 3.6:
            found.append(float((speed[first] - speed[last]) / (time[last] - time[first])))
    return found


def queue_room(cars: pl.DataFrame) -> list[float]:
    """Metres between centres of neighbours who stand on one lane, each pair once."""
    stopped = cars.filter((pl.col("speed") < 0.1) & (pl.col("time") % 30.0 == 0.0))
    found: list[float] = []
    for part in stopped.partition_by("time", "lane"):
        places = part.select("x", "y").to_numpy()
        order = np.argsort(places @ np.array([math.cos(0.3), math.sin(0.3)]))
        steps = [math.dist(places[a], places[b]) for a, b in pairwise(order)]
        found += [step for step in steps if step < 15.0]
    return found


def print_curve(store: Workspace, folder: Path) -> None:
    bend = 5.0 * math.pi
    plan = (
        '<geometry s="0" x="0" y="0" hdg="0" length="200"><line/></geometry>'
        f'<geometry s="200" x="200" y="0" hdg="0" length="{bend!r}"><arc curvature="0.1"/>'
        f'</geometry><geometry s="{200.0 + bend!r}" x="210" y="10" hdg="{math.pi / 2.0!r}" '
        'length="200"><line/></geometry>'
    )
    own_map(store, folder, "angle", plan, 400.0 + bend, 1)
    ends = [((5.0, -1.9, 0.0), (211.9, 200.0, math.pi / 2.0))]
    done = flow_run(store, "angle", ends, 300.0, folder / "angle")
    x, y = 200.0 + 11.875 * math.sin(math.pi / 4.0), 10.0 - 11.875 * math.cos(math.pi / 4.0)
    far = (pl.col("x") - x) ** 2 + (pl.col("y") - y) ** 2
    near = done.trajectories().with_columns(far=far).sort("far").unique("id", keep="first")
    speed = near.filter(pl.col("far") < 25.0)["speed"].to_numpy()
    rates = [np.percentile(speed, share) for share in (15, 50, 85)]
    print(
        f"right angle of 10 m: {len(speed)} cars, 15, 50, 85 %: "
        + ", ".join(f"{3.6 * rate:.1f} km/h ({rate**2 / 11.875:.1f} m/s2)" for rate in rates)
    )


DROP_AT = 2500.0
RISING = (1200.0, 1400.0, 1500.0, 1600.0, 1700.0, 1800.0)
"""Vehicles per hour and lane of three, ten minutes each; two lanes carry 1,600 at most."""
QUEUED = 70.0 / 3.6
"""m/s of the mean upstream below which there is a queue (HCM takes 3/4 of the free speed)."""


def print_breakdown(store: Workspace, folder: Path) -> None:
    """Flow per lane behind the end of a lane, in five minutes before a queue, and in the queue."""
    file = folder / "drop.xodr"
    file.write_text(drop_map())
    store.add_map(file)
    entry = store.map("drop")
    settings = GenerationSettings(map_name="drop", fill=0.0, roi_segments=200)
    (path,) = generate(store, settings=settings)
    until = 600.0 * (len(RISING) + 2)
    flows = tuple(
        Flow(
            id=f"step{step}-{lane}", per_hour=rate, begin=600.0 * step, initial_speed=25.0,
            end=600.0 * (step + 1) if step < len(RISING) - 1 else until,
            spawn=entry.nearest(10.0, -1.875 - 3.75 * lane, 0.0).id,
            goal=entry.nearest(3990.0, -1.875 - 3.75 * min(lane, 1), 0.0).id,
        )
        for step, rate in enumerate(RISING)
        for lane in range(3)
    )  # fmt: skip
    scenario = read_scenario(path).model_copy(update={"actors": (), "flows": flows})
    done = run(store, scenario, settings=RunSettings(until=until), out=folder / "drop")
    rows = done.trajectories().sort("id", "time")
    flow, speed = (
        np.array([
            value(rows, begin) for begin in np.arange(0.0, until - 300.0, 300.0)
        ])
        for value in (flow_behind, speed_before)
    )  # fmt: skip
    queued = np.flatnonzero(speed < QUEUED)
    if not len(queued):
        print("\nthree lanes of which one ends: no queue")
        return
    before, after = flow[: queued[0]].max(), flow[queued[0] + 1 :].mean()
    waves = wave_speed(rows, until)
    print(
        f"\nthree lanes of which one ends: {before:.0f} veh/h/lane before the queue, {after:.0f} "
        f"out of it ({100.0 * (1.0 - after / before):.0f} % less); waves {waves:.0f} km/h upstream"
    )


def drop_map() -> str:
    """A road of 4 km whose third lane ends at :data:`DROP_AT`."""

    def lanes(count: int, link: str) -> str:
        parts = (
            LANE.format(-number).replace(
                "><width",
                f'><link><{link} id="{-number}"/></link><width' if number < 3 else "><width",
            )
            for number in range(1, count + 1)
        )
        return f'<center><lane id="0" type="none"/></center><right>{"".join(parts)}</right>'

    return (
        '<OpenDRIVE><header revMajor="1" revMinor="6"/><road id="1" length="4000" junction="-1">'
        '<link/><type s="0" type="motorway"><speed max="120" unit="km/h"/></type><planView>'
        '<geometry s="0" x="0" y="0" hdg="0" length="4000"><line/></geometry></planView><lanes>'
        f'<laneSection s="0">{lanes(3, "successor")}</laneSection>'
        f'<laneSection s="{DROP_AT}">{lanes(2, "predecessor")}</laneSection>'
        "</lanes></road></OpenDRIVE>"
    )


def flow_behind(rows: pl.DataFrame, begin: float) -> float:
    """Vehicles per hour and lane at 700 m behind the end, in five minutes."""
    here = DROP_AT + 700.0
    part = rows.filter(pl.col("time").is_between(begin, begin + 300.0))
    x, same = pl.col("x"), pl.col("id") == pl.col("id").shift(1)
    return 12.0 * len(part.filter((x >= here) & (x.shift(1) < here) & same)) / 2.0


def speed_before(rows: pl.DataFrame, begin: float) -> float:
    """m/s in the 500 m before the end, mean over five minutes."""
    part = rows.filter(
        pl.col("time").is_between(begin, begin + 300.0)
        & pl.col("x").is_between(DROP_AT - 500.0, DROP_AT)
    )
    return float(part["speed"].mean() or math.inf)


def wave_speed(rows: pl.DataFrame, until: float) -> float:
    """km/h at which a slowdown goes upstream in the last half hour, by the shift of speeds.

    The mean speeds around two places 500 m apart, in bins of 5 s, are held against each other.
    """
    series = []
    for place in (1200.0, 1700.0):
        part = rows.filter(
            (pl.col("time") > until - 1800.0) & pl.col("x").is_between(place - 50.0, place + 50.0)
        )
        bins = part.group_by((pl.col("time") // 5.0).alias("bin")).agg(pl.col("speed").mean())
        known = bins.sort("bin")
        at = np.arange((until - 1800.0) // 5.0 + 1, until // 5.0)
        series.append(np.interp(at, known["bin"].to_numpy(), known["speed"].to_numpy()))
    up, down = (one - one.mean() for one in series)
    lags = np.arange(4, 60)
    likeness = [float(np.corrcoef(up[lag:], down[:-lag])[0, 1]) for lag in lags]
    return 3.6 * 500.0 / (5.0 * float(lags[int(np.argmax(likeness))]))


if __name__ == "__main__":
    main()
