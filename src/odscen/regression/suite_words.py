"""Results of a suite in words and as data, for the terminal, JSON and the reports."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from odscen.regression.gates import CaseResult, SuiteResult
    from odscen.regression.verdict import Change

MOST = 12
"""Changes that are reported of one scenario; JSON has all."""


def reason(result: CaseResult) -> str | None:
    """Say why figures may differ from the baseline: what was changed, or that nothing was."""
    if result.verdict is None:
        return None
    if result.changed_inputs:
        return f"changed since the baseline: {', '.join(result.changed_inputs)}"
    if result.verdict.failing:
        return "map, scenario and versions are those of the baseline: the behaviour has changed"
    return None


def where(result: CaseResult) -> str | None:
    """Name the segments, the junction and the actor that have changed most, if something fails.

    Two segments: where one has changed, the next one often has as well.
    """
    verdict = result.verdict
    if verdict is None or not verdict.failing:
        return None
    changes = (*verdict.places, *verdict.actors)
    first: dict[str, dict[str, str]] = {}
    for change in changes:
        first.setdefault(change.key.kind, {}).setdefault(change.key.place, change.words)
    named = [
        words
        for kind, places in first.items()
        for words in list(places.values())[: 2 if kind == "segment" else 1]
    ]
    return f"most changed: {'; '.join(named)}" if named else None


def lines(result: CaseResult) -> list[str]:
    """All that is reported of a scenario, one line each; nothing of one that passed."""
    found = list(result.problems[:MOST])
    if len(result.problems) > MOST:
        found.append(f"and {len(result.problems) - MOST} more")
    return [*found, *(text for text in (where(result), reason(result)) if text)]


def to_dict(result: SuiteResult) -> dict[str, Any]:
    """Return the whole result as data."""
    return {
        "suite": result.suite.name,
        "file": str(result.suite.file),
        "passed": result.exit_code == 0,
        "exit_code": result.exit_code,
        "cases": [_case(case) for case in result.cases],
    }


def _case(case: CaseResult) -> dict[str, Any]:
    verdict = case.verdict
    most = None if verdict is None else verdict.where
    return {
        "name": case.case.name,
        "file": str(case.case.file),
        "map": case.map_name,
        "status": case.status,
        "seeds": [run.seed for run in case.runs],
        "wall_seconds": round(case.wall_seconds, 3),
        "problems": list(case.problems),
        "changed_inputs": list(case.changed_inputs),
        "changes": [_change(change) for change in verdict.failing] if verdict else [],
        "most_changed": None if most is None else _change(most),
        "baseline": None if case.case.baseline is None else str(case.case.baseline),
        "baseline_updated": case.updated,
    }


def _change(change: Change) -> dict[str, Any]:
    found = change.difference
    return {
        "kind": change.key.kind,
        "place": change.key.place or None,
        "figure": change.key.figure,
        "baseline": found.a,
        "value": found.b,
        "difference": found.difference,
        "allowed": None if found.a is None else change.tolerance.allowed(found.a),
    }
