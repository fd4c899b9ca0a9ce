"""Road markings as styled lines along lane borders."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.arrays import IntArray, offsets, ranges
from odscen.drawing.lane_borders import thinned
from odscen.drawing.map_drawing import Lines, Mark

if TYPE_CHECKING:
    from odscen.drawing.lane_borders import Borders, Sections
    from odscen.opendrive.road_model import RoadMark


_DASHES = {"broken": (3.0, 6.0), "botts dots": (0.2, 1.0)}
_DASH_FAST = (6.0, 12.0)
"""Broken lines outside towns, as on rural roads and motorways (painted, gap; metres)."""

_UNPAINTED = frozenset({"none", "grass", ""})


class _Stroke(NamedTuple):
    """One painted line: a stretch of a border, shifted sideways, in a style."""

    row: int
    section: int
    s_from: float
    s_to: float
    shift: float
    style: tuple[str, float, tuple[float, float] | None]


def road_marks(borders: Borders, levels: IntArray, tolerance: float) -> tuple[Mark, ...]:
    """All painted markings, grouped by style; ``levels`` per section, ``tolerance`` in metres."""
    strokes = _strokes(borders.sections)
    if not strokes:
        return ()
    stations = borders.stations
    section = np.array([stroke.section for stroke in strokes])
    row = np.array([stroke.row for stroke in strokes])
    # One ascending key over all sections finds both ends of all strokes in two calls.
    base = offsets(np.ceil(borders.sections.s1 - borders.sections.s0).astype(np.int64) + 2)[:-1]
    low_s = borders.sections.s0
    key = base[stations.section] + stations.s - low_s[stations.section]
    ends = np.array([(stroke.s_from, stroke.s_to) for stroke in strokes])
    first = np.searchsorted(key, base[section] + ends[:, 0] - low_s[section] - 1e-5)
    last = np.searchsorted(key, base[section] + ends[:, 1] - low_s[section] + 1e-5)
    sizes = last - first
    place = ranges(first, sizes)
    on_line = place + np.repeat(borders.lines.start[row] - stations.start[section], sizes)
    shift = np.repeat(np.array([stroke.shift for stroke in strokes]), sizes)[:, None]
    normal = np.stack([stations.left_x[place], stations.left_y[place]], axis=1)
    exact = Lines(borders.lines.xy[on_line] + shift * normal, offsets(sizes))
    level = levels[section]
    kept = np.flatnonzero(sizes >= 2)
    thin = thinned(exact.take(kept), tolerance)
    groups: dict[tuple[int, str, float, tuple[float, float]], list[int]] = {}
    for line, stroke in enumerate(kept.tolist()):
        color, width, dash = strokes[stroke].style
        style = (int(level[stroke]), color, width, dash or (0.0, 0.0))
        groups.setdefault(style, []).append(line)
    return tuple(
        Mark(at, color, width, dash if dash[0] else None, thin.take(np.array(groups[style])))
        for style in sorted(groups)
        for at, color, width, dash in [style]
    )


def _strokes(sections: Sections) -> list[_Stroke]:
    lanes = int(sections.rows[-1])
    strokes = []
    for index, model in enumerate(sections.models):
        row = int(sections.rows[index])
        ids = sorted(lane for lane in model.lanes if lane != 0)
        rows = {lane: row + k for k, lane in enumerate(ids)}
        rows[0] = lanes + index
        fast = bool(sections.fast[index])
        for lane, item in model.lanes.items():
            marks = item.road_marks
            for k, mark in enumerate(marks):
                s_from = max(mark.s, model.s)
                s_to = marks[k + 1].s if k + 1 < len(marks) else model.s_end
                if s_to - s_from < 0.05 or mark.type in _UNPAINTED:
                    continue
                strokes += [
                    _Stroke(rows[lane], index, s_from, min(s_to, model.s_end), shift, style)
                    for shift, style in _mark_styles(mark, lane, fast=fast)
                ]
    return strokes


def _mark_styles(
    mark: RoadMark, lane: int, *, fast: bool
) -> list[tuple[float, tuple[str, float, tuple[float, float] | None]]]:
    """Sideways shift and style of the one or two lines of a marking.

    Double lines are named from the inside to the outside, at the centre from left to right
    (section 11.9).
    """
    width = mark.width if 0.02 <= mark.width <= 1.0 else (0.25 if mark.weight == "bold" else 0.12)
    width = round(width, 2)
    color = "white" if mark.color in {"standard", ""} else mark.color
    if mark.type == "curb":
        color = "curb"
    parts = mark.type.split() if mark.type != "botts dots" else ["botts dots"]
    broken = _DASH_FAST if fast else _DASHES["broken"]
    dashes = [broken if part == "broken" else _DASHES.get(part) for part in parts]
    if len(parts) == 1:
        return [(0.0, (color, width, dashes[0]))]
    # Given widths of double lines may span both; a painted line is seldom over 15 cm.
    thin = min(width, 0.15)
    sign = 1.0 if lane > 0 else -1.0
    return [(-sign * thin, (color, thin, dashes[0])), (sign * thin, (color, thin, dashes[1]))]
