"""Which part of a run is analysed, and over which intervals its figures are given."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Self

from odscen.base.errors import InputError
from odscen.figures.by_place.traffic_sums import INTERVAL, intervals

if TYPE_CHECKING:
    from collections.abc import Mapping

    import polars as pl

_CLOSE = 1e-6


@dataclass(frozen=True, slots=True)
class AnalysisTimes:
    """What is analysed of a run; seconds.

    Attributes
    ----------
    warm_up
        From the start of the run; left out of all figures.
    interval
        Of the figures over time, from the end of the warm-up on; ``None`` for that which lanes
        were measured over.
    """

    warm_up: float = 0.0
    interval: float | None = None

    @classmethod
    def of_summary(cls, summary: Mapping[str, Any]) -> Self:
        """As ``summary.json`` of a run says."""
        return cls(float(summary.get("warm_up") or 0.0), summary.get("interval"))

    def to_dict(self) -> dict[str, float]:
        """Fields for ``summary.json``; none if the whole run is analysed as it was measured."""
        times = {"warm_up": self.warm_up or None, "interval": self.interval}
        return {name: value for name, value in times.items() if value is not None}

    def refuse_beyond(self, end: float) -> None:
        """Refuse a warm-up that leaves nothing of a run of ``end`` seconds.

        Raises
        ------
        InputError
            If it does.
        """
        if self.warm_up >= end:
            raise InputError(
                f"the warm-up of {self.warm_up:g} s leaves nothing of a run of {end:g} s"
            )

    def clock(self, lanes: pl.DataFrame, *, end: float) -> pl.DataFrame:
        """``begin`` and ``end`` of each interval of a run of ``end`` seconds, warm-up included.

        Parameters
        ----------
        lanes
            Per lane and interval, from :func:`odscen.runs.recorded.read_lanes`.

        Raises
        ------
        InputError
            If an interval of the lane data lies in two of these, or nothing is left to analyse.
        """
        import polars as pl

        self.refuse_beyond(end)
        if self == WHOLE_RUN:
            return intervals(lanes, end)
        own = intervals(lanes, end)
        if self.interval is None:
            edges = [0.0, *(t for t in own["begin"].to_list() if t > self.warm_up), end]
        else:
            count = math.ceil((end - self.warm_up) / self.interval - _CLOSE)
            edges = [0.0, *(self.warm_up + k * self.interval for k in range(1, count)), end]
        if self.warm_up:
            edges.insert(1, self.warm_up)
        clock = pl.DataFrame(list(pairwise(edges)), schema=own.schema, orient="row")
        self._refuse_torn(own, edges)
        return clock

    def _refuse_torn(self, own: pl.DataFrame, edges: list[float]) -> None:
        for edge in edges[1:-1]:
            torn = own.filter((own["begin"] < edge - _CLOSE) & (own["end"] > edge + _CLOSE))
            if torn.height:
                begin, end = torn.row(0)
                raise InputError(
                    f"the run was measured from {begin:g} to {end:g} s in one: warm-up and interval"
                    f" must be multiples of {end - begin:g} s, not {self._describe_times()}"
                )

    def _describe_times(self) -> str:
        interval = "none" if self.interval is None else f"{self.interval:g} s"
        return f"{self.warm_up:g} s and {interval}"

    def analysed(self, table: pl.DataFrame) -> pl.DataFrame:
        """Rows of a table by interval that are not of the warm-up."""
        return table.filter(table["begin"] >= self.warm_up - _CLOSE)


WHOLE_RUN = AnalysisTimes()
"""All of a run, over the intervals that lanes were measured over."""


def begins_at(times: pl.Series, clock: pl.DataFrame) -> pl.Series:
    """``begin`` of the interval of each time, null before the first; ``clock`` is in order."""
    import numpy as np
    import polars as pl

    begins = clock["begin"].to_numpy()
    at = np.searchsorted(begins, times.to_numpy(), side="right") - 1
    found = np.concatenate([[np.nan], begins])[at + 1]
    return pl.Series("begin", found, nan_to_null=True)


def on_clock(lanes: pl.DataFrame, clock: pl.DataFrame) -> pl.DataFrame:
    """Lane data summed up over the intervals of ``clock``, of which each holds whole rows."""
    import polars as pl

    if lanes.is_empty():
        return lanes
    keys = ("edge", "lane")
    sums = [name for name in lanes.columns if name not in (*INTERVAL, *keys)]
    return (
        lanes.drop("end")
        .rename({"begin": "own"})
        .sort("own")
        .join_asof(clock.sort("begin"), left_on="own", right_on="begin", coalesce=False)
        .group_by(*INTERVAL, *keys)
        .agg(pl.col(sums).sum())
        .select(lanes.columns)
        .sort("begin", "lane")
    )
