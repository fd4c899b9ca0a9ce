"""Lengths of time as people write them: ``24h``, ``1h30m``, ``90min``, ``10s``, ``3600``."""

from __future__ import annotations

import math
import re

from odscen.base.errors import InputError

_SECONDS = {"d": 86_400.0, "h": 3600.0, "min": 60.0, "m": 60.0, "s": 1.0}
_PART = re.compile(r"\s*(?P<number>\d+\.?\d*|\.\d+)\s*(?P<unit>d|h|min|m|s)")


def parse_duration(text: str) -> float:
    """Seconds; a bare number is seconds.

    Raises
    ------
    InputError
        If it is no positive length of time.
    """
    try:
        seconds = float(text)
    except ValueError:
        seconds = _sum_of_parts(text)
    if not (math.isfinite(seconds) and seconds > 0):
        raise InputError(
            f"{text!r} is no length of time; write for example 24h, 1h30m, 90min, 10s or 3600"
        )
    return seconds


def clock(seconds: float) -> str:
    """``"13:05"``: hours and minutes, without an end at 24."""
    minutes = int(seconds // 60)
    return f"{minutes // 60}:{minutes % 60:02d}"


def _sum_of_parts(text: str) -> float:
    total, place = 0.0, 0
    while place < len(text.rstrip()):
        part = _PART.match(text, place)
        if part is None:
            return math.nan
        total += float(part["number"]) * _SECONDS[part["unit"]]
        place = part.end()
    return total
