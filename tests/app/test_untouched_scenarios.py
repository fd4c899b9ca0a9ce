"""A scenario that nobody has touched has no problems: a list of them would make people doubt it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from odscen.app.generation import generate
from odscen.app.running.runs import check_file
from odscen.maps.shipped import shipped_maps
from odscen.maps.store import Workspace
from odscen.scenario.sampling.generation_settings import GenerationSettings

if TYPE_CHECKING:
    from pathlib import Path

MAPS = {path.stem: path for path in shipped_maps()}


@pytest.mark.parametrize("name", ["roundabout", "rural_hills", "town_5x5"])
def test_sampled_scenarios_have_no_warnings(name: str, tmp_path: Path) -> None:
    workspace = Workspace.open(tmp_path / "workspace")
    workspace.add_map(MAPS[name])
    settings = GenerationSettings(map_name=name, count=3, seed=7, fill=0.4)
    for path in generate(workspace, settings=settings):
        checked = check_file(workspace, path)
        assert len(checked.scenario.actors) > 3
        assert [problem.message for problem in checked.warnings] == []
