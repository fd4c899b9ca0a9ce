from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from odscen.app.generation import generate
from odscen.app.scenarios import read_scenario, scenario_files
from odscen.base.errors import InputError, NotFoundError
from odscen.maps.store import BUILDER, Workspace, is_outdated
from odscen.scenario.document.sampling_config import SamplingConfig
from odscen.scenario.sampling.generation_settings import GenerationSettings
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


@pytest.mark.slow
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


@pytest.mark.slow
def test_maps_are_built_anew_only_if_their_statistics_decide_which_is_drawn(
    tmp_path: Path,
) -> None:
    store = Workspace.open(tmp_path)
    for name in (CROSSING, "roundabout"):
        about = store.add_map(MAPS / f"{name}.xodr").folder / "map.json"
        (about.parent / "SHA256SUMS").unlink()
        older = json.loads(about.read_text()) | {"builder": "1"}
        older["statistics"]["crosswalks"] = 99
        about.write_text(json.dumps(older))

    def drawn(**maps: Any) -> tuple[str, list[bool]]:
        """Name of the map that is drawn, and which are of the older odscen then."""
        config = SamplingConfig.model_validate({"maps": maps})
        (path,) = generate(store, settings=GenerationSettings(config=config, seed=1, fill=0.1))
        return read_scenario(path).map.name, [is_outdated(one) for one in store.maps()]

    assert drawn(names=["round*"]) == ("roundabout", [False, True])
    assert drawn(names=["round*"], where={"crosswalks": {"max": 50}}) == (
        "roundabout",
        [False, True],
    )
    assert drawn(where={"crosswalks": {"max": 50}})[1] == [False, False]


def test_a_map_that_is_not_there_is_refused_before_anything_is_written(
    workspace: Workspace, tmp_path: Path
) -> None:
    with pytest.raises(NotFoundError, match="nowhere"):
        generate(workspace, settings=GenerationSettings(map_name="nowhere"), out=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_workspace_without_maps_says_how_to_add_one(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="maps add"):
        generate(Workspace.open(tmp_path))
