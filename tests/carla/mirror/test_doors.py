"""Doors near the ego open at stops, and are shut before their vehicles move."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from odscen.carla.mirror.cosim import cosim
from odscen.carla.mirror.cosim_options import CosimOptions
from odscen.carla.mirror.mirrored import Doors
from odscen.carla.server.batch import DoorMove
from odscen.carla.server.client import Address
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from odscen.scenario import edits
from odscen.scenario.document.json_form import dumps
from odscen.sumo.runner.in_step import Step
from odscen.sumo.worker.simulation.observed import VehicleSignal
from tests.carla.conftest import MAPS
from tests.carla.mirror.test_wheels import plan_of, step_of
from tests.carla_standin.process import StandIn

LEFT, RIGHT = VehicleSignal.DOOR_OPEN_LEFT, VehicleSignal.DOOR_OPEN_RIGHT
ROAD = MAPS / "t_junction_signs.xodr"
OPEN = (DoorMove("FR", opens=True), DoorMove("RR", opens=True))
SHUT = (DoorMove("FR", opens=False), DoorMove("RR", opens=False))
ACTORS = {row: 100 + row for row in range(8)}


def standing(*signals: int, away: float = 5.0) -> Step:
    """The ego and others, so many metres apart, with these signals."""
    count = len(signals) + 1
    step = step_of([(away * k, 0.0, 0.0) for k in range(count)])
    return replace(step, signals=np.array([0, *map(int, signals)]))


def doors_of(count: int, *, calls: int = 24, able: bool = True) -> Doors:
    return Doors(plan_of(count), np.full(count, able), calls=calls)


def moves(doors: Doors, *steps: Step) -> list[dict[int, Any]]:
    """What is moved in the first tick after each step has been planned."""
    found = []
    for step in steps:
        doors.before(step)
        found.append(doors.moved(ACTORS))
        assert doors.moved(ACTORS) == {}, "once for each change"
    return found


def test_a_door_opens_one_step_after_its_vehicle_has_stopped_and_shuts_before_it_goes() -> None:
    drives, stands = standing(0), standing(RIGHT)
    told = moves(doors_of(2), drives, stands, stands, stands, drives, drives)
    assert told == [{}, {}, {101: OPEN}, {}, {101: SHUT}, {}]


def test_the_drivers_door_is_on_the_left() -> None:
    [_, opened] = moves(doors_of(2), standing(LEFT), standing(LEFT))
    assert opened == {101: (DoorMove("FL", opens=True),)}


def test_only_near_the_ego_and_only_models_that_have_doors() -> None:
    far = standing(RIGHT, away=61.0)
    assert moves(doors_of(2), far, far) == [{}, {}]
    near = standing(RIGHT)
    assert moves(doors_of(2, able=False), near, near) == [{}, {}]
    assert moves(doors_of(2), near, near, far) == [{}, {101: OPEN}, {101: SHUT}]


def test_no_more_doors_are_open_than_can_be_shut_in_a_tick() -> None:
    doors, many = doors_of(6, calls=5), standing(*[RIGHT] * 5)
    told = moves(doors, many, many, many, standing(*[0] * 5))
    assert told == [{}, {101: OPEN, 102: OPEN}, {}, {101: SHUT, 102: SHUT}]


def test_one_who_is_taken_away_is_forgotten() -> None:
    doors, stands = doors_of(2), standing(RIGHT)
    assert moves(doors, stands, stands)[1] == {101: OPEN}
    doors.before(standing(0))
    assert doors.moved({0: 100}) == {}
    doors.before(standing(0))
    assert doors.moved(ACTORS) == {}


@pytest.mark.slow
def test_on_a_server_a_bus_opens_its_doors_at_its_stop_and_never_drives_with_one_open(
    workspace: Workspace, tmp_path: Path
) -> None:
    pytest.importorskip("carla", reason="co-simulation needs the package carla")
    path = bus_beside_the_ego(workspace, tmp_path)
    seen: list[tuple[float, list[float], list[int], int]] = []
    with StandIn(ROAD, map_name=ROAD.stem) as server:

        def look(step: Step) -> bool:
            seen.extend(
                (step.time, one["transform"][0], one["doors"], one["left_doors"])
                for one in server.actors()
                if one["type_id"] == "vehicle.mitsubishi.fusorosa"
            )
            return True

        result, report = cosim(
            workspace,
            path,
            CosimOptions(Address(server.host, server.port), on_step=look, parity=False),
            settings=RunSettings(until=32.0, step_length=0.5),
            out=tmp_path,
        )
        calls = server.calls()
    assert (result.status, report.error) == ("completed", None)
    opened = [(time, place) for time, place, doors, _ in seen if doors]
    assert {tuple(doors) for *_, doors, _ in seen if doors} == {(1, 3)}
    assert 8.0 <= opened[-1][0] - opened[0][0] <= 10.0, "a dwell time of 10 s"
    assert max(math.dist(opened[0][1], place) for _, place in opened) < 0.01
    assert {left for *_, left in seen} == {0}
    assert seen[-1][0] > opened[-1][0] + 2.0
    assert math.dist(seen[-1][1], opened[-1][1]) > 2.0, "it has gone on"
    assert (calls["open_vehicle_door"], calls["close_vehicle_door"]) == (2, 2)


def bus_beside_the_ego(workspace: Workspace, folder: Path) -> Path:
    """A bus that stays for 10 s at a stop, and a slow ego on the same road."""
    graph = workspace.add_map(ROAD).graph()
    scenario = edits.new_scenario(graph, name="bus", roi=graph.segments.ids, seed=4)
    scenario = edits.set_stop(scenario, graph, stop="first", node="2.0.-1.25", bay=True, length=14)
    scenario = edits.set_line(
        scenario, graph, line="7", start="2.0.-1.5", goal="4.0.1.40", stops=({"stop": "first"},),
        departures=(0.0,), dwell=10,
    )  # fmt: skip
    data = scenario.model_dump(mode="json", by_alias=True, exclude_none=True)
    ego = {
        "id": "ego", "category": "car", "spawn": "2.0.-1.18", "goal": "4.0.1.40", "speed": 1.5,
        "ego": True,
    }  # fmt: skip
    path = folder / "bus.scenario.json"
    path.write_text(dumps(type(scenario).model_validate(data | {"actors": [ego]})))
    return path
