"""What the registry says of figures, and that others read it."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from odscen.base.errors import InputError
from odscen.experiments.tolerance import usual
from odscen.figures.measures.figure import Better, Figure, RunData, SummaryPart
from odscen.figures.measures.figure_docs import between_markers, column_table, run_figure_table
from odscen.figures.measures.registry import (
    ALL_FIGURES,
    COUNTS,
    RUN_FIGURES,
    figure_of,
    figure_values,
    run_figure,
)

ROOT = Path(__file__).parents[3]
DOCS = ROOT / "docs" / "runs.md"


def test_every_figure_has_its_own_name_and_words_and_a_tolerance_that_a_suite_may_have() -> None:
    assert len({(figure.kind, figure.name) for figure in ALL_FIGURES}) == len(ALL_FIGURES)
    assert len({(figure.kind, figure.label) for figure in ALL_FIGURES}) == len(ALL_FIGURES)
    for figure in ALL_FIGURES:
        assert 0 < len(figure.label) <= 42, "the chart of a comparison has no room for more"
        assert figure.source
        assert figure.definition.endswith(".")
        assert usual(figure).allowed(100.0) >= 0.0


@pytest.mark.parametrize(
    ("name", "unit", "better", "tolerance"),
    [
        ("arrived", "", Better.HIGHER, (0.0, 0.0)),
        ("mean_delay", "s", Better.LOWER, (0.02, 0.5)),
        ("pedestrian_mean_waiting_time", "s", Better.LOWER, (0.02, 0.5)),
        ("insertion_error_max", "m", Better.LOWER, (0.0, 0.05)),
        ("depart_delay_max", "s", Better.LOWER, (0.05, 1.0)),
        ("mean_stops", "", Better.LOWER, (0.05, 0.1)),
        ("mean_speed", "m/s", Better.HIGHER, (0.02, 0.0)),
        ("co2_per_km", "g/km", Better.LOWER, (0.02, 0.0)),
        ("throughput", "veh/h", Better.HIGHER, (0.02, 0.0)),
        ("planning_time_index", "", Better.LOWER, (0.02, 0.0)),
        ("min_ttc", "s", Better.HIGHER, (0.02, 0.0)),
        ("max_drac", "m/s2", Better.LOWER, (0.02, 0.0)),
    ],
)
def test_units_directions_and_tolerances_are_stated(
    name: str, unit: str, better: Better, tolerance: tuple[float, float]
) -> None:
    figure = run_figure(name)
    assert figure is not None
    assert (figure.unit, figure.better) == (unit, better)
    allowed = usual(figure)
    assert (allowed.relative, allowed.absolute) == tolerance


def test_a_bound_may_be_in_another_unit_of_the_same_kind_only() -> None:
    speed = figure_of("segment", "mean_speed")
    assert speed.in_unit_of(36.0, "km/h") == pytest.approx(10.0)
    with pytest.raises(InputError, match="mean_speed is written in m/s, km/h, not in 's'"):
        speed.in_unit_of(1.0, "s")


def test_the_better_value_is_told_by_the_direction() -> None:
    delay, arrived, planned = (run_figure(n) for n in ("mean_delay", "arrived", "planned"))
    assert delay
    assert arrived
    assert planned
    assert [delay.improves(d) for d in (-1.0, 1.0, 0.0, None)] == [True, False, None, None]
    assert [arrived.improves(d) for d in (-1.0, 1.0)] == [False, True]
    assert planned.improves(1.0) is None


def test_a_figure_that_nobody_knows_has_its_name_and_no_unit() -> None:
    unknown = figure_of("run", "mean_headway_time")
    assert (unknown.label, unknown.written(12.5)) == ("mean headway time", "12.5")
    assert usual(unknown).allowed(100.0) == pytest.approx(2.0)
    assert run_figure("mean_headway_time") is None


def test_shipped_baselines_have_known_figures_only() -> None:
    files = sorted((ROOT / "suites" / "baselines").glob("*.json"))
    assert files
    for file in files:
        rows = json.loads(file.read_text())["rows"]
        names = {row["figure"] for row in rows if "figure" in row}
        assert names <= {figure.name for figure in RUN_FIGURES}


def test_figures_of_a_run_stand_in_the_parts_of_its_summary() -> None:
    summary = {"sim_seconds": 60.0, "actors": {"arrived": 3}, "figures": {"mean_delay": 1.5}}
    found = {figure.name: figure.of_summary(summary) for figure in RUN_FIGURES}
    assert {name: value for name, value in found.items() if value is not None} == {
        "sim_seconds": 60.0,
        "arrived": 3.0,
        "mean_delay": 1.5,
    }
    assert set(figure_values(RunData(), part=SummaryPart.ACTORS)) == set(COUNTS)
    assert figure_values(RunData(end=60.0), part=SummaryPart.RUN) == {"sim_seconds": 60.0}


def test_a_value_is_written_in_its_unit() -> None:
    plain = Figure(name="x", unit="", label="x", definition="X.", source="")
    assert [plain.written(value) for value in (3.0, 0.256, 100.0)] == ["3", "0.26", "100"]
    assert figure_of("run", "mean_delay").written(12.5) == "12.50 s"


@pytest.mark.golden
def test_the_tables_of_the_docs_are_those_of_the_registry() -> None:
    text = DOCS.read_text(encoding="utf-8")
    new = between_markers(text, "columns", column_table())
    new = between_markers(new, "figures", run_figure_table())
    if os.environ.get("ODSCEN_GOLDEN") == "write":
        DOCS.write_text(new, encoding="utf-8")
    assert DOCS.read_text(encoding="utf-8") == new
    with pytest.raises(ValueError, match="no markers"):
        between_markers(text, "figure of the moon", "")
