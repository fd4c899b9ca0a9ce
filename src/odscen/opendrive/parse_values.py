"""Records that several elements of the standard share: cubics over s, speeds, validities."""

from __future__ import annotations

import math
import re
import sys
from typing import TYPE_CHECKING, Final, TypeVar, cast

from odscen.base.errors import OpenDriveError
from odscen.base.shown import shown
from odscen.opendrive.parse_rules import (
    MAX_LANE_ID,
    MAX_NUMBER,
    S_TOLERANCE,
    SLIVER_LENGTH,
    STEP_BACK,
    Notes,
    Rule,
)
from odscen.opendrive.parse_xml import Element, choice, integer, number, refusal
from odscen.opendrive.road_model import Cubic, Validity

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

T = TypeVar("T")

_SPEED_UNITS: Final[dict[str, float]] = {"": 1.0, "m/s": 1.0, "km/h": 1 / 3.6, "mph": 0.44704}
_UNIT_SPELLINGS: Final[dict[str, str]] = {
    **dict.fromkeys(("km/h", "kmh", "kph", "kmph", "kmperh", "kilometersperhour"), "km/h"),
    **dict.fromkeys(("mph", "mi/h", "mileh", "milesperhour"), "mph"),
    **dict.fromkeys(("m/s", "ms", "mps", "mpers", "meterspersecond"), "m/s"),
}
"""Units of speed as writers spell them, without case and all but letters and strokes."""


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
            fill_missing(element, (*(() if row else (s_name,)), "b", "c", "d"), notes)
            end = s_end - s0 if following is None else number(following, s_name)
            s, a, b, c, d = _parse_record(element, s_name, end, notes)
        if s <= last:
            s = ordered_s(element, s_name, s, last, notes)
        last = s
        records.append(Cubic(s0 + s, a, b, c, d))
    return tuple(records)


def fill_missing(element: Element, names: Sequence[str], notes: Notes) -> None:
    """Put 0 for attributes that are not there, and note them."""
    missing = [name for name in names if element.get(name) is None]
    if missing:
        detail = f"{', '.join(missing)} missing; that counts as 0"
        notes.add(Rule.MISSING_NUMBER, element, detail)
    for name in missing:
        element.set(name, "0")


def start_at_zero(element: Element, s_name: str, s: float, notes: Notes) -> float:
    """Where the first record starts: at 0 if it is less than :data:`STEP_BACK` behind it."""
    if S_TOLERANCE < s < STEP_BACK:
        notes.add(Rule.RECORD_ORDER, element, f"{s_name}={s:.9g} is behind 0; it starts there")
        return 0.0
    return s


def _parse_record(element: Element, s_name: str, end: float, notes: Notes) -> tuple[float, ...]:
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
        If it starts before that one by more than :data:`STEP_BACK`.
    """
    if s < last - STEP_BACK:
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
    if text.lower().replace("_", " ") in {"no limit", "nolimit"}:
        return math.inf
    if text.lower() in {"undefined", ""}:
        return None
    unit = element.get("unit", "")
    factor = _SPEED_UNITS.get(unit, speed_factor(unit))
    if factor is None:
        detail = f"unit={shown(unit)} is none of km/h, m/s, mph; no speed is given"
        notes.add(Rule.SPEED, element, detail)
        return None
    try:
        value = number(element, "max", limit=MAX_NUMBER) * factor
    except OpenDriveError as error:
        notes.add(Rule.SPEED, element, f"{error.problem}; no speed is given")
        return None
    if value <= 0.0:
        notes.add(Rule.SPEED, element, f"max={shown(text)} is not above zero; no speed is given")
        return None
    if unit not in _SPEED_UNITS:
        notes.add(Rule.SPELLING, element, f"unit={shown(unit)} is read as {_spell_unit(unit)}")
    return value


def speed_factor(unit: str) -> float | None:
    """Factor to m/s of a unit of speed in any spelling, or ``None`` for other units."""
    name = _spell_unit(unit)
    return _SPEED_UNITS[name] if name else None


def _spell_unit(unit: str) -> str | None:
    """The standard's spelling of a unit of speed."""
    return _UNIT_SPELLINGS.get(re.sub(r"[^a-z/]", "", unit.lower()))


def spelt_choice(
    element: Element, name: str, options: Mapping[str | None, T], notes: Notes, **usual: T
) -> T:
    """The meaning of an attribute out of ``options``, whatever its case and outer space.

    Parameters
    ----------
    usual
        As ``otherwise``: what another value counts as; without it, it is refused.
    """
    value = element.get(name)
    if value is None or value in options:
        return choice(element, name, options)
    for option, meaning in options.items():
        if option is not None and option.lower() == value.strip().lower():
            notes.add(Rule.SPELLING, element, f"{name}={shown(value)} is read as {option}")
            return meaning
    if "otherwise" not in usual:
        return choice(element, name, options)
    notes.add(Rule.UNKNOWN_VALUE, element, f"{name}={shown(value)} counts as not given")
    return usual["otherwise"]


def validities(elements: Sequence[Element]) -> tuple[Validity, ...]:
    """``<validity>`` records (section 14.4)."""
    return tuple(
        Validity(
            integer(element, "fromLane", limit=MAX_LANE_ID),
            integer(element, "toLane", limit=MAX_LANE_ID),
        )
        for element in elements
    )
