"""Parameter value distributions as plans of sweeps."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from odscen.formats.openscenario_import.import_report import RefusedError
from odscen.scenario.sweeps.sweep_plan import MOST_CASES, Range, SweepPlan, Table

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping

    from lxml.etree import _Element
    from numpy.random import Generator

    from odscen.base.arrays import FloatArray
    from odscen.formats.openscenario_import.import_report import ImportReport

_DIGITS: Final = 9


def read_distribution(
    report: ImportReport, element: _Element, known: Collection[str]
) -> SweepPlan | None:
    """Plan of the sweep that a ``ParameterValueDistribution`` asks for.

    A deterministic one is a grid of its ranges, sets and tables. Of a stochastic one the test runs
    are drawn here, by its random seed, each parameter for itself.

    Parameters
    ----------
    known
        Parameters of the scenario; others cannot be varied, and the report says so.

    Returns
    -------
    SweepPlan or None
        ``None`` if no parameter of the scenario is varied.

    Raises
    ------
    InputError
        If a value that should be a number is none; names element and line.
    """
    report.mark(element, "taken")
    reading = _DistributionReader(report, known)
    kind = report.child(element, "Deterministic", "Stochastic")
    if kind is None:
        raise report.wrong(element, "there is no Deterministic and no Stochastic distribution")
    axes = reading.deterministic(kind) if kind.tag == "Deterministic" else reading.drawn(kind)
    return SweepPlan(tuple(axes)) if axes else None


@dataclass(frozen=True, slots=True)
class _DistributionReader:
    report: ImportReport
    known: Collection[str]

    def deterministic(self, group: _Element) -> list[Range | Table]:
        """An axis for each distribution of parameters that are known."""
        found: list[Range | Table] = []
        for child in self.report.children(group):
            try:
                if child.tag == "DeterministicMultiParameterDistribution":
                    axis: Range | Table | None = self._read_value_sets(self.report.only(child))
                else:
                    axis = self._read_single(child)
            except RefusedError as error:
                self.report.mark(child, "refused", error.reason)
                continue
            if axis is not None:
                found.append(axis)
        return found

    def _read_single(self, element: _Element) -> Range | Table | None:
        name = self.report.word(element, "parameterName").lstrip("$")
        if not self._is_known(element, name):
            return None
        kind = self.report.only(element)
        if kind.tag == "DistributionSet":
            values = [self.report.number(child, "value") for child in self.report.children(kind)]
            return Table((name,), _unique_rows(kind, [(_round_value(value),) for value in values]))
        if kind.tag == "DistributionRange":
            return self._read_range(kind, name)
        raise RefusedError(kind, f"a {kind.tag} of values")

    def _read_range(self, kind: _Element, name: str) -> Range | Table:
        """Values from the lower limit on, a step apart, up to the upper limit."""
        limits = self.report.only(kind)
        low = _round_value(self.report.number(limits, "lowerLimit"))
        high = _round_value(self.report.number(limits, "upperLimit"))
        step = self.report.number(kind, "stepWidth")
        if step <= 0 or high < low:
            raise self.report.wrong(kind, f"no step of {step:g} leads from {low:g} to {high:g}")
        count = math.floor((high - low) / step + 1e-9) + 1
        if count > MOST_CASES:
            raise self.report.wrong(kind, f"{count:,} values; at most {MOST_CASES:,} are possible")
        values = [round(low + number * step, _DIGITS) for number in range(count)]
        if count > 1 and math.isclose(values[-1], high, abs_tol=1e-9):
            return Range(name, low, high, count)
        return Table((name,), tuple((value,) for value in values))

    def _read_value_sets(self, kind: _Element) -> Table | None:
        """Values that belong together; columns of parameters that are not known are left out."""
        if kind.tag != "ValueSetDistribution":
            raise RefusedError(kind, f"a {kind.tag} of values")
        rows: list[dict[str, float]] = []
        for group in self.report.children(kind, "ParameterValueSet"):
            row = {}
            for child in self.report.children(group, "ParameterAssignment"):
                name = self.report.word(child, "parameterRef").lstrip("$")
                if self._is_known(child, name):
                    row[name] = _round_value(self.report.number(child, "value"))
            rows.append(row)
        names = tuple(rows[0]) if rows else ()
        if any(set(row) != set(names) for row in rows):
            raise RefusedError(kind, "sets of values that do not have the same parameters")
        if not names:
            return None
        return Table(
            names, _unique_rows(kind, [tuple(row[name] for name in names) for row in rows])
        )

    def _is_known(self, element: _Element, name: str) -> bool:
        if name in self.known:
            return True
        words = "no number of the scenario comes from it: it keeps its declared value"
        for inner in element.iter("*"):
            self.report.mark(inner, "approximated", words)
        return False

    def drawn(self, group: _Element) -> list[Range | Table]:
        """Test runs as one table, a column for each parameter."""
        count = int(self.report.number(group, "numberOfTestRuns"))
        seed = int(abs(self.report.number(group, "randomSeed", 0.0)))
        if not 1 <= count <= MOST_CASES:
            raise self.report.wrong(group, f"{count} test runs; 1 to {MOST_CASES:,} are possible")
        columns: dict[str, list[float]] = {}
        for index, distribution in enumerate(self.report.children(group, "StochasticDistribution")):
            name = self.report.word(distribution, "parameterName").lstrip("$")
            if not self._is_known(distribution, name):
                continue
            generator = np.random.default_rng([seed, index])
            try:
                columns[name] = self._draw_column(self.report.only(distribution), count, generator)
            except RefusedError as error:
                self.report.mark(distribution, "refused", error.reason)
                continue
            words = f"{count} values drawn now, by seed {seed} and numpy's generator"
            self.report.mark(distribution, "approximated", words)
        rows = tuple(zip(*columns.values(), strict=True))
        return [Table(tuple(columns), rows)] if columns else []

    def _draw_column(self, kind: _Element, count: int, generator: Generator) -> list[float]:
        draw = DRAWS.get(str(kind.tag))
        if draw is None:
            raise RefusedError(kind, f"a {kind.tag} of values")
        return [_round_value(value) for value in draw(self, kind, count, generator).tolist()]

    def limits(self, kind: _Element) -> tuple[float, float]:
        """Limits of a distribution; infinite without a range."""
        inside = self.report.child(kind, "Range")
        if inside is None:
            return -math.inf, math.inf
        low, high = (self.report.number(inside, name) for name in ("lowerLimit", "upperLimit"))
        if low > high:
            raise self.report.wrong(inside, f"the range {low:g} to {high:g} is empty")
        return low, high


def _draw_uniform(
    read: _DistributionReader, kind: _Element, count: int, generator: Generator
) -> FloatArray:
    low, high = read.limits(kind)
    if not math.isfinite(low):
        raise read.report.wrong(kind, "there is no Range")
    return generator.uniform(low, high, count)


def _draw_normal(
    read: _DistributionReader, kind: _Element, count: int, generator: Generator
) -> FloatArray:
    from scipy.stats import truncnorm

    mean, variance = (read.report.number(kind, key) for key in ("expectedValue", "variance"))
    low, high = read.limits(kind)
    if variance < 0:
        raise read.report.wrong(kind, f"the variance {variance:g} is negative")
    spread = math.sqrt(variance)
    if spread == 0:
        return np.full(count, min(max(mean, low), high), dtype=np.float64)
    bounds = (low - mean) / spread, (high - mean) / spread
    found: FloatArray = truncnorm.ppf(generator.random(count), *bounds, loc=mean, scale=spread)
    clipped: FloatArray = np.clip(found, low, high)
    return clipped


def _draw_poisson(
    read: _DistributionReader, kind: _Element, count: int, generator: Generator
) -> FloatArray:
    """Whole numbers in the range, as often as a Poisson distribution has them."""
    from scipy.stats import poisson

    mean = read.report.number(kind, "expectedValue")
    if not 0 < mean < 1e6:
        raise read.report.wrong(kind, f"an expected value of {mean:g}")
    low, high = read.limits(kind)
    below = poisson.cdf(math.ceil(low) - 1, mean) if math.isfinite(low) else 0.0
    up_to = poisson.cdf(math.floor(high), mean) if math.isfinite(high) else 1.0
    if not up_to > below:
        raise read.report.wrong(kind, f"the range {low:g} to {high:g} has no value of it")
    found: FloatArray = poisson.ppf(generator.uniform(below, up_to, count), mean)
    return found


def _draw_histogram(
    read: _DistributionReader, kind: _Element, count: int, generator: Generator
) -> FloatArray:
    bins = list(read.report.children(kind, "Bin", "HistogramBin"))
    chosen = generator.choice(len(bins), count, p=_read_shares(read, kind, bins))
    limits = np.array([read.limits(bin_element) for bin_element in bins])
    if not np.isfinite(limits).all():
        raise read.report.wrong(kind, "a bin has no Range")
    low, high = limits[chosen].T
    drawn: FloatArray = generator.uniform(low, high)
    return drawn


def _draw_by_weight(
    read: _DistributionReader, kind: _Element, count: int, generator: Generator
) -> FloatArray:
    values = list(read.report.children(kind, "Element"))
    chosen = generator.choice(len(values), count, p=_read_shares(read, kind, values))
    return np.array([read.report.number(value, "value") for value in values])[chosen]


def _read_shares(read: _DistributionReader, kind: _Element, parts: list[_Element]) -> FloatArray:
    weights = np.array([read.report.number(part, "weight") for part in parts])
    if not parts or weights.min() < 0 or not weights.sum() > 0:
        raise read.report.wrong(kind, "there are no parts with weights")
    shares: FloatArray = weights / weights.sum()
    return shares


DRAWS: Final[
    Mapping[str, Callable[[_DistributionReader, _Element, int, Generator], FloatArray]]
] = {
    "UniformDistribution": _draw_uniform,
    "NormalDistribution": _draw_normal,
    "PoissonDistribution": _draw_poisson,
    "Histogram": _draw_histogram,
    "ProbabilityDistributionSet": _draw_by_weight,
}
"""How values of stochastic distributions are drawn."""


def _round_value(value: float) -> float:
    return round(float(value), _DIGITS)


def _unique_rows(kind: _Element, rows: list[tuple[float, ...]]) -> tuple[tuple[float, ...], ...]:
    """Rows in their order, each once."""
    if not rows:
        raise RefusedError(kind, "it has no values")
    return tuple(dict.fromkeys(rows))
