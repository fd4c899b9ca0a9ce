from __future__ import annotations

from pathlib import Path

import polars as pl

from odscen.sumo.outputs.output_tables import lane_table

MEASURES = (
    "sampledSeconds", "traveltime", "density", "waitingTime", "timeLoss", "speed",
    "departed", "arrived", "entered", "left", "distance",
)  # fmt: skip


def test_a_sidewalk_that_a_teleported_vehicle_was_led_over_is_left_out(tmp_path: Path) -> None:
    rows = [
        {"interval_begin": 0.0, "interval_end": 30.0, "interval_id": "lanes", "edge_id": "a"}
        | {"lane_id": lane}
        | {f"lane_{name}": 1.0 for name in MEASURES}
        for lane in ("a_0", "a_1")
    ]
    pl.DataFrame(rows).write_parquet(tmp_path / "lanes.parquet")
    table = lane_table(tmp_path / "lanes.parquet", None, {"a": {"a_1": 50.0}})
    assert table["lane"].to_list() == ["a_1"]


def test_who_was_there_when_a_state_was_loaded_has_not_entered_in_the_first_interval(
    tmp_path: Path,
) -> None:
    rows = [
        {"interval_begin": begin, "interval_end": begin + 30.0, "interval_id": "lanes"}
        | {"edge_id": lane[0], "lane_id": lane}
        | {f"lane_{name}": 1.0 for name in MEASURES}
        | {"lane_entered": 3.0}
        for begin in (30.0, 60.0)
        for lane in ("a_0", "b_0")
    ]
    pl.DataFrame(rows).write_parquet(tmp_path / "lanes.parquet")
    lengths = {"a": {"a_0": 50.0}, "b": {"b_0": 50.0}}
    table = lane_table(tmp_path / "lanes.parquet", None, lengths, {"a_0": 2, "c_0": 1})
    entered = table.select("begin", "lane", "entered").rows()
    assert entered == [(30.0, "a_0", 1), (30.0, "b_0", 3), (60.0, "a_0", 3), (60.0, "b_0", 3)]
