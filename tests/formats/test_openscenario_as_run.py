"""Runs as OpenSCENARIO: everybody where they were, and what lights showed."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from lxml import etree

from odscen.app.exchange.exports import export, export_run
from odscen.base.errors import InputError
from odscen.formats.openscenario import xosc_as_run
from odscen.formats.openscenario.dialect import VERSIONS
from odscen.runs.finished_run import Run
from odscen.runs.recorded import read_light_states
from tests.sumo.story_case import document, loaded, node_at, run, walk_node_at, workspace

if TYPE_CHECKING:
    from odscen.scenario.document.scenario_document import Scenario

TOWN = "town_5x5"
QC = Path(__file__).parents[2] / "build" / "qc"
LATE = 4.0


def scenario(**parts: Any) -> Scenario:
    goal = node_at(TOWN, 390.0, 103.4)
    actors: list[dict[str, Any]] = [
        {"id": "ego", "category": "car", "spawn": node_at(TOWN, 215.0, 103.4), "ego": True,
         "goal": goal, "initial_speed": 8.0},
        {"id": "late", "category": "bus", "spawn": node_at(TOWN, 300.0, 103.4), "depart": LATE,
         "goal": goal},
        {"id": "child", "category": "pedestrian", "spawn": walk_node_at(TOWN, 270.0, 100.5),
         "goal": walk_node_at(TOWN, 240.0, 109.5)},
    ]  # fmt: skip
    vanish = {"id": "gone", "actor": "ego", "when": {"time": {"after": 6.0}},
              "then": [{"vanish": {}}]}  # fmt: skip
    return document(TOWN, actors, [vanish], flows=[], **parts)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return run(scenario(until=30.0), tmp_path_factory.mktemp("ran") / "ran").folder


@cache
def written(folder: Path, version: str) -> Path:
    out = folder.parent / version
    files = export_run(workspace(), folder, out, to="openscenario", options={"version": version})
    (file,) = (path for path in files if path.suffix == ".xosc")
    return file


@pytest.fixture(scope="module")
def tree(folder: Path) -> Any:
    return etree.parse(written(folder, "1.2"))


@pytest.mark.slow
def test_everybody_goes_where_their_body_was_at_each_recorded_time(folder: Path, tree: Any) -> None:
    rows = Run.open(folder).trajectories()
    for name in ("ego", "late", "child"):
        own = {row["time"]: row for row in rows.to_dicts() if row["id"] == name}
        box = tree.find(f'.//ScenarioObject[@name="{name}"]//Center')
        ahead = float(box.get("x"))
        assert (ahead == 0.0) == (name == "child")
        vertices = tree.findall(f'.//ManeuverGroup[@name="{name}"]//Vertex')
        assert len(vertices) > 10
        assert float(vertices[-1].get("time")) == pytest.approx(max(own))
        for vertex in vertices:
            at, there = vertex.find(".//WorldPosition"), own[float(vertex.get("time"))]
            hdg = float(at.get("h"))
            assert float(at.get("x")) + ahead * math.cos(hdg) == pytest.approx(there["x"], abs=1e-4)
            assert float(at.get("y")) + ahead * math.sin(hdg) == pytest.approx(there["y"], abs=1e-4)
    timings = {one.get("domainAbsoluteRelative") for one in tree.iterfind(".//Timing")}
    assert timings == {"absolute"}


@pytest.mark.slow
def test_who_departs_later_is_added_then_and_who_leaves_is_deleted(tree: Any) -> None:
    added = {one.getparent().get("entityRef") for one in tree.iterfind(".//AddEntityAction")}
    placed = {one.get("entityRef") for one in tree.iterfind(".//Private")}
    assert "late" in added
    assert added | placed == {"ego", "late", "child"}
    assert not added & placed
    begin = tree.find('.//Event[@name="late moves"]//SimulationTimeCondition')
    assert LATE <= float(begin.get("value")) <= LATE + 0.2
    end = tree.find('.//Event[@name="ego is gone"]')
    assert end.find(".//DeleteEntityAction").getparent().get("entityRef") == "ego"
    assert 6.0 <= float(end.find(".//SimulationTimeCondition").get("value")) <= 6.3


def test_signals_show_what_the_lights_of_the_run_showed(folder: Path, tree: Any) -> None:
    states = read_light_states(folder)
    assert states is not None
    light = next(one for one in loaded(TOWN).sumo.lights if any(one.signals))
    link = next(index for index, own in enumerate(light.signals) if own)
    signal = light.signals[link][0]
    links = [index for index, own in enumerate(light.signals) if signal in own]
    colour = {"G": "green", "g": "green", "y": "yellow", "r": "red", "s": "red"}
    wanted: list[str] = []
    for row in states.filter(states["light"] == light.id).sort("time").to_dicts():
        shown = {colour[row["state"][index]] for index in links}
        best = next(one for one in ("green", "yellow", "red") if one in shown)
        if wanted[-1:] != [best]:
            wanted.append(best)
    found = [
        one.get("state")
        for one in tree.iterfind(".//TrafficSignalStateAction")
        if one.get("name") == signal
    ]
    lamps = {"green": "off;off;on", "yellow": "off;on;off", "red": "on;off;off"}
    assert found == [lamps[colour] for colour in wanted]


@pytest.mark.parametrize("version", VERSIONS)
def test_the_file_is_valid(folder: Path, version: str) -> None:
    found = list(QC.glob(f"lib/python*/site-packages/qc_openscenario/schema/{version}.0/*.xsd"))
    if not found:
        pytest.skip("asam-qc-openscenarioxml is not here; `make check-maps` installs it")
    etree.XMLSchema(etree.parse(found[0])).assertValid(etree.parse(written(folder, version)))


def test_the_same_run_gives_the_same_bytes(folder: Path, tmp_path: Path) -> None:
    again = export_run(workspace(), folder, tmp_path, to="openscenario", options={"version": "1.2"})
    (file,) = (path for path in again if path.suffix == ".xosc")
    assert file.read_bytes() == written(folder, "1.2").read_bytes()


def test_what_cannot_be_written_is_refused_before_anything_is(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(InputError, match="the format sumo cannot say what happened in a run"):
        export_run(workspace(), folder, tmp_path / "x", to="sumo")
    with pytest.raises(InputError, match="nothing"):
        export_run(workspace(), tmp_path / "nothing", tmp_path / "x", to="openscenario")
    monkeypatch.setattr(xosc_as_run, "MOST_POINTS", 10)
    with pytest.raises(InputError, match="a file has 1 to 10"):
        export_run(workspace(), folder, tmp_path / "x", to="openscenario")
    assert not (tmp_path / "x").exists()


@pytest.mark.parametrize("version", ["1.0", "1.2"])
def test_a_scenario_that_says_nothing_of_weather_writes_none_but_for_scenario_runner(
    tmp_path: Path, version: str
) -> None:
    files = export(
        workspace(), scenario(), tmp_path, to="openscenario", options={"version": version}
    )
    (file,) = (path for path in files if path.suffix == ".xosc")
    found = etree.parse(file).find(".//EnvironmentAction")
    assert (found is not None) == (version == "1.0")


@pytest.mark.parametrize(
    ("preset", "clock", "time"),
    [
        ("WetNoon", 0.0, "12:00:00"),
        ("ClearSunset", 0.0, "18:00:00"),
        ("ClearNight", 0.0, "00:00:00"),
        ("ClearNoon", 27_000.0, "07:30:00"),
    ],
)
def test_the_time_of_day_is_the_scenarios_or_that_of_its_weather(
    tmp_path: Path, preset: str, clock: float, time: str
) -> None:
    given = scenario(environment={"preset": preset}, demand={"clock": clock})
    files = export(workspace(), given, tmp_path, to="openscenario")
    (file,) = (path for path in files if path.suffix == ".xosc")
    day = etree.parse(file).find(".//TimeOfDay")
    assert day is not None
    assert str(day.get("dateTime")).endswith(f"T{time}")
