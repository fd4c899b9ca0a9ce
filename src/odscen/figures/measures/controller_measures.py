"""Measures of practice of an event log of a signal controller: what its detectors say of it.

As in "Performance Measures for Traffic Signal Systems" (Day et al., Purdue University, 2014,
doi.org/10.5703/1288284315333) and as agencies compute them: an arrival is the begin of a call of an
advance detector; a split has failed if the detectors at the stop line are occupied for 80 % of the
green and of the first 5 s of red after it; a pedestrian waits from the first push of a button until
walk begins.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator

    import polars as pl

    from odscen.base.arrays import FloatArray

GREEN, YELLOW, RED = 1, 8, 10
WALK, WALK_CLEARANCE, BUTTON = 21, 22, 90
DETECTOR_OFF, DETECTOR_ON = 81, 82
RED_SECONDS: Final = 5.0
"""Seconds of red in which a failed split is still occupied."""
OCCUPIED: Final = 0.8
"""Share of time from which a detector counts as occupied."""
LOST_OFF: Final = 2.0
"""A second begin of a call within these seconds ends the first at once; later, half-way."""


def arrivals(events: pl.DataFrame, detectors: pl.DataFrame) -> pl.DataFrame:
    """List vehicles at advance detectors, the points of a Purdue coordination diagram.

    Parameters
    ----------
    events
        ``time``, ``device``, ``event``, ``parameter``, by time.
    detectors
        ``device``, ``phase``, ``parameter``, ``function``.

    Returns
    -------
    polars.DataFrame
        ``device``, ``phase``, ``time``, ``light`` (``green``, ``yellow`` or ``red``; null before
        the first of the log) and ``in_cycle``, seconds since the begin of green.
    """
    import polars as pl

    rows = []
    words = {GREEN: "green", YELLOW: "yellow", RED: "red"}
    for device, phase, own, lights in _find_phases(events, detectors, "advance"):
        calls = own.filter(pl.col("event") == DETECTOR_ON)
        times, codes = _epoch_seconds(lights), lights["event"].to_numpy()
        at = _epoch_seconds(calls)
        last = np.searchsorted(times, at, side="right") - 1
        greens = times[codes == GREEN]
        begun = np.searchsorted(greens, at, side="right") - 1
        for stamp, now, light, cycle in zip(calls["time"], at, last, begun, strict=True):
            shown = words[int(codes[light])] if light >= 0 and cycle >= 0 else None
            since = round(float(now - greens[cycle]), 3) if cycle >= 0 else None
            rows.append((device, phase, stamp, shown, since))
    schema = {
        "device": pl.String(), "phase": pl.Int64(), "time": pl.Datetime("ms"), "light": pl.String(),
        "in_cycle": pl.Float64(),
    }  # fmt: skip
    return pl.DataFrame(rows, schema=schema, orient="row").sort("device", "phase", "time")


def arrivals_on_green(
    events: pl.DataFrame, detectors: pl.DataFrame, *, minutes: int = 15
) -> pl.DataFrame:
    """Share of vehicles that arrive while their phase is green.

    Returns
    -------
    polars.DataFrame
        ``device``, ``phase``, ``begin``, ``arrivals`` and ``on_green``, a share.
    """
    import polars as pl

    return (
        arrivals(events, detectors)
        .group_by("device", "phase", begin=pl.col("time").dt.truncate(f"{minutes}m"))
        .agg(
            arrivals=pl.len().cast(pl.Int64),
            on_green=(pl.col("light") == "green").fill_null(value=False).mean(),
        )
        .sort("device", "phase", "begin")
    )


def split_failures(
    events: pl.DataFrame, detectors: pl.DataFrame, *, minutes: int = 15
) -> pl.DataFrame:
    """Greens that did not serve all who waited, by the occupancy of the detectors of a phase.

    A cycle counts where it is whole: a green, one yellow, one red of :data:`RED_SECONDS` at least,
    and a detector known from its begin on. It belongs to the bin in which these seconds end.

    Returns
    -------
    polars.DataFrame
        ``device``, ``phase``, ``begin``, ``cycles``, ``green`` (mean seconds),
        ``green_occupancy``, ``red_occupancy`` (mean shares) and ``failures``.
    """
    import polars as pl

    rows = []
    bins = events.select(pl.col("time").dt.truncate(f"{minutes}m"))
    cut = (_epoch_seconds(bins).max() if len(bins) else 0.0) + 60.0 * minutes
    for device, phase, own, lights in _find_phases(events, detectors, "presence"):
        spans = _occupied_spans(own)
        if spans is None:
            continue
        known, begins, ends = spans
        times, codes = _epoch_seconds(lights), lights["event"].to_numpy()
        greens = np.flatnonzero(codes == GREEN)
        limits = [*times[greens].tolist()[1:], np.inf]
        for green, limit in zip(times[greens].tolist(), limits, strict=True):
            within = (times >= green) & (times < limit)
            yellows = times[within & (codes == YELLOW)]
            reds = times[within & (codes == RED)]
            over = [red + RED_SECONDS for red in reds if red + RED_SECONDS < min(limit, cut)]
            if len(yellows) != 1 or len(over) != 1 or len(reds) != 1 or known > green:
                continue
            busy = _measure_overlap(begins, ends, green, float(yellows[0])) / (
                float(yellows[0]) - green
            )
            late = _measure_overlap(begins, ends, float(reds[0]), over[0]) / RED_SECONDS
            failed = busy >= OCCUPIED and late >= OCCUPIED
            rows.append((device, phase, over[0], float(yellows[0]) - green, busy, late, failed))
    schema = {
        "device": pl.String(), "phase": pl.Int64(), "time": pl.Float64(), "green": pl.Float64(),
        "green_occupancy": pl.Float64(), "red_occupancy": pl.Float64(), "failed": pl.Boolean(),
    }  # fmt: skip
    table = pl.DataFrame(rows, schema=schema, orient="row").with_columns(
        begin=(pl.col("time") * 1000).round().cast(pl.Datetime("ms")).dt.truncate(f"{minutes}m")
    )
    return (
        table.group_by("device", "phase", "begin")
        .agg(
            pl.len().cast(pl.Int64).alias("cycles"),
            pl.col("green", "green_occupancy", "red_occupancy").mean(),
            pl.col("failed").sum().cast(pl.Int64).alias("failures"),
        )
        .sort("device", "phase", "begin")
    )


def pedestrian_delays(events: pl.DataFrame, *, minutes: int = 15) -> pl.DataFrame:
    """How long it takes from the first push of a button until walk begins.

    Later pushes, and those while walk is shown, are not waited for anew.

    Returns
    -------
    polars.DataFrame
        ``device``, ``phase``, ``begin`` (of the bin in which walk begins), ``waits`` and ``delay``,
        mean seconds.
    """
    import polars as pl

    wanted = events.filter(pl.col("event").is_in([BUTTON, WALK, WALK_CLEARANCE]))
    rows = []
    for (device, phase), own in wanted.group_by("device", "parameter", maintain_order=True):
        pushed, before = None, None
        for time, event in zip(own["time"], own["event"], strict=True):
            if event == BUTTON:
                if pushed is None and before in (None, WALK_CLEARANCE):
                    pushed = time
            elif pushed is not None:
                rows.append((device, phase, time, (time - pushed).total_seconds()))
                pushed = None
            before = event
    schema = {
        "device": pl.String(), "phase": pl.Int64(), "time": pl.Datetime("ms"),
        "delay": pl.Float64(),
    }  # fmt: skip
    return (
        pl.DataFrame(rows, schema=schema, orient="row")
        .group_by("device", "phase", begin=pl.col("time").dt.truncate(f"{minutes}m"))
        .agg(pl.len().cast(pl.Int64).alias("waits"), pl.col("delay").mean())
        .sort("device", "phase", "begin")
    )


def _epoch_seconds(events: pl.DataFrame) -> FloatArray:
    return events["time"].dt.epoch("ms").to_numpy() / 1000.0


def _find_phases(
    events: pl.DataFrame, detectors: pl.DataFrame, function: str
) -> Iterator[tuple[str, int, pl.DataFrame, pl.DataFrame]]:
    """Each phase with calls of its detectors, and with its begins of green, yellow and red."""
    import polars as pl

    chosen = detectors.filter(pl.col("function") == function)
    for (device, phase), own in chosen.group_by("device", "phase", maintain_order=True):
        mine = events.filter(pl.col("device") == device)
        calls = mine.filter(
            pl.col("event").is_in([DETECTOR_OFF, DETECTOR_ON]),
            pl.col("parameter").is_in(own["parameter"].to_list()),
        )
        lights = mine.filter(
            pl.col("event").is_in([GREEN, YELLOW, RED]), pl.col("parameter") == phase
        ).sort("time", "event")
        yield str(device), int(str(phase)), calls, lights


def _occupied_spans(calls: pl.DataFrame) -> tuple[float, FloatArray, FloatArray] | None:
    """When the detectors of a phase say anything first, and spans in which any is occupied, s.

    Events that were lost are put in: see :data:`LOST_OFF`; between two ends of calls, a begin is
    half-way.
    """
    steps: list[tuple[float, int]] = []
    for _, own in calls.group_by("parameter", maintain_order=True):
        times, codes = _epoch_seconds(own), own["event"].to_numpy()
        for index, (time, code) in enumerate(zip(times.tolist(), codes.tolist(), strict=True)):
            change = 1 if code == DETECTOR_ON else -1
            if index == 0 and change < 0:
                steps.append((time - 0.001, 1))
            elif index and code == codes[index - 1]:
                gap = time - float(times[index - 1])
                at_once = change > 0 and gap <= LOST_OFF
                steps.append((time if at_once else time - gap / 2, -change))
            steps.append((time, change))
    if not steps:
        return None
    steps.sort()
    begins: list[float] = []
    ends: list[float] = []
    count = 0
    for row, (time, change) in enumerate(steps):
        count += change
        if row + 1 < len(steps) and steps[row + 1][0] == time:
            continue  # all changes of one moment count together
        busy = len(begins) > len(ends)
        if count > 0 and not busy:
            begins.append(time)
        elif count <= 0 and busy:
            ends.append(time)
    if len(begins) > len(ends):
        ends.append(np.inf)
    return steps[0][0], np.array(begins), np.array(ends)


def _measure_overlap(begins: FloatArray, ends: FloatArray, start: float, end: float) -> float:
    """Seconds of spans within ``start`` and ``end``."""
    return float(np.clip(np.minimum(ends, end) - np.maximum(begins, start), 0.0, None).sum())
