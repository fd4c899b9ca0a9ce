"""Checks of numbers across elements: geometry fits together, values are sensible.

All roads are checked at once on flattened arrays; only what is noted or refused is looked at one by
one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from odscen.base.errors import OpenDriveError
from odscen.base.shown import shown_id
from odscen.opendrive import parse_rules as rules
from odscen.opendrive.geometry import PlanView
from odscen.opendrive.parse_left_out import RoadFault
from odscen.opendrive.parse_rules import Notes, Rule
from odscen.opendrive.profiles import CubicTable

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from odscen.base.arrays import FloatArray, IntArray
    from odscen.base.ids import RoadId
    from odscen.opendrive.road_model import Road

NameOf = Callable[[int], str]
"""Path of the element of a row."""


def check_numbers(roads: dict[RoadId, Road], notes: Notes) -> None:
    """Refuse geometry that does not fit together; note what is within the tolerances.

    Raises
    ------
    OpenDriveError
        Naming the first element at fault.
    """
    in_order = list(roads.values())
    _check_roads(in_order, notes)
    _check_lane_length(in_order)


def _check_roads(roads: list[Road], notes: Notes) -> None:
    # Absurd coefficients overflow; the comparisons below then refuse them by name.
    with np.errstate(all="ignore"):
        _check_plan_view(roads, notes)
        _check_road_profiles(roads, notes)
        _check_lane_widths(roads, notes)


def find_faults(roads: Mapping[RoadId, Road]) -> list[RoadFault]:
    """Roads that :func:`check_numbers` refuses, and why; nothing is noted."""
    return _faults_among(list(roads.values()))


def _faults_among(roads: list[Road]) -> list[RoadFault]:
    if not roads:
        return []
    try:
        _check_roads(roads, Notes())
    except OpenDriveError as error:
        if len(roads) == 1:
            return [RoadFault(roads[0].id, error)]
        middle = len(roads) // 2
        return _faults_among(roads[:middle]) + _faults_among(roads[middle:])
    return []


def _make_namer(roads: list[Road], groups: list[int], tag: str) -> NameOf:
    """Path of row ``i`` of a table with ``groups[k]`` rows of road ``k``."""
    first = np.concatenate([[0], np.cumsum(groups)])

    def name(row: int) -> str:
        road = int(np.searchsorted(first, row, side="right")) - 1
        return f"road {shown_id(roads[road].id)} > {tag} {row - first[road]}"

    return name


def _refuse_any(bad: NDArray[np.bool_], name: NameOf, problem: Callable[[int], str]) -> None:
    for row in _rows_where(bad):
        raise OpenDriveError(problem(row), element=name(row))


def _rows_where(mask: NDArray[np.bool_]) -> list[int]:
    """Rows at which ``mask`` holds."""
    return [int(row) for row in np.flatnonzero(mask)]


# ----------------------------------------------------------------------------- plan view
def _check_plan_view(roads: list[Road], notes: Notes) -> None:
    plan = PlanView.of([road.geometry for road in roads])
    name = _make_namer(roads, [len(road.geometry) for road in roads], "geometry")
    row = np.arange(plan.s.size)
    last = np.zeros(plan.s.size, dtype=bool)
    last[plan.first[1:] - 1] = True
    following = np.minimum(row + 1, plan.s.size - 1)
    end_s = np.where(last, 0.0, plan.s[following])
    end_s[last] = [road.length for road in roads]

    # What s says is there against what the lengths say.
    missing = end_s - (plan.s + plan.length)
    says = np.where(last, "the road's length", "the s of the next geometry")
    _refuse_any(
        ~(np.abs(missing) <= rules.MAX_S_GAP),
        name,
        lambda i: f"ends at s={plan.s[i] + plan.length[i]:.6g}, but {says[i]} is {end_s[i]:.6g}",
    )
    for i in _rows_where(np.abs(missing) > rules.S_TOLERANCE):
        detail = f"its end and {says[i]} differ by {abs(missing[i]):.3g} m"
        notes.add(Rule.PLAN_VIEW_S, name(i), detail)

    _check_curves(plan, name, notes)
    end = plan.at_rows(row, end_s - plan.s)
    far = np.maximum(np.abs(end.x), np.abs(end.y))
    _refuse_any(
        ~(far <= rules.MAX_COORDINATE),
        name,
        lambda i: f"leads to ({end.x[i]:g}, {end.y[i]:g}); the limit is {rules.MAX_COORDINATE:g} m",
    )
    inner = np.flatnonzero(~last)
    gap = np.zeros(plan.s.size)
    gap[inner] = np.hypot(end.x[inner] - plan.x[inner + 1], end.y[inner] - plan.y[inner + 1])
    _refuse_any(
        gap > rules.MAX_GAP,
        name,
        lambda i: (
            f"ends {gap[i]:.6g} m away from the start of the next; the limit is {rules.MAX_GAP:g} m"
        ),
    )
    _note_joints(plan, end.hdg, gap, inner, name, notes)


def _note_joints(
    plan: PlanView,
    end_hdg: FloatArray,
    gap: FloatArray,
    inner: IntArray,
    name: NameOf,
    notes: Notes,
) -> None:
    kink = np.zeros(gap.size)
    turn = plan.curves.start_heading(plan.cubic, plan.hdg)[inner + 1] - end_hdg[inner]
    kink[inner] = np.abs((turn + np.pi) % (2.0 * np.pi) - np.pi)
    noted = (gap > rules.GAP_TOLERANCE) | (kink > rules.KINK_TOLERANCE)
    for i in _rows_where(noted):
        detail = f"ends {gap[i]:.3g} m and {kink[i]:.3g} rad off the start of the next"
        notes.add(Rule.PLAN_VIEW_GAP, name(i), detail)


def _check_curves(plan: PlanView, name: NameOf, notes: Notes) -> None:
    """Arc lengths of paramPoly3 curves against their ``length``."""
    rows = np.flatnonzero(plan.cubic >= 0)
    stretch = np.ones(plan.s.size)
    stretch[rows] = plan.curves.stretch[plan.cubic[rows]]
    _refuse_any(
        ~((stretch >= 0.5) & (stretch <= 2.0)),
        name,
        lambda i: (
            f"the curve is {stretch[i] * plan.length[i]:.6g} m long, "
            f"but length={plan.length[i]:.6g}"
        ),
    )
    astray = np.zeros(plan.s.size)
    astray[rows] = plan.curves.astray()
    _refuse_any(
        ~(astray <= np.maximum(rules.MAX_ASTRAY, rules.CURVE_TOLERANCE * plan.length)),
        name,
        lambda i: (
            f"the curve bends too sharply to be followed over its length of {plan.length[i]:.6g} m"
        ),
    )
    for i in _rows_where(np.abs(stretch - 1.0) > rules.CURVE_TOLERANCE):
        detail = f"the curve is {stretch[i] * plan.length[i]:.6g} m long, not {plan.length[i]:.6g}"
        notes.add(Rule.CURVE_LENGTH, name(i), detail)


# ----------------------------------------------------------------------------- profiles
def _check_road_profiles(roads: list[Road], notes: Notes) -> None:
    ends = np.array([road.length for road in roads])
    limits = {
        "elevation": rules.MAX_ELEVATION,
        "superelevation": rules.MAX_ROLL,
        "lane_offset": rules.MAX_WIDTH,
    }
    for field, limit in limits.items():
        groups = [getattr(road, field) for road in roads]
        tag = "laneOffset" if field == "lane_offset" else field
        name = _make_namer(roads, [len(group) for group in groups], tag)
        table = CubicTable.of(groups)
        low, high, _ = _record_extremes(table, ends)
        worst = np.where(np.abs(low) > np.abs(high), low, high)
        _refuse_any(
            ~(np.abs(worst) <= limit),
            name,
            lambda i, worst=worst, limit=limit: f"reaches {worst[i]:.6g}; the limit is {limit:g}",  # type: ignore[misc]
        )
        if field == "elevation":
            _note_jumps(table, ends, name, notes)


def _check_lane_widths(roads: list[Road], notes: Notes) -> None:
    lanes = [
        (f"road {shown_id(road.id)} > laneSection {number} > lane {lane.id}", section, lane)
        for road in roads
        for number, section in enumerate(road.sections)
        for lane in section.lanes.values()
        if lane.id
    ]
    groups = [lane.widths for _, _, lane in lanes]
    table = CubicTable.of(groups)
    group = np.repeat(np.arange(len(lanes)), np.diff(table.first))
    ends = np.array([section.s_end for _, section, _ in lanes])
    low, high, at = _record_extremes(table, ends)

    def name(row: int) -> str:
        return lanes[int(group[row])][0]

    _refuse_any(
        ~(low >= -rules.MAX_NEGATIVE_WIDTH),
        name,
        lambda i: f"width at s={at[i]:.6g} is {low[i]:.3g} m",
    )
    _refuse_any(
        ~(high <= rules.MAX_WIDTH),
        name,
        lambda i: f"width reaches {high[i]:.6g} m; the limit is {rules.MAX_WIDTH:g} m",
    )
    for i in _rows_where(low < -rules.WIDTH_TOLERANCE):
        detail = f"width at s={at[i]:.6g} is {low[i]:.3g} m and counts as 0"
        notes.add(Rule.NEGATIVE_WIDTH, name(i), detail)
    _note_jumps(table, ends, name, notes)


def _record_ends(table: CubicTable, ends: FloatArray) -> FloatArray:
    """Where each record ends: at the next one of its group, or at the group's end."""
    sizes = np.diff(table.first)
    following = np.append(table.starts[1:], 0.0)
    filled = np.flatnonzero(sizes)
    following[table.first[filled + 1] - 1] = ends[filled]
    ends_at: FloatArray = np.maximum(following, table.starts)
    return ends_at


