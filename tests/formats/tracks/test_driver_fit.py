"""Drivers fitted to recorded traffic: parameters that are known come out again."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from typer.testing import CliRunner

import odscen
from odscen.cli.commands import command_line
from odscen.formats.tracks.driver_fit import PARAMETERS, fit_driver, fit_drivers
from odscen.formats.tracks.followings import find_followings
from odscen.formats.tracks.recorded_traffic import complete_tracks
from odscen.lanegraph.query import node_id

TRUTH = {
    "one": {"tau": 1.4, "minGap": 2.6, "accel": 1.6, "decel": 2.8},
    "two": {"tau": 0.9, "minGap": 1.8, "accel": 2.0, "decel": 3.5},
    "three": {"tau": 1.9, "minGap": 3.2, "accel": 1.3, "decel": 2.2},
}
LENGTH, STEP = 4.5, 0.1
GOALS = (14.0, 5.0, 12.0, 0.0, 13.0, 3.0)
ROAD = """<OpenDRIVE><header revMajor="1" revMinor="6"/><road id="1" length="1500" junction="-1">
<type s="0" type="rural"><speed max="100" unit="km/h"/></type><planView>
<geometry s="0" x="0" y="0" hdg="0" length="1500"><line/></geometry></planView><lanes>
<laneSection s="0"><center><lane id="0" type="none"/></center><right><lane id="-1" type="driving">
<width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></right></laneSection></lanes></road>
</OpenDRIVE>"""


def platoon(noise: float = 0.0) -> pl.DataFrame:
    """Tracks of a leader that stops and goes, and three drivers by the textbook's formula.

    Treiber, Hennecke and Helbing, 2000; a desired speed of 30 m/s. ``noise`` is the deviation of
    places (m) and speeds (m/s).
    """
    rng = np.random.default_rng(1)
    time = np.arange(0.0, 54.0, STEP)
    speed = [8.0]
    for now in time[1:]:
        change = np.clip(GOALS[int(now // 9.0)] - speed[-1], -0.3, 0.3)
        speed.append(max(0.0, speed[-1] + float(change)))
    v = np.array(speed)
    x = np.cumsum(np.append(0.0, v[1:] * STEP))
    tracks = [("zero", x, v)]
    for name, p in TRUTH.items():
        own_x, own_v = np.empty_like(x), np.empty_like(x)
        own_x[0], own_v[0] = x[0] - LENGTH - 20.0, 8.0
        for k in range(len(time) - 1):
            gap, u = x[k] - own_x[k] - LENGTH, own_v[k]
            root = 2.0 * (p["accel"] * p["decel"]) ** 0.5
            wanted = p["minGap"] + max(0.0, u * p["tau"] + u * (u - v[k]) / root)
            a = p["accel"] * (1.0 - (u / 30.0) ** 4 - (wanted / gap) ** 2)
            own_v[k + 1] = max(0.0, u + a * STEP)
            own_x[k + 1] = own_x[k] + own_v[k + 1] * STEP
        tracks.append((name, own_x, own_v))
        x, v = own_x, own_v
    rows = pl.concat(
        pl.DataFrame({"id": name, "time": time, "x": x, "speed": v}) for name, x, v in tracks
    ).with_columns(kind=pl.lit("car"), y=0.0, hdg=0.0, length=LENGTH, width=1.8)
    return rows.with_columns(
        x=rows["x"] + rng.normal(0.0, noise, rows.height),
        speed=(rows["speed"] + rng.normal(0.0, noise, rows.height)).clip(0.0),
    )


def misses(rows: pl.DataFrame, model: str = "IDM") -> dict[str, float]:
    """Largest relative error of each driver's parameters."""
    found: dict[str, list[Any]] = {}
    for following in find_followings(rows):
        found.setdefault(following.id, []).append(following)
    assert found.keys() == TRUTH.keys()
    worst = {}
    for name, followings in found.items():
        fitted = fit_driver(followings, model=model)
        worst[name] = max(abs(fitted[key] / TRUTH[name][key] - 1.0) for key in PARAMETERS)
    return worst


