"""OpenDRIVE itself, as one of the formats that maps can have."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.errors import OpenDriveError
from odscen.maps.importers.base import ImportedMap, MapImporter
from odscen.maps.importers.file_kinds import file_kind, is_packed, root_element

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.learning.offered_options import OptionValue


class OpenDriveImporter(MapImporter):
    """OpenDRIVE 1.4 to 1.8: the file is the map.

    A file named ``.xodr`` is read as one whatever it holds, so that a damaged one is refused with
    the place of the damage; a file of another name needs the root element.
    """

    name = "opendrive"
    label = "OpenDRIVE 1.4 to 1.8"
    suffixes = (".xodr",)
    version = "1"

    def detect(self, content: bytes, file: str) -> bool:
        """Whether it has the name or the root element of OpenDRIVE."""
        return file.lower().endswith(self.suffixes) or root_element(content) == "OpenDRIVE"

    def to_opendrive(self, content: bytes, options: Mapping[str, OptionValue]) -> ImportedMap:  # noqa: ARG002 - it has none
        """Give the file as it is; its report is that of the conversion to SUMO.

        Raises
        ------
        OpenDriveError
            If it is packed.
        """
        if is_packed(content):
            kind = file_kind(content, "map.xodr")
            raise OpenDriveError(f"this is {kind.what}: {kind.advice}")
        return ImportedMap(content)
