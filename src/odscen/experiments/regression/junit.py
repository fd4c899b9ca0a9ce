"""JUnit XML of a suite, as CI servers read it: a test case per scenario, and one per run of it.

The scenario's has the verdict; its runs' have what each run failed or missed by itself.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from lxml import etree

from odscen.experiments.regression.case_results import CaseStatus
from odscen.experiments.suites.suite_words import details, headline
from odscen.runs import layout

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from odscen.experiments.regression.case_results import CaseResult, SeedResult, SuiteResult

_UNWRITABLE = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def junit_xml(result: SuiteResult) -> str:
    """Text of the file.

    ``classname`` is the suite, ``name`` the scenario, or ``SCENARIO[seed-N]`` of a run, times in
    seconds. A scenario takes no time of its own, so that the times add up.
    """
    suite = etree.Element("testsuite", name=_text(result.suite.name))
    for case in result.cases:
        _scenario(suite, case, result.suite.name)
        for run in case.runs:
            _run(suite, case, run, result.suite.name)
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


def _scenario(suite: etree._Element, case: CaseResult, suite_name: str) -> None:
    properties = dict(_case_properties(case))
    element = _test_case(suite, case, suite_name, case.name, 0.0, properties)
    if case.status.passes:
        if told := [text for text in (headline(case), *details(case)) if text]:
            etree.SubElement(element, "system-out").text = _text("\n".join(told))
        return
    tag = "error" if case.status is CaseStatus.ERROR else "failure"
    _outcome(element, tag, case.status.value, [headline(case), *details(case)])


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


def _run(suite: etree._Element, case: CaseResult, run: SeedResult, suite_name: str) -> None:
    name = f"{case.name}[seed-{run.seed}]"
    properties = dict(_run_properties(run))
    element = _test_case(suite, case, suite_name, name, run.wall_seconds, properties)
    if run.error:
        _outcome(element, "error", "run failed", [run.error])
    elif run.missed:
        _outcome(element, "failure", "expectation", run.missed)


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
    safe = {key: _text(value) for key, value in attributes.items()}
    element = etree.SubElement(suite, "testcase", safe)
    listed = etree.SubElement(element, "properties")
    for key, value in properties.items():
        etree.SubElement(listed, "property", name=_text(key), value=_text(value))
    return element


def _outcome(element: etree._Element, tag: str, kind: str, words: Sequence[str]) -> None:
    told = [_text(text) for text in words]
    etree.SubElement(element, tag, {"message": told[0], "type": kind}).text = "\n".join(told)


def _text(text: str) -> str:
    return _UNWRITABLE.sub("?", text)
