"""A study as a page: means with confidence intervals, differences of variants, and failures.

Of the ``n`` values of a figure with mean ``m`` and standard deviation ``s`` the interval is
``m +- t(0.975, n - 1) s / sqrt(n)``, as of :mod:`odscen.app.running.confident_runs`. Differences
of a variant are taken between runs of the same scenario, case and seed, so that what they share
does not count.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from odscen.app.running.confident_runs import confidence_of
from odscen.base.errors import InputError
from odscen.base.markup import Markup, element, join
from odscen.base.text_files import write_text
from odscen.experiments.studies import study_results
from odscen.experiments.table import study_figures
from odscen.records.outcomes import RunStatus
from odscen.reports.page_templates import html_page, html_table, page_head, report_section

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path

    import polars as pl

    from odscen.app.running.confident_runs import Confidence
    from odscen.experiments.studies import StudyState

SHOWN_FIGURES: Final = ("mean_delay", "mean_speed", "arrived", "collided")
MOST_ROWS: Final = 500
"""Of a table on the page; the Parquet file has all."""
_SHARE: Final = 0.05
_KEYS: Final = ["scenario", "case", "seed"]
_SHARED: Final = ["variant", "seed"]
"""What runs of two scenarios share that are compared."""


@dataclass(frozen=True, slots=True)
class StudyGroup:
    """Runs of one scenario and variant that have completed, or their differences.

    Attributes
    ----------
    figures
        Confidence intervals by figure.
    values
        By figure, of the runs that have it, in the order of the study.
    """

    scenario: str
    variant: str
    runs: int
    figures: Mapping[str, Confidence]
    values: Mapping[str, Sequence[float]]

    def words(self, name: str) -> str:
        """``12.40 +- 0.31``, or a dash."""
        figure = self.figures[name]
        if figure.mean is None:
            return "-"
        return f"{figure.mean:.2f} +- {figure.half_width:.2f}"

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready."""
        return {
            "scenario": self.scenario,
            "variant": self.variant,
            "runs": self.runs,
            "figures": {
                name: {"mean": figure.mean, "half_width": figure.half_width, "runs": figure.seeds}
                for name, figure in self.figures.items()
            },
        }


def study_groups(out: Path, figures: Sequence[str]) -> tuple[list[StudyGroup], list[StudyGroup]]:
    """Means of figures by scenario and variant, in the order of the study; then differences.

    Raises
    ------
    InputError
        If there is no study, or no such figure.
    """
    _refuse_unknown(figures)
    own = _completed_rows(study_results(out).table)
    return _group_figures(own, figures), paired_differences(own, figures)


def figures_had(out: Path) -> list[str]:
    """Figures that any run of a study has, in their usual order; those of all studies without any.

    Raises
    ------
    InputError
        If there is no study.
    """
    table = _completed_rows(study_results(out).table)
    had = [name for name in study_figures() if table[name].null_count() < table.height]
    return had or list(SHOWN_FIGURES)


def _refuse_unknown(figures: Iterable[str]) -> None:
    for name in figures:
        if name not in study_figures():
            raise InputError(f"no figure of runs is called {name!r}")


def _completed_rows(table: pl.DataFrame) -> pl.DataFrame:
    import polars as pl

    return table.filter(pl.col("status") == str(RunStatus.COMPLETED))


def _group_figures(
    table: pl.DataFrame, figures: Sequence[str], *, differences: bool = False
) -> list[StudyGroup]:
    return [
        StudyGroup(
            str(scenario),
            str(variant),
            part.height,
            {
                name: confidence_of(
                    part[name].to_list(), share=_SHARE, figure=name, lopsided=not differences
                )
                for name in figures
            },
            {name: part[name].drop_nulls().to_list() for name in figures},
        )
        for (scenario, variant), part in table.group_by("scenario", "variant", maintain_order=True)
    ]


def paired_differences(table: pl.DataFrame, figures: Sequence[str]) -> list[StudyGroup]:
    """By how much variants differ from the first one, run by run of the same case and seed.

    Parameters
    ----------
    table
        Runs that have completed.
    """
    import polars as pl

    variants = table["variant"].unique(maintain_order=True).to_list()
    if len(variants) < 2:
        return []
    first = table.filter(pl.col("variant") == variants[0])
    others = table.filter(pl.col("variant") != variants[0])
    return _group_figures(_format_paired(others, first, _KEYS, figures), figures, differences=True)


