"""The table of what real servers do names tests and switches that are there."""

from __future__ import annotations

import re
from pathlib import Path

from tests.carla_standin.switches import Switches

ROOT = Path(__file__).parents[2]
HERE = Path(__file__).parent


def rules() -> list[list[str]]:
    """Rows of the table: rule, source, stand-in, tests."""
    text = (ROOT / "docs" / "carla-server.md").read_text(encoding="utf-8")
    table = text.partition("## Rules of real servers")[2]
    rows = [line.strip("|").split("|") for line in table.splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in row] for row in rows[1:]]


def test_every_rule_has_a_source_and_says_where_it_is_and_what_tests_it() -> None:
    assert len(rules()) >= 16
    for rule, source, stand_in, tests in rules():
        assert source, rule
        assert stand_in, rule
        assert tests, rule
        if tests == "none":
            assert stand_in.startswith("no: "), rule


def test_tests_modules_and_switches_of_the_table_are_there() -> None:
    sources = [*(ROOT / "tests" / "carla").rglob("*.py"), *HERE.glob("*.py")]
    text = "\n".join(path.read_text(encoding="utf-8") for path in sources)
    switches = Switches.__dataclass_fields__
    for _, _, stand_in, tests in rules():
        for name in re.findall(r"`(test_\w+)`", tests):
            assert f"def {name}(" in text, name
        for name in re.findall(r"`(\w+\.py)`", stand_in):
            assert (HERE / name).is_file(), name
        for name in re.findall(r"switch `(\w+)`", stand_in):
            assert name in switches, name
