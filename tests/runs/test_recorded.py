"""Trajectories of a run folder, kept in memory or scanned."""

from __future__ import annotations

from typing import TYPE_CHECKING

import polars as pl
import pytest

from odscen.runs import recorded

if TYPE_CHECKING:
    from pathlib import Path


@pytest.mark.parametrize("in_memory", [0, recorded.IN_MEMORY])
def test_trajectories_are_the_same_in_memory_and_scanned(tmp_path: Path, monkeypatch, in_memory):
    monkeypatch.setattr(recorded, "IN_MEMORY", in_memory)
    assert recorded.scan_trajectories(tmp_path) is None
    parts = tmp_path / "trajectories"
    parts.mkdir()
    rows = pl.DataFrame({"timestep_time": [0.0, 0.5, 1.0], "vehicle_id": ["a", "a", "b"]})
    rows[:2].write_parquet(parts / "part-001.parquet")
    rows[2:].write_parquet(parts / "part-002.parquet")
    found = recorded.scan_trajectories(tmp_path)
    assert found is not None
    assert found.collect().equals(rows)
    assert ("DF" in found.explain()) is bool(in_memory)
