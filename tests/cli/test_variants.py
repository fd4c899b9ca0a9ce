from __future__ import annotations

import json
from pathlib import Path

import pytest

from odscen.app.maps import load_map
from odscen.app.scenarios import read_scenario, write_scenario
from odscen.maps.store import Workspace
from odscen.scenario import edits
from odscen.scenario.document.json_form import content_sha256
from odscen.scenario.forms.any_form import read_any
from odscen.scenario.forms.graph_form import to_graphml
from tests.cli.conftest import odscen

SHUT = {"id": "shut", "kind": "closure", "begin": 10, "places": ["r2"]}


def parent(workspace: Path, folder: Path) -> Path:
    graph = load_map(Workspace.open(workspace).map("signal_crossing")).sumo.graph
    scenario = edits.new_scenario(graph, name="today", roi=graph.segments.ids)
    scenario = edits.set_simulation(scenario, duration=60)
    scenario = edits.set_background(scenario, graph, background="others", trips=30)
    return write_scenario(scenario, folder / "today.scenario.json")


def shut(folder: Path) -> Path:
    file = folder / "shut.json"
    file.write_text(json.dumps([{"kind": "set_measure", "measure": SHUT}]))
    return file


@pytest.mark.slow
def test_a_variant_is_its_parent_with_the_edits_and_knows_both(
    workspace: Path, tmp_path: Path
) -> None:
    old, file = parent(workspace, tmp_path), tmp_path / "closed.scenario.json"
    call = ("variant", old, shut(tmp_path), "--set", "set_simulation.duration=90", "-o", file)
    done = odscen(*call, "--json", "--workspace", workspace)
    assert done.code == 0, done.err
    assert [words.split(" (")[0] for words in done.json["edits"]] == [
        "Measure shut",
        "Change the run's settings",
    ]
    before, made = read_scenario(old), read_scenario(file)
    assert (made.name, made.simulation.duration, made.measures[0].id) == ("closed", 90, "shut")
    assert made.demand == before.demand
    assert made.variant is not None
    assert made.variant.parent == "today"
    assert made.variant.parent_sha256 == content_sha256(before)
    assert made.variant.sha256 == content_sha256(made)
    assert odscen("check", file, "--workspace", workspace).code == 0
    text = file.read_bytes()
    assert odscen(*call, "--workspace", workspace).code == 0
    assert file.read_bytes() == text


def test_the_graph_form_keeps_parent_and_edits(workspace: Path, tmp_path: Path) -> None:
    old, file = parent(workspace, tmp_path), tmp_path / "b.scenario.json"
    odscen("variant", old, "--set", "set_seed.seed=7", "-o", file, "--workspace", workspace)
    made = read_scenario(file)
    graph = load_map(Workspace.open(workspace).map("signal_crossing")).sumo.graph
    assert made.variant is not None
    assert read_any(to_graphml(made, graph).encode()).variant == made.variant


@pytest.mark.slow
def test_a_variant_that_cannot_be_names_the_edit_and_writes_nothing(
    workspace: Path, tmp_path: Path
) -> None:
    old, out = parent(workspace, tmp_path), tmp_path / "no.scenario.json"

    def refused(*arguments: object) -> str:
        done = odscen("variant", old, *arguments, "-o", out, "--workspace", workspace)
        assert done.code == 2, done.err
        assert not out.exists()
        return done.err

    assert "give a file of edits, or --set" in refused()
    assert "'set_measures' is none of" in refused("--set", "set_measures.id=3")
    assert "write KIND.FIELD=VALUE" in refused("--set", "duration=3")
    assert "seed" in refused("--set", "set_seed.seed=-1")
    file = tmp_path / "edits.json"
    file.write_text(json.dumps([{"kind": "set_measure", "measure": {**SHUT, "places": ["r77"]}}]))
    assert "edit 1, 'Measure shut'" in refused(file)
    file.write_text("[{")
    assert "this is not JSON" in refused(file)
    file.write_text('[{"kind": "set_seed", "sed": 3}]')
    assert "edits.json: edits[0]" in refused(file)
    file.write_text('[{"kind": {"a": 1}, "seed": 3}]')
    assert "is none of" in refused(file)
    file.write_text(json.dumps([{"kind": "set_seed", "seed": n} for n in range(1001)]))
    assert "this has 1,001 edits; the limit is 1,000" in refused(file)


@pytest.mark.slow
def test_a_comparison_of_parent_and_variant_names_the_edits(
    workspace: Path, tmp_path: Path
) -> None:
    old, file = parent(workspace, tmp_path), tmp_path / "closed.scenario.json"
    odscen("variant", old, shut(tmp_path), "-o", file, "--workspace", workspace)
    for one in (old, file):
        run = ("run", one, "--seed", 3, "--out", tmp_path / one.name.split(".")[0])
        assert odscen(*run, "--workspace", workspace).code == 0
    found = odscen("compare", tmp_path / "today", tmp_path / "closed", "--json").json
    (named,) = (note for note in found["notes"] if "variant" in note)
    assert named.startswith("B is a variant of A (today): Measure shut (set_measure")
    assert not any("different names" in note for note in found["notes"])
    back = odscen("compare", tmp_path / "closed", tmp_path / "today", "--json").json
    assert any(note.startswith("A is a variant of B") for note in back["notes"])
