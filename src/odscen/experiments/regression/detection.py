r"""What a suite is to catch, and how many seeds that takes.

With the same ``n`` seeds on both sides a change fails where the mean difference is above what
chance explains. A true change ``c`` is caught with probability ``power`` if

``c >= max(floor, t(1 - q, n - 1) * s_d / sqrt(n)) + t(power, n - 1) * s_d / sqrt(n)``

with ``s_d`` the standard deviation of the differences by seed, of which a pilot of m pairs has an
estimate. Half of such estimates are too small and would give too few seeds, so it is the upper end
of a one-sided interval that counts (Browne, Statistics in Medicine 14, 1995: 1933-1940):

``s_d = s_m * sqrt((m - 1) / chi2(1 - ASSURANCE, m - 1))``
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from odscen.base.errors import InputError
from odscen.experiments.regression.measure import DIGITS, FigureKey
from odscen.experiments.regression.scatter import FEWEST_SEEDS, FLOOR, WATCHED, quantile, tail_of
from odscen.experiments.regression.tolerance import Tolerance, parse_tolerance, usual
from odscen.figures.measures.figure import Better
from odscen.scenario.document.document_parts import Label, Part

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.figures.measures.figure import Figure

ASSURANCE = 0.8
"""Probability that the scatter of differences is not above what seeds are chosen for."""

MOST_CHOSEN = 1000
"""Seeds that a suite may allow."""

_FLOOR_SHARE = 0.5
"""Share of the change that is to be caught, above which the figure's floor does not go."""

_BEYOND = 1_000_000
"""Seeds that are not counted further."""


class DetectEntry(Part):
    """``detect`` of a suite; a text stands for its ``change``."""

    change: Label
    figure: Label = "mean_delay"
    power: Annotated[float, Field(ge=0.5, le=0.99)] = 0.9
    seeds_max: Annotated[int, Field(ge=FEWEST_SEEDS, le=MOST_CHOSEN)] = 128


@dataclass(frozen=True, slots=True)
class Detection:
    """A change that is to be caught.

    Attributes
    ----------
    figure
        Of the run.
    change
        As the suite has it: ``"5 %"``, ``"2 s"`` or ``"5 % or 2 s"``, whichever is more.
    power
        Probability of catching it.
    seeds_max
        More are not run.
    """

    figure: Figure
    change: str
    power: float
    seeds_max: int

    @property
    def key(self) -> FigureKey:
        """Of the figure, in baselines."""
        return FigureKey("run", "", self.figure.name)

    @property
    def words(self) -> str:
        """``"a change of mean_delay by 5 %"``."""
        return f"a change of {self.figure.name} by {self.change}"

    def size(self, mean: float) -> float:
        """How large the change is where the baseline has ``mean``, in the figure's unit."""
        return parse_tolerance(self.change, self.figure).allowed(mean)

    def floor(self, mean: float) -> float:
        """What is allowed however little seeds scatter, in the figure's unit."""
        least = usual(self.figure).times(FLOOR).allowed(mean)
        return min(least, _FLOOR_SHARE * self.size(mean))

    def smallest_caught(self, scatter: float, count: int, *, mean: float) -> float:
        """Smallest change that is caught with that many seeds, in the figure's unit.

        Parameters
        ----------
        scatter
            Standard deviation of the differences by seed, in the figure's unit.
        """
        error = scatter / math.sqrt(count)
        tail = tail_of(WATCHED, both_sides=self.figure.better is Better.NEITHER)
        allowed = max(self.floor(mean), quantile(tail, count - 1) * error)
        return allowed + quantile(1 - self.power, count - 1) * error

    def seeds_for(self, scatter: float, *, mean: float) -> int:
        """Seeds that it takes, whatever ``seeds_max`` says; parameters as above.

        It is ``10^6`` where it takes that many or more.
        """
        wanted = self.size(mean)
        low, high = FEWEST_SEEDS - 1, FEWEST_SEEDS
        while high < _BEYOND and self.smallest_caught(scatter, high, mean=mean) > wanted:
            low, high = high, 2 * high
        while high - low > 1:
            middle = (low + high) // 2
            enough = self.smallest_caught(scatter, middle, mean=mean) <= wanted
            low, high = (low, middle) if enough else (middle, high)
        return min(high, _BEYOND)


