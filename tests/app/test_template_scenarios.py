"""Templates placed on the maps of a workspace."""

from __future__ import annotations

from pathlib import Path

import pytest

from odscen.app.running.runs import run
from odscen.app.scenarios import check_scenario, read_scenario
from odscen.app.template_scenarios import template_scenario, write_template
from odscen.base.errors import ConflictError, InputError, NotFoundError
from odscen.maps.store import Workspace
from odscen.scenario.templates.scene_sites import NoPlaceError
from odscen.scenario.templates.template_registry import TEMPLATES

MAPS = Path(__file__).parents[2] / "maps"
ROOM = {
    "town_5x5": {
        "stationary", "bicycle-ahead", "hidden-child", "mid-block", "van-and-walker", "turning",
        "reversing", "red-light",
    },
    "motorway_weave": {
        "cut-in", "cut-out", "stationary", "lead-brakes", "bicycle-ahead", "drift", "bus-leaves",
    },
    "rural_hills": {"stationary", "lead-brakes", "bicycle-ahead", "oncoming"},
    "signal_crossing": {
        "stationary", "lead-brakes", "bicycle-ahead", "hidden-child", "mid-block",
        "van-and-walker", "turning", "reversing", "red-light",
    },
    "left_hand_crossing": {
        "stationary", "bicycle-ahead", "hidden-child", "mid-block", "turning", "reversing",
        "red-light",
    },
}  # fmt: skip
"""Templates that each shipped map has room for."""


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    opened = Workspace.open(tmp_path_factory.mktemp("templates"))
    for name in ROOM:
        opened.add_map(MAPS / f"{name}.xodr")
    return opened


@pytest.mark.slow
@pytest.mark.parametrize("map_name", ROOM)
def test_templates_are_placed_where_there_is_room_and_else_say_why(
    workspace: Workspace, map_name: str
) -> None:
    placed = set()
    for name in TEMPLATES:
        try:
            scenario = template_scenario(workspace, name, map_name)
        except NoPlaceError as refused:
            assert f"map {map_name!r} has no room for" in str(refused)  # noqa: PT017
        else:
            placed.add(name)
            assert check_scenario(workspace, scenario) == ()
            assert sum(actor.ego for actor in scenario.actors) == 1
            assert TEMPLATES[name].source in scenario.description
    assert placed == ROOM[map_name]


@pytest.mark.slow
def test_a_refusal_counts_the_places_and_the_reasons(workspace: Workspace) -> None:
    with pytest.raises(NoPlaceError, match=r"of \d+ places, \d+ are shorter than 143 m") as refused:
        template_scenario(workspace, "cut-in", "signal_crossing")
    counts = [int(word) for word in str(refused.value).split() if word.isdigit()]
    assert counts[0] == counts[1]


def test_other_numbers_need_other_room(workspace: Workspace) -> None:
    slow = {"ego_speed": 8.0, "speed": 4.0}
    with pytest.raises(NoPlaceError):
        template_scenario(workspace, "cut-in", "signal_crossing")
    scenario = template_scenario(workspace, "cut-in", "signal_crossing", values=slow)
    assert [actor.speed for actor in scenario.actors] == [8.0, 4.0]


@pytest.mark.parametrize(
    ("template", "values", "message"),
    [
        ("cut-in", {"pace": 3.0}, "template 'cut-in' has no parameter 'pace'; it has ego_speed"),
        ("cut-in", {"over": 99.0}, "over must be 1 to 10 s, not 99"),
        ("cut-in", {"ego_speed": 5.0, "speed": 5.0}, "ego_speed must be at least 1 m/s above"),
        ("oncoming", {"speed": 5.0}, "speed must be at least 1 m/s above slow_speed"),
    ],
)
def test_numbers_that_make_no_scene_are_refused(
    workspace: Workspace, template: str, values: dict[str, float], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        template_scenario(workspace, template, "motorway_weave", values=values)


@pytest.mark.slow
def test_a_template_is_written_once_under_a_name(workspace: Workspace, tmp_path: Path) -> None:
    file = write_template(workspace, "mid-block", "town_5x5", out=tmp_path)
    assert file.name == "mid-block-town_5x5.scenario.json"
    assert read_scenario(file) == template_scenario(workspace, "mid-block", "town_5x5")
    with pytest.raises(ConflictError, match="is there already"):
        write_template(workspace, "mid-block", "town_5x5", out=tmp_path)


def test_an_unknown_template_is_refused_with_those_there_are(workspace: Workspace) -> None:
    with pytest.raises(NotFoundError, match="did you mean cut-in"):
        template_scenario(workspace, "cutin", "town_5x5")


@pytest.mark.slow
def test_a_drift_leaves_its_lane_when_the_side_of_the_body_is_over_the_border(
    workspace: Workspace, tmp_path: Path
) -> None:
    """From 2 s on at 0.5 m/s: 0.975 m to the border of a lane of 3.75 m, so after 1.95 s."""
    scenario = template_scenario(workspace, "drift", map_name="motorway_weave", name="drift")
    result = run(workspace, scenario, out=tmp_path / "runs")
    rows = {row["criterion"]: row for row in result.summary["criteria"]}
    left = rows["lane_departure(ego) <= 0 m"]
    hit = rows["collided(ego) == 0"]["time"]
    assert not left["passed"]
    assert left["time"] == pytest.approx(3.95, abs=0.11)  # the next record
    assert left["value"] >= 0.5 * (hit - 3.95) - 0.06
