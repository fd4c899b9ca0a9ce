from __future__ import annotations

import json
import os
import re
from pathlib import Path

import pytest

from odscen.figures.measures.figure_docs import between_markers
from odscen.scenario.document.rules_document import Action, StoryRule
from odscen.scenario.story.action_kinds import ACTIONS
from odscen.scenario.story.rule_docs import action_table, condition_table

DOCS = Path(__file__).parents[3] / "docs" / "rules.md"


@pytest.mark.golden
def test_the_tables_of_the_docs_are_those_of_the_registries() -> None:
    text = DOCS.read_text(encoding="utf-8")
    new = between_markers(text, "conditions", condition_table())
    new = between_markers(new, "actions", action_table())
    if os.environ.get("ODSCEN_GOLDEN") == "write":
        DOCS.write_text(new, encoding="utf-8")
    assert DOCS.read_text(encoding="utf-8") == new


def test_each_example_of_the_docs_is_a_rule() -> None:
    found = re.findall(r"```json\n(.*?)```", DOCS.read_text(encoding="utf-8"), re.DOTALL)
    rules = [rule for text in found for rule in json.loads(text)]
    assert len(rules) >= 4
    for rule in rules:
        assert StoryRule.model_validate_json(json.dumps(rule), strict=True).id


def test_each_action_of_the_document_is_in_the_registry() -> None:
    assert set(ACTIONS) == set(Action.model_fields) - {"together"}
