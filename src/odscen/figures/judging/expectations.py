"""Expectations of a run, such as ``arrived>=0.95`` or ``mean_delay <= 40 s`` (requirement R58).

``NAME OP NUMBER [UNIT]`` with one of ``>= <= > < ==``. Names are those of the summary: sim_seconds,
the counts of actors (planned, inserted, arrived, ...) and the figures (insertion_error_max,
mean_travel_time, ...); :mod:`odscen.figures.measures.registry` has them all. A *count* compared
with a number from 0 to 1 that is written with a decimal point, or followed by ``%``, is taken as a
share of the planned actors: ``arrived>=0.95``, ``arrived>=95%`` and ``arrived==1.0`` are shares,
``arrived>=1`` and ``collided==0`` are counts.
``NAME(ACTOR) OP NUMBER [UNIT]`` is about one actor, by its id: ``min_ttc(car-1) >= 1.5 s``;
``ego`` means every ego, unless an actor has this id. ``NAME(ACTOR,OTHER) OP NUMBER [UNIT]`` is
about two, ``NAME(RULE) OP NUMBER [UNIT]`` about a rule. Names are those of
:mod:`odscen.figures.judging.actor_measures`.
A value that a run does not have meets no limit; measures of encounters in tables of cases are the
exception, see :mod:`odscen.experiments.table`.
``usable`` alone expects that the run is not "not usable", ``criteria`` alone that every criterion
of the scenario is met.
A unit may be another one of the same kind: ``mean_speed >= 30 km/h``; without one it is SI.
"""

from __future__ import annotations

import difflib
import operator
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

from odscen.base.errors import InputError
from odscen.figures.judging.actor_measures import (
    ACTOR_NAMES,
    Measured,
    PairMeasure,
    RuleMeasure,
    RunRecords,
    first_event,
    measure_of,
    worst_conflict,
)
from odscen.figures.measures.figure import Basis, RunFigure
from odscen.figures.measures.registry import names_of, run_figure
from odscen.figures.measures.usability import UsabilityLevel, usability_score
from odscen.records.run_events import EventKind

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from odscen.figures.judging.actor_measures import Measure
    from odscen.figures.measures.figure import Figure

NAMES = names_of("run")
EGO = "ego"
"""Means every ego where no actor has this id."""

_OPERATORS: dict[str, Callable[[float, float], bool]] = {
    ">=": operator.ge,
    "<=": operator.le,
    "==": operator.eq,
    ">": operator.gt,
    "<": operator.lt,
}
_OPERATOR_WORDS = {
    ">=": "at least",
    "<=": "at most",
    "==": "exactly",
    ">": "more than",
    "<": "less than",
}
_PLAIN = {
    ("arrived", "==", 1.0): "reaches its goal",
    ("arrived", ">=", 1.0): "reaches its goal",
    ("collided", "==", 0.0): "does not collide",
    ("stopped", "==", 1.0): "comes to a standstill",
    ("fired", "==", 1.0): "fires",
    ("fired", "==", 0.0): "does not fire",
}
"""What is asked of an actor most, as one says it."""
_PATTERN = re.compile(
    r"\s*(?P<name>[A-Za-z_]\w*)\s*(?:\(\s*(?P<actor>[^()\s]+)\s*\)\s*)?(?P<op>>=|<=|==|>|<)\s*"
    r"(?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(?P<unit>%|[A-Za-z][A-Za-z/]*)?\s*"
)


@dataclass(frozen=True, slots=True)
class Expectation:
    """One expectation, as :func:`parse_expectation` reads it.

    Attributes
    ----------
    text
        As it was written.
    name
        Of the figure.
    op, bound
        Comparison, such as ``>=``, and number, in SI.
    share
        Whether the value is divided by the number of planned actors first.
    actor
        Id of the one that it is about, or ``ego``; ``None`` for the whole run.
    """

    text: str
    name: str
    op: str
    bound: float
    share: bool
    actor: str | None = None

    @property
    def figure(self) -> Figure | None:
        """What it is about; ``None`` for figures of a suite's own, ``usable`` and ``criteria``."""
        return run_figure(self.name) if self.actor is None else measure_of(self.name, self.actor)

    @property
    def words(self) -> str:
        """A sentence: ``"Shortest time to collision (TTC) of ego: at least 1.5 s"``."""
        figure, match = self.figure, _PATTERN.fullmatch(self.text)
        if figure is None or match is None:
            return self.text
        plain = _PLAIN.get((self.name, self.op, self.bound))
        if self.actor is not None and plain is not None:
            return f"{self.actor} {plain}"
        who = (self.actor or "").replace(",", " to ")
        about = figure.label if self.actor is None else f"{figure.label} of {who}"
        bound = f"{match['number']} {self.unit}".rstrip()
        return f"{about[0].upper()}{about[1:]}: {_OPERATOR_WORDS[self.op]} {bound}"

    @property
    def unit(self) -> str:
        """The unit that it is written in, or that of its figure."""
        figure, match = self.figure, _PATTERN.fullmatch(self.text)
        written = match["unit"] if match is not None else None
        return written or (figure.unit if figure is not None and not self.share else "")

    def holds(self, value: float) -> bool:
        """Whether a value of its figure, in SI, keeps it."""
        return _OPERATORS[self.op](value, self.bound)

    def in_its_unit(self, value: float) -> float:
        """A value of its figure in the unit that it is written in."""
        if self.unit == "%":
            return value * 100.0
        return value if self.figure is None else value / self.figure.in_unit_of(1.0, self.unit)


