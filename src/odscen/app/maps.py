"""Maps as scenarios are made and run on them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

from odscen.lanegraph.parking_areas import map_parking
from odscen.sumo.realize.lights.light_views import scenario_lights
from odscen.sumo.realize.sumo_map import SumoMap
from odscen.sumo.realize.usable import usable_places

if TYPE_CHECKING:
    from odscen.drawing.map_drawing import MapDrawing
    from odscen.maps.edited_map import EditedMap
    from odscen.maps.map_entry import MapEntry
    from odscen.maps.store import Workspace
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.placing.region import Usable
    from odscen.scenario.signals.light import Light


@dataclass(frozen=True, slots=True, eq=False)
class LoadedMap:
    """A map of the catalogue with what scenarios are made and run on, loaded once.

    Attributes
    ----------
    entry
        Its folder and what is known of it.
    sumo
        Lane graph, pedestrian graph and SUMO network, with the table between them.
    usable
        What SUMO can use of it.
    drawing
        What is drawn of it.
    lights
        Its traffic lights, as scenarios name them.
    """

    entry: MapEntry
    sumo: SumoMap
    usable: Usable
    drawing: MapDrawing
    lights: tuple[Light, ...]


@lru_cache(maxsize=4)
def load_map(entry: MapEntry) -> LoadedMap:
    """Load a map; the last few stay in memory."""
    graph, drawing = entry.graph(), entry.drawing()
    strips = [area.rings for area in drawing.areas if area.kind == "parking"]
    parking = map_parking(
        graph.lanes,
        spaces=drawing.parking_spaces.each,
        strips=[ring for rings in strips for ring in rings.each],
    )
    sumo = SumoMap.of(graph, entry.lane_table(), parking=parking, converter=entry.converter)
    lights = scenario_lights(sumo)
    return LoadedMap(entry, sumo, usable_places(sumo), drawing, lights)


@lru_cache(maxsize=2)
def map_to_mend(entry: MapEntry) -> EditedMap:
    """Load a map to look at what edits would find on it; the last two stay in memory."""
    from odscen.maps.edited_map import EditedMap  # late: no run needs what reads OpenDRIVE
    from odscen.opendrive.parse import parse

    return EditedMap(parse(entry.read("xodr"), file=entry.name))


def map_of(workspace: Workspace, scenario: Scenario) -> LoadedMap:
    """Load the map that a scenario was made on.

    Raises
    ------
    NotFoundError
        If the workspace has no map of that name and none of that content.
    InputError
        If the map of that name has other content.
    """
    return load_map(workspace.map_for(scenario.map.name, scenario.map.sha256))
