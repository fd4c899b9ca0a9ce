"""Records that several elements of the standard share: cubics over s, speeds, validities."""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING, Final, cast

from odscen.base.shown import shown
from odscen.opendrive.parse_rules import (
    MAX_LANE_ID,
    MAX_NUMBER,
    S_TOLERANCE,
    SLIVER_LENGTH,
    Notes,
    Rule,
)
from odscen.opendrive.parse_xml import Element, choice, integer, number, refusal
from odscen.opendrive.road_model import Cubic, Validity

if TYPE_CHECKING:
    from collections.abc import Sequence

_SPEED_UNITS: Final[dict[str | None, float]] = {
    None: 1.0,
    "": 1.0,
    "m/s": 1.0,
    "km/h": 1 / 3.6,
    "mph": 0.44704,
}


def cubics(
    elements: Sequence[Element], s_name: str, s0: float, s_end: float, notes: Notes
) -> tuple[Cubic, ...]:
    """Records ``a + b ds + c ds^2 + d ds^3``; each starts at ``s0`` plus its ``s_name``.

    The last one ends at ``s_end``, metres of s.

    Raises
    ------
    OpenDriveError
        For numbers that are none, and records that are not in ascending order of s.
    """
    records: list[Cubic] = []
    last = -math.inf
    for row, element in enumerate(elements):
        get = element.get
        texts = (get(s_name), get("a"), get("b"), get("c"), get("d"))
        try:
            s, a, b, c, d = map(float, cast("tuple[str, ...]", texts))
            # False for NaN, too.
            plain = abs(s) + abs(a) + abs(b) + abs(c) + abs(d) <= MAX_NUMBER
            plain = plain and "_" not in "".join(cast("tuple[str, ...]", texts))
        except (TypeError, ValueError):
            plain = False
        if not plain:
            # The slow way finds the attribute at fault and says so.
            following = elements[row + 1] if row + 1 < len(elements) else None
            end = s_end - s0 if following is None else number(following, s_name)
            s, a, b, c, d = _record(element, s_name, end, notes)
        if s <= last:
            s = ordered_s(element, s_name, s, last, notes)
        last = s
        records.append(Cubic(s0 + s, a, b, c, d))
    return tuple(records)


def _record(element: Element, s_name: str, end: float, notes: Notes) -> tuple[float, ...]:
    """Start and coefficients of a record; those of a sliver may be beyond the limit."""
    s = number(element, s_name)
    if not abs(end - s) <= SLIVER_LENGTH:
        return (s, *(number(element, name) for name in "abcd"))
    b, c, d = (number(element, name, limit=sys.float_info.max) for name in "bcd")
    if max(map(abs, (b, c, d))) <= MAX_NUMBER:
        return (s, number(element, "a"), b, c, d)
    detail = f"b={b:g}, c={c:g}, d={d:g} on {max(end - s, 0.0):.3g} m count as 0"
    notes.add(Rule.SLIVER, element, detail)
    return (s, number(element, "a"), 0.0, 0.0, 0.0)


def ordered_s(element: Element, s_name: str, s: float, last: float, notes: Notes) -> float:
    """Where a record starts that does not start behind the one before it, at ``last``.

    Raises
    ------
    OpenDriveError
        If it starts before that one by more than :data:`S_TOLERANCE`.
    """
    if s < last - S_TOLERANCE:
        raise refusal(element, f"{s_name}={s:g} is below the {last:g} of the record before")
    if s < last:
        detail = f"{s_name}={s:.9g} is below the {last:.9g} of the record before; it starts there"
        notes.add(Rule.RECORD_ORDER, element, detail)
    else:
        detail = f"{s_name}={s:g} is that of the record before; this one holds"
        notes.add(Rule.SAME_S, element, detail)
    return last


def speed(element: Element, notes: Notes) -> float | None:
    """Speed in m/s of a ``max`` attribute, infinite for "no limit", ``None`` if none is given."""
    text = element.get("max", "").strip()
    if text == "no limit":
        return math.inf
    if text in {"undefined", ""}:
        return None
    value = number(element, "max", limit=MAX_NUMBER) * choice(element, "unit", _SPEED_UNITS)
    if value <= 0.0:
        notes.add(Rule.SPEED, element, f"max={shown(text)} is not above zero; no speed is given")
        return None
    return value


def speed_factor(unit: str) -> float | None:
    """Factor to m/s of a unit of speed, or ``None`` for other units."""
    return _SPEED_UNITS.get(unit) if unit else None


def validities(elements: Sequence[Element]) -> tuple[Validity, ...]:
    """``<validity>`` records (section 14.4)."""
    return tuple(
        Validity(
            integer(element, "fromLane", limit=MAX_LANE_ID),
            integer(element, "toLane", limit=MAX_LANE_ID),
        )
        for element in elements
    )
