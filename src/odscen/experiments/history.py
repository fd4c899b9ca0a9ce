"""Figures of suites over commits: a line for each run of a suite, and since when a figure differs.

A suite runs the same scenarios with the same seeds, and the same input gives the same figures: a
difference is no chance, and needs no test of scatter. So a level of a figure lasts for as long as
its values are within the figure's tolerance of the first one of the level, which also catches what
creeps away in small steps. Where a level begins with other seeds, that is said, as chance may then
be the reason. Tolerances are the usual ones, not those of a suite, which may change, too.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from odscen.base.errors import InputError
from odscen.base.given_files import read_given
from odscen.base.markup import Markup, element, join
from odscen.base.stored_files import documents, read_document
from odscen.experiments.measure import FigureKey
from odscen.experiments.tolerance import usual
from odscen.figures.measures.registry import figure_of
from odscen.reports.charts import Axis, ChartFrame, Dots, chart, dot_parts, nice_ticks
from odscen.reports.page_templates import html_page, html_table, page_head, report_section

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path

    from odscen.experiments.suite import SuiteResult
    from odscen.figures.measures.figure import Figure

_FORMAT, _VERSION = "odscen-history", 1
_COMMITS = "GITHUB_SHA", "CI_COMMIT_SHA"
"""Variables of the environment that name the commit in GitHub's and GitLab's jobs."""
_SHORT = 10
"""Letters of a commit that are shown."""
_NOISE = 1e-4
"""Figures are written with that many decimals."""
_LARGEST = 1e15
_MOST_LABELS = 8
"""Of commits below a chart."""


@dataclass(frozen=True, slots=True)
class HistoryLine:
    """A run of a suite.

    Attributes
    ----------
    suite
        Its name.
    commit
        What was run; ``+`` behind it says that files differed from it.
    date
        Of the commit, ISO 8601; empty where it is not known.
    cases
        By scenario.
    """

    suite: str
    commit: str
    date: str
    cases: Mapping[str, CaseLine]

    @property
    def short(self) -> str:
        """The commit as it is shown."""
        name, changed = self.commit.removesuffix("+"), self.commit.endswith("+")
        return name[:_SHORT] + ("+" if changed else "")


@dataclass(frozen=True, slots=True)
class CaseLine:
    """A scenario in it: verdict, seeds, and the mean of each figure of the run over the seeds."""

    status: str
    seeds: tuple[int, ...]
    figures: Mapping[str, float]


class Level(NamedTuple):
    """Runs in a row between which a figure has not changed.

    ``first`` and ``last`` are places in the history; ``value`` is the first one.
    """

    first: int
    last: int
    value: float


class Trend(NamedTuple):
    """A figure of a scenario over all runs.

    Attributes
    ----------
    scenario, figure
        Which one, the figure by its name; where the history has several suites, the scenario with
        that of its own, as these may have scenarios of one name.
    places
        In the history, of the runs that have it.
    values
        Its means there.
    levels
        At least one.
    other_seeds
        Whether the last level began with other seeds.
    """

    scenario: str
    figure: str
    places: tuple[int, ...]
    values: tuple[float, ...]
    levels: tuple[Level, ...]
    other_seeds: bool

    @property
    def entry(self) -> Figure:
        """What is known of the figure; of one that a suite has made up, its name."""
        return figure_of("run", self.figure)

    def written(self, value: float) -> str:
        """A value with its unit."""
        return self.entry.written(value)

    @property
    def better(self) -> bool | None:
        """Whether the last level is better than the one before; ``None`` if neither, or one."""
        if len(self.levels) < 2:
            return None
        return self.entry.improves(self.levels[-1].value - self.levels[-2].value)

    def words(self, history: Sequence[HistoryLine]) -> str:
        """Since when it is as it is, in a sentence."""
        last = self.levels[-1]
        if len(self.levels) < 2:
            return f"{self.figure} is {self.written(last.value)} in all {len(self.places)} runs"
        before = self.levels[-2]
        share = ""
        if before.value:
            share = f" ({100.0 * (last.value - before.value) / abs(before.value):+.1f} %)"
        reason = "; the seeds are others since then" if self.other_seeds else ""
        return (
            f"{self.figure} is {self.written(last.value)} since {history[last.first].short}, "
            f"was {self.written(before.value)} until {history[before.last].short}{share}{reason}"
        )


def history_line(result: SuiteResult, *, commit: str, date: str = "") -> HistoryLine:
    """What a history keeps of a suite that has been run."""
    cases = {}
    for case in result.cases:
        if not case.runs:
            continue
        names = dict.fromkeys(
            key.figure for run in case.runs for key in run.figures if key.kind == "run"
        )
        means = {}
        for name in names:
            found = [run.figures.get(FigureKey("run", "", name)) for run in case.runs]
            known = [value for value in found if value is not None]
            if len(known) == len(case.runs):  # a mean over some seeds is another figure
                means[name] = round(sum(known) / len(known), 4)
        seeds = tuple(run.seed for run in case.runs)
        cases[case.name] = CaseLine(case.status.value, seeds, means)
    return HistoryLine(result.suite.name, commit, date, cases)


def append_history(file: Path, line: HistoryLine) -> None:
    """Add a run at the end of a file; it is made if need be.

    Raises
    ------
    InputError
        If there is a file that is no history, or it cannot be written.
    """
    if file.exists():
        read_history(file)
    text = json.dumps(
        {
            "format": _FORMAT,
            "version": _VERSION,
            "suite": line.suite,
            "commit": line.commit,
            "date": line.date,
            "cases": {
                name: {
                    "status": case.status, "seeds": [*case.seeds], "figures": dict(case.figures),
                }
                for name, case in line.cases.items()
            },
        },
        ensure_ascii=False,
    )  # fmt: skip
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with file.open("a", encoding="utf-8") as stream:
            stream.write(text + "\n")  # one call, so that jobs side by side do not mix their lines
    except OSError as error:
        raise InputError(f"it cannot be written: {error.strerror}", file=str(file)) from error


def read_history(file: Path) -> tuple[HistoryLine, ...]:
    """Read a history, in the order of its lines; of a commit that was run twice the last counts.

    Raises
    ------
    InputError
        If it cannot be read, or a line is none, with its number.
    """
    lines: dict[tuple[str, str], HistoryLine] = {}
    for number, text in enumerate(read_given(file).decode("utf-8", "replace").splitlines(), 1):
        if not text.strip():
            continue
        try:
            line = _parse_line(text)
        except InputError as error:
            raise InputError(error.problem, file=str(file), element=f"line {number}") from error
        place = line.suite, line.commit
        lines.pop(place, None)
        lines[place] = line
    return tuple(lines.values())


def _parse_line(text: str) -> HistoryLine:
    what = "a line of a history"
    values = read_document(text, form=_FORMAT, version=_VERSION, what=what)
    with documents(what):
        cases = {
            str(name): CaseLine(
                str(case["status"]),
                tuple(int(seed) for seed in case["seeds"]),
                {str(figure): _read_figure(value) for figure, value in case["figures"].items()},
            )
            for name, case in values["cases"].items()
        }
        return HistoryLine(str(values["suite"]), str(values["commit"]), str(values["date"]), cases)


def _read_figure(value: Any) -> float:
    """A number that can be drawn beside others."""
    number = float(value)
    if not abs(number) <= _LARGEST:
        raise InputError(f"a figure is {value!r}, not a number up to {_LARGEST:g}")
    return number


def current_commit(folder: Path) -> tuple[str, str]:
    """Commit that is checked out around a folder, and its date; ``+`` behind it if files differ.

    In jobs of GitHub and GitLab it is the one that the job was started for.

    Raises
    ------
    InputError
        If it is not known.
    """
    named = next((os.environ[name] for name in _COMMITS if os.environ.get(name)), "")
    if named:
        known = re.fullmatch("[0-9a-f]{7,64}", named) is not None
        return named, (known and _ask_git(folder, "show", "-s", "--format=%cI", named)) or ""
    head = _ask_git(folder, "rev-parse", "HEAD")
    if not head:
        raise InputError(
            "git knows no commit of this folder; name one with --commit", file=str(folder)
        )
    changed = _ask_git(folder, "status", "--porcelain", "--untracked-files=no")
    date = _ask_git(folder, "show", "-s", "--format=%cI", head) or ""
    return head + ("+" if changed else ""), date


def _ask_git(folder: Path, *words: str) -> str | None:
    try:
        done = subprocess.run(
            ["git", "-C", str(folder), *words],  # noqa: S607
            capture_output=True, text=True, check=False, timeout=30,
        )  # fmt: skip
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout.strip() if done.returncode == 0 else None


def find_levels(values: Sequence[float], places: Sequence[int], figure: Figure) -> list[Level]:
    """Levels of a figure: each lasts while values are within its tolerance of the first one."""
    levels: list[Level] = []
    for place, value in zip(places, values, strict=True):
        if levels:
            level = levels[-1]
            allowed = usual(figure).allowed(level.value)
            if abs(value - level.value) <= allowed + _NOISE:
                levels[-1] = level._replace(last=place)
                continue
        levels.append(Level(place, place, value))
    return levels


def find_trends(history: Sequence[HistoryLine]) -> tuple[Trend, ...]:
    """Figures of all scenarios, those first that have changed last."""
    several = len({line.suite for line in history}) > 1
    runs: dict[tuple[str, str], list[tuple[int, CaseLine]]] = {}
    for place, line in enumerate(history):
        for name, case in line.cases.items():
            scenario_name = f"{line.suite}: {name}" if several else name
            for figure in case.figures:
                runs.setdefault((scenario_name, figure), []).append((place, case))
    trends = []
    for (scenario, figure), there in runs.items():
        values = [case.figures[figure] for _, case in there]
        places = [place for place, _ in there]
        levels = find_levels(values, places, figure_of("run", figure))
        seeds = {place: case.seeds for place, case in there}
        other = len(levels) > 1 and seeds[levels[-1].first] != seeds[levels[-2].last]
        trends.append(Trend(scenario, figure, tuple(places), tuple(values), tuple(levels), other))
    return tuple(sorted(trends, key=lambda x: (len(x.levels) < 2, -x.levels[-1].first, x.scenario)))


# The page


def history_page(history: Sequence[HistoryLine]) -> str:
    """Page of a history: what has changed and since when, with a chart of each changed figure."""
    trends = find_trends(history)
    changed = [trend for trend in trends if len(trend.levels) > 1]
    suites = ", ".join(dict.fromkeys(line.suite for line in history)) or "no suite"
    scenarios = len({trend.scenario for trend in trends})
    head = page_head(
        "History of figures",
        suites,
        element(
            "p",
            f"{len(history)} runs, {scenarios} scenarios, {len(trends)} figures.",
        ),
        verdict=f"{len(changed)} figures have changed" if changed else "No figure has changed",
        style="fair" if changed else "good",
    )
    parts = [head, _changes_section(history, changed), _runs_section(history)]
    parts += [_figure_section(history, trend, n) for n, trend in enumerate(changed, start=1)]
    return html_page(f"{suites} - history of figures", join([part for part in parts if part]))


def _changes_section(history: Sequence[HistoryLine], changed: Sequence[Trend]) -> Markup | None:
    if not changed:
        return None
    rows = []
    for number, trend in enumerate(changed, start=1):
        last, before = trend.levels[-1], trend.levels[-2]
        style = {True: "good", False: "bad", None: ""}[trend.better]
        cells = (
            element("td", element("a", trend.scenario, href=f"#figure-{number}")),
            element("td", trend.figure),
            element("td", trend.written(before.value)),
            element("td", trend.written(last.value), class_=style or None),
            element("td", history[last.first].short),
            element("td", history[last.first].date[:10]),
            element("td", "other seeds" if trend.other_seeds else ""),
        )
        rows.append(element("tr", *cells))
    heads = ("Scenario", "Figure", "Before", "Now", "Since", "Date", "")
    return report_section(
        "What has changed",
        html_table(heads, rows, label="What has changed"),
        explained="a figure has changed where it is off from the first value of its level by more "
        "than its tolerance. The same input and seeds give the same figures, so this is no chance, "
        "unless the seeds are others.",
        ident="changes",
    )


def _runs_section(history: Sequence[HistoryLine]) -> Markup:
    rows = []
    for line in reversed(history):
        statuses = [case.status for case in line.cases.values()]
        counts = ", ".join(f"{statuses.count(name)} {name}" for name in dict.fromkeys(statuses))
        cells = (line.short, line.date[:10], line.suite, counts)
        rows.append(element("tr", *(element("td", cell) for cell in cells)))
    return report_section(
        "Runs",
        html_table(("Commit", "Date", "Suite", "Scenarios"), rows, label="Runs"),
        explained="the newest first; a + says that files differed from the commit.",
        ident="runs",
    )


def _figure_section(history: Sequence[HistoryLine], trend: Trend, number: int) -> Markup:
    unit = trend.entry.unit
    low, high = min(trend.values), max(trend.values)
    ticks = nice_ticks(min(low, 0.0) if low < 0.3 * high else low, high)
    y_axis = Axis(ticks[0], ticks[-1], [(t, f"{t:g}") for t in ticks], unit or trend.figure)
    last = max(len(history) - 1, 1)
    every = -(-len(history) // _MOST_LABELS)
    x_ticks = [(float(n), history[n].short) for n in range(0, len(history), every)]
    frame = ChartFrame(Axis(-0.5, last + 0.5, x_ticks, "commit"), y_axis)
    titles = [
        f"{history[place].short}: {trend.written(value)}"
        for place, value in zip(trend.places, trend.values, strict=True)
    ]
    dots = Dots(
        trend.figure, "c-car", np.array(trend.places, dtype=float), np.array(trend.values), titles
    )
    lines = [_level_line(frame, level) for level in trend.levels]
    words = trend.words(history)
    return report_section(
        f"{trend.scenario}: {trend.figure}",
        chart(frame, [*lines, *dot_parts(frame, [dots])], description=words),
        explained=f"{words}.",
        ident=f"figure-{number}",
    )


def _level_line(frame: ChartFrame, level: Level) -> Markup:
    left, right = (float(frame.x(x)) for x in (level.first - 0.4, level.last + 0.4))
    y = float(frame.y(level.value))
    return element("path", d=f"M{left:.1f} {y:.1f}H{right:.1f}", class_="trail")


def told_lines(history: Sequence[HistoryLine], trends: Iterable[Trend]) -> list[str]:
    """What has changed, a line each; one line if nothing has."""
    changed = [trend for trend in trends if len(trend.levels) > 1]
    if not changed:
        return [f"No figure has changed in {len(history)} runs."]
    return [f"{trend.scenario}: {trend.words(history)}" for trend in changed]
