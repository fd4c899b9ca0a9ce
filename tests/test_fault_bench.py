"""The fault bench itself: the same seed, the same damage; and what counts as a failure."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from bench.fuzz.damage import changes_for, damaged
from bench.fuzz.limits import Ended
from bench.fuzz.map_damage import MAP
from bench.fuzz.verdicts import Verdict, judge, left_over, listing
from tests.opendrive.full import FULL

FILES = {
    "a.xodr": FULL.encode(),
    "a.json": json.dumps({"a": [1, 2.5, {"b": "c"}]}).encode(),
    "a.csv": b"from,to,trips\nr1,r2,3\n",
    "a.toml": b"a = 1\n",
    "a.parquet": bytes(range(256)),
}


@pytest.mark.parametrize("name", sorted(FILES))
def test_damage_follows_from_the_seed_alone(name: str) -> None:
    changes = MAP if name == "a.xodr" else changes_for(name)

    def made(seed: int) -> list[bytes]:
        rng = np.random.default_rng(seed)
        return [damaged(FILES[name], rng, changes).data for _ in range(40)]

    assert made(1) == made(1)
    assert made(1) != made(2)
    assert len(set(made(1))) > 15


@pytest.mark.parametrize(
    ("code", "err", "verdict"),
    [
        (0, "", Verdict.FINE),
        (2, "error: a.xodr: road 1: no length", Verdict.REFUSED),
        (2, "", Verdict.UNCLEAR),
        (2, "error: not XML (<string>, line 1)", Verdict.UNCLEAR),
        (2, "error: road '\u202e1'", Verdict.UNCLEAR),
        (0, "x.py:1: RuntimeWarning: overflow", Verdict.WARNING),
        (1, "Traceback (most recent call last):\nKeyError: 'a'", Verdict.TRACEBACK),
        (-11, "", Verdict.CRASH),
    ],
)
def test_how_a_command_ends_is_judged_by_its_code_and_words(
    code: int, err: str, verdict: Verdict
) -> None:
    found = judge(Ended(("check",), code, "", err, 0.1, 0)).verdict
    assert found is verdict
    assert found.failed == verdict.value.isupper()


def test_a_refused_command_leaves_everything_as_it_was(tmp_path: Path) -> None:
    kept = tmp_path / "kept"
    kept.write_text("a")
    before = listing([tmp_path])
    assert left_over(before, listing([tmp_path]), refused=True) == ""
    (tmp_path / "run.lock").touch()
    assert left_over(before, listing([tmp_path]), refused=True) == ""
    (tmp_path / "half").touch()
    assert left_over(before, listing([tmp_path]), refused=False) == ""
    assert left_over(before, listing([tmp_path]), refused=True) == f"left {tmp_path / 'half'}"
    (tmp_path / ".building-x").mkdir()
    assert left_over(before, listing([tmp_path]), refused=False).endswith(".building-x")
