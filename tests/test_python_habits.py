"""What people write in scripts and notebooks: paths as text, types that are wrong, short reprs."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree as ET

import pytest

import odscen
from odscen.lanegraph.query import node_id, node_index

if TYPE_CHECKING:
    from odscen.lanegraph.graphs import MapGraph

MAP = "t_junction_signs"


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> odscen.Workspace:
    """A workspace that was opened and filled with nothing but text for paths."""
    folder = tmp_path_factory.mktemp("workspace")
    workspace = odscen.Workspace.open(str(folder))
    (xodr,) = (file for file in odscen.shipped_maps() if file.stem == MAP)
    workspace.add_map(str(xodr))
    return workspace


@pytest.fixture(scope="module")
def graph(workspace: odscen.Workspace) -> MapGraph:
    return workspace.map(MAP).graph()


def test_all_paths_may_be_text(workspace: odscen.Workspace, tmp_path: Path) -> None:
    """From sampling to a report, a comparison, an export and edits: same files as with paths."""
    settings = odscen.GenerationSettings(map_name=MAP, seed=3)
    (file,) = odscen.generate(workspace, settings=settings, out=str(tmp_path / "made"))
    assert file.parent == tmp_path / "made"
    scenario = odscen.read_scenario(str(file))
    assert odscen.check(workspace, str(file)) == odscen.check(workspace, scenario)

    copy = odscen.write_scenario(scenario, str(tmp_path / "copy.scenario.json"))
    assert copy.read_bytes() == file.read_bytes()

    short = odscen.RunSettings(until=20.0)
    run = odscen.run(workspace, str(copy), settings=short, out=str(tmp_path / "runs"))
    assert run.folder == tmp_path / "runs" / "copy"
    assert odscen.Run.open(str(run.folder)).figures == run.figures
    assert odscen.renew_report(workspace, str(run.folder)) == run.folder / "report.html"
    assert odscen.compare(str(run.folder), run).a.runs == odscen.compare(run, run).b.runs

    (exported,) = odscen.export(workspace, str(copy), str(tmp_path / "graph"), to="graphml")
    assert exported.parent == tmp_path / "graph"
    editing = odscen.Editing(workspace, str(copy))
    editing.apply("set_seed", seed=8)
    assert editing.save(str(tmp_path / "edited.scenario.json")).is_file()


def test_learners_and_demand_take_text_for_paths_too(
    workspace: odscen.Workspace, graph: MapGraph, tmp_path: Path
) -> None:
    from odscen import demand, edit, learn

    with pytest.raises(odscen.InputError, match=rf"{re.escape(str(tmp_path))}: no \*"):
        learn.read_shards(str(tmp_path))
    missing = str(tmp_path / "none.npz")
    with pytest.raises(odscen.InputError, match=r"none\.npz"):
        learn.read_model(missing)
    scenario = edit.new_scenario(graph, name="empty", roi=graph.segments.ids)
    with pytest.raises(odscen.InputError, match=r"none\.npz"):
        demand.import_traffic(workspace, scenario, missing, stations=missing)
    with pytest.raises(odscen.InputError, match="nothing is left to learn from"):
        learn.learn_driving(workspace, [], str(tmp_path / "driver.npz"))


def test_the_home_folder_is_found(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """``~`` is what it is in a shell."""
    monkeypatch.setenv("HOME", str(tmp_path))
    assert odscen.Workspace.open("~/traffic").root == tmp_path / "traffic"


def test_what_is_no_path_is_refused_in_words() -> None:
    with pytest.raises(odscen.InputError, match=r"a path is text or a pathlib\.Path, not 5"):
        odscen.read_scenario(5)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"until": "300"}, "until must be a number of seconds, not '300'"),
        ({"step_length": "0.1"}, "step_length must be a number of seconds, not '0.1'"),
        ({"seed": 1.5}, "seed must be a whole number, not 1.5"),
        ({"warm_up": "5min"}, "warm_up must be whole seconds, not '5min'"),
        ({"behaviour": "idm"}, r"behaviour must be a BehaviourDoor, such as .*, not 'idm'"),
        (
            {"expectations": ("arrived >= 50 %",)},
            r"an expectation must be made by odscen.parse_expectation\('arrived >= 50 %'\)",
        ),
        ({"expectations": "arrived >= 50 %"}, "expectations must be a tuple, not a single text"),
        ({"seed": True}, "seed must be a whole number, not True"),
        ({"recording": "none"}, "recording must be an odscen.Recording, not 'none'"),
    ],
)
def test_values_of_other_types_are_refused_where_they_are_given(
    wrong: dict[str, Any], words: str
) -> None:
    """At construction, by name and value: not by an error of Python's in the middle of a run."""
    with pytest.raises(odscen.InputError, match=words):
        odscen.RunSettings(**wrong)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (
            {"columns": ("speedy",)},
            r"columns must be a tuple of lane, pos, slope, not \('speedy',\)",
        ),
        ({"columns": "lane"}, "columns must be a tuple of lane, pos, slope, not 'lane'"),
        ({"every": "1s"}, "every must be seconds above 0, not '1s'"),
        ({"every": -1.0}, "every must be seconds above 0, not -1.0"),
        ({"region": (0, 1)}, r"region must be four numbers, metres, not \(0, 1\)"),
    ],
)
def test_what_is_recorded_is_checked_at_construction(wrong: dict[str, Any], words: str) -> None:
    with pytest.raises(odscen.InputError, match=words):
        odscen.Recording(**wrong)


