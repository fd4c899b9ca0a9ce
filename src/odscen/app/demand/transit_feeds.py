"""Public transport from GTFS feeds."""

from __future__ import annotations

import io
import zipfile
from typing import TYPE_CHECKING

from odscen.app.maps import map_of
from odscen.base.errors import InputError, in_file
from odscen.base.given_files import (
    MOST,
    UNREADABLE_ARCHIVE,
    as_path,
    read_given,
    read_given_text,
)
from odscen.formats.gtfs_feed import CALENDARS, NEEDED, read_feed
from odscen.formats.gtfs_lines import place_feed
from odscen.opendrive.parse import parse
from odscen.scenario.checks.demand_checks import transit_problems
from odscen.scenario.document.problems import refuse_errors
from odscen.scenario.placing.region import Region

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from datetime import date
    from pathlib import Path

    from odscen.base.arrays import FloatArray
    from odscen.base.given_files import GivenPath
    from odscen.formats.gtfs_lines import PlacedFeed
    from odscen.maps.store import Workspace
    from odscen.opendrive.road_model import Header
    from odscen.scenario.document.scenario_document import Scenario

WITHIN = 30.0
"""Metres that a stop of a feed may be from its lane."""


def import_transit(
    workspace: Workspace,
    scenario: Scenario,
    file: GivenPath,
    *,
    day: date | None = None,
    routes: Sequence[str] = (),
    within: float = WITHIN,
) -> tuple[Scenario, PlacedFeed]:
    """Replace the public transport of a scenario by the bus trips of a feed on a day.

    Parameters
    ----------
    workspace
        Has the map.
    scenario
        The scenario; it is not changed.
    file
        A GTFS feed: a zip archive, or the folder of its tables.
    day
        Day of service; needed where the feed has a calendar.
    routes
        Names of routes that are wanted; all of them if empty.
    within
        Metres that a stop may be from its lane.

    Returns
    -------
    tuple of Scenario and PlacedFeed
        The scenario, and what of the feed was left out, and why.

    Raises
    ------
    InputError
        If the map has no georeference, or the feed cannot be read.
    """
    file = as_path(file)
    entry = workspace.map_for(scenario.map.name, scenario.map.sha256)
    header = parse(entry.read("xodr"), file=entry.path("xodr").name).header
    project = projection(header)
    with in_file(str(file)):
        feed = read_feed(_read_feed_tables(file), day=day)
        placed = place_feed(
            feed,
            region := Region.of(map_of(workspace, scenario).sumo.graph, scenario.roi),
            project,
            clock=scenario.demand.clock,
            duration=scenario.simulation.duration,
            within=within,
            routes=routes,
        )
    changed = scenario.model_copy(update={"transit": placed.transit})
    refuse_errors(transit_problems(changed, region))
    return changed, placed


def projection(
    header: Header,
) -> Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]:
    """From degrees of longitude and latitude to metres of the map.

    Raises
    ------
    InputError
        If the map has no georeference that is understood, or turns it.
    """
    import pyproj

    if header.crs is None:
        raise InputError(
            "the map has no georeference that is understood, so stops cannot be placed on it",
            element="geoReference",
        )
    x, y, _, hdg = header.offset
    if hdg:
        raise InputError(
            f"the map is turned by {hdg:g} rad against its georeference, which is not supported",
            element="offset",
        )
    transformer = pyproj.Transformer.from_crs("EPSG:4326", header.crs, always_xy=True)

    def project(lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        east, north = transformer.transform(lon, lat)
        return east - x, north - y

    return project


def _read_feed_tables(file: Path) -> dict[str, str]:
    """Tables of a feed by name; of an archive, wherever in it they are."""
    names = (*NEEDED, *CALENDARS)
    if file.is_dir():
        return {name: read_given_text(file / name) for name in names if (file / name).is_file()}
    try:
        with zipfile.ZipFile(io.BytesIO(read_given(file))) as archive:
            found = {}
            for member in archive.infolist():
                name = member.filename.rpartition("/")[2]
                if name in names:
                    if member.file_size > MOST:
                        raise InputError(
                            f"{name} has {member.file_size} bytes; the limit is {MOST}"
                        )
                    found[name] = archive.read(member).decode("utf-8")
            return found
    except UnicodeDecodeError as error:
        raise InputError(
            f"a table is not text in UTF-8: byte {error.start} is {error.object[error.start]:#04x}"
        ) from error
    except UNREADABLE_ARCHIVE as error:
        raise InputError(f"this is no zip archive that can be read: {error}") from error
