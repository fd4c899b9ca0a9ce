"""Results of a suite in words and as data: for the terminal, JSON, JUnit XML and Markdown."""

from __future__ import annotations

import re
from itertools import groupby
from typing import TYPE_CHECKING, Any

from lxml import etree

from odscen.experiments.suite import CaseStatus
from odscen.runs import layout

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from odscen.experiments.suite import CaseResult, SeedResult, SuiteResult
    from odscen.experiments.tolerance import Sizing
    from odscen.experiments.verdict import Change


MOST_PROBLEMS = 6
"""Problems that the terminal has of one scenario; JUnit, JSON and the page have all."""

_IN_HEADLINE = 2
"""Figures of the run in the headline; a place comes after them."""


NOWHERE = "nothing has changed at any segment, junction or actor"
"""Said where inputs or figures of the run fail, and figures of all places are as they were."""


def headline(case: CaseResult) -> str:
    """Say in one line what is wrong: the likeliest cause, its worst figures, and the worst place.

    Of a scenario that passes: what has changed; empty if nothing has.
    """
    if case.status in (CaseStatus.ERROR, CaseStatus.MISSING, CaseStatus.NEW):
        first = case.problems[0].splitlines()
        problem = first[0] if len(first) == 1 else f"{first[0]} {first[1].strip(' -')}"
        return f"{case.causes[0].words}: {problem}" if case.errors and case.causes else problem
    if case.status is CaseStatus.FAILED and case.unusable:
        return f"usable: {case.unusable[0]}"
    if case.status is CaseStatus.FAILED:
        return f"{_describe_cause(case)}{'; '.join(_describe_worst(case))}"
    return "; ".join(
        [
            *_describe_better(case)[:_IN_HEADLINE],
            *filter(None, [_describe_changed_inputs(case), case.place]),
        ]
    )


def _describe_cause(case: CaseResult) -> str:
    """``"map: "``; the figures' own behaviour if no input has changed, nothing without baseline."""
    if case.verdict is None:
        return ""
    if not case.causes:
        return "behaviour: "
    likeliest = case.causes[0]
    if likeliest.name == "map":  # what has changed on it is known by itself
        return f"{likeliest.words}: "
    # Of other inputs the name says most.
    return (
        f"{likeliest.name}: {likeliest.details}: " if likeliest.details else f"{likeliest.name}: "
    )


def _describe_worst(case: CaseResult) -> list[str]:
    """The first missed expectation, the worst figures, the worst place."""
    verdict = case.verdict
    if verdict is None:
        return list(case.failures[:_IN_HEADLINE])
    changes = {change.words for change in verdict.failing}
    found = [words for words in case.failures if words not in changes][:1]
    failing = [change for change in verdict.figures if change.counts]  # the strongest first
    found += [change.words for change in failing[:_IN_HEADLINE]]
    if case.place:
        return [*found, case.place]
    return [*found, NOWHERE] if case.causes else found


def _describe_better(case: CaseResult) -> list[str]:
    better = () if case.verdict is None else case.verdict.better
    return [f"better: {change.words}" for change in better]


def _describe_changed_inputs(case: CaseResult) -> str | None:
    changed = ", ".join(
        f"{cause.words} ({cause.details})" if cause.details else cause.words
        for cause in case.causes
    )
    return f"changed since the baseline: {changed}" if changed else None


def reason(case: CaseResult) -> str | None:
    """Say why figures may differ from the baseline: what was changed, or that nothing was."""
    if case.verdict is None:
        return None
    if case.verdict.failing and not case.causes:
        return "map, scenario and versions are those of the baseline: the behaviour has changed"
    return _describe_changed_inputs(case)


def where(case: CaseResult) -> str | None:
    """Name the segments, the junction and the actor that have changed most, if something fails.

    Two segments: where one has changed, the next one often has as well.
    """
    verdict = case.verdict
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


def details(case: CaseResult) -> list[str]:
    """All there is to say of a scenario below its headline, one line each."""
    top = headline(case)
    found = [*case.problems, *_describe_better(case)]
    found += [text for text in (where(case), reason(case)) if text]
    found += [f"warning: {words}" for words in case.warnings]
    parts = (top, _describe_changed_inputs(case) if case.status.passes else top)
    return list(dict.fromkeys(text for text in (*found, *case.notes) if text not in parts))


def lines(case: CaseResult) -> list[str]:
    """What the terminal has of a scenario, one line each; nothing of one that is as it was."""
    top = headline(case)
    below = details(case)
    rest = [words for words in below if words not in (*case.problems, *_describe_better(case))]
    shown = [words for words in below if words not in rest]
    if len(shown) > MOST_PROBLEMS:
        shown = [*shown[:MOST_PROBLEMS], f"and {len(shown) - MOST_PROBLEMS} more"]
    return [text for text in (top, *shown, *rest) if text]


