"""What the page takes for granted of new parts of a scenario, before the server has answered."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from odscen.base.categories import Category
from odscen.scenario.document.scenario_document import Actor, Flow
from odscen.scenario.document.signals_document import JunctionTiming

PARTS = Path(__file__).parents[2] / "frontend/src/editor/newParts.json"


@pytest.mark.parametrize(
    ("part", "made", "given"),
    [
        ("actor", Actor(id="a", category=Category.CAR, spawn="n"), {"id", "category", "spawn"}),
        ("flow", Flow(id="f", spawn="n", per_hour=60), {"id", "spawn", "per_hour"}),
        ("timing", JunctionTiming(junction="1"), {"junction"}),
    ],
)
def test_the_page_fills_new_parts_with_the_defaults_of_the_document(
    part: str, made: Actor | Flow | JunctionTiming, given: set[str]
) -> None:
    assert json.loads(PARTS.read_text(encoding="utf-8"))[part] == made.model_dump(
        mode="json", exclude=given
    )
