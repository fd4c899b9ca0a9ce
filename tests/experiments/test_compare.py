import json
import re

import numpy as np
import pytest
from scipy import stats

from odscen.app.running import runs
from odscen.base.errors import InputError
from odscen.experiments.comparison_page import comparison_page
from odscen.experiments.comparisons import compare_runs, read_runs
from odscen.experiments.measure import FigureKey
from odscen.figures.measures.comparison import compare_figure
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from tests.cli.conftest import odscen
from tests.experiments.conftest import ROOT

SCENARIO = ROOT / "suites" / "scenarios" / "signal_crossing.scenario.json"


def test_runs_of_the_same_seeds_are_paired_as_scipy_does():
    a, b = {1: 10.0, 2: 14.0, 3: 9.0}, {1: 11.0, 2: 16.5, 3: 10.0}
    found = compare_figure(a, b)
    peer = stats.ttest_rel(list(b.values()), list(a.values())).confidence_interval(0.95)
    assert found.paired
    assert found.difference == pytest.approx(1.5)
    assert (found.low, found.high) == pytest.approx((peer.low, peer.high))


def test_runs_of_other_seeds_are_compared_by_welch_as_scipy_does():
    a, b = {1: 10.0, 2: 14.0, 3: 9.0}, {5: 21.0, 6: 16.5, 7: 20.0, 8: 30.0}
    found = compare_figure(a, b)
    one, other = (np.array(list(side.values())) for side in (b, a))
    peer = stats.ttest_ind(one, other, equal_var=False).confidence_interval(0.95)
    assert not found.paired
    assert (found.low, found.high) == pytest.approx((peer.low, peer.high))
    assert found.clear


def test_what_is_missing_on_one_side_is_no_difference_of_zero():
    found = compare_figure({1: None}, {1: 3.0})
    assert (found.a, found.b, found.difference, found.low) == (None, 3.0, None, None)


@pytest.fixture(scope="module")
def sides(tmp_path_factory):
    """Three seeds of a crossing, and the same with a much longer first green."""
    root = tmp_path_factory.mktemp("sides")
    store = Workspace.open(root / "workspace")
    store.add_map(ROOT / "maps" / "signal_crossing.xodr")
    changed = json.loads(SCENARIO.read_text())
    changed["signals"] = {"junctions": [{"junction": "10001", "green": [60, 8]}]}
    other = root / "signal_crossing.scenario.json"
    other.write_text(json.dumps(changed))
    for side, path in (("a", SCENARIO), ("b", other)):
        for seed in (1, 2, 3):
            runs.run(store, path, out=root / side / str(seed), settings=RunSettings(seed=seed))
            (root / side / str(seed) / "signal_crossing").rename(root / side / f"seed-{seed}")
    return root / "a", root / "b"


@pytest.mark.slow
def test_a_longer_green_is_a_clear_difference_at_its_junction(sides):
    a, b = sides
    result = compare_runs(read_runs(a), read_runs(b))
    rows = {row.key: row.difference for row in result.rows}
    delay = rows[FigureKey("run", "", "mean_delay")]
    assert delay.paired
    assert delay.runs == 3
    assert delay.low < delay.difference < delay.high
    seconds = [
        json.loads((side / f"seed-{seed}" / "summary.json").read_text())["figures"]["mean_delay"]
        for side in (a, b)
        for seed in (1, 2, 3)
    ]
    assert delay.a == pytest.approx(np.mean(seconds[:3]), abs=1e-3)
    assert delay.difference == pytest.approx(np.mean(seconds[3:]) - np.mean(seconds[:3]), abs=1e-3)
    assert any(row.key.place == "j10001" for row in result.places)


@pytest.mark.slow
def test_the_page_of_a_comparison_shows_chart_map_and_diagram(sides):
    a, b = sides
    store = Workspace.open(a.parent / "workspace")
    result = compare_runs(read_runs(a, store), read_runs(b, store))
    page = comparison_page(result)
    assert "junction j10001: stopped delay" in page
    # Every figure that differs has a dot, and a bar as there are three runs a side.
    run_rows = [row for row in result.rows if row.key.kind == "run"]
    differing = sum(bool(row.difference.relative) for row in run_rows)
    chart = page[page.index('id="differences"') : page.index('id="figures"')]
    assert chart.count("<circle") == differing > 5
    assert chart.count('class="interval"') == differing
    assert chart.count('class="difference clear"') == sum(
        row.says == "clear" and bool(row.difference.relative) for row in run_rows
    )
    waiting = next(
        row for row in result.rows if row.key == FigureKey("junction", "j10001", "waiting_time")
    )
    words = f"delay {waiting.difference.a:.2f} s in A, {waiting.difference.b:.2f} s in B"
    assert re.search(rf'class="d[01]"><title>j10001: [a-z ]*{re.escape(words)}', page)
    diagram = page[page.index('id="diagram"') :]
    assert all(f'class="dots side-{side}"' in diagram for side in "ab")


@pytest.mark.slow
def test_a_page_of_runs_that_are_the_same_says_so(sides):
    a, _ = sides
    page = comparison_page(compare_runs(read_runs(a), read_runs(a)))
    assert "A and B are the same in every figure." in page
    assert 'id="differences"' not in page


@pytest.mark.slow
def test_a_run_in_slices_has_the_places_of_one_in_one_piece(sides, tmp_path):
    store = Workspace.open(tmp_path / "workspace")
    store.add_map(ROOT / "maps" / "signal_crossing.xodr")
    settings = RunSettings(seed=1, slice_length=100.0)
    done = runs.run(store, SCENARIO, out=tmp_path, settings=settings)
    assert "trajectory_parts" in done.summary["files"]
    sliced, whole = read_runs(done.folder), read_runs(sides[0] / "seed-1")
    assert sliced.places
    assert {key for key in sliced.runs[1] if key.place} == {
        key for key in whole.runs[1] if key.place
    }
    passed = FigureKey("junction", "j10001", "vehicles")
    assert sliced.runs[1][passed] == pytest.approx(whole.runs[1][passed], abs=2)


def test_a_run_compared_with_itself_is_the_same(sides):
    a, _ = sides
    result = compare_runs(read_runs(a), read_runs(a))
    assert {row.says for row in result.rows} == {"the same"}


@pytest.mark.slow
def test_the_command_prints_json_and_writes_a_page(sides, tmp_path):
    a, b = sides
    out = ("--json", "--html", tmp_path / "c.html")
    done = odscen("compare", a / "seed-1", b / "seed-2", *out)
    assert done.code == 0, done.err
    delay = next(row for row in done.json["figures"] if row["figure"] == "mean_delay")
    assert delay["unit"] == "s"
    assert delay["low"] is None
    assert any("not paired" in note for note in done.json["notes"])
    assert (tmp_path / "c.html").read_text().startswith("<!DOCTYPE html>")


def test_a_folder_without_runs_is_refused_by_name(tmp_path):
    with pytest.raises(InputError, match=r"no run here; name a run, which has a summary\.json"):
        read_runs(tmp_path)