def seed_words(seeds: Sequence[int]) -> str:
    """``"1-42"`` or ``"1, 2, 7-9"``."""
    parts: list[str] = []
    rows = enumerate(sorted(seeds))
    for _, group in groupby(rows, key=lambda row: row[1] - row[0]):
        run = [seed for _, seed in group]
        parts += [f"{run[0]}-{run[-1]}"] if len(run) > 2 else map(str, run)
    return ", ".join(parts)


def sizing_words(sizings: Sequence[Sizing]) -> str:
    """What the chosen seeds of scenarios catch, in one sentence."""
    counts = [sizing.seeds for sizing in sizings]
    few = f"{min(counts)} to {max(counts)}" if min(counts) < max(counts) else f"{counts[0]}"
    enough = sum(sizing.enough for sizing in sizings)
    return (
        f"{few} seeds a scenario were chosen to catch what the suite wants to be caught; in "
        f"{enough} of {len(sizings)} scenarios they do"
    )


def to_dict(result: SuiteResult) -> dict[str, Any]:
    """Return the whole result as data."""
    return {
        "suite": result.suite.name,
        "file": str(result.suite.file),
        "passed": result.exit_code == 0,
        "exit_code": result.exit_code,
        "verdicts": {status.value: number for status, number in result.counts.items()},
        "changed_inputs": {words: list(names) for words, names in result.touched.items()},
        "cases": [_case_data(case) for case in result.cases],
    }


def _case_data(case: CaseResult) -> dict[str, Any]:
    verdict = case.verdict
    most = None if verdict is None else verdict.where
    return {
        "name": case.name,
        "file": str(case.case.file),
        "map": case.map_name,
        "status": case.status,
        "headline": headline(case),
        "cause": _cause_name(case),
        "seeds": [run.seed for run in case.runs],
        "detect": None if case.sizing is None else case.sizing.model_dump(mode="json"),
        "wall_seconds": round(case.wall_seconds, 3),
        "problems": list(case.problems),
        "notes": list(case.notes),
        "warnings": list(case.warnings),
        "changed_inputs": list(case.changed_inputs),
        "changed_fields": [
            *(change.to_dict() for change in case.map_changes),
            *(change.to_dict() for change in case.scenario_changes),
        ],
        "changes": [_change_data(change) for change in verdict.failing] if verdict else [],
        "better": [_change_data(change) for change in verdict.better] if verdict else [],
        "most_changed": None if most is None else _change_data(most),
        "baseline": None if case.case.baseline is None else str(case.case.baseline),
        "baseline_updated": case.updated,
    }


def _cause_name(case: CaseResult) -> str | None:
    if case.unusable:
        return "usable"
    return case.causes[0].name if case.causes else None


def _change_data(change: Change) -> dict[str, Any]:
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


MOST_SUMMARY_ROWS = 50
"""Rows of the table; GitHub refuses summaries over 1 MiB, and nobody reads more."""

_SIGNS = {
    CaseStatus.ERROR: ":boom:",
    CaseStatus.FAILED: ":x:",
    CaseStatus.MISSING: ":grey_question:",
    CaseStatus.NEW: ":new:",
    CaseStatus.CHANGED: ":warning:",
    CaseStatus.PASSED: ":white_check_mark:",
}
_SPECIAL = re.compile(r"([\\`*_\[\]<>|#~$])")


def suite_summary(result: SuiteResult) -> str:
    """Verdicts, what has changed and whom it touches, and each scenario that is not as it was."""
    counts = ", ".join(f"{number} {status}" for status, number in result.counts.items())
    sign = _SIGNS[CaseStatus.PASSED if result.exit_code == 0 else CaseStatus.FAILED]
    name = _escape_markdown(result.suite.name)
    parts = [f"## {sign} {name}\n\n{counts or 'no scenarios'}\n"]
    if sized := [case.sizing for case in result.cases if case.sizing is not None]:
        parts.append(f"{_escape_markdown(sizing_words(sized))}\n")
    if result.touched:
        rows = [
            f"- {_escape_markdown(words)}: {len(names)} of {len(result.cases)} scenarios"
            for words, names in result.touched.items()
        ]
        parts.append("Changed since the baselines:\n\n" + "\n".join(rows) + "\n")
    not_passed = [case for case in result.worst_first if case.status is not CaseStatus.PASSED]
    if not_passed:
        head = "| Scenario | Verdict | Why |\n| --- | --- | --- |\n"
        parts.append(
            head + "\n".join(_summary_row(case) for case in not_passed[:MOST_SUMMARY_ROWS]) + "\n"
        )
    if len(not_passed) > MOST_SUMMARY_ROWS:
        parts.append(
            f"and {len(not_passed) - MOST_SUMMARY_ROWS} more, see the page of the suite.\n"
        )
    return "\n".join(parts)


