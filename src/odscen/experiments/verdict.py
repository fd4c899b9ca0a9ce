"""What a baseline says of new runs: which figures are outside their tolerance, where, and why.

Why is told by fingerprints, which have a digest of each input: a cause is one input, or several
that people take for one, whose digest is another.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING, NamedTuple

from odscen.experiments.tolerance import EXACT, FLOOR, WATCHED, Level, Tolerance, allowed_by_chance
from odscen.figures.measures.comparison import compare_figure
from odscen.figures.measures.figure import Better

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from odscen.experiments.baseline import Baseline
    from odscen.experiments.measure import FigureKey, Measured
    from odscen.experiments.tolerance import Detection, Tolerances
    from odscen.figures.measures.comparison import Difference
    from odscen.figures.measures.figure import Figure


FEWEST = 5
"""A place with fewer vehicles, as a mean over the seeds, is reported but fails nothing."""

_NOISE = 1e-4
"""Figures are written with that many decimals; a smaller difference is none."""


class Effect(StrEnum):
    """What a change amounts to."""

    FAILS = "fails"
    BETTER = "better"
    FEW = "too few vehicles to fail"
    EXPLAINS = "explains"
    ALLOWED = "within what is allowed"


@dataclass(frozen=True, slots=True)
class Change:
    """A figure that is not as it was.

    Attributes
    ----------
    entry
        What is known of the figure.
    score
        Orders changes: the difference over what is allowed, weighted by vehicles at places.
    effect
        What it amounts to.
    """

    key: FigureKey
    entry: Figure
    difference: Difference
    tolerance: Tolerance
    score: float
    effect: Effect

    @property
    def counts(self) -> bool:
        """Whether it fails the gate."""
        return self.effect is Effect.FAILS

    @property
    def label(self) -> str:
        """Figure and place for people."""
        place = f"{self.key.kind} {self.key.place}: " if self.key.place else ""
        return f"{place}{self.entry.label}"

    @property
    def row(self) -> tuple[str, str, str, str, str]:
        """Figure, baseline, value, difference and what is allowed, for people."""
        figure, found = self.entry, self.difference
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
        Of the whole run, those that have changed most for their tolerance first.
    places
        Segments and junctions, those that fail the gate first, the most changed before others.
    actors
        The most changed first; they explain, and fail only where the suite gives a tolerance.
    allowed
        Segments and junctions, then actors, that have changed within their tolerance, the most
        changed first.
    """

    figures: tuple[Change, ...]
    places: tuple[Change, ...]
    actors: tuple[Change, ...]
    allowed: tuple[Change, ...]

    @property
    def failing(self) -> tuple[Change, ...]:
        """Changes that fail the gate, figures of the run first."""
        return tuple(
            change for change in (*self.figures, *self.places, *self.actors) if change.counts
        )

    @property
    def better(self) -> tuple[Change, ...]:
        """Changes for the better, figures of the run first."""
        return tuple(
            change for change in (*self.figures, *self.places) if change.effect is Effect.BETTER
        )

    @property
    def where(self) -> Change | None:
        """The place that has changed most, else the actor; ``None`` if all are as they were.

        Those beyond their tolerance go before others.
        """
        return next(iter((*self.places, *self.actors, *self.allowed)), None)


def hold_against(
    baseline: Baseline,
    runs: Mapping[int, Measured],
    tolerances: Tolerances,
    *,
    better_fails: bool = False,
    detect: Detection | None = None,
) -> BaselineVerdict:
    """Hold new runs, given by seed, against a baseline, by the means over the seeds of both.

    Figures of the run that the baseline does not have are newer than it, and are not judged. What
    is allowed is what the suite says; else, of a baseline by scatter, what chance explains, but not
    less than half of what the figure's entry says; else what the entry says.

    Parameters
    ----------
    better_fails
        Whether a figure fails, too, that is better than its tolerance allows.
    detect
        A change that is to be caught: its figure has more of the false alarms than others.
    """
    compared = _compare_seeds(baseline, runs)
    limits = _Limits(
        tolerances, _share_false_alarms(compared, tolerances, detect), detect, better_fails
    )
    changes = []
    for figure in compared:
        tolerance = tolerances.of(figure.key)
        if baseline.by_scatter and (figure.key.kind, figure.key.figure) not in tolerances.given:
            tolerance = limits.by_scatter(figure, tolerance)
        change = _judge_change(figure, tolerance, tolerances, by_scatter=baseline.by_scatter)
        if change is not None:
            if better_fails and change.effect is Effect.BETTER:
                change = replace(change, effect=Effect.FAILS)
            changes.append(change)

    def of(*kinds: str, allowed: bool = False) -> tuple[Change, ...]:
        chosen = [
            change
            for change in changes
            if change.key.kind in kinds and allowed == (change.effect is Effect.ALLOWED)
        ]
        # Sorting is stable: figures of the run that are equally far off stay in their order.
        return tuple(sorted(chosen, key=lambda change: (not change.counts, -change.score)))

    places = ("segment", "junction")
    slight = (*of(*places, allowed=True), *of("actor", allowed=True))
    return BaselineVerdict(of("run"), of(*places), of("actor"), slight)


