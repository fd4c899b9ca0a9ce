"""Each deviation that the stand-in can be told, alone, and what the self-check calls it."""

from __future__ import annotations

import ast
import re
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest

from odscen.carla.selfcheck.body_checks import BODY_NAMES, GROUND
from odscen.carla.selfcheck.check_line import CheckLimits
from odscen.carla.selfcheck.pace_checks import GROUND_PACE, PACE
from odscen.carla.selfcheck.selfcheck_run import (
    FRAMES,
    GIVEN_BACK,
    MAP,
    RELEASE,
    SECONDS,
    SIGNALS,
    STATES,
    selfcheck,
)
from odscen.carla.server.client import Address
from odscen.maps.store import Workspace
from tests.carla.conftest import MAPS
from tests.carla_standin.process import StandIn
from tests.carla_standin.switches import Switches

carla = pytest.importorskip("carla", reason="co-simulation needs the package carla")

TESTS = Path(__file__).parents[2]
DOCUMENT = TESTS.parent / "docs/carla-server.md"
CROSSING = MAPS / "signal_crossing.xodr"
LIMITS = {
    "tick_seconds": CheckLimits(ground_ms=200.0),
    "ground_seconds": CheckLimits(pace=2.0, ground_ms=15.0),
}
"""Those that are looked at; the others leave time to a machine that may be busy."""
PATIENT = CheckLimits(pace=2.0, ground_ms=200.0)
LINES = (
    RELEASE, MAP, FRAMES, SECONDS, GROUND, *BODY_NAMES, SIGNALS, STATES, PACE, GROUND_PACE,
    GIVEN_BACK,
)  # fmt: skip


def read_tables() -> tuple[list[list[str]], list[list[str]]]:
    text = DOCUMENT.read_text(encoding="utf-8")
    section = text.split("### What each deviation is called")[1].split("\n## ")[0]
    tables = re.split(r"\n\|---\|---\|---\|\n", section)[1:]
    rows = [
        [
            [cell.strip() for cell in line.strip("|").split("|")]
            for line in table.splitlines()
            if line.startswith("| `")
        ]
        for table in tables
    ]
    return rows[0], rows[1]


def read_deviation(cell: str) -> dict[str, Any]:
    call = ast.parse(f"f({cell.strip('`')})", mode="eval").body
    assert isinstance(call, ast.Call)
    return {str(given.arg): ast.literal_eval(given.value) for given in call.keywords}


DEVIATIONS = [
    (read_deviation(does), set(re.sub(r" \(.*\)", "", lines).split("; ")))
    for does, _, lines in read_tables()[0]
]


def test_each_line_and_each_switch_is_in_a_table() -> None:
    named = set().union(*(lines for _, lines in DEVIATIONS))
    assert named == set(LINES)
    _, harmless = read_tables()
    switches = {name for does, _ in DEVIATIONS for name in does} - {"map_name"}
    others = {name for row in harmless for name in re.findall(r"`(\w+)`", row[0])}
    known = {field.name for field in fields(Switches) if not field.name.startswith("_")}
    assert switches | others == known
    assert not switches & others
    text = "".join(file.read_text(encoding="utf-8") for file in TESTS.rglob("test_*.py"))
    for *_, test in harmless:
        assert f"def {test.strip('`')}(" in text


@pytest.mark.slow
@pytest.mark.parametrize(
    ("does", "lines"), DEVIATIONS, ids=[", ".join(does) for does, _ in DEVIATIONS]
)
def test_a_deviation_is_found_by_its_lines_and_no_other(
    workspace: Workspace, does: dict[str, Any], lines: set[str]
) -> None:
    workspace.add_map(CROSSING)
    workspace.add_map(MAPS / "roundabout.xodr")
    limits = LIMITS.get(next(iter(does)), PATIENT)
    with StandIn(CROSSING, **does) as server:
        report = selfcheck(workspace, Address(server.host, server.port, 10.0), limits=limits)
    assert {line.name for line in report.differing} == lines
    if not {"version", "frames_per_tick"} & set(does):
        assert not report.unchecked
