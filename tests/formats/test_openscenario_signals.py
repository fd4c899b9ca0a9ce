"""Traffic lights in an export: controllers that show what a run shows, and signals in rules."""

from __future__ import annotations

import json
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import pytest
from lxml import etree

from bench.osc_export import QC, checked, schema
from odscen.app.exchange.exports import export
from odscen.app.template_scenarios import template_scenario
from odscen.formats.openscenario.dialect import VERSIONS
from odscen.formats.openscenario.xosc_signals import from_the_start
from odscen.records.light_programs import ProgramPhase, ShownPlan
from odscen.runs.recorded import read_light_states
from tests.sumo.story_case import document, entry, loaded, node_at, run, workspace

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.scenario.document.scenario_document import Scenario

TOWN, CROSSING = "town_5x5", "signal_crossing"
GREEN, YELLOW, RED = "off;off;on", "off;on;off", "on;off;off"
"""Lamps from the top, as esmini takes them."""
COLOURS = {"G": GREEN, "g": GREEN, "y": YELLOW, "r": RED, "s": RED, "u": YELLOW}


def scenario(**parts: Any) -> Scenario:
    behind, spawn = (node_at(TOWN, x, 103.4) for x in (215.0, 240.0))
    goal = node_at(TOWN, 390.0, 103.4)
    ego = {"id": "ego", "category": "car", "spawn": spawn, "goal": goal, "ego": True}
    late = ego | {
        "id": "late",
        "ego": False,
        "depart": 90.0,
        "spawn": behind,
    }  # until then the run lasts
    return document(TOWN, [ego, late], parts.pop("rules", []), flows=[], **parts)


def exported(given: Scenario, folder: Path, version: str = "1.2") -> tuple[Any, dict[str, Any]]:
    files = export(workspace(), given, folder, to="openscenario", options={"version": version})
    (file,) = (one for one in files if one.suffix == ".xosc")
    (notes,) = (one for one in files if one.name.endswith(".export.json"))
    return etree.parse(file), json.loads(notes.read_text(encoding="utf-8"))


def shown(controller: Any, signal: str, time: float) -> str:
    """State of a signal at a time of a controller that begins at 0."""
    phases = controller.findall("Phase")
    at = time % sum(float(one.get("duration")) for one in phases)
    for phase in phases:
        at -= float(phase.get("duration"))
        if at < 0:
            break
    state = phase.find(f'TrafficSignalState[@trafficSignalId="{signal}"]')
    return str(state.get("state"))


@pytest.mark.slow
@pytest.mark.parametrize("offset", [0.0, 17.0])
def test_controllers_show_at_each_time_what_the_lights_of_a_run_show(
    tmp_path: Path, offset: float
) -> None:
    light = next(one for one in loaded(TOWN).sumo.lights if any(one.signals))
    timing = {"junction": str(light.junctions[0]), "offset": offset}
    given = scenario(signals={"junctions": [timing]} if offset else {}, until=95.0)
    tree, notes = exported(given, tmp_path / "out")
    controller = tree.find(f'.//TrafficSignalController[@name="{light.junctions[0]}"]')
    states = read_light_states(run(given, tmp_path / "ran").folder)
    assert states is not None
    rows = states.filter(states["light"] == light.id).sort("time").to_dicts()
    compared = 0
    for row, after in pairwise(rows):
        for link, names in enumerate(light.signals):
            others = {row["state"][n] for n, own in enumerate(light.signals) if own == names}
            if names and len({COLOURS[one] for one in others}) == 1:
                middle = (row["time"] + after["time"]) / 2.0
                assert shown(controller, names[0], middle) == COLOURS[row["state"][link]]
                compared += 1
    assert compared > 20
    assert not [one for one in notes["approximated"] if "signals" in one["place"]]


def test_each_light_with_signals_has_a_controller_whose_phases_have_names_of_their_own(
    tmp_path: Path,
) -> None:
    tree, _ = exported(scenario(), tmp_path)
    lights = [one for one in loaded(TOWN).sumo.lights if any(one.signals)]
    found = tree.findall(".//TrafficSignals/TrafficSignalController")
    assert [one.get("name") for one in found] == [str(one.junctions[0]) for one in lights]
    for controller, light in zip(found, lights, strict=True):
        names = [one.get("name") for one in controller]
        assert len(set(names)) == len(names) >= len(light.phases)
        total = sum(float(one.get("duration")) for one in controller)
        assert total == pytest.approx(sum(phase.duration for phase in light.phases))
        signals = {signal for own in light.signals for signal in own}
        for phase in controller:
            assert {one.get("trafficSignalId") for one in phase} == signals


