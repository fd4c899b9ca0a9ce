"""Vehicles that other programs drive on the server: SUMO's traffic sees them, and is not theirs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from odscen.carla.mirror.cosim import cosim
from odscen.carla.mirror.cosim_options import CosimOptions
from odscen.carla.mirror.foreign_actors import ForeignRoles
from odscen.carla.server.client import Address
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from tests.carla.conftest import MAPS, hero_pose, scenario_of
from tests.carla.driver import Car, Driver
from tests.carla_standin.process import StandIn

carla = pytest.importorskip("carla", reason="co-simulation needs the package carla")

WEAVE = MAPS / "motorway_weave.xodr"
STEP = 0.1
ROADS = {"south": "36.0.-1", "north": "44.0.-1"}
"""One lane each way; nodes are 2 m apart."""
FOLLOWERS = [
    {"id": name, "category": "car", "spawn": f"{lane}.2", "goal": f"{lane}.78", "speed": 12.0}
    for name, lane in ROADS.items()
]
BRAKING = [(0.0, 8.0), (2.0, 4.0), (3.0, 0.0)]
GONE = 18.0


def mirrored(
    workspace: Workspace, tmp_path: Path, foreign: ForeignRoles | None
) -> tuple[dict[str, Any], pl.DataFrame]:
    """Run with a foreign car ahead of either follower; what is reported, and what was recorded."""
    path = scenario_of(workspace, WEAVE, FOLLOWERS, tmp_path)
    with StandIn(WEAVE, map_name=WEAVE.stem, refuse_grounded=False) as server:
        ahead = [hero_pose(workspace, WEAVE, f"{lane}.30") for lane in ROADS.values()]
        with Driver(
            server, Car(ahead[0], BRAKING, "hero", GONE), Car(ahead[1], BRAKING, "scenario")
        ):
            result, report = cosim(
                workspace,
                path,
                CosimOptions(
                    Address(server.host, server.port), tick=STEP, foreign=foreign, parity=False
                ),
                out=tmp_path / "runs",
                settings=RunSettings(until=34.0, step_length=STEP),
            )
        assert (result.status, report.error, report.refused) == ("completed", None, [])
        left = [a["type_id"] for a in server.actors() if a["type_id"].startswith("vehicle.")]
        assert len(left) == (1 if result.summary["sim_seconds"] > GONE else 2)
    rows = pl.read_parquet(result.folder / "trajectories.parquet").rename(
        lambda name: name.removeprefix("vehicle_").replace("timestep_", "")
    )
    events = json.loads((result.folder / "events.json").read_text())["events"]
    told = {"report": report, "events": events, "summary": result.summary}
    return told, rows


@pytest.mark.slow
def test_who_is_far_below_the_roads_is_not_in_the_traffic(
    workspace: Workspace, tmp_path: Path
) -> None:
    path = scenario_of(workspace, WEAVE, FOLLOWERS, tmp_path)
    with StandIn(WEAVE, map_name=WEAVE.stem, refuse_grounded=False) as server:
        places = [hero_pose(workspace, WEAVE, f"{lane}.30") for lane in ROADS.values()]
        cars = [Car((x, y, -500.0, yaw), [(0.0, 0.0)]) for x, y, _, yaw in places]
        with Driver(server, *cars):
            result, report = cosim(
                workspace,
                path,
                CosimOptions(
                    Address(server.host, server.port), tick=STEP, foreign=ForeignRoles(),
                    parity=False,
                ),
                out=tmp_path / "runs",
                settings=RunSettings(until=8.0, step_length=STEP),
            )  # fmt: skip
    assert (result.status, report.error) == ("completed", None)
    rows = pl.read_parquet(result.folder / "trajectories.parquet")
    assert set(rows["vehicle_id"]) == set(ROADS)
    late = rows.filter(pl.col("timestep_time") > 6.0)
    assert late["vehicle_speed"].min() == pytest.approx(12.0)  # above them, where they would stop


@pytest.mark.slow
def test_traffic_brakes_for_two_vehicles_that_another_client_drives_and_resumes_when_one_goes(
    workspace: Workspace, tmp_path: Path
) -> None:
    told, rows = mirrored(workspace, tmp_path, ForeignRoles())
    assert [(one["type"], one["role"]) for one in told["report"].foreign] == [
        ("vehicle.tesla.model3", "hero"),
        ("vehicle.tesla.model3", "scenario"),
    ]
    for name in ROADS:
        own = rows.filter(pl.col("id") == name)
        assert own["speed"].max() > 7.0
        waiting = own.filter(pl.col("time").is_between(GONE - 3.0, GONE - 1.0))
        assert waiting["speed"].max() < 0.3, f"{name} waits behind the vehicle that has stopped"
    assert not [event for event in told["events"] if event["kind"] == "collision"]
    arrived = {event["actor"] for event in told["events"] if event["kind"] == "arrived"}
    assert arrived == {"south"}, "the hero has gone away, the other one stays"


@pytest.mark.slow
def test_foreign_vehicles_are_in_no_count_and_in_no_recording(
    workspace: Workspace, tmp_path: Path
) -> None:
    told, rows = mirrored(workspace, tmp_path, ForeignRoles())
    assert set(rows["id"].unique()) == set(ROADS)
    counts = told["summary"]["actors"]
    assert (counts["planned"], counts["inserted"], counts["arrived"]) == (2, 2, 1)
    assert {event["actor"] for event in told["events"]} <= set(ROADS)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("foreign", "seen"), [(None, set()), (ForeignRoles(("scenario",)), {"north"})]
)
def test_only_the_roles_that_are_named_are_seen(
    workspace: Workspace, tmp_path: Path, foreign: ForeignRoles | None, seen: set[str]
) -> None:
    told, rows = mirrored(workspace, tmp_path, foreign)
    late = rows.filter(pl.col("time") > 20.0)
    assert set(late["id"].unique()) == seen, "the others have driven through"
    assert len(told["report"].foreign) == len(seen)
