from __future__ import annotations

import math

import polars as pl
import pytest

from odscen.figures.measures.parity import error_curve, errors_by_place, parity_figures, with_errors
from odscen.records.run_plan import Plan, PlannedActor
from odscen.reports.parity_report import render_parity

NOWHERE = (math.nan,) * 4


def actor(name: str, category: str = "car", *, depart: float = 0.0) -> PlannedActor:
    return PlannedActor(
        id=name, category=category, spawn="a", goal="b", depart=depart, length=4.5, width=1.8,
        x=0.0, y=0.0, z=0.0, hdg=0.0,
    )  # fmt: skip


PLAN = Plan(
    scenario="<two>", seed=1, until=10.0, step_length=1.0, net_offset=(0.0, 0.0),
    actors=(actor("car-1"), actor("walker-1", "pedestrian", depart=1.0)),
)  # fmt: skip


def states(*rows: tuple[float, ...]) -> pl.DataFrame:
    names = ["time", "row", "x", "y", "z", "hdg", "carla_x", "carla_y", "carla_z", "carla_hdg"]
    table = pl.DataFrame(rows, schema=dict.fromkeys(names, pl.Float64), orient="row")
    return with_errors(table.with_columns(pl.col("row").cast(pl.Int64)))


def lights(*rows: tuple[float, str, str, str]) -> pl.DataFrame:
    schema = {"time": pl.Float64, "signal": pl.String, "sumo": pl.String, "carla": pl.String}
    return pl.DataFrame(rows, schema=schema, orient="row")


SEEN = states(
    (0.0, 0, 1.0, 0.0, 0.0, 3.1, 1.0, 0.0, 0.0, 3.1),
    (1.0, 0, 11.0, 0.0, 5.0, math.pi - 0.01, 11.3, 0.4, 5.1, 0.01 - math.pi),
    (2.0, 0, 21.0, 0.0, 0.0, 0.0, *NOWHERE),
    (2.0, 1, 50.0, 9.0, 0.0, 0.0, *NOWHERE),
    (3.0, 1, 51.0, 9.0, 0.0, 0.0, 51.0, 9.01, 0.0, 0.0),
)
SHOWN = lights(
    (0.0, "7", "Green", "Green"), (1.0, "7", "Yellow", "Green"), (0.0, "8", "Red", "Red"),
    (1.0, "8", "Red", "Red"),
)  # fmt: skip


def test_errors_are_level_distance_height_and_the_short_way_round() -> None:
    worst = parity_figures(SEEN, SHOWN, PLAN)["worst"][0]
    assert worst["actor"] == "car-1"
    assert worst["time"] == 1.0
    assert worst["position"] == pytest.approx(0.5)
    assert worst["height"] == pytest.approx(0.1)
    assert worst["heading"] == pytest.approx(math.degrees(0.02), abs=1e-4)


def test_who_is_not_shown_is_counted_and_named() -> None:
    figures = parity_figures(SEEN, SHOWN, PLAN)
    assert (figures["samples"], figures["mirrored"], figures["steps"]) == (5, 3, 4)
    assert figures["absent"] == [
        {"actor": "car-1", "steps": 1, "since": 2.0},
        {"actor": "walker-1", "steps": 1, "since": 2.0},
    ]
    assert figures["by_category"]["pedestrian"]["position_error_m"]["max"] == pytest.approx(0.01)


def test_starts_are_held_against_the_plan_and_against_each_other() -> None:
    departures = parity_figures(SEEN, SHOWN, PLAN)["departures"]
    assert departures["sumo_after_plan_s"]["max"] == 1.0
    assert departures["sumo_off_plan_m"]["p50"] == pytest.approx((1.0 + math.hypot(50, 9)) / 2)
    assert departures["carla_after_sumo_s"]["max"] == 1.0


def test_a_light_that_differs_is_named_with_its_time() -> None:
    found = parity_figures(SEEN, SHOWN, PLAN)["lights"]
    assert (found["signals"], found["samples"], found["wrong"]) == (2, 4, 1)
    assert found["worst"] == [{"signal": "7", "steps": 1, "since": 1.0}]


def test_errors_are_found_by_time_and_place() -> None:
    time, median, most = error_curve(SEEN, width=2.0)
    assert time.tolist() == [1.0, 3.0]
    assert median.tolist() == pytest.approx([0.25, 0.01])
    assert most.tolist() == pytest.approx([0.5, 0.01])
    corner, error = errors_by_place(SEEN, size=10.0)
    assert corner.tolist() == [[0.0, 0.0], [10.0, 0.0], [50.0, 0.0]]
    assert error.tolist() == pytest.approx([0.0, 0.5, 0.01])


def test_the_page_names_the_worst_and_escapes_what_is_not_ours() -> None:
    page = render_parity(parity_figures(SEEN, SHOWN, PLAN), SEEN)
    assert "The two worlds differ in places" in page
    assert "50 cm" in page
    assert "<two>" not in page
    assert "&lt;two&gt;" in page


def test_worlds_that_agree_are_said_to() -> None:
    same = states((0.0, 0, 1.0, 2.0, 0.0, 0.5, 1.0, 2.0, 0.0, 0.5))
    page = render_parity(parity_figures(same, lights(), PLAN), same)
    assert "Both worlds agree" in page


def test_nobody_at_all_is_told_and_not_an_error() -> None:
    nobody = states()
    figures = parity_figures(nobody, lights(), PLAN)
    assert figures["share_mirrored"] is None
    assert "CARLA showed no road user" in render_parity(figures, nobody)
    hidden = states((0.0, 0, 1.0, 2.0, 0.0, 0.5, *NOWHERE))
    assert "CARLA showed no road user" in render_parity(
        parity_figures(hidden, lights(), PLAN), hidden
    )