def _format_paired(
    table: pl.DataFrame, first: pl.DataFrame, keys: Sequence[str], figures: Sequence[str]
) -> pl.DataFrame:
    """Return ``table`` with its differences from the rows of ``first`` that have the same keys."""
    import polars as pl

    both = table.join(
        first.select(*keys, *figures),
        on=list(keys),
        suffix=" before",
        nulls_equal=True,
        maintain_order="left",
    )
    return both.with_columns(pl.col(name) - pl.col(f"{name} before") for name in figures)


def scenario_differences(out: Path, figures: Sequence[str]) -> list[StudyGroup]:
    """By how much scenarios differ from the first one, run by run of the same variant and seed.

    None where a scenario has several cases, of which no two belong together.

    Raises
    ------
    InputError
        If there is no study, or no such figure.
    """
    _refuse_unknown(figures)
    return _pair_scenarios(_completed_rows(study_results(out).table), figures)


def _pair_scenarios(own: pl.DataFrame, figures: Sequence[str]) -> list[StudyGroup]:
    import polars as pl

    scenarios = own["scenario"].unique(maintain_order=True).to_list()
    if len(scenarios) < 2 or own.select("scenario", *_SHARED).is_duplicated().any():
        return []
    first = own.filter(pl.col("scenario") == scenarios[0])
    others = own.filter(pl.col("scenario") != scenarios[0])
    return _group_figures(
        _format_paired(others, first, _SHARED, figures), figures, differences=True
    )


def difference_sentences(out: Path, figures: Sequence[str]) -> list[str]:
    """What each scenario but the first did, and each variant but the first: a sentence each.

    Raises
    ------
    InputError
        If there is no study, or no such figure.
    """
    _refuse_unknown(figures)
    return _say_differences(_completed_rows(study_results(out).table), figures)


def _say_differences(own: pl.DataFrame, figures: Sequence[str]) -> list[str]:
    scenarios, variants = (
        own[name].unique(maintain_order=True).to_list() for name in ("scenario", "variant")
    )
    sentences = []
    for group in _pair_scenarios(own, figures):
        where = f" ({group.variant})" if len(variants) > 1 else ""
        sentences.append(
            f"{group.scenario}{where}, compared with {scenarios[0]}: {_say_group(group, figures)}."
        )
    for group in paired_differences(own, figures):
        where = f"{group.scenario}, " if len(scenarios) > 1 else ""
        sentences.append(
            f"{where}{group.variant}, compared with {variants[0]}: {_say_group(group, figures)}."
        )
    return sentences


def _say_group(group: StudyGroup, figures: Sequence[str]) -> str:
    """The first figure that differs or might, and all others that clearly do."""
    first, *others = figures
    clear = [name for name in others if _is_clear_difference(group.figures[name])]
    return "; ".join(_say_figure(group.figures[name]) for name in (first, *clear))


def _is_clear_difference(found: Confidence) -> bool:
    if found.mean is None or found.half_width is None:
        return False
    return abs(found.mean) > found.half_width


def _say_figure(found: Confidence) -> str:
    """``mean delay falls by 12.0 s (8.1 to 15.9; 10 pairs of runs), better``."""
    figure = study_figures()[found.figure]
    if found.mean is None or found.half_width is None:
        return f"{figure.label} takes two pairs of runs to compare"
    low, high = found.mean - found.half_width, found.mean + found.half_width
    unit, pairs = f" {figure.unit}" if figure.unit else "", f"{found.seeds:,} pairs of runs"
    digits = min(6, max(0, 1 - math.floor(math.log10(found.half_width or abs(found.mean) or 1.0))))
    if not _is_clear_difference(found):
        return (
            f"no clear difference of {figure.label} "
            f"({low:.{digits}f} to {high:.{digits}f}{unit}; {pairs})"
        )
    rises = found.mean > 0.0
    least, most = (low, high) if rises else (-high, -low)
    better = figure.improves(found.mean)
    return (
        f"{figure.label} {'rises' if rises else 'falls'} by {abs(found.mean):.{digits}f}{unit} "
        f"({least:.{digits}f} to {most:.{digits}f}; {pairs})"
        f"{'' if better is None else ', better' if better else ', worse'}"
    )


