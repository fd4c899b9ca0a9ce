"""Networks against their maps by :mod:`odscen.convert.verify.fidelity`, which knows neither."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from odscen.convert.verify.fidelity import verify
from tests.convert.maps import converted, each_map, named

if TYPE_CHECKING:
    from odscen.convert.verify.fidelity_result import Fidelity


@cache
def measured(path: Path) -> Fidelity:
    made = converted(path)
    return verify(made.network.net_xml, made.odr, made.roads)


@each_map()
def test_the_network_follows_its_map(path: Path) -> None:
    failed = [verdict for verdict in measured(path).verdicts if not verdict.ok]
    assert failed == []


@each_map()
def test_every_crosswalk_has_a_crossing_in_its_place(path: Path) -> None:
    fidelity = measured(path)
    assert fidelity.lost_crosswalks == ()
    crossings = converted(path).network.table.counts["crossings"]
    assert crossings == fidelity.crosswalks


@pytest.mark.parametrize(
    ("name", "count"),
    [("signal_crossing", 4), ("t_junction_signs", 6), ("town_5x5", 112), ("roundabout", 4)],
)
def test_crosswalks_are_looked_at_where_there_are_any(name: str, count: int) -> None:
    assert measured(named(name)).crosswalks == count
