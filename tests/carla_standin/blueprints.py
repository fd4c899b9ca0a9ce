"""Actor definitions: odscen's asset catalogue, a camera and what else the tests spawn."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from odscen.base.categories import Category
from odscen.simulators.assets import Blueprint, shipped_assets
from tests.carla_standin import wire

CAMERA, LIDAR, RADAR = "sensor.camera.rgb", "sensor.lidar.ray_cast", "sensor.other.radar"
WALKER_CONTROLLER = "controller.ai.walker"

_BOOL, _INT, _FLOAT, _STRING, _COLOR = range(5)
_TWO_WHEELED = {Category.MOTORCYCLE, Category.BICYCLE}
_TAGS = {
    Category.CAR: 14,
    Category.VAN: 14,
    Category.TRUCK: 15,
    Category.BUS: 16,
    Category.MOTORCYCLE: 18,
    Category.BICYCLE: 19,
    Category.PEDESTRIAN: 12,
}
"""CARLA's semantic tags."""
TRAFFIC_LIGHT_TAG, SIGN_TAG, NO_TAG = 7, 8, 0


@dataclass(frozen=True, slots=True)
class Attribute:
    """An attribute of a blueprint; values travel as text."""

    id: str
    type: int
    value: str
    recommended: tuple[str, ...] = ()
    modifiable: bool = False

    def wire(self) -> list[Any]:
        """ActorAttribute."""
        recommended = list(self.recommended)
        kind = wire.attribute_type(self.type)
        return [self.id, kind, self.value, recommended, self.modifiable, False]


@dataclass(frozen=True, slots=True)
class Definition:
    """What can be spawned. ``half_size`` and ``box_height`` (of its centre) are metres."""

    uid: int
    id: str
    attributes: tuple[Attribute, ...]
    half_size: tuple[float, float, float] = (0.0, 0.0, 0.0)
    box_height: float = 0.0
    semantic_tag: int = NO_TAG

    def wire(self) -> list[Any]:
        """ActorDefinition."""
        tags = ",".join(self.id.split("."))
        return [self.uid, self.id, tags, [attribute.wire() for attribute in self.attributes]]

    @property
    def has_body(self) -> bool:
        """Whether it needs room where it is spawned."""
        return self.half_size[0] > 0.0


def definitions() -> dict[str, Definition]:
    """Everything that can be spawned, by id."""
    known = [
        _road_user(uid, blueprint)
        for uid, blueprint in enumerate(shipped_assets().blueprints.values(), start=1)
    ]
    known.append(Definition(len(known) + 1, WALKER_CONTROLLER, (_role("default"),)))
    known.append(Definition(len(known) + 1, "sensor.other.lane_invasion", (_role("front"),)))
    known.append(Definition(len(known) + 1, CAMERA, _camera_attributes()))
    known.append(Definition(len(known) + 1, LIDAR, _scanner_attributes()))
    known.append(
        Definition(
            len(known) + 1,
            RADAR,
            (*_scanner_attributes(), Attribute("horizontal_fov", _FLOAT, "30.0", modifiable=True)),
        )
    )
    return {definition.id: definition for definition in known}


def _road_user(uid: int, blueprint: Blueprint) -> Definition:
    body = blueprint.body
    walks = blueprint.category is Category.PEDESTRIAN
    return Definition(
        uid,
        blueprint.id,
        _walker_attributes(blueprint) if walks else _vehicle_attributes(blueprint),
        half_size=(body.length / 2, body.width / 2, body.height / 2),
        # A vehicle stands on its origin, a walker's origin is in its middle.
        box_height=0.0 if walks else body.height / 2,
        semantic_tag=_TAGS[blueprint.category],
    )


def _vehicle_attributes(blueprint: Blueprint) -> tuple[Attribute, ...]:
    wheels = 2 if blueprint.category in _TWO_WHEELED else 4
    lit = "false" if blueprint.category is Category.BICYCLE else "true"
    return (
        _role("autopilot", "autopilot", "scenario", "ego_vehicle"),
        Attribute("color", _COLOR, "180,180,180", ("180,180,180", "20,40,120"), modifiable=True),
        Attribute("sticky_control", _BOOL, "true", modifiable=True),
        Attribute("object_type", _STRING, ""),
        Attribute("number_of_wheels", _INT, str(wheels)),
        Attribute("base_type", _STRING, blueprint.base_type),
        Attribute("special_type", _STRING, blueprint.special_type),
        Attribute("generation", _INT, str(blueprint.generation or 0)),
        Attribute("has_lights", _BOOL, lit),
        Attribute("has_dynamic_doors", _BOOL, str(_has_doors(blueprint)).lower()),
    )


def _has_doors(blueprint: Blueprint) -> bool:
    """Whether its doors open: here all of the newer models that have doors, really some of them."""
    return blueprint.category not in _TWO_WHEELED and blueprint.generation == 2


def _walker_attributes(blueprint: Blueprint) -> tuple[Attribute, ...]:
    return (
        _role("pedestrian"),
        Attribute("is_invincible", _BOOL, "true", modifiable=True),
        Attribute("speed", _FLOAT, "0.0", ("0.0", "1.43", "3.35"), modifiable=True),
        Attribute("age", _STRING, blueprint.age or "adult"),
        Attribute("generation", _INT, "2"),
    )


def _camera_attributes() -> tuple[Attribute, ...]:
    return (
        _role("front"),
        Attribute("image_size_x", _INT, "800", modifiable=True),
        Attribute("image_size_y", _INT, "600", modifiable=True),
        Attribute("fov", _FLOAT, "90.0", modifiable=True),
        Attribute("sensor_tick", _FLOAT, "0.0", modifiable=True),
    )


def _scanner_attributes() -> tuple[Attribute, ...]:
    return (
        _role("front"),
        Attribute("range", _FLOAT, "100.0", modifiable=True),
        Attribute("sensor_tick", _FLOAT, "0.0", modifiable=True),
    )


def _role(value: str, *recommended: str) -> Attribute:
    return Attribute("role_name", _STRING, value, recommended or (value,), modifiable=True)
