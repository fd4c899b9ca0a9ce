"""Each example runs to its end as README says, and prints what it promises."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("workspace")


def printed(name: str, workspace: Path) -> str:
    done = subprocess.run(
        [sys.executable, "-W", "error", str(EXAMPLES / name), str(workspace)],
        env=os.environ | {"POLARS_FMT_TABLE_FORMATTING": "ASCII_MARKDOWN"},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


def cells(table: str) -> list[list[str]]:
    """Rows of a table that polars has printed, below its head."""
    rows = [line.strip("| ").split("|") for line in table.splitlines() if line.startswith("|")]
    below = next(i for i, row in enumerate(rows) if set(row[0].strip()) == {"-"} and i > 1) + 1
    return [[cell.strip() for cell in row] for row in rows[below:]]


def test_every_example_is_tried_here_and_is_short() -> None:
    tried = Path(__file__).read_text(encoding="utf-8")
    for path in EXAMPLES.glob("*.py"):
        assert f'"{path.name}"' in tried
        assert len(path.read_text(encoding="utf-8").splitlines()) <= 60


@pytest.mark.slow
def test_the_sweep_finds_that_delay_grows_with_traffic(workspace: Path) -> None:
    rows = cells(printed("sweep.py", workspace))
    assert [row[0] for row in rows] == ["0.1", "0.3", "0.5"]
    users, delays = ([float(row[column]) for row in rows] for column in (1, 2))
    assert users == sorted(users)
    assert delays[0] < delays[1] < delays[2]


@pytest.mark.slow
def test_the_own_figure_is_a_share_for_each_junction_the_worst_first(workspace: Path) -> None:
    rows = cells(printed("own_figure.py", workspace))
    assert len(rows) == 10
    assert all(re.fullmatch(r"j\d+", row[0]) and int(row[1]) >= 1 for row in rows)
    shares = [float(row[2]) for row in rows]
    assert shares == sorted(shares, reverse=True)
    assert 0.0 < shares[0] <= 1.0


@pytest.mark.slow
def test_the_lane_graph_reaches_further_with_lane_changes(workspace: Path) -> None:
    text = printed("lane_graph_networkx.py", workspace)
    without, having = (float(share) for share in re.findall(r"lane changes: ([\d.]+)%", text))
    assert 0 < without < having < 100
    assert re.search(r"edges: \d+ left, \d+ right, \d+ successor", text)
    assert len(re.findall(r"shortest paths between segments: [jr]\d+", text)) == 3


@pytest.mark.slow
def test_the_watched_run_is_stopped_when_half_have_arrived(workspace: Path) -> None:
    text = printed("watch_a_run.py", workspace)
    assert re.search(r"^ +0 s: \d+ under way, 0\.0 m/s on average$", text, re.MULTILINE)
    found = re.search(r"(\d+) of (\d+) arrived in ([\d.]+) s; see (.*)", text)
    assert found is not None
    arrived, planned, seconds = int(found[1]), int(found[2]), float(found[3])
    assert planned / 2 <= arrived < planned
    assert seconds < 300
    assert Path(found[4]).is_file()


@pytest.mark.slow
def test_the_regression_test_passes_and_fails_when_the_bound_is_tighter(tmp_path: Path) -> None:
    text = (EXAMPLES / "test_regression.py").read_text(encoding="utf-8")
    text = text.replace("Path(__file__).parents[1]", f"Path({str(EXAMPLES.parent)!r})")
    (tmp_path / "test_regression.py").write_text(text)
    (tmp_path / "test_tighter.py").write_text(
        text.replace("mean_delay <= 60 s", "mean_delay <= 1 s")
    )
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "odscen.experiments.regression.pytest_plugin",
    ]
    done = subprocess.run(
        command, cwd=tmp_path, env=os.environ | {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert "2 failed, 2 passed" in done.stdout, done.stdout
    assert "expected mean_delay <= 1 s, but it is" in done.stdout


@pytest.mark.slow
def test_lights_are_learned_and_judged_beside_four_controls(tmp_path: Path) -> None:
    pytest.importorskip("gymnasium")
    text = (EXAMPLES / "learn_lights.py").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 40
    script = tmp_path / "learn_lights.py"
    assert "range(1, 31)" in text
    script.write_text(text.replace("range(1, 31)", "range(1, 3)"))  # two seeds in place of thirty
    command = [sys.executable, "-W", "error", str(script), str(tmp_path), "2"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "agent.npz").is_file()
    lines = done.stdout.splitlines()
    assert len(lines) == 10
    assert re.match(r"signal_crossing, fixed: [\d.]+ s, \+0\.0 s", lines[0])
    assert re.match(r"left_hand_crossing, agent: [\d.]+ s, [-+][\d.]+ s \([-+]", lines[9])


@pytest.mark.slow
def test_the_edited_scene_is_undone_timed_and_run(workspace: Path) -> None:
    text = printed("edit_and_run.py", workspace)
    assert "undone: Change the seed, seed 0" in text
    assert re.search(r"^Junction .*: cycle [\d.]+ s \(was", text, re.MULTILINE)
    assert "Background traffic, Time the light" in text
    assert re.search(r"^\d+ road users, mean delay [\d.]+ s$", text, re.MULTILINE)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("map_pictures.py", r"drawn: .*segments\.svg\neastbound \S+ at \d\.\d m, westbound \S+"),
        ("critical_gap.py", r"ttc 1\.0 s: not safe\n[^$]*ttc 5\.0 s: safe\n\d of 4 cases are"),
        ("gate_a_change.py", r"again: 0\nnarrowed: 1 the map: width of lane .*: 3\.25 m -> 2\.4 m"),
        (
            "make_dataset.py",
            r"^2 runs, \d{5,} bytes\nfirst run: \d\d arrays, \d+ road users\n"
            r"batch: \(2, \d+, \d+, 5\), [1-9]\d* lanes",
        ),
        ("own_driver.py", r"sumo: mean speed [\d.]+ m/s\ndawdlers: mean speed [\d.]+ m/s"),
        ("own_generator.py", r"(\d+) cars, of them \1 moving\nproblems: none"),
        ("rain_study.py", r"as-designed: [\d.]+ m/s\nhard-rain: [\d.]+ m/s"),
        ("to_openscenario.py", r"refused: 0\n2 actors there, 2 back"),
        ("time_lights.py", r"junction \S+: \S+\n[^$]*[Mm]ean delay"),
        ("drive_the_ego.py", r"0: 40 steps, return ([\d.]+)\nepisode 1: 40 steps, return \1\n"),
    ],
)
def test_a_program_of_the_gallery_prints_what_it_promises(
    name: str, words: str, tmp_path: Path
) -> None:
    if name == "drive_the_ego.py":
        pytest.importorskip("gymnasium")
    text = printed(name, tmp_path)
    assert re.search(words, text), text
    speeds = [float(speed) for speed in re.findall(r"([\d.]+) m/s", text)]
    assert speeds == sorted(speeds, reverse=True)  # dawdlers and rain are slower