def _record_extremes(
    table: CubicTable, ends: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Lowest and highest value of each record, and the s of the lowest; shape ``(records,)``."""
    if table.starts.size == 0:
        return np.zeros(0), np.zeros(0), np.zeros(0)
    length = _record_ends(table, ends) - table.starts
    a, b, c, d = table.coefficients.T
    # Extremes lie at the ends, or where b + 2 c ds + 3 d ds^2 = 0; the form without
    # cancellation of the roots also covers d = 0.
    q = -(c + np.copysign(np.sqrt(np.maximum(c * c - 3.0 * b * d, 0.0)), c))
    roots = (q / (3.0 * d), b / q)
    inside = [np.where((root > 0.0) & (root < length), root, 0.0) for root in roots]
    ds = np.stack([np.zeros_like(a), length, *inside])
    values = a + ds * (b + ds * (c + ds * d))
    lowest = np.argmin(values, axis=0)
    columns = np.arange(a.size)
    return values[lowest, columns], values.max(axis=0), table.starts + ds[lowest, columns]


def _note_jumps(table: CubicTable, ends: FloatArray, name: NameOf, notes: Notes) -> None:
    """Note where a record does not start with the value that the one before it ends with."""
    if table.starts.size == 0:
        return
    ds = _record_ends(table, ends) - table.starts
    a, b, c, d = table.coefficients.T
    end_value = a + ds * (b + ds * (c + ds * d))
    jump = np.zeros(a.size)
    jump[1:] = a[1:] - end_value[:-1]
    jump[table.first[:-1][np.diff(table.first) > 0]] = 0.0
    jump[1:][ds[:-1] <= 0.0] = 0.0  # a record of no length has no value to jump from
    for i in _rows_where(np.abs(jump) > rules.JUMP_TOLERANCE):
        notes.add(Rule.JUMP, name(i), f"jumps by {jump[i]:.3g} m at s={table.starts[i]:.6g}")


def _check_lane_length(roads: list[Road]) -> None:
    total = sum(
        (section.s_end - section.s) * (len(section.lanes) - 1)
        for road in roads
        for section in road.sections
    )
    if total > rules.MAX_LANE_LENGTH:
        raise OpenDriveError(
            f"all lanes together are {total:.6g} m long; the limit is {rules.MAX_LANE_LENGTH:g} m"
        )