@pytest.mark.slow
def test_known_drivers_are_recovered_from_exact_tracks() -> None:
    assert max(misses(complete_tracks(platoon(), "test").rows).values()) < 0.05


@pytest.mark.slow
def test_known_drivers_are_recovered_within_a_tenth_from_tracks_with_errors() -> None:
    assert max(misses(complete_tracks(platoon(0.2), "test").rows).values()) < 0.1


def test_what_has_no_followers_is_refused() -> None:
    alone = platoon().filter(pl.col("id") == "zero")
    with pytest.raises(odscen.InputError, match="no vehicle follows another one for 10 s"):
        fit_drivers(complete_tracks(alone, "test").rows)


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> odscen.Workspace:
    root = tmp_path_factory.mktemp("fit")
    (root / "long.xodr").write_text(ROAD)
    store = odscen.Workspace.open(root)
    store.add_map(root / "long.xodr")
    return store


@pytest.mark.slow
@pytest.mark.parametrize("model", ["IDM", "Krauss"])
def test_drivers_of_a_run_are_recovered_and_written_for_scenarios(
    workspace: odscen.Workspace, tmp_path: Path, model: str
) -> None:
    entry = workspace.map("long")
    graph = entry.graph()

    def place(x: float) -> str:
        return str(node_id(graph, int(np.argmin(np.abs(graph.lanes.x - x)))))

    actors: list[dict[str, Any]] = [
        {"id": "zero", "category": "car", "spawn": place(200), "initial_speed": 8, "speed": 14}
    ]
    sets = []
    for k, (name, values) in enumerate(TRUTH.items(), start=1):
        sets.append({"id": f"drives-{name}", "car_following": model, "parameters": values})
        actors.append(
            {"id": name, "category": "car", "spawn": place(200 - 35 * k), "initial_speed": 8}
            | {"style": f"drives-{name}"}
        )
    rules = [
        {"id": f"r{k}", "actor": "zero", "when": {"time": {"after": 1 + 9.0 * k}}}
        | {"then": [{"speed": {"to": goal, "rate": 3.0}}]}
        for k, goal in enumerate(GOALS)
    ]
    scenario = odscen.Scenario.model_validate(
        {
            "name": "platoon",
            "map": {"name": "long", "sha256": entry.sha256, "spacing": graph.lanes.spacing},
            "roi": list(graph.segments.ids),
            "simulation": {"duration": 60, "step_length": 0.1},
            "drivers": {"sets": sets},
            "actors": actors,
            "rules": rules,
        }
    )
    run = odscen.run(workspace, scenario, out=tmp_path / "run")
    recorded = odscen.read_recorded_traffic(run.folder).rows
    # Krauss' next speed is a formula of what is recorded: nothing is left but rounding.
    assert max(misses(recorded, model).values()) < (0.1 if model == "IDM" else 0.01)

    out = tmp_path / "drivers.json"
    arguments = ["recording", "fit", str(run.folder), "--map", "long", "--out", str(out), "--json"]
    said = CliRunner().invoke(command_line(), [*arguments, "--workspace", str(workspace.root)])
    assert said.exit_code == 0, said.output
    report = json.loads(said.stdout)
    cars = report["categories"]["car"]
    assert (cars["fitted"], cars["held_out"]) == (2, 1)
    assert cars["model"] == model
    assert cars["misfit"][model] == min(cars["misfit"].values())
    gap_errors = {
        row["figure"]: next(iter(row[name]["rms"] for name in ("fitted", "default") if name in row))
        for row in report["comparison"]
        if row["figure"].startswith("gap error")
    }
    assert set(gap_errors) == {"gap error of fitted drivers", "gap error of default drivers"}
    again = odscen.Scenario.model_validate(
        scenario.model_dump(mode="json") | {"drivers": json.loads(out.read_text()), "actors": []}
    )
    assert [(one.id, one.car_following) for one in again.drivers.sets] == [("recorded-car", model)]
