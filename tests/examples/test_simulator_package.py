"""A simulator with assets and weather from outside: ``examples/simulator_package``."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from itertools import pairwise
from pathlib import Path

import numpy as np
import polars as pl
import pytest

import odscen
from odscen.app.scenarios import read_scenario, write_scenario
from odscen.base.categories import Category
from odscen.maps.store import Workspace
from odscen.runs.finished_run import Run
from odscen.runs.run_settings import RunSettings
from odscen.simulators import assets
from odscen.simulators.assets import installed_assets
from tests.app.conftest import sampled, workspace
from tests.installed_packages import install
from tests.reporters import Listener

__all__ = ["sampled", "workspace"]

PACKAGE = Path(__file__).parents[2] / "examples" / "simulator_package"
MODULE, PROJECT = PACKAGE / "calm_traffic.py", PACKAGE / "pyproject.toml"
UV = Path(sys.executable).with_name("uv")
MODEL, SIZE, WEATHER = "calm.minibus", (7.0, 2.2), "CalmSeaFog"
SETTINGS = RunSettings(until=50.0, step_length=0.2)


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(assets, "installed_assets", installed_assets.__wrapped__)
    points = tomllib.loads(PROJECT.read_text(encoding="utf-8"))["project"]["entry-points"]
    code = MODULE.read_text(encoding="utf-8")
    install(tmp_path / "site", monkeypatch, code=code, entry_points=points)


def with_assets(sampled: Path, folder: Path, *, weather: str) -> Path:
    """Some of the scenario, its first car a slow minibus that three others come up to."""
    scenario = read_scenario(sampled)
    car = max(
        (actor for actor in scenario.actors if actor.category == "car" and ".-" in actor.spawn),
        key=lambda actor: int(actor.spawn.rpartition(".")[2]),
    )
    lane, _, node = car.spawn.rpartition(".")
    bus = {"category": Category.BUS, "model": MODEL, "speed": 3.0, "depart": 0.0}
    behind = {"model": None, "speed": None, "depart": 0.0}
    queue = [
        car.model_copy(
            update={**behind, "id": f"queue-{k}", "spawn": f"{lane}.{int(node) - 8 * k}"}
        )
        for k in (1, 2, 3)
    ]
    others = [actor for actor in scenario.actors if not actor.spawn.startswith(f"{lane}.")][:8]
    sky = scenario.environment.model_copy(update={"preset": weather})
    actors = (car.model_copy(update=bus), *queue, *others)
    made = scenario.model_copy(update={"actors": actors, "environment": sky})
    return write_scenario(made, folder / f"{weather}.scenario.json")


def test_it_has_at_most_200_lines() -> None:
    lines = [file.read_text(encoding="utf-8").splitlines() for file in (MODULE, PROJECT)]
    assert sum(map(len, lines)) <= 200


@pytest.mark.slow
@pytest.mark.usefixtures("installed")
def test_its_model_is_driven_and_its_weather_makes_all_slower(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    runs: dict[str, Run] = {}
    for weather in ("ClearNoon", WEATHER):
        listener = Listener()
        file = with_assets(sampled, tmp_path, weather=weather)
        runs[weather] = odscen.run(
            workspace, file, simulator="calm", settings=SETTINGS, out=tmp_path / "runs",
            reporter=listener,
        )  # fmt: skip
        assert runs[weather].status == "completed"
        assert any("bodies may overlap" in words for words in listener.words)
    clear, fog = runs["ClearNoon"], runs[WEATHER]
    plan = json.loads((fog.folder / "plan.json").read_text())
    (bus,) = [row for row in plan["actors"] if row.get("model") == MODEL]
    assert (bus["length"], bus["width"]) == SIZE
    assert clear.counts["inserted"] == clear.counts["planned"] == 12
    fast, slow = (pace(run) for run in (clear, fog))
    assert fast["first second"] == pytest.approx(1.5, abs=0.01)
    assert slow["first second"] == pytest.approx(0.9, abs=0.01), "a wet road has 0.6 of the grip"
    assert slow["under way"] < 0.95 * fast["under way"]
    for run in (clear, fog):
        apart = gaps_in_queue(run, [bus["id"], "queue-1", "queue-2", "queue-3"])
        assert apart.min() > 0.5
        assert apart.min() < 15.0, "they have come up to the one ahead"


def pace(run: Run) -> dict[str, float]:
    """Of vehicles, m/s: the fastest a second after departure, and the mean of those who move."""
    table = run.trajectories().filter(pl.col("category") != "pedestrian").sort("id", "time")
    since = pl.col("time") - pl.col("time").min().over("id")
    second = table.filter((since - 1.0).abs() < 1e-6)["speed"].to_numpy()
    moving = table.filter(pl.col("speed") > 0.5)["speed"].to_numpy()
    return {"first second": float(second.max()), "under way": float(moving.mean())}


def gaps_in_queue(run: Run, names: list[str]) -> np.ndarray:
    """Metres between the bodies of each of them and the next, in a straight line, at all times."""
    plan = json.loads((run.folder / "plan.json").read_text())
    length = {row["id"]: row["length"] for row in plan["actors"]}
    table, found = run.trajectories().select("time", "id", "x", "y"), []
    for ahead, behind in pairwise(names):
        first, second = (table.filter(pl.col("id") == name) for name in (ahead, behind))
        both = first.join(second, on="time")
        apart = np.hypot(both["x"] - both["x_right"], both["y"] - both["y_right"])
        found.append(apart - 0.5 * (length[ahead] + length[behind]))
        assert len(apart) > 20
    return np.concatenate(found)


@pytest.mark.slow
def test_installed_with_pip_the_command_line_runs_it(
    workspace: Workspace, sampled: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The whole way of a user: a wheel is built, and ``odscen`` finds both entry points."""
    site = tmp_path / "site"
    done = subprocess.run(
        [UV, "pip", "install", "--quiet", "--no-deps", "--target", site, PACKAGE],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    monkeypatch.setenv("PYTHONPATH", str(site))
    monkeypatch.syspath_prepend(site)
    monkeypatch.setattr(assets, "installed_assets", installed_assets.__wrapped__)
    file = with_assets(sampled, tmp_path, weather=WEATHER)
    command = [
        *(sys.executable, "-m", "odscen", "run", file, "--simulator", "calm", "--until", "30"),
        *("--simulator-set", "headway=2", "--workspace", workspace.root),
        *("--out", tmp_path / "runs", "--json"),
    ]
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    told = json.loads(ran.stdout)
    assert told["driven_by"] == "Calm traffic"
    assert told["status"] == "completed"
    assert Path(told["files"]["report"]).is_file()
