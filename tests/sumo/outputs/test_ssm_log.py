from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import polars as pl

from odscen.figures.measures import safety
from odscen.figures.measures.figure import RunData
from odscen.figures.measures.registry import figure_values
from odscen.sumo.outputs.conflict_files import logged_conflicts, tidy_conflicts

if TYPE_CHECKING:
    from pathlib import Path

OVERLAPPING = """<SSMLog>
    <conflict begin="0.00" end="3.40" ego="bus-1" foe="car-3">
        <minTTC time="0.00" position="NA" type="2" value="0.00" speed="NA"/>
        <maxDRAC time="NA" position="NA" type="NA" value="NA" speed="NA"/>
        <PET time="NA" position="NA" type="NA" value="NA" speed="NA"/>
    </conflict>
    <conflict begin="4.00" end="6.00" ego="car-3" foe="bus-1">
        <minTTC time="5.00" position="112.50,31.00" type="7" value="1.25" speed="8.10"/>
        <PET time="NA" position="NA" type="NA" value="NA" speed="NA"/>
    </conflict>
</SSMLog>
"""


def test_bodies_that_overlap_from_the_start_are_a_conflict_without_a_place(tmp_path: Path) -> None:
    file = tmp_path / "ssm.xml"
    file.write_text(OVERLAPPING, encoding="utf-8")
    overlap, later = logged_conflicts(file, net_offset=(100.0, 30.0))
    assert (overlap["one"], overlap["other"], overlap["ttc"]) == ("bus-1", "car-3", 0.0)
    assert (overlap["x"], overlap["y"], overlap["kind"]) == (None, None, "following")
    assert (later["x"], later["y"], later["kind"], later["ttc"]) == (12.5, 1.0, "merging", 1.25)


def test_the_table_and_the_figures_of_a_run_have_a_conflict_without_a_place(tmp_path: Path) -> None:
    (tmp_path / "ssm.xml").write_text(OVERLAPPING, encoding="utf-8")
    plan: Any = SimpleNamespace(net_offset=(100.0, 30.0), actors=())
    tidy_conflicts(tmp_path, plan)
    assert [path.name for path in tmp_path.iterdir()] == ["conflicts.parquet"]
    table = pl.read_parquet(tmp_path / "conflicts.parquet").sort("begin")
    assert table["x"].to_list() == [None, 12.5]
    figures = figure_values(RunData(conflicts=table), safety.FIGURES)
    assert figures["min_ttc"] == 0.0
