"""Lights of a shipped town coordinated along its main road."""

from __future__ import annotations

from xml.etree import ElementTree as ET

import pytest

from odscen.app.maps import load_map
from odscen.app.signals.green_waves import coordinate_signals
from odscen.app.signals.signal_plans import signal_programs
from odscen.base.errors import InputError
from odscen.maps.store import Workspace
from odscen.scenario import edits
from odscen.scenario.document.scenario_document import Scenario
from odscen.scenario.signals.green_wave import green_bands
from tests.signal_case import ROOT

AVENUE = ("10002", "10007", "10016", "10022", "10028", "10036")


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    store = Workspace.open(tmp_path_factory.mktemp("workspace"))
    store.add_map(ROOT / "maps" / "town_5x5.xodr")
    return store


@pytest.fixture(scope="module")
def town(workspace: Workspace) -> Scenario:
    graph = load_map(workspace.map("town_5x5")).sumo.graph
    return edits.new_scenario(graph, name="town", roi=graph.segments.ids, seed=1)


def test_lights_of_a_road_get_one_cycle_and_offsets_with_the_bands_that_are_reported(
    workspace: Workspace, town: Scenario
) -> None:
    found = coordinate_signals(workspace, town, along=["Avenue"], cycle=80.0)
    names = [one.junctions[0] for one in found.lights]
    assert names in (list(AVENUE), list(AVENUE[::-1]))
    assert min(found.out.seconds, found.back.seconds) > min(found.before)
    shown = {light.junctions[0]: light for light in signal_programs(workspace, found.scenario)}
    offsets = [shown[name].plans[0].offset for name in names]
    assert {shown[name].plans[0].cycle for name in names} == {80.0}
    assert offsets == [one.offset for one in found.lights]
    waves = [one.wave for one in found.lights]
    assert green_bands(waves, offsets, 80.0) == (found.out, found.back)
    metres = [one.metres for one in found.lights]
    assert metres == sorted(metres)
    assert waves[-1].out_time == pytest.approx(waves[0].back_time, rel=0.2)


def test_one_direction_gets_all_of_its_shortest_green(workspace: Workspace, town: Scenario) -> None:
    found = coordinate_signals(workspace, town, junctions=AVENUE, favoured="out")
    shortest = min(max(w.seconds for w in one.wave.out) for one in found.lights)
    assert found.out.seconds == pytest.approx(shortest, abs=1.0)
    fast = coordinate_signals(workspace, town, junctions=AVENUE, favoured="out", speed=5.0)
    assert fast.lights[-1].wave.out_time == pytest.approx(fast.lights[-1].metres / 5.0)


def test_the_diagram_names_lights_and_bands(workspace: Workspace, town: Scenario) -> None:
    found = coordinate_signals(workspace, town, junctions=AVENUE[:3], cycle=80.0)
    root = ET.fromstring(found.to_svg())
    words = " ".join(text.text or "" for text in root.iter("{http://www.w3.org/2000/svg}text"))
    for name in AVENUE[:3]:
        assert name in words
    assert "% of 80 s" in words


def test_a_light_between_and_a_cycle_too_short_are_refused(
    workspace: Workspace, town: Scenario
) -> None:
    with pytest.raises(InputError, match="junction 10007 lies between those of 10002 and 10016"):
        coordinate_signals(workspace, town, junctions=["10002", "10016"])
    with pytest.raises(InputError, match="needs a cycle of"):
        coordinate_signals(workspace, town, junctions=AVENUE, cycle=20.0)
