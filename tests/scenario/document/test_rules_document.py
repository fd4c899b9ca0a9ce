"""Rules as they are written, and what is refused when they are read."""

from __future__ import annotations

import json
from typing import Any

import pytest

from odscen.base.errors import ScenarioError
from odscen.scenario.document.json_form import dumps, loads
from tests.graphs import SHA256

RULES = [
    {
        "id": "cut-in", "actor": "van", "when": {"ttc": {"to": "ego", "below": 3.0}},
        "then": [{"lane": {"by": 1}}, {"together": [{"brake": {"by": 6.0}}, {"go": {}}]}],
    },
    {
        "id": "later", "actor": "van",
        "when": {"any": [{"not": {"rule": {"id": "cut-in"}}}, {"time": {"after": 3.0}}],
                 "delay": 1.0, "edge": "rising"},
        "then": [{"walk": {"to": [3.0, 4.5]}}], "times": 3,
    },
]  # fmt: skip


def text(rules: list[Any], **simulation: Any) -> str:
    return json.dumps(
        {
            "format": "odscen-scenario", "version": 1, "name": "x", "roi": ["r1"], "rules": rules,
            "map": {"name": "toy", "sha256": SHA256}, "simulation": simulation,
        }
    )  # fmt: skip


def test_rules_are_written_one_a_line_as_they_were_read() -> None:
    scenario = loads(text(RULES))
    written = dumps(scenario)
    assert json.loads(written)["rules"] == RULES
    assert loads(written) == scenario
    assert sum(line.lstrip().startswith('{"id": "') for line in written.splitlines()) == 2


def test_a_scenario_without_rules_does_not_speak_of_them() -> None:
    assert "rules" not in dumps(loads(text([])))


def test_with_rules_steps_are_short_unless_the_document_says_how_long() -> None:
    assert loads(text(RULES)).simulation.step_length == 0.1
    assert loads(text(RULES, step_length=0.5)).simulation.step_length == 0.5
    assert loads(text([])).simulation.step_length == 0.5
    assert '"step_length": 0.1' in dumps(loads(text(RULES)))


@pytest.mark.parametrize(
    ("when", "then", "words"),
    [
        ({}, {"go": {}}, "give one condition of time, ttc"),
        (
            {"time": {"after": 1.0}, "ttc": {"to": "a", "below": 1.0}},
            {"go": {}},
            "not time and ttc",
        ),
        ({"ttc": {"to": "a"}}, {"go": {}}, "give one bound of below, above, not none"),
        ({"distance": {"below": 1.0}}, {"go": {}}, "give one end of to, place"),
        ({"time": {"after": 1.0}}, {}, "give one action of"),
        ({"time": {"after": 1.0}}, {"lane": {"by": 0}}, "by must not be 0"),
        ({"time": {"after": 1.0}}, {"speed": {"to": 3.0}}, "give one measure of rate, over"),
        (
            {"time": {"after": 1.0}},
            {"speed": {"to": 3.0, "shape": "step", "over": 1.0}},
            "a step takes no time; leave out over",
        ),
        ({"time": {"after": 1.0}}, {"keep_gap": {"to": "a"}}, "give one gap of metres, seconds"),
    ],
)
def test_a_rule_that_means_nothing_or_two_things_is_refused_with_its_place(
    when: dict[str, Any], then: dict[str, Any], words: str
) -> None:
    rule = {"id": "r", "actor": "a", "when": when, "then": [then]}
    with pytest.raises(ScenarioError) as caught:
        loads(text([rule]))
    assert words in str(caught.value)
    assert "rules[0]" in str(caught.value)
