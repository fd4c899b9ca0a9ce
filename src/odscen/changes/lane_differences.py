"""What differs in the lanes of one road: lanes, types, widths, limits, permissions, marks."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from odscen.base.ids import LaneKey
from odscen.changes.map_change import ChangePlace, MapChange, metres, of_lane, of_road
from odscen.changes.paired_lanes import SAME, merged
from odscen.opendrive.road_model import DRIVABLE_TYPES

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from odscen.base.arrays import FloatArray
    from odscen.changes.map_change import ChangedThing, ChangeKind
    from odscen.changes.paired_lanes import PairedStretch
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.road_model import Lane, Road, RoadMark

_SAMPLES = np.linspace(0.0, 1.0 - 1e-9, 9)  # the end belongs to the next record
_KMH = 3.6


@dataclass(frozen=True, slots=True)
class RoadPair:
    """A road in both maps, with the tables of both maps and the lanes paired."""

    before: Road
    after: Road
    tables: tuple[RoadTable, RoadTable]
    stretches: tuple[PairedStretch, ...]


class _PieceDifference(NamedTuple):
    """A difference on a piece of a road, before pieces that say the same are joined."""

    what: ChangedThing
    lane: int | None
    values: tuple[str | None, str | None]
    s0: float
    s1: float
    added: bool = False
    size: float = 0.0


def lane_differences(pair: RoadPair) -> Iterator[MapChange]:
    """Differences of the lanes of a road, from the centre line outwards, along s."""
    differences: list[_PieceDifference] = []
    for stretch in pair.stretches:
        differences += _lanes_of(stretch)
        for old, new in stretch.pairs:
            if old is not None and new is not None:
                differences += _compare_properties(old, new, stretch)
                if old.id:
                    differences += _compare_widths(pair, stretch, (old, new))
    differences += _compare_limits(pair)
    for join_piece in _join_pieces(differences):
        yield _lane_change(pair, join_piece)


def _lanes_of(stretch: PairedStretch) -> Iterator[_PieceDifference]:
    for old, new in stretch.pairs:
        if new is None and old is not None:
            yield _PieceDifference("lane", old.id, (old.type, None), stretch.s0, stretch.s1)
        elif old is None and new is not None:
            yield _PieceDifference(
                "lane", new.id, (None, new.type), stretch.s0, stretch.s1, added=True
            )


# ------------------------------------------------------------------------- what holds from s on
def _describe_mark(mark: RoadMark | None) -> str:
    if mark is None:
        return "none"
    change = "" if mark.lane_change == "both" else f", lane change {mark.lane_change}"
    weight = "" if mark.weight == "standard" else f", {mark.weight}"
    return f"{mark.type} {mark.color}{weight}{change}"


def _records_holding_at(records: Sequence[Any], s: float) -> list[Any]:
    """Records that hold at s: those with the last start before it."""
    started = [record for record in records if record.s <= s + SAME]
    return [record for record in started if record.s == started[-1].s]


def _last_record_at(records: Sequence[Any], s: float) -> Any:
    holding = _records_holding_at(records, s)
    return holding[-1] if holding else None


def _describe_height(lane: Lane, s: float) -> str:
    height = _last_record_at(lane.heights, s)
    if height is None:
        return "0 m"
    return f"{metres(height.inner)} m inside, {metres(height.outer)} m outside"


def _describe_access(lane: Lane, s: float) -> str:
    return ", ".join(
        sorted(
            f"{record.rule} {record.restriction}" for record in _records_holding_at(lane.access, s)
        )
    )


_PROPERTIES: tuple[tuple[ChangedThing, Callable[[Lane, float], str]], ...] = (
    ("lane type", lambda lane, _: lane.type),
    ("lane direction", lambda lane, _: lane.direction),
    ("lane height", _describe_height),
    ("permission", lambda lane, s: _describe_access(lane, s) or "as the lane's type"),
    ("road mark", lambda lane, s: _describe_mark(_last_record_at(lane.road_marks, s))),
)


def _compare_properties(old: Lane, new: Lane, stretch: PairedStretch) -> Iterator[_PieceDifference]:
    if old == new:
        return
    starts = (
        record.s
        for lane in (old, new)
        for records in (lane.heights, lane.access, lane.road_marks)
        for record in records
    )
    inside = [s - stretch.s0 for s in starts if s > stretch.s0]
    pieces = merged(inside, end=stretch.s1 - stretch.s0)
    for low, high in zip(pieces, [*pieces[1:], stretch.s1 - stretch.s0], strict=True):
        s0, s1 = stretch.s0 + low, stretch.s0 + high
        for what, value in _PROPERTIES:
            values = value(old, 0.5 * (s0 + s1)), value(new, 0.5 * (s0 + s1))
            if values[0] != values[1]:
                yield _PieceDifference(what, old.id, values, s0, s1)


# ------------------------------------------------------------------------- widths and limits
def _compare_widths(
    pair: RoadPair, stretch: PairedStretch, lanes: tuple[Lane, Lane]
) -> Iterator[_PieceDifference]:
    """Pieces on which the widths differ, with those at the place where they differ most."""
    if lanes[0].widths == lanes[1].widths and lanes[0].borders == lanes[1].borders == ():
        return
    starts = [c.s for lane in lanes for c in (*lane.widths, *lane.borders) if c.s > stretch.s0]
    length = stretch.s1 - stretch.s0
    pieces = merged((s - stretch.s0 for s in starts), end=length)
    for low, high in zip(pieces, [*pieces[1:], length], strict=True):
        at = stretch.s0 + low + (high - low) * _SAMPLES
        old, new = (
            _widths_at(table, LaneKey(road.id, section, lane.id), at)
            for table, road, section, lane in zip(
                pair.tables, (pair.before, pair.after), stretch.sections, lanes, strict=True
            )
        )
        apart = np.abs(new - old)
        worst = int(np.argmax(apart))
        if apart[worst] > SAME:
            values = f"{metres(float(old[worst]))} m", f"{metres(float(new[worst]))} m"
            s0, s1 = stretch.s0 + low, stretch.s0 + high
            size = float(apart[worst])
            yield _PieceDifference("width", lanes[0].id, values, s0, s1, size=size)


def _widths_at(table: RoadTable, key: LaneKey, s: FloatArray) -> FloatArray:
    return table.lane_width(np.full(s.size, table.lane_index[key]), s)


def _compare_limits(pair: RoadPair) -> list[_PieceDifference]:
    """Limits as they act, of lanes for motor vehicles: one of the road where all change alike."""
    differences: list[_PieceDifference] = []
    for stretch in pair.stretches:
        lanes = [
            (old, new)
            for old, new in stretch.pairs
            if old is not None and new is not None and old.type in DRIVABLE_TYPES
        ]
        starts = [
            record.s - stretch.s0
            for road in (pair.before, pair.after)
            for record in (*road.types, *_speeds_of_road(road))
            if record.s > stretch.s0
        ]
        length = stretch.s1 - stretch.s0
        pieces = merged(starts, end=length)
        for low, high in zip(pieces, [*pieces[1:], length], strict=True):
            differences += _limits_of(pair, stretch, lanes, (stretch.s0 + low, stretch.s0 + high))
    return differences


def _speeds_of_road(road: Road) -> Iterable[Any]:
    return (
        speed
        for section in road.sections
        for lane in section.lanes.values()
        for speed in lane.speeds
    )


def _limits_of(
    pair: RoadPair,
    stretch: PairedStretch,
    lanes: Sequence[tuple[Lane, Lane]],
    between: tuple[float, float],
) -> list[_PieceDifference]:
    middle = np.array([0.5 * (between[0] + between[1])])
    values = []
    for both in lanes:
        old, new = (
            table.speed_limit(
                np.array([table.lane_index[LaneKey(road.id, section, lane.id)]]), middle
            )[0]
            for table, road, section, lane in zip(
                pair.tables, (pair.before, pair.after), stretch.sections, both, strict=True
            )
        )
        values.append((both[0].id, (_describe_limit(old), _describe_limit(new))))
    changed = [(lane, limits) for lane, limits in values if limits[0] != limits[1]]
    if changed and len(changed) == len(values) and len({limits for _, limits in changed}) == 1:
        return [_PieceDifference("limit", None, changed[0][1], *between)]
    return [_PieceDifference("limit", lane, limits, *between) for lane, limits in changed]


def _describe_limit(value: float) -> str:
    if math.isnan(value):
        return "none given"
    return "no limit" if math.isinf(value) else f"{metres(round(value * _KMH, 2))} km/h"


# ------------------------------------------------------------------------- one line each
def _join_pieces(found: Iterable[_PieceDifference]) -> list[_PieceDifference]:
    """Pieces of a lane that follow each other and say the same, as one.

    Widths are one from end to end, with the values where they differ most.
    """
    kept: list[_PieceDifference] = []
    open_pieces: dict[tuple[Any, ...], int] = {}
    for piece_difference in found:
        values = None if piece_difference.what == "width" else piece_difference.values
        key = (piece_difference.what, piece_difference.lane, piece_difference.added, values)
        at = open_pieces.get(key)
        if at is not None and abs(kept[at].s1 - piece_difference.s0) <= SAME:
            widest = max(kept[at], piece_difference, key=lambda piece: piece.size)
            kept[at] = widest._replace(s0=kept[at].s0, s1=piece_difference.s1)
        else:
            open_pieces[key] = len(kept)
            kept.append(piece_difference)
    return kept


def _lane_change(pair: RoadPair, found: _PieceDifference) -> MapChange:
    road = pair.after.id if found.added else pair.before.id
    of = of_road(road) if found.lane is None else of_lane(road, found.lane)
    kind: ChangeKind = "changed"
    if found.what == "lane":
        kind = "added" if found.added else "removed"
    return MapChange(
        kind,
        found.what,
        of if found.what == "lane" else f"{found.what} of {of}",
        *found.values,
        place=ChangePlace(road, found.s0, found.s1, found.lane),
    )
