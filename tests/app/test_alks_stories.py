"""The scenarios of UN R157 do what their titles say: from the trajectories of their runs alone.

Their road is straight where they play and leads along x; the ego keeps to the lane with its centre
at y = -8 m, and lanes are 3.5 m wide. In the files it drives 60 km/h, and so it does here until
SUMO brakes for what is in front of it.
"""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pytest

from odscen.app.exchange.imports import import_file
from odscen.app.running.runs import run
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings

if TYPE_CHECKING:
    from odscen.base.arrays import FloatArray

FOLDER = Path(__file__).parents[3] / "shared" / "osc" / "alks" / "concrete_scenarios"
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not FOLDER.is_dir(), reason="the ALKS scenarios are not here"),
]
LANE, WIDTH, SPEED = -8.0, 3.5, 60 / 3.6


class Motion(NamedTuple):
    """Where the centre of a body is over time: s, m and m/s, on a straight road along x."""

    time: FloatArray
    x: FloatArray
    y: FloatArray
    speed: FloatArray

    def at(self, time: float) -> tuple[float, float, float]:
        """X, y and speed at an instant."""
        x, y, speed = (float(np.interp(time, self.time, one)) for one in self[1:])
        return x, y, speed

    def in_lane(self, half: float = 0.9) -> FloatArray:
        """Times at which a body so wide is on the lane of the ego."""
        return self.time[np.abs(self.y - LANE) < WIDTH / 2 + half]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("alks")


def story(folder: Path, name: str, *, until: float = 45.0) -> dict[str, Motion]:
    """Motions of a scenario that has been run, by the names in its file."""
    return _run(folder, f"alks_scenario_{name}_template", until)


@cache
def _run(folder: Path, name: str, until: float) -> dict[str, Motion]:
    workspace = Workspace.open(folder / "workspace")
    found = import_file(workspace, FOLDER / f"{name}.xosc")
    assert [one for one in found.problems if one.severity == "error"] == []
    until = min(until, found.scenario.simulation.duration)
    settings = RunSettings(until=until)
    done = run(workspace, found.scenario, settings=settings, name=name, out=folder)
    assert done.status == "completed"
    columns = ("time", "x", "y", "speed")
    return {
        str(key): Motion(*(rows[one].to_numpy() for one in columns))
        for (key,), rows in done.trajectories().group_by("id", maintain_order=True)
    }


def test_the_ego_drives_freely_at_its_speed(folder: Path) -> None:
    (ego,) = story(folder, "4_1_1_free_driving").values()
    assert ego.speed == pytest.approx(np.full(len(ego.speed), SPEED), abs=0.01)
    assert ego.time[-1] > 40


def gaps_between(lead: Motion, ego: Motion) -> FloatArray:
    """Metres between their centres, at the times at which both are there."""
    both, other = np.isin(lead.time, ego.time), np.isin(ego.time, lead.time)
    gaps: FloatArray = lead.x[both] - ego.x[other]
    return gaps


def test_the_lead_vehicle_swerves_in_its_lane_to_both_sides_and_comes_back(folder: Path) -> None:
    motions = story(folder, "4_1_2_swerving_lead_vehicle")
    lead, ego = motions["LeadVehicle"], motions["Ego"]
    aside = lead.y - LANE
    assert (aside.max(), aside.min()) == (
        pytest.approx(1.5, abs=0.02),
        pytest.approx(-1.5, abs=0.02),
    )
    assert lead.time[aside.argmax()] < lead.time[aside.argmin()]
    assert abs(aside[-1]) < 0.02
    assert (gaps_between(lead, ego) > 0).all()


def test_the_side_vehicle_stays_abreast_in_the_next_lane(folder: Path) -> None:
    motions = story(folder, "4_1_3_side_vehicle", until=45)
    side, ego = motions["SideVehicle"], motions["Ego"]
    straight = side.time < 15
    assert np.abs(side.x - ego.x)[straight].max() < 7
    assert (side.y - ego.y)[straight].min() > WIDTH / 2
    assert (side.y - ego.y)[straight].max() < 1.5 * WIDTH