class _ComparedFigure(NamedTuple):
    """A figure on both sides, by seed, and how many vehicles it rests on."""

    key: FigureKey
    old: dict[int, float | None]
    new: dict[int, float | None]
    weight: float


def _compare_seeds(baseline: Baseline, runs: Mapping[int, Measured]) -> list[_ComparedFigure]:
    """Figures of the seeds that both have; by scatter also of other seeds, if those differ."""
    common = [seed for seed in baseline.seeds if seed in runs]
    others = baseline.by_scatter and set(runs) != set(baseline.seeds)
    before, now = (list(baseline.seeds), list(runs)) if others else (common, common)
    position = {seed: index for index, seed in enumerate(baseline.seeds)}
    found = (key for seed in now for key in runs[seed] if key.kind != "run")
    compared = []
    for key in dict.fromkeys((*baseline.figures, *found)):
        stored = baseline.figures.get(key)
        old: dict[int, float | None]
        old = {seed: None if stored is None else stored[position[seed]] for seed in before}
        new = {seed: runs[seed].get(key) for seed in now}
        if key.place and key.figure == "vehicles":  # a place that no vehicle passes has no row
            old = {seed: value or 0.0 for seed, value in old.items()}
            new = {seed: value or 0.0 for seed, value in new.items()}
        compared.append(_ComparedFigure(key, old, new, 1.0))
    passed = {
        figure.key: tuple(_mean_count(side) for side in (figure.old, figure.new))
        for figure in compared
        if figure.key.figure == "vehicles"
    }
    return [figure._replace(weight=_count_vehicles(figure.key, passed)) for figure in compared]


def _share_false_alarms(
    compared: Sequence[_ComparedFigure], tolerances: Tolerances, detect: Detection | None
) -> Level:
    """Share out false alarms among the figures that can fail by scatter."""
    run = places = 0
    for figure in compared:
        if (figure.key.kind, figure.key.figure) in tolerances.given or figure.key.kind == "actor":
            continue
        run += figure.key.kind == "run" and not (detect is not None and figure.key == detect.key)
        places += figure.key.kind != "run" and figure.weight >= FEWEST
    return Level.shared(run=run, places=places, watched=detect is not None)


class _Limits(NamedTuple):
    """What scatter allows of each figure."""

    tolerances: Tolerances
    level: Level
    detect: Detection | None
    better_fails: bool

    def by_scatter(self, compared: _ComparedFigure, usual: Tolerance) -> Tolerance:
        """What chance explains, where that is more than the least that matters."""
        watched = (
            self.detect if self.detect is not None and compared.key == self.detect.key else None
        )
        level = self.level.run if compared.key.kind == "run" else self.level.place
        better = self.tolerances.entry(compared.key).better
        allowed = allowed_by_chance(
            compared.old,
            compared.new,
            level=level if watched is None else WATCHED,
            both_sides=self.better_fails or better is Better.NEITHER,
        )
        if allowed is None:
            return usual
        floor = usual.times(FLOOR)
        mean = _mean_known(compared.old)
        if watched is not None and watched.floor(mean) < floor.allowed(mean):
            floor = Tolerance(absolute=watched.floor(mean))
        return floor if allowed <= floor.allowed(mean) else Tolerance(0.0, allowed, by_scatter=True)


def _mean_known(values: Mapping[int, float | None]) -> float:
    known = [value for value in values.values() if value is not None]
    return sum(known) / len(known)


def _judge_change(
    compared: _ComparedFigure, tolerance: Tolerance, tolerances: Tolerances, *, by_scatter: bool
) -> Change | None:
    key, entry = compared.key, tolerances.entry(compared.key)
    difference = compare_figure(compared.old, compared.new)
    if difference.a is None or difference.b is None:
        # Places and actors without a figure are seen by who passed and who arrived.
        if difference.a is difference.b or key.kind != "run":
            return None
        there = compared.old if difference.b is None else compared.new
        if by_scatter and None in there.values():  # with other seeds there may be none, too
            return None
        return Change(key, entry, difference, EXACT, 1.0, Effect.FAILS)
    allowed = tolerance.allowed(difference.a)
    size = abs(difference.b - difference.a)
    if size <= _NOISE:
        return None
    # A mean over n vehicles varies by chance with 1 / sqrt(n). Where none is allowed, one counts.
    score = size / (allowed or 1.0) * math.sqrt(compared.weight)
    effect = Effect.ALLOWED
    if size > allowed + _NOISE:
        effect = _effect_of(
            key, tolerances, compared.weight, better=entry.improves(difference.difference)
        )
    return Change(key, entry, difference, tolerance, score, effect)


