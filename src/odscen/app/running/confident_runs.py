"""As many seeds as a confidence interval of a figure needs.

Of ``n`` runs with different seeds, mean ``m`` and standard deviation ``s``, the 95 % confidence
interval of the mean is ``m +- h`` with

``h = t(0.975, n - 1) s / sqrt(n)``

(Student's t). Near saturation a few runs break down, and of few seeds none may have: the scatter is
lopsided, and this interval too short. So of five values and more, if all are above 0, it is Cox's
for the mean of a log-normal figure, with Student's t: of logarithms with mean ``y`` and standard
deviation ``u``

``exp(y + u^2 / 2 +- t(0.975, n - 1) sqrt(u^2 / n + u^4 / (2 (n - 1))))``

(Olsson, "Confidence intervals for the mean of a log-normal distribution", Journal of Statistics
Education 13 (1), 2005); ``h`` reaches to the end that is further from ``m``. With a scatter of some
percent both are the same.

``n`` runs are enough for an interval of ``+- share`` if ``h <= share |m|``; of more, the least
``n`` for which this holds with the scatter of the runs that there are (FHWA-HOP-18-036, appendix on
the number of model runs).
"""

from __future__ import annotations

import math
import statistics
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from odscen.app.running.batches import run_many
from odscen.app.scenarios import scenario_name
from odscen.base.errors import InputError, NotFoundError
from odscen.figures.measures.registry import names_of, run_figure
from odscen.records.outcomes import RunStatus
from odscen.runs.reporter import SILENT
from odscen.runs.run_settings import AS_DESIGNED

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from odscen.base.given_files import GivenPath
    from odscen.maps.store import Workspace
    from odscen.runs.finished_run import Run
    from odscen.runs.reporter import Reporter
    from odscen.runs.run_settings import RunSettings
    from odscen.scenario.document.scenario_document import Scenario

FIGURE = "mean_delay"
"""The figure whose interval is wanted unless another is named."""
FEWEST = 5
"""Runs that the standard deviation is taken from at first."""
_TAIL = 0.025
_MOST = 10_000
_LARGEST = 700.0
"""Logarithm of a number up to which there are floating-point numbers."""


