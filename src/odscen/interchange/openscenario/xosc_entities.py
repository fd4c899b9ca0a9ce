"""Actors as entities: sizes, performance, and as properties what OpenSCENARIO has no word for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from odscen.base.categories import Category
from odscen.interchange.openscenario.dialect import Dialect, xml

if TYPE_CHECKING:
    from lxml.etree import _Element

    from odscen.interchange.openscenario.xosc_places import Places
    from odscen.scenario.document.scenario_document import Actor

CATEGORIES: Final = {
    Category.CAR: "car",
    Category.VAN: "van",
    Category.TRUCK: "truck",
    Category.BUS: "bus",
    Category.MOTORCYCLE: "motorbike",
    Category.BICYCLE: "bicycle",
}
_FASTEST: Final = {Category.TRUCK: 36.0, Category.BUS: 28.0, Category.BICYCLE: 14.0}
_USUAL_FASTEST: Final = 70.0
"""m/s; limits of the vehicle, not of its driver."""
_MASS: Final = {Category.PEDESTRIAN: 75.0}
PREFIX: Final = "odscen."
"""Of properties that odscen reads again."""


def entity(actor: Actor, places: Places, dialect: Dialect) -> _Element:
    """``ScenarioObject`` of an actor."""
    walks = actor.category is Category.PEDESTRIAN
    made = _pedestrian(actor, places, dialect) if walks else _vehicle(actor, places)
    return xml("ScenarioObject", made, name=actor.id)


def _vehicle(actor: Actor, places: Places) -> _Element:
    body = places.body(actor)
    wheel = 0.6
    fastest = max(_FASTEST.get(actor.category, _USUAL_FASTEST), actor.speed or 0.0)
    performance = xml("Performance", maxSpeed=fastest, maxAcceleration=10.0, maxDeceleration=10.0)
    about = {"wheelDiameter": wheel, "trackWidth": 0.85 * body.width, "positionZ": wheel / 2}
    axles = xml(
        "Axles",
        xml("FrontAxle", maxSteering=0.6, positionX=0.56 * body.length, **about),
        xml("RearAxle", maxSteering=0.0, positionX=0.0, **about),
    )
    return xml(
        "Vehicle",
        xml("ParameterDeclarations"),
        _box(actor, places),
        performance,
        axles,
        _properties(actor),
        name=actor.model or actor.category,
        vehicleCategory=CATEGORIES[actor.category],
    )


def _pedestrian(actor: Actor, places: Places, dialect: Dialect) -> _Element:
    model = actor.model or "pedestrian"
    return xml(
        "Pedestrian",
        xml("ParameterDeclarations"),
        _box(actor, places),
        _properties(actor),
        name=model,
        mass=_MASS[Category.PEDESTRIAN],
        pedestrianCategory="pedestrian",
        model=model if dialect.minor == 0 else None,
    )


def _box(actor: Actor, places: Places) -> _Element:
    body = places.body(actor)
    return xml(
        "BoundingBox",
        xml("Center", x=places.centre_ahead(actor), y=0.0, z=body.height / 2),
        xml("Dimensions", width=body.width, length=body.length, height=body.height),
    )


def _properties(actor: Actor) -> _Element:
    """Fields of the actor that OpenSCENARIO has no word for; ScenarioRunner wants the element."""
    said = actor.model_dump(
        mode="json",
        exclude_defaults=True,
        exclude={"id", "category", "spawn", "goal", "lateral_offset", "initial_speed", "depart"},
    )
    kind = "ego_vehicle" if actor.ego else "simulation"
    rows = [xml("Property", name="type", value=kind)]
    rows += [xml("Property", name=PREFIX + name, value=_text(v)) for name, v in said.items()]
    return xml("Properties", *rows)


def _text(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
