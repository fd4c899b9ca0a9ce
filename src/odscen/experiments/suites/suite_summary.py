"""Summary of a suite as Markdown, as GitHub and GitLab show it."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from odscen.experiments.regression.case_results import CaseStatus
from odscen.experiments.suites.suite_words import headline, sizing_words

if TYPE_CHECKING:
    from odscen.experiments.regression.case_results import CaseResult, SuiteResult

MOST = 50
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
    name = _plain(result.suite.name)
    parts = [f"## {sign} {name}\n\n{counts or 'no scenarios'}\n"]
    if sized := [case.sizing for case in result.cases if case.sizing is not None]:
        parts.append(f"{_plain(sizing_words(sized))}\n")
    if result.touched:
        rows = [
            f"- {_plain(words)}: {len(names)} of {len(result.cases)} scenarios"
            for words, names in result.touched.items()
        ]
        parts.append("Changed since the baselines:\n\n" + "\n".join(rows) + "\n")
    told = [case for case in result.worst_first if case.status is not CaseStatus.PASSED]
    if told:
        head = "| Scenario | Verdict | Why |\n| --- | --- | --- |\n"
        parts.append(head + "\n".join(_row(case) for case in told[:MOST]) + "\n")
    if len(told) > MOST:
        parts.append(f"and {len(told) - MOST} more, see the page of the suite.\n")
    return "\n".join(parts)


def _row(case: CaseResult) -> str:
    cells = (case.name, f"{case.label}", headline(case))
    name, label, why = (_plain(cell) for cell in cells)
    return f"| {name} | {_SIGNS[case.status]} {label} | {why} |"


def _plain(text: str) -> str:
    """Text that Markdown takes as it stands, in one line."""
    return _SPECIAL.sub(r"\\\1", " ".join(text.split()))
