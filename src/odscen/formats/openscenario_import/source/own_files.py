"""Files that odscen wrote: what it says of actors in properties, and rules as groups of events."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Final

from odscen.formats.openscenario.xosc_entities import PREFIX

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lxml.etree import _Element

    from odscen.formats.openscenario_import.import_report import ImportReport

Made = dict[str, Any]
_STARTED, _ENDED = '"has": "started"', '"has": "ended"'
AUTHOR: Final = "odscen"


def is_own(root: _Element) -> bool:
    """Whether odscen wrote a file."""
    header = root.find("FileHeader")
    return header is not None and header.get("author") == AUTHOR


def own_fields(report: ImportReport, thing: _Element) -> Made | None:
    """Fields of an actor in the properties of its vehicle or pedestrian; ``None`` without a node.

    What the file says elsewhere too, such as its place, holds where it differs.
    """
    found: Made = {}
    for group in report.children(thing, "Properties"):
        for child in report.children(group, "Property"):
            name, text = child.get("name", ""), child.get("value", "")
            if name.startswith(PREFIX):
                found[name.removeprefix(PREFIX)] = value_of(text)
    return found if "spawn" in found else None


def value_of(text: str) -> Any:
    """Inverse of how the export writes a field: JSON, or the bare text where that is none."""
    try:
        return json.loads(text)
    except ValueError:
        return text


def said_in_properties(actors: Sequence[str]) -> frozenset[str]:
    """Names of maneuver groups that say what the properties of these actors do."""
    return frozenset(f"{actor} {what}" for actor in actors for what in ("departs", "has a goal"))


def without_repeats(groups: list[Made]) -> list[Made]:
    """Groups of conditions of which any fires, but those that a rule ``started`` implies.

    A rule that has started is written as one that runs, or else is complete.
    """
    texts = [json.dumps(group, sort_keys=True) for group in groups]
    begun = [text for text in texts if _STARTED in text]
    implied = {text.replace(_STARTED, _ENDED) for text in begun}
    return [group for group, text in zip(groups, texts, strict=True) if text not in implied]
