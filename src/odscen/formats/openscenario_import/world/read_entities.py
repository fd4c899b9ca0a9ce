"""Entities: categories, bodies and the reference point."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from odscen.base.categories import DEFAULT_BODY, Body, Category
from odscen.formats.openscenario_import.source.own_files import is_own, own_fields

if TYPE_CHECKING:
    from lxml.etree import _Element

    from odscen.formats.openscenario_import.import_report import ImportReport

_CATEGORIES: Final = {
    "car": Category.CAR,
    "van": Category.VAN,
    "truck": Category.TRUCK,
    "bus": Category.BUS,
    "motorbike": Category.MOTORCYCLE,
    "bicycle": Category.BICYCLE,
}
_LARGEST: Final = Body(30.0, 5.0, 10.0)
"""Metres, as of scenarios."""
_NEAREST: Final = {"semitrailer": Category.TRUCK, "trailer": Category.TRUCK}
EGO: Final = re.compile(r"ego|hero|ego_vehicle|host|vut", re.IGNORECASE)

_REFERENCE_POINT: Final = "refpoint_x_offset"
"""Property of a vehicle: metres from its rear axle to the point that positions are of."""


@dataclass(slots=True)
class ReadEntity:
    """An entity of the file; ``ahead`` is from its reference point to its centre, metres.

    ``body`` is its size, ``sized`` whether the file says it.

    ``own`` are fields of an actor, in a file that odscen wrote. ``controlled`` says whether the
    file assigns a controller to it anywhere.
    """

    element: _Element
    id: str
    category: Category
    body: Body
    ahead: float
    sized: bool = False
    ego: bool = False
    obstacle: bool = False
    controlled: bool = False
    own: dict[str, Any] | None = None

    @property
    def length(self) -> float:
        """Of its body, metres."""
        return self.body.length


def plain_id(text: str, taken: set[str]) -> str:
    """Identifier made of a name, unlike those that are taken."""
    bare = re.sub(r"[^A-Za-z0-9_.-]+", "-", text).strip("-_.")[:56] or "one"
    found, number = bare, 1
    while found in taken:
        number += 1
        found = f"{bare}-{number}"
    taken.add(found)
    return found


def read_entities(report: ImportReport, root: _Element) -> dict[str, ReadEntity]:
    """Entities by their name in the file; the ego is the one that is called so, or none."""
    entities: dict[str, ReadEntity] = {}
    taken: set[str] = set()
    group = report.child(root, "Entities")
    for element in () if group is None else report.children(group, "ScenarioObject"):
        name = report.word(element, "name")
        thing = report.child(element, "Vehicle", "Pedestrian", "MiscObject")
        if thing is None:
            report.mark(element, "refused", "an entity without a body that odscen knows")
            continue
        for controller in element.iterchildren("ObjectController"):
            report.ignore(controller, "a controller is a program beside the file; see --ego")
        entity = _read_entity(report, thing, plain_id(name, taken))
        if entity is None:
            report.mark(element, "refused", "its category has no counterpart")
        else:
            entity.controlled = _has_controller(root, element, name)
            entities[name] = entity
    if is_own(root):
        for entity in entities.values():
            entity.own = own_fields(report, entity.element)
            entity.ego = bool(entity.own and entity.own.get("ego"))
        return entities
    drivers = [entity for name, entity in entities.items() if EGO.fullmatch(name)]
    for driver in drivers[:1]:
        driver.ego = driver.category is not Category.PEDESTRIAN
    return entities


def _has_controller(root: _Element, entity: _Element, name: str) -> bool:
    """Whether a file assigns a controller to an entity: with its body, at first or in the story."""
    if entity.find("ObjectController") is not None:
        return True
    for action in root.iter("AssignControllerAction"):
        private = next(action.iterancestors("Private"), None)
        group = next(action.iterancestors("ManeuverGroup"), None)
        if private is not None and private.get("entityRef") == name:
            return True
        if group is not None and any(
            ref.get("entityRef") == name for ref in group.iterfind("Actors/EntityRef")
        ):
            return True
    return False


def _read_entity(report: ImportReport, thing: _Element, own: str) -> ReadEntity | None:
    kind = thing.get("vehicleCategory", "car")
    if thing.tag == "Pedestrian":
        category: Category | None = Category.PEDESTRIAN
    elif thing.tag == "MiscObject":
        category = Category.CAR
        report.mark(thing, "approximated", "an object is a stationary car")
    else:
        category = _CATEGORIES.get(kind) or _NEAREST.get(kind)
        if kind in _NEAREST:
            words = f"a {kind} is a {_NEAREST[kind]} by itself: nothing tows it"
            report.mark(thing, "approximated", words)
    if category is None:
        report.mark(thing, "refused", f"vehicles of category {kind!r}")
        return None
    body, ahead, sized = DEFAULT_BODY[category], 0.0, False
    box = report.child(thing, "BoundingBox")
    if box is not None:
        centre, size = report.child(box, "Center"), report.child(box, "Dimensions")
        if centre is not None:
            ahead = report.number(centre, "x", 0.0)
        # esmini's name for a vehicle whose places are those of another point than its rear axle.
        for named in thing.iterfind(f"Properties/Property[@name='{_REFERENCE_POINT}']"):
            ahead -= report.number(named, "value", 0.0)
            report.take(named)
        if size is not None:
            body, sized = _read_size(report, size, body), True
    obstacle = thing.tag == "MiscObject"
    return ReadEntity(thing, own, category, body, ahead, sized, obstacle=obstacle)


def _read_size(report: ImportReport, size: _Element, usual: Body) -> Body:
    """Size of a box, within what bodies can have."""
    given = [float(report.number(size, name, getattr(usual, name))) for name in Body._fields]
    used = [min(max(value, 0.1), most) for value, most in zip(given, _LARGEST, strict=True)]
    if used != given:
        long, wide, high = used
        words = (
            f"{long:g} m long, {wide:g} m wide and {high:g} m high: no body is larger or smaller"
        )
        report.mark(size, "approximated", words)
    return Body(*used)
