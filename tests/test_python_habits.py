"""What people write in scripts and notebooks: paths as text, types that are wrong, short reprs."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

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
        ({"recording": "none"}, "recording must be an odscen.Recording, not 'none'"),
    ],
)
def test_values_of_other_types_are_refused_where_they_are_given(
    wrong: dict[str, Any], words: str
) -> None:
    """At construction, by name and value: not by an error of Python's in the middle of a run."""
    with pytest.raises(odscen.InputError, match=words):
        odscen.RunSettings(**wrong)


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
