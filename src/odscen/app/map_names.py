"""Names of the places of a map of the catalogue."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

from odscen.opendrive.road_names import road_names
from odscen.reports.place_names import place_names

if TYPE_CHECKING:
    from odscen.app.maps import LoadedMap
    from odscen.reports.place_names import PlaceNames


@lru_cache(maxsize=4)
def map_names(loaded: LoadedMap) -> PlaceNames:
    """Name the segments and junctions of a map by its streets and the compass."""
    entry = loaded.entry
    # A map that was removed under a run has left what the run needs, but no names.
    names = road_names(entry.read("xodr")) if entry.path("xodr").exists() else {}
    return place_names(loaded.sumo.graph, names)
