"""A case of a sweep as a scenario by itself, from the files alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from odscen.app.scenarios import SUFFIX, write_scenario
from odscen.base.categories import Category
from odscen.base.errors import InputError, NotFoundError
from odscen.experiments.sweeps import (
    SweepSettings,
    begin_sweep,
    named_cases,
    opened_case,
    read_plan,
    read_table,
)
from odscen.scenario import edits
from odscen.scenario.sweeps.sweep_plan import SweepPlan, axis_from_text, concrete
from tests.graphs import fork

if TYPE_CHECKING:
    from pathlib import Path

PLAN = SweepPlan((axis_from_text("later=1,2,5"),))


def begun(out: Path, *, ego: bool = True, **settings: object) -> Path:
    """Folder of a sweep of a car that departs later, none of whose cases has run."""
    graph = fork()
    one = edits.new_scenario(graph, name="late", roi=("r1", "j9", "r2", "r3"))
    one = edits.add_actor(one, graph, category=Category.CAR, spawn="1.0.-1.10")
    one = edits.set_ego(one, actor="car-1") if ego else one
    one = edits.set_parameter(one, parameter="later", value=1.0, unit="s")
    one = edits.set_formula(one, place="actors/car-1/depart", formula="$later")
    begin_sweep(out, one, PLAN, SweepSettings(**settings))  # type: ignore[arg-type]
    for name, values in named_cases(PLAN).items():
        write_scenario(concrete(one, values, name=name), out / "cases" / f"{name}{SUFFIX}")
    return out


def test_an_opened_case_has_numbers_the_seed_of_the_sweep_and_its_limits(tmp_path: Path) -> None:
    case = opened_case(begun(tmp_path, safe=("min_ttc >= 1.5",), seed=7), "case-003")
    assert (case.name, case.seed, case.formulas) == ("late, case-003", 7, {})
    assert case.actors[0].depart == case.parameters["later"].value == 5.0
    assert case.criteria == ("collided(ego) == 0", "min_ttc(ego) >= 1.5 s")


def test_limits_that_a_criterion_cannot_hold_are_left_out(tmp_path: Path) -> None:
    safe = ("min_ttc >= 4", "min_ttc < 2", "min_pet >= 1")
    assert opened_case(begun(tmp_path, safe=safe), "case-001").criteria == ("collided(ego) == 0",)


def test_without_an_ego_a_case_has_no_criteria_and_the_seed_of_the_scenario(
    tmp_path: Path,
) -> None:
    case = opened_case(begun(tmp_path, ego=False, safe=("min_ttc >= 1",)), "case-002")
    assert (case.criteria, case.seed) == ((), 0)


@pytest.mark.parametrize("name", ["case-004", "../scenario", "case-1", ""])
def test_a_case_that_is_none_is_not_found(tmp_path: Path, name: str) -> None:
    with pytest.raises(NotFoundError):
        opened_case(begun(tmp_path), name)


def test_the_table_of_a_sweep_that_has_not_run_waits_for_all_cases(tmp_path: Path) -> None:
    found = read_table(begun(tmp_path))
    assert found.table["status"].to_list() == ["waiting"] * 3
    assert found.table["later"].to_list() == [1.0, 2.0, 5.0]
    assert found.table["safe"].to_list() == [None] * 3
    assert found.boundary == ()


def test_a_folder_that_says_nothing_of_a_sweep_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no sweep is here"):
        read_plan(tmp_path)
    (tmp_path / "sweep.json").write_text('{"format": "odscen-sweep", "version": 1}')
    with pytest.raises(InputError, match=r"sweep\.json: a sweep has a plan and settings"):
        read_plan(tmp_path)
