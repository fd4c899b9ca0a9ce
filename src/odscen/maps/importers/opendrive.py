"""OpenDRIVE itself, as one of the formats that maps can have."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.errors import OpenDriveError
from odscen.maps.importers.base import ImportedMap, MapImporter
from odscen.maps.importers.file_kinds import file_kind, is_packed, root_element

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.learning.offered_options import OptionValue


_HEAD_BYTES = 4096
"""Bytes of a file in which XML of any encoding has a tag."""


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
            If it is packed, or of another format under the name of OpenDRIVE.
        """
        kind = file_kind(content, "map.xodr")
        if is_packed(content):
            raise OpenDriveError(f"this is {kind.what}: {kind.advice}")
        if not _may_be_opendrive(content) and kind.what != "text":
            raise OpenDriveError(f"this is {kind.what}, not OpenDRIVE: {kind.advice}")
        return ImportedMap(content)


def _may_be_opendrive(content: bytes) -> bool:
    """Whether a file is OpenDRIVE, or a damaged one, which the parser refuses with the place."""
    root = root_element(content)
    if root is not None:
        return root.lower() == "opendrive" or b"<OpenDRIVE" in content
    return not content or b"<" in content[:_HEAD_BYTES]
