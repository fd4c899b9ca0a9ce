"""Which doors are open at stops, as the worker says: SUMO's own bits for doors are never set."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import polars as pl
import pytest

from odscen.runs.recorded import read_stays
from odscen.runs.run_settings import RunSettings
from odscen.sumo.runner.elevation import ElevationLookup
from odscen.sumo.runner.in_step import InStep, Step
from odscen.sumo.runner.prepare import prepare
from odscen.sumo.runner.run_jobs import run_prepared
from odscen.sumo.worker.simulation.observed import VehicleSignal
from odscen.sumo.worker.simulation.stop_doors import GETTING_OUT, StopDoors
from tests.parking_case import parking_scenario, parking_town

LEFT, RIGHT = VehicleSignal.DOOR_OPEN_LEFT, VehicleSignal.DOOR_OPEN_RIGHT
AT_BUS_STOP, PARKED, ON_THE_LANE = 1 + 16, 1 + 2 + 128, 1


class Sumo:
    """What of libsumo is asked for."""

    def __init__(self, net: Path, states: dict[str, int]) -> None:
        self.starting: tuple[str, ...] = ()
        self.ending: tuple[str, ...] = ()
        self.driven = 100.0
        self.simulation = SimpleNamespace(
            getStopStartingVehiclesNumber=lambda: len(self.starting),
            getStopStartingVehiclesIDList=lambda: self.starting,
            getStopEndingVehiclesNumber=lambda: len(self.ending),
            getStopEndingVehiclesIDList=lambda: self.ending,
            getOption=lambda _name: str(net),
        )
        self.vehicle = SimpleNamespace(
            getStopState=states.__getitem__, getDistance=lambda _name: self.driven
        )


@pytest.fixture
def made(tmp_path: Path) -> Any:
    def sumo(*, lefthand: str = "") -> tuple[Sumo, StopDoors]:
        net = tmp_path / "net.xml"
        net.write_text(f'<?xml version="1.0"?>\n<!-- a > b -->\n<net version="1.20"{lefthand}>\n')
        states = {"bus": AT_BUS_STOP, "car": PARKED, "van": ON_THE_LANE}
        own = Sumo(net, states)
        return own, StopDoors(own)

    return sumo


IDS = ("bus", "car", "van")


def test_a_bus_has_its_kerb_doors_open_until_it_leaves_and_a_parked_car_the_drivers_a_while(
    made: Any,
) -> None:
    sumo, doors = made()
    assert doors.signals(IDS, 0.0).tolist() == [0, 0, 0]
    sumo.starting = IDS
    assert doors.signals(IDS, 1.0).tolist() == [RIGHT, LEFT, 0]
    sumo.starting = ()
    assert doors.signals(IDS, 0.9 + GETTING_OUT).tolist() == [RIGHT, LEFT, 0]
    assert doors.signals(IDS, 1.0 + GETTING_OUT).tolist() == [RIGHT, 0, 0]
    sumo.ending = ("bus",)
    assert doors.signals(IDS, 30.0).tolist() == [0, 0, 0]


def test_where_traffic_keeps_to_the_left_the_kerb_is_there(made: Any) -> None:
    sumo, doors = made(lefthand=' lefthand="true"')
    sumo.starting = IDS
    assert doors.signals(IDS, 1.0).tolist() == [LEFT, RIGHT, 0]


def test_of_a_car_that_begins_parked_nobody_gets_out(made: Any) -> None:
    sumo, doors = made()
    sumo.starting, sumo.driven = ("car",), 0.0
    assert doors.signals(IDS, 1.0).tolist() == [0, 0, 0]


@pytest.mark.slow
def test_in_sumo_a_car_that_takes_a_place_opens_its_drivers_door_once(tmp_path: Path) -> None:
    """Those that begin in a place do not open it there."""
    town = parking_town()
    net = tmp_path / "net.net.xml"
    net.write_bytes(town.net_xml)
    parking = {"begin": 0.3, "end": 0.7, "stay": 60}
    scenario = parking_scenario(parking, trips=60, duration=150.0)
    prepared = prepare(scenario, town.sumo, net, settings=RunSettings(step_length=0.5))
    opened: dict[str, list[float]] = {}
    speeds: list[float] = []

    def look(step: Step) -> None:
        found = (step.signals & (LEFT | RIGHT)) > 0
        assert set((step.signals[found] & (LEFT | RIGHT)).tolist()) <= {int(LEFT)}
        speeds.extend(step.speed[found].tolist())
        for name in step.ids[found].tolist():
            opened.setdefault(name, []).append(step.time)

    ground = ElevationLookup(town.sumo.graph, town.table)
    run_prepared(prepared, tmp_path / "run", live=InStep(prepared.plan, ground, look))
    stays = read_stays(tmp_path / "run")
    assert stays is not None
    ended = stays.filter(~pl.col("begins"), pl.col("arrival") < 140.0)
    assert ended.height >= 3
    assert stays.filter(pl.col("begins")).height >= 3
    others = set(stays.filter(~pl.col("begins"))["actor"])
    assert set(ended["actor"]) <= set(opened) <= others
    for name, arrival in ended.select("actor", "arrival").iter_rows():
        assert opened[name][0] == pytest.approx(arrival, abs=0.5)
        assert opened[name][-1] - opened[name][0] == pytest.approx(GETTING_OUT, abs=0.6)
    assert max(speeds) == 0.0
