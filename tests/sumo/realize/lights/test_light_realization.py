"""Programs of the engineer as SUMO runs them, from plain ``sumo`` on the exported files."""

from __future__ import annotations

import subprocess
from itertools import groupby, pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import polars as pl
import pytest
from lxml import etree

from odscen.records.light_programs import programs_from_json, programs_to_json
from odscen.scenario.signals.program_design import DesignedProgram, cycle_length
from odscen.sumo.realize.lights.light_realization import realized_lights
from odscen.sumo.realize.lights.program_files import signals_xml
from odscen.sumo.runner.prepare import prepare
from odscen.sumo.runner.run_folder import write_sumo_files
from tests.signal_case import (
    carried_out,
    crossing,
    entries,
    light,
    one_plan,
    program,
    scenario,
    timing,
)
from tests.sumo.conftest import BIN

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.scenario.document.scenario_document import Scenario


class Shown(NamedTuple):
    """What was shown from a second on, and for how long; and what SUMO said."""

    begin: float
    seconds: float
    program: str
    name: str
    state: str


def shown(folder: Path, one: Scenario) -> list[Shown]:
    """States of the light one after the other; SUMO says nothing of lights."""
    folder.mkdir(exist_ok=True)
    prepared = prepare(one, crossing().sumo, crossing().net(folder))
    write_sumo_files(prepared.sumo_files, prepared.net, folder, link=False)
    watch = '<timedEvent type="SaveTLSStates" source="J10001" dest="states.xml"/>'
    (folder / "watch.add.xml").write_text(f"<additional>{watch}</additional>")
    added = [name for name in prepared.sumo_files if name.endswith(".add.xml")]
    done = subprocess.run(
        [BIN / "sumo", "-c", "scenario.sumocfg", "-a", ",".join([*added, "watch.add.xml"])],
        cwd=folder, check=True, capture_output=True, text=True,
    )  # fmt: skip
    assert "tlLogic" not in done.stderr
    assert "detector" not in done.stderr
    rows = etree.parse(folder / "states.xml").getroot().iterfind("tlsState")
    seen = [
        (float(r.get("time", "")), (r.get("programID", ""), r.get("name", ""), r.get("state", "")))
        for r in rows
    ]
    parts = [(key, [time for time, _ in same]) for key, same in groupby(seen, lambda row: row[1])]
    return [Shown(times[0], len(times) * 0.5, *key) for key, times in parts]


def stages(seen: list[Shown]) -> list[str]:
    """Names of the stages in their order."""
    names = [one.name for one in seen if one.name.startswith("stage ")]
    return [name.removeprefix("stage ") for name in names]


def without_call(**changes: Any) -> dict[str, Any]:
    return one_plan(stages=[{**s, "on_call": False} for s in program()["stages"]], **changes)


def test_each_stage_is_shown_for_its_green_and_the_cycle_repeats(tmp_path: Path) -> None:
    seen = shown(tmp_path, scenario(without_call(offset=12)))
    assert stages(seen)[:9] == ["4", "1", "2", "3", "4", "1", "2", "3", "4"] or stages(seen)[
        :8
    ] == ["1", "2", "3", "4", "1", "2", "3", "4"]
    greens = {"stage 1": 20.0, "stage 2": 6.0, "stage 3": 12.0, "stage 4": 7.0}
    for one in seen[1:-1]:
        if one.name in greens:
            assert one.seconds == greens[one.name]
    firsts = [one.begin for one in seen if one.name == "stage 1"]
    assert firsts[0] == 12.0
    assert {round(b - a, 3) for a, b in pairwise(firsts)} == {84.0}


@pytest.mark.slow
def test_no_intergreen_is_ever_shorter_than_the_paths_need(tmp_path: Path) -> None:
    for control in ("fixed", "actuated"):
        junction = program()
        seen = shown(tmp_path / control, scenario(junction, control=control, clock=18.4 * 3600))
        design = DesignedProgram(timing(**junction), light(), "fixed")
        least = pauses(seen, design)
        assert least
        for (ending, beginning), seconds in least.items():
            assert seconds >= design.needed(ending, beginning)[0], (ending, beginning)


