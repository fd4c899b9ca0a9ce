"""Traffic lights in the report."""

from __future__ import annotations

import polars as pl
from lxml import etree

from odscen.figures.measures.signal_use import signal_use
from odscen.records.light_programs import (
    LightProgram,
    ProgramPhase,
    ShownGroup,
    ShownPlan,
)
from odscen.reports.page_templates import render_block
from odscen.reports.report_signals import LightsOfRun, signal_values
from odscen.reports.signal_charts import program_bars, shown_bars
from odscen.reports.signal_pictures import (
    JunctionPictures,
)

GROUPS = (
    ShownGroup(
        "V1", (0, 1), ("r1",), walk=False, lanes=(("a", ":a"), ("a", ":a1")),
        paths=(((0.0, 0.0), (10.0, 0.0)), ((0.0, 0.0), (5.0, 5.0))),
    ),
    ShownGroup("V2", (2,), ("r2 <left>",), walk=False, paths=(((5.0, -5.0), (5.0, 5.0)),)),
    ShownGroup("P1", (3,), ("walk r1",), walk=True, paths=(((9.0, -2.0), (9.0, 2.0)),)),
)  # fmt: skip
PHASES = (
    ProgramPhase(20.0, "Ggrr", "stage 1", "1"),
    ProgramPhase(3.0, "yyrr", "yellow"),
    ProgramPhase(2.0, "rrrr", "all red"),
    ProgramPhase(9.0, "rrgr", "stage 2", "2", 5.0, 15.0),
    ProgramPhase(1.0, "rrgr", "stage 2", "2", 1.0, 6.0),
    ProgramPhase(7.0, "rrrG", "stage 3", "3", on_call=True),
)
PLAN = ShownPlan("scenario", 5.0, PHASES)
LIGHT = LightProgram("J1", ("1",), "actuated", own=True, groups=GROUPS, plans=(PLAN,))


def states(*more: str) -> pl.DataFrame:
    rows, now = [], 0.0
    for phase in (*PHASES, *PHASES):
        rows.append((now, "J1", "0", 0, phase.name, phase.state))
        now += phase.seconds
    names = ["time", "light", "program", "phase", "name", "state"]
    return pl.DataFrame([*rows, *more], schema=names, orient="row")


def test_bars_are_green_permissive_and_yellow_at_their_seconds() -> None:
    assert [tuple(bar) for bar in program_bars(PLAN, (0, 1))] == [
        (0.0, 20.0, "green"), (20.0, 23.0, "yellow"),
    ]  # fmt: skip
    assert [tuple(bar) for bar in program_bars(PLAN, (2,))] == [(25.0, 35.0, "permissive")]
    rows = [(0.0, "rG"), (5.0, "rG"), (9.0, "rr"), (10.0, "")]
    assert [tuple(bar) for bar in shown_bars(rows, (1,))] == [(0.0, 9.0, "green")]


def test_each_stage_has_a_picture_with_its_seconds_and_groups() -> None:
    stages = JunctionPictures(LIGHT).stages(PLAN)
    assert [(stage.words, stage.detail) for stage in stages] == [
        ("stage 1: 20 s", "V1"),
        ("stage 2: 10 to 15 s", "V2"),
        ("stage 3: 7 s", "P1 on call"),
    ]
    first = etree.fromstring(str(stages[0].picture))
    kinds = [path.get("class") for path in first.iter("path")]
    assert kinds.count("movement green") == 1
    assert kinds.count("movement permissive") == 1
    assert kinds.count("movement red") == 1
    assert kinds.count("movement red walk") == 1


def test_a_light_without_ways_has_no_diagram() -> None:
    plain = LightProgram("J1", ("1",), "fixed", own=False, groups=(), plans=(PLAN,))
    assert JunctionPictures(plain).stages(PLAN) == []


def test_the_section_has_cards_bars_and_a_row_for_each_group() -> None:
    table = signal_use([LIGHT], states(), end=84.0)
    values = signal_values(
        LightsOfRun((LIGHT,), states(), table), {"cycle_failures": 0.25, "unused_green": 0.1}
    )
    text = str(render_block("run_report.html.j2", "signals", signals=values))
    assert "<figcaption><b>stage 2: 10 to 15 s</b><span>V2</span></figcaption>" in text
    assert "Junction 1, actuated, program of the scenario" in text
    assert "25" in text
    assert "r2 &lt;left&gt;" in text
    assert text.count("<tr>") == 8  # heads and rows of three splits and of three groups
    assert "cycle 42 s, offset 5 s" in text
    assert "As shown in the run" in text