def test_the_side_vehicle_drives_a_bend_at_its_speed_on_the_ground(folder: Path) -> None:
    side = story(folder, "4_1_3_side_vehicle", until=45)["SideVehicle"]
    assert np.ptp(side.y) > 30.0
    covered = np.hypot(np.diff(side.x), np.diff(side.y)).cumsum()
    assert np.abs(covered - SPEED * (side.time[1:] - side.time[0])).max() < 0.3
    assert side.speed == pytest.approx(np.full(len(side.speed), SPEED), abs=0.15)
    assert side.speed.mean() == pytest.approx(SPEED, abs=0.01)


@pytest.mark.parametrize(
    ("name", "aside"),
    [
        ("4_2_1_fully_blocking_target", 0.0),
        ("4_2_2_partially_blocking_target", -1.5),
        ("4_2_4_multiple_blocking_targets", 0.0),
    ],
)
def test_a_target_blocks_the_lane_and_the_ego_stops_before_it(
    folder: Path, name: str, aside: float
) -> None:
    motions = story(folder, name)
    target, ego = motions["TargetBlocking"], motions["Ego"]
    assert np.ptp(target.x) == np.ptp(target.y) == 0
    assert target.x[0] == pytest.approx(500, abs=1.5)  # half a space between nodes, and its centre
    assert target.y[0] - LANE == pytest.approx(aside, abs=0.05)
    assert ego.speed[ego.time < 20] == pytest.approx(SPEED, abs=0.01)
    assert ego.speed[-1] < 0.1
    assert 0 < target.x[0] - ego.x[-1] - 2.5 < 6
    if "multiple" in name:
        behind = motions["TargetBlocking2"]
        assert behind.x[0] > target.x[0] + 5
        assert behind.y[0] == pytest.approx(LANE, abs=0.05)


def test_the_pedestrian_crosses_the_lane_of_the_ego_before_it(folder: Path) -> None:
    motions = story(folder, "4_2_3_crossing_pedestrian")
    walker, ego = motions["TargetBlocking"], motions["Ego"]
    first = float(walker.time[np.argmax(np.abs(walker.y - walker.y[0]) > 0.05)])
    assert walker.y[0] < LANE - WIDTH / 2
    assert walker.y[-1] > LANE + WIDTH / 2
    # It sets off when the ego, at 60 km/h, is as far away as it needs for 5 m at 5 km/h.
    x, _, speed = ego.at(first)
    assert speed == pytest.approx(SPEED, abs=0.01)
    assert (walker.x[0] - x - 3.6) / speed == pytest.approx(3.6, abs=0.2)
    on_it = walker.in_lane(half=0.0)
    assert 0 < on_it[0] - first < 3.6
    assert ego.at(float(on_it[0]))[0] < walker.x[0]
    assert ego.speed.min() < SPEED - 5  # it brakes


def test_the_lead_vehicle_is_faster_then_slower_and_the_ego_follows(folder: Path) -> None:
    motions = story(folder, "4_3_1_follow_lead_vehicle_comfortable", until=60)
    lead, ego = motions["LeadVehicle"], motions["Ego"]
    assert lead.speed.max() == pytest.approx(SPEED + 5, abs=0.05)
    assert lead.speed[-1] == pytest.approx(SPEED - 5, abs=0.05)
    assert np.abs(np.diff(lead.speed) / np.diff(lead.time)).max() == pytest.approx(1.0, abs=0.1)
    # "Scenario lasts until 20 seconds after the speed actions are complete."
    changes = lead.time[1:][np.abs(np.diff(lead.speed)) > 0.01]
    assert lead.time[-1] - changes[-1] == pytest.approx(20.0, abs=0.3)
    assert ego.speed[-1] == pytest.approx(lead.speed[-1], abs=0.6)
    assert gaps_between(lead, ego).min() > 5


def test_the_lead_vehicle_brakes_to_a_standstill_and_the_ego_stops_behind_it(folder: Path) -> None:
    motions = story(folder, "4_3_2_follow_lead_vehicle_emergency_brake")
    lead, ego = motions["LeadVehicle"], motions["Ego"]
    moves, stops = lead.time[lead.speed > SPEED - 0.1][-1], lead.time[lead.speed < 0.1][0]
    assert stops - moves == pytest.approx(SPEED / 9.81, abs=0.2)
    way = lead.at(float(stops))[0] - lead.at(float(moves))[0]
    assert way == pytest.approx(SPEED**2 / 2 / 9.81, abs=1.7)  # a step of 0.1 s
    assert ego.speed[-1] < 0.1
    assert lead.x[-1] - ego.x[-1] - 5 > 0


