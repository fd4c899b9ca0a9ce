"""In SUMO: who drives beside the centre of its lane does so in junctions, by as many metres."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from odscen.sumo.worker.simulation.session import open_session
from tests.convert.maps import converted, named

if TYPE_CHECKING:
    from pathlib import Path

WAYS = {"left": "1.0.f 1.1.f 4.1.b 4.0.b", "straight": "3.0.f 3.1.f 1.1.b 1.0.b"}


@pytest.fixture(scope="module")
def net(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("lateral") / "net.xml"
    file.write_bytes(converted(named("signal_crossing")).network.net_xml)
    return file


def farthest_from(
    net: Path, folder: Path, beside: float, *, way: str, step: str, kept: bool = True
) -> float:
    """Most metres by which a car leaves its place beside the centres of lanes, on its way."""
    routes = folder / "routes.xml"
    routes.write_text(
        '<routes><vType id="car" width="1.8" length="5" sigma="0"/>'
        f'<vehicle id="a" type="car" depart="0" departPosLat="{beside}" departLane="best"'
        f' departSpeed="max"><route edges="{WAYS[way]}"/></vehicle></routes>'
    )
    away = [0.0]
    with open_session(
        ["-n", str(net), "-r", str(routes), "--step-length", step, "--no-step-log"]
    ) as session:
        while session.time < 120.0 and session.expected():
            if kept:
                session.lateral_places.before_step()
            session.step()
            away += [
                abs(session._sumo.vehicle.getLateralLanePosition(name) - beside)
                for name in session.vehicles()
            ]
    return max(away)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("step", ["0.1", "0.5"])
def test_a_car_stays_where_it_is_beside_the_centre(
    way: str, step: str, net: Path, tmp_path: Path
) -> None:
    assert farthest_from(net, tmp_path, 0.3, way=way, step=step) < 0.2
    assert farthest_from(net, tmp_path, -0.3, way=way, step=step) < 0.2


def test_sumo_alone_moves_it_aside_at_once(net: Path, tmp_path: Path) -> None:
    assert farthest_from(net, tmp_path, 0.3, way="left", step="0.1", kept=False) > 0.25
