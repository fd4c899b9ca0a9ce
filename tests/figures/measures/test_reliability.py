import polars as pl
import pytest

from odscen.figures.measures.figure import RunData
from odscen.figures.measures.registry import figure_values
from odscen.figures.measures.reliability import FIGURES


def test_reliability_is_that_of_vehicles_that_arrived():
    trips = pl.DataFrame(
        {
            "person": [False] * 4 + [True],
            "arrival": [1.0, 1.0, 1.0, None, 1.0],
            "duration": [10.0, 15.0, 20.0, 500.0, 90.0],
            "time_loss": [0.0, 5.0, 10.0, 499.0, 80.0],
        }
    )
    found = figure_values(RunData(trips=trips), FIGURES)
    assert found["travel_time_index"] == pytest.approx(1.5)
    assert found["planning_time_index"] == pytest.approx(1.95)
    assert found["buffer_index"] == pytest.approx(0.3)
    assert set(figure_values(RunData(trips=trips.clear()), FIGURES).values()) == {None}


def test_the_index_of_few_vehicles_is_said_to_be_that_of_lights():
    note = next(figure.note for figure in FIGURES if figure.name == "travel_time_index")
    assert callable(note)
    assert note({"throughput": 900.0}) == "mean travel time over free-flow time"
    assert "red lights" in note({"throughput": 40.0})