def test_enumerations_are_refused_by_name_and_value(
    workspace: odscen.Workspace, tmp_path: Path
) -> None:
    """A wrong kind of table, method of a search, count of scenarios: before anything is read."""
    scenario = odscen.edit.new_scenario(workspace.map(MAP).graph(), name="empty")
    with pytest.raises(odscen.InputError, match=r"kind must be one of od, .*, not 'matrix'"):
        odscen.demand.import_demand(workspace, scenario, "none.csv", kind="matrix")  # type: ignore[arg-type]
    with pytest.raises(odscen.InputError, match="method 'anneal' is not one of grid, latin"):
        odscen.experiments.SearchSettings(method="anneal")
    with pytest.raises(odscen.InputError, match="method grid takes no number of runs"):
        odscen.experiments.SearchSettings(method="grid")
    with pytest.raises(odscen.InputError, match="count must be a whole number, not '3'"):
        odscen.GenerationSettings(count="3")  # type: ignore[arg-type]
    with pytest.raises(odscen.InputError, match=r"a picture is a file \.svg or \.png"):
        odscen.Picture("<svg/>").save(tmp_path / "map.jpg")


def test_the_nearest_node_is_that_of_a_lane_in_the_direction(
    workspace: odscen.Workspace, graph: MapGraph
) -> None:
    """Each node is the nearest to itself; with a heading, one of the lane that goes that way."""
    entry, lanes = workspace.map(MAP), graph.lanes
    for row in range(0, len(lanes.x), 37):
        x, y, hdg = (float(column[row]) for column in (lanes.x, lanes.y, lanes.hdg))
        found = entry.nearest(x, y, hdg)
        assert found.distance == pytest.approx(0.0, abs=1e-9)
        assert found.hdg == pytest.approx(hdg, abs=math.pi / 4)
        away = entry.nearest(x + 0.3, y)
        assert away.distance <= 0.3 + 1e-9
        assert node_id(graph, node_index(graph, away.id)) == away.id
        back = entry.nearest(x, y, hdg + math.pi)
        assert abs(math.remainder(back.hdg - hdg - math.pi, math.tau)) <= math.pi / 4
        assert back.distance > 0.5
    with pytest.raises(odscen.InputError, match="finite"):
        entry.nearest(math.nan, 0.0)


def test_maps_and_runs_are_pictures_with_units(
    workspace: odscen.Workspace, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """A script and a notebook get the same drawing; figures have units; a logger hears of it."""
    entry = odscen.Workspace(str(workspace.root)).map(MAP)
    file = entry.plot(segments=True).save(tmp_path / "map.svg")
    drawn = file.read_text(encoding="utf-8")
    assert ET.fromstring(drawn).tag.endswith("svg")
    assert drawn.count("<path") > entry.plot().svg.count("<path")

    settings = odscen.GenerationSettings(map_name=MAP, seed=3, fill=0.3)
    scenario = odscen.read_scenario(odscen.generate(workspace, settings=settings)[0])
    with caplog.at_level("INFO", logger="odscen"):
        run = odscen.run(workspace, scenario, settings=odscen.RunSettings(until=30.0), name="drawn")
    assert "run drawn: completed, 30 s simulated in" in caplog.text
    bare, on_map = run.plot().svg, run.plot(entry).svg
    assert ET.fromstring(bare).tag.endswith("svg")
    assert on_map.count("<path") > bare.count("<path") + 5  # lanes and markings
    assert 'class="cell v' in bare
    size = dict(re.findall(r'(width|height)="(\d+)"', bare[:300]))
    assert int(size["width"]) == 900
    assert 100 < int(size["height"]) < 2000
    table = run.figure_table()
    (speed,) = table.filter(table["name"] == "mean_speed").iter_rows(named=True)
    assert (speed["value"], speed["unit"]) == (run.figures["mean_speed"], "m/s")
    assert set(run.figures) <= set(table["name"])
    shown = run._repr_html_()
    assert f"{run.figures['mean_speed']:.4g} m/s" in shown
    assert shown.endswith("</svg>\n")


def test_a_progress_bar_tells_of_each_run(
    workspace: odscen.Workspace, capsys: pytest.CaptureFixture[str]
) -> None:
    """On standard error, so that what a script prints stays its own; it ends with the last run."""
    settings = odscen.GenerationSettings(map_name=MAP, seed=5, count=2, fill=0.2)
    files = odscen.generate(workspace, settings=settings)
    short = odscen.RunSettings(until=10.0, recording=odscen.Recording(trajectories=False))
    odscen.run_many(workspace, files, settings=short, reporter=odscen.ProgressBar(), reports=False)
    odscen.run(workspace, files[0], settings=short, name="alone", reporter=odscen.ProgressBar())
    said = capsys.readouterr()
    assert said.out == ""
    for name in (f"{MAP}-0005", f"{MAP}-0006", "run"):
        assert re.search(rf"{name} .*100%", said.err), said.err


def test_reprs_are_short(workspace: odscen.Workspace) -> None:
    """A line each, for prompts and logs."""
    settings = odscen.GenerationSettings(map_name=MAP, seed=3)
    scenario = odscen.read_scenario(odscen.generate(workspace, settings=settings)[0])
    bare = replace(workspace.map(MAP))
    assert repr(bare) == f"<Map {MAP}: {workspace.root / 'maps' / MAP}>"
    assert "<svg xmlns" in bare._repr_svg_()[:100]
    assert f"{scenario}" == repr(scenario)
    assert repr(scenario).startswith(f"<Scenario {MAP}-0003 on {MAP}: {len(scenario.actors)} actor")
    assert len(repr(scenario)) < 100
