"""``odscen learn`` on the command line."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.conftest import odscen


def test_a_folder_without_snapshots_is_named(workspace: Path, tmp_path: Path) -> None:
    found = odscen("learn", "evaluate", "--data", tmp_path, "--workspace", workspace, "--json")
    assert found.code == 2
    assert str(tmp_path) in found.err
    assert "odscen learn data" in found.err


@pytest.mark.slow
def test_evaluating_one_town_counts_binned_statistics_in_the_other(
    workspace: Path, tmp_path: Path
) -> None:
    """The one has lanes for kinds that were never seen in the other, and hardly any queue."""
    data = ("--data", tmp_path, "--workspace", workspace)
    towns = ("signal_crossing", "t_junction_signs")
    maps = [word for town in towns for word in ("--map", town)]
    made = odscen(
        "learn", "data", *maps, "--out", tmp_path, "--runs", 2, "--until", 60, "--workspace",
        workspace, "--json",
    )  # fmt: skip
    assert [run["skipped"] for run in made.json["runs"]] == [None] * 4
    for town in towns:
        done = odscen("learn", "evaluate", "--no-run", "--town", town, *data, "--json")
        assert (done.code, "Warning" in done.err) == (0, False), done.err
        by_source = {one["source"]: one for one in done.json["maps"]}
        assert set(by_source) == {"SUMO", "reference", "binned statistics", "random fill"}
        binned = by_source["binned statistics"]
        assert (binned["map_name"], binned["vehicles"] > 1.0) == (town, True)
        assert 0.0 < binned["values"]["frechet"]["value"] < 100.0
        assert binned["values"]["novelty"]["low"] is None
