"""What differs between two maps, and between two scenarios."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from odscen.app.scenarios import read_scenario
from odscen.base.errors import InputError
from odscen.changes.map_differences import map_differences
from odscen.changes.scenario_differences import scenario_differences
from odscen.drawing.changed_places import changed_places
from odscen.drawing.map_shapes import map_drawing
from odscen.drawing.map_sheet import render_drawing
from odscen.maps.map_files import read_map_file
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse

if TYPE_CHECKING:
    from odscen.changes.map_change import MapChange
    from odscen.changes.scenario_differences import ScenarioChange
    from odscen.maps.store import Workspace
    from odscen.opendrive.road_model import OpenDrive


@dataclass(frozen=True, slots=True, eq=False)
class ComparedMaps:
    """Two maps as read, by their names, and what differs."""

    names: tuple[str, str]
    before: OpenDrive
    after: OpenDrive
    changes: tuple[MapChange, ...]

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready."""
        return {
            "before": self.names[0],
            "after": self.names[1],
            "changes": [change.to_dict() for change in self.changes],
        }

    def to_svg(self) -> str:
        """Draw the map after, with what differs marked on it; a whole SVG document."""
        tables = RoadTable.of(self.before), RoadTable.of(self.after)
        drawing = map_drawing(self.after, tables[1], name=" -> ".join(self.names))
        return render_drawing(drawing, marks=changed_places(self.changes, *tables))


def compare_maps(workspace: Workspace, before: str, after: str) -> ComparedMaps:
    """Hold two maps against each other.

    Parameters
    ----------
    before, after
        Each the name of a map of the workspace or the path of an OpenDRIVE file; a file where both
        exist and the text ends in ``.xodr``.

    Raises
    ------
    NotFoundError
        If there is no such map.
    InputError
        If a file is no map.
    """
    old, new = _read_opendrive_of(workspace, before), _read_opendrive_of(workspace, after)
    return ComparedMaps((before, after), old, new, map_differences(old, new))


def _read_opendrive_of(workspace: Workspace, name: str) -> OpenDrive:
    path = Path(name)
    if path.suffix.lower() != ".xodr":
        path = workspace.map(name).path("xodr")
    return parse(read_map_file(path), file=str(path))


def compare_scenarios(before: Path, after: Path) -> tuple[ScenarioChange, ...]:
    """Differences of two scenario files, as JSON documents or in their graph form.

    Raises
    ------
    InputError, ScenarioError
        If a file is no scenario.
    """
    if before.is_dir() or after.is_dir():
        folder = before if before.is_dir() else after
        raise InputError("this is a folder, not a scenario", file=str(folder))
    return scenario_differences(read_scenario(before), read_scenario(after))
