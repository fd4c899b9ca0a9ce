"""An ego that somebody drives in CARLA: SUMO's traffic sees it and reacts."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from odscen.base.errors import InputError
from odscen.carla.mirror.cosim import cosim
from odscen.carla.mirror.cosim_options import CosimOptions
from odscen.carla.mirror.cosim_report import CosimReport
from odscen.carla.server.client import Address
from odscen.maps.store import Workspace
from odscen.runs.finished_run import Run
from odscen.runs.run_settings import RunSettings
from tests.carla.conftest import MAPS, hero_pose, scenario_of
from tests.carla.driver import Car, Driver
from tests.carla_standin.process import StandIn

carla = pytest.importorskip("carla", reason="co-simulation needs the package carla")

STEP = 0.1


def drive(
    workspace: Workspace,
    xodr: Path,
    actors: list[dict[str, Any]],
    speeds: list[tuple[float, float]],
    tmp_path: Path,
    *,
    until: float,
) -> tuple[Run, CosimReport, pl.DataFrame, list[dict[str, Any]]]:
    path = scenario_of(workspace, xodr, actors, tmp_path)
    ego = next(actor for actor in actors if actor.get("ego"))
    # The driver makes its hero where it is to be, without the way down.
    with StandIn(xodr, map_name=xodr.stem, refuse_grounded=False) as server:
        with Driver(server, Car(hero_pose(workspace, xodr, ego["spawn"]), speeds)):
            result, report = cosim(
                workspace,
                path,
                CosimOptions(Address(server.host, server.port), tick=STEP, external_ego=True),
                out=tmp_path / "runs",
                settings=RunSettings(until=until, step_length=STEP),
            )
        roles = [a["type_id"] for a in server.actors() if a["type_id"].startswith("vehicle.")]
        assert roles == ["vehicle.tesla.model3"], "the hero is not ours and stays"
    rows = pl.read_parquet(result.folder / "trajectories.parquet").rename(
        lambda name: name.removeprefix("vehicle_").replace("timestep_", "")
    )
    events = json.loads((result.folder / "events.json").read_text())["events"]
    return result, report, rows, events


@pytest.mark.slow
def test_a_follower_brakes_behind_an_ego_that_brakes_in_carla(
    workspace: Workspace, tmp_path: Path
) -> None:
    actors = [
        {
            "id": "ego", "category": "car", "model": "vehicle.tesla.model3", "ego": True,
            "spawn": "2.1.-1.40", "goal": "4.1.-1.200", "speed": 20.0,
        },
        {
            "id": "behind", "category": "car", "spawn": "2.1.-1.25", "goal": "4.1.-1.200",
            "speed": 22.0,
        },
    ]  # fmt: skip
    # 20 m/s, and after 4 s down to a stand at 8 m/s^2.
    braking = [(4.0 + 0.1 * k, max(0.0, 20.0 - 0.8 * k)) for k in range(26)]
    result, report, rows, events = drive(
        workspace, MAPS / "motorway_weave.xodr", actors, [(0.0, 20.0), *braking], tmp_path,
        until=20.0,
    )  # fmt: skip
    assert (result.status, report.error) == ("completed", None)
    ego, behind = rows.filter(pl.col("id") == "ego"), rows.filter(pl.col("id") == "behind")
    assert ego["x"].max() > ego["x"].min() + 80.0, "it was driven"
    assert behind["speed"].max() > 15.0
    assert behind["speed"].tail(1).item() < 0.5
    both = ego.join(behind, on="time", suffix="_behind")
    if both["lane"].to_list()[-1] == both["lane_behind"].to_list()[-1]:
        gap = (both["x"] - both["x_behind"]).min()
        assert gap > 4.7  # its own length
    assert not [event for event in events if event["kind"] == "collision"]


@pytest.mark.slow
def test_sumos_ego_is_where_the_hero_is(workspace: Workspace, tmp_path: Path) -> None:
    actors = [
        {
            "id": "ego", "category": "car", "model": "vehicle.tesla.model3", "ego": True,
            "spawn": "2.1.-1.40", "goal": "4.1.-1.200",
        },
    ]  # fmt: skip
    _, _, rows, _ = drive(
        workspace, MAPS / "motorway_weave.xodr", actors, [(0.0, 12.0)], tmp_path, until=8.0
    )
    late = rows.filter((pl.col("id") == "ego") & (pl.col("time") > 3.0))
    assert late.height > 40
    steps = late["x"].diff().drop_nulls()
    assert steps.min() == pytest.approx(1.2, abs=1e-3)
    assert steps.max() == pytest.approx(1.2, abs=1e-3)
    assert late["speed"].to_numpy() == pytest.approx(12.0, abs=0.05)
    assert late["y"].to_numpy() == pytest.approx(late["y"][0], abs=1e-3)


def test_who_has_right_of_way_brakes_for_an_ego_that_ignores_it_or_the_crash_is_told(
    workspace: Workspace, tmp_path: Path
) -> None:
    actors = [
        {
            "id": "ego", "category": "car", "model": "vehicle.tesla.model3", "ego": True,
            "spawn": "5.0.-1.20",
        },
        {
            "id": "major", "category": "car", "spawn": "4.0.-1.34", "goal": "2.0.1.30",
            "speed": 13.0,
        },
    ]  # fmt: skip
    result, report, rows, events = drive(
        workspace, MAPS / "t_junction_signs.xodr", actors, [(0.0, 11.0), (6.25, 0.0)], tmp_path,
        until=14.0,
    )  # fmt: skip
    assert (result.status, report.error) == ("completed", None)
    major = rows.filter(pl.col("id") == "major")
    assert major["speed"].max() > 8.0, "it was under way"
    stopped = major["speed"].tail(1).item() < 0.5
    crashed = any(event["kind"] == "collision" for event in events)
    assert stopped or crashed


@pytest.mark.slow
def test_an_ego_that_runs_through_a_column_in_a_junction_collides_and_that_is_reported(
    workspace: Workspace, tmp_path: Path
) -> None:
    ego = {
        "id": "ego", "category": "car", "model": "vehicle.tesla.model3", "ego": True,
        "spawn": "5.0.-1.20",
    }  # fmt: skip
    column = [
        {
            "id": f"major-{k}", "category": "car", "spawn": f"4.0.-1.{k}", "goal": "2.0.1.30",
            "speed": 13.0,
        }
        for k in range(2, 36, 5)
    ]  # fmt: skip
    result, report, _, events = drive(
        workspace, MAPS / "t_junction_signs.xodr", [ego, *column],
        [(0.0, 0.0), (4.0, 11.0)], tmp_path, until=16.0,
    )  # fmt: skip
    assert (result.status, report.error) == ("completed", None)
    crashes = [event for event in events if event["kind"] == "collision"]
    parties = {name for event in crashes for name in (event["actor"], event["partner"])}
    assert "ego" in parties
    assert any(name.startswith("major-") for name in parties)
    assert result.summary["actors"]["collided"] >= 2


@pytest.mark.slow
def test_an_ego_of_ours_waits_for_a_driver_and_is_taken_away(
    workspace: Workspace, tmp_path: Path
) -> None:
    xodr = MAPS / "motorway_weave.xodr"
    actors = [{"id": "ego", "category": "car", "ego": True, "spawn": "2.1.-1.40"}]
    path = scenario_of(workspace, xodr, actors, tmp_path)
    with StandIn(xodr, map_name=xodr.stem) as server:
        before = server.actors()
        options = CosimOptions(Address(server.host, server.port), tick=STEP, external_ego=True)
        result, report = cosim(
            workspace,
            path,
            options,
            out=tmp_path,
            settings=RunSettings(until=2.0, step_length=STEP),
        )
        assert (result.status, report.error, report.spawned) == ("completed", None, 0)
        assert [a["id"] for a in server.actors()] == [a["id"] for a in before]
    rows = pl.read_parquet(result.folder / "trajectories.parquet")
    assert rows["vehicle_speed"].tail(5).max() == pytest.approx(0.0, abs=0.01)


@pytest.mark.slow
def test_without_an_ego_nobody_can_drive_it(workspace: Workspace, tmp_path: Path) -> None:
    xodr = MAPS / "motorway_weave.xodr"
    path = scenario_of(
        workspace, xodr, [{"id": "a", "category": "car", "spawn": "2.1.-1.40"}], tmp_path
    )
    with StandIn(xodr, map_name=xodr.stem) as server:
        options = CosimOptions(Address(server.host, server.port), external_ego=True)
        with pytest.raises(InputError, match="no ego"):
            cosim(workspace, path, options, out=tmp_path)
