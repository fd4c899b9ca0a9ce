"""In SUMO: who changes lanes behind a turn has left the turn before."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import pytest

from odscen.sumo.worker.simulation.session import open_session
from tests.convert.maps import converted, named

if TYPE_CHECKING:
    from pathlib import Path

TURNS = ("19.0.b 13.0.b", "20.2.f 28.0.f", "13.0.b 35.0.b")
"""Right angles of real roads, each into a road of two lanes."""
OWN_LANES = 1621
"""SUMO's own mode of changing lanes."""


@pytest.fixture(scope="module")
def net(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("exits") / "net.xml"
    file.write_bytes(converted(named("carla-2019/Town05")).network.net_xml)
    return file


class Driven(NamedTuple):
    """Most degrees of heading per metre driven, modes behind the turn, lane at the end."""

    leap: float
    modes: set[int]
    lane: str


def drive(net: Path, folder: Path, route: str, *, step: str, waits: bool) -> Driven:
    """Drive a car through a turn that has to be on the left lane behind it."""
    routes = folder / "routes.xml"
    routes.write_text(
        '<routes><vType id="car" length="5" sigma="0"/><vehicle id="a" type="car" depart="0"'
        f' departLane="best" departSpeed="0" arrivalLane="1"><route edges="{route}"/></vehicle>'
        "</routes>"
    )
    leap, before, modes, lane = 0.0, None, set(), ""
    with open_session(
        ["-n", str(net), "-r", str(routes), "--step-length", step, "--no-step-log",
         "--lanechange.duration", "3"]
    ) as session:  # fmt: skip
        vehicle = session._sumo.vehicle
        while session.time < 120.0 and session.expected():
            if waits:
                session.turn_exits.before_step()
            session.step()
            for name in session.vehicles():
                heading, lane = math.radians(vehicle.getAngle(name)), vehicle.getLaneID(name)
                if before is not None:
                    turned = abs(math.remainder(heading - before, math.tau))
                    leap = max(leap, turned / max(0.5, vehicle.getSpeed(name) * float(step)))
                before = heading
                if vehicle.getLanePosition(name) > 5.5 and not lane.startswith(":"):
                    modes.add(vehicle.getLaneChangeMode(name))
        session.turn_exits.forget()
    return Driven(math.degrees(leap), modes, lane)


@pytest.mark.parametrize("step", ["0.1", "0.5"])
@pytest.mark.parametrize("route", TURNS)
def test_the_heading_does_not_leap(route: str, step: str, net: Path, tmp_path: Path) -> None:
    kept = drive(net, tmp_path, route, step=step, waits=True)
    alone = drive(net, tmp_path, route, step=step, waits=False)
    assert kept.lane == alone.lane == f"{route.split()[1]}_1"
    assert kept.leap < 20.0
    assert alone.leap > kept.leap + 5.0


def test_it_may_change_lanes_as_ever_before_and_behind(net: Path, tmp_path: Path) -> None:
    driven = drive(net, tmp_path, TURNS[0], step="0.1", waits=True)
    # In the last step before the junction it waits already, and from a body's length on no more.
    assert OWN_LANES in driven.modes
    assert driven.modes <= {OWN_LANES, 256}
