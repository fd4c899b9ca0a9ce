"""Green waves: offsets of lights along a corridor, and the bands in which one passes all of them.

A band is a stretch of time in which vehicles that begin to drive through the corridor at the
progression speed have green at every light. The offsets are those of the widest bands, as MAXBAND
has them for given cycle, splits and speeds (J. D. C. Little, M. D. Kelson, N. H. Gartner, 1981),
found by trial of all: once it is given how late the band of one direction is after that of the
other, whether bands of some widths fit through a light is a question of that light alone.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.base.arrays import FloatArray

Favoured = Literal["both", "out", "back"]

_NEAR = 1e-6

LEAST_BAND = 5.0
"""Seconds of a band that is worth it: two vehicles follow each other through it, at 2 s each after
the first one has reacted."""


class GreenWindow(NamedTuple):
    """Seconds of a program at which green begins, and for which it lasts."""

    begin: float
    seconds: float


class WaveLight(NamedTuple):
    """A light of a corridor.

    Attributes
    ----------
    out, back
        Windows of green for those who drive along the corridor, and back; none where one cannot.
    out_time
        Seconds from the first light of the corridor to this one.
    back_time
        Seconds from the last light to this one.
    """

    out: tuple[GreenWindow, ...]
    back: tuple[GreenWindow, ...]
    out_time: float
    back_time: float


class Band(NamedTuple):
    """When a band begins at the first light of its direction, and how long it lasts; seconds."""

    begin: float
    seconds: float


def green_bands(
    lights: Sequence[WaveLight], offsets: Sequence[float], cycle: float
) -> tuple[Band, Band]:
    """Widest band of either direction with given offsets; none lasts 0 s."""
    pairs = list(zip(lights, offsets, strict=True))
    return (
        _widest_band([(light.out, offset - light.out_time) for light, offset in pairs], cycle),
        _widest_band([(light.back, offset - light.back_time) for light, offset in pairs], cycle),
    )


def _widest_band(windows: Sequence[tuple[Sequence[GreenWindow], float]], cycle: float) -> Band:
    """Longest common stretch of windows that are shifted, on the circle of a cycle."""
    free = [(0.0, 2.0 * cycle)]
    for own, shift in windows:
        shown = [
            (begin + turn * cycle, begin + turn * cycle + min(window.seconds, cycle))
            for window in own
            for begin in ((window.begin + shift) % cycle,)
            for turn in (-1, 0, 1)
        ]
        if any(window.seconds >= cycle for window in own):
            continue
        free = [
            (max(a, c), min(b, d)) for a, b in free for c, d in shown if min(b, d) - max(a, c) > 0.0
        ]
    # What the end of the two cycles cuts is whole in the first of them.
    best = max(
        free, key=lambda pair: (round(min(pair[1] - pair[0], cycle), 6), -pair[0]), default=None
    )
    if best is None:
        return Band(0.0, 0.0)
    return Band(best[0] % cycle, min(best[1] - best[0], cycle))


def widest_offsets(
    lights: Sequence[WaveLight], cycle: float, *, favoured: Favoured = "both"
) -> tuple[float, ...]:
    """Offsets in whole seconds with which the bands are widest; that of the first light is 0.

    Parameters
    ----------
    favoured
        ``both``: the narrower band is made as wide as can be, then the sum, and where not both get
        :data:`LEAST_BAND`, the wider one; otherwise the band of that direction, then the other.
    """
    grid = max(math.floor(cycle + _NEAR), 1)
    steps: FloatArray = np.arange(2 * grid, dtype=np.float64)
    out = [_green_left(light.out, light.out_time - steps[:grid], cycle) for light in lights]
    # By seconds that the band back begins after the one out, less the offset.
    back = [_green_left(light.back, steps + (light.back_time - grid), cycle) for light in lights]
    places = np.arange(grid)[None, :] - np.arange(grid)[:, None] + grid
    rooms = [array[places] for array in back]  # by offset, then by the lateness of the band back
    widest = math.floor(min(float(room.max()) for room in out) + _NEAR)
    best: tuple[tuple[float, float], int, float, int] | None = None
    for width in range(widest + 1):
        through = np.full(grid, cycle)
        for room, other in zip(out, rooms, strict=True):
            fits = room >= width - _NEAR if width else room > -np.inf  # no band fits anywhere
            through = np.minimum(through, other[fits].max(axis=0))
        for late in np.flatnonzero(through >= through.max() - _NEAR).tolist()[:1]:
            value = _value_of_bands(float(width), max(float(through[late]), 0.0), favoured)
            if best is None or value > best[0]:
                best = value, width, float(through[late]), late
    if best is None:
        return (0.0,) * len(lights)
    _, width, returned, late = best
    offsets = []
    for room, other in zip(out, rooms, strict=True):
        spare = other[:, late] - returned
        if width:
            spare = np.minimum(room - width, spare)
        offsets.append(int(np.flatnonzero(spare >= spare.max() - _NEAR)[0]))
    return tuple(float((offset - offsets[0]) % grid) for offset in offsets)


def _value_of_bands(out: float, back: float, favoured: Favoured) -> tuple[float, float]:
    if favoured == "out":
        return round(out, 6), round(back, 6)
    if favoured == "back":
        return round(back, 6), round(out, 6)
    # Two bands that nearly no vehicle fits into are worth less than one that some do.
    wide = [band if band >= LEAST_BAND else 0.0 for band in (out, back)]
    narrow = (min(out, back) + 0.5 * (out + back)) * 1e-6
    return round(min(wide), 6), round(sum(wide) + narrow, 6)


def _green_left(windows: Sequence[GreenWindow], times: FloatArray, cycle: float) -> FloatArray:
    """Seconds of green that are left at times of the program; negative without any."""
    room = np.full(len(times), -1.0)
    for window in windows:
        since = np.mod(times - window.begin + _NEAR, cycle) - _NEAR
        left = window.seconds - since
        room = np.maximum(room, left if window.seconds < cycle else cycle)
    return room
