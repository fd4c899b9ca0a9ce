"""Entities that appear and vanish; ScenarioRunner has them under the ground instead."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from odscen.formats.openscenario.dialect import xml
from odscen.formats.openscenario.xosc_places import UNDERGROUND

if TYPE_CHECKING:
    from lxml.etree import _Element

    from odscen.formats.openscenario.dialect import Dialect
    from odscen.formats.openscenario.xosc_places import GroundPose

BELOW: Final = f"{UNDERGROUND:g} m under the ground, for ScenarioRunner adds and deletes nothing"


def private(content: _Element) -> _Element:
    """``PrivateAction``."""
    return xml("PrivateAction", content)


def delete_entity(name: str, last: GroundPose, dialect: Dialect) -> _Element:
    """``GlobalAction`` that removes the entity of a name.

    ScenarioRunner refuses that, so it is put under the ground where it was ``last``.
    """
    if dialect.for_scenario_runner:
        return private(xml("TeleportAction", last.below().element()))
    return xml("GlobalAction", xml("EntityAction", xml("DeleteEntityAction"), entityRef=name))


def add_entity(name: str, at: GroundPose, dialect: Dialect) -> _Element:
    """``GlobalAction`` that adds the entity of a name.

    ScenarioRunner refuses that, so it comes from under the ground.
    """
    if dialect.for_scenario_runner:
        return private(xml("TeleportAction", at.element()))
    added = xml("AddEntityAction", at.element())
    return xml("GlobalAction", xml("EntityAction", added, entityRef=name))


def speed_action(speed: float, shape: str, dimension: str, value: float) -> _Element:
    """``PrivateAction`` that changes the speed."""
    return private(
        xml(
            "LongitudinalAction",
            xml(
                "SpeedAction",
                xml(
                    "SpeedActionDynamics",
                    dynamicsShape=shape,
                    dynamicsDimension=dimension,
                    value=float(value),
                ),
                xml("SpeedActionTarget", xml("AbsoluteTargetSpeed", value=float(speed))),
            ),
        )
    )