def pauses(seen: list[Shown], design: DesignedProgram) -> dict[tuple[str, str], float]:
    """Shortest time from the end of green of a group to the begin of that of one it meets."""
    ends: dict[str, float] = {}
    least: dict[tuple[str, str], float] = {}
    for before, after in pairwise(seen):
        for name, group in design.groups.items():
            was, now = (
                {one.state[n] for n in group.movements} & {"G", "g"} for one in (before, after)
            )
            if was and not now:
                ends[name] = after.begin
            if now and not was:
                for other, end in ends.items():
                    if design.needed(other, name)[0] and other != name:
                        pair = other, name
                        least[pair] = min(least.get(pair, 1e9), after.begin - end)
    return least


@pytest.mark.slow
def test_a_stage_on_call_comes_only_if_somebody_waits(tmp_path: Path) -> None:
    called = shown(tmp_path / "called", scenario(one_plan(), walkers=120.0))
    quiet = shown(tmp_path / "quiet", scenario(one_plan(), walkers=0.0))
    assert "4" in stages(called)
    assert "4" not in stages(quiet)
    # With fixed-time control stage 3 is held, so that the first stage begins when it would have.
    for seen in (called, quiet):
        firsts = [one.begin for one in seen if one.name == "stage 1"]
        assert {round(b - a, 3) for a, b in pairwise(firsts)} == {84.0}
    assert {one.seconds for one in quiet if one.name == "stage 3"} == {12.0}
    assert any(one.name == "hold 3" for one in quiet)


def called_by_vehicles() -> dict[str, Any]:
    """The arrows of the main street and the green of the side street come on call."""
    own = {s["id"]: s for s in program()["stages"]}
    called = [
        own["1"],
        {**own["2"], "on_call": True},
        {**own["3"], "on_call": True, "min_green": 5},
        own["4"],
    ]
    return one_plan(stages=called, detectors=None)


def only_from(leg: int, to: str, *, control: str) -> Scenario:
    """Some cars from one leg to the end of another, and nobody else."""
    one = scenario(called_by_vehicles(), control=control, walkers=0.0, vehicles=120.0)
    flows = (flow for flow in one.flows if flow.spawn == entries()[leg])
    kept = [flow.model_copy(update={"goal": to}) for flow in flows]
    return one.model_copy(update={"flows": tuple(kept)})


@pytest.mark.parametrize("control", ["fixed", "actuated"])
@pytest.mark.parametrize(
    ("leg", "to", "wanted"),
    [(0, "3.0.1.64", set()), (1, "4.0.1.64", {"3"})],
    ids=["main street", "side street"],
)
def test_a_vehicle_calls_the_stage_that_it_needs_and_others_are_left_out(
    tmp_path: Path, control: str, leg: int, to: str, wanted: set[str]
) -> None:
    one = only_from(leg, to, control=control)
    seen = shown(tmp_path, one)
    assert set(stages(seen)) == {"1"} | wanted
    for name in wanted:
        # Of eight cycles or more some are without a car.
        assert 4 <= stages(seen).count(name) < stages(seen).count("1")


@pytest.mark.slow
def test_an_arrow_comes_on_call_for_who_found_no_gap_in_oncoming_traffic(tmp_path: Path) -> None:
    lefts = only_from(0, "4.0.1.64", control="fixed")
    assert "2" not in stages(shown(tmp_path / "alone", lefts))
    oncoming = only_from(2, "1.0.1.64", control="fixed").flows[0]
    busy = oncoming.model_copy(update={"per_hour": 1200.0})
    seen = shown(tmp_path / "busy", lefts.model_copy(update={"flows": (*lefts.flows, busy)}))
    assert 2 <= stages(seen).count("2") < stages(seen).count("1")


@pytest.mark.slow
def test_whoever_calls_a_stage_gets_it_in_the_next_cycle(tmp_path: Path) -> None:
    one = only_from(1, "4.0.1.64", control="fixed")
    trips = pl.read_parquet(carried_out(one, tmp_path).folder / "trips.parquet")
    design = DesignedProgram(timing(**called_by_vehicles()), light(), "fixed")
    cycle = cycle_length(design, design.plans()[0].stages)
    assert len(trips) >= 8
    assert trips["waiting_time"].to_list()[0] > 0.0
    assert max(trips["waiting_time"].to_list()) <= cycle


@pytest.mark.slow
def test_vehicles_call_in_a_run_in_slices_as_in_one_piece(tmp_path: Path) -> None:
    one = only_from(1, "4.0.1.64", control="actuated")
    runs = [
        carried_out(one, tmp_path / name, slice_length=length)
        for name, length in (("whole", None), ("slices", 150.0))
    ]
    whole, slices = (run.actors().select("id", "inserted", "arrived") for run in runs)
    assert len(whole) >= 8
    assert slices.equals(whole)


