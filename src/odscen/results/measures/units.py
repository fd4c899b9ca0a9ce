"""Units of figures by their names, and the units in which people may write a bound."""

from __future__ import annotations

import difflib

from odscen.base.errors import InputError

_NAMES = {
    "co2_total": "kg",
    "fuel_total": "kg",
    "co2_per_km": "g/km",
    "vehicle_km": "km",
    "travel_time_index": "",
    "planning_time_index": "",
    "throughput": "veh/h",
}
_WORDS = (
    ("error", "m"),
    ("length", "m"),
    ("distance", "m"),
    ("speed", "m/s"),
    ("seconds", "s"),
    ("time", "s"),
    ("delay", "s"),
    ("ttc", "s"),
    ("pet", "s"),
    ("drac", "m/s2"),
    *((gas, "g") for gas in ("co2", "co", "hc", "nox", "pmx", "fuel")),
)
"""A figure is named after what it measures: the first word found in its name decides, unless its
whole name is among ``_NAMES``."""

_CONVERSIONS: dict[str, dict[str, float]] = {
    "s": {"s": 1.0, "min": 60.0, "h": 3600.0},
    "m/s2": {"m/s2": 1.0},
    "m": {"m": 1.0, "cm": 0.01, "km": 1000.0},
    "m/s": {"m/s": 1.0, "km/h": 1.0 / 3.6},
    "km": {"km": 1.0, "m": 0.001},
    "kg": {"kg": 1.0, "g": 0.001, "t": 1000.0},
    "g": {"g": 1.0, "mg": 0.001, "kg": 1000.0},
    "g/km": {"g/km": 1.0},
    "veh/h": {"veh/h": 1.0},
}


def unit_of(name: str) -> str:
    """Unit of a figure, ``""`` for counts and whatever has none."""
    if name in _NAMES:
        return _NAMES[name]
    parts = name.split("_")
    return next((unit for word, unit in _WORDS if word in parts), "")


def with_unit(value: float, name: str, *, digits: int = 2) -> str:
    """``"12.50 s"``: a value of the figure ``name`` for people; counts without decimals."""
    unit = unit_of(name)
    if not unit:
        return f"{value:.{digits}f}".rstrip("0").rstrip(".")
    return f"{value:.{digits}f} {unit}"


def in_unit_of(name: str, value: float, unit: str) -> float:
    """``value``, written in ``unit``, in the unit of the figure ``name``; "" is that unit.

    Raises
    ------
    InputError
        If the figure cannot be measured in ``unit``.
    """
    own = unit_of(name)
    if unit in ("", own):
        return value
    known = _CONVERSIONS.get(own, {})
    if unit not in known:
        close = difflib.get_close_matches(unit, known, n=1)
        hint = f"; did you mean {close[0]}?" if close else ""
        written = ", ".join(known) if known else "no unit"
        msg = f"{name} is written in {written}, not in {unit!r}{hint}"
        raise InputError(msg)
    return value * known[unit]
