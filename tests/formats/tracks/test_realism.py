"""Distances between a run and a recording are those by which they were made to differ."""

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
from odscen.formats.tracks.realism import compare_traffic
from odscen.formats.tracks.recorded_traffic import complete_tracks

ROOT = Path(__file__).parents[3]
LEFT, RIGHT = 0.0, -3.25
"""y of the two lanes of road 3, 3.25 m wide, which lead east from x = -146 to -18."""
LENGTH, WIDTH = 4.5, 1.8


def platoon(*, faster: float = 0.0, left: float = 0.0, gap: float = 20.0) -> pl.DataFrame:
    """Ten cars in a lane with ``gap`` metres between bodies, at 8 to 8.9 m/s, for 9 s."""
    t = np.arange(0.0, 9.0 + 1e-9, 0.1)
    parts = []
    for k in range(10):
        speed = 8.0 + faster
        x = -20.0 - 80.0 - k * (gap + LENGTH) + speed * t
        parts.append(
            pl.DataFrame({"id": f"v{k}", "time": t, "x": x}).with_columns(
                y=pl.lit(left), hdg=pl.lit(0.0), speed=pl.lit(speed), kind=pl.lit("car"),
                length=pl.lit(LENGTH), width=pl.lit(WIDTH),
            )
        )  # fmt: skip
    return complete_tracks(pl.concat(parts), "test").rows


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> odscen.Workspace:
    store = odscen.Workspace.open(tmp_path_factory.mktemp("realism"))
    store.add_map(ROOT / "maps" / "signal_crossing.xodr")
    return store


def vehicles_of(compared: dict[str, Any]) -> dict[str, dict[str, Any]]:
    return {row["figure"]: row for row in compared["figures"] if row["group"] == "vehicles"}


def test_traffic_has_no_distance_from_itself() -> None:
    compared = compare_traffic(platoon(), platoon())
    assert {row["distance"] for row in compared["figures"]} == {0.0}
    assert compared["kinds"]["all"] == {"divergence": 0.0, "between_halves": 0.0}


def test_distances_are_those_by_which_speeds_and_gaps_differ() -> None:
    found = vehicles_of(compare_traffic(platoon(faster=2.0, gap=15.0), platoon()))
    assert found["speed"]["distance"] == pytest.approx(2.0, abs=1e-3)
    assert found["speed"]["divergence"] == pytest.approx(1.0)
    assert found["acceleration"]["distance"] == pytest.approx(0.0, abs=1e-3)
    assert found["nearest_distance"]["distance"] == pytest.approx(5.0, abs=1e-3)
    assert found["headway"]["recorded"]["mean"] == pytest.approx(20.0 / 8.0, abs=1e-3)
    assert found["headway"]["run"]["mean"] == pytest.approx(15.0 / 10.0, abs=1e-3)
    assert found["ttc"]["distance"] == 0.0
    assert found["touching"]["run"]["mean"] == 0.0


def test_bodies_that_touch_and_short_times_to_collision_are_counted() -> None:
    # Who follows is 4 m/s faster: 24.5 m between the middles, less 4 m/s, so that the bodies touch
    # from 5 s on, for as long as it takes to drive two lengths.
    ahead = platoon().filter(pl.col("id") == "v0")
    behind = platoon(faster=4.0).filter(pl.col("id") == "v1")
    found = vehicles_of(compare_traffic(pl.concat([ahead, behind]), platoon()))
    t = np.arange(0.0, 9.0 + 1e-9, 0.1)
    middles = 20.0 + LENGTH - 4.0 * t
    touches = np.abs(middles) <= LENGTH + 1e-9
    assert found["touching"]["run"]["mean"] == pytest.approx(touches.mean(), abs=1e-4)
    # The one behind has 5 s at first; that ahead, and each that is past, has none: 5 s.
    own = np.where(middles > 0.0, np.maximum(5.0 - t, 0.0), 5.0)
    assert found["ttc"]["run"]["mean"] == pytest.approx((own.mean() + 5.0) / 2.0, abs=1e-3)


def test_edges_of_lanes_and_the_recorded_part_of_the_map_count(
    workspace: odscen.Workspace,
) -> None:
    graph = workspace.map("signal_crossing").graph()
    seen = pl.col("x").is_between(-130.0, -60.0)
    recorded = platoon().filter(seen)
    compared = compare_traffic(platoon(left=0.3), recorded, graph)
    found = vehicles_of(compared)
    assert found["lane_edge"]["recorded"]["mean"] == pytest.approx((3.25 - WIDTH) / 2.0, abs=0.01)
    assert found["lane_edge"]["distance"] == pytest.approx(0.3, abs=0.01)
    assert found["off_lane"]["run"]["mean"] == 0.0
    whole = platoon(left=0.3)
    near = whole.filter(pl.col("x").is_between(-140.0, -50.0)).height / whole.height
    assert compared["run"]["share"] == pytest.approx(near, abs=0.03)
    beside = vehicles_of(compare_traffic(platoon(left=6.0), recorded, graph))
    assert beside["off_lane"]["distance"] == 1.0
    with pytest.raises(odscen.InputError, match="within 10 m of where it was recorded"):
        compare_traffic(platoon(left=60.0), recorded, graph)


@pytest.mark.slow
def test_the_command_and_a_suite_have_the_same_number(
    workspace: odscen.Workspace, tmp_path: Path
) -> None:
    scenario = ROOT / "suites" / "scenarios" / "signal_crossing.scenario.json"
    run = odscen.run(
        workspace, scenario, out=tmp_path / "run", settings=odscen.RunSettings(until=60.0, seed=2)
    )
    file = tmp_path / "recorded.parquet"
    odscen.read_recorded_traffic(run.folder).rows.write_parquet(file)
    page = tmp_path / "page.html"
    other = odscen.run(
        workspace, scenario, out=tmp_path / "other", settings=odscen.RunSettings(until=60.0, seed=3)
    )
    arguments = ["recording", "realism", str(other.folder), str(file), "--map", "signal_crossing"]
    arguments += ["--html", str(page), "--json", "--workspace", str(workspace.root)]
    said = CliRunner().invoke(command_line(), arguments)
    assert said.exit_code == 0, said.output
    kinds = json.loads(said.stdout)["kinds"]
    assert set(kinds) == {"kinematic", "interactive", "map", "all"}
    assert 0.0 < kinds["all"]["divergence"] < 0.2
    assert "Divergence by kind" in page.read_text(encoding="utf-8")
    suite = tmp_path / "suite.toml"
    suite.write_text(
        f"""
        scenarios = [{json.dumps(str(scenario))}]
        until = 60
        usable = false
        expect = ["same <= 0", "likeness < 0.2", "likeness > 0"]
        [[scenario]]
        file = {json.dumps(str(scenario))}
        seeds = [2]
        [figures.same]
        recording = "recorded.parquet"
        of = "speed"
        [figures.likeness]
        recording = "recorded.parquet"
        window = "0..30"
        """
    )
    result = odscen.run_suite(workspace, odscen.read_suite(suite))
    assert [case.failures + case.errors for case in result.cases] == [()]
    suite.write_text(suite.read_text().replace('"speed"', '"sped"'))
    with pytest.raises(odscen.ScenarioError) as refused:
        odscen.read_suite(suite)
    assert "'sped' is none of all, kinematic, interactive, map, speed" in str(refused.value)