@pytest.mark.slow
def test_a_detector_prolongs_its_stage_up_to_the_bound_and_no_other(tmp_path: Path) -> None:
    busy = shown(tmp_path / "busy", scenario(one_plan(), control="actuated", vehicles=900.0))
    idle = shown(tmp_path / "idle", scenario(one_plan(), control="actuated", vehicles=40.0))
    lengths = {
        name: [one.seconds for one in seen[1:-1] if one.name == "stage 1"]
        for name, seen in (("busy", busy), ("idle", idle))
    }
    assert max(lengths["busy"]) > 25.0
    assert all(20.0 <= seconds <= 35.0 for some in lengths.values() for seconds in some)
    assert min(lengths["idle"]) == 20.0
    assert {one.seconds for one in busy[1:-1] if one.name == "stage 3"} == {12.0}


def test_an_actuated_program_with_a_cycle_keeps_to_it(tmp_path: Path) -> None:
    bounds = [{**s, "min_green": 5, "max_green": 30} for s in program()["stages"][:3]]
    junction = one_plan(stages=[*bounds, program()["stages"][3]], cycle=84, detectors=None)
    seen = shown(tmp_path, scenario(junction, control="actuated", walkers=0.0))
    ends = [one.begin + one.seconds for one in seen[:-1] if one.name == "stage 1"]
    assert len(ends) > 5
    assert {round(b - a, 3) for a, b in pairwise(ends)} == {84.0}
    assert ends[0] == 20.0
    assert len({one.seconds for one in seen if one.name == "stage 3"}) > 1


def test_a_left_turn_through_gaps_is_protected_in_the_stage_behind(tmp_path: Path) -> None:
    seen = shown(tmp_path, scenario(without_call(), walkers=0.0))
    movements = light().movements
    left, oncoming = (
        next(n for n, one in enumerate(movements) if one.approach == leg and one.turn == turn)
        for leg, turn in (("r1", "left"), ("r3", "straight"))
    )
    parts = [
        (key, sum(one.seconds for one in same))
        for key, same in groupby(seen, lambda one: (one.state[left], one.state[oncoming]))
    ]
    # A whole cycle: through gaps, while oncoming traffic clears, by the arrow.
    start = next(n for n, (key, _) in enumerate(parts) if key == ("g", "G"))
    assert parts[start][1] >= 20.0  # and pedestrian clearance
    assert [key[0] + key[1] for key, _ in parts[start : start + 6]] == [
        "gG", "gy", "gr", "Gr", "yr", "rr",
    ]  # fmt: skip
    assert parts[start + 3][1] == 6.0
    clearing = light().clearing(oncoming, left)
    assert clearing is not None
    assert parts[start + 1][1] + parts[start + 2][1] >= movements[oncoming].yellow + clearing


def test_plans_of_the_day_take_over_in_the_first_stage_and_fall_in_step(tmp_path: Path) -> None:
    seen = shown(tmp_path, scenario(program(), clock=18.5 * 3600 - 200))
    assert [name for name, _ in groupby(one.program for one in seen)] == ["day", "evening"]
    last = next(one for one in reversed(seen) if one.program == "day")
    assert last.name == "stage 1"
    assert 200.0 <= last.begin + last.seconds < 200.0 + 84.0 + 1.0
    firsts = [one.begin for one in seen if (one.program, one.name) == ("evening", "stage 1")]
    assert {round(b - a, 3) for a, b in pairwise(firsts[1:])} == {76.0}


@pytest.mark.slow
def test_programs_of_actuated_lights_without_detectors_of_their_own_get_loops(
    tmp_path: Path,
) -> None:
    seen = shown(tmp_path, scenario(None, control="actuated", vehicles=600.0))
    assert len({one.seconds for one in seen[1:-1] if one.name == "stage 1"}) > 1


def test_the_same_scenario_gives_the_same_file() -> None:
    one, other = (
        signals_xml(realized_lights(scenario(program()), crossing().sumo)) for _ in range(2)
    )
    assert one == other


def test_what_lights_show_can_be_kept_as_json() -> None:
    shown = tuple(one.shown for one in realized_lights(scenario(program()), crossing().sumo))
    assert programs_from_json(programs_to_json(shown)) == shown
    (kept,) = shown
    assert [group.id for group in kept.groups][:2] == ["V1", "V1L"]
    assert kept.groups[0].movements == ("r1 right", "r1 straight")
    assert [plan.cycle for plan in kept.plans] == [76.0]
