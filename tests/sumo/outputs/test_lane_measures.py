from __future__ import annotations

from pathlib import Path

import polars as pl

from odscen.sumo.outputs.lane_measures import lane_table

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
