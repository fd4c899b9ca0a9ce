"""What differs in what stands on or beside a road: signals, crosswalks, other objects."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import fields
from math import hypot
from typing import TYPE_CHECKING, Any

from odscen.base.shown import shown_id
from odscen.changes.map_change import ChangePlace, MapChange, metres, of_road
from odscen.changes.paired_lanes import SAME

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from odscen.changes.map_change import ChangedThing
    from odscen.opendrive.road_model import Road


_MOVED = 0.01
_NEAR = 0.5
_PLACE = ("id", "s", "t")
_MS_UNITS = ("m/s", "km/h", "mph")


def furniture_differences(old: Road, new: Road) -> Iterator[MapChange]:
    """Differences of signals, references of signals, and objects of a road."""
    yield from _things(old, new, old.signals, new.signals, _signal_name)
    yield from _things(old, new, old.signal_references, new.signal_references, _reference_name)
    yield from _things(old, new, old.objects, new.objects, _object_name)


def _signal_name(one: Any) -> tuple[ChangedThing, str]:
    return "signal", f"signal {shown_id(one.id)} (type {shown_id(one.type)})"


def _reference_name(one: Any) -> tuple[ChangedThing, str]:
    return "signal reference", f"reference to signal {shown_id(one.id)}"


def _object_name(one: Any) -> tuple[ChangedThing, str]:
    if one.type == "crosswalk":
        return "crosswalk", f"crosswalk {shown_id(one.id)}"
    return "object", f"object {shown_id(one.id)} ({one.type or 'no type'})"


def _things(
    old: Road,
    new: Road,
    before: Sequence[Any],
    after: Sequence[Any],
    name: Callable[[Any], tuple[ChangedThing, str]],
) -> Iterator[MapChange]:
    if before == after:
        return
    pairs, gone, came = _paired(before, after)
    for one in gone:
        what, subject = name(one)
        yield MapChange("removed", what, f"{subject} of {of_road(old.id)}", place=_place(old, one))
    for one in came:
        what, subject = name(one)
        yield MapChange("added", what, f"{subject} of {of_road(new.id)}", place=_place(new, one))
    for first, second in pairs:
        yield from _differences(old, first, second, name)


def _place(road: Road, one: Any) -> ChangePlace:
    return ChangePlace(road.id, one.s, one.s, None, one.t)


def _paired(
    before: Sequence[Any], after: Sequence[Any]
) -> tuple[list[tuple[Any, Any]], list[Any], list[Any]]:
    """Pair by id, the nearest first where an id is not unique; then by type and place."""
    pairs: list[tuple[Any, Any]] = []
    gone = _take_pairs(before, list(after), pairs, key=lambda one: one.id, within=float("inf"))
    taken = {id(second) for _, second in pairs}
    rest = [one for one in after if id(one) not in taken]
    gone = _take_pairs(gone, rest, pairs, key=_kind, within=_NEAR)
    taken = {id(second) for _, second in pairs}
    return pairs, gone, [one for one in after if id(one) not in taken]


def _kind(one: Any) -> tuple[str, str]:
    return getattr(one, "type", one.id), getattr(one, "subtype", "")


def _take_pairs(
    before: Sequence[Any],
    after: Sequence[Any],
    pairs: list[tuple[Any, Any]],
    *,
    key: Callable[[Any], Any],
    within: float,
) -> list[Any]:
    """Add pairs of the same key, nearest first; what found no partner is returned."""
    free: dict[Any, list[Any]] = defaultdict(list)
    for one in after:
        free[key(one)].append(one)
    alone = []
    for one in before:
        near = min(free[key(one)], key=lambda other: _apart(one, other), default=None)
        if near is None or _apart(one, near) > within:
            alone.append(one)
            continue
        free[key(one)] = [other for other in free[key(one)] if other is not near]
        pairs.append((one, near))
    return alone


def _apart(one: Any, other: Any) -> float:
    return hypot(one.s - other.s, one.t - other.t)


def _differences(
    road: Road, old: Any, new: Any, name: Callable[[Any], tuple[ChangedThing, str]]
) -> Iterator[MapChange]:
    what, subject = name(old)
    of = f"{subject} of {of_road(road.id)}"
    place = _place(road, old)
    if _apart(old, new) > _MOVED:
        before, after = (f"s {metres(one.s)} m, t {metres(one.t)} m" for one in (old, new))
        yield MapChange("moved", what, of, before, after, place)
    if old.id != new.id:
        yield MapChange("changed", what, f"id of {of}", old.id, new.id, place=place)
    for field in _fields(old):
        before, after = getattr(old, field), getattr(new, field)
        if field not in _PLACE and not _equal(before, after):
            label = field.replace("_", " ")
            values = _said(old, field), _said(new, field)
            if values[0] == values[1]:
                values = "as it was", "another"
            yield MapChange("changed", what, f"{label} of {of}", *values, place=place)


def _fields(one: Any) -> Sequence[str]:
    names: Sequence[str] = getattr(one, "_fields", ())
    return names or [field.name for field in fields(one)]


def _equal(before: Any, after: Any) -> bool:
    if isinstance(before, float) and isinstance(after, float):
        return abs(before - after) <= SAME
    return bool(before == after)


def _said(one: Any, field: str) -> str:
    value = getattr(one, field)
    if field == "value" and value is not None and one.unit in _MS_UNITS:
        return f"{metres(round(value * 3.6, 2))} km/h"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return metres(value)
    if field == "validities":
        return ", ".join(f"lanes {one.from_lane} to {one.to_lane}" for one in value) or "all lanes"
    if isinstance(value, tuple):
        return f"{len(value)}"
    return str(value) if value not in (None, "") else "none"
