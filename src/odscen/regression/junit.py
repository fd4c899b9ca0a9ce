"""JUnit XML of a suite: one test case per scenario, as CI servers read it."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from lxml import etree

from odscen.regression.gates import CaseStatus
from odscen.regression.suite_words import lines, reason

if TYPE_CHECKING:
    from odscen.regression.gates import CaseResult, SuiteResult

_UNWRITABLE = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def junit_xml(result: SuiteResult) -> str:
    """Text of the file; ``classname`` is the suite, ``name`` the scenario, times in seconds."""
    statuses = [case.status for case in result.cases]
    seconds = sum(case.wall_seconds for case in result.cases)
    counts = {
        "tests": str(len(statuses)),
        "failures": str(statuses.count(CaseStatus.FAILED)),
        "errors": str(statuses.count(CaseStatus.ERROR)),
        "time": f"{seconds:.3f}",
    }
    root = etree.Element("testsuites", counts)
    suite = etree.SubElement(
        root, "testsuite", {"name": result.suite.name, "skipped": "0", **counts}
    )
    for case in result.cases:
        _test_case(suite, case, result.suite.name)
    return etree.tostring(root, pretty_print=True, xml_declaration=True, encoding="UTF-8").decode()


def _test_case(suite: etree._Element, case: CaseResult, suite_name: str) -> None:
    attributes = {
        "classname": suite_name,
        "name": case.case.name,
        "file": str(case.case.file),
        "time": f"{case.wall_seconds:.3f}",
    }
    element = etree.SubElement(suite, "testcase", attributes)
    words = [_UNWRITABLE.sub("?", line) for line in lines(case)]
    if case.status is not CaseStatus.PASSED:
        tag = "error" if case.status is CaseStatus.ERROR else "failure"
        etree.SubElement(element, tag, {"message": words[0]}).text = "\n".join(words)
    elif note := reason(case):
        etree.SubElement(element, "system-out").text = note
