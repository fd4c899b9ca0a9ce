"""How full parking areas are, from the stays in their places."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    import polars as pl

    from odscen.base.arrays import FloatArray, IntArray
    from odscen.records.run_plan import Plan, PlannedParking


class AreaUse(NamedTuple):
    """Use of one parking area, or of all together.

    Attributes
    ----------
    places
        How many there are.
    begun, ended
        Trips that began, and ended, there.
    diverted
        Trips that were to end there and ended in another area.
    highest
        Most places taken at a time.
    occupancy
        Mean share of places taken.
    full
        Share of time in which all places were taken.
    """

    places: int
    begun: int
    ended: int
    diverted: int
    highest: int
    occupancy: float
    full: float


class PlacesTaken(NamedTuple):
    """Places taken: ``places[k]`` from ``time[k]`` (s) until the next one, or the end."""

    time: FloatArray
    places: IntArray


@dataclass(frozen=True, slots=True, eq=False)
class ParkingUse:
    """Stays in the parking areas of a run, from ``begin`` to ``end`` (s).

    Attributes
    ----------
    stays
        Columns of :func:`odscen.sumo.outputs.output_tables.stay_table`, and ``wanted``: the area
        that the trip was to end in.
    areas
        Of the plan.
    """

    stays: pl.DataFrame
    areas: Sequence[PlannedParking]
    begin: float
    end: float

    @classmethod
    def of(cls, stays: pl.DataFrame, plan: Plan, *, begin: float, end: float) -> ParkingUse:
        """Hold the stays of a run against its plan."""
        import polars as pl

        wanted = {actor.id: actor.ends_in for actor in plan.actors if actor.ends_in is not None}
        names = {"actor": list(wanted), "wanted": list(wanted.values())}
        table = pl.DataFrame(names, schema={"actor": pl.String, "wanted": pl.String})
        joined = stays.join(table, on="actor", how="left", maintain_order="left")
        return cls(joined, plan.parking, begin, end)

    def use(self, area: str | None = None) -> AreaUse:
        """Use of an area; of all together if none is named."""
        import polars as pl

        places = sum(parking.places for parking in self.areas if area in (None, parking.id))
        mine = self._stays_in(area)
        arrived = pl.col("arrival").is_between(self.begin, self.end, closed="left")
        left = pl.col("departure").is_between(self.begin, self.end, closed="left")
        wanted = pl.lit(value=True) if area is None else pl.col("wanted") == area
        moved = ~pl.col("begins") & (pl.col("wanted") != pl.col("area")) & arrived & wanted
        taken = self.taken(area)
        lasts = np.diff(np.append(taken.time, self.end))
        span = max(self.end - self.begin, 1e-9)
        return AreaUse(
            places=places,
            begun=mine.filter(pl.col("begins") & left).height,
            ended=mine.filter(~pl.col("begins") & arrived).height,
            diverted=self.stays.filter(moved).height,
            highest=int(taken.places.max(initial=0)),
            occupancy=float(np.sum(taken.places * lasts)) / (max(places, 1) * span),
            full=float(np.sum(lasts[taken.places >= places])) / span,
        )

    def taken(self, area: str | None = None) -> PlacesTaken:
        """Places taken over time."""
        mine = self._stays_in(area)
        arrival = np.clip(mine["arrival"].to_numpy(), self.begin, self.end)
        departure = mine["departure"].fill_null(self.end).to_numpy()
        departure = np.clip(departure, self.begin, self.end)
        times = np.unique(np.concatenate([[self.begin], arrival, departure]))
        times = times[times < self.end]
        come = np.searchsorted(np.sort(arrival), times, side="right")
        gone = np.searchsorted(np.sort(departure), times, side="right")
        return PlacesTaken(times, come - gone)

    def _stays_in(self, area: str | None) -> pl.DataFrame:
        import polars as pl

        return self.stays if area is None else self.stays.filter(pl.col("area") == area)
