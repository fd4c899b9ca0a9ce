"""The generator that ships, asked for more than its model places of its own accord."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from odscen.app.learned.learned_maps import whole_map
from odscen.learning.fill import checked_fill
from odscen.learning.reference.reference_generator import ReferenceGenerator
from odscen.learning.traffic_snapshots import no_lights
from odscen.maps.store import Workspace
from tests.app.conftest import MAPS

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.app.learned.learned_maps import WholeMap


@pytest.fixture(scope="module")
def country(tmp_path_factory: pytest.TempPathFactory) -> WholeMap:
    folder: Path = tmp_path_factory.mktemp("country")
    return whole_map(Workspace.open(folder).add_map(MAPS / "rural_hills.xodr"))


@pytest.mark.slow
@pytest.mark.parametrize("per_km", [4, 40])
def test_a_road_in_the_country_has_as_many_vehicles_as_are_wanted(
    country: WholeMap, per_km: int
) -> None:
    wanted = round(per_km * country.learned.metres / 1000.0)
    lights = no_lights(len(country.region.graph.lanes.lanes.keys))
    request = country.request(wanted, lights, seed=1)
    fill = ReferenceGenerator().fill(country.region.graph, request, np.random.default_rng(1))
    checked = checked_fill(fill, request, country.region)
    assert 0.95 * wanted <= len(checked.actors) <= wanted
