from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from odscen.base.errors import OdscenError
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.objects import crosswalks, object_outline, stop_lines
from odscen.opendrive.parse import parse
from odscen.opendrive.topology import lane_successors
from tests.opendrive.full import FULL
from tests.opendrive.mutate import mutations

SMALL = (
    "direct_junction_simple",
    "fabriksgatan_traffic_lights",
    "multi_lane_3way_intersection",
    "parking_demo",
    "soderleden",
)


def use_everything(data: bytes) -> None:
    """Parse and ask every question that has an answer for any map."""
    odr = parse(data)
    table = RoadTable.of(odr)
    lanes = np.arange(len(table.lane_keys))
    for s in (table.lane_s0, table.lane_s1, 0.5 * (table.lane_s0 + table.lane_s1)):
        assert all(np.isfinite(part).all() for part in table.lane_points(lanes, s))
        table.speed_limit(lanes, s)
        table.lane_change_at(lanes, s)
        table.inner_lane_change_at(lanes, s)
    lane_successors(odr)
    crosswalks(odr, table)
    stop_lines(odr, table)
    for road in odr.roads.values():
        for obj in road.objects:
            object_outline(table, road.id, obj)


def outcomes(data: bytes, *, seed: int, count: int) -> list[str]:
    found = []
    for mutation in mutations(data, seed, count):
        try:
            use_everything(mutation.data)
            found.append("taken")
        except OdscenError as error:
            found.append("refused" if str(error) else "refused without a word")
    return found


@pytest.mark.parametrize("name", SMALL)
def test_damaged_real_maps_are_taken_or_refused(shared_maps: Path, name: str) -> None:
    data = (shared_maps / "esmini" / f"{name}.xodr").read_bytes()
    assert {"taken", "refused"} == set(outcomes(data, seed=1, count=15))


def test_damage_to_a_file_with_every_element_is_taken_or_refused() -> None:
    assert {"taken", "refused"} == set(outcomes(FULL.encode(), seed=2, count=60))


def test_damage_is_the_same_for_the_same_seed() -> None:
    one, other, third = (list(mutations(FULL, seed, 20)) for seed in (3, 3, 4))
    assert one == other
    assert one != third