def _summary_row(case: CaseResult) -> str:
    cells = (case.name, f"{case.label}", headline(case))
    name, label, why = (_escape_markdown(cell) for cell in cells)
    return f"| {name} | {_SIGNS[case.status]} {label} | {why} |"


def _escape_markdown(text: str) -> str:
    """Text that Markdown takes as it stands, in one line."""
    return _SPECIAL.sub(r"\\\1", " ".join(text.split()))


_UNWRITABLE = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def junit_xml(result: SuiteResult) -> str:
    """Text of the file.

    ``classname`` is the suite, ``name`` the scenario, or ``SCENARIO[seed-N]`` of a run, times in
    seconds. A scenario takes no time of its own, so that the times add up.
    """
    suite = etree.Element("testsuite", name=_writable_text(result.suite.name))
    for case in result.cases:
        _add_scenario_case(suite, case, result.suite.name)
        for run in case.runs:
            _add_run_case(suite, case, run, result.suite.name)
    seconds = sum(case.wall_seconds for case in result.cases)
    counts = {
        "tests": str(len(suite)),
        "failures": str(len(suite.findall("testcase/failure"))),
        "errors": str(len(suite.findall("testcase/error"))),
        "skipped": "0",
        "time": f"{seconds:.3f}",
    }
    root = etree.Element("testsuites", counts)
    for name, value in counts.items():
        suite.set(name, value)
    root.append(suite)
    return etree.tostring(root, pretty_print=True, xml_declaration=True, encoding="UTF-8").decode()


def _add_scenario_case(suite: etree._Element, case: CaseResult, suite_name: str) -> None:
    properties = dict(_case_properties(case))
    element = _test_case(suite, case, suite_name, case.name, 0.0, properties)
    if case.status.passes:
        if texts := [text for text in (headline(case), *details(case)) if text]:
            etree.SubElement(element, "system-out").text = _writable_text("\n".join(texts))
        return
    tag = "error" if case.status is CaseStatus.ERROR else "failure"
    _add_outcome(element, tag, case.status.value, [headline(case), *details(case)])


def _case_properties(case: CaseResult) -> Iterator[tuple[str, str]]:
    yield "verdict", case.status.value
    if case.causes:
        yield "cause", case.causes[0].name
    if case.map_name:
        yield "map", case.map_name
    if case.case.baseline is not None:
        yield "baseline", str(case.case.baseline)
    if case.runs:
        yield "seeds", str(len(case.runs))
    if case.sizing is not None:
        yield "detect", case.sizing.words
    before = {} if case.baseline is None else case.baseline.fingerprint
    for name, digest in case.made_of.items():
        yield f"fingerprint.{name}", digest
        if before.get(name, digest) != digest:
            yield f"baseline.fingerprint.{name}", before[name]


def _add_run_case(
    suite: etree._Element, case: CaseResult, run: SeedResult, suite_name: str
) -> None:
    name = f"{case.name}[seed-{run.seed}]"
    properties = dict(_run_properties(run))
    element = _test_case(suite, case, suite_name, name, run.wall_seconds, properties)
    if run.error:
        _add_outcome(element, "error", "run failed", [run.error])
    elif run.missed:
        _add_outcome(element, "failure", "expectation", run.missed)


def _run_properties(run: SeedResult) -> Iterator[tuple[str, str]]:
    yield "seed", str(run.seed)
    for key, value in run.figures.items():
        if key.kind == "run" and value is not None:
            yield f"figure.{key.figure}", f"{value:g}"
    if run.folder is None:
        return
    for name, file in (
        ("run", ""),
        ("summary", layout.SUMMARY_FILE),
        ("report", layout.REPORT_FILE),
    ):
        if (path := run.folder / file).exists():
            yield f"artefact.{name}", str(path)


def _test_case(
    suite: etree._Element,
    case: CaseResult,
    suite_name: str,
    name: str,
    seconds: float,
    properties: Mapping[str, str],
) -> etree._Element:
    attributes = {
        "classname": suite_name,
        "name": name,
        "file": str(case.case.file),
        "time": f"{seconds:.3f}",
    }
    safe = {key: _writable_text(value) for key, value in attributes.items()}
    element = etree.SubElement(suite, "testcase", safe)
    listed = etree.SubElement(element, "properties")
    for key, value in properties.items():
        etree.SubElement(listed, "property", name=_writable_text(key), value=_writable_text(value))
    return element


def _add_outcome(element: etree._Element, tag: str, kind: str, words: Sequence[str]) -> None:
    texts = [_writable_text(text) for text in words]
    # An attribute holds no line breaks.
    first = texts[0].splitlines()[0] if texts[0] else ""
    etree.SubElement(element, tag, {"message": first, "type": kind}).text = "\n".join(texts)


def _writable_text(text: str) -> str:
    return _UNWRITABLE.sub("?", text)
