"""Lights of a shipped town coordinated along its main road."""

from __future__ import annotations

from xml.etree import ElementTree as ET

import pytest

from odscen.app.maps import load_map
from odscen.app.signals.green_waves import (
    CoordinatedLight,
    Coordination,
    coordinate_signals,
)
from odscen.app.signals.signal_plans import signal_programs
from odscen.base.errors import InputError
from odscen.maps.store import Workspace
from odscen.scenario import edits
from odscen.scenario.checks.signal_checks import signal_problems
from odscen.scenario.document.scenario_document import Scenario
from odscen.scenario.signals.green_wave import (
    LEAST_BAND,
    GreenWindow,
    WaveLight,
    green_bands,
    widest_offsets,
)
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


@pytest.mark.slow
def test_lights_of_a_road_get_one_cycle_and_offsets_with_the_bands_that_are_reported(
    workspace: Workspace, town: Scenario
) -> None:
    found = coordinate_signals(workspace, town, along=["Avenue"], cycle=80.0)
    names = [one.junctions[0] for one in found.lights]
    assert names in (list(AVENUE), list(AVENUE[::-1]))
    # Both directions together would get bands of a few seconds: one has a wide one instead.
    assert max(found.out.seconds, found.back.seconds) > max(20.0, *found.before)
    assert found.worth_it
    assert [words.partition(":")[0] for words in found.doubts] == ["There is no green wave along"]
    shown = {light.junctions[0]: light for light in signal_programs(workspace, found.scenario)}
    offsets = [shown[name].plans[0].offset for name in names]
    assert {shown[name].plans[0].cycle for name in names} == {80.0}
    assert offsets == [one.offset for one in found.lights]
    waves = [one.wave for one in found.lights]
    assert green_bands(waves, offsets, 80.0) == (found.out, found.back)
    metres = [one.metres for one in found.lights]
    assert metres == sorted(metres)
    assert waves[-1].out_time == pytest.approx(waves[0].back_time, rel=0.2)


@pytest.mark.slow
def test_one_direction_gets_all_of_its_shortest_green(workspace: Workspace, town: Scenario) -> None:
    found = coordinate_signals(workspace, town, junctions=AVENUE, favoured="out")
    shortest = min(max(w.seconds for w in one.wave.out) for one in found.lights)
    assert found.out.seconds == pytest.approx(shortest, abs=1.0)
    fast = coordinate_signals(workspace, town, junctions=AVENUE, favoured="out", speed=5.0)
    assert fast.lights[-1].wave.out_time == pytest.approx(fast.lights[-1].metres / 5.0)


def test_two_narrow_bands_give_way_to_a_wide_one_and_none_is_said_to_be_none() -> None:
    def light(metres: float, green: float) -> WaveLight:
        window = (GreenWindow(0.0, green),)
        return WaveLight(window, window, metres / 10.0, (900.0 - metres) / 10.0)

    # Every 300 m, 10 m/s, a cycle of 60 s: both directions meet a quarter of a cycle off.
    lights = [light(metres, 20.0) for metres in (0.0, 150.0, 300.0, 450.0, 900.0)]
    bands = green_bands(lights, widest_offsets(lights, 60.0), 60.0)
    assert max(band.seconds for band in bands) >= LEAST_BAND
    short = [light(metres, 4.0) for metres in (0.0, 150.0, 300.0)]
    offsets = widest_offsets(short, 60.0)
    out, back = green_bands(short, offsets, 60.0)
    parts = tuple(
        CoordinatedLight((str(n),), one.out_time, offset, one)
        for n, (one, offset) in enumerate(zip(short, offsets, strict=True))
    )
    none = Coordination(Scenario.model_construct(), 60.0, parts, out, back, (0.0, 0.0))
    assert not none.worth_it
    assert none.to_words()[-1].startswith("There is no green wave: neither direction")


@pytest.mark.slow
def test_lights_with_bus_priority_keep_it_in_a_green_wave(
    workspace: Workspace, town: Scenario
) -> None:
    signals = town.signals.model_copy(update={"bus_priority": True})
    one = town.model_copy(update={"signals": signals})
    found = coordinate_signals(workspace, one, junctions=AVENUE[:3], favoured="out")
    timings = {timing.junction: timing for timing in found.scenario.signals.junctions}
    for name in AVENUE[:3]:
        assert timings[name].control == "actuated"
        assert timings[name].cycle == found.cycle
        assert timings[name].bus_priority is True
    loaded = load_map(workspace.map("town_5x5"))
    codes = {problem.code for problem in signal_problems(found.scenario.signals, loaded.lights)}
    assert not codes & {"offset_lost_to_buses", "bus_priority_needs_actuation"}
    shown = {light.junctions[0]: light for light in signal_programs(workspace, found.scenario)}
    assert {shown[name].plans[0].cycle for name in AVENUE[:3]} == {found.cycle}


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
