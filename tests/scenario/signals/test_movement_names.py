"""Names of movements in signal programs."""

from __future__ import annotations

import pytest

from odscen.scenario.signals.light import find_movements, shortest_names
from tests.signal_case import light


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("r1", {"r1>r2", "r1>r3", "r1>r4"}),
        ("r1 left", {"r1>r4"}),
        ("r1>r3", {"r1>r3"}),
        ("r1>j10001>r3", {"r1>r3"}),
        ("1.0.-1", {"r1>r4"}),
        ("walk r1", {"walk r1"}),
        ("r1 uphill", set()),
        ("r9", set()),
    ],
)
def test_a_name_refers_to_movements_by_segment_turn_or_lane(name: str, found: set[str]) -> None:
    movements = light().movements
    assert {movements[n].name for n in find_movements(name, movements)} == found


def test_the_fewest_names_are_found_for_any_set_of_movements() -> None:
    movements = light().movements
    for names in (("r1",), ("r1 straight", "r1 right"), ("walk r3",), ("1.0.-3>3.0.2",)):
        wanted = {n for name in names for n in find_movements(name, movements)}
        short = shortest_names(wanted, movements)
        assert {n for name in short for n in find_movements(name, movements)} == wanted
        assert len(short) == len(names)
