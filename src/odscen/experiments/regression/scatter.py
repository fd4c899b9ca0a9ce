r"""How far a mean over seeds may be from the baseline's by chance alone, from the seeds' scatter.

Other seeds of the same distributions give other means. The difference of two of them, over
``n_0`` seeds at the baseline and ``n_1`` now, lies with probability ``1 - q`` at least below

``allowed = t(1 - q / 2, n_0 + n_1 - 2) * s * sqrt(1 / n_0 + 1 / n_1)``

where ``s`` is the standard deviation over the seeds of either side, pooled (Student's t). That of
the baseline alone would not do: waiting times are skewed, and a rare long one that only the new
seeds have would be an alarm. It takes half of q, as means of a few skewed values exceed the
quantile more often than Student's t does. Where both sides have the same seeds, they are compared
in pairs, same traffic under two conditions:

``allowed = t(1 - q, n - 1) * s_d / sqrt(n)``

with ``s_d`` of the n differences. Which of the two holds is known beforehand, so that q is not
shared between them.
"""

from __future__ import annotations

import math
import statistics
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

FALSE_ALARMS = 0.02
"""Probability, at most, that a scenario fails by chance: half of it in figures of the run and half
in places, each shared out evenly among the figures (Bonferroni)."""

FEWEST_SEEDS = 8
"""Seeds from which scatter is a tolerance. Of fewer the quantile of Student's t is so large that
anything would pass: in pairs 55 standard errors at 3 seeds, 11 at 5, 6.5 at 8 and 4.4 at 20."""

FLOOR = 0.5
"""Share of a figure's own tolerance that is allowed however little its seeds scatter: smaller
differences matter to no one, and figures that never vary would fail for the last digit."""

CHANGE, CAUGHT = 0.05, 0.9
"""The change, as a share of the mean, and the probability of catching it, that seeds are for."""

VARYING = "mean_travel_time"
"""The figure that seeds are to vary."""
_LEAST_SPREAD = 0.01
"""Share of the largest value by which it differs, at least, where seeds vary."""
_LEAST_SEEDS = 3
"""Two may well be alike."""

_MOST_SEEDS = 100_000


WATCHED = FALSE_ALARMS / 4
"""Of it, what goes to the figure of which a suite names the change that is to be caught."""


class Level(NamedTuple):
    """Probability of a false alarm in one figure of the run, and in one figure of a place."""

    run: float
    place: float

    @classmethod
    def shared(cls, *, run: int, places: int, watched: bool = False) -> Level:
        """Share out :data:`FALSE_ALARMS` among so many figures.

        ``watched`` takes :data:`WATCHED` off the share of the run: one of its figures has that for
        itself, and is not counted in ``run`` (weighted Bonferroni).
        """
        half = FALSE_ALARMS / 2
        return cls((half - WATCHED * watched) / max(1, run), half / max(1, places))


def tail_of(level: float, *, both_sides: bool) -> float:
    """Share the probability of a false alarm between the directions in which a figure fails."""
    return level / 2 if both_sides else level


def allowed_by_chance(
    old: Mapping[int, float | None],
    new: Mapping[int, float | None],
    *,
    level: float,
    both_sides: bool,
) -> float | None:
    """Largest difference of the means that chance explains, in the unit of the figure.

    Parameters
    ----------
    old, new
        Values by seed.
    level
        Probability of a false alarm, at most.
    both_sides
        Whether a difference in either direction fails; else only one does.

    Returns
    -------
    float or None
        ``None`` where fewer than :data:`FEWEST_SEEDS` of a side have the figure.
    """
    one, other = _known(old), _known(new)
    if min(len(one), len(other)) < FEWEST_SEEDS:
        return None
    tail = tail_of(level, both_sides=both_sides)
    if one.keys() == other.keys():
        pairs = [other[seed] - one[seed] for seed in one]
        return quantile(tail, len(pairs) - 1) * statistics.stdev(pairs) / math.sqrt(len(pairs))
    freedom = len(one) + len(other) - 2
    squares = sum((len(side) - 1) * statistics.variance(side.values()) for side in (one, other))
    error = math.sqrt(squares / freedom) * math.sqrt(1 / len(one) + 1 / len(other))
    return quantile(tail / 2, freedom) * error


def seeds_needed(values: Sequence[float], *, level: float) -> int | None:
    """Seeds with which a change by :data:`CHANGE` of the mean is caught, most of the time.

    Both sides have that many, and other ones; with the same seeds on both sides it takes fewer,
    how many depends on the change.

    Returns
    -------
    int or None
        ``None`` where the values do not tell: fewer than two of them, or a mean of 0.
    """
    if len(values) < 2 or not (mean := abs(statistics.fmean(values))):
        return None
    share = statistics.stdev(values) / mean
    count = FEWEST_SEEDS
    while count < _MOST_SEEDS and _detectable(share, count, level) > CHANGE:
        count = math.ceil(count * 1.05)
    return count


def hardly_varying(values: Sequence[float | None]) -> str | None:
    """Say so if values of :data:`VARYING` by seed make next to no difference."""
    known = [value for value in values if value is not None]
    if len(known) < _LEAST_SEEDS or max(known) - min(known) > _LEAST_SPREAD * abs(max(known)):
        return None
    spread = f"{min(known):g} to {max(known):g} s"
    return (
        f"the seeds hardly vary: {VARYING} is {spread}; more of them say no more, "
        'redraw = "traffic" makes them vary'
    )


def _detectable(share: float, count: int, level: float) -> float:
    """Change that is caught as often as wanted, as a share of the mean."""
    freedom = 2 * count - 2
    needed = quantile(level / 2, freedom) + quantile(1 - CAUGHT, freedom)
    return needed * share * math.sqrt(2 / count)


def _known(values: Mapping[int, float | None]) -> dict[int, float]:
    return {seed: value for seed, value in values.items() if value is not None}


@cache
def quantile(tail: float, freedom: int) -> float:
    """Value that Student's t exceeds with probability ``tail``."""
    from scipy.special import stdtrit

    return -float(stdtrit(freedom, tail))
