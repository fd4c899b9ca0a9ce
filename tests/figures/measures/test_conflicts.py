import polars as pl
import pytest
from lxml import html

from odscen.figures.measures.conflicts import (
    conflict_table,
    conflicts_of_slices,
    walking_conflicts,
)
from odscen.records.run_plan import PlannedActor
from odscen.reports.page_templates import render_block
from odscen.reports.run_report import conflict_values

STEP = 0.1


def conflict(one: str, other: str, begin: float, end: float, **measures: float) -> dict:
    row = {"kind": "following", "x": 1.0, "y": 2.0, "ttc": None, "drac": None, "pet": None}
    return {"one": one, "other": other, "begin": begin, "end": end, **row, **measures}


def planned(name: str, category: str, length: float, width: float) -> PlannedActor:
    return PlannedActor(
        name, category, "r1:0:-1:10", None, 0.0, length, width, 0.0, 0.0, 0.0, 0.0
    )  # fmt: skip


def test_both_sides_of_a_conflict_are_one_and_the_worst_of_both_counts():
    rows = [
        conflict("a", "b", 10.0, 14.0, ttc=2.0, drac=1.0),
        conflict("b", "a", 11.0, 15.0, ttc=1.2, drac=4.0, pet=2.5),
    ]
    table = conflict_table(rows)
    assert table.select("begin", "end", "one", "other", "ttc", "drac", "pet").rows() == [
        (10.0, 15.0, "a", "b", 1.2, 4.0, 2.5)
    ]


def test_two_who_meet_again_later_have_two_conflicts():
    rows = [
        conflict("a", "b", 10.0, 14.0, ttc=2.0),
        conflict("b", "a", 10.5, 13.0, ttc=1.9),
        conflict("a", "b", 14.5, 16.0, ttc=1.0),
        conflict("a", "c", 11.0, 12.0, ttc=2.5),
    ]
    table = conflict_table(rows)
    assert table.select("begin", "one", "other", "ttc").rows() == [
        (10.0, "a", "b", 1.9),
        (11.0, "a", "c", 2.5),
        (14.5, "a", "b", 1.0),
    ]


def test_a_conflict_over_the_boundary_of_two_slices_is_one():
    first = [
        conflict("a", "b", 50.0, 59.5, ttc=2.0, drac=3.5),
        conflict("a", "c", 40.0, 45.0, ttc=1.0),
        conflict("a", "d", 50.0, 56.0, pet=1.0),
    ]
    second = [
        conflict("b", "a", 60.0, 66.0, ttc=1.4, drac=1.0),
        conflict("a", "c", 60.0, 61.0, ttc=2.0),
        conflict("a", "b", 66.5, 67.0, ttc=2.5),
    ]
    whole = conflicts_of_slices([conflict_table(first), conflict_table(second)])
    assert whole.select("begin", "end", "one", "other", "ttc", "drac", "pet").rows() == [
        (40.0, 45.0, "a", "c", 1.0, None, None),
        (50.0, 66.0, "a", "b", 1.4, 3.5, None),
        (50.0, 56.0, "a", "d", None, None, 1.0),
        (60.0, 61.0, "a", "c", 2.0, None, None),
        (66.5, 67.0, "a", "b", 2.5, None, None),
    ]


@pytest.mark.parametrize("passes", [7.0, 8.5])
def test_encroachment_after_a_walker_is_the_time_until_the_car_is_where_they_were(passes: float):
    """The walker leaves the car's path, 2 m wide and 0.25 m for the walker, at 6.25 s."""
    steps = [round(STEP * k, 6) for k in range(200)]
    walker = [("p", t, 0.0, -5.0 + t, 0.0) for t in steps]
    car = [("c", t, 10.0 * (t - passes), 0.0, 90.0) for t in steps]
    traces = pl.DataFrame(
        walker + car, schema=["id", "time", "x", "y", "angle"], orient="row"
    )  # fmt: skip
    actors = [planned("p", "pedestrian", 0.5, 0.5), planned("c", "car", 4.0, 2.0)]
    (row,) = walking_conflicts(traces, actors)
    assert (row["one"], row["other"], row["kind"]) == ("p", "c", "walking")
    assert row["pet"] == pytest.approx(passes - 0.025 - 6.25, abs=2 * STEP)
    assert row["y"] == pytest.approx(1.25, abs=STEP)


def test_a_car_that_passes_long_after_or_beside_a_walker_is_no_conflict():
    steps = [round(STEP * k, 6) for k in range(200)]
    walker = [("p", t, 0.0, -5.0 + t, 0.0) for t in steps]
    late = [("late", t, 10.0 * (t - 12.0), 0.0, 90.0) for t in steps]
    beside = [("beside", t, 10.0 * (t - 6.0), 30.0, 90.0) for t in steps]
    traces = pl.DataFrame(
        walker + late + beside, schema=["id", "time", "x", "y", "angle"], orient="row"
    )  # fmt: skip
    actors = [planned("p", "pedestrian", 0.5, 0.5)]
    actors += [planned(name, "car", 4.0, 2.0) for name in ("late", "beside")]
    assert walking_conflicts(traces, actors) == []


def test_conflicts_are_told_the_worst_first():
    measures = {"x": 3.0, "y": -4.0, "drac": None, "pet": None}
    rows = [
        {"begin": 1.0, "end": 2.0, "one": "a", "other": "<b>", "kind": "following", "ttc": 2.5},
        {"begin": 5.0, "end": 6.0, "one": "c", "other": "d", "kind": "crossing", "ttc": 0.75},
    ]
    values = conflict_values(conflict_table([{**measures, **row} for row in rows]))
    section = render_block("run_report.html.j2", "conflicts", conflicts=values)
    page = html.fromstring(str(section))
    told = [[cell.text_content() for cell in row] for row in page.findall(".//tbody/tr")]
    assert told == [
        ["5", "c", "d", "crossing", "0.75", "", "", "3, -4"],
        ["1", "<b>", "a", "following", "2.50", "", "", "3, -4"],
    ]
    text = page.text_content()
    assert "1serious conflictsof 2 recorded" in text
    assert "under 3 m/s\u00b2highest deceleration to avoid a crash" in text
