"""Which lane of a road before is which lane of it after, stretch by stretch."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from odscen.opendrive.road_model import Cubic, Lane, LaneSection, Road

SAME = 0.001
"""Metres (and m/s, radians) up to which two values are one: files are written in millimetres."""

_MISSING = 3.0
_OTHER_TYPE = 2.0
_OTHER_DETAIL = 0.1

LanePair = tuple["Lane | None", "Lane | None"]


class PairedStretch(NamedTuple):
    """A part of a road on which neither map changes its lane section; road coordinates, metres.

    ``pairs`` has each lane of both maps once, from the centre line outwards, right side first; the
    centre line itself comes first of all. ``sections`` are the indices of the lane sections.
    """

    s0: float
    s1: float
    sections: tuple[int, int]
    pairs: tuple[LanePair, ...]


def paired_stretches(before: Road, after: Road) -> list[PairedStretch]:
    """Stretches of a road that both maps have, along growing s, up to the shorter one's end.

    Parameters
    ----------
    before, after
        The same road in two maps. Their sections need not begin at the same places.
    """
    end = min(before.length, after.length)
    starts = merged((section.s for road in (before, after) for section in road.sections), end=end)
    stretches = []
    for s0, s1 in zip(starts, [*starts[1:], end], strict=True):
        middle = 0.5 * (s0 + s1)
        sections = _section_at(before, middle), _section_at(after, middle)
        pairs = paired_lanes(before.sections[sections[0]], after.sections[sections[1]])
        stretches.append(PairedStretch(s0, s1, sections, pairs))
    return stretches


def merged(places: Iterable[float], *, end: float) -> list[float]:
    """Places from 0 to ``end`` in order, those within :data:`SAME` of another once."""
    kept = [0.0]
    for place in sorted(places):
        if place - kept[-1] > SAME and end - place > SAME:
            kept.append(place)
    return kept


def _section_at(road: Road, s: float) -> int:
    starts = [index for index, section in enumerate(road.sections) if section.s <= s]
    return starts[-1] if starts else 0


def paired_lanes(before: LaneSection, after: LaneSection) -> tuple[LanePair, ...]:
    """Pair the lanes of two cross sections: by place where both have as many, else by likeness.

    Where a lane is missing among equal ones, it is the outermost of them.
    """
    centre: LanePair = (before.lanes.get(0), after.lanes.get(0))
    return centre, *_pair_side(before, after, -1), *_pair_side(before, after, 1)


def _pair_side(before: LaneSection, after: LaneSection, sign: int) -> list[LanePair]:
    old, new = (
        [section.lanes[k] for k in sorted(section.lanes, key=abs) if k * sign > 0]
        for section in (before, after)
    )
    if len(old) == len(new):
        return list(zip(old, new, strict=True))
    return _align_lanes(old, new)


def _align_lanes(old: Sequence[Lane], new: Sequence[Lane]) -> list[LanePair]:
    """Pair two sequences at the least cost; a lane without a partner costs most."""

    @cache
    def best(i: int, j: int) -> tuple[float, tuple[LanePair, ...]]:
        # Of choices that cost the same the first is taken: a pair before a gap, from inside out.
        choices: list[tuple[float, tuple[LanePair, ...]]] = []
        if i < len(old) and j < len(new):
            cost, rest = best(i + 1, j + 1)
            choices.append((cost + _count_differences(old[i], new[j]), ((old[i], new[j]), *rest)))
        if i < len(old):
            cost, rest = best(i + 1, j)
            choices.append((cost + _MISSING, ((old[i], None), *rest)))
        if j < len(new):
            cost, rest = best(i, j + 1)
            choices.append((cost + _MISSING, ((None, new[j]), *rest)))
        return min(choices, key=lambda choice: choice[0], default=(0.0, ()))

    return list(best(0, 0)[1])


def _count_differences(old: Lane, new: Lane) -> float:
    details = ("direction", "level", "heights", "speeds", "access", "road_marks")
    other = sum(getattr(old, name) != getattr(new, name) for name in details)
    return float(
        _OTHER_TYPE * (old.type != new.type)
        + min(1.0, abs(_first_coefficient(old.widths) - _first_coefficient(new.widths)))
        + _OTHER_DETAIL * other
    )


def _first_coefficient(profile: Sequence[Cubic]) -> float:
    return profile[0].a if profile else 0.0