def _effect_of(
    key: FigureKey, tolerances: Tolerances, weight: float, *, better: bool | None
) -> Effect:
    if key.kind == "actor" and (key.kind, key.figure) not in tolerances.given:
        return Effect.EXPLAINS
    if key.place and key.kind != "actor" and weight < FEWEST:
        return Effect.FEW
    return Effect.BETTER if better else Effect.FAILS


def _count_vehicles(key: FigureKey, passed: Mapping[FigureKey, tuple[float, ...]]) -> float:
    """Vehicles that a figure of a place rests on: mean over the seeds, the lesser of both sides."""
    if key.kind not in ("segment", "junction"):
        return 1.0
    sides = passed.get(key._replace(figure="vehicles"), (0.0, 0.0))
    return max(sides) if key.figure == "vehicles" else min(sides)


def _mean_count(values: Mapping[int, float | None]) -> float:
    return sum(value or 0.0 for value in values.values()) / max(1, len(values))


_PACKAGES = ("sumo", "odscen")

_LABELS = {
    "map": "map",
    "network": "map",
    "scenario.signals": "signals",
    "scenario.measures": "measures",
    "scenario.rules": "rules",
    "scenario.criteria": "criteria",
    "scenario.actors": "actors",
    "scenario.flows": "demand",
    "scenario.demand": "demand",
    "scenario.transit": "public transport",
    "scenario.drivers": "drivers",
    "scenario.environment": "environment",
    "scenario.roi": "region of interest",
    "scenario.simulation": "settings",
    "redraw": "settings",
    "sumo": "SUMO",
    "odscen": "odscen",
}
"""What people call each part of a fingerprint, the likeliest to change traffic first."""

VERSIONS = tuple(_LABELS[name] for name in _PACKAGES)
"""Names of the causes that are versions, not inputs."""

_POINTS_TO = {
    ("run", "planned"): ("demand", "actors"),
    ("junction", "waiting_time"): ("signals",),
    ("segment", "free_speed"): ("map", "drivers", "environment"),
}
"""Causes that a figure speaks for when several inputs have changed."""


@dataclass(frozen=True, slots=True)
class Cause:
    """An input that has changed.

    Attributes
    ----------
    name
        ``"map"``, ``"signals"``, ``"SUMO"``, ...
    words
        What has changed about it: ``"the scenario's signals"``, ``"sumo 1.27.0 -> 1.28.0"``. What
        is different on two maps, road by road, would be said here.
    part
        Of the scenario, as its document calls it; empty for other inputs.
    details
        Fields of that part with both values, where the scenario of before is kept.
    """

    name: str
    words: str
    part: str = ""
    details: str = ""


def causes_between(old: Mapping[str, str], new: Mapping[str, str]) -> tuple[Cause, ...]:
    """Compare two fingerprints; nothing if nothing is different. The likeliest cause is first."""
    order = list(_LABELS)
    names = sorted(
        old.keys() | new.keys(),
        key=lambda name: (order.index(name) if name in order else len(order), name),
    )
    return tuple(
        Cause(
            _LABELS.get(name, name.removeprefix("scenario.")),
            _describe_input(name, old, new),
            part=name.removeprefix("scenario.") if name.startswith("scenario.") else "",
        )
        for name in names
        if old.get(name) != new.get(name)
    )


def _describe_input(name: str, old: Mapping[str, str], new: Mapping[str, str]) -> str:
    if name in _PACKAGES or name == "redraw":
        without = "open" if name == "redraw" else "none"
        return f"{name} {old.get(name, without)} -> {new.get(name, without)}"
    part = name.removeprefix("scenario.")
    return f"the {name}" if part == name else f"the scenario's {part}"


def likeliest_first(causes: Iterable[Cause], worst: Iterable[Change]) -> tuple[Cause, ...]:
    """Put the causes first that the figures speak for which have changed most."""
    spoken_for = [
        name
        for change in worst
        for name in _POINTS_TO.get((change.key.kind, change.key.figure), ())
    ]

    def place(cause: Cause) -> int:
        return spoken_for.index(cause.name) if cause.name in spoken_for else len(spoken_for)

    return tuple(sorted(causes, key=place))
