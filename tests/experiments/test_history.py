"""Histories of suites: a line a run, and since when a figure is as it is."""

from __future__ import annotations

import json
import subprocess
from typing import TYPE_CHECKING

import pytest
from lxml import etree
from typer.testing import CliRunner

from odscen.base.errors import InputError, NotFoundError
from odscen.cli.commands import command_line
from odscen.experiments.annotations import sarif
from odscen.experiments.badge import badge, suite_badge
from odscen.experiments.history import (
    CaseLine,
    HistoryLine,
    append_history,
    current_commit,
    find_levels,
    find_trends,
    history_line,
    history_page,
    read_history,
    told_lines,
)
from odscen.experiments.measure import FigureKey
from odscen.figures.measures.registry import figure_of

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

DELAY = figure_of("run", "mean_delay")
"""Allowed are 2 % or 0.5 s."""


def line(
    number: int, figures: Mapping[str, float], *, seeds: tuple[int, ...] = (1, 2)
) -> HistoryLine:
    case = CaseLine("passed", seeds, figures)
    date = f"2026-01-{number:02d}T12:00:00Z"
    return HistoryLine("small", f"{number:02d}{0:038x}", date, {"town": case})


def test_a_level_lasts_while_values_are_within_the_tolerance_of_its_first() -> None:
    levels = find_levels([30.0, 30.4, 30.1, 36.0, 36.2], range(5), DELAY)
    assert [(x.first, x.last, x.value) for x in levels] == [(0, 2, 30.0), (3, 4, 36.0)]


def test_what_creeps_away_in_small_steps_is_a_change_too() -> None:
    values = [30.0 + 0.4 * k for k in range(10)]
    assert len(find_levels(values, range(10), DELAY)) > 3


def test_the_sentence_names_both_values_the_commit_and_other_seeds() -> None:
    history = [line(n, {"mean_delay": 30.0, "arrived": 50.0}) for n in (1, 2)]
    history += [line(n, {"mean_delay": 36.0, "arrived": 50.0}) for n in (3, 4)]
    trends = find_trends(history)
    assert [trend.figure for trend in trends] == ["mean_delay", "arrived"]
    assert told_lines(history, trends) == [
        "town: mean_delay is 36.00 s since 0300000000, was 30.00 s until 0200000000 (+20.0 %)"
    ]
    assert trends[0].better is False
    other = [*history[:2], line(3, {"mean_delay": 36.0}, seeds=(3, 4))]
    assert "; the seeds are others since then" in told_lines(other, find_trends(other))[0]
    assert told_lines(history[:2], find_trends(history[:2])) == ["No figure has changed in 2 runs."]


def test_suites_of_one_file_are_kept_apart_though_their_scenarios_have_one_name() -> None:
    history = []
    for number, delay in ((1, 30.0), (2, 30.0), (3, 36.0)):
        own = line(number, {"mean_delay": delay})
        history += [
            own,
            HistoryLine("large", own.commit, own.date, line(1, {"mean_delay": 90.0}).cases),
        ]
    found = {trend.scenario: len(trend.levels) for trend in find_trends(history)}
    assert found == {"small: town": 2, "large: town": 1}


def test_a_file_keeps_a_line_a_run_and_the_last_of_a_commit_counts(tmp_path: Path) -> None:
    file = tmp_path / "deep" / "history.jsonl"
    for number, delay in ((1, 30.0), (2, 31.0), (1, 36.0)):
        append_history(file, line(number, {"mean_delay": delay}))
    found = read_history(file)
    assert [x.cases["town"].figures["mean_delay"] for x in found] == [31.0, 36.0]
    file.write_text(file.read_text() + '{"format": "odscen-history", "version": 1}\n')
    with pytest.raises(InputError, match=r"history\.jsonl: line 4: not a line of a history"):
        read_history(file)
    with pytest.raises(InputError, match="line 4"):
        append_history(file, line(3, {}))


