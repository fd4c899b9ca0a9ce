"""Both converters on the shipped maps: what a map gives, and that it can be run."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from odscen.app.generation import generate
from odscen.app.running.runs import run
from odscen.app.scenarios import check_scenario
from odscen.base.checksums import sums_of, write_sums
from odscen.base.errors import InputError, ToolError
from odscen.convert.model.conversion_settings import ConversionSettings
from odscen.maps import store
from odscen.maps.store import Workspace
from odscen.scenario.sampling.generation_settings import GenerationSettings

if TYPE_CHECKING:
    from odscen.convert.model.conversion_settings import ConverterName

MAPS = Path(__file__).parents[2] / "maps"
CROSSING = MAPS / "signal_crossing.xodr"
NETCONVERT = ConversionSettings(converter="netconvert")
NAMES = tuple(sorted(path.stem for path in MAPS.glob("*.xodr")))


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    """Has each shipped map with a network by netconvert."""
    found = Workspace.open(tmp_path_factory.mktemp("workspace"))
    for name in NAMES:
        found.add_map(MAPS / f"{name}.xodr", settings=NETCONVERT)
    return found


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_every_map_has_lanes_of_netconvert_nearly_everywhere(
    workspace: Workspace, name: str
) -> None:
    entry = workspace.map(name)
    figures = entry.info["report"]["figures"]
    for where in ("road", "junction"):
        assert figures[f"driving_{where}_covered"] > 0.99 * figures[f"driving_{where}_length"]
    assert entry.converter == "netconvert"
    assert entry.fidelity().normal.p50 < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_sampled_scenarios_run_to_their_end_on_netconverts_network(
    workspace: Workspace, name: str, tmp_path: Path
) -> None:
    settings = GenerationSettings(map_name=name, seed=2, fill=0.3)
    (file,) = generate(workspace, settings=settings, out=tmp_path)
    assert not [one for one in check_scenario(workspace, file) if one.severity == "error"]
    summary = run(workspace, file, out=tmp_path / "runs").summary
    counts = summary["actors"]
    assert summary["status"] == "completed"
    assert counts["arrived"] == counts["planned"] > 5
    assert counts["teleported"] == 0
    assert summary["insertion_error_max"] < 0.25
    assert counts["collided"] <= 2


@pytest.mark.slow
def test_lights_by_netconvert_are_named_by_their_junctions(workspace: Workspace) -> None:
    (light,) = workspace.map("signal_crossing").info["lights"]
    assert light["junctions"] == ["10001"]
    assert len(light["green"]) >= 2
    assert len(light["signals"]) >= 8


@pytest.mark.slow
def test_maps_keep_their_converter_until_another_is_named(tmp_path: Path) -> None:
    place = Workspace.open(tmp_path)
    assert place.add_map(CROSSING).converter == "odscen"
    made = place.add_map(CROSSING, settings=NETCONVERT)
    assert made.converter == "netconvert"
    assert place.add_map(CROSSING) == made
    back = place.add_map(CROSSING, settings=ConversionSettings(converter="odscen"))
    assert (back.converter, back == made) == ("odscen", False)


@pytest.mark.slow
def test_a_map_built_by_an_older_odscen_is_rebuilt_by_its_own_converter(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = Workspace.open(tmp_path)
    made = place.add_map(CROSSING, settings=NETCONVERT)
    monkeypatch.setattr(store, "BUILDER", "later")
    again = place.map("signal_crossing")
    assert again.info["builder"] == "later"
    assert (again.converter, again.net_sha256) == ("netconvert", made.net_sha256)


def test_a_map_without_a_mention_of_a_converter_is_odscens(tmp_path: Path) -> None:
    entry = Workspace.open(tmp_path).add_map(CROSSING)
    info = json.loads((entry.folder / "map.json").read_text())
    del info["network"]
    (entry.folder / "map.json").write_text(json.dumps(info))
    write_sums(entry.folder, sums_of(entry.folder))
    assert Workspace.open(tmp_path).map("signal_crossing").converter == "odscen"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("converter", "expected"), [("netconvert", ToolError), ("file", InputError)]
)
def test_what_a_converter_cannot_do_leaves_the_map_as_it_was(
    tmp_path: Path, converter: ConverterName, expected: type[Exception]
) -> None:
    place = Workspace.open(tmp_path / "workspace")
    strange = tmp_path / "strange.xodr"
    # An empty type is valid OpenDRIVE in practice, but none for netconvert.
    strange.write_text(CROSSING.read_text().replace('type="1000001"', 'type=""'))
    before = place.add_map(strange)
    with pytest.raises(expected):
        place.add_map(strange, settings=ConversionSettings(converter=converter))
    assert place.map("strange") == before
