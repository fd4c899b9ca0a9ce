"""Expectations of a run, such as ``arrived>=0.95`` or ``mean_delay <= 40 s`` (requirement R58).

``NAME OP NUMBER [UNIT]`` with one of ``>= <= > < ==``. Names are those of the summary: sim_seconds,
the counts of actors (planned, inserted, arrived, ...) and the figures (insertion_error_max,
mean_travel_time, ...); :mod:`odscen.results.measures.registry` has them all. A *count* compared
with a number from 0 to 1 that is written with a decimal point, or followed by ``%``, is taken as a
share of the planned actors: ``arrived>=0.95``, ``arrived>=95%`` and ``arrived==1.0`` are shares,
``arrived>=1`` and ``collided==0`` are counts.
``usable`` alone expects that the run is not "not usable".
A unit may be another one of the same kind: ``mean_speed >= 30 km/h``; without one it is SI.
"""

from __future__ import annotations

import difflib
import operator
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from odscen.base.errors import InputError
from odscen.results.measures.figure import Basis, RunFigure
from odscen.results.measures.registry import names_of, run_figure
from odscen.results.measures.usability import UsabilityLevel, usability_score

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from odscen.results.measures.figure import Figure

NAMES = names_of("run")

_OPERATORS: dict[str, Callable[[float, float], bool]] = {
    ">=": operator.ge,
    "<=": operator.le,
    "==": operator.eq,
    ">": operator.gt,
    "<": operator.lt,
}
_PATTERN = re.compile(
    r"\s*(?P<name>[A-Za-z_]\w*)\s*(?P<op>>=|<=|==|>|<)\s*"
    r"(?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(?P<unit>%|[A-Za-z][A-Za-z/]*)?\s*"
)


@dataclass(frozen=True, slots=True)
class Expectation:
    """One expectation; ``share`` if the value is divided by the number of planned actors first."""

    text: str
    name: str
    op: str
    bound: float
    share: bool


USABLE = Expectation(
    "usable", "usable", ">=", float(UsabilityLevel.RESERVATIONS.score), share=False
)
"""That the run is usable, perhaps with reservations; its value is 2, 1 or 0."""


@dataclass(frozen=True, slots=True)
class ExpectationVerdict:
    """An expectation and what the run had; ``value`` ``None`` if the run has no such figure."""

    expectation: str
    value: float | None
    passed: bool


def parse_expectation(text: str, *, own: Mapping[str, Figure] | None = None) -> Expectation:
    """Read one expectation, for ``expectations`` of the settings of a run.

    Parameters
    ----------
    text
        ``NAME OP NUMBER [UNIT]``, for example ``arrived >= 95 %`` or ``mean_delay <= 40 s``; SI
        without a unit. The table of figures in docs/runs.md has the names. Or ``usable``.
    own
        Further figures by name, whose values are put into the ``figures`` of the summary.

    Returns
    -------
    Expectation
        To be held against the summary of a run.

    Raises
    ------
    InputError
        If it is not ``NAME OP NUMBER [UNIT]``, or the name is not known, or the unit does not fit.
    """
    if text.strip() == USABLE.name:
        return USABLE
    match = _PATTERN.fullmatch(text)
    if match is None:
        msg = (
            f"expectation {text!r} is not of the form NAME OP NUMBER, "
            "for example arrived>=0.95 (OP is one of >= <= > < ==), nor usable"
        )
        raise InputError(msg)
    name, number, unit = match["name"], match["number"], match["unit"] or ""
    percent = unit == "%"
    figure = run_figure(name) or (own or {}).get(name)
    counts = isinstance(figure, RunFigure) and figure.count
    if figure is None:
        close = difflib.get_close_matches(name, NAMES, n=3, cutoff=0.5)
        hint = f"did you mean {', '.join(close)}?" if close else f"known are {', '.join(NAMES)}"
        msg = f"expectation {text!r}: no figure is named {name!r}; {hint}"
        raise InputError(msg)
    if percent and not counts:
        msg = f"expectation {text!r}: {name} is no count of actors, so it has no percentage"
        raise InputError(msg)
    if percent:
        bound = float(number) / 100.0
    else:
        try:
            bound = figure.in_unit_of(float(number), unit)
        except InputError as error:
            msg = f"expectation {text!r}: {error.problem}"
            raise InputError(msg) from error
    written_as_share = ("." in number or "e" in number.lower()) and 0.0 <= bound <= 1.0
    return Expectation(
        text=text.strip(),
        name=name,
        op=match["op"],
        bound=bound,
        share=counts and (percent or written_as_share),
    )


def needs_criticality(expectations: Iterable[Expectation]) -> bool:
    """Whether one of them is about how close road users came, which is not measured by itself."""
    figures = (run_figure(expectation.name) for expectation in expectations)
    return any(figure is not None and figure.basis is Basis.CONFLICTS for figure in figures)


def evaluate(
    expectations: Sequence[Expectation], summary: Mapping[str, Any]
) -> tuple[ExpectationVerdict, ...]:
    """Hold a run's summary against expectations.

    A figure that the run does not have (none arrived, the run failed) fails its expectation.
    """
    return tuple(_verdict(expectation, summary) for expectation in expectations)


def _verdict(expectation: Expectation, summary: Mapping[str, Any]) -> ExpectationVerdict:
    value = _value(expectation, summary)
    passed = value is not None and _OPERATORS[expectation.op](value, expectation.bound)
    return ExpectationVerdict(expectation.text, value, passed)


def _value(expectation: Expectation, summary: Mapping[str, Any]) -> float | None:
    if expectation == USABLE:
        return usability_score(summary)
    figure = run_figure(expectation.name)
    own = (summary.get("figures") or {}).get(expectation.name)
    value = own if figure is None else figure.of_summary(summary)
    if value is None or not expectation.share:
        return value
    planned = summary["actors"]["planned"]
    return value / planned if planned else None
