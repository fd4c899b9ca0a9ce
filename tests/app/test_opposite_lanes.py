"""Vehicles that start in an opposite lane stay there until the story brings them back."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from odscen.app.exchange.imports import import_file
from odscen.app.running.runs import run
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from tests.app.test_scenario_imports import FILE, ROAD, SPEED

if TYPE_CHECKING:
    import polars as pl

TWO_WAY = ROAD.replace(
    "</center>",
    '</center><left><lane id="1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/>'
    "</lane></left>",
)
"""A lane against x with its middle at y = 1.75, and two along it, at -1.75 and -5.25."""
STARTS = """<LanePosition roadId="0" laneId="1" s="20"><Orientation type="relative"
h="3.14159265"/></LanePosition>"""
AT_20 = FILE[FILE.index("<PrivateAction><LongitudinalAction>") : FILE.index("</Private>")]
AT_20 = AT_20.replace("${$kph / 3.6}", "20")
HEADWAY = re.compile(r"<TimeHeadwayCondition.*?/>", re.DOTALL)
AHEAD = """<RelativeDistanceCondition entityRef="Other" relativeDistanceType="longitudinal"
coordinateSystem="entity" freespace="false" value="20" rule="greaterThan"/>"""
ESMINI = Path(__file__).parents[3] / "shared" / "osc" / "esmini" / "xosc"


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    return Workspace.open(tmp_path_factory.mktemp("opposite"))


def overtaking(target: str, condition: str) -> str:
    """The ego at 10 m/s at s = 48.6 m, another in the opposite lane behind it at 20 m/s."""
    text = FILE.replace("ACTION", SPEED).replace('delay="0.5"', 'delay="0"')
    text = re.sub(r"<RelativeLanePosition .*?/>", STARTS, text)
    text = text.replace("</Private></Actions>", f"{AT_20}</Private></Actions>")
    text = HEADWAY.sub(condition, text)
    return text.replace('<RelativeTargetLane entityRef="Other" value="1"/>', target)


def play(workspace: Workspace, file: Path, out: Path) -> tuple[Any, dict[str, pl.DataFrame]]:
    found = import_file(workspace, file)
    assert [one for one in found.problems if one.severity == "error"] == []
    settings = RunSettings(until=12.0)
    done = run(workspace, found.scenario, settings=settings, name="run", out=out)
    assert done.status == "completed"
    assert "rule_failed" not in done.events()["kind"].to_list()
    rows = {str(key): one for (key,), one in done.trajectories().group_by("id")}
    return done, {key: one.sort("time") for key, one in rows.items()}


def instant(done: Any, rule: str, what: str) -> float:
    events = done.events()
    [found] = events.filter((events["rule"] == rule) & (events["kind"] == f"rule_{what}"))["time"]
    return float(found)


@pytest.mark.parametrize(
    ("target", "condition"),
    [
        (
            '<RelativeTargetLane entityRef="Ego" value="0"/>',
            '<TimeHeadwayCondition entityRef="Other" value="1.5" freespace="true" '
            'rule="greaterThan"/>',
        ),
        ('<AbsoluteTargetLane value="-1"/>', AHEAD),
    ],
)
def test_who_overtakes_in_the_opposite_lane_stays_there_until_it_cuts_in(
    workspace: Workspace, tmp_path: Path, target: str, condition: str
) -> None:
    (tmp_path / "road.xodr").write_text(TWO_WAY)
    file = tmp_path / "scene.xosc"
    file.write_text(overtaking(target, condition))
    done, rows = play(workspace, file, tmp_path)
    begin, end = instant(done, "cut-in", "started"), instant(done, "cut-in", "ended")
    other = rows["Other"].filter(rows["Other"]["time"] > 0.15)
    time, x, y = (other[name].to_numpy() for name in ("time", "x", "y"))
    # 28.6 m behind at first, at 20 m/s until the cut-in is over, when it slows down to 5 m/s.
    assert 2.0 < begin < end - 2.4
    assert y[time < begin] == pytest.approx(1.75, abs=0.02)
    assert x[time < end] == pytest.approx(x[0] + 20.0 * (time[time < end] - time[0]), abs=0.1)
    assert y[time > end] == pytest.approx(-1.75, abs=0.02)
    assert np.all(np.diff(x) > 0.0)
    assert np.cos(other["hdg"].to_numpy()).min() > 0.9
    assert other["speed"][-1] == pytest.approx(20.0 - 2.0 * (time[-1] - end), abs=0.3)


@pytest.mark.slow
@pytest.mark.parametrize(
    "target",
    ['<AbsoluteTargetLane value="1"/>', '<RelativeTargetLane entityRef="Other" value="1"/>'],
)
def test_a_change_into_the_opposite_lane_is_one_beside_its_own(
    workspace: Workspace, tmp_path: Path, target: str
) -> None:
    (tmp_path / "road.xodr").write_text(TWO_WAY)
    file = tmp_path / "scene.xosc"
    own = '<LanePosition roadId="0" laneId="-1" s="20"/>'
    close = AHEAD.replace("greater", "less").replace('"20"', '"25"')
    file.write_text(overtaking(target, close).replace(STARTS, own))
    done, rows = play(workspace, file, tmp_path)
    begin, end = instant(done, "cut-in", "started"), instant(done, "cut-in", "ended")
    other = rows["Other"]
    time, x, y = (other[name].to_numpy() for name in ("time", "x", "y"))
    assert y[time < begin] == pytest.approx(-1.75, abs=0.02)
    assert y[time > end] == pytest.approx(1.75, abs=0.02)
    assert end == pytest.approx(begin + 2.5)
    assert np.all(np.diff(x) > 0.0)


@pytest.mark.slow
@pytest.mark.skipif(not ESMINI.is_dir(), reason="../shared/osc is not here")
@pytest.mark.parametrize(
    ("name", "who"), [("cut-in_simple", "OverTaker"), ("alks_cut-in", "TargetCutIn")]
)
def test_the_cut_ins_of_esmini_from_the_opposite_lane_happen(
    workspace: Workspace, tmp_path: Path, name: str, who: str
) -> None:
    done, rows = play(workspace, ESMINI / f"{name}.xosc", tmp_path)
    begin, end = instant(done, "CutInEvent", "started"), instant(done, "CutInEvent", "ended")
    other = rows[who].filter(rows[who]["time"] > 0.15)
    time, x, y = (other[one].to_numpy() for one in ("time", "x", "y"))
    lane = float(rows["Ego"]["y"][0])
    assert y[time < begin] == pytest.approx(lane + 3.1, abs=0.05)
    assert y[time > end] == pytest.approx(lane, abs=0.05)
    assert np.all(np.diff(x) > 0.0)


@pytest.mark.slow
def test_one_that_comes_against_a_lane_from_a_place_of_parameters_stays_in_it(
    workspace: Workspace, tmp_path: Path
) -> None:
    text = FILE.replace("ACTION", SPEED)
    start = '<LanePosition roadId="0" laneId="-1" s="${$kph + 150}"><Orientation type="relative"'
    start += ' h="3.14159265"/></LanePosition>'
    text = re.sub(r"<RelativeLanePosition .*?/>", start, text)
    text = text.replace("</Private></Actions>", f"{AT_20}</Private></Actions>")
    (tmp_path / "road.xodr").write_text(TWO_WAY)
    (tmp_path / "against.xosc").write_text(text)
    found = import_file(workspace, tmp_path / "against.xosc")
    settings = RunSettings(until=2.0)
    done = run(workspace, found.scenario, settings=settings, name="run", out=tmp_path)
    rows = done.trajectories().sort("time")
    other = rows.filter(rows["id"] == "Other", rows["time"].is_between(0.3, 1.5))
    assert other["y"].to_numpy() == pytest.approx(-1.75, abs=0.01)
    assert np.cos(other["hdg"].to_numpy()) == pytest.approx(-1.0, abs=1e-6)
    passed = np.diff(other["time"].to_numpy())
    assert np.diff(other["x"].to_numpy()) / passed == pytest.approx(-20.0, abs=0.05)


@pytest.mark.slow
def test_whose_trajectory_ends_in_the_opposite_lane_goes_on_there_and_does_not_turn_round(
    workspace: Workspace, tmp_path: Path
) -> None:
    rows = "".join(
        f'<Vertex time="0"><Position><WorldPosition x="{x}" y="{y}" h="0"/></Position></Vertex>'
        for x, y in ((80, -1.75), (110, 1.75), (140, 1.75))
    )
    follow = (
        "<RoutingAction><FollowTrajectoryAction><TrajectoryRef><Trajectory name='t' closed='false'>"
        f"<Shape><Polyline>{rows}</Polyline></Shape></Trajectory></TrajectoryRef><TimeReference>"
        "<None/></TimeReference><TrajectoryFollowingMode followingMode='position'/>"
        "</FollowTrajectoryAction></RoutingAction>"
    )
    own = '<LanePosition roadId="0" laneId="-1" s="60"/>'
    text = overtaking("", AHEAD).replace(STARTS, own).replace('s="48.6"', 's="480"')
    text = re.sub(r"(?s)<LateralAction>.*?</LateralAction>", follow, text, count=1)
    text = HEADWAY.sub("", text).replace(AHEAD, '<TraveledDistanceCondition value="1"/>')
    text = text.replace(SPEED, SPEED.replace('value="5"', 'value="20"'))
    (tmp_path / "road.xodr").write_text(TWO_WAY)
    (tmp_path / "scene.xosc").write_text(text)
    _, rows_of = play(workspace, tmp_path / "scene.xosc", tmp_path)
    other = rows_of["Other"]
    late = other.filter(other["time"].is_between(5.0, 12.0))
    assert late["y"].to_numpy() == pytest.approx(1.75, abs=0.05)
    assert np.diff(late["x"].to_numpy()) == pytest.approx(20.0 * np.diff(late["time"]), abs=0.05)
    assert np.cos(late["hdg"].to_numpy()).min() > 0.99
