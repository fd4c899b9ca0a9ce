"""The maps by name."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from tools.make_maps.arterial_town import COUNT as ARTERIAL_COUNT
from tools.make_maps.arterial_town import arterial_crossing, arterial_town
from tools.make_maps.crossings import (
    bus_street,
    left_hand_crossing,
    signal_crossing,
    t_junction_signs,
)
from tools.make_maps.joined_towns import joined_towns
from tools.make_maps.motorway import motorway_weave
from tools.make_maps.roundabout import roundabout
from tools.make_maps.rural import rural_hills
from tools.make_maps.town import large_town, town_5x5
from tools.make_maps.varied_town import COUNT, varied_town

if TYPE_CHECKING:
    from collections.abc import Callable

    from tools.make_maps.builder import Builder

MAPS: dict[str, Callable[[str], Builder]] = {
    "signal_crossing": signal_crossing,
    "t_junction_signs": t_junction_signs,
    "roundabout": roundabout,
    "motorway_weave": motorway_weave,
    "rural_hills": rural_hills,
    "town_5x5": town_5x5,
    "left_hand_crossing": left_hand_crossing,
    "bus_street": bus_street,
}
ON_DEMAND: dict[str, Callable[[str], Builder]] = {
    "large_town": large_town,
    "arterial_crossing": arterial_crossing,
    "towns_10": partial(joined_towns, count=10),
    "towns_100": partial(joined_towns, count=100),
    **{f"varied_town_{seed:02d}": varied_town for seed in range(COUNT)},
    **{f"arterial_town_{seed:02d}": arterial_town for seed in range(ARTERIAL_COUNT)},
}
"""Too large, or too many, to be kept in the repository."""
LEFT_HAND = {"left_hand_crossing"}
"""Maps that are mirrored when they are written."""
