"""What measures do: a closure diverts, an incident queues, a bus lane speeds up its buses.

``python -m bench.measures FOLDER`` prints the tables of docs/measures.md; FOLDER gets the runs.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import polars as pl

from odscen.app.maps import load_map
from odscen.app.running.runs import check_file, prepare_run
from odscen.base.categories import Category
from odscen.figures.measures.comparison import compare_figure
from odscen.maps.store import Workspace
from odscen.runs.recorded import read_trajectories
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.json_form import dumps
from odscen.scenario.document.measures_document import (
    ChangedPermission,
    LaneIncident,
    RoadClosure,
)
from odscen.scenario.document.scenario_document import (
    Background,
    Demand,
    Flow,
    MapReference,
    Scenario,
    Simulation,
    Transit,
)
from odscen.sumo.realize.sumo_lane_places import lane_segments
from odscen.sumo.runner.run_jobs import run_prepared

if TYPE_CHECKING:
    from odscen.app.maps import LoadedMap

MAPS = Path(__file__).parents[1] / "maps"
SEEDS = range(1, 6)
CLOSED, BEGIN, END = "r25", 600.0, 1800.0
BUS_LANES = ("3.0.-2", "12.0.-2", "23.0.-2", "34.0.-2")
SLOW = 5.0
"""m/s below which a vehicle counts as queued."""


def main() -> None:
    """Print the tables."""
    root = Path(sys.argv[1])
    workspace = Workspace.open(root / "workspace")
    for name in ("town_5x5", "motorway_weave"):
        if name not in workspace.map_names():
            workspace.add_map(MAPS / f"{name}.xodr")
    closure(workspace, root)
    incident(workspace, root)
    bus_lane(workspace, root)


def town(loaded: LoadedMap) -> Scenario:
    """1,200 trips in 40 minutes on the whole of town_5x5."""
    background = Background(id="traffic", trips=1200.0)
    return _scenario(loaded, "open", 2400.0).model_copy(
        update={"demand": Demand(background=(background,))}
    )


def motorway(loaded: LoadedMap) -> Scenario:
    """2,100 vehicles an hour from one end of the carriageway to the other, for 50 minutes."""
    flows = tuple(
        Flow(
            id=f"lane{lane}",
            spawn=f"1.0.-{lane}.5",
            goal=f"5.2.-{lane}.43",
            per_hour=700.0,
            end=3000.0,
        )
        for lane in (1, 2, 3)
    )
    return _scenario(loaded, "free", 3600.0).model_copy(update={"flows": flows})


def accident(*, begin: float = 600.0, end: float = 1800.0) -> tuple[LaneIncident, ...]:
    """Two of three lanes blocked, 420 m before the weaving area."""
    return tuple(
        LaneIncident(
            id=f"broken{lane}", kind="incident", begin=begin, end=end, lane=f"2.1.-{lane}", s=400.0
        )
        for lane in (2, 3)
    )


def closure(workspace: Workspace, root: Path) -> None:
    """Vehicles on each road while one is closed, against the same traffic without."""
    loaded = load_map(workspace.map("town_5x5"))
    base = town(loaded)
    shut = RoadClosure(id="shut", kind="closure", begin=BEGIN, end=END, places=(CLOSED,))
    both = (base, base.model_copy(update={"name": "shut", "measures": (shut,)}))
    found = [
        {
            # The first five minutes are left out: until then roads empty and fill.
            seed: counted(loaded, _run(workspace, one, seed, root), begin=BEGIN + 300.0, end=END)
            for seed in SEEDS
        }
        for one in both
    ]
    print("road, open, closed, difference, low, high")
    for road in sorted(found[0][1].keys() | {CLOSED}):
        a, b = ({seed: float(by[seed].get(road, 0)) for seed in SEEDS} for by in found)
        change = compare_figure(a, b)
        if change.clear or road == CLOSED:
            print(road, change.a, change.b, change.difference, change.low, change.high)


def incident(workspace: Workspace, root: Path) -> None:
    """Queued vehicles before the accident, every two minutes, without it and with it."""
    loaded = load_map(workspace.map("motorway_weave"))
    base = motorway(loaded)
    blocked = base.model_copy(update={"name": "accident", "measures": accident()})
    free, queued = (
        queue(loaded, _run(workspace, one, 1, root), every=120.0) for one in (base, blocked)
    )
    print("time, without, with")
    for time in range(0, 3601, 120):
        print(time, free.get(float(time), 0), queued.get(float(time), 0))


def avenue(loaded: LoadedMap) -> Scenario:
    """1,300 cars an hour for 25 minutes along the avenue of town_5x5, a bus every two minutes."""
    flows = tuple(
        Flow(
            id=f"cars{lane}",
            spawn=f"3.0.-{lane}.8",
            goal=f"44.0.-{lane}.36",
            per_hour=650.0,
            end=1500.0,
        )
        for lane in (1, 2)
    )
    line = {
        "id": "7",
        "start": "3.0.-2.3",
        "goal": "44.0.-2.38",
        "stops": [{"stop": "market"}],
        "headway": 120.0,
        "end": 1500.0,
    }
    stop = {"id": "market", "node": "23.0.-2.20", "length": 18.0, "bay": True}
    return _scenario(loaded, "avenue", 4500.0).model_copy(
        update={
            "flows": flows,
            "transit": Transit.model_validate({"stops": [stop], "lines": [line]}),
        }
    )


def bus_lane(workspace: Workspace, root: Path) -> None:
    """Travel times of buses and cars along the avenue, without a bus lane and with it."""
    loaded = load_map(workspace.map("town_5x5"))
    base = avenue(loaded)
    lane = ChangedPermission(
        id="buses", kind="permission", places=BUS_LANES, allowed=(Category.BUS, Category.BICYCLE)
    )
    both = (base, base.model_copy(update={"name": "buslane", "measures": (lane,)}))
    found = [{seed: _times(_run(workspace, one, seed, root)) for seed in SEEDS} for one in both]
    print("who, without, with, difference, low, high")
    for who in ("buses", "cars", "last car"):
        a, b = ({seed: by[seed][who] for seed in SEEDS} for by in found)
        change = compare_figure(a, b)
        print(who, change.a, change.b, change.difference, change.low, change.high)


def _times(rows: pl.DataFrame) -> dict[str, float]:
    """Mean seconds in the network of buses and of cars, and when the last car is gone."""
    rows = rows.with_columns(pl.col("vehicle_id").str.starts_with("cars").alias("car"))
    each = rows.group_by("vehicle_id", "car").agg(
        (pl.col("timestep_time").max() - pl.col("timestep_time").min()).alias("time")
    )
    means = dict(each.group_by("car").agg(pl.col("time").mean()).iter_rows())
    last = rows.filter(pl.col("car"))["timestep_time"].max()
    return {"buses": means[False], "cars": means[True], "last car": float(str(last))}


def queue(loaded: LoadedMap, rows: pl.DataFrame, *, every: float) -> dict[float, int]:
    """Vehicles slower than 5 m/s on the carriageway up to the weaving area, by time."""
    before = [
        lane
        for lane, segments in lane_segments(loaded.sumo).items()
        if segments[0].startswith(("r1-", "r2-", "j10001"))
    ]
    slow = rows.filter(
        (pl.col("vehicle_speed") < SLOW)
        & pl.col("vehicle_lane").is_in(before)
        & ~pl.col("vehicle_id").str.starts_with("broken")
        & (pl.col("timestep_time") % every == 0.0)
    )
    return dict(slow.group_by("timestep_time").len().iter_rows())


def _scenario(loaded: LoadedMap, name: str, duration: float) -> Scenario:
    graph = loaded.sumo.graph
    return Scenario(
        name=name,
        map=MapReference(name=graph.map_name, sha256=graph.map_sha256, spacing=graph.lanes.spacing),
        roi=tuple(map(str, graph.segments.ids)),
        simulation=Simulation(duration=duration),
    )


def counted(loaded: LoadedMap, rows: pl.DataFrame, *, begin: float, end: float) -> dict[str, int]:
    """Vehicles that were on each road at some time between two."""
    rows = rows.filter(pl.col("timestep_time").is_between(begin, end))
    roads = {lane: parts[0] for lane, parts in lane_segments(loaded.sumo).items()}
    rows = rows.with_columns(
        pl.col("vehicle_lane").replace_strict(roads, default=None).alias("road")
    )
    found = rows.group_by("road").agg(pl.col("vehicle_id").n_unique())
    return {road: count for road, count in found.iter_rows() if road and road.startswith("r")}


def _run(workspace: Workspace, scenario: Scenario, seed: int, root: Path) -> pl.DataFrame:
    file = root / f"{scenario.name}.json"
    file.write_text(dumps(scenario), encoding="utf-8")
    prepared = prepare_run(check_file(workspace, file, settings=RunSettings(seed=seed)))
    result = run_prepared(prepared, root / f"{scenario.name}-{seed}")
    print(scenario.name, seed, result.status, result.summary["actors"], file=sys.stderr)
    recorded = read_trajectories(result.folder, most=100_000_000)
    return pl.DataFrame() if recorded is None else recorded.rows


if __name__ == "__main__":
    main()
