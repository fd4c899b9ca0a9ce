"""Criteria of a scenario: expectations that it carries itself, judged after each run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from odscen.base.errors import InputError
from odscen.figures.judging.actor_measures import RuleMeasure
from odscen.figures.judging.expectations import EGO, Expectation, evaluate, parse_expectation
from odscen.scenario.document.problems import Problem, error, warning

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from odscen.figures.judging.actor_measures import RunRecords
    from odscen.scenario.document.scenario_document import Scenario


def criteria_of(texts: Sequence[str]) -> tuple[Expectation, ...]:
    """Read criteria that :func:`criteria_problems` has passed, in their order."""
    return tuple(map(parse_expectation, texts))


_AT_ANY_TIME = frozenset(
    {"collided", "emergency_stopped", "teleported", "inserted", "planned", "departed"}
    | {"min_ttc", "min_pet", "max_drac", "serious_conflicts", "conflicts", "usable", "criteria"}
)
"""Figures of a run that do not wait for arrivals."""
_ON_ARRIVAL = frozenset({"arrived", "mean_speed", "travel_time", "delay"})
"""Measures of an actor that it has when it has arrived."""


def awaited_actors(wanted: Sequence[Expectation], scenario: Scenario) -> tuple[str, ...]:
    """Actors about whose arrival something is asked, in the order of the document."""
    names: set[str] = set()
    for expectation in wanted:
        if expectation.actor is None and expectation.name not in _AT_ANY_TIME:
            names.update(actor.id for actor in scenario.actors)
        elif expectation.name in _ON_ARRIVAL:
            known = [actor.id for actor in scenario.actors if actor.id == expectation.actor]
            egos = [actor.id for actor in scenario.actors if actor.ego]
            names.update(known or (egos if expectation.actor == EGO else ()))
    return tuple(actor.id for actor in scenario.actors if actor.id in names)


def criteria_problems(scenario: Scenario) -> tuple[Problem, ...]:
    """Find criteria that cannot be judged: other words than those of figures, unknown actors."""
    return tuple(_find_problems(scenario))


def _find_problems(scenario: Scenario) -> Iterator[Problem]:
    known = {actor.id for actor in scenario.actors}
    flows = tuple(f"{flow.id}." for flow in scenario.flows)
    egos = any(actor.ego for actor in scenario.actors)
    rules = {rule.id for rule in scenario.rules}
    for index, text in enumerate(scenario.criteria):
        where = f"criteria[{index}]"
        try:
            wanted = parse_expectation(text)
        except InputError as problem:
            yield error("criterion_unknown", where, problem.problem)
            continue
        if wanted.figure is None:
            msg = f"{text!r} is for suites and --expect; a criterion names a figure"
            yield error("criterion_unknown", where, msg)
        if text in scenario.criteria[:index]:
            yield warning("criterion_twice", where, f"{text!r} is there already")
        if isinstance(wanted.figure, RuleMeasure):
            if wanted.actor not in rules:
                msg = f"no rule has the id {wanted.actor!r}, about which the criterion is"
                yield error("criterion_without_actor", where, msg)
            continue
        missing = [
            actor
            for actor in ((wanted.actor or "").split(",") if wanted.actor is not None else ())
            if actor not in known and not actor.startswith(flows)
        ]
        if not missing:
            continue
        actor = missing[0]
        if actor != EGO:
            msg = f"no actor has the id {actor!r}; a criterion is about an actor, or {EGO}"
            yield error("criterion_without_actor", where, msg)
        elif not egos:
            msg = "the scenario has no ego; mark an actor as ego, or name one by its id"
            yield error("criterion_without_actor", where, msg)


def missed_rows(summary: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Rows of criteria that a run has not met."""
    return [row for row in summary.get("criteria") or () if not row["passed"]]


def missed_words(row: Mapping[str, Any]) -> str:
    """``"Collisions of ego: exactly 0, but it is 1 at 12.4 s"``."""
    at = "" if row["time"] is None else f" at {row['time']:g} s"
    unit = f" {row['unit']}" if row["unit"] else ""
    value = "not measured" if row["value"] is None else f"{row['value']:g}{unit}{at}"
    return f"{row['words']}, but it is {value}"


def criteria_rows(
    texts: Sequence[str], summary: Mapping[str, Any], records: RunRecords
) -> list[dict[str, Any]]:
    """Judge a run by criteria, as rows of ``summary.json``.

    Returns
    -------
    One row for each, with ``criterion``, ``words``, ``value`` in ``unit`` (``None`` if the run does
    not have it), ``passed``, and the instant ``time``, s (``None`` where there is none).
    """
    wanted = criteria_of(texts)
    rows = []
    for expectation, verdict in zip(wanted, evaluate(wanted, summary, records), strict=True):
        value = verdict.value
        rows.append(
            {
                "criterion": expectation.text,
                "words": expectation.words,
                "value": None if value is None else round(expectation.in_its_unit(value), 6),
                "unit": expectation.unit,
                "passed": verdict.passed,
                "time": verdict.time,
            }
        )
    return rows
