"""Actors as entities: sizes, performance, and as properties what OpenSCENARIO has no word for."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from odscen.base.categories import Category
from odscen.formats.openscenario.dialect import Dialect, xml
from odscen.formats.openscenario.xosc_places import reference_behind

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lxml.etree import _Element

    from odscen.base.categories import Body
    from odscen.formats.openscenario.xosc_places import Places
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


@dataclass(frozen=True, slots=True, kw_only=True)
class EntityFacts:
    """What an entity says of a road user; ``speed`` is at most desired, m/s."""

    id: str
    category: Category
    model: str | None
    speed: float | None
    body: Body
    properties: Mapping[str, str]


def entity(actor: Actor, places: Places, dialect: Dialect) -> _Element:
    """``ScenarioObject`` of an actor."""
    facts = EntityFacts(
        id=actor.id,
        category=actor.category,
        model=actor.model,
        speed=actor.speed,
        body=places.body(actor),
        properties=_actor_properties(actor),
    )
    return entity_of(facts, dialect)


def entity_of(facts: EntityFacts, dialect: Dialect) -> _Element:
    """``ScenarioObject`` of a road user."""
    walks = facts.category is Category.PEDESTRIAN
    made = _write_pedestrian(facts, dialect) if walks else _write_vehicle(facts)
    return xml("ScenarioObject", made, name=facts.id)


def _write_vehicle(facts: EntityFacts) -> _Element:
    body = facts.body
    wheel = 0.6
    fastest = max(_FASTEST.get(facts.category, _USUAL_FASTEST), facts.speed or 0.0)
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
        _write_box(facts),
        performance,
        axles,
        _property_rows(facts),
        name=facts.model or facts.category,
        vehicleCategory=CATEGORIES[facts.category],
    )


def _write_pedestrian(facts: EntityFacts, dialect: Dialect) -> _Element:
    model = facts.model or "pedestrian"
    return xml(
        "Pedestrian",
        xml("ParameterDeclarations"),
        _write_box(facts),
        _property_rows(facts),
        name=model,
        mass=_MASS[Category.PEDESTRIAN],
        pedestrianCategory="pedestrian",
        model=model if dialect.minor == 0 else None,
    )


def _write_box(facts: EntityFacts) -> _Element:
    body = facts.body
    ahead = reference_behind(facts.category, body.length)
    return xml(
        "BoundingBox",
        xml("Center", x=ahead, y=0.0, z=body.height / 2),
        xml("Dimensions", width=body.width, length=body.length, height=body.height),
    )


def _actor_properties(actor: Actor) -> dict[str, str]:
    """Fields of the actor, those too that a position or speed says without the node's name."""
    fields = actor.model_dump(
        mode="json",
        exclude_defaults=True,
        exclude={"id", "category"},
    )
    kind = "ego_vehicle" if actor.ego else "simulation"
    return {
        "type": kind,
        **{PREFIX + name: _property_text(value) for name, value in fields.items()},
    }


def _property_rows(facts: EntityFacts) -> _Element:
    """``Properties``, which ScenarioRunner wants even if it is empty."""
    rows = [xml("Property", name=name, value=value) for name, value in facts.properties.items()]
    return xml("Properties", *rows)


def _property_text(value: object) -> str:
    """JSON, but for texts that are none themselves."""
    text = value if isinstance(value, str) else json.dumps(value)
    try:
        json.loads(text)
    except ValueError:
        return text
    return json.dumps(value)
