"""A small signalised grid made by netgenerate, and runs on it written by hand."""

from __future__ import annotations

import random
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
import sumo

from odscen.records.run_plan import Plan, PlannedActor
from odscen.sumo.realize.measure_files import measures_xml
from odscen.sumo.realize.sumocfg import SumocfgSettings, sumo_config
from odscen.sumo.runner import long_runs, worker_process
from odscen.sumo.runner.run_folder import SumoPreparedRun

BIN = Path(sumo.SUMO_HOME) / "bin"

LENGTH = 4.5
"""Of every car in these tests, metres."""
SLICE, UNTIL = 60.0, 200.0
ROWS = ("A0B0 B0C0 C0C1", "A1B1 B1C1", "C2B2 B2A2 A2A1", "C0C1 C1C2", "B2B1 B1B0 B0A0")
WALKS = ("A0B0 B0C0", "C1B1 B1A1", "B2B1 B1B0")

Prepare = Callable[..., SumoPreparedRun]


def start_killed_workers(patch: pytest.MonkeyPatch) -> None:
    """Have processes of long runs started as ``killed_worker``, though they might be forked."""
    patch.setattr(worker_process, "WORKER", "tests.sumo.killed_worker")
    patch.setattr(long_runs, "is_ready", lambda: False)


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
    ) -> SumoPreparedRun:
        actors = [car(i) for i in range(cars)] + ([WALKER] if walker else [])
        text = routes or "\n".join(
            ["<routes>", TYPES, *(_car_xml(i) for i in range(cars)), *[WALK] * walker, "</routes>"]
        )
        plan = Plan(
            scenario="grid", seed=7, until=until, step_length=0.5, net_offset=(0.0, 0.0),
            actors=tuple(actors),
        )  # fmt: skip
        settings = SumocfgSettings(until=until, step_length=0.5, seed=7, measures=True)
        return SumoPreparedRun(
            plan=plan,
            sumo_files={
                "measures.add.xml": measures_xml(10.0, emissions=True),
                "routes.rou.xml": text,
                "scenario.sumocfg": sumo_config(settings),
            },
            net=grid,
            scenario_json="{}",
        )

    return prepared


@pytest.fixture(scope="session")
def long(grid: Path) -> SumoPreparedRun:
    """Cars whose drivers dawdle at random, and walkers, over 200 s in slices of 60 s."""
    chance = random.Random(3)
    departs = sorted(round(chance.uniform(0.0, 150.0), 2) for _ in range(90))
    lines, actors = ["<routes>", TYPES], []
    for index, depart in enumerate(departs):
        walker = index % 5 == 0
        name = f"{'walker' if walker else 'car'}{index}"
        actors.append(
            PlannedActor(
                id=name, category="pedestrian" if walker else "car", spawn="1.0.-1.0", goal=None,
                depart=depart, length=0.4 if walker else 4.5, width=0.5, x=0.0, y=0.0, z=0.0,
                hdg=0.0, free_flow_time=40.0,
            )
        )  # fmt: skip
        if walker:
            lines.append(
                f'<person id="{name}" type="walker" depart="{depart}" departPos="5">'
                f'<walk edges="{WALKS[index % 3]}"/></person>'
            )
        else:
            lines.append(
                f'<vehicle id="{name}" type="car" depart="{depart}" departLane="1">'
                f'<route edges="{ROWS[index % 5]}"/></vehicle>'
            )
    settings = SumocfgSettings(until=UNTIL, step_length=0.5, seed=7, measures=True)
    files = {
        "measures.add.xml": measures_xml(30.0, emissions=True),
        "routes.rou.xml": "\n".join([*lines, "</routes>", ""]),
        "scenario.sumocfg": sumo_config(settings),
    }
    plan = Plan("grid", 7, UNTIL, 0.5, (0.0, 0.0), tuple(actors), slice_length=SLICE)
    return SumoPreparedRun(plan=plan, sumo_files=files, net=grid, scenario_json="{}")


TYPES = """\
<vType id="car" length="4.5" width="1.8" speedFactor="0.95" speedDev="0"/>
<vType id="walker" vClass="pedestrian" length="0.4" width="0.5" speedFactor="1" speedDev="0"
 maxSpeed="1.3" desiredMaxSpeed="1.3"/>"""
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