USABLE = Expectation(
    "usable", "usable", ">=", float(UsabilityLevel.RESERVATIONS.score), share=False
)
"""That the run is usable, perhaps with reservations; its value is 2, 1 or 0."""


CRITERIA = Expectation("criteria", "criteria", "==", 0.0, share=False)
"""That the scenario's criteria are met; its value is how many are not."""


@dataclass(frozen=True, slots=True)
class ExpectationVerdict:
    """An expectation and what the run had; ``value`` ``None`` if the run has no such figure.

    ``time`` is when the value came about, s; ``None`` where it has no instant.
    """

    expectation: str
    value: float | None
    passed: bool
    time: float | None = None


def parse_expectation(
    text: str,
    *,
    own: Mapping[str, Figure] | None = None,
    columns: Mapping[str, Figure] | None = None,
) -> Expectation:
    """Read one expectation, for ``expectations`` of the settings of a run.

    Parameters
    ----------
    text
        ``NAME OP NUMBER [UNIT]``, for example ``arrived >= 95 %`` or ``mean_delay <= 40 s``; SI
        without a unit. The table of figures in docs/runs.md has the names. Or
        ``NAME(ACTOR) OP NUMBER [UNIT]``, see docs/criteria.md; or ``usable``; or ``criteria``.
    own
        Further figures by name, whose values are put into the ``figures`` of the summary.
    columns
        Columns of a table: then it is a limit of one of them, and nothing else.

    Returns
    -------
    Expectation
        To be held against the summary of a run.

    Raises
    ------
    InputError
        If it is not ``NAME OP NUMBER [UNIT]``, or the name is not known, or the unit does not fit.
    """
    match = _PATTERN.fullmatch(text)
    if columns is not None:
        if match is None or match["actor"] is not None:
            raise InputError(f"{text!r} is no limit; write for example: min_ttc >= 1.5 s")
        if match["name"] not in columns:
            known = ", ".join(columns)
            raise InputError(f"{text!r}: there is no column {match['name']!r}; there are {known}")
    for word in (USABLE, CRITERIA):
        if text.strip() == word.name and columns is None:
            return word
    if match is None:
        raise InputError(
            f"expectation {text!r} is not of the form NAME OP NUMBER, "
            "for example arrived>=0.95 (OP is one of >= <= > < ==), nor usable or criteria"
        )
    name, number, unit = match["name"], match["number"], match["unit"] or ""
    percent = unit == "%"
    figure, names = run_figure(name) or (own or {}).get(name), NAMES
    if columns is not None:
        figure = columns[name]
    if match["actor"] is not None:
        figure, names = measure_of(name, match["actor"]), ACTOR_NAMES
    counts = isinstance(figure, RunFigure) and figure.count
    if figure is None:
        kind, hint = _KIND[names is NAMES], _suggest_names(name, names)
        raise InputError(f"expectation {text!r}: no {kind} is named {name!r}; {hint}")
    if percent and not counts:
        raise InputError(
            f"expectation {text!r}: {name} is no count of actors, so it has no percentage"
        )
    if percent:
        bound = float(number) / 100.0
    else:
        try:
            bound = figure.in_unit_of(float(number), unit)
        except InputError as error:
            raise InputError(f"expectation {text!r}: {error.problem}") from error
    written_as_share = ("." in number or "e" in number.lower()) and 0.0 <= bound <= 1.0
    return Expectation(
        text=text.strip(),
        name=name,
        op=match["op"],
        bound=bound,
        share=counts and (percent or written_as_share),
        actor=match["actor"],
    )