@pytest.mark.parametrize(
    ("name", "seconds", "gap"),
    [
        ("4_4_1_cut_in_no_collision", math.pi / 2.0 * 3.5 / 2.0, 30),
        ("4_4_2_cut_in_unavoidable_collision", math.pi / 2.0 * 3.5 / 3.0, 10),
    ],
)
def test_a_slower_vehicle_cuts_into_the_lane_of_the_ego_ahead_of_it(
    folder: Path, name: str, seconds: float, gap: float
) -> None:
    # The rate of the file is its largest lateral speed, pi/2 times the mean of a half-cosine.
    motions = story(folder, name)
    other, ego = motions["CutInVehicle"], motions["Ego"]
    assert other.y[0] == pytest.approx(LANE - WIDTH, abs=0.05)
    assert other.y[-1] == pytest.approx(LANE, abs=0.05)
    moving = other.time[(np.abs(other.y - other.y[0]) > 0.02) & (np.abs(other.y - LANE) > 0.02)]
    assert moving[-1] - moving[0] == pytest.approx(seconds, abs=0.3)
    begins = float(moving[0])
    assert other.at(begins)[0] - ego.at(begins)[0] - 5 == pytest.approx(gap, abs=1.5)
    assert other.at(begins)[2] == pytest.approx(40 / 3.6, abs=0.3)
    enters = float(other.in_lane()[0])
    assert other.at(enters)[0] > ego.at(enters)[0] + 2.5
    assert ego.at(enters)[2] > other.at(enters)[2] + 3


@pytest.mark.parametrize(
    "name", ["4_5_1_cut_out_fully_blocking", "4_5_2_cut_out_multiple_blocking_targets"]
)
def test_the_lead_vehicle_cuts_out_before_the_target_and_the_ego_stops(
    folder: Path, name: str
) -> None:
    motions = story(folder, name)
    lead, ego, target = (motions[one] for one in ("LeadVehicle", "Ego", "TargetBlocking"))
    assert lead.y[0] == pytest.approx(LANE, abs=0.05)
    assert lead.y[-1] == pytest.approx(LANE + WIDTH, abs=0.05)
    left = float(lead.in_lane()[-1])
    assert lead.at(left)[0] < target.x[0] < lead.x[-1]
    assert lead.speed.min() > SPEED - 0.5
    assert ego.speed[-1] < 0.1
    assert 0 < target.x[0] - ego.x[-1] - 2.5 < 6


def test_a_target_is_in_range_ahead_of_the_ego(folder: Path) -> None:
    motions = story(folder, "4_6_1_forward_detection_range")
    assert motions["TargetBlocking"].x[0] - motions["Ego"].x[0] > 400
    assert motions["TargetBlocking"].y[0] == pytest.approx(LANE - 5.25, abs=0.05)


def test_a_motorcycle_beside_all_lanes_comes_into_the_lane_of_the_ego(folder: Path) -> None:
    motions = story(folder, "4_6_2_lateral_detection_range", until=28)
    side, ego = motions["SideVehicle"], motions["Ego"]
    settled = side.time > 0.25
    assert np.abs(side.x - ego.x)[settled].max() < 2.5  # abreast, by up to a space between nodes
    first, last = side.at(9.9)[1], side.at(28.0)[1]
    assert first - LANE == pytest.approx(-7.0, abs=0.05)
    assert last - LANE == pytest.approx(-1.75, abs=0.05)
    moving = side.time[settled & (np.abs(np.gradient(side.y, side.time)) > 0.01)]
    # 5.25 m on a half-cosine with 0.1 m/s^2 at most: pi sqrt(5.25 / 0.2) s
    assert moving[0] == pytest.approx(10.0, abs=0.4)
    assert moving[-1] - moving[0] == pytest.approx(np.pi * np.sqrt(5.25 / 0.2), abs=0.6)
    assert ego.speed == pytest.approx(np.full(len(ego.speed), SPEED), abs=0.01)
