"""Suites as one HTML page each, in the dress of the run report."""

from __future__ import annotations

import os
from contextlib import suppress
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from odscen.app.maps import load_map
from odscen.base.errors import OdscenError
from odscen.base.markup import Markup, element, join
from odscen.experiments.place_map import place_map
from odscen.experiments.suite import CaseStatus
from odscen.experiments.suite_runs import map_before
from odscen.experiments.suite_words import details, headline, seed_words, sizing_words
from odscen.experiments.verdict import FEWEST, Effect
from odscen.reports.charts import legend
from odscen.reports.page_templates import html_page, html_table, page_head, report_section
from odscen.reports.report_maps import SPEED_STEPS_KMH, place_shapes
from odscen.runs.layout import REPORT_FILE

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from odscen.experiments.measure import FigureKey
    from odscen.experiments.place_map import PlaceStyles
    from odscen.experiments.suite import CaseResult, SuiteResult
    from odscen.experiments.verdict import Change
    from odscen.maps.store import Workspace


MOST_NUMBERED = 8
"""Places with a number."""

_TEXT = 0.045
"""Height of the numbers, a share of a map's extent; two maps share the width of the page."""

_DELAY_STEPS = (10.0, 20.0, 35.0, 55.0, 80.0)
"""Limits between the colours of stopped delay, seconds: those of levels of service at lights."""

_LEVELS = ("los-a", "los-b", "los-c", "los-d", "los-e", "los-f")


def ranked_places(case: CaseResult) -> dict[tuple[str, str], int]:
    """Numbers of the places that have changed most, from 1, by kind and name."""
    places = () if case.verdict is None else case.verdict.places
    names = dict.fromkeys((change.key.kind, change.key.place) for change in places)
    return {name: number for number, name in enumerate(list(names)[:MOST_NUMBERED], start=1)}


def change_maps(case: CaseResult, workspace: Workspace | None) -> Markup | None:
    """Draw the map with the figures before and now; ``None`` where no place has changed.

    The map of before is drawn if the workspace still has it, else that of now.

    Raises
    ------
    OdscenError
        If the map cannot be loaded.
    """
    entry, baseline = case.entry, case.baseline
    ranks = ranked_places(case)
    if entry is None or baseline is None or not ranks:
        return None
    before = {key: _mean_known(values) for key, values in baseline.figures.items()}
    keys = dict.fromkeys(key for run in case.runs for key in run.figures if key.place)
    now = {key: _mean_known([run.figures.get(key) for run in case.runs]) for key in keys}
    old = map_before(entry, baseline.fingerprint.get("map", ""), workspace)
    sides = []
    for title, side, figures in (("Baseline", old or entry, before), ("Now", entry, now)):
        shapes = place_shapes(load_map(side).sumo.graph)
        names = {name: str(rank) for (_, name), rank in ranks.items()}
        drawn = place_map(
            shapes, _place_styles(figures), title=f"{case.name}: {title}", names=names, text=_TEXT
        )
        heading = "Baseline, on the map of now" if title == "Baseline" and not old else title
        if drawn is not None:
            sides.append(element("figure", element("figcaption", heading), drawn))
    return element("div", element("div", *sides, class_="side-by-side"), _map_legend())


def _mean_known(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if known else None


def _place_styles(figures: Mapping[FigureKey, float | None]) -> PlaceStyles:
    """Segments by mean speed and junctions by stopped delay, where enough vehicles passed."""
    styles: PlaceStyles = {}
    for key, value in figures.items():
        passed = figures.get(key._replace(figure="vehicles")) or 0.0
        if value is None or passed < FEWEST:
            continue
        words = f"{key.entry.label} {key.entry.written(value)}, {passed:g} vehicles"
        if (key.kind, key.figure) == ("segment", "mean_speed"):
            step = int(np.searchsorted(SPEED_STEPS_KMH, value * 3.6, side="right"))
            styles["segment", key.place] = (f"v{step}", words)
        elif (key.kind, key.figure) == ("junction", "waiting_time"):
            step = int(np.searchsorted(_DELAY_STEPS, value, side="right"))
            styles["junction", key.place] = (_LEVELS[step], words)
    return styles


def _map_legend() -> Markup:
    speeds = [
        (f"v{step}", words) for step, words in enumerate(_class_words(SPEED_STEPS_KMH, "km/h"))
    ]
    delays = list(zip(_LEVELS, _class_words(_DELAY_STEPS, "s"), strict=True))
    idle = ("los-none", f"fewer than {FEWEST} vehicles")
    return element(
        "div",
        element("p", "Roads, mean speed:"),
        legend([*speeds, idle]),
        element("p", "Junctions, stopped delay per vehicle:"),
        legend(delays),
    )


def _class_words(limits: Sequence[float], unit: str) -> list[str]:
    """Words of the classes between limits."""
    ends = [f"{limit:g}" for limit in limits]
    between = [f"{low} to {high} {unit}" for low, high in pairwise(ends)]
    return [f"under {ends[0]} {unit}", *between, f"over {ends[-1]} {unit}"]


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
    with_headline = [case for case in result.worst_first if headline(case)]
    parts = [_render_head(result), _render_overview(result, idents), _render_touched(result)]
    for number, case in enumerate(with_headline):
        drawn = None
        if number < MOST_MAPS:
            with suppress(OdscenError):  # the map has gone meanwhile: the words are there
                drawn = change_maps(case, workspace)
        parts.append(_case_section(case, drawn, ident=idents[case.name], beside=beside))
    return html_page(
        f"{result.suite.name} - regression test", join([part for part in parts if part])
    )


def _render_head(result: SuiteResult) -> Markup:
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


def _render_overview(result: SuiteResult, idents: Mapping[str, str]) -> Markup:
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


def _render_touched(result: SuiteResult) -> Markup | None:
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
        _link_reports(case, beside),
        explained=explained,
        ident=ident,
    )


def _change_row(change: Change, ranks: Mapping[tuple[str, str], int]) -> Markup:
    cells = [element("td", text, class_="n") for text in change.row[1:]]
    rank = ranks.get((change.key.kind, change.key.place))
    name = f"{rank}. {change.label}" if rank else change.label
    effect = element("td", change.effect.value, class_=_EFFECTS.get(change.effect, "fair"))
    return element("tr", element("th", name, scope="row"), *cells, effect)


def _link_reports(case: CaseResult, beside: Path | None) -> Markup | None:
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
