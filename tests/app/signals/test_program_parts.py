"""Programs made by edits on real junctions: what is computed, what is set, and what a run shows."""

from __future__ import annotations

from itertools import groupby, pairwise
from typing import TYPE_CHECKING

import pytest

from odscen.app.maps import map_of
from odscen.app.signals.program_editing import take_over_program
from odscen.app.signals.signal_views import DETECTABLE, detector_lanes, group_pairs
from odscen.base.errors import ScenarioError
from odscen.maps.store import Workspace
from odscen.runs.recorded import read_calls, read_light_states
from odscen.scenario import edits
from odscen.scenario.document.scenario_document import MapReference
from odscen.scenario.signals.light import find_light
from odscen.scenario.signals.program_design import DesignedProgram, beginning_groups, cycle_length
from tests.signal_case import JUNCTION, carried_out, light, one_plan, scenario

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.scenario.document.scenario_document import Scenario

LIGHTS = [light()]
BARE = {"intergreens": None, "detectors": None}


def shown(folder: Path) -> list[tuple[float, str, str]]:
    """What the light showed: from when on, in which plan, which letters."""
    states = read_light_states(folder)
    assert states is not None
    return list(states.select("time", "program", "state").iter_rows())


def greens(folder: Path, group: str, one: Scenario) -> list[tuple[float, float]]:
    """Begin and end of each green of a group in a run."""
    (timing,) = one.signals.junctions
    first = DesignedProgram(timing, light(), "fixed").groups[group].movements[0]
    rows = [(time, state[first] in "Gg") for time, _, state in shown(folder)]
    begins = [(next(same)[0], on) for on, same in groupby(rows, lambda row: row[1])]
    return [(a, b) for (a, on), (b, _) in pairwise(begins) if on]


@pytest.mark.slow
def test_an_intergreen_that_is_set_is_shown_in_a_run_to_the_second(tmp_path: Path) -> None:
    one = scenario(one_plan(**BARE), walkers=0.0, until=300.0)
    longer = edits.set_intergreen(one, LIGHTS, JUNCTION, ending="V1", beginning="V3L", seconds=9)
    longer = edits.set_intergreen(
        longer, LIGHTS, JUNCTION, ending="V3L", beginning="V2", seconds=11
    )
    for made, pause in ((one, 6.0), (longer, 11.0)):
        folder = carried_out(made, tmp_path / f"{pause:g}").folder
        ends = [end for _, end in greens(folder, "V3L", made)]
        begins = [begin for begin, _ in greens(folder, "V2", made) if begin > ends[0]]
        assert len(begins) >= 2
        gaps = [begin - end for end, begin in zip(ends, begins, strict=False)]
        assert gaps == pytest.approx([pause] * len(gaps))


def test_a_group_of_its_own_has_green_in_the_stages_that_were_chosen(tmp_path: Path) -> None:
    one = scenario(one_plan(**BARE), walkers=0.0, until=300.0)
    new = edits.set_group(one, LIGHTS, JUNCTION, "V2L", movements=["r2 left"])
    new = edits.add_stage(new, LIGHTS, JUNCTION, "5", protected=["V2L"], green=9, after="2")
    new = edits.set_group(new, LIGHTS, JUNCTION, "V2L", protected=["5"], permissive=[])
    folder = carried_out(new, tmp_path).folder
    own, others = greens(folder, "V2L", new), greens(folder, "V2", new)
    assert [end - begin for begin, end in own] == pytest.approx([9.0] * len(own))
    assert len(own) >= 3
    assert not any(a < end and begin < b for a, b in own for begin, end in others)


@pytest.mark.slow
def test_a_detector_prolongs_the_green_of_its_stage_as_long_as_its_gap_says(
    tmp_path: Path,
) -> None:
    one = scenario(one_plan(**BARE), control="actuated", walkers=0.0, vehicles=700.0)
    lengths = {}
    for gap in (1.0, 5.0):
        made = edits.set_detector(
            one, LIGHTS, JUNCTION, "D1", at="r1", before=25, gap=gap, stages=["1"]
        )
        run = carried_out(made, tmp_path / f"{gap:g}")
        calls = read_calls(run.folder)
        assert calls is not None
        assert any(".D1." in name for name in calls["detector"].unique())
        lengths[gap] = [end - begin for begin, end in greens(run.folder, "V3", made)]
    # Stage 1 lasts between its green of 20 s and its max_green of 35 s.
    assert sum(lengths[5.0]) / len(lengths[5.0]) > sum(lengths[1.0]) / len(lengths[1.0]) + 3.0
    assert all(20.0 <= s <= 36.0 + 6.0 for some in lengths.values() for s in some)


