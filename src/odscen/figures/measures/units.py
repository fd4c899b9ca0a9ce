"""Units of figures, and the units in which people may write a bound."""

from __future__ import annotations

import difflib

from odscen.base.errors import InputError

_CONVERSIONS: dict[str, dict[str, float]] = {
    "s": {"s": 1.0, "min": 60.0, "h": 3600.0},
    "m/s2": {"m/s2": 1.0},
    "m": {"m": 1.0, "cm": 0.01, "km": 1000.0},
    "m/s": {"m/s": 1.0, "km/h": 1.0 / 3.6},
    "km": {"km": 1.0, "m": 0.001},
    "kg": {"kg": 1.0, "g": 0.001, "t": 1000.0},
    "g": {"g": 1.0, "mg": 0.001, "kg": 1000.0},
}
"""Factor to the unit of a figure, by that and the unit that is written."""


def in_unit(value: float, written: str, unit: str, *, name: str) -> float:
    """``value``, given in the unit ``written``, in ``unit``; "" is ``unit`` itself.

    Parameters
    ----------
    name
        Of the figure, for the error.

    Raises
    ------
    InputError
        If ``written`` is no unit for what ``unit`` measures.
    """
    if written in ("", unit):
        return value
    known = _CONVERSIONS.get(unit, {unit: 1.0} if unit else {})
    if written not in known:
        close = difflib.get_close_matches(written, known, n=1)
        hint = f"; did you mean {close[0]}?" if close else ""
        units = ", ".join(known) if known else "no unit"
        raise InputError(f"{name} is written in {units}, not in {written!r}{hint}")
    return value * known[written]