def test_greens_that_traffic_prolongs_are_listed_as_planned(tmp_path: Path) -> None:
    _, notes = exported(scenario(signals={"control": "actuated"}), tmp_path)
    listed = [one for one in notes["approximated"] if one["place"].startswith("signals of")]
    assert listed
    assert {one["reason"] for one in listed} == {
        "each green as long as planned: nothing prolongs it"
    }


def test_a_program_that_began_before_is_turned_to_the_start() -> None:
    phases = (
        ProgramPhase(30.0, "G", "a"),
        ProgramPhase(3.0, "y", "b"),
        ProgramPhase(7.0, "r", "c"),
    )
    turned = from_the_start(ShownPlan("p", 12.0, phases))
    assert [(one.name, one.seconds) for one in turned] == [
        ("a", 2.0), ("b", 3.0), ("c", 7.0), ("a", 28.0),
    ]  # fmt: skip
    assert from_the_start(ShownPlan("p", 0.0, phases)) == phases
    assert from_the_start(ShownPlan("p", 10.0, phases))[0].name == "b"


def test_rules_wait_for_the_signal_over_a_movement_and_switch_its_controller(
    tmp_path: Path,
) -> None:
    entry(CROSSING)
    given = template_scenario(workspace(), "red-light", CROSSING)
    tree, notes = exported(given, tmp_path / "out")
    condition = tree.find(".//TrafficSignalCondition")
    assert condition.get("state") == GREEN
    (waits,) = (rule for rule in given.rules if rule.id == "green")
    assert waits.when.all is not None
    signal = waits.when.all[1].signal
    assert signal is not None
    assert not [one for one in notes["left_out"] if one["place"].startswith("rules")]
    ids = {one for light in loaded(CROSSING).sumo.lights for own in light.signals for one in own}
    assert condition.get("name") in ids
    switch = {"light": signal.light, "movement": signal.movement}
    rules = [
        {"id": name, "actor": "ego", "when": {"time": {"after": 2.0}}, "then": [{"signal": part}]}
        for name, part in (("on", switch), ("off", {"light": signal.light, "shows": "off"}))
    ]
    switched = given.model_validate(given.model_dump(exclude_unset=True) | {"rules": rules})
    tree, _ = exported(switched, tmp_path / "switched", "1.3")
    action = tree.find(".//TrafficSignalControllerAction")
    controller = tree.find(
        f'.//TrafficSignalController[@name="{action.get("trafficSignalControllerRef")}"]'
    )
    phase = controller.find(f'Phase[@name="{action.get("phase")}"]')
    state = phase.find(f'TrafficSignalState[@trafficSignalId="{condition.get("name")}"]')
    assert state.get("state") == GREEN
    off = tree.findall(".//TrafficSignalStateAction")
    assert {one.get("state") for one in off} == {"off;off;off"}
    assert {one.get("name") for one in off} == ids


def test_a_map_without_lights_has_no_controllers(tmp_path: Path) -> None:
    entry("motorway_weave")
    given = template_scenario(workspace(), "cut-in", "motorway_weave")
    tree, _ = exported(given, tmp_path)
    assert tree.find(".//TrafficSignals") is None


@pytest.mark.parametrize("version", VERSIONS)
def test_files_with_lights_are_valid_and_asams_checks_find_nothing(
    tmp_path: Path, version: str
) -> None:
    if not (QC / "bin" / "qc_openscenario").exists():
        pytest.skip("asam-qc-openscenarioxml is not here; `make check-maps` installs it")
    entry(CROSSING)
    given = template_scenario(workspace(), "red-light", CROSSING)
    exported(given, tmp_path, version)
    (file,) = tmp_path.glob("*.xosc")
    assert schema(version).validate(etree.parse(file))
    checks, issues = checked(file)
    assert checks >= 5
    assert issues == []
