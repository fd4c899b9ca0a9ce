from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from odscen.base.errors import InputError
from odscen.experiments.baseline import Baseline, read_baseline, seeds_that_hardly_vary
from odscen.experiments.measure import FigureKey

ROWS: list[dict[str, Any]] = [{"figure": "mean_delay", "values": [1.5, None]}]


def written(folder: Path, **changed: object) -> Path:
    data = {
        "format": "odscen-baseline",
        "version": 1,
        "scenario": "x",
        "fingerprint": {"map": "0"},
        "seeds": [1, 2],
        "rows": ROWS,
        **changed,
    }
    file = folder / "x.json"
    file.write_text(json.dumps(data), encoding="utf-8")
    return file


def test_a_baseline_is_read_by_figure_and_seed(tmp_path: Path) -> None:
    baseline = read_baseline(written(tmp_path))
    assert baseline is not None
    assert baseline.seeds == (1, 2)
    assert list(baseline.figures.values()) == [(1.5, None)]


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"rows": [{"street": "r1", "flow": [1, 2]}]}, "row .* is of no figure, segment, junction"),
        ({"rows": [{"figure": "mean_delay"}]}, "'values' is missing"),
        ({"rows": [{"figure": "mean_delay", "values": [1]}]}, "1 values for 2 seeds"),
        ({"rows": [{"figure": "mean_delay", "values": [int("9" * 400), 1]}]}, "infinity"),
        ({"rows": [{"figure": ["mean_delay"], "values": [1, 2]}]}, "is not a text"),
        ({"rows": [{"figure": 3.0, "values": [1, 2]}]}, "3.0 is not a text"),
        ({"rows": [{"segment": [], "flow": [1, 2]}]}, "is not a text"),
        ({"rows": [[]]}, "row .* is of no figure"),
        ({"rows": [7]}, "not iterable"),
        ({"rows": None}, "not iterable"),
        ({"fingerprint": 3}, "not iterable"),
        ({"fingerprint": {"map": 3}}, "3 is not a text"),
        ({"seeds": ["one"]}, "invalid literal"),
        ({"version": 2}, "version 2 is not a baseline"),
    ],
)
def test_a_damaged_baseline_is_refused_with_its_file(
    tmp_path: Path, changed: dict[str, Any], words: str
) -> None:
    file = written(tmp_path, **changed)
    with pytest.raises(InputError, match=words) as refused:
        read_baseline(file)
    assert refused.value.file == str(file)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[" * 100_000, "not a baseline: depth limit exceeded"),
        ('{"format": ' + "9" * 5000 + "}", "not a baseline"),
        ("null", "not a baseline"),
    ],
    ids=["brackets", "digits", "null"],
)
def test_what_is_no_baseline_is_refused_with_its_file(
    tmp_path: Path, text: str, words: str
) -> None:
    file = tmp_path / "x.json"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=words) as refused:
        read_baseline(file)
    assert refused.value.file == str(file)


def of_travel_times(*values: float | None) -> Baseline:
    key = FigureKey("run", "", "mean_travel_time")
    return Baseline(tuple(range(len(values))), {}, {key: values})


def test_seeds_that_hardly_vary_are_warned_of_with_their_range() -> None:
    (words,) = seeds_that_hardly_vary(of_travel_times(107.44, 107.35, 107.31))
    assert words.startswith("the seeds hardly vary: mean_travel_time is 107.31 to 107.44 s")


def test_seeds_that_vary_and_single_runs_are_not_warned_of() -> None:
    assert seeds_that_hardly_vary(of_travel_times(44.84, 45.16, 39.11)) == ()
    assert seeds_that_hardly_vary(of_travel_times(44.84)) == ()
    assert seeds_that_hardly_vary(of_travel_times(None, None)) == ()
