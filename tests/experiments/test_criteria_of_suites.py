"""Suites expect the criteria that their scenarios have themselves."""

from __future__ import annotations

from odscen.experiments.gates import run_suite
from odscen.experiments.suite import read_suite
from tests.experiments.conftest import edit_json


def test_a_suite_expects_the_criteria_of_its_scenarios_unless_it_says_otherwise(store, tiny):
    suite = tiny("one")
    text = suite.read_text().replace('baselines = "baselines"\n', "usable = false\n")
    suite.write_text(text)
    edit_json(suite.parent / "one.scenario.json", criteria=["collided == 0", "sim_seconds <= 10 s"])
    (case,) = run_suite(store, read_suite(suite)).cases
    assert case.status.value == "failed"
    assert list(case.problems) == ["seed 1: Simulated time: at most 10 s, but it is 20 s"]
    suite.write_text("criteria = false\n" + text)
    (case,) = run_suite(store, read_suite(suite)).cases
    assert case.status.value == "passed"
