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
