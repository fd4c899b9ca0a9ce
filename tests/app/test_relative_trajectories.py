"""Trajectories relative to an entity that moves: they begin where it is by then."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from odscen.app.exchange.exports import export
from odscen.app.exchange.imports import import_file
from odscen.app.running.runs import run
from odscen.changes.acting_differences import acting_differences
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from tests.app.test_openscenario_features import event, private, read, reasons, rule, scene

if TYPE_CHECKING:
    from pathlib import Path

AT_3_S = (
    '<ByValueCondition><SimulationTimeCondition value="3" rule="greaterThan"/></ByValueCondition>'
)


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    return Workspace.open(tmp_path_factory.mktemp("relative"))


def follow(shape: str) -> str:
    line = f'<Trajectory name="t" closed="false"><Shape>{shape}</Shape></Trajectory>'
    return private(
        f"<RoutingAction><FollowTrajectoryAction><TrajectoryRef>{line}</TrajectoryRef>"
        '<TimeReference><None/></TimeReference><TrajectoryFollowingMode followingMode="position"/>'
        "</FollowTrajectoryAction></RoutingAction>"
    )


def line(*places: tuple[float, float], of: str = "Ego", turn: str = "") -> str:
    rows = (
        f'<Vertex time="0"><Position><RelativeObjectPosition entityRef="{of}" dx="{x}" dy="{y}">'
        f"{turn}</RelativeObjectPosition></Position></Vertex>"
        for x, y in places
    )
    return follow(f"<Polyline>{''.join(rows)}</Polyline>")


def of_the_ego(action: str) -> str:
    """The file with an act in which the ego does this after 3 s."""
    act = event("swerve", action, AT_3_S)
    group = (
        '<ManeuverGroup name="own" maximumExecutionCount="1"><Actors '
        'selectTriggeringEntities="false"><EntityRef entityRef="Ego"/></Actors>'
        f'<Maneuver name="n">{act}</Maneuver></ManeuverGroup>'
    )
    text = scene()
    end = text.index("</ManeuverGroup>") + len("</ManeuverGroup>")
    return text[:end] + group + text[end:]


SWERVE = line((0, 0), (20, 0), (40, 3), (60, 3))


def test_one_that_begins_at_itself_is_metres_ahead_and_to_its_left(
    workspace: Workspace, tmp_path: Path
) -> None:
    found = read(workspace, tmp_path, of_the_ego(SWERVE))
    assert found.lists["refused"] == []
    path: dict[str, Any] = rule(found, "swerve")["then"][0]["path"]
    assert path["relative_to"] == "Ego"
    # The reference point, which follows it, is 1.4 m behind the centre and 3.9 m behind the front.
    assert path["points"][-1] == [pytest.approx(60 - 1.4), pytest.approx(3.0)]
    assert path["behind"] == pytest.approx(3.9)


@pytest.mark.slow
def test_the_actor_drives_it_from_where_it_is_by_then(workspace: Workspace, tmp_path: Path) -> None:
    found = read(workspace, tmp_path, of_the_ego(SWERVE))
    done = run(workspace, found.scenario, settings=RunSettings(until=9.5), out=tmp_path / "runs")
    rows = {str(key): one for (key,), one in done.trajectories().group_by("id")}["Ego"]
    y = np.interp([2.9, 3.0 + 3.0, 3.0 + 5.9], rows["time"], rows["y"]) + 1.75
    assert y[0] == pytest.approx(0.0, abs=0.01)
    assert 0.3 < y[1] < 2.0  # half-way between 20 and 40 m after 3 s at 10 m/s
    assert y[2] == pytest.approx(3.0, abs=0.1)


def test_a_spline_without_a_start_begins_at_the_actor(workspace: Workspace, tmp_path: Path) -> None:
    spline = follow(
        '<ClothoidSpline><ClothoidSplineSegment curvatureStart="0" curvatureEnd="0" length="12"/>'
        "</ClothoidSpline>"
    )
    found = read(workspace, tmp_path, of_the_ego(spline))
    path = rule(found, "swerve")["then"][0]["path"]
    assert path["relative_to"] == "Ego"
    assert path["points"][-1] == [pytest.approx(12 - 1.4), pytest.approx(0.0)]


@pytest.mark.parametrize(
    ("action", "why"),
    [
        (line((0, 0), (9, 0), turn='<Orientation type="relative" h="3.14"/>'), "do not reverse"),
        (line((0, 0), (9, 0), turn='<Orientation type="absolute" h="0"/>'), "a direction of the"),
        (
            SWERVE.replace('entityRef="Ego" dx="60"', 'entityRef="Other" dx="60"'),
            "places relative to 'Ego' and 'Other', which move apart",
        ),
        (
            SWERVE.replace("RelativeObjectPosition", "RelativeLanePosition").replace("dx", "ds"),
            "known in the run only",
        ),
    ],
)
def test_what_cannot_be_told_before_the_run_is_refused(
    workspace: Workspace, tmp_path: Path, action: str, why: str
) -> None:
    found = read(workspace, tmp_path, of_the_ego(action))
    assert any(why in one for one in reasons(found, "refused"))
    assert "swerve" not in [one.id for one in found.scenario.rules]


@pytest.mark.parametrize("of", ["Ego", "Other"])
def test_it_comes_back_from_a_file_but_for_scenario_runner(
    workspace: Workspace, tmp_path: Path, of: str
) -> None:
    swerve = line((0, 0), (20, 0), (40, 3), (60, 3), of=of)
    before = read(workspace, tmp_path, of_the_ego(swerve)).scenario
    for version in ("1.2", "1.0"):
        files = export(workspace, before, tmp_path / version, to="openscenario",
                       options={"version": version})  # fmt: skip
        (file,) = (one for one in files if one.suffix == ".xosc")
        words = [one.place for one in acting_differences(before, import_file(
            workspace, file).scenario) if one.place[0] == "rules"]  # fmt: skip
        assert words == ([] if version == "1.2" else [("rules", "swerve")])


def test_a_teleport_along_its_own_lane_lines_it_up(workspace: Workspace, tmp_path: Path) -> None:
    place = '<RelativeLanePosition entityRef="Ego" dLane="0" ds="0"/>'
    jump = private(f"<TeleportAction><Position>{place}</Position></TeleportAction>")
    found = read(workspace, tmp_path, of_the_ego(jump))
    assert rule(found, "swerve")["then"] == [{"offset": {"to": 0.0, "over": 0.1}}]
