"""Tables that are read in parts give what they give at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import polars as pl
import pytest
from polars.testing import assert_frame_equal

from odscen.app.exchange.recorded_traffic import read_recorded_traffic
from odscen.base.errors import InputError
from odscen.formats.tracks import table_schemas
from tests.formats.tracks.test_track_readers import HIGHD, IND, INTERACTION, NGSIM, PEDESTRIANS

if TYPE_CHECKING:
    from pathlib import Path

BESIDE = {"pedestrian_tracks_000.csv": PEDESTRIANS, "vehicle_tracks_000.csv": INTERACTION}


@pytest.fixture
def in_parts(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """Any table is large, and each road user a part."""
    monkeypatch.setattr(table_schemas, "LARGE_TABLE", 0)
    monkeypatch.setattr(table_schemas, "_ROWS_OF_PART", 1)
    return monkeypatch


def write_files(folder: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder / list(files)[-1]


@pytest.mark.parametrize(
    ("files", "users"),
    [
        (HIGHD, 2),
        (IND, 2),
        ({"ngsim.csv": NGSIM}, 2),
        (BESIDE, 3),
        ({"own.csv": "time,x,y\n0,0,0\n0.1,1,0\n"}, 1),
        ({"own.csv": "time,x,y,id\n0,0,0,b\n0,0,0,a\n0,0,0,b\n0.1,1,0,b\n0.1,1,0,a\n"}, 2),
    ],
)
def test_a_large_table_gives_the_same_tracks_in_parts(
    files: dict[str, str], users: int, tmp_path: Path, in_parts: pytest.MonkeyPatch
) -> None:
    path = write_files(tmp_path, files)
    parts = read_recorded_traffic(path)
    in_parts.undo()
    whole = read_recorded_traffic(path)
    assert whole.rows["id"].n_unique() == users
    assert_frame_equal(parts.rows, whole.rows)
    assert (parts.step, parts.notes, parts.unused) == (whole.step, whole.notes, whole.unused)
    assert parts.summary() == whole.summary()


def test_tracks_that_lie_anyhow_in_a_large_table_are_sorted(
    tmp_path: Path, in_parts: pytest.MonkeyPatch
) -> None:
    in_parts.setattr(table_schemas, "_ROWS_OF_PART", 700)
    rng = np.random.default_rng(3)
    rows = pl.DataFrame({"id": np.repeat(np.arange(40), 60), "time": np.tile(np.arange(60), 40)})
    rows = rows.with_columns(pl.col("time") / 10.0, x=rng.uniform(0, 9, 2400), y=pl.lit(0.0))
    rows.sample(fraction=1.0, shuffle=True, seed=1).write_csv(tmp_path / "mixed.csv")
    read = read_recorded_traffic(tmp_path / "mixed.csv").rows
    expected = rows.with_columns(pl.col("id").cast(pl.String)).sort("id", "time")
    assert_frame_equal(read.select("id", "time", "x", "y"), expected)


@pytest.mark.parametrize(
    ("files", "words"),
    [
        ({"a.csv": "time,x,y,id\n0,0,0,a\n0,1,0,\n"}, r"road user at 0\.0 s: it has no id"),
        ({"a.csv": "time,x,y,id\n0,0,0,a\n0,z,0,b\n"}, "line 3 > column x: 'z' is not a number"),
        ({"a.csv": "time,x,y,id\n0,0,0,b\n0,1,0,b\n"}, r"it is at \(0, 0\) and at \(1, 0\)"),
        (
            BESIDE | {"vehicle_tracks_000.csv": INTERACTION.replace("\n1,", "\nP1,")},
            r"pedestrian_tracks_000\.csv: road user P1: it is in both files",
        ),
    ],
)
def test_what_is_wrong_in_a_large_table_names_its_place(
    files: dict[str, str], words: str, tmp_path: Path, in_parts: pytest.MonkeyPatch
) -> None:
    path = write_files(tmp_path, files)
    with pytest.raises(InputError, match=words):
        read_recorded_traffic(path)
    in_parts.undo()
