"""A kind of proposal and a column that are registered once are known to all commands."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from odscen.base.errors import ScenarioError
from odscen.experiments.dataset_plan import DatasetPlan
from odscen.experiments.plan import StudyPlan
from odscen.experiments.searches import SearchSettings, search
from odscen.experiments.studies import begin_study, carry_out_study
from odscen.experiments.suite import read_suite
from odscen.experiments.sweeps import SweepSettings, sweep
from odscen.experiments.table import COLUMNS, Column, register_column
from odscen.experiments.work import LocalExecutor
from odscen.figures.measures.figure import Figure
from odscen.scenario.document.json_form import loads
from odscen.scenario.document.problems import validated
from odscen.scenario.sweeps.sweep_plan import (
    PROPOSALS,
    ProposalKind,
    SweepPlan,
    axis_from_text,
    register_proposal,
)
from tests.experiments.study_case import place, plan_file, short_scenario

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from odscen.base.arrays import FloatArray

VARIED = {"vary": [{"parameter": "per_minute", "from": 2, "to": 4}], "method": "middle"}


class Middle:
    """Proposes the middle of everything, again and again."""

    def __init__(self, plan: SweepPlan) -> None:
        self._axes = len(plan.axes)

    def ask(self, count: int) -> FloatArray:
        return np.full((count, self._axes), 0.5)

    def tell(self, values: Sequence[float | None]) -> None:
        del values


@pytest.fixture
def registered() -> Iterator[None]:
    figure = Figure(
        name="twice_planned", unit="", label="twice as many", definition="Twice.", source="test"
    )
    register_proposal(ProposalKind("middle", Middle))
    register_column(Column(figure, lambda measured: 2.0 * measured.run.counts["planned"]))
    yield
    del PROPOSALS["middle"], COLUMNS["twice_planned"]


@pytest.mark.usefixtures("registered")
@pytest.mark.slow
def test_sweeps_searches_and_studies_have_both(tmp_path: Path) -> None:
    file = short_scenario(tmp_path, seconds=5.0)
    scenario = loads(file.read_text(encoding="utf-8"))
    axes = (axis_from_text("per_minute=2..4"),)
    judged = SweepSettings(("twice_planned >= 1",))
    swept = sweep(
        place(), scenario, SweepPlan(axes, "middle", 1), tmp_path / "sweep", settings=judged
    ).table
    assert swept["per_minute"].to_list() == [3.0]
    assert swept["safe"].to_list() == [True]
    looked_for = search(
        place(),
        scenario,
        axes,
        tmp_path / "search",
        search_settings=SearchSettings("middle", runs=1, batch=1),
        settings=judged,
    ).table
    planned = swept["twice_planned"].to_list()
    assert looked_for["twice_planned"].to_list() == planned
    out = tmp_path / "study"
    begin_study(place(), plan_file(tmp_path, **VARIED, samples=1, seeds=[scenario.seed]), out)
    table = carry_out_study(out, LocalExecutor(place())).table
    assert table["per_minute"].to_list() == [3.0]
    assert table["twice_planned"].to_list() == [2.0 * n for n in table["planned"].to_list()]


@pytest.mark.usefixtures("registered")
def test_plans_of_datasets_and_suites_can_name_them(tmp_path: Path) -> None:
    short_scenario(tmp_path)
    study = {"name": "some", "scenarios": ["crossing.scenario.json"], **VARIED, "samples": 2}
    plan = validated(
        DatasetPlan,
        {"name": "some", "licence": "CC0", "keep_if": ["twice_planned > 2"], "study": study},
    )
    (limit,) = plan.limits()
    assert limit.holds({"twice_planned": 3.0})
    assert not limit.holds({"twice_planned": None})
    suite = tmp_path / "suite.toml"
    suite.write_text('scenarios = ["*.scenario.json"]\nexpect = ["twice_planned > 2"]\n')
    (case,) = read_suite(suite).cases
    assert "twice_planned > 2" in [one.text for one in case.expectations]


def test_without_it_no_plan_knows_the_kind() -> None:
    study = {"name": "some", "scenarios": ["crossing.scenario.json"], **VARIED, "samples": 2}
    with pytest.raises(ScenarioError, match="'middle' is not one of grid, latin, sobol, random"):
        validated(StudyPlan, study)
