from __future__ import annotations

from pathlib import Path

import pytest

from odscen.app.scenarios import generate, read_scenario, scenario_files
from odscen.base.errors import InputError, NotFoundError
from odscen.scenario.sampling.generation_settings import GenerationSettings
from odscen.workspace.store import BUILDER, Workspace
from tests.app.conftest import CROSSING, MAPS


def test_each_of_several_scenarios_can_be_made_again_alone(
    workspace: Workspace, tmp_path: Path
) -> None:
    three = GenerationSettings(map_name=CROSSING, count=3, seed=7, fill=0.1)
    alone = GenerationSettings(map_name=CROSSING, seed=8, fill=0.1)
    made = generate(workspace, settings=three, out=tmp_path / "three")
    (second,) = generate(workspace, settings=alone, out=tmp_path / "alone")
    assert [read_scenario(path).seed for path in made] == [7, 8, 9]
    assert made[1].read_bytes() == second.read_bytes()
    assert scenario_files([tmp_path / "three"]) == made


def test_a_map_that_is_named_is_the_only_one_that_is_read(
    workspace: Workspace, tmp_path: Path
) -> None:
    """Others may be large, and be built anew once they are read by a newer odscen."""
    store = Workspace.open(tmp_path / "two")
    for name in (CROSSING, "roundabout"):
        store.add_map(MAPS / f"{name}.xodr")
    about = store.root / "maps" / "roundabout" / "map.json"
    older = about.read_text().replace(f'"builder": "{BUILDER}"', '"builder": "1"')
    assert older != about.read_text()
    about.write_text(older)
    settings = GenerationSettings(map_name=CROSSING, seed=7, fill=0.1)
    (path,) = generate(store, settings=settings)
    assert about.read_text() == older
    (same,) = generate(workspace, settings=settings, out=tmp_path / "same")
    assert path.read_bytes() == same.read_bytes()


def test_a_map_that_is_not_there_is_refused_before_anything_is_written(
    workspace: Workspace, tmp_path: Path
) -> None:
    with pytest.raises(NotFoundError, match="nowhere"):
        generate(workspace, settings=GenerationSettings(map_name="nowhere"), out=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_workspace_without_maps_says_how_to_add_one(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="maps add"):
        generate(Workspace.open(tmp_path))
