"""Suites as one HTML page each, in the dress of the run report."""

from __future__ import annotations

import os
from contextlib import suppress
from typing import TYPE_CHECKING

from odscen.base.errors import OdscenError
from odscen.base.markup import Markup, element, join
from odscen.experiments.regression.case_results import CaseStatus
from odscen.experiments.regression.verdict import Effect
from odscen.experiments.suites.suite_map import change_maps, ranked_places
from odscen.experiments.suites.suite_words import (
    details,
    headline,
    seed_words,
    sizing_words,
)
from odscen.reports.page_templates import html_page, html_table, page_head, report_section
from odscen.runs.layout import REPORT_FILE

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from odscen.experiments.regression.case_results import CaseResult, SuiteResult
    from odscen.experiments.regression.verdict import Change
    from odscen.maps.store import Workspace

MOST_MAPS = 20
"""Scenarios with maps, the worst; each takes as much of the page as all the rest."""

MOST_ROWS = 40
"""Rows of a scenario's table; JSON has all."""

_JUDGED = (
    "means over all seeds. Segments and junctions are named as on the map of the editor; those "
    "with the largest changes for the number of vehicles that passed stand first, and their "
    "numbers are those on the maps."
)
_NOT_JUDGED = "there is no baseline to hold it against, or it could not be run."

_STYLES = {
    CaseStatus.PASSED: "good",
    CaseStatus.CHANGED: "fair",
    CaseStatus.NEW: "fair",
    CaseStatus.MISSING: "bad",
    CaseStatus.FAILED: "bad",
    CaseStatus.ERROR: "bad",
}
_EFFECTS = {Effect.FAILS: "bad", Effect.BETTER: "good"}


def suite_page(
    result: SuiteResult, *, workspace: Workspace | None = None, beside: Path | None = None
) -> str:
    """Page of a suite: the verdict, the scenarios, and what has changed where, worst first.

    Parameters
    ----------
    workspace
        May have the maps of the baselines, which are drawn beside those of now.
    beside
        Folder of the page, for links to reports of runs that are kept.
    """
    idents = {case.name: f"case-{number}" for number, case in enumerate(result.cases, start=1)}
    told = [case for case in result.worst_first if headline(case)]
    parts = [_head(result), _overview(result, idents), _touched(result)]
    for number, case in enumerate(told):
        drawn = None
        if number < MOST_MAPS:
            with suppress(OdscenError):  # the map has gone meanwhile: the words are there
                drawn = change_maps(case, workspace)
        parts.append(_case_section(case, drawn, ident=idents[case.name], beside=beside))
    return html_page(
        f"{result.suite.name} - regression test", join([part for part in parts if part])
    )


def _head(result: SuiteResult) -> Markup:
    total, runs = len(result.cases), sum(len(case.runs) for case in result.cases)
    bad = sum(not case.status.passes for case in result.cases)
    verdict = f"{bad} of {total} scenarios do not pass" if bad else "All scenarios pass"
    counts = ", ".join(f"{number} {status}" for status, number in result.counts.items())
    sized = [case.sizing for case in result.cases if case.sizing is not None]
    return page_head(
        "Regression test",
        result.suite.name,
        element("p", f"{counts or 'no scenarios'}; {runs} runs."),
        element("p", f"{sizing_words(sized)}.") if sized else None,
        verdict=verdict,
        style="bad" if bad else "good",
    )


def _overview(result: SuiteResult, idents: Mapping[str, str]) -> Markup:
    rows = [_case_row(case, idents[case.name]) for case in result.worst_first]
    heads = ("Scenario", "Verdict", "Why", "Map", "Seeds", "Computed in, s")
    explained = (
        "each scenario is run once per seed, the number that decides all chance. It passes if "
        "every run meets what is expected of it and no mean is worse than the baseline by more "
        "than its tolerance; changed means that it passes and its inputs are other ones than the "
        "baseline's, or figures are better. The worst stand first."
    )
    table = html_table(heads, rows)
    return report_section("Scenarios", table, explained=explained, ident="all")


def _case_row(case: CaseResult, ident: str) -> Markup:
    why = headline(case)
    name = element("a", case.name, href=f"#{ident}") if why else case.name
    return element(
        "tr",
        element("th", name, scope="row"),
        element("td", case.label, class_=_STYLES[case.status]),
        element("td", why, class_="wrap"),
        element("td", case.map_name),
        element("td", seed_words([run.seed for run in case.runs]), class_="wrap"),
        element("td", f"{case.wall_seconds:.1f}", class_="n"),
    )


def _touched(result: SuiteResult) -> Markup | None:
    """Which changed input touches which scenarios."""
    if not result.touched:
        return None
    rows = [
        element(
            "tr",
            element("th", words, scope="row"),
            element("td", str(len(names)), class_="n"),
            element("td", ", ".join(names), class_="wrap"),
        )
        for words, names in result.touched.items()
    ]
    explained = (
        "inputs whose digest is another than in the baseline, and the scenarios they are in."
    )
    table = html_table(("Changed", "Scenarios", "Names"), rows)
    return report_section(
        "Changed since the baselines", table, explained=explained, ident="touched"
    )


def _case_section(
    case: CaseResult, drawn: Markup | None, *, ident: str, beside: Path | None
) -> Markup:
    verdict = case.verdict
    changes = () if verdict is None else (*verdict.figures, *verdict.places)
    in_table = {change.words for change in changes}
    in_table |= {f"better: {words}" for words in in_table}
    besides = [words for words in details(case) if words not in in_table]
    if case.sizing is not None and case.sizing.words not in besides:
        besides.append(case.sizing.words)
    if len(changes) > MOST_ROWS:
        besides.append(f"{len(changes) - MOST_ROWS} more changes are in the JSON of the suite")
    ranks = ranked_places(case)
    rows = [_change_row(change, ranks) for change in changes[:MOST_ROWS]]
    heads = ("Figure", "Baseline", "Now", "Difference", "Allowed", "Verdict")
    explained = _NOT_JUDGED if verdict is None else _JUDGED
    return report_section(
        f"{case.name}: {case.label}",
        element("p", headline(case)),
        element("ul", *(element("li", words) for words in besides)) if besides else None,
        drawn,
        html_table(heads, rows, label=f"Figures of {case.name}") if rows else None,
        _reports(case, beside),
        explained=explained,
        ident=ident,
    )


def _change_row(change: Change, ranks: Mapping[tuple[str, str], int]) -> Markup:
    cells = [element("td", text, class_="n") for text in change.row[1:]]
    rank = ranks.get((change.key.kind, change.key.place))
    name = f"{rank}. {change.label}" if rank else change.label
    effect = element("td", change.effect.value, class_=_EFFECTS.get(change.effect, "fair"))
    return element("tr", element("th", name, scope="row"), *cells, effect)


def _reports(case: CaseResult, beside: Path | None) -> Markup | None:
    """Links to the reports of the runs, where they are kept."""
    links = []
    for run in case.runs:
        report = None if run.folder is None else run.folder / REPORT_FILE
        if report is not None and beside is not None and report.is_file():
            target = os.path.relpath(report.resolve(), beside.resolve()).replace(os.sep, "/")
            links.append(element("a", f"seed {run.seed}", href=target))
    if not links:
        return None
    return element("p", "Reports of the runs: ", *(part for link in links for part in (link, " ")))
