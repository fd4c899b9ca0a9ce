"""Selections of entities, and actors that are whoever triggers, put in as entities by name."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lxml.etree import _Element

    from odscen.formats.openscenario_import.import_report import ImportReport

_KINDS: Final[Mapping[str, str]] = {
    "vehicle": "Vehicle", "pedestrian": "Pedestrian", "miscellaneous": "MiscObject",
}  # fmt: skip
"""Types of objects, and the elements of their bodies."""
_WHOEVER: Final = "all that can trigger it, whichever of them does"


def name_entities(report: ImportReport, root: _Element) -> None:
    """Put entities in the place of selections, in a tree in which each attribute has its value."""
    selections: dict[str, tuple[str, ...]] = {}
    for element in root.iterfind("Entities/EntitySelection"):
        selections[element.get("name", "")] = _members_of(root, element, selections)
        report.take(element)
    for actors in root.iterfind("Storyboard/Story//Actors"):
        if actors.get("selectTriggeringEntities") == "true":
            _add_triggering_entities(report, actors)
    for element in [*root.iterfind("Storyboard//EntityRef")]:
        above = element.getparent()
        if above is None or above.tag not in ("Actors", "TriggeringEntities"):
            continue
        for name in selections.get(element.get("entityRef", ""), ()):
            element.addprevious(element.makeelement("EntityRef", entityRef=name))
        if element.get("entityRef") in selections:
            report.mark(element, "taken")
            above.remove(element)


def _members_of(
    root: _Element, selection: _Element, known: Mapping[str, tuple[str, ...]]
) -> tuple[str, ...]:
    found: dict[str, None] = {}
    for element in selection.iterfind("Members/EntityRef"):
        name = element.get("entityRef", "")
        found |= dict.fromkeys(known.get(name, (name,)))
    for element in selection.iterfind("Members/ByType"):
        tag = _KINDS.get(element.get("objectType", ""), "")
        these = root.iterfind("Entities/ScenarioObject")
        found |= {it.get("name", ""): None for it in these if tag and it.find(tag) is not None}
    return tuple(found)


def _add_triggering_entities(report: ImportReport, actors: _Element) -> None:
    """Add the entities of the trigger of the act, which is when its actors are chosen."""
    act = next(actors.iterancestors("Act"), None)
    there = {element.get("entityRef") for element in actors.iterfind("EntityRef")}
    for element in (
        () if act is None else act.iterfind("StartTrigger//TriggeringEntities/EntityRef")
    ):
        if element.get("entityRef") not in there:
            there.add(element.get("entityRef"))
            actors.append(actors.makeelement("EntityRef", entityRef=element.get("entityRef", "")))
    report.mark(actors, "approximated", _WHOEVER)
