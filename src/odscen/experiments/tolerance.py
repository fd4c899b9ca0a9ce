r"""How far figures may be from a baseline: tolerances, scatter of the seeds, what is caught.

A tolerance is ``"5 %"``, ``"1.5 s"``, or ``"5 % or 1.5 s"``. What chance explains comes from the
scatter over the seeds. Other seeds of the same distributions give other means. The difference of
two of them, over
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
import re
import statistics
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Annotated, NamedTuple

from pydantic import Field

from odscen.base.errors import InputError
from odscen.experiments.measure import DIGITS, FigureKey
from odscen.figures.measures.figure import Better
from odscen.scenario.document.document_parts import Label, Part

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.figures.measures.figure import Figure


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
    one, other = _drop_missing_values(old), _drop_missing_values(new)
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
    while count < _MOST_SEEDS and _detectable_change(share, count, level) > CHANGE:
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


def _detectable_change(share: float, count: int, level: float) -> float:
    """Change that is caught as often as wanted, as a share of the mean."""
    freedom = 2 * count - 2
    needed = quantile(level / 2, freedom) + quantile(1 - CAUGHT, freedom)
    return needed * share * math.sqrt(2 / count)


def _drop_missing_values(values: Mapping[int, float | None]) -> dict[int, float]:
    return {seed: value for seed, value in values.items() if value is not None}


@cache
def quantile(tail: float, freedom: int) -> float:
    """Value that Student's t exceeds with probability ``tail``."""
    from scipy.special import stdtrit

    return -float(stdtrit(freedom, tail))


_PART = re.compile(r"(?P<number>\d+\.?\d*|\.\d+)\s*(?P<unit>%|[A-Za-z][A-Za-z/]*)?")


@dataclass(frozen=True, slots=True)
class Tolerance:
    """Allowed are ``relative`` times the baseline or ``absolute``, whichever is more.

    ``by_scatter`` says that ``absolute`` is what the scatter of the seeds explains.
    """

    relative: float = 0.0
    absolute: float = 0.0
    by_scatter: bool = False

    def allowed(self, baseline: float) -> float:
        """Return the largest difference that passes, in the unit of the figure."""
        return max(self.relative * abs(baseline), self.absolute)

    def times(self, factor: float) -> Tolerance:
        """Return a part of it."""
        return Tolerance(factor * self.relative, factor * self.absolute)

    def words(self, figure: Figure) -> str:
        """``"5 % or 1.50 s"``, as it may be written in a suite, or ``"1.50 s by scatter"``."""
        if self.by_scatter:
            return f"{figure.written(self.absolute)} by scatter"
        parts = [f"{100 * self.relative:g} %"] if self.relative else []
        if self.absolute or not parts:
            parts.append(figure.written(self.absolute))
        return " or ".join(parts)


def parse_tolerance(text: str, figure: Figure) -> Tolerance:
    """Read a tolerance of a figure.

    Raises
    ------
    InputError
        If it is none, or in a unit that the figure does not have.
    """
    relative = absolute = 0.0
    for part in text.split(" or "):
        match = _PART.fullmatch(part.strip())
        if match is None:
            raise InputError(
                f"{text!r} is no tolerance; write for example '5 %', '1.5 s' or '5 % or 1.5 s'"
            )
        number, unit = float(match["number"]), match["unit"] or ""
        if unit == "%":
            relative = max(relative, number / 100.0)
        else:
            absolute = max(absolute, figure.in_unit_of(number, unit))
    return Tolerance(relative, absolute)


EXACT = Tolerance()


@cache
def usual(figure: Figure) -> Tolerance:
    """Tolerance of a figure that a suite says nothing of."""
    return parse_tolerance(figure.tolerance, figure)


@dataclass(frozen=True, slots=True)
class Tolerances:
    """Tolerances by kind of place and figure, for whatever differs from the usual."""

    given: Mapping[tuple[str, str], Tolerance]
    own: Mapping[str, Figure] = field(default_factory=dict)
    """Figures of the run that the suite defines, by name."""

    def entry(self, key: FigureKey) -> Figure:
        """What is known of a figure, be it the suite's own."""
        own = self.own.get(key.figure) if key.kind == "run" else None
        return own or key.entry

    def of(self, key: FigureKey) -> Tolerance:
        """Tolerance of one figure."""
        given = self.given.get((key.kind, key.figure))
        return usual(self.entry(key)) if given is None else given


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
    return found * _assured_scatter(len(pairs))


def _assured_scatter(count: int) -> float:
    """Upper end of the interval of a standard deviation over ``count`` values, as a share of it."""
    from scipy.stats import chi2

    return math.sqrt((count - 1) / float(chi2.ppf(1 - ASSURANCE, count - 1)))