_KIND = {True: "figure", False: "measure of an actor"}


def _suggest_names(name: str, names: Sequence[str]) -> str:
    close = difflib.get_close_matches(name, names, n=3, cutoff=0.5)
    return f"did you mean {', '.join(close)}?" if close else f"known are {', '.join(names)}"


def needs_criticality(expectations: Iterable[Expectation]) -> bool:
    """Whether one of them is about how close road users came, which is not measured by itself."""
    figures = (expectation.figure for expectation in expectations)
    return any(getattr(figure, "basis", None) is Basis.CONFLICTS for figure in figures)


def evaluate(
    expectations: Sequence[Expectation],
    summary: Mapping[str, Any],
    records: RunRecords | None = None,
) -> tuple[ExpectationVerdict, ...]:
    """Hold a run's summary, and its records, against expectations.

    A figure that the run does not have (none arrived, the run failed) fails its expectation, and so
    does an expectation of an actor without ``records``, or of one that the run does not have.
    """
    records = RunRecords() if records is None else records
    return tuple(_judge_expectation(expectation, summary, records) for expectation in expectations)


def _judge_expectation(
    expectation: Expectation, summary: Mapping[str, Any], records: RunRecords
) -> ExpectationVerdict:
    found = _measure_expectation(expectation, summary, records)
    if found is None:
        return ExpectationVerdict(expectation.text, None, passed=False)
    passed = expectation.holds(found.value)
    return ExpectationVerdict(expectation.text, found.value, passed, found.time)


def _measure_expectation(
    expectation: Expectation, summary: Mapping[str, Any], records: RunRecords
) -> Measured | None:
    measure = expectation.figure
    if expectation.actor is not None:
        return _measure_actors(expectation, cast("Measure", measure), records)
    value = _value_of_figure(expectation, summary)
    return None if value is None else Measured(value, _instant_of_figure(expectation.name, records))


def _measure_actors(
    expectation: Expectation, measure: Measure, records: RunRecords
) -> Measured | None:
    """Value of the actor or rule; of several egos the one that is furthest from meeting it."""
    if isinstance(measure, RuleMeasure):
        return measure.compute(records, expectation.actor or "")
    actor, _, other = (expectation.actor or "").partition(",")
    chosen = [outcome for outcome in records.outcomes if outcome.id == actor]
    if not chosen and actor == EGO:
        chosen = [outcome for outcome in records.outcomes if outcome.ego]
    if isinstance(measure, PairMeasure):
        found = [measure.compute(records, outcome, other) for outcome in chosen]
    else:
        found = [measure.compute(records, outcome) for outcome in chosen]
    known = [measured for measured in found if measured is not None]
    if not known or len(known) < len(found):
        return None
    if expectation.op == "==":
        return max(known, key=lambda measured: abs(measured.value - expectation.bound))
    return (min if ">" in expectation.op else max)(known, key=lambda measured: measured.value)


_CONFLICT_COLUMNS = {"min_ttc": "ttc", "min_pet": "pet", "max_drac": "drac"}
_COUNTED_EVENTS = {
    "collided": EventKind.COLLISION,
    "teleported": EventKind.TELEPORT_START,
    "emergency_stopped": EventKind.EMERGENCY_STOP,
    "stranded": EventKind.STRANDED,
}


def _instant_of_figure(name: str, records: RunRecords) -> float | None:
    """When a figure of the run came about, if it has an instant: the first, or the worst."""
    kind = _COUNTED_EVENTS.get(name)
    if kind is not None:
        return first_event(records, kind)
    conflicts, walking = records.conflicts, name == "pedestrian_min_pet"
    column = "pet" if walking else _CONFLICT_COLUMNS.get(name)
    if column is None or conflicts is None:
        return None
    afoot = conflicts["kind"] == "walking"
    worst = worst_conflict(conflicts.filter(afoot if walking else ~afoot), column)
    return None if worst is None else worst.time


def _value_of_figure(expectation: Expectation, summary: Mapping[str, Any]) -> float | None:
    if expectation == USABLE:
        return usability_score(summary)
    if expectation == CRITERIA:
        return float(sum(not row["passed"] for row in summary.get("criteria") or ()))
    figure = run_figure(expectation.name)
    own = (summary.get("figures") or {}).get(expectation.name)
    value = own if figure is None else figure.of_summary(summary)
    if value is None or not expectation.share:
        return value
    planned = summary["actors"]["planned"]
    return value / planned if planned else None
