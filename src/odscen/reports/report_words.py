"""Times in the words of the report."""

from __future__ import annotations

from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING

import numpy as np

from odscen.base.durations import clock
from odscen.base.markup import number

if TYPE_CHECKING:
    from collections.abc import Iterator

_DAY = 86_400.0

_START: ContextVar[float] = ContextVar("start of the run, seconds after midnight", default=0.0)


@contextmanager
def starting_at(clock_time: float) -> Iterator[None]:
    """Write times of the run inside as times of day; of a run that starts at 0 they are both."""
    token = _START.set(clock_time)
    try:
        yield
    finally:
        _START.reset(token)


def has_clock() -> bool:
    """Whether times are those of a day."""
    return _START.get() > 0.0


def time_words(seconds: float) -> str:
    """``"7:15"``: time of day, or hours and minutes since the start of the run."""
    start = _START.get()
    return clock((seconds + start) % _DAY if start else seconds)


def moment(seconds: float) -> str:
    """``"10:58:17"``, of day if the run has a clock, or ``"4 min 05 s"`` after its start."""
    if not has_clock():
        return duration(seconds)
    of_day = round(seconds + _START.get()) % round(_DAY)
    return f"{of_day // 3600}:{of_day // 60 % 60:02d}:{of_day % 60:02d}"


def duration(seconds: float | None) -> str:
    """``"4 min 05 s"``; empty for ``None``."""
    if seconds is None or not np.isfinite(seconds):
        return ""
    if seconds < 60.0:
        return f"{number(seconds, 1)} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02d} min" if hours else f"{minutes} min {rest:02d} s"


def stretch(begin: float, end: float) -> str:
    """``"17:15 to 17:30 h"``, of day if the run has a clock, or ``"4:10 to 4:20 min"``.

    Less than five minutes of a run without a clock are minutes and seconds, too.
    """
    if begin % 60.0 == end % 60.0 == 0.0 and (has_clock() or end - begin >= 300.0):
        return f"{time_words(begin)} to {time_words(end)} h"
    one, other = (f"{int(t // 60)}:{int(t % 60):02d}" for t in (begin, end))
    return f"{one} to {other} min"
