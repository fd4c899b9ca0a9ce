"""Methods of search: the same seed asks the same, and TPE goes where it was told that it is bad."""

from __future__ import annotations

import pickle
import sys
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from odscen.base.errors import InputError, MissingDependencyError
from odscen.scenario.sweeps.sweep_plan import Proposer, Range, SweepPlan, proposal_kind

if TYPE_CHECKING:
    from pathlib import Path


def proposer_of(method: str, *, axes: int, runs: int, seed: int) -> Proposer:
    varied = tuple(Range(f"p{axis}", 0.0, 1.0) for axis in range(axes))
    return proposal_kind(method).start(SweepPlan(varied, method, runs, seed))


def places_of(method: str, *, seed: int = 3, runs: int = 40) -> np.ndarray:
    """Places that are asked when (0.8, 0.2) is the worst."""
    proposer = proposer_of(method, axes=2, runs=runs, seed=seed)
    found = []
    for _ in range(runs // 4):
        places = proposer.ask(4)
        proposer.tell([-float(np.hypot(*(place - [0.8, 0.2]))) for place in places])
        found.append(places)
    return np.concatenate(found)


def test_a_latin_hypercube_has_one_case_in_each_part_of_each_range() -> None:
    places = places_of("latin")
    for axis in places.T:
        assert sorted((axis * 40).astype(int)) == list(range(40))


def test_the_same_seed_asks_the_same_and_another_does_not() -> None:
    for method in ("random", "latin"):
        np.testing.assert_array_equal(places_of(method), places_of(method))
        assert not np.array_equal(places_of(method), places_of(method, seed=4))


def test_tpe_asks_again_the_same_and_looks_where_it_is_bad() -> None:
    pytest.importorskip("optuna")
    places = places_of("tpe")
    np.testing.assert_array_equal(places, places_of("tpe"))
    away = np.hypot(*(places - [0.8, 0.2]).T)
    assert np.median(away[20:]) < 0.5 * np.median(away[:10])


def test_tpe_goes_on_after_cases_that_are_not_possible() -> None:
    pytest.importorskip("optuna")
    proposer = proposer_of("tpe", axes=1, runs=4, seed=0)
    proposer.ask(2)
    proposer.tell([None, 1.0])
    assert proposer.ask(2).shape == (2, 1)


def test_without_optuna_tpe_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "optuna", None)
    with pytest.raises(MissingDependencyError, match=r"odscen\[search\]"):
        proposer_of("tpe", axes=1, runs=1, seed=0)


def test_an_unknown_method_is_refused_by_name() -> None:
    with pytest.raises(InputError, match="'best' is not one of grid, latin, sobol, random, tpe"):
        proposer_of("best", axes=1, runs=1, seed=0)


def test_tpe_reads_nothing_that_is_stored_and_unpickles_nothing(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """What optuna keeps in files and databases has pickles in it."""
    pytest.importorskip("optuna")
    proposer: Any = proposer_of("tpe", axes=2, runs=30, seed=0)

    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("something was unpickled")

    for name in ("load", "loads", "Unpickler"):
        monkeypatch.setattr(pickle, name, refuse)
    monkeypatch.chdir(tmp_path)
    for _ in range(6):
        proposer.tell([float(place[0]) for place in proposer.ask(4)])
    assert type(proposer._study._storage).__name__ == "InMemoryStorage"
    assert list(tmp_path.iterdir()) == []
