"""OpenStreetMap extracts as maps: the importer and its options."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from odscen.base.errors import InputError
from odscen.maps.importers.base import ImportedMap, MapImporter
from odscen.maps.importers.osm.osm_file import cut_out, is_osm, parse_box, read_extract

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.learning.offered_options import OptionValue


class OpenStreetMapImporter(MapImporter):
    """OpenStreetMap: .osm, .osm.gz, .osm.bz2, .osm.pbf.

    Roads, junctions, crosswalks, lights and signs are drawn from the tags; what these leave open is
    guessed, each guess with a confidence and the id of the element. Nothing of the file that would
    act on traffic is left out without a row in the report.
    """

    name = "openstreetmap"
    label = "OpenStreetMap (.osm, .osm.gz, .osm.bz2, .osm.pbf)"
    suffixes = (".osm", ".osm.gz", ".osm.bz2", ".osm.pbf", ".pbf")
    version = "1"
    options: ClassVar = {
        "properties": {
            "box": {
                "type": "string",
                "title": "Box",
                "description": "part to cut out: W,S,E,N in degrees; empty for all of the file",
                "default": "",
            },
            "driving_side": {
                "type": "string",
                "title": "Driving side",
                "description": "side of the road that traffic keeps to; by country if automatic",
                "enum": ["automatic", "right", "left"],
                "default": "automatic",
            },
            "service_roads": {
                "type": "string",
                "title": "Service roads",
                "description": "through: without driveways and aisles of car parks",
                "enum": ["none", "through", "all"],
                "default": "through",
            },
            "tracks": {
                "type": "boolean",
                "title": "Tracks",
                "description": "roads of fields and woods",
                "default": False,
            },
        }
    }

    def detect(self, content: bytes, file: str) -> bool:
        """Whether it is an extract of OpenStreetMap; Lanelet2 has the same root element."""
        return is_osm(content, file)

    def to_opendrive(self, content: bytes, options: Mapping[str, OptionValue]) -> ImportedMap:
        """Draw the map of an extract.

        Raises
        ------
        InputError
            If the file is damaged, or has no road in the box.
        LimitError
            If it unpacks to more than may be read.
        """
        from odscen.maps.importers.osm.drawing import draw_map
        from odscen.maps.importers.osm.furniture import lone_signals
        from odscen.maps.importers.osm.street_network import WaySelection, build_network
        from odscen.maps.importers.osm.street_tags import country_at
        from odscen.opendrive.write import write_opendrive

        extract = read_extract(content)
        box = parse_box(str(options["box"]))
        if box is not None:
            extract = cut_out(extract, box)
        if not extract.nodes:
            where = f" in the box {options['box']}" if box else ""
            raise InputError(f"there is no node{where}")
        lats = [node.lat for node in extract.nodes.values()]
        lons = [node.lon for node in extract.nodes.values()]
        country = country_at((min(lats) + max(lats)) / 2, (min(lons) + max(lons)) / 2)
        side = options["driving_side"]
        keeps_left = country.keeps_left if side == "automatic" else side == "left"
        selection = WaySelection(str(options["service_roads"]), bool(options["tracks"]))
        network = build_network(extract, country, keeps_left=keeps_left, selection=selection)
        if network.streets and (stops := lone_signals(extract, network)):
            network = build_network(
                extract, country, keeps_left=keeps_left, selection=selection, stops=stops
            )
        if not network.streets:
            refused = sorted({skipped.reason for skipped in network.skipped})[:3]
            about = f" ({'; '.join(refused)})" if refused else ""
            raise InputError(f"there is no road for vehicles{about}")
        drawn = draw_map(extract, network, name="OpenStreetMap")
        return ImportedMap(write_opendrive(drawn.map), drawn.entries)
