"""The importer of Lanelet2 maps."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, ClassVar

from odscen.maps.importers.base import ImportedMap, MapImporter
from odscen.maps.importers.file_kinds import root_element

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.learning.offered_options import OptionValue

_LANELET = re.compile(rb"""v=(["'])lanelet\1""")


class Lanelet2Importer(MapImporter):
    """Lanelet2: OpenStreetMap's XML with relations that are lanelets; also Autoware's dialect."""

    name = "lanelet2"
    label = "Lanelet2 (.osm with lanelets, also Autoware's)"
    suffixes = (".osm",)
    version = "2"
    options: ClassVar[Any] = {
        "properties": {
            "origin": {
                "type": "string",
                "default": "",
                "title": "Latitude,longitude of x = y = 0",
                "description": "As Lanelet2's UtmProjector has it. Without it: local_x and "
                "local_y of the nodes, or the middle of the map.",
            },
            "traffic": {
                "type": "string",
                "enum": ["auto", "right", "left"],
                "default": "auto",
                "title": "Side on which traffic keeps",
            },
        }
    }

    def detect(self, content: bytes, file: str) -> bool:  # noqa: ARG002 - content decides
        """Whether it is OpenStreetMap's XML with a lanelet; plain OpenStreetMap has none."""
        return root_element(content) == "osm" and _LANELET.search(content) is not None

    def to_opendrive(self, content: bytes, options: Mapping[str, OptionValue]) -> ImportedMap:
        """Make roads of lanelets; see :mod:`odscen.maps.importers.lanelet2`.

        Raises
        ------
        InputError
            If the file is damaged, or has no lanelet that can be read.
        """
        from odscen.maps.importers.lanelet2.conversion import convert_lanelets
        from odscen.maps.importers.lanelet2.lanelet_file import read_lanelet_file

        source = read_lanelet_file(content, origin=str(options["origin"]))
        return convert_lanelets(source, str(options["traffic"]))
