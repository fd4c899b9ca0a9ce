"""JUnit of a suite in which much has gone wrong at once."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from lxml import etree

from odscen.experiments.suite_words import junit_xml


@pytest.fixture(scope="module")
def root(mixed):
    return etree.fromstring(junit_xml(mixed).encode())


def case_of(root, name):
    return root.find(f".//testcase[@name='{name}']")


def properties(element):
    return {one.get("name"): one.get("value") for one in element.iter("property")}


@pytest.mark.slow
def test_scenarios_and_runs_are_test_cases_and_the_counts_are_theirs(root):
    names = [one.get("name") for one in root.iter("testcase")]
    assert names == [
        "broken",
        "signal_crossing",
        "signal_crossing[seed-1]",
        "signal_crossing[seed-2]",
        "t_junction_signs",
        "t_junction_signs[seed-1]",
        "t_junction_signs[seed-2]",
        "gone",
    ]
    assert {key: root.get(key) for key in ("tests", "errors", "failures")} == {
        "tests": "8",
        "errors": "1",
        "failures": "3",
    }
    seconds = sum(float(one.get("time")) for one in root.iter("testcase"))
    assert seconds == pytest.approx(float(root.get("time")), abs=0.01)


def test_the_message_is_the_likeliest_cause_with_few_figures_and_the_worst_place(root):
    message = case_of(root, "signal_crossing").find("failure").get("message")
    assert re.match(
        r"signals: signals, junction 10001: .* of the map -> {\"green\": \[60.*}: \w+ is ", message
    )
    assert "; most at junction j10001: waiting_time is " in message
    assert message.count(" was ") == 3
    message = case_of(root, "t_junction_signs").find("failure").get("message")
    assert message.startswith("the map: ")
    assert "; most at segment r2: free_speed is 5." in message
    message = case_of(root, "broken").find("error").get("message")
    assert "'9.9.9.9'" in message


def test_the_body_has_every_figure_and_the_reason(root):
    body = case_of(root, "signal_crossing").find("failure").text.splitlines()
    assert len(body) > 20
    assert body[-1].startswith("changed since the baseline: the scenario's signals (signals, junct")


def test_properties_have_verdict_fingerprints_figures_and_files(root):
    found = properties(case_of(root, "t_junction_signs"))
    assert (found["verdict"], found["cause"], found["map"]) == ("failed", "map", "t_junction_signs")
    assert re.fullmatch(r"[0-9a-f]{16}", found["fingerprint.map"])
    assert found["baseline.fingerprint.map"] != found["fingerprint.map"]
    assert found["fingerprint.sumo"] == "1.28.0"
    assert found["baseline"].endswith("baselines/t_junction_signs.json")
    run = properties(case_of(root, "t_junction_signs[seed-2]"))
    assert run["seed"] == "2"
    assert float(run["figure.mean_delay"]) > 0
    assert Path(run["artefact.report"]).is_file()
    assert Path(run["artefact.summary"]).parent == Path(run["artefact.run"])