@dataclass(frozen=True, slots=True)
class Confidence:
    """The confidence interval of a figure over the seeds of a scenario, and the one wanted.

    Attributes
    ----------
    mean, half_width
        In the unit of the figure: the 95 % interval is mean +- half_width; ``None`` of fewer than
        two values.
    share
        Half the width wanted, as a share of the mean.
    seeds
        Runs that have the figure.
    needed
        Runs that the interval wanted takes; ``None`` where that cannot be said.
    """

    scenario: str
    figure: str
    mean: float | None
    half_width: float | None
    share: float
    seeds: int
    needed: int | None

    @property
    def enough(self) -> bool:
        """Whether the interval is as narrow as wanted."""
        return (
            self.mean is not None
            and self.half_width is not None
            and self.half_width <= self.share * abs(self.mean)
        )

    @property
    def words(self) -> str:
        """One line for people."""
        unit = _unit_suffix(self.figure)
        wanted = f"the interval wanted, +- {100.0 * self.share:g} %"
        if self.mean is None or self.half_width is None:
            return f"{self.figure}: {self.seeds} seeds are too few for {wanted}"
        own = f"{self.figure} {self.mean:.2f} +- {self.half_width:.2f}{unit}"
        own += f" with {self.seeds} seeds"
        if self.enough:
            return f"{own}: enough for {wanted}"
        needs = "" if self.needed is None else f", it takes about {self.needed}"
        return f"{own}: too few for {wanted}{needs}"

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready."""
        return {**asdict(self), "enough": self.enough, "words": self.words}


def _unit_suffix(figure: str) -> str:
    entry = run_figure(figure)
    return f" {entry.unit}" if entry is not None and entry.unit else ""


def confidence_of(
    values: Sequence[float | None],
    *,
    share: float,
    figure: str = FIGURE,
    scenario: str = "",
    lopsided: bool = True,
) -> Confidence:
    """Confidence interval of a figure from its values by seed.

    Parameters
    ----------
    share
        Half the width wanted, as a share of the mean.
    lopsided
        Whether the figure may scatter further up than down, as differences do not.
    """
    known = [value for value in values if value is not None]
    if len(known) < 2:
        return Confidence(scenario, figure, None, None, share, len(known), None)
    mean = statistics.fmean(known)
    reach = (_cox_reach if lopsided and _looks_lognormal(known) else _student_reach)(known)
    half = reach(len(known))
    needed = None
    if mean:
        needed = next((n for n in _seed_counts() if reach(n) <= share * abs(mean)), None)
    return Confidence(scenario, figure, mean, half, share, len(known), needed)


def _seed_counts() -> Sequence[int]:
    return range(2, _MOST)


def _looks_lognormal(values: Sequence[float]) -> bool:
    return len(values) >= FEWEST and 0.0 < min(values) < max(values)


def _student_reach(values: Sequence[float]) -> Callable[[int], float]:
    """From the mean to an end of the interval, of so many runs that scatter like these."""
    scatter = statistics.stdev(values)
    return lambda count: _compute_quantile(count) * scatter / math.sqrt(count)


def _cox_reach(values: Sequence[float]) -> Callable[[int], float]:
    """The same of a log-normal figure, to the further end."""
    mean, logarithms = statistics.fmean(values), [math.log(value) for value in values]
    spread = statistics.variance(logarithms)
    middle = statistics.fmean(logarithms) + spread / 2.0

    def reach(count: int) -> float:
        error = math.sqrt(spread / count + spread * spread / (2.0 * (count - 1)))
        high = middle + _compute_quantile(count) * error
        highest = math.exp(high) if high < _LARGEST else math.inf
        return max(highest - mean, mean - math.exp(2.0 * middle - high))

    return reach


def _compute_quantile(count: int) -> float:
    from scipy.special import stdtrit

    return float(stdtrit(count - 1, 1.0 - _TAIL))


def parse_share(text: str) -> float:
    """Read half the width of an interval: ``"5 %"``, ``"5%"`` or ``"0.05"``.

    Raises
    ------
    InputError
        If it is no share above 0 and below 1.
    """
    try:
        number, percent, rest = text.strip().partition("%")
        share = float(number) / (100.0 if percent else 1.0)
    except ValueError:
        share, rest = math.nan, ""
    if rest or not 0.0 < share < 1.0:
        raise InputError(f"{text!r} is no share of the mean; write for example 5 % or 0.05")
    return share


def run_until_confident(
    workspace: Workspace,
    scenario: Scenario | GivenPath,
    *,
    share: float,
    figure: str = FIGURE,
    seeds: Sequence[int] = tuple(range(1, FEWEST + 1)),
    most: int = 50,
    settings: RunSettings = AS_DESIGNED,
    out: Path | None = None,
    overwrite: bool = False,
    processes: int = 1,
    reports: bool = True,
    reporter: Reporter = SILENT,
) -> tuple[tuple[Run, ...], Confidence]:
    """Run a scenario with more and more seeds until the interval of a figure is narrow enough.

    Parameters
    ----------
    share
        Half the width of the 95 % interval wanted, as a share of the mean.
    figure
        Of the table of figures in docs/runs.md.
    seeds
        That are run in any case; then come those that follow the largest.
    most
        Seeds in all, at most.
    overwrite
        Whether runs that have ended are replaced in ``out``; in the workspace's ``runs`` they are.
    reports
        Whether each run gets its report.
    reporter
        Hears of each run, and after each round how far it is.

    Returns
    -------
    The runs, by seed, and the interval of those that completed; it is not ``enough`` if ``most``
    seeds are too few.

    Raises
    ------
    NotFoundError
        If there is no such figure.
    """
    if run_figure(figure) is None:
        raise NotFoundError("figure", figure, names_of("run"))
    done: list[Run] = []
    batch = list(seeds)[:most]
    while True:
        done += run_many(
            workspace, [scenario], settings=settings, seeds=batch, out=out, overwrite=overwrite,
            processes=processes, reports=reports, figures=reports, reporter=reporter,
        )  # fmt: skip
        found = confidence_of(
            [_figure_value(run, figure) for run in done],
            share=share,
            figure=figure,
            scenario=scenario_name(scenario),
        )
        reporter.said(f"{found.scenario}: {found.words}")
        missing = min(found.needed or most, most) - len(done)
        if found.enough or len(done) >= most or not any(map(_has_completed, done)):
            return tuple(done), found
        first = max(batch) + 1
        batch = list(range(first, first + min(max(1, missing), most - len(done))))


def _has_completed(run: Run) -> bool:
    return run.status is RunStatus.COMPLETED


def _figure_value(run: Run, figure: str) -> float | None:
    entry = run_figure(figure)
    return run.value_of(entry) if entry is not None and _has_completed(run) else None
