"""How an actor appears and vanishes in files that odscen wrote."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from lxml.etree import _Element

    from odscen.formats.openscenario_import.places.read_positions import PositionReader
    from odscen.formats.openscenario_import.world.read_entities import ReadEntity

Made = dict[str, Any]
_SAME: Final = 1e-3
"""Metres, radians and m/s."""


def own_entity_action(
    content: _Element, entity: ReadEntity, positions: PositionReader
) -> Made | None:
    """``appear`` or ``vanish`` of an actor; ``None`` of another global action."""
    about = content.find("EntityAction")
    if about is None or about.get("entityRef") != entity.id:
        return None
    if about.find("DeleteEntityAction") is not None:
        return {"vanish": {}}
    position = about.find("AddEntityAction/Position")
    if position is None:
        return None
    at, own = positions.point(position).moved(entity.ahead), entity.own or {}
    start = positions.of_node(own.get("spawn", ""))
    if start is not None:
        start = start.moved(
            float(own.get("longitudinal_offset", 0.0)), float(own.get("lateral_offset", 0.0))
        )
        if at.away(start) < _SAME and abs(at.hdg - start.hdg) < _SAME:
            return {"appear": {}}
    return {"appear": {"at": [round(value, 4) for value in (at.x, at.y, at.hdg)]}}


def with_speed(then: list[Made], entity: ReadEntity) -> list[Made]:
    """Actions in which one that appears has the speed that is written beside it."""
    if len(then) < 2 or "appear" not in then[0]:
        return then
    first, *rest = then
    to = rest[0].get("speed", {}).get("to", 0.0)  # of a pedestrian at 0 a stop
    if abs(to - ((entity.own or {}).get("initial_speed") or 0.0)) > _SAME:
        first = {"appear": first["appear"] | {"speed": to}}
    return [first, *rest[1:]]
