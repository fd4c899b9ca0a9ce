"""Where the trips of matrices and of background traffic begin and end."""

from __future__ import annotations

import numpy as np
import pytest

from odscen.scenario.demand.trips import QUARTER, EvenShares


def spread(places: list[float]) -> float:
    """Largest difference of shares below a bound: that of the places, and the bound itself."""
    found = np.sort(np.array(places))
    steps = np.arange(len(found)) / len(found)
    return float(np.max(np.maximum(np.abs(found - steps), np.abs(found - steps - 1 / len(found)))))


@pytest.mark.parametrize("which", [0, 1])
def test_an_hour_of_single_trips_fills_a_zone_evenly(which: int) -> None:
    """Twelve rows of one trip in each of four quarters; at random, 0.2 is usual."""
    of_zone = [
        float(EvenShares((0.3, 0.6, 0.0), row).places(1)[which][0])
        for other in range(12)
        for quarter in range(4)
        for row in [(3.0, float(other), quarter) if which == 0 else (float(other), 3.0, quarter)]
    ]
    assert spread(of_zone) < 0.06


def test_more_trips_leave_the_first_ones_as_they_were() -> None:
    even = EvenShares((0.3, 0.6, 0.1), (2.0, 5.0, 1.0))
    for some, all_ in zip(even.places(3), even.places(40), strict=True):
        assert some.tolist() == all_[:3].tolist()
        assert spread(all_.tolist()) < 0.1
    starts, goals = even.places(400)
    assert abs(float(np.corrcoef(starts, goals)[0, 1])) < 0.05


def test_parts_of_trips_add_up() -> None:
    """A hundred and forty-four rows of 0.4 trips: at random 58 and 12 more or less."""
    rows = [(float(a), float(b), 8 * QUARTER / QUARTER) for a in range(12) for b in range(12)]
    total = sum(EvenShares((0.0, 0.0, 0.7), row).whole(0.4) for row in rows)
    assert abs(total - 0.4 * len(rows)) < 4
    assert {EvenShares((0.0, 0.0, 0.7), row).whole(2.0) for row in rows} == {2}
