"""Stop triggers of OpenSCENARIO: durations, and rules that end the run."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import pytest

from odscen.app.exchange.exports import export
from odscen.app.exchange.imports import import_file
from odscen.app.running.runs import run
from odscen.maps.store import Workspace
from tests.app.test_openscenario_features import entity_condition, read, rule, scene, when

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.app.exchange.imports import ImportedFile

TIME = (
    '<ByValueCondition><SimulationTimeCondition value="{}" rule="greaterThan"/></ByValueCondition>'
)
DROVE = entity_condition('<TraveledDistanceCondition value="30"/>')
STANDS = entity_condition('<StandStillCondition duration="2"/>')
ACT = (
    '<ByValueCondition><StoryboardElementStateCondition storyboardElementType="act" '
    'storyboardElementRef="a" state="completeState"/></ByValueCondition>'
)
TRAFFIC = '<ByValueCondition><UserDefinedValueCondition name="x" value="1" rule="equalTo"/>'
TRAFFIC += "</ByValueCondition>"
STEADY = entity_condition('<SpeedCondition value="5" rule="equalTo"/>')
DRIVEN = {"travelled": {"of": "Ego", "above": 30.0}}
OVER = {"all": [{"rule": {"id": "cut-in"}}, {"rule": {"id": "later"}}]}


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    return Workspace.open(tmp_path_factory.mktemp("stops"))


def stopping(*groups: str) -> str:
    stop = f"<StopTrigger>{''.join(groups)}</StopTrigger>"
    return re.sub("(?s)<StopTrigger>.*</StopTrigger>", stop, scene())


def ends(found: ImportedFile) -> list[dict[str, Any]]:
    made = [one for one in found.scenario.rules if one.then[0].end is not None]
    return [rule(found, one.id)["when"] for one in made]


@pytest.mark.parametrize(
    ("groups", "duration", "whens"),
    [
        ([when(TIME.format(20))], 20.0, []),
        ([when(TIME.format(20)), when(DROVE)], 20.0, [DRIVEN]),
        ([when(DROVE)], 60.0, [DRIVEN]),
        ([when(TIME.format(20), DROVE)], 80.0, [{"all": [{"time": {"after": 20.0}}, DRIVEN]}]),
        ([when(ACT)], 60.0, [OVER]),
        ([when(TRAFFIC)], 60.0, []),  # not known
        ([when(TIME.format(20), TRAFFIC)], 20.0, []),
        ([when(DROVE).replace('name="c"', 'name="criteria_DrivenDistanceTest"')], 60.0, []),
    ],
)
def test_a_stop_trigger_is_a_duration_or_a_rule_that_ends_the_run(
    workspace: Workspace,
    tmp_path: Path,
    groups: list[str],
    duration: float,
    whens: list[dict[str, Any]],
) -> None:
    found = read(workspace, tmp_path, stopping(*groups))
    assert found.scenario.simulation.duration == duration
    assert ends(found) == whens
    assert found.lists["refused"] == []
    taken = {row.xpath.rpartition("/")[2] for row in found.lists["taken"]}
    assert ("TraveledDistanceCondition" in taken) == any(
        DRIVEN in (one, *one.get("all", ())) for one in whens
    )


@pytest.mark.slow
def test_a_run_ends_when_the_file_says_so(workspace: Workspace, tmp_path: Path) -> None:
    found = read(workspace, tmp_path, stopping(when(TIME.format(20)), when(DROVE)))
    done = run(workspace, found.scenario, name="run", out=tmp_path)
    assert (done.status, done.summary["stopped"]) == ("completed", False)
    rows = done.trajectories()
    ego = rows.filter(rows["id"] == "Ego").sort("time")
    assert ego["x"][-1] - ego["x"][0] == pytest.approx(30.0, abs=1.0)
    assert done.summary["sim_seconds"] == pytest.approx(ego["time"][-1] + 0.1)


def test_the_end_of_a_run_comes_back_from_an_export(workspace: Workspace, tmp_path: Path) -> None:
    equal = when(STEADY).replace('"none"', '"rising"')
    found = read(workspace, tmp_path, stopping(when(TIME.format(20)), when(DROVE), equal))
    whens = ends(found)
    assert whens[1] == {
        "all": [{"speed": {"of": "Ego", "above": 4.9}}, {"speed": {"of": "Ego", "below": 5.1}}],
        "edge": "rising",
    }
    for version in ("1.0", "1.2"):
        files = export(
            workspace, found.scenario, tmp_path / version, to="openscenario",
            options={"version": version},
        )  # fmt: skip
        (file,) = (path for path in files if path.suffix == ".xosc")
        again = import_file(workspace, file)
        assert again.scenario.simulation.duration == 20.0
        assert ends(again) == whens == [DRIVEN, whens[1]]
