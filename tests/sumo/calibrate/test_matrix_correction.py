"""Matrices corrected by counts: the arithmetic, and a whole crossing."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest
from scipy import sparse

from odscen.base.errors import InputError
from odscen.scenario.demand.count_stations import Observation
from odscen.scenario.document.scenario_document import MapReference, Scenario
from odscen.sumo.calibrate.matrix_correction import (
    MatrixCell,
    PairPassages,
    corrected,
    least_squares,
    pair_passages,
    prior_cells,
    share_matrix,
    whole_trips,
)
from tests.sumo.runner.test_on_maps import built

CROSSING = "signal_crossing"


def scenario(*, counts: list[list[Any]], trips: list[list[Any]], **matrix: Any) -> Scenario:
    graph = built(CROSSING).sumo.graph
    place = MapReference(name=graph.map_name, sha256=graph.map_sha256, spacing=graph.lanes.spacing)
    demand = {
        "matrices": [{"id": "m", "end": 1800.0, "trips": trips, **matrix}],
        "counts": [{"id": "c", "use": "compare", "rows": counts}] if counts else [],
    }
    return Scenario.model_validate(
        {
            "name": "test",
            "map": place,
            "roi": tuple(map(str, graph.segments.ids)),
            "demand": demand,
            "simulation": {"duration": 1800.0},
        }
    )


def test_a_passage_is_shared_by_the_slices_that_it_falls_into() -> None:
    """All of 900 s depart evenly and pass 90 s later: a tenth in the next slice."""
    cells = [MatrixCell(0, ("a", "b"), 0.0, 900.0, 10.0)]
    seen = [Observation("c", "x", 0.0, 900.0, 9.0), Observation("c", "x", 900.0, 1800.0, 1.0)]
    passages = {("a", "b"): PairPassages(2, (("x", 90.0),))}  # one of two trips passes
    shares = share_matrix(cells, seen, passages).toarray()
    assert shares == pytest.approx(np.array([[0.45], [0.05]]))


def test_without_counts_that_differ_the_prior_stays() -> None:
    shares = sparse.csr_array(np.array([[1.0, 1.0]]))
    prior = np.array([30.0, 10.0])
    counted = np.array([40.0])
    found = least_squares(shares, counted, counted, prior, trust=0.1)
    assert found == pytest.approx(prior, abs=1e-6)


def test_least_squares_weighs_counts_against_the_prior_as_the_formula_says() -> None:
    """One cell: (x - c)^2 / c + t (x - q)^2 / q is least at (1 + t) / (1 / c + t / q)."""
    shares = sparse.csr_array(np.array([[1.0]]))
    found = least_squares(shares, np.array([80.0]), np.array([80.0]), np.array([40.0]), trust=0.5)
    assert found[0] == pytest.approx(1.5 / (1 / 80 + 0.5 / 40), rel=1e-4)


def test_no_cell_becomes_negative() -> None:
    shares = sparse.csr_array(np.array([[1.0, 0.0], [1.0, 1.0]]))
    counted = np.array([50.0, 20.0])
    found = least_squares(shares, counted, counted, np.array([20.0, 20.0]), trust=1e-6)
    assert (found >= 0.0).all()
    assert found[1] == pytest.approx(0.0, abs=0.1)


def test_whole_trips_keep_the_sum_of_a_slice() -> None:
    cells = [MatrixCell(0, ("a", str(k)), 0.0, 900.0, 0.3) for k in range(10)]
    trips = whole_trips(cells, np.full(10, 0.3))
    assert trips.sum() == 3.0
    assert set(trips.tolist()) == {0.0, 1.0}


def test_a_matrix_is_split_into_the_slices_of_the_counts_by_its_profile() -> None:
    graph = built(CROSSING).sumo.graph
    one, other = sorted(str(name) for name in graph.segments.ids if str(name).startswith("r"))[:2]
    rows = [[one, 0.0, 900.0, 5.0], [one, 900.0, 1800.0, 5.0]]
    cells = prior_cells(scenario(counts=rows, trips=[[one, other, 30.0]]))
    assert [(cell.begin, cell.end, cell.prior) for cell in cells] == [
        (0.0, 900.0, 15.0),
        (900.0, 1800.0, 15.0),
    ]


def test_a_turn_that_was_counted_twice_as_often_gets_twice_the_trips() -> None:
    sumo_map = built(CROSSING).sumo
    graph = sumo_map.graph
    one, other, third = sorted(
        str(name) for name in graph.segments.ids if str(name).startswith("r")
    )[:3]
    (junction,) = (str(name) for name in graph.segments.ids if str(name).startswith("j"))
    turn = f"{one}>{junction}>{other}"
    rows = [[turn, begin, begin + 900.0, 100.0] for begin in (0.0, 900.0)]
    prior = scenario(counts=rows, trips=[[one, other, 100.0], [one, third, 60.0]])
    found = corrected(prior, sumo_map, pair_passages(prior, sumo_map), trust=0.01)
    assert found.before.share_met == 0.0
    assert found.after.share_met == 1.0
    assert [one.id for one in found.scenario.demand.matrices] == ["m-1", "m-2"]
    trips: Counter[tuple[str, str]] = Counter()
    for matrix in found.scenario.demand.matrices:
        trips.update({(a, b): int(number) for a, b, number in matrix.trips})
    assert 185 <= trips[one, other] <= 205
    assert trips[one, third] == pytest.approx(60.0, abs=1)
    assert found.scenario.demand.counts[0].use == "compare"


def test_a_place_that_no_trip_passes_is_named() -> None:
    sumo_map = built(CROSSING).sumo
    graph = sumo_map.graph
    one, other, third = sorted(
        str(name) for name in graph.segments.ids if str(name).startswith("r")
    )[:3]
    (junction,) = (str(name) for name in graph.segments.ids if str(name).startswith("j"))
    place = f"{third}>{junction}>{one}"
    prior = scenario(counts=[[place, 0.0, 900.0, 100.0]], trips=[[one, other, 100.0]])
    found = corrected(prior, sumo_map, pair_passages(prior, sumo_map))
    (row,) = found.after.rows
    assert row.why == "no trip of the matrix passes here at that time"


def test_without_counts_or_with_uneven_slices_it_is_refused() -> None:
    sumo_map = built(CROSSING).sumo
    one, other = sorted(
        str(name) for name in sumo_map.graph.segments.ids if str(name).startswith("r")
    )[:2]
    with pytest.raises(InputError, match="no counts"):
        corrected(scenario(counts=[], trips=[[one, other, 1.0]]), sumo_map, {})
    uneven = [[one, 0.0, 900.0, 1.0], [one, 900.0, 1200.0, 1.0]]
    with pytest.raises(InputError, match="300, 900 s long"):
        corrected(scenario(counts=uneven, trips=[[one, other, 1.0]]), sumo_map, {})
