"""Scenarios in whatever form they come."""

from __future__ import annotations

import json

import pytest

from odscen.base.errors import ScenarioError
from odscen.scenario.document.json_form import loads
from odscen.scenario.forms.any_form import read_any

DOCUMENT = json.dumps(
    {
        "name": "a",
        "map": {"name": "t", "sha256": "0" * 64, "spacing": 2.0},
        "roi": ["1.0"],
    }
)


@pytest.mark.parametrize(
    ("before", "after", "key"),
    [('"roi":', '"roi": [], "roi":', "roi"), ('"spacing":', '"name": "u", "spacing":', "name")],
)
def test_a_key_that_is_given_twice_is_refused(before: str, after: str, key: str) -> None:
    """Of the two values one would be lost in silence."""
    assert read_any(DOCUMENT) == loads(DOCUMENT)
    with pytest.raises(ScenarioError, match=f"'{key}' is given twice in one place"):
        read_any(DOCUMENT.replace(before, after), file="a.json")
