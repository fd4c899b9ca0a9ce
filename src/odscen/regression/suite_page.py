"""Suites as one HTML page each, in the dress of the run report."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.markup import Markup, element, join
from odscen.regression.gates import CaseStatus
from odscen.regression.suite_words import lines, reason, where
from odscen.results.report.page_templates import html_page, html_table, page_head, report_section

if TYPE_CHECKING:
    from odscen.regression.gates import CaseResult, SuiteResult
    from odscen.regression.verdict import Change


def suite_page(result: SuiteResult) -> str:
    """Page of a suite: the verdict, the scenarios, and what has changed where."""
    passed = sum(case.status is CaseStatus.PASSED for case in result.cases)
    total = len(result.cases)
    whole = passed == total
    verdict = "All as it should be" if whole else f"{total - passed} of {total} scenarios failed"
    runs = sum(len(case.runs) for case in result.cases)
    head = page_head(
        "Regression test",
        result.suite.name,
        element("p", f"{passed} of {total} scenarios passed, in {runs} runs."),
        verdict=verdict,
        style="good" if whole else "bad",
    )
    rows = [_case_row(case) for case in result.cases]
    heads = ("Scenario", "Map", "Verdict", "Seeds", "Computed in, s")
    explained = (
        "each scenario is run once per seed, the number that decides all chance. It passes if "
        "every run meets what is expected of it and the means are within tolerance of the baseline."
    )
    body = [
        head,
        report_section("Scenarios", html_table(heads, rows), explained=explained, ident="all"),
    ]
    body += [_case_section(case) for case in result.cases if lines(case)]
    return html_page(f"{result.suite.name} - regression test", join(body))


def _case_row(case: CaseResult) -> Markup:
    style = "good" if case.status is CaseStatus.PASSED else "bad"
    seeds = ", ".join(str(run.seed) for run in case.runs)
    return element(
        "tr",
        element("th", case.case.name, scope="row"),
        element("td", case.map_name),
        element("td", case.status.label, class_=style),
        element("td", seeds),
        element("td", f"{case.wall_seconds:.1f}", class_="n"),
    )


def _case_section(case: CaseResult) -> Markup:
    changes = () if case.verdict is None else (*case.verdict.figures, *case.verdict.places)
    in_table = {change.words for change in changes}
    besides = [problem for problem in case.problems if problem not in in_table]
    lines = [*besides, *(text for text in (where(case), reason(case)) if text)]
    rows = [_change_row(change) for change in changes]
    heads = ("Figure", "Baseline", "Now", "Difference", "Allowed", "Verdict")
    explained = (
        "means over all seeds. Segments and junctions are named as on the map of the editor; those "
        "with the largest changes for the number of vehicles that passed stand first."
    )
    return report_section(
        case.case.name,
        element("ul", *(element("li", line) for line in lines)),
        html_table(heads, rows, label=f"Figures of {case.case.name}") if rows else None,
        explained=explained,
        ident=f"case-{case.case.name}",
    )


def _change_row(change: Change) -> Markup:
    cells = [element("td", text, class_="n") for text in change.row[1:]]
    fails = element("td", "fails" if change.counts else "too few vehicles to fail",
                    class_="bad" if change.counts else "fair")  # fmt: skip
    return element("tr", element("th", change.key.label, scope="row"), *cells, fails)
