from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from odscen.app.exchange.exports import export
from odscen.app.scenarios import read_scenario, write_scenario
from odscen.base.errors import NotFoundError, ScenarioError, WorkspaceError
from odscen.maps.store import Workspace


@pytest.mark.parametrize("to", ["arrays", "graphml", "openscenario", "pyg", "sumo"])
def test_every_format_of_scenarios_writes_files_and_the_same_ones_each_time(
    to: str, workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    one, other = (export(workspace, sampled, tmp_path / name, to=to) for name in ("a", "b"))
    assert one
    assert [path.name for path in one] == [path.name for path in other]
    assert [path.read_bytes() for path in one] == [path.read_bytes() for path in other]


def test_the_graph_form_has_the_name_of_the_scenario_and_reads_back_as_it(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    (file,) = export(workspace, sampled, tmp_path, to="graphml")
    assert file.name == sampled.name.replace(".scenario.json", ".graphml")
    assert read_scenario(file) == read_scenario(sampled)


def test_a_scenario_with_errors_is_not_written_for_sumo(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    scenario = read_scenario(sampled)
    twice = scenario.model_copy(update={"actors": (*scenario.actors, scenario.actors[0])})
    file = write_scenario(twice, tmp_path / "broken.json")
    with pytest.raises(ScenarioError):
        export(workspace, file, tmp_path / "out", to="sumo")
    assert not (tmp_path / "out").exists()


def test_an_unknown_format_is_refused_with_those_there_are(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    with pytest.raises(NotFoundError, match="sumo"):
        export(workspace, sampled, tmp_path, to="summo")


def test_a_folder_that_cannot_be_made_is_named(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    (tmp_path / "taken").write_text("a file")
    with pytest.raises(WorkspaceError, match="taken"):
        export(workspace, sampled, tmp_path / "taken", to="graphml")


def test_listing_the_formats_imports_nothing_heavy() -> None:
    script = (
        "import sys; from odscen.formats import list_formats; assert list_formats()\n"
        "assert not {'numpy', 'pydantic', 'polars', 'networkx'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", script], check=True)