def test_the_commit_is_that_of_git_or_of_the_job(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("GITHUB_SHA", "CI_COMMIT_SHA"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("GIT_CEILING_DIRECTORIES", str(tmp_path.parent))
    with pytest.raises(InputError, match="name one with --commit"):
        current_commit(tmp_path)
    own = ["-c", "user.name=a", "-c", "user.email=a@example.org", "-c", "commit.gpgsign=false"]
    (tmp_path / "suite.toml").write_text("a")
    for words in (["init", "-q"], ["add", "."], [*own, "commit", "-q", "-m", "First"]):
        subprocess.run(["git", *words], cwd=tmp_path, check=True)
    commit, date = current_commit(tmp_path)
    assert len(commit) == 40
    assert date[:2] == "20"
    (tmp_path / "suite.toml").write_text("b")
    assert current_commit(tmp_path)[0] == f"{commit}+"
    monkeypatch.setenv("CI_COMMIT_SHA", "--help")
    assert current_commit(tmp_path) == ("--help", "")


def test_the_page_is_well_formed_and_escapes_names() -> None:
    history = [line(n, {"mean_delay": 30.0 + 9.0 * (n > 2)}) for n in (1, 2, 3)]
    named = [HistoryLine("<b>town", x.commit, x.date, {"a<i>": x.cases["town"]}) for x in history]
    text = history_page(named)
    assert text == history_page(named)
    assert "<b>town" not in text
    assert "<i>" not in text
    assert "mean_delay is 39.00 s since" in text
    assert text.count('class="chart"') == 1


def test_the_command_says_since_when_and_writes_the_page(tmp_path: Path) -> None:
    file, page = tmp_path / "history.jsonl", tmp_path / "history.html"
    for number, delay in ((1, 30.0), (2, 36.0)):
        append_history(file, line(number, {"mean_delay": delay}))
    run = CliRunner()
    done = run.invoke(command_line(), ["history", str(file), "--html", str(page)])
    assert done.exit_code == 0, done.output
    assert done.stdout.startswith("town: mean_delay is 36.00 s since 0200000000, was 30.00 s")
    assert page.read_text().startswith("<!")
    done = run.invoke(command_line(), ["history", str(file), "--json"])
    (figure,) = json.loads(done.stdout)["figures"]
    assert [level["value"] for level in figure["levels"]] == [30.0, 36.0]
    done = run.invoke(command_line(), ["history", str(file), "--suite", "other"])
    assert isinstance(done.exception, NotFoundError)


def test_a_badge_is_an_image_with_its_words() -> None:
    root = etree.fromstring(badge("town & hills", "7 of 8 pass", good=False).encode())
    assert root.get("role") == "img"
    assert root[0].text == "town & hills: 7 of 8 pass"
    assert {one.text for one in root.iter("{*}text")} == {"town & hills", "7 of 8 pass"}


@pytest.mark.slow
def test_a_suite_becomes_a_line_a_badge_and_a_log_of_findings(mixed) -> None:
    found = history_line(mixed, commit="c0ffee", date="")
    assert set(found.cases) == {"signal_crossing", "t_junction_signs"}
    case = next(case for case in mixed.cases if case.name == "signal_crossing")
    delays = [run.figures[FigureKey("run", "", "mean_delay")] for run in case.runs]
    assert found.cases["signal_crossing"].seeds == (1, 2)
    assert found.cases["signal_crossing"].figures["mean_delay"] == pytest.approx(
        sum(delays) / 2, abs=1e-4
    )
    assert "0 of 4 pass" in suite_badge(mixed)
    log = json.loads(sarif(mixed))
    assert log["version"] == "2.1.0"
    results = log["runs"][0]["results"]
    assert {one["level"] for one in results} >= {"error"}
    crossing = next(one for one in results if one["message"]["text"].startswith("signal_crossing"))
    place = crossing["locations"][0]["physicalLocation"]
    assert place["artifactLocation"]["uri"].endswith("signal_crossing.scenario.json")
    assert place["region"]["startLine"] >= 1
    assert len({one["partialFingerprints"]["odscen/v1"] for one in results}) == len(results)