def detection_of(entry: DetectEntry, figures: Mapping[str, Figure]) -> Detection:
    """Read what is to be caught; ``figures`` are those of the run, by name.

    Raises
    ------
    InputError
        If there is no such figure, or the change is none; names the key.
    """
    figure = figures.get(entry.figure)
    if figure is None:
        raise InputError(
            f"no figure has the name {entry.figure!r}; known are {', '.join(sorted(figures))}",
            element="figure",
        )
    try:
        change = parse_tolerance(entry.change, figure)
    except InputError as error:
        raise InputError(error.problem, element="change") from error
    if change == Tolerance():
        raise InputError(f"{entry.change!r} is no change", element="change")
    return Detection(figure, entry.change, entry.power, entry.seeds_max)


class Sizing(Part):
    """What the seeds of a baseline were chosen for, and what they catch.

    Attributes
    ----------
    mean
        Of the figure over the seeds, in its unit.
    scatter
        Standard deviation of the differences by seed that they were chosen for, in its unit.
    seeds
        How many there are.
    needed
        How many it takes; more than ``seeds`` where the suite does not allow them.
    catches
        Smallest change that they catch, in the figure's unit.
    """

    figure: Label
    change: Label
    power: Annotated[float, Field(gt=0, lt=1)]
    mean: float
    scatter: Annotated[float, Field(ge=0)]
    seeds: Annotated[int, Field(ge=1)]
    needed: Annotated[int, Field(ge=1)]
    catches: Annotated[float, Field(ge=0)]

    @property
    def enough(self) -> bool:
        """Whether they catch what they are to catch."""
        return self.needed <= self.seeds

    @property
    def caught(self) -> str:
        """What they catch, rounded up: ``"7.1 %"`` of the mean, or in the unit where that is 0."""
        if not self.mean:
            return f"{self.catches:g}"
        return f"{math.ceil(1000 * self.catches / abs(self.mean)) / 10:g} %"

    @property
    def words(self) -> str:
        """What they catch, and what it would take where that is not enough."""
        often = f"with probability {self.power:g}"
        if self.enough:
            return f"{self.seeds} seeds catch a change of {self.figure} by {self.change} {often}"
        many = "a million or more" if self.needed >= _BEYOND else self.needed
        return (
            f"{self.seeds} seeds, the most that the suite allows, catch a change of {self.figure} "
            f"by {self.caught} {often}; {self.change} takes {many}"
        )

    def is_for(self, detect: Detection) -> bool:
        """Whether it is the change that a suite wants to be caught, with seeds that it allows."""
        wanted = detect.figure.name, detect.change, detect.power
        if (self.figure, self.change, self.power) != wanted:
            return False
        most = self.seeds <= detect.seeds_max
        return most and (self.enough or self.seeds == detect.seeds_max)


Pairs = Sequence[tuple[float, float]]
"""A figure by seed, as it is and with a change, in its unit."""


def size_of(detect: Detection, aimed: Pairs, jolted: Pairs = ()) -> Sizing:
    """Choose how many seeds catch a change, of the kind that scatters more.

    Parameters
    ----------
    aimed
        With a change that is meant to be as large as the one that is to be caught.
    jolted
        With one that only moves traffic about, if at least three have the figure.
    """
    mean = statistics.fmean(old for old, _ in aimed)
    scatter = scatter_of_differences(aimed, wanted=detect.size(mean))
    if len(jolted) > 2:
        scatter = max(scatter, scatter_of_differences(jolted))
    needed = detect.seeds_for(scatter, mean=mean)
    count = min(needed, detect.seeds_max)
    return Sizing(
        figure=detect.figure.name,
        change=detect.change,
        power=detect.power,
        mean=round(mean, DIGITS),
        scatter=round(scatter, DIGITS),
        seeds=count,
        needed=needed,
        catches=round(detect.smallest_caught(scatter, count, mean=mean), DIGITS),
    )


def scatter_of_differences(pairs: Pairs, *, wanted: float = 0.0) -> float:
    """Standard deviation, at most, of the differences that a change makes, in the figure's unit.

    Parameters
    ----------
    wanted
        The change of the mean that is to be caught, in the same unit. Where the mean has changed
        by less, differences are taken to grow with it, but not beyond those of runs that have
        nothing in common: ``sqrt(2)`` times the scatter of runs.
    """
    differences = [new - old for old, new in pairs]
    effect = abs(statistics.fmean(differences))
    found = statistics.stdev(differences)
    if effect < wanted:
        unrelated = math.sqrt(2.0) * statistics.stdev(old for old, _ in pairs)
        found = max(found, min(unrelated, found * wanted / effect if effect else unrelated))
    return found * _assured(len(pairs))


def _assured(count: int) -> float:
    """Upper end of the interval of a standard deviation over ``count`` values, as a share of it."""
    from scipy.stats import chi2

    return math.sqrt((count - 1) / float(chi2.ppf(1 - ASSURANCE, count - 1)))
