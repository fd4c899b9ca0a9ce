"""Page, summary and data of a suite in which much has gone wrong at once."""

from __future__ import annotations

import re

import pytest

from odscen.experiments.suite_page import suite_page
from odscen.experiments.suite_words import suite_summary, to_dict


@pytest.fixture(scope="module")
def page(mixed, store):
    return suite_page(mixed, workspace=store, beside=mixed.suite.file.parent)


def section(page, heading):
    return next(part for part in page.split("<section")[1:] if heading in part)


@pytest.mark.slow
def test_the_worst_scenarios_stand_first(page):
    assert "4 of 4 scenarios do not pass" in page
    assert "1 error, 2 failed, 1 missing; 4 runs." in page
    names = re.findall(r'href="#case-\d+">(\w+)<', page)
    assert names[0] == "broken"
    assert set(names[1:3]) == {"signal_crossing", "t_junction_signs"}
    assert names[3] == "gone"


def test_the_page_draws_the_places_before_and_now_with_numbers(page):
    crossing = section(page, "signal_crossing: failed")
    assert re.findall(r"<figcaption>(.*?)</figcaption>", crossing) == ["Baseline", "Now"]
    before, now = crossing.split("<figure>")[1:]
    for side in (before, now):
        assert ">1</text>" in side
    delay = [re.search(r"j10001: stopped delay ([\d.]+) s", side) for side in (before, now)]
    assert float(delay[1][1]) > float(delay[0][1]) + 5
    assert "1. junction j10001: stopped delay" in crossing


def test_the_map_of_before_is_drawn_where_the_workspace_has_it(page, mixed):
    assert "Baseline, on the map of now" not in section(page, "t_junction_signs: failed")
    without = suite_page(mixed)
    assert "Baseline, on the map of now" in section(without, "t_junction_signs: failed")


def test_reports_of_the_runs_are_links_relative_to_the_page(page):
    assert 'href="../runs/signal_crossing/seed-1/report.html"' in page


def test_the_page_says_whom_each_changed_input_touches(page):
    touched = section(page, "Changed since the baselines")
    assert "the map t_junction_signs" in touched
    assert "the scenario&#39;s signals" in touched or "the scenario's signals" in touched


def test_the_summary_is_a_table_that_markdown_takes_as_it_stands(mixed):
    text = suite_summary(mixed)
    assert text.startswith("## :x: small\n\n1 error, 2 failed, 1 missing\n")
    rows = [line for line in text.splitlines() if line.startswith("| ")]
    assert len(rows) == 2 + 4
    assert all(len(re.findall(r"(?<!\\)\|", row)) == 4 for row in rows)
    assert "| t\\_junction\\_signs | :x: failed | the map: " in text
    assert "- the map t\\_junction\\_signs: 1 of 4 scenarios" in text


def test_the_data_has_verdicts_headlines_and_causes(mixed):
    data = to_dict(mixed)
    assert (data["passed"], data["exit_code"]) == (False, 2)
    assert data["verdicts"] == {"error": 1, "failed": 2, "missing": 1}
    crossing = next(case for case in data["cases"] if case["name"] == "signal_crossing")
    assert (crossing["status"], crossing["cause"]) == ("failed", "signals")
    change = next(one for one in crossing["changes"] if one["figure"] == "mean_delay")
    assert change["difference"] == pytest.approx(change["value"] - change["baseline"])
    assert {one["figure"] for one in crossing["better"]} == {"mean_speed"}
