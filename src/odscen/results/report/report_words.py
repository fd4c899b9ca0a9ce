"""Times in the words of the report."""

from __future__ import annotations

import numpy as np

from odscen.base.durations import clock
from odscen.base.markup import number


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
    """``"17:15 to 17:30 h"`` since the start, or ``"4:10 to 4:20 min"`` if it takes seconds."""
    if begin % 60.0 == end % 60.0 == 0.0:
        return f"{clock(begin)} to {clock(end)} h"
    one, other = (f"{int(t // 60)}:{int(t % 60):02d}" for t in (begin, end))
    return f"{one} to {other} min"
