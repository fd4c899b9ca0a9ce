"""A small signalised grid made by netgenerate, and runs on it written by hand."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
import sumo

from odscen.results.records import Plan, PlannedActor
from odscen.sumo.config import RunSettings, sumo_config
from odscen.sumo.runner import PreparedRun

BIN = Path(sumo.SUMO_HOME) / "bin"

LENGTH = 4.5
"""Of every car in these tests, metres."""

Prepare = Callable[..., PreparedRun]


@pytest.fixture(scope="session")
def grid(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Net file: 3 x 3 crossings, streets of 120 m, two lanes a side, sidewalks and crossings."""
    net = tmp_path_factory.mktemp("grid") / "grid.net.xml"
    subprocess.run(
        [
            BIN / "netgenerate", "--grid", "--grid.number", "3", "--grid.length", "120",
            "--default.lanenumber", "2", "--no-turnarounds", "--tls.guess",
            "--sidewalks.guess", "--crossings.guess", "--walkingareas", "-o", net,
        ],
        check=True,
        capture_output=True,
    )  # fmt: skip
    return net


@pytest.fixture
def prepare(grid: Path) -> Prepare:
    """Return a function that prepares a run: some cars down the first row, and one walker."""

    def prepared(
        *, cars: int = 4, walker: bool = True, until: float = 200.0, routes: str | None = None
    ) -> PreparedRun:
        actors = [car(i) for i in range(cars)] + ([WALKER] if walker else [])
        text = routes or "\n".join(
            ["<routes>", TYPES, *(_car_xml(i) for i in range(cars)), *[WALK] * walker, "</routes>"]
        )
        plan = Plan(
            scenario="grid", seed=7, until=until, step_length=0.5, net_offset=(0.0, 0.0),
            actors=tuple(actors),
        )  # fmt: skip
        settings = RunSettings(until=until, step_length=0.5, seed=7)
        return PreparedRun(
            plan=plan,
            sumo_files={"routes.rou.xml": text, "scenario.sumocfg": sumo_config(settings)},
            net=grid,
            scenario_json="{}",
        )

    return prepared


TYPES = """\
<vType id="car" length="4.5" width="1.8" speedFactor="0.95" speedDev="0"/>
<vType id="walker" vClass="pedestrian" length="0.4" width="0.5" speedFactor="1" speedDev="0"
 maxSpeed="1.3"/>"""
WALK = """\
<person id="walker" type="walker" depart="0" departPos="30"><walk edges="A0B0 B0C0" arrivalPos="20"
 departPosLat="0.5"/></person>"""
WALKER = PlannedActor(
    id="walker", category="pedestrian", spawn="ped.1.0.-1.0", goal=None, depart=0.0, length=0.4,
    width=0.5, x=38.2, y=-6.9, z=0.0, hdg=0.0,
)  # fmt: skip


def car(index: int) -> PlannedActor:
    """Plan for car ``index``: 10 m apart on the right lane, 0.3 m left of its middle."""
    return PlannedActor(
        id=f"car{index}", category="car", spawn=f"1.0.-1.{index}", goal="1.0.-1.99", depart=0.0,
        length=LENGTH, width=1.8, x=8.4 + 40.0 - 10.0 * index - LENGTH / 2, y=-4.8 + 0.3, z=0.0,
        hdg=0.0, route_length=290.0, free_flow_time=20.0, ego=index == 0,
    )  # fmt: skip


def _car_xml(index: int) -> str:
    return (
        f'<vehicle id="car{index}" type="car" depart="0" departLane="1" departSpeed="0"'
        f' departPos="{40 - 10 * index}" departPosLat="0.3"><route edges="A0B0 B0C0"/></vehicle>'
    )
