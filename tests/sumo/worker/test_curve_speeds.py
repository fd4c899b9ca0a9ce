"""In SUMO: who wants more than the limit goes through curves as others do."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pytest

from odscen.sumo.worker.simulation.curve_speeds import FASTEST
from odscen.sumo.worker.simulation.session import open_session
from tests.convert.maps import converted, named

if TYPE_CHECKING:
    from pathlib import Path

LEFT = "1.0.f 1.1.f 4.1.b 4.0.b"
STRAIGHT = "3.0.f 3.1.f 1.1.b 1.0.b"


@pytest.fixture(scope="module")
def net(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("curves") / "net.xml"
    file.write_bytes(converted(named("signal_crossing")).network.net_xml)
    return file


class Driven(NamedTuple):
    """Most m/s2 to the side, largest share of a limit before the junction, factor at the end."""

    sideways: float
    share: float
    factor: float


def drive(
    net: Path,
    folder: Path,
    *,
    factor: float,
    way: str = LEFT,
    step: str = "0.5",
    save_at: float = -1.0,
    looks: bool = True,
) -> Driven:
    """Drive a car through the junction, with all lights off."""
    routes = folder / "routes.xml"
    routes.write_text(
        '<routes><vType id="car" length="5" sigma="0" decel="4"/><vehicle id="a" type="car"'
        f' depart="0" departLane="best" departSpeed="0" speedFactor="{factor}">'
        f'<route edges="{way}"/></vehicle></routes>'
    )
    share, last, headings, speeds = 0.0, 0.0, [], []
    with open_session(
        ["-n", str(net), "-r", str(routes), "--step-length", step, "--no-step-log"]
    ) as session:
        vehicle, limit_of = session._sumo.vehicle, session._sumo.lane.getMaxSpeed
        for light in session._sumo.trafficlight.getIDList():
            session._sumo.trafficlight.setProgram(light, "off")
        while session.time < 120.0 and session.expected():
            if looks:
                session.curve_speeds.before_step()
            if session.time == save_at:
                session.curve_speeds.forget()
                assert vehicle.getSpeedFactor("a") == factor
            session.step()
            for name in session.vehicles():
                lane, last = vehicle.getLaneID(name), vehicle.getSpeedFactor(name)
                headings.append(math.radians(vehicle.getAngle(name)))
                speeds.append(vehicle.getSpeed(name))
                if not lane.startswith(":"):
                    share = max(share, speeds[-1] / limit_of(lane))
    apart = round(1.0 / float(step))
    turned = np.abs(np.diff(np.unwrap(headings)[::apart]))
    return Driven(float(np.max(turned * np.array(speeds)[::apart][1:])), share, last)


@pytest.mark.parametrize("step", ["0.1", "0.5", "1"])
def test_who_wants_more_than_the_limit_turns_as_fast_drivers_do(
    step: str, net: Path, tmp_path: Path
) -> None:
    driven = drive(net, tmp_path, factor=1.8, step=step)
    assert driven.sideways < 4.0
    assert driven.share > 1.5
    assert driven.factor == 1.8  # its own again, once the curve is behind it
    assert drive(net, tmp_path, factor=1.8, step=step, looks=False).sideways > 6.0


def test_straight_on_nothing_changes(net: Path, tmp_path: Path) -> None:
    looked = drive(net, tmp_path, factor=1.8, way=STRAIGHT)
    assert looked == drive(net, tmp_path, factor=1.8, way=STRAIGHT, looks=False)
    assert looked.share > 1.5


def test_a_fast_driver_is_left_alone(net: Path, tmp_path: Path) -> None:
    looked = drive(net, tmp_path, factor=FASTEST)
    assert looked == drive(net, tmp_path, factor=FASTEST, looks=False)


@pytest.mark.parametrize("second", [2.0, 6.0, 8.0, 10.0])
def test_a_saved_state_has_its_own_factor(second: float, net: Path, tmp_path: Path) -> None:
    driven = drive(net, tmp_path, factor=1.8, save_at=second)
    assert driven.sideways < 5.0
    assert driven.factor == 1.8
