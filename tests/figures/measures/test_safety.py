import polars as pl

from odscen.figures.measures.conflicts import SEEN_PET, SEEN_TTC, conflict_table
from odscen.figures.measures.figure import RunData
from odscen.figures.measures.registry import figure_values
from odscen.figures.measures.safety import FIGURES
from tests.figures.measures.test_conflicts import conflict


def figures_of(conflicts: pl.DataFrame) -> dict:
    return figure_values(RunData(conflicts=conflicts), FIGURES)


def test_figures_of_nobody_in_conflict_are_the_limits_of_what_is_recorded():
    figures = figures_of(conflict_table([]))
    assert figures["min_ttc"] == SEEN_TTC
    assert figures["pedestrian_min_pet"] == SEEN_PET
    assert figures["serious_conflicts"] == 0


def test_figures_tell_vehicles_from_people_on_foot():
    walking = conflict("p", "a", 1.0, 2.0, pet=0.4) | {"kind": "walking"}
    rows = [walking, conflict("a", "b", 5.0, 6.0, ttc=1.4, pet=2.0, drac=3.1)]
    figures = figures_of(conflict_table(rows))
    assert figures == {
        "min_ttc": 1.4,
        "max_drac": 3.1,
        "min_pet": 2.0,
        "pedestrian_min_pet": 0.4,
        "serious_conflicts": 2.0,
    }


def test_a_run_without_criticality_does_not_have_them():
    assert figure_values(RunData(), FIGURES) == {}
