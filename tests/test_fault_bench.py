"""The fault bench itself: the same seed, the same damage; and what counts as a failure."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path

import numpy as np
import psutil
import pytest

from bench.fuzz.batches import try_batch
from bench.fuzz.damage import changes_for, damaged
from bench.fuzz.limits import Ended, Limits
from bench.fuzz.map_damage import MAP
from bench.fuzz.material import Material
from bench.fuzz.results import wrong_in_document, wrong_in_variant
from bench.fuzz.trials import Trial, trial_rng
from bench.fuzz.verdicts import Verdict, judge, left_over, listing
from odscen.base.errors import InputError
from tests.experiments.study_case import SCENARIO
from tests.opendrive.full import FULL

FILES = {
    "a.xodr": FULL.encode(),
    "a.json": json.dumps({"a": [1, 2.5, {"b": "c"}]}).encode(),
    "a.csv": b"from,to,trips\nr1,r2,3\n",
    "a.toml": b"a = 1\n",
    "a.parquet": bytes(range(256)),
}


@pytest.mark.slow
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


def own_limits() -> Limits:
    """Limits that take no process for a leftover that other tests have started here."""
    return Limits(own={child.pid for child in psutil.Process().children()})


@pytest.mark.slow
def test_a_batch_finds_what_its_trials_find_alone(tmp_path: Path) -> None:
    """Trials of one target in one process end as they do one by one."""
    limits = own_limits()
    material = Material(tmp_path / "material", ())

    def trial(one: Trial) -> str:
        if one.rng.random() < 0.5:
            given = ("--workspace", str(tmp_path))
            one.command("check", str(one.folder / "nowhere.scenario.json"), *given)
        else:
            one.ask("what is wrong", lambda: "nothing is right")
        return "made up"

    seeds = range(1, 9)
    alone = Trial(material, limits, tmp_path / "batch", 1, trial_rng("t", 1))
    alone.folder.mkdir()
    batch = try_batch(alone, "t", trial, seeds)
    found = []
    for seed in seeds:
        folder = tmp_path / f"alone-{seed}"
        folder.mkdir()
        each = Trial(material, limits, folder, seed, trial_rng("t", seed))
        trial(each)
        found.append(each.finding.verdict)
    assert [one.finding.verdict for one in batch] == found
    assert set(found) == {Verdict.REFUSED, Verdict.WRONG}


def test_a_batch_that_dies_is_a_find_of_the_trial_in_which_it_died(tmp_path: Path) -> None:
    def trial(one: Trial) -> str:
        if one.seed == 3:
            os.kill(os.getpid(), signal.SIGKILL)
        return "made up"

    alone = Trial(Material(tmp_path, ()), own_limits(), tmp_path / "batch", 1, trial_rng("t", 1))
    alone.folder.mkdir()
    verdicts = {one.seed: one.finding.verdict for one in try_batch(alone, "t", trial, range(1, 6))}
    assert verdicts == {1: Verdict.FINE, 2: Verdict.FINE, 3: Verdict.CRASH}


@pytest.mark.parametrize("given", ['{"seed": 3, "seed": 4}', '{"seed": "3"}'])
def test_what_a_document_says_is_held_against_what_was_read(tmp_path: Path, given: str) -> None:
    data = json.loads(SCENARIO.read_text(encoding="utf-8"))
    file = tmp_path / "a.scenario.json"
    file.write_text(json.dumps(data), encoding="utf-8")
    assert wrong_in_document(file) == ""
    data.pop("seed")
    file.write_text(given[:-1] + "," + json.dumps(data)[1:], encoding="utf-8")
    with pytest.raises(InputError, match="seed"):
        wrong_in_document(file)


def test_a_variant_has_what_its_edits_say(tmp_path: Path) -> None:
    source, out = tmp_path / "a.scenario.json", tmp_path / "b.scenario.json"
    actors = [{"id": "car-1"}, {"id": "car-2"}]
    source.write_text(json.dumps({"seed": 1, "actors": actors}))
    edits = [{"kind": "set_seed", "seed": 4}, {"kind": "remove_actors", "actors": ["car-1"]}]
    made = {"seed": 4, "actors": actors[1:], "variant": {"edits": edits}}
    for change, words in (
        ({}, ""),
        ({"seed": 1}, "set_seed.seed: 4 became 1"),
        ({"actors": []}, "['car-2'] were not removed, and are gone"),
        ({"actors": actors}, "['car-1'] were removed, and are there"),
        ({"variant": {"edits": edits[:1]}}, "2 edits were taken, and the variant names 1"),
    ):
        out.write_text(json.dumps(made | change))
        assert wrong_in_variant(source, edits, out) == words
