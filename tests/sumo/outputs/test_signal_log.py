"""The log of signal states and detector calls in the run folder."""

from __future__ import annotations

from typing import TYPE_CHECKING

import polars as pl
import pytest

from odscen.runs import layout
from odscen.runs.recorded import read_calls, read_light_states
from odscen.scenario.signals.program_design import DesignedProgram
from tests.signal_case import carried_out, light, program, scenario, timing

if TYPE_CHECKING:
    from pathlib import Path

EVENING = 18.5 * 3600.0 - 200.0


def stages(states: pl.DataFrame) -> list[tuple[str, float]]:
    """Names of stages with their seconds, whatever the plan; without the first and last row."""
    states = states.filter((pl.col("state") != pl.col("state").shift(1)).fill_null(value=True))
    seconds = states["time"].diff().shift(-1)
    rows = zip(states["name"].to_list(), seconds.to_list(), strict=True)
    return [(name, s) for name, s in list(rows)[1:-1] if name.startswith("stage")]


@pytest.mark.slow
def test_every_change_of_a_light_is_in_the_log_and_every_call_of_a_detector(
    tmp_path: Path,
) -> None:
    one = scenario(program(), control="actuated", clock=EVENING)
    run = carried_out(one, tmp_path / "one")
    states, calls = read_light_states(run.folder), read_calls(run.folder)
    assert states is not None
    assert calls is not None
    assert states["time"][0] == 0.0
    assert set(states["program"].unique()) == {"day", "evening"}
    assert len(states.filter(pl.col("state") == pl.col("state").shift(1))) == 1  # the new plan
    assert set(calls["detector"].unique()) >= {"J10001.call.0", "J10001.D1.1"}
    assert calls.filter(pl.col("end") < pl.col("begin")).is_empty()
    assert not list(run.folder.glob("*.xml"))
    assert run.summary["files"]["signal_states"] == layout.LIGHT_STATES_FILE
    assert run.summary["files"]["signal_figures"] == "figures/signals.csv"
    assert 0.0 <= run.summary["figures"]["cycle_failures"] <= 1.0
    assert 0.0 < run.summary["figures"]["unused_green"] < 1.0


@pytest.mark.slow
def test_lights_are_fixed_time_in_the_mesoscopic_model(tmp_path: Path) -> None:
    one = scenario(program(), control="actuated", clock=EVENING)
    run = carried_out(one, tmp_path / "meso", meso=True)
    states = read_light_states(run.folder)
    assert states is not None
    assert {s for name, s in stages(states) if name == "stage 4"} == {7.0}
    assert read_calls(run.folder) is None
    assert run.summary["figures"]["cycle_failures"] is None


@pytest.mark.slow
def test_greens_in_the_figures_are_those_of_the_log(tmp_path: Path) -> None:
    run = carried_out(scenario(None), tmp_path / "one")
    table = pl.read_csv(run.folder / "figures" / "signals.csv")
    assert table["movements"].to_list()[:5] == ["r1", "r2", "r3", "r4", "walk r1"]
    states = read_light_states(run.folder)
    assert states is not None
    green = sum(
        min(end, 600.0) - begin
        for begin, end, state in zip(
            states["time"], [*states["time"].to_list()[1:], 600.0], states["state"], strict=True
        )
        if state[0] in "Gg"
    )
    assert table["green"][0] == pytest.approx(green)
    assert table["vehicles"][0] > 20


def test_a_run_in_slices_logs_the_same_program_across_its_boundaries(tmp_path: Path) -> None:
    one = scenario(program(), control="actuated", clock=EVENING)
    run = carried_out(one, tmp_path / "sliced", slice_length=150.0)
    assert (run.folder / layout.LIGHT_STATES_FOLDER).is_dir()
    states, calls = read_light_states(run.folder), read_calls(run.folder)
    assert states is not None
    assert calls is not None
    assert states["time"].is_sorted()
    assert set(states["program"].unique()) == {"day", "evening"}
    # Stage 3 is held where nobody calls stage 4; the first one gets what the others leave.
    bounds = {"stage 2": (6.0, 6.0), "stage 3": (10.0, 28.0), "stage 4": (7.0, 7.0)}
    for name, seconds in stages(states):
        low, high = bounds.get(name, (14.0, 85.0))
        assert low <= seconds <= high, name
    assert_intergreens(states)
    assert calls["begin"].max() > 450.0  # type: ignore[operator]


def assert_intergreens(states: pl.DataFrame) -> None:
    """No group has green earlier after another than their paths need."""
    design = DesignedProgram(timing(**program()), light(), "fixed")
    ends: dict[str, float] = {}
    before = ""
    for time, state in zip(states["time"], states["state"], strict=True):
        for name, group in design.groups.items():
            was, now = (bool(s) and s[group.movements[0]] in "Gg" for s in (before, state))
            if was and not now:
                ends[name] = time
            if now and not was:
                for other, end in ends.items():
                    assert time - end >= design.needed(other, name)[0]
        before = state


@pytest.mark.slow
def test_an_actuated_run_says_nothing_of_lights_or_detectors(tmp_path: Path) -> None:
    for name, junction in (("own", program()), ("map", None)):
        run = carried_out(scenario(junction, control="actuated", clock=EVENING), tmp_path / name)
        log = (run.folder / layout.LOG_FILE).read_text()
        assert "detector" not in log
        assert "tlLogic" not in log
        assert "raffic light" not in log
