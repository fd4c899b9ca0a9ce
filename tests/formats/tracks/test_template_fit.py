"""Numbers of templates come out of recordings of their runs as they went in."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from typer.testing import CliRunner

import odscen
from odscen.cli.commands import command_line
from odscen.formats.tracks.template_fit import FittedScene, describe_values, draw_values
from odscen.templates import place_template
from tests.formats.tracks.test_tracks_on_maps import crossing_traffic

ROOT = Path(__file__).parents[3]
CUT_INS = [
    {"ego_speed": 16.0, "speed": 11.0, "ttc": 1.6, "over": 3.0},
    {"ego_speed": 14.0, "speed": 10.5, "ttc": 2.2, "over": 4.0},
    {"ego_speed": 18.0, "speed": 12.0, "ttc": 1.2, "over": 2.5},
    {"ego_speed": 15.0, "speed": 9.0, "ttc": 2.6, "over": 5.0},
]
BRAKING = [
    {"speed": 14.0, "gap": 25.0, "deceleration": 6.0},
    {"speed": 11.0, "gap": 18.0, "deceleration": 5.0},
    {"speed": 16.0, "gap": 35.0, "deceleration": 7.5},
    {"speed": 12.5, "gap": 14.0, "deceleration": 5.5},
]
WALKS = [
    {"ego_speed": 8.0, "walking_speed": 1.4, "hit": 0.5},
    {"ego_speed": 6.0, "walking_speed": 1.2, "hit": 0.2},
    {"ego_speed": 9.0, "walking_speed": 1.8, "hit": 0.8},
    {"ego_speed": 7.0, "walking_speed": 1.5, "hit": 1.6},
]
BOUNDS = {
    "ego_speed": 0.1, "speed": 0.05, "walking_speed": 0.05, "ttc": 0.05, "over": 0.1, "gap": 0.15,
    "deceleration": 0.1, "hit": 0.1,
}  # fmt: skip
"""By how much a number may differ: m/s, s, m, m/s²."""


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> odscen.Workspace:
    store = odscen.Workspace.open(tmp_path_factory.mktemp("templates"))
    for name in ("motorway_weave", "town_5x5"):
        store.add_map(ROOT / "maps" / f"{name}.xodr")
    return store


def record_runs(
    workspace: odscen.Workspace, scenarios: Sequence[odscen.Scenario], folder: Path
) -> Path:
    """Runs, one after another as one recording, five minutes apart."""
    parts = []
    for number, given in enumerate(scenarios):
        # What the ego does about it is no part of the scene; it drives as the story says.
        actors = tuple(
            actor.model_copy(update={"driver": "story"}) if actor.ego else actor
            for actor in given.actors
        )
        simulation = given.simulation.model_copy(update={"step_length": 0.1})
        scenario = given.model_copy(update={"actors": actors, "simulation": simulation})
        run = odscen.run(workspace, scenario, out=folder / f"run-{number}")
        rows = odscen.read_recorded_traffic(run.folder).rows
        parts.append(
            rows.with_columns(
                id=pl.format("{}-{}", pl.lit(number), pl.col("id")),
                time=pl.col("time") + 300.0 * number,
            )
        )
    file = folder / "recorded.parquet"
    pl.concat(parts).write_parquet(file)
    return file


def fitted_templates(
    workspace: odscen.Workspace, file: Path, map_name: str, out: Path
) -> dict[str, Any]:
    """What the command says of a recording."""
    arguments = ["recording", "templates", str(file), "--map", map_name, "--out", str(out)]
    arguments += ["--samples", "20", "--json", "--workspace", str(workspace.root)]
    said = CliRunner().invoke(command_line(), arguments)
    assert said.exit_code == 0, said.output
    found: dict[str, Any] = json.loads(said.stdout)["templates"]
    return found


def assert_same_scenes(scenes: list[dict[str, Any]], sets: list[dict[str, float]]) -> None:
    assert [int(scene["id"].partition("-")[0]) for scene in scenes] == list(range(len(sets)))
    for scene, values in zip(scenes, sets, strict=True):
        assert scene["other"].endswith("-ego")
        for name, value in scene["values"].items():
            assert value == pytest.approx(values[name], abs=BOUNDS[name]), (scene, values)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("template", "map_name", "sets"),
    [
        ("cut-in", "motorway_weave", CUT_INS),
        ("lead-brakes", "motorway_weave", BRAKING),
        ("mid-block", "town_5x5", WALKS),
    ],
)
def test_numbers_of_runs_come_out_of_their_recording(
    workspace: odscen.Workspace,
    tmp_path: Path,
    template: str,
    map_name: str,
    sets: list[dict[str, float]],
) -> None:
    scenarios = [place_template(workspace, template, map_name, values=each) for each in sets]
    file = record_runs(workspace, scenarios, tmp_path / "first")
    out = tmp_path / "out"
    found = fitted_templates(workspace, file, map_name, out)[template]
    assert_same_scenes(found["scenes"], sets)
    # A sweep of the scenario over the recorded scenes drives them again, each in the same place.
    plan = json.loads((out / f"{template}.scenes.json").read_text())
    assert plan["vary"][0]["table"] == [list(one["values"].values()) for one in found["scenes"]]
    swept = ["sweep", str(out / f"{template}.scenario.json"), "--json", "--out"]
    swept += [str(tmp_path / "sweep"), "--plan", str(out / f"{template}.scenes.json")]
    said = CliRunner().invoke(command_line(), [*swept, "--workspace", str(workspace.root)])
    assert said.exit_code == 0, said.output
    assert [row["status"] for row in json.loads(said.stdout)["cases"]] == ["completed"] * 4
    cases = sorted((tmp_path / "sweep" / "cases").glob("*.scenario.json"))
    again = record_runs(
        workspace, [odscen.read_scenario(case) for case in cases], tmp_path / "again"
    )
    driven = fitted_templates(workspace, again, map_name, tmp_path / "out-again")[template]
    assert_same_scenes(driven["scenes"], sets)


def known_scenes(count: int) -> list[FittedScene]:
    """Cut-ins whose speeds go together: the one behind is 1 to 5 m/s faster than the other."""
    rng = np.random.default_rng(5)
    speed = rng.normal(12.0, 2.0, count)
    values = zip(
        speed + rng.uniform(1.5, 4.5, count), speed, rng.gamma(4.0, 0.5, count), strict=True
    )
    return [
        FittedScene(
            "cut-in",
            str(k),
            "ego",
            float(k),
            dict(zip(("ego_speed", "speed", "ttc"), each, strict=True)),
        )
        for k, each in enumerate(values)
    ]


def test_what_is_drawn_is_distributed_and_goes_together_as_the_scenes() -> None:
    scenes = known_scenes(300)
    drawn = draw_values(scenes, 4000, seed=1)
    assert drawn == draw_values(scenes, 4000, seed=1)
    assert drawn != draw_values(scenes, 4000, seed=2)
    again = [FittedScene("cut-in", "", "", 0.0, values) for values in drawn]
    true, found = describe_values(scenes), describe_values(again)
    for name, row in true["parameters"].items():
        for key in ("p5", "p25", "p50", "p75", "p95"):
            assert found["parameters"][name][key] == pytest.approx(
                row[key], abs=0.1 * row["std"] + 0.1
            )
    assert true["correlation"]["ego_speed and speed"] > 0.85
    for pair, value in true["correlation"].items():
        assert found["correlation"][pair] == pytest.approx(value, abs=0.06)
    assert min(values["ego_speed"] - values["speed"] for values in drawn) >= 1.0


def test_what_is_no_scene_of_a_template_is_counted_with_its_reason(tmp_path: Path) -> None:
    store = odscen.Workspace.open(tmp_path / "crossing")
    store.add_map(ROOT / "maps" / "signal_crossing.xodr")
    crossing_traffic().write_csv(tmp_path / "tracks.csv")
    found = fitted_templates(store, tmp_path / "tracks.csv", "signal_crossing", tmp_path / "out")
    # The one behind the cut-in is as fast as the one that cuts in.
    assert found["cut-in"]["scenes"] == []
    assert found["cut-in"]["unfit"] == {"the vehicle behind is not 1 m/s faster": 1}
    assert found["lead-brakes"]["unfit"] == {"no vehicle follows the one that brakes": 1}
    written = sorted(file.name for file in (tmp_path / "out").iterdir())
    assert "cut-in.scenario.json" not in written
    assert "templates.json" in written
