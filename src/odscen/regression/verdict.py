"""What a baseline says of new runs: which figures are outside their tolerance, and where."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from odscen.regression.tolerance import EXACT
from odscen.results.measures.comparison import compare_figure

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.regression.baseline import Baseline
    from odscen.regression.measure import FigureKey, Measured
    from odscen.regression.tolerance import Tolerance, Tolerances
    from odscen.results.measures.comparison import Difference

FEWEST = 5
"""A place with fewer vehicles, as a mean over the seeds, is reported but fails nothing."""

_NOISE = 1e-4
"""Figures are written with that many decimals; a smaller difference is none."""


@dataclass(frozen=True, slots=True)
class Change:
    """A figure that is not as it was; ``score`` orders places by how much they have changed."""

    key: FigureKey
    difference: Difference
    tolerance: Tolerance
    score: float
    counts: bool

    @property
    def row(self) -> tuple[str, str, str, str, str]:
        """Figure, baseline, value, difference and what is allowed, for people."""
        figure, found = self.key.entry, self.difference
        before, now = (
            "none" if value is None else figure.written(value) for value in (found.a, found.b)
        )
        how_far = []
        if found.difference is not None:
            sign = "+" if found.difference > 0 else "-"
            how_far.append(f"{sign}{figure.written(abs(found.difference))}")
        if found.relative is not None:
            how_far.append(f"{100 * found.relative:+.1f} %")
        return self.key.name, before, now, ", ".join(how_far), self.tolerance.words(figure)

    @property
    def words(self) -> str:
        """``"mean_delay is 31.20 s, was 24.00 s (+7.20 s, +30.0 %; allowed 2 % or 0.50 s)"``."""
        name, before, now, how_far, allowed = self.row
        size = f"{how_far}; allowed {allowed}" if how_far else f"allowed {allowed}"
        return f"{name} is {now}, was {before} ({size})"


@dataclass(frozen=True, slots=True)
class BaselineVerdict:
    """Figures of a scenario outside their tolerance.

    Attributes
    ----------
    figures
        Of the whole run, in their order.
    places
        Segments and junctions, the most changed first; those with ``counts`` fail the gate.
    actors
        The most changed first; they explain, and fail only where the suite gives a tolerance.
    """

    figures: tuple[Change, ...]
    places: tuple[Change, ...]
    actors: tuple[Change, ...]

    @property
    def failing(self) -> tuple[Change, ...]:
        """Changes that fail the gate, figures of the run first."""
        return tuple(
            change for change in (*self.figures, *self.places, *self.actors) if change.counts
        )

    @property
    def where(self) -> Change | None:
        """The place that has changed most, else the actor; ``None`` if all are as they were."""
        return next(iter((*self.places, *self.actors)), None)


def hold_against(
    baseline: Baseline, runs: Mapping[int, Measured], tolerances: Tolerances
) -> BaselineVerdict:
    """Hold new runs, given by seed, against a baseline, by the means over the seeds of both.

    Figures of the run that the baseline does not have are newer than it, and are not judged.
    """
    seeds = [seed for seed in baseline.seeds if seed in runs]
    position = {seed: index for index, seed in enumerate(baseline.seeds)}
    found = (key for seed in seeds for key in runs[seed] if key.kind != "run")
    keys = dict.fromkeys((*baseline.figures, *found))
    changes = []
    for key in keys:
        stored = baseline.figures.get(key)
        old: dict[int, float | None]
        old = {seed: None if stored is None else stored[position[seed]] for seed in seeds}
        new = {seed: runs[seed].get(key) for seed in seeds}
        if key.place and key.figure == "vehicles":  # a place that no vehicle passes has no row
            old = {seed: value or 0.0 for seed, value in old.items()}
            new = {seed: value or 0.0 for seed, value in new.items()}
        weight = _vehicles(key, baseline, runs, seeds, position)
        change = _change(key, compare_figure(old, new), tolerances, weight)
        if change is not None:
            changes.append(change)

    def of(*kinds: str) -> tuple[Change, ...]:
        chosen = [change for change in changes if change.key.kind in kinds]
        if kinds != ("run",):
            chosen.sort(key=lambda change: (not change.counts, -change.score, change.key))
        return tuple(chosen)

    return BaselineVerdict(of("run"), of("segment", "junction"), of("actor"))


def _change(
    key: FigureKey, difference: Difference, tolerances: Tolerances, weight: float
) -> Change | None:
    tolerance = tolerances.of(key)
    if difference.a is None or difference.b is None:
        # Places and actors without a figure are seen by who passed and who arrived.
        if difference.a is difference.b or key.kind != "run":
            return None
        return Change(key, difference, EXACT, math.inf, counts=True)
    allowed = tolerance.allowed(difference.a)
    size = abs(difference.b - difference.a)
    if size <= allowed + _NOISE:
        return None
    # A mean over n vehicles varies by chance with 1 / sqrt(n).
    score = size / max(allowed, _NOISE) * math.sqrt(weight)
    counts = {
        "run": True,
        "actor": (key.kind, key.figure) in tolerances.given,
    }.get(key.kind, weight >= FEWEST)
    return Change(key, difference, tolerance, score, counts=counts)


def _vehicles(
    key: FigureKey,
    baseline: Baseline,
    runs: Mapping[int, Measured],
    seeds: list[int],
    position: Mapping[int, int],
) -> float:
    """Vehicles that a figure of a place rests on: mean over the seeds, the lesser of both sides."""
    if key.kind not in ("segment", "junction"):
        return 1.0
    own = key._replace(figure="vehicles")
    stored = baseline.figures.get(own)
    old = sum((stored[position[seed]] or 0.0) if stored else 0.0 for seed in seeds)
    new = sum(runs[seed].get(own) or 0.0 for seed in seeds)
    chosen = max(old, new) if key.figure == "vehicles" else min(old, new)
    return chosen / max(1, len(seeds))
