"""Figures of signal groups from what lights showed and who passed."""

from __future__ import annotations

import polars as pl
import pytest

from odscen.figures.measures.figure import Basis, RunData
from odscen.figures.measures.registry import run_figure
from odscen.figures.measures.signal_use import signal_use
from odscen.records.light_programs import LightProgram, ShownGroup

GROUPS = (
    ShownGroup("V1", (0,), ("r1",), walk=False, lanes=(("a", ":a", ":a2"),)),
    ShownGroup("V2", (1,), ("r2",), walk=False, lanes=(("b", ":b"),)),
    ShownGroup("P1", (2,), ("walk r1",), walk=True),
)
LIGHT = LightProgram("J1", ("1",), "fixed", own=True, groups=GROUPS, plans=())
STATES = [
    (0.0, "Grr"), (20.0, "yrr"), (23.0, "rrr"), (25.0, "rGG"), (35.0, "ryr"), (38.0, "rrr"),
    (40.0, "Grr"), (60.0, "yrr"), (63.0, "rrr"), (65.0, "rGG"),
]  # fmt: skip


def states() -> pl.DataFrame:
    rows = [(time, "J1", "0", number, "", state) for number, (time, state) in enumerate(STATES)]
    names = ["time", "light", "program", "phase", "name", "state"]
    return pl.DataFrame(rows, schema=names, orient="row")


def rows(*vehicles: tuple[str, float, str, float]) -> pl.LazyFrame:
    """Vehicle, time, lane and speed."""
    names = ["vehicle_id", "timestep_time", "vehicle_lane", "vehicle_speed"]
    return pl.LazyFrame(list(vehicles), schema=names, orient="row")


WAYS = pl.DataFrame(
    [
        ("a", "j1", "A", None, None, None),
        ("before", "j1", "A", None, None, None),
        ("b", "j1", "B", None, None, None),
        (":a", "j1", "A", "a", ":a", "r1>j1>r3"),
    ],
    schema=dict.fromkeys(("lane", "junction", "approach", "source", "via", "movement"), pl.String),
    orient="row",
)


def used(*vehicles: tuple[str, float, str, float]) -> dict[str, dict[str, object]]:
    table = signal_use([LIGHT], states(), end=70.0, rows=rows(*vehicles), ways=WAYS)
    return {row["group"]: row for row in table.to_dicts()}


def test_greens_served_are_those_that_were_shown() -> None:
    table = signal_use([LIGHT], states(), end=70.0)
    assert table["greens"].to_list() == [2, 2, 2]
    assert table["green"].to_list() == [40.0, 15.0, 15.0]
    assert table["mean_green"].to_list() == [20.0, 7.5, 7.5]
    assert table["vehicles"].to_list() == [None, None, None]


def test_green_is_unused_from_three_seconds_after_a_vehicle_until_the_next() -> None:
    table = used(("c", 4.0, ":a", 8.0), ("c", 4.5, ":a2", 8.0), ("d", 12.0, ":a", 8.0))
    # 0 to 4: 1 s; 4 to 12: 5 s; 12 to 20: 5 s; the second green of 20 s: 17 s.
    assert table["V1"]["vehicles"] == 2
    assert table["V1"]["unused_green"] == pytest.approx(28.0)
    assert table["V2"]["unused_green"] == pytest.approx(7.0 + 2.0)
    assert table["P1"]["unused_green"] is None


def test_a_green_fails_if_one_that_stood_before_it_began_has_not_passed_at_its_end() -> None:
    elsewhere = [("c", 2.0, "far away", 0.0), ("c", 67.0, ":b", 5.0)]
    assert used(*elsewhere)["V2"]["cycle_failures"] == 0
    waiting = [("c", 2.0, "b", 0.0), ("c", 66.0, ":b", 5.0)]
    assert used(*waiting)["V2"]["cycle_failures"] == 1
    served = [("c", 26.0, "b", 0.0), ("c", 66.0, ":b", 5.0)]
    assert used(*served)["V2"]["cycle_failures"] == 0  # it came when the green had begun


def test_the_figures_of_the_run_are_shares_over_all_groups_for_vehicles() -> None:
    table = signal_use(
        [LIGHT], states(), end=70.0, ways=WAYS,
        rows=rows(("c", 2.0, "b", 0.0), ("c", 66.0, ":b", 5.0)),
    )  # fmt: skip
    data = RunData(signals=table)
    assert data.has(Basis.SIGNALS)
    failures, unused = (run_figure(name) for name in ("cycle_failures", "unused_green"))
    assert failures is not None
    assert unused is not None
    assert failures.compute(data) == pytest.approx(1 / 4)
    assert unused.compute(data) == pytest.approx((17.0 + 17.0 + 7.0 + 1.0) / 55.0)


def test_without_lights_there_are_no_such_figures() -> None:
    assert not RunData().has(Basis.SIGNALS)
