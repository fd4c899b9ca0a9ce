"""Closeness of bodies and of paths that cross, on tracks made by hand."""

from __future__ import annotations

import math

import numpy as np
import polars as pl
import pytest

from odscen.experiments.closeness import closeness_of, criticality

BODIES = {"east": (4.0, 2.0), "north": (4.0, 2.0), "far": (4.0, 2.0)}
NOTHING = dict.fromkeys(
    ("collision", "impact_speed", "min_ttc", "min_pet", "clearance", "conflict_distance")
)


def tracks(late: float) -> pl.DataFrame:
    """One goes east through the origin at 5 s, another north through it `late` s later; 10 m/s."""
    time = np.arange(0.0, 10.01, 0.1)
    rows = []
    for name, x, y, hdg in (
        ("east", 10.0 * (time - 5.0), 0.0 * time, 0.0),
        ("north", 0.0 * time, 10.0 * (time - 5.0 - late), math.pi / 2),
        ("far", 0.0 * time + 500.0, 10.0 * time, math.pi / 2),
    ):
        rows.append(pl.DataFrame({"time": time, "id": name, "x": x, "y": y, "hdg": hdg}))
    return pl.concat(rows)


@pytest.mark.parametrize("late", [0.0, 0.5, 2.0])
def test_the_conflict_distance_is_what_the_later_one_has_left(late: float) -> None:
    found = closeness_of(tracks(late), BODIES, {"east"})
    assert found.conflict_distance == pytest.approx(10.0 * late, abs=1e-6)
    # At the middle of the two instants each is half of that from the crossing point.
    between = math.hypot(5.0 * late, 5.0 * late)
    assert found.clearance is not None
    assert max(between - 4.5, 0.0) <= found.clearance <= max(between - 2.0, 0.1)


def test_only_those_who_are_watched_count() -> None:
    assert closeness_of(tracks(0.5), BODIES, {"far"}).clearance > 300.0  # type: ignore[operator]
    assert closeness_of(tracks(0.5), BODIES, {"nobody"}) == (None, None)
    assert closeness_of(tracks(0.5), BODIES, None).conflict_distance == pytest.approx(5.0)


def test_any_collision_is_worse_than_none_and_a_faster_one_is_worse_still() -> None:
    slow = criticality({**NOTHING, "collision": True, "impact_speed": 3.0})
    fast = criticality({**NOTHING, "collision": True, "impact_speed": 12.0})
    touched = criticality({**NOTHING, "min_ttc": 0.0, "clearance": 0.0})
    assert 2.0 > fast > slow > touched == 1.0
    assert criticality({**NOTHING, "collision": True, "impact_speed": math.nan}) == 1.0


def test_what_is_nearer_is_more_critical_also_without_an_encounter() -> None:
    near = criticality({**NOTHING, "clearance": 2.0})
    far = criticality({**NOTHING, "clearance": 20.0})
    met = criticality({**NOTHING, "clearance": 2.0, "min_ttc": 1.0})
    assert met > near > far > criticality(NOTHING) == 0.0