def write_study_page(out: Path, figures: Sequence[str], file: Path) -> Path:
    """Write the page of a study, of all runs that have ended by now.

    Raises
    ------
    InputError
        If there is no study, or no such figure.
    WorkspaceError
        If it cannot be written.
    """
    _refuse_unknown(figures)
    results = study_results(out)
    return write_text(file, study_page(results.state, results.table, figures))


def study_page(state: StudyState, table: pl.DataFrame, figures: Sequence[str]) -> str:
    """Page of a study; equal tables give equal text."""
    own = _completed_rows(table)
    parts = [
        _render_head(state),
        _render_sentences(_say_differences(own, figures)),
        _render_section("Means", "means", _group_figures(own, figures), figures, _MEANS),
        _render_section(
            "Differences", "differences", paired_differences(own, figures), figures, _PAIRS
        ),
        _render_problems(state),
    ]
    return html_page(f"{state.name} - study", join([part for part in parts if part]))


_MEANS: Final = (
    "means over all runs of a scenario and variant that completed, with their 95 % confidence "
    "intervals; a dash where fewer than two runs have the figure."
)
_PAIRS: Final = (
    "by how much a variant differs from the scenario as designed (or the first variant), as mean "
    "and 95 % confidence interval of the differences of runs with the same case and seed: an "
    "interval without 0 says that it matters."
)
_SENTENCES: Final = (
    "the first figure, and others that differ clearly: the mean of the differences of runs with "
    "the same seed, with its 95 % confidence interval."
)
_FAILURES: Final = "why runs failed, or were not possible, most frequent first."


def _render_head(state: StudyState) -> Markup:
    bad = state.ended - state.counts["completed"]
    left = state.runs - state.ended
    verdict = f"{bad:,} of {state.runs:,} runs failed" if bad else "All runs completed"
    if left:
        verdict = f"{left:,} of {state.runs:,} runs have not ended"
    counts = ", ".join(f"{count:,} {status}" for status, count in state.counts.items() if count)
    return page_head(
        "Study",
        state.name,
        element("p", f"{state.runs:,} runs: {counts or 'none has ended'}."),
        verdict=verdict,
        style="bad" if bad else "fair" if left else "good",
    )


def _render_sentences(sentences: Sequence[str]) -> Markup | None:
    if not sentences:
        return None
    more = len(sentences) - MOST_ROWS
    return report_section(
        "What each one did",
        element("ul", *(element("li", sentence) for sentence in sentences[:MOST_ROWS])),
        element("p", f"and {more:,} more in the table") if more > 0 else None,
        explained=_SENTENCES,
        ident="did",
    )


def _render_section(
    title: str, ident: str, groups: Sequence[StudyGroup], figures: Sequence[str], explained: str
) -> Markup | None:
    if not groups:
        return None
    rows = [
        element(
            "tr",
            element("th", group.scenario, scope="row"),
            element("td", group.variant),
            element("td", f"{group.runs:,}", class_="n"),
            *(element("td", group.words(name), class_="n") for name in figures),
        )
        for group in groups[:MOST_ROWS]
    ]
    heads = ("Scenario", "Variant", "Runs", *map(_figure_label, figures))
    more = len(groups) - MOST_ROWS
    return report_section(
        title,
        html_table(heads, rows, label=title),
        element("p", f"and {more:,} more in the table") if more > 0 else None,
        explained=explained,
        ident=ident,
    )


def _figure_label(name: str) -> str:
    figure = study_figures()[name]
    return f"{figure.label}, {figure.unit}" if figure.unit else figure.label


def _render_problems(state: StudyState) -> Markup | None:
    if not state.problems:
        return None
    rows = [
        element(
            "tr",
            element("td", f"{count:,}", class_="n"),
            element("td", words, class_="wrap"),
        )
        for words, count in state.problems[:MOST_ROWS]
    ]
    table = html_table(("Runs", "Why"), rows, label="Failures")
    return report_section("Failures", table, explained=_FAILURES, ident="failures")
