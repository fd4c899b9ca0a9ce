"""How far bodies are beyond their lanes, against what geometry says."""

from __future__ import annotations

import math

import numpy as np
import polars as pl
import pytest

from odscen.figures.judging.lane_departure import DrivenLanes, lane_departures

WIDTH, BODY = 3.5, (4.0, 2.0)
ROAD = DrivenLanes(
    {
        "right": np.array([[0.0, 0.0], [100.0, 0.0]]),
        "left": np.array([[0.0, WIDTH], [100.0, WIDTH]]),
        "against": np.array([[100.0, 2 * WIDTH], [0.0, 2 * WIDTH]]),
        "behind": np.array([[100.0, 0.0], [150.0, 0.0]]),
    },
    dict.fromkeys(("right", "left", "against", "behind"), WIDTH),
    {"right": ["behind"]},
)


def bodies(*rows: tuple[float, float, float]) -> pl.DataFrame:
    """Body at each second, by ``x``, ``y`` and ``hdg``."""
    named = [
        {"time": float(time), "x": x, "y": y, "hdg": hdg, "length": BODY[0], "width": BODY[1]}
        for time, (x, y, hdg) in enumerate(rows)
    ]
    return pl.DataFrame(named)


def beyond(*rows: tuple[float, float, float]) -> list[float]:
    return [found.beyond for found in lane_departures(bodies(*rows), ROAD)]


@pytest.mark.parametrize("aside", [0.0, 0.5, 0.75, 1.0, -1.2])
def test_a_side_is_beyond_the_border_by_offset_and_half_the_widths(aside: float) -> None:
    (found,) = beyond((50.0, aside, 0.0))
    assert found == pytest.approx(abs(aside) + (BODY[1] - WIDTH) / 2.0)


def test_a_body_that_is_turned_reaches_further_with_its_corners() -> None:
    (found,) = beyond((50.0, 0.0, 0.3))
    reach = math.sin(0.3) * BODY[0] / 2.0 + math.cos(0.3) * BODY[1] / 2.0
    assert found == pytest.approx(reach - WIDTH / 2.0)


def test_a_change_of_lanes_is_a_departure_until_the_body_is_inside_the_other() -> None:
    found = beyond(*((10.0 + 5 * k, 0.5 * k, 0.0) for k in range(9)))
    assert max(found) == pytest.approx(2.5 + (BODY[1] - WIDTH) / 2.0)  # at 3 m it is inside
    assert found[-1] == pytest.approx(0.5 + (BODY[1] - WIDTH) / 2.0)


def test_who_drives_on_has_not_left_the_lane() -> None:
    assert max(beyond(*((80.0 + 4 * k, 0.2, 0.0) for k in range(12)))) < 0.0


def test_the_opposite_lane_is_not_ones_own() -> None:
    found = beyond((50.0, WIDTH, 0.0), (60.0, 2 * WIDTH, 0.0))
    assert found[1] == pytest.approx(WIDTH + (BODY[1] - WIDTH) / 2.0)


def test_records_before_any_lane_are_left_out() -> None:
    assert beyond((50.0, -20.0, 0.0)) == []
    assert len(beyond((50.0, -20.0, 0.0), (50.0, 0.0, 0.0))) == 1
