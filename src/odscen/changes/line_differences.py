"""What differs in a road as a whole: its line, heights, types, name and what it leads to."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.changes.map_change import ChangePlace, MapChange, metres, of_road
from odscen.changes.paired_lanes import SAME, merged

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from odscen.base.arrays import FloatArray
    from odscen.changes.lane_differences import RoadPair
    from odscen.changes.map_change import ChangedThing
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.road_model import Road, RoadLink

_STEP = 2.0
_LINE = 0.01
_ANGLE = 1e-5


def road_differences(pair: RoadPair, roads: Mapping[str, str]) -> Iterator[MapChange]:
    """Differences of a road beside its lanes.

    Parameters
    ----------
    pair
        The road in both maps.
    roads
        Id before by id after, of each road that is in both maps.
    """
    old, new = pair.before, pair.after
    yield from _values(old, new)
    if old == new:
        return
    yield from _line(pair)
    yield from _types(old, new)
    for end in ("predecessor", "successor"):
        yield from _link(old, new, end, roads)


def _values(old: Road, new: Road) -> Iterator[MapChange]:
    place = ChangePlace(old.id, 0.0, old.length)
    for name, before, after in (
        ("id", old.id, new.id),
        ("name", old.name, new.name),
        ("rule", old.rule, new.rule),
    ):
        if before != after:
            subject = f"{name} of {of_road(old.id)}"
            said = before or "none", after or "none"
            yield MapChange("changed", "road", subject, *said, place=place)
    if abs(old.length - new.length) > SAME:
        said = f"{metres(old.length)} m", f"{metres(new.length)} m"
        place = ChangePlace(old.id, old.length, old.length)
        yield MapChange("changed", "geometry", f"length of {of_road(old.id)}", *said, place=place)


def _line(pair: RoadPair) -> Iterator[MapChange]:
    """Reference line, height, roll and lane offset, each with its greatest difference."""
    end = min(pair.before.length, pair.after.length)
    s = np.linspace(0.0, end, max(2, int(end / _STEP) + 1))
    old, new = (
        _evaluated(table, road, s)
        for table, road in zip(pair.tables, (pair.before, pair.after), strict=True)
    )
    moved = np.hypot(old["x"] - new["x"], old["y"] - new["y"])
    if moved.max() > _LINE:
        yield MapChange(
            "moved",
            "geometry",
            f"line of {of_road(pair.before.id)}",
            None,
            f"by up to {metres(float(moved.max()))} m",
            place=_where(pair, s, moved, _LINE),
        )
    things: tuple[tuple[ChangedThing, str, float], ...] = (
        ("elevation", "m", SAME),
        ("superelevation", "rad", _ANGLE),
        ("lane offset", "m", SAME),
    )
    for what, unit, same in things:
        apart = np.abs(old[what] - new[what])
        at = int(np.argmax(apart))
        if apart[at] > same:
            subject = f"{what} of {of_road(pair.before.id)} at s {metres(float(s[at]))} m"
            before, after = (f"{metres(float(one[what][at]))} {unit}" for one in (old, new))
            place = _where(pair, s, apart, same)
            yield MapChange("changed", what, subject, before, after, place)


def _evaluated(table: RoadTable, road: Road, s: FloatArray) -> dict[str, FloatArray]:
    row = np.full(s.size, table.road_index[road.id])
    line = table.reference(row, s)
    return {
        "x": line.x,
        "y": line.y,
        "elevation": line.z,
        "superelevation": line.roll,
        "lane offset": table.lane_offset(row, s),
    }


def _where(pair: RoadPair, s: FloatArray, apart: FloatArray, same: float) -> ChangePlace:
    at = np.flatnonzero(apart > same)
    return ChangePlace(pair.before.id, float(s[at[0]]), float(s[at[-1]]))


def _types(old: Road, new: Road) -> Iterator[MapChange]:
    if old.types == new.types:
        return
    end = min(old.length, new.length)
    starts = merged((one.s for road in (old, new) for one in road.types), end=end)
    before = None
    for s0, s1 in zip(starts, [*starts[1:], end], strict=True):
        said = _type_at(old, 0.5 * (s0 + s1)), _type_at(new, 0.5 * (s0 + s1))
        if said[0] != said[1] and said != before:
            subject = f"type of {of_road(old.id)}"
            place = ChangePlace(old.id, s0, s1)
            yield MapChange("changed", "road type", subject, *said, place=place)
        before = said


def _type_at(road: Road, s: float) -> str:
    holding = [one.type for one in road.types if one.s <= s]
    return holding[-1] if holding else "none"


def _link(old: Road, new: Road, end: str, roads: Mapping[str, str]) -> Iterator[MapChange]:
    before: RoadLink | None = getattr(old, end)
    after: RoadLink | None = getattr(new, end)
    said = _link_words(before, None), _link_words(after, roads)
    if said[0] != said[1]:
        at = 0.0 if end == "predecessor" else old.length
        subject = f"{end} of {of_road(old.id)}"
        yield MapChange("changed", "road link", subject, *said, place=ChangePlace(old.id, at, at))


def _link_words(link: RoadLink | None, roads: Mapping[str, str] | None) -> str:
    if link is None:
        return "none"
    number: Any = link.element_id
    if roads is not None and link.element_type == "road":
        number = roads.get(number, number)
    end = f", its {link.contact_point}" if link.contact_point else ""
    return f"{link.element_type} {number}{end}"
