"""Scenarios to arrays and back on real maps, by Python and by the command line's steps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import odscen
from odscen.app.exchange.exports import export
from odscen.app.exchange.imports import import_file
from odscen.app.template_scenarios import template_scenario
from odscen.base.errors import InputError, NotFoundError
from odscen.maps.store import Workspace
from odscen.scenario.document.json_form import dumps
from odscen.scenario.templates.template_registry import TEMPLATES
from tests.app.conftest import CROSSING


@pytest.mark.slow
def test_a_sampled_scenario_comes_back_byte_for_byte_from_a_file(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    (file,) = export(workspace, sampled, tmp_path, to="arrays")
    scenario = odscen.scenario_from_arrays(odscen.read_arrays(file))
    assert dumps(scenario).encode() == sampled.read_bytes()
    assert odscen.read_scenario(file) == scenario
    assert file.name == f"{sampled.name.removesuffix('.scenario.json')}.npz"
    (same,) = export(workspace, sampled, tmp_path / "pyg", to="pyg")
    assert same.read_bytes() == file.read_bytes()


def test_all_starts_and_goals_of_a_sampled_scenario_are_nodes_of_its_graph(
    workspace: Workspace, sampled: Path
) -> None:
    arrays = odscen.scenario_arrays(workspace, sampled)
    assert len(arrays["actor_id"]) > 10
    assert (arrays["actor_node"] >= 0).all()
    assert (arrays["actor_goal"] >= 0).all()
    graph = workspace.map(CROSSING).graph()
    on_road = arrays["actor_category"] < 6
    place = arrays["node_x"][arrays["actor_node"][on_road]]
    assert np.array_equal(place, graph.lanes.x[arrays["actor_node"][on_road]])


@pytest.mark.parametrize("template", TEMPLATES)
def test_templates_come_back_byte_for_byte(workspace: Workspace, template: str) -> None:
    try:
        scenario = template_scenario(workspace, template, CROSSING)
    except InputError:
        pytest.skip(f"{CROSSING} has no room for {template}")
    arrays = odscen.scenario_arrays(workspace, scenario)
    assert dumps(odscen.scenario_from_arrays(arrays)) == dumps(scenario)


def test_what_openscenario_files_become_comes_back_byte_for_byte(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    files = export(workspace, sampled, tmp_path, to="openscenario")
    (xosc,) = (one for one in files if one.suffix == ".xosc")
    scenario = import_file(workspace, xosc).scenario
    assert len(scenario.actors) > 10
    arrays = odscen.scenario_arrays(workspace, scenario)
    assert dumps(odscen.scenario_from_arrays(arrays)) == dumps(scenario)


def test_a_learner_slows_everybody_down_and_the_checks_accept_it(
    workspace: Workspace, sampled: Path
) -> None:
    arrays = odscen.scenario_arrays(workspace, sampled)
    speed = arrays["actor_speed"].astype(np.float32)  # as tensors have it
    changed = odscen.scenario_from_arrays({**arrays, "actor_speed": speed * 0.9})
    before = odscen.read_scenario(sampled)
    assert [one.speed for one in changed.actors] == pytest.approx(
        [0.9 * one.speed for one in before.actors if one.speed], rel=1e-6
    )
    assert not [one for one in odscen.check(workspace, changed) if one.severity == "error"]


def test_a_learner_who_puts_one_road_user_on_another_is_told_by_the_checks(
    workspace: Workspace, sampled: Path
) -> None:
    arrays = odscen.scenario_arrays(workspace, sampled)
    arrays["actor_node"][1] = arrays["actor_node"][0]
    problems = odscen.check(workspace, odscen.scenario_from_arrays(arrays))
    assert "node_taken" in {one.code for one in problems if one.severity == "error"}


def test_arrays_of_a_run_are_no_scenario(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", about=np.array('{"format": "odscen-arrays", "version": 1}'))
    with pytest.raises(InputError, match="array about: these are odscen-arrays 1, not odscen-scen"):
        odscen.read_scenario(tmp_path / "a.npz")


def test_a_map_that_the_workspace_does_not_have_is_named(sampled: Path, tmp_path: Path) -> None:
    with pytest.raises(NotFoundError, match=CROSSING):
        odscen.scenario_arrays(Workspace.open(tmp_path), sampled)
