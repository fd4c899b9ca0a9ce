"""Day profiles: how demand comes and goes with the time of day."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.base.errors import NotFoundError

if TYPE_CHECKING:
    from odscen.base.arrays import FloatArray
    from odscen.scenario.document.scenario_document import Demand

DAY = 86_400.0

BUILT_IN: dict[str, tuple[float, ...]] = {
    # Share of each hour, per cent: the daily time lines TGw2_PKW (cars on a working day) and
    # TGs1_PKW (cars at the weekend) that SUMO's tools know by these names, see
    # https://sumo.dlr.de/docs/Demand/Importing_O/D_Matrices.html
    "weekday": (
        *(0.8, 0.5, 0.4, 0.3, 0.4, 1.2, 4.5, 7.4, 6.6, 5.2, 5.0, 5.0),
        *(5.2, 5.3, 5.6, 6.7, 8.4, 8.6, 7.4, 5.0, 3.9, 3.0, 2.1, 1.6),
    ),
    "weekend": (
        *(3.3, 2.8, 2.0, 1.5, 1.2, 1.3, 1.2, 1.5, 2.5, 3.7, 4.8, 5.5),
        *(6.0, 6.7, 7.0, 7.1, 6.9, 7.4, 7.0, 6.0, 4.7, 4.1, 3.5, 2.3),
    ),
}


_LEAST_SHARE = 1e-15
"""Of the day: a slice with less has nothing."""


class Curve:
    """Demand over time as the integral of a factor whose mean over a day is 1.

    Parameters
    ----------
    shares
        Relative shares of equal slices of the day, from midnight on.
    clock
        Time of day at the start of the run, seconds.
    seconds
        Of the part of the day over which the mean of the factor is 1.
    """

    def __init__(
        self, shares: tuple[float, ...] = (1.0,), *, clock: float = 0.0, seconds: float = DAY
    ) -> None:
        self._times = np.linspace(0.0, DAY, len(shares) + 1)
        # A share that a day's sum cannot hold would make the inverse infinitely steep.
        held = [share if share > sum(shares) * _LEAST_SHARE else 0.0 for share in shares]
        self._sums = np.concatenate([[0.0], np.cumsum(held)]) * (seconds / sum(held))
        self._day = float(self._sums[-1])
        self._clock = clock
        self._before = float(self._integrate_to(np.array(clock)))

    def amount(self, time: float) -> float:
        """Integral of the factor from the start of the run to ``time``, seconds."""
        return float(self._integrate_to(np.array(self._clock + time))) - self._before

    def times(self, amounts: FloatArray) -> FloatArray:
        """Inverse of :meth:`amount`, for many at once."""
        days, rest = np.divmod(amounts + self._before, self._day)
        times: FloatArray = days * DAY + np.interp(rest, self._sums, self._times) - self._clock
        return times

    def draw(self, uniform: FloatArray, *, begin: float, end: float) -> FloatArray:
        """Times between ``begin`` and ``end``, spread as the profile says.

        Where the profile has nothing in that time, they are spread evenly.

        Parameters
        ----------
        uniform
            Random numbers from 0 to 1.
        """
        low, high = self.amount(begin), self.amount(end)
        if high <= low:
            return begin + uniform * (end - begin)
        return np.clip(self.times(low + uniform * (high - low)), begin, end)

    def _integrate_to(self, time_of_day: FloatArray) -> FloatArray:
        days, rest = np.divmod(time_of_day, DAY)
        integral: FloatArray = days * self._day + np.interp(rest, self._times, self._sums)
        return integral


def curve(demand: Demand, profile: str | None) -> Curve:
    """Return the curve of a profile by name; constant for ``None``.

    Raises
    ------
    NotFoundError
        If there is no such profile.
    """
    if profile is None:
        return Curve(clock=demand.clock)
    known = known_profiles(demand)
    if profile not in known:
        raise NotFoundError("day profile", profile, list(known))
    own = {part.id: part.seconds for part in demand.profiles}
    return Curve(known[profile], clock=demand.clock, seconds=own.get(profile, DAY))


def known_profiles(demand: Demand) -> dict[str, tuple[float, ...]]:
    """Shares of all profiles by name: the built-in ones and the scenario's own."""
    return BUILT_IN | {profile.id: profile.of_day for profile in demand.profiles}
