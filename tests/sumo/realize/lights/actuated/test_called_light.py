"""Actuated lights with the stages of the map, as plain SUMO runs them."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import polars as pl
import pytest

from odscen.convert.model.net import Phase
from odscen.runs.recorded import read_light_states
from odscen.scenario.signals.program_design import DesignedProgram
from odscen.sumo.realize.lights.actuated.stage_variants import LEAST_CALLED
from odscen.sumo.realize.lights.stage_phases import plan_phases
from tests.signal_case import JUNCTION, carried_out, crossing, entries, light, scenario, timing

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.runs.finished_run import Run
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.realize.sumo_map import SumoMap

WALKS = [n for n, one in enumerate(light().movements) if one.walk]
UNTIL = 600.0


class Shown(NamedTuple):
    """A state with the seconds from and to which it is shown."""

    begin: float
    end: float
    state: str


def shown(run: Run) -> list[Shown]:
    states = read_light_states(run.folder)
    assert states is not None
    states = states.filter((pl.col("state") != pl.col("state").shift(1)).fill_null(value=True))
    begins = states["time"].to_list()
    ends = [*begins[1:], UNTIL]
    return [Shown(*row) for row in zip(begins, ends, states["state"].to_list(), strict=True)]


def greens(seen: list[Shown], movement: int) -> list[tuple[float, float]]:
    """Begin and end of each green of a movement."""
    found: list[tuple[float, float]] = []
    for begin, end, state in seen:
        if state[movement] not in "Gg":
            continue
        if found and found[-1][1] == begin:
            found[-1] = found[-1][0], end
        else:
            found.append((begin, end))
    return found


def three_stages() -> SumoMap:
    """The crossing with another program of the map: people have a stage of their own."""
    groups = [
        {"id": "V1", "movements": ["r1", "r3"]},
        {"id": "V2", "movements": ["r2", "r4"]},
        {"id": "F", "movements": ["walk r1", "walk r2", "walk r3", "walk r4"]},
    ]
    stages = [
        {"id": "1", "protected": ["V1"], "green": 20.0},
        {"id": "2", "protected": ["V2"], "green": 10.0},
        {"id": "3", "protected": ["F"], "green": 7.0},
    ]
    program = DesignedProgram(
        timing(junction=JUNCTION, groups=groups, stages=stages), light(), "fixed"
    )
    made = plan_phases(program, program.plans()[0], ends={}, calls={}).phases
    phases = tuple(
        Phase(p.seconds, p.state, p.name, *((8.0, 40.0) if p.stage in {"1", "2"} else (0.0, 0.0)))
        for p in made
    )
    own = crossing().sumo
    return replace(own, lights=(own.lights[0]._replace(phases=phases),))


def waiting(run: Run) -> list[float]:
    return pl.read_parquet(run.folder / "trips.parquet")["waiting_time"].to_list()


def only_leg(number: int, *, vehicles: float) -> Scenario:
    """Cars on one leg and nobody else."""
    one = scenario(None, control="actuated", walkers=0.0, vehicles=vehicles)
    spawn = entries()[number]
    return one.model_copy(update={"flows": tuple(f for f in one.flows if f.spawn == spawn)})


@pytest.mark.slow
def test_a_light_rests_in_the_stage_of_those_who_come(tmp_path: Path) -> None:
    seen = shown(carried_out(only_leg(0, vehicles=300.0), tmp_path))
    assert len(seen) == 1
    movement = next(n for n, one in enumerate(light().movements) if one.approach == "r1")
    assert seen[0].state[movement] in "Gg"


def test_each_vehicle_of_a_quiet_leg_gets_its_green_and_the_light_returns(tmp_path: Path) -> None:
    run = carried_out(only_leg(1, vehicles=60.0), tmp_path)
    trips = pl.read_parquet(run.folder / "trips.parquet")
    side = next(n for n, one in enumerate(light().movements) if one.approach == "r2")
    own = greens(shown(run), side)
    assert 3 <= len(own) <= len(trips)
    # Change, and the least green of the stage that has just begun.
    assert max(waiting(run)) <= 25.0
    assert all(end - begin <= 15.0 for begin, end in own if end < UNTIL)


@pytest.mark.slow
def test_crossings_have_green_only_if_somebody_waits(tmp_path: Path) -> None:
    without = shown(carried_out(scenario(None, control="actuated", walkers=0.0), tmp_path / "no"))
    first = max(end for n in WALKS for _, end in greens(without, n)[:1])
    assert first <= 100.0  # the stage in which the run begins
    assert all(len(greens(without, n)) <= 1 for n in WALKS)
    run = carried_out(scenario(None, control="actuated", walkers=60.0), tmp_path / "some")
    some = shown(run)
    walked = [n for n in WALKS if light().movements[n].approach == "r1"]
    assert all(len(greens(some, n)) >= 3 for n in walked)
    assert all(end - begin >= 7.0 for n in WALKS for begin, end in greens(some, n) if end < UNTIL)
    people = pl.read_parquet(run.folder / "trips.parquet").filter(pl.col("person"))
    assert len(people) >= 6
    assert max(people["waiting_time"]) < 90.0


@pytest.mark.slow
@pytest.mark.parametrize(("vehicles", "walkers"), [(120.0, 60.0), (500.0, 200.0)])
def test_no_intergreen_is_shorter_than_the_paths_need(
    tmp_path: Path, vehicles: float, walkers: float
) -> None:
    one = scenario(None, control="actuated", vehicles=vehicles, walkers=walkers)
    seen = shown(carried_out(one, tmp_path))
    movements, ended = light().movements, dict[int, float]()
    pairs = 0
    for before, now in pairwise(seen):
        for n, (was, then) in enumerate(zip(before.state, now.state, strict=True)):
            if was in "Gg" and then not in "Gg":
                assert then == ("r" if movements[n].walk else "y")
                ended[n] = now.begin
        for n, (was, then) in enumerate(zip(before.state, now.state, strict=True)):
            if then in "Gg" and was not in "Gg":
                for other, time in ended.items():
                    clearing = light().clearing(other, n)
                    if clearing is not None and now.state[other] not in "Gg":
                        assert now.begin - time >= movements[other].yellow + clearing
                        pairs += 1
    assert pairs > 100


@pytest.mark.slow
def test_greens_keep_their_bounds_while_others_wait(tmp_path: Path) -> None:
    one = scenario(None, control="actuated", vehicles=900.0, walkers=60.0)
    seen = shown(carried_out(one, tmp_path))
    longest = max(phase.most for phase in crossing().sumo.lights[0].phases)
    clearance = 10.0
    for n, movement in enumerate(light().movements):
        if movement.drive:
            own = greens(seen, n)[1:-1]
            assert own
            assert all(LEAST_CALLED <= e - b <= longest + clearance for b, e in own)


@pytest.mark.slow
def test_half_of_the_usual_traffic_waits_less_at_actuated_lights(tmp_path: Path) -> None:
    loss = {}
    for control in ("fixed", "actuated"):
        one = scenario(None, control=control, vehicles=200.0, walkers=30.0)
        run = carried_out(one, tmp_path / control)
        loss[control] = pl.read_parquet(run.folder / "trips.parquet").filter(~pl.col("person"))
    assert len(loss["fixed"]) > 100
    means = {control: trips["time_loss"].mean() for control, trips in loss.items()}
    assert means["actuated"] < 0.8 * means["fixed"]  # type: ignore[operator]


@pytest.mark.slow
def test_a_run_with_calls_writes_no_warning_about_detectors(tmp_path: Path) -> None:
    run = carried_out(scenario(None, control="actuated"), tmp_path)
    log = (run.folder / "sumo.log").read_text()
    assert "etector" not in log
    assert "tlLogic" not in log


@pytest.mark.slow
@pytest.mark.parametrize("walkers", [0.0, 40.0])
def test_a_stage_of_their_own_comes_only_for_people_who_wait(
    tmp_path: Path, walkers: float
) -> None:
    one = scenario(None, control="actuated", walkers=walkers, vehicles=200.0)
    run = carried_out(one, tmp_path, sumo_map=three_stages())
    own = greens(shown(run), WALKS[0])
    people = pl.read_parquet(run.folder / "trips.parquet").filter(pl.col("person"))
    assert bool(len(people)) == bool(walkers)
    assert len(own) == 0 if not walkers else 3 <= len(own) <= len(people)
    assert all(end - begin == 7.0 for begin, end in own)