@pytest.mark.slow
def test_plans_of_the_day_switch_at_their_times_with_their_own_greens(tmp_path: Path) -> None:
    one = scenario(one_plan(**BARE), walkers=0.0, clock=9 * 3600.0 - 150.0, until=400.0)
    one = edits.set_plan(one, LIGHTS, JUNCTION, "B", times=["00:00", "09:00"])
    one = edits.set_plan(one, LIGHTS, JUNCTION, "A", times=["06:00"], green={"1": 32})
    folder = carried_out(one, tmp_path).folder
    rows = shown(folder)
    plans = [(next(same)[0], plan) for plan, same in groupby(rows, lambda row: row[1])]
    assert [plan for _, plan in plans] == ["A", "B"]
    # At 09:00, 150 s into the run, or in the first stage thereafter.
    (_, (switch, _)) = plans
    assert 150.0 <= switch < 150.0 + 100.0
    per_plan = {
        plan: {round(e - b, 1) for b, e in greens(folder, "V1", one) if plan == at_time(plans, b)}
        for plan in ("A", "B")
    }
    # V1 ends as late as it may, some seconds after the 32 and the 20 s of its stage.
    assert min(per_plan["A"]) - min(per_plan["B"]) == pytest.approx(12.0)


def at_time(plans: list[tuple[float, str]], time: float) -> str:
    return [plan for begin, plan in plans if begin <= time][-1]


@pytest.mark.slow
def test_intergreens_of_a_real_junction_are_computed_and_only_longer_ones_are_taken(
    shared_maps: Path, tmp_path: Path
) -> None:
    file = next(shared_maps.glob("**/carla-2020/Town04.xodr"), None)
    if file is None:
        pytest.skip("carla-2020/Town04 is not among the real maps")
    workspace = Workspace.open(tmp_path)
    entry = workspace.add_map(file)
    one = scenario(None, walkers=0.0)
    one = one.model_copy(
        update={
            "map": MapReference(name=entry.name, sha256=entry.info["sha256"]),
            "roi": (), "actors": (), "flows": (),
        }
    )  # fmt: skip
    loaded = map_of(workspace, one)
    view = max(loaded.lights, key=lambda each: len(each.movements))
    junction = view.names[0]
    own = take_over_program(workspace, one, junction)
    (timing,) = own.signals.junctions
    program = DesignedProgram(timing, view, "fixed")
    pairs = group_pairs(timing, view)
    assert len(pairs) >= 6
    assert all(pair.used == pair.needed > 0.0 for pair in pairs if pair.together == "never")
    # Yellow and clearing: no conflict on a road of a town needs less than 3 s, or more than 30.
    assert all(3.0 <= pair.needed <= 30.0 for pair in pairs if pair.needed)
    stages = program.plans()[0].stages
    first, second = stages[0], stages[1]
    ending, beginning = next(
        (a, b)
        for a in sorted(first.groups - second.groups)
        for b in sorted(beginning_groups(first, second))
        if program.needed(a, b)[0]
    )
    needed, _ = program.needed(ending, beginning)
    with pytest.raises(ScenarioError, match=rf"too short: .* needs {needed:g} s to clear"):
        edits.set_intergreen(
            own, loaded.lights, junction, ending=ending, beginning=beginning, seconds=needed - 1
        )
    longer = edits.set_intergreen(
        own, loaded.lights, junction, ending=ending, beginning=beginning, seconds=40
    )
    (new,) = longer.signals.junctions
    lengths = [cycle_length(DesignedProgram(each, view, "fixed"), stages) for each in (timing, new)]
    assert lengths[1] > lengths[0]
    found = {(p.ending, p.beginning): p for p in group_pairs(new, view)}[ending, beginning]
    assert (found.given, found.used, found.needed) == (40.0, 40.0, needed)
    # Every lane before it has a line of as many metres as detectors can be placed on.
    lanes = detector_lanes(loaded, junction)
    assert {lane.at for lane in lanes} <= {m.lanes[0] for m in view.movements}
    assert len(lanes) >= 4
    assert find_light(loaded.lights, junction) is view
    assert all(0.0 < length(lane.line) <= DETECTABLE + 1.0 for lane in lanes)


def length(line: tuple[tuple[float, float], ...]) -> float:
    return float(sum(((a - c) ** 2 + (b - d) ** 2) ** 0.5 for (a, b), (c, d) in pairwise(line)))
