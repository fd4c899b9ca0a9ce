"""A matrix corrected by counts: generalised least squares over its cells and slices of time.

Cells are trips ``x`` from one place to another in one slice; ``q`` are those of the prior matrix,
``c`` the counts and ``p`` the share of the trips of a cell that pass a count station in the slice
of the count. Cells of 0 stay 0. What is minimised over ``x >= 0`` is

    sum((p x - c)^2 / max((p x + c) / 2, 1)) + trust * sum((x - q)^2 / q)

(Cascetta 1984, Transportation Research Part B 18(4/5), with variances as those of Poisson numbers);
the first sum is that of the squared GEH statistics of the slices. Its denominators are those of the
solution before, three times: with those of the counts alone too few trips would come out. The
result is rounded to whole trips, so that rows in their order, added up, are right to one trip.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy import sparse
from scipy.optimize import lsq_linear

from odscen.base.categories import Category
from odscen.base.errors import InputError
from odscen.scenario.demand.count_stations import GOOD, StationFinder, geh, observations
from odscen.scenario.demand.day_profiles import curve
from odscen.scenario.demand.trips import SLOWER, window
from odscen.scenario.demand.zones import TripEnds
from odscen.scenario.document.scenario_document import Matrix
from odscen.scenario.placing.region import Region
from odscen.sumo.calibrate.count_fit import CountFit, CountFits, counts_apart
from odscen.sumo.realize.passages import each_passing, planned_passages
from odscen.sumo.realize.realization import all_road_users
from odscen.sumo.realize.route_choice.chosen_paths import RoutesOfDemand
from odscen.sumo.realize.usable import usable_places

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.base.arrays import FloatArray, Int32Array
    from odscen.scenario.demand.count_stations import Observation
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.realize.sumo_map import SumoMap

SAMPLE = 12
"""Trips of each pair of places at least from which shares are estimated, and at most ten times."""
WEIGHINGS = 3
"""Times that the squared differences are weighed anew."""
MOST_ROUNDS = 200
"""Of the solver."""

Pair = tuple[str, str]
"""Origin and destination."""


class PairPassages(NamedTuple):
    """What sampled trips between two places pass: how many trips, and place and seconds of each."""

    trips: int
    passed: tuple[tuple[str, float], ...]


class MatrixCell(NamedTuple):
    """Trips of a row of a matrix (by its number) that depart in a slice, and those of the prior."""

    matrix: int
    pair: Pair
    begin: float
    end: float
    prior: float


@dataclass(frozen=True, slots=True)
class CorrectedMatrix:
    """A scenario whose matrices meet its counts better, and how well.

    Attributes
    ----------
    scenario
        Its matrices are one for each slice, and its counts are compared with.
    before, after
        Counts against the prior and the corrected matrix, as planned.
    trips_before, trips_after
        Of the matrices.
    """

    scenario: Scenario
    before: CountFits
    after: CountFits
    trips_before: float
    trips_after: float


def pair_passages(
    scenario: Scenario,
    sumo_map: SumoMap,
    assigned: Mapping[str, Int32Array] | None = None,
) -> dict[Pair, PairPassages]:
    """Find out which count stations trips of each pair pass, and how long after their departure.

    Parameters
    ----------
    assigned
        Paths of trips that were found by an assignment, by their ids; the others take the route
        that they would begin an assignment with.
    """
    region = Region.of(sumo_map.graph, scenario.roi)
    ground = TripEnds(region, usable_places(sumo_map))
    places = [observation.place for observation in observations(scenario.demand)]
    passing = StationFinder(region.graph, places)
    until = scenario.simulation.duration
    named, sampled = _sample_matrices(scenario)
    users, _ = all_road_users(sampled, sumo_map, region, until=until)
    pairs = {user.id: pair for user in users if (pair := named.get(_row_name(user.id)))}
    trips: dict[Pair, int] = defaultdict(int)
    for pair in pairs.values():
        trips[pair] += 1
    passed: dict[Pair, list[tuple[str, float]]] = defaultdict(list)
    routes = RoutesOfDemand(scenario, region, ground.router)
    mine = [user for user in users if user.id in pairs]
    for user, found in each_passing(
        mine, region, ground.router, passing, routes=routes, assigned=assigned
    ):
        passed[pairs[user.id]] += [
            (passing.places[place], SLOWER * (time - user.depart)) for place, time in found
        ]
    return {pair: PairPassages(number, tuple(passed[pair])) for pair, number in trips.items()}


def corrected(
    scenario: Scenario,
    sumo_map: SumoMap,
    passages: Mapping[Pair, PairPassages],
    *,
    trust: float = 0.1,
) -> CorrectedMatrix:
    """Correct the matrices of a scenario by its counts.

    Parameters
    ----------
    scenario
        With the prior matrices, and counts that are all in slices of one length.
    passages
        From :func:`pair_passages`.
    trust
        How much a trip that the prior does not have weighs against one that counts do not have.

    Raises
    ------
    InputError
        If there is no matrix of vehicles or no count, or slices differ in length.
    """
    seen, cells = observations(scenario.demand), prior_cells(scenario)
    if not seen or not cells:
        what = "counts" if not seen else "matrix of vehicles"
        raise InputError(f"the scenario has no {what} to correct a matrix by")
    others = _count_other_vehicles(scenario, sumo_map, seen)
    shares = share_matrix(cells, seen, passages)
    counted = np.array([observation.counted for observation in seen])
    prior = np.array([cell.prior for cell in cells])
    rest = np.maximum(counted - others, 0.0)
    found = prior
    for _ in range(WEIGHINGS):
        variance = (others + shares @ found + counted) / 2.0
        found = least_squares(shares, rest, variance, prior, trust=trust)
    trips = whole_trips(cells, found)
    apart = counts_apart(scenario, sumo_map)

    def fits(numbers: FloatArray) -> CountFits:
        modelled = others + shares @ numbers
        used = np.asarray(shares.sum(axis=1)) > 0.0
        rows = tuple(
            _fit_of_count(station, number, passable, apart.by_count)
            for station, number, passable in zip(
                seen, modelled.tolist(), used.tolist(), strict=True
            )
        )
        return CountFits("planned", rows, round(float(numbers.sum())), apart.words)

    return CorrectedMatrix(
        _with_trips(scenario, cells, trips),
        fits(prior),
        fits(trips),
        float(prior.sum()),
        float(trips.sum()),
    )


def prior_cells(scenario: Scenario) -> list[MatrixCell]:
    """Split the rows of matrices of vehicles into the slices of the counts.

    Raises
    ------
    InputError
        If slices of the counts differ in length.
    """
    slices = {(row[1], row[2]) for part in scenario.demand.counts for row in part.rows}
    lengths = {round(end - begin, 6) for begin, end in slices}
    if len(lengths) > 1:
        raise InputError(
            f"slices of the counts are {', '.join(f'{length:g}' for length in sorted(lengths))} s "
            "long"
        )
    cells = []
    for index, matrix in enumerate(scenario.demand.matrices):
        if Category.PEDESTRIAN in matrix.mix or not lengths:
            continue
        begin, end = window(scenario, matrix)
        day = curve(scenario.demand, matrix.profile)
        whole = day.amount(end) - day.amount(begin)
        length = min(lengths)
        first = min(slices)[0] % length
        edges = np.arange(first - length * np.ceil((first - begin) / length), end, length)
        cuts = np.unique(np.concatenate([[begin], edges[edges > begin], [end]])).tolist()
        for start, stop in pairwise(cuts):
            part = (day.amount(stop) - day.amount(start)) / whole if whole else 0.0
            if not whole:
                part = (stop - start) / (end - begin)
            cells += [
                MatrixCell(index, (origin, destination), start, stop, number * part)
                for origin, destination, number in matrix.trips
                if number * part > 0.0
            ]
    return cells


def share_matrix(
    cells: Sequence[MatrixCell],
    seen: Sequence[Observation],
    passages: Mapping[Pair, PairPassages],
) -> sparse.csr_array:
    """Share of the trips of each cell that are in each count, shape ``(counts, cells)``.

    Trips depart evenly over the slice of their cell.
    """
    of_place: dict[str, list[int]] = defaultdict(list)
    for row, station in enumerate(seen):
        of_place[station.place].append(row)
    entries: dict[tuple[int, int], float] = defaultdict(float)
    for column, cell in enumerate(cells):
        known = passages.get(cell.pair)
        if known is None or not known.trips:
            continue
        length = cell.end - cell.begin
        for place, lead in known.passed:
            for row in of_place[place]:
                begin = max(seen[row].begin, cell.begin + lead)
                end = min(seen[row].end, cell.end + lead)
                if end > begin:
                    entries[row, column] += (end - begin) / length / known.trips
    rows, columns = zip(*entries, strict=True) if entries else ((), ())
    shape = len(seen), len(cells)
    return sparse.csr_array((list(entries.values()), (list(rows), list(columns))), shape=shape)


def least_squares(
    shares: sparse.csr_array,
    wanted: FloatArray,
    variance: FloatArray,
    prior: FloatArray,
    *,
    trust: float,
) -> FloatArray:
    """Trips of each cell, shape of ``prior``; see the formula of the module.

    Parameters
    ----------
    wanted
        Vehicles that the matrices are to bring to each count, shape ``(counts,)``.
    variance
        What their squared differences are divided by, at least by 1, shape ``(counts,)``.
    """
    exact = sparse.diags_array(1.0 / np.sqrt(np.maximum(variance, 1.0)))
    kept = np.sqrt(trust / prior)
    # In multiples of the prior, so that the solver sees columns alike.
    scaled = sparse.vstack(
        [exact @ shares @ sparse.diags_array(prior), sparse.diags_array(kept * prior)]
    ).tocsr()
    target = np.concatenate([exact @ wanted, kept * prior])
    solution = lsq_linear(
        scaled, target, bounds=(0.0, np.inf), max_iter=MOST_ROUNDS, lsmr_tol="auto"
    )
    return np.asarray(solution.x * prior, dtype=np.float64)


def whole_trips(cells: Sequence[MatrixCell], trips: FloatArray) -> FloatArray:
    """Round to whole numbers so that sums over the cells of a slice are right to one trip."""
    result = np.zeros(len(trips))
    groups: dict[tuple[int, float], list[int]] = defaultdict(list)
    for index, cell in enumerate(cells):
        groups[cell.matrix, cell.begin].append(index)
    for group in groups.values():
        sums = np.round(np.cumsum(trips[group]) + 1e-9)
        result[group] = np.diff(sums, prepend=0.0)
    return result


def with_more_trips(scenario: Scenario) -> Scenario:
    """Give each pair of places of matrices so many trips that routes between them can be seen.

    The first trips of a row are those that it has in the scenario.
    """
    matrices = []
    for matrix in scenario.demand.matrices:
        if Category.PEDESTRIAN in matrix.mix:
            matrices.append(matrix)
            continue
        rows = tuple(
            (a, b, float(np.clip(np.ceil(number), SAMPLE, 10 * SAMPLE)))
            for a, b, number in matrix.trips
        )
        matrices.append(matrix.model_copy(update={"trips": rows}))
    demand = scenario.demand.model_copy(update={"matrices": tuple(matrices)})
    return scenario.model_copy(update={"demand": demand})


def _sample_matrices(scenario: Scenario) -> tuple[dict[str, Pair], Scenario]:
    """Keep the matrices of vehicles, with more trips; which row each name is of."""
    more = with_more_trips(scenario).demand
    matrices = tuple(matrix for matrix in more.matrices if Category.PEDESTRIAN not in matrix.mix)
    named = {f"{matrix.id}.{a}-{b}": (a, b) for matrix in matrices for a, b, _ in matrix.trips}
    demand = more.model_copy(
        update={"matrices": matrices, "inputs": (), "background": (), "counts": ()}
    )
    return named, scenario.model_copy(update={"demand": demand, "actors": (), "flows": ()})


def _row_name(trip: str) -> str:
    return trip.rpartition(".")[0]


def _count_other_vehicles(
    scenario: Scenario, sumo_map: SumoMap, seen: Sequence[Observation]
) -> FloatArray:
    """Vehicles of the rest of the scenario in each count, shape ``(counts,)``."""
    region = Region.of(sumo_map.graph, scenario.roi)
    demand = scenario.demand.model_copy(update={"matrices": (), "counts": ()})
    rest = scenario.model_copy(update={"demand": demand})
    users, _ = all_road_users(rest, sumo_map, region, until=scenario.simulation.duration)
    ground = TripEnds(region, usable_places(sumo_map))
    routes = RoutesOfDemand(rest, region, ground.router)
    passages = planned_passages(users, region, ground.router, seen, routes=routes)
    return np.array(
        [
            float(passages.get((observation.place, observation.begin, observation.end), 0))
            for observation in seen
        ]
    )


def _fit_of_count(
    observation: Observation,
    modelled: float,
    passable: bool,
    apart: Mapping[tuple[str, str, float, float], str],
) -> CountFit:
    value = geh(modelled, observation.counted, observation.end - observation.begin)
    why = ""
    if value > GOOD:
        why = apart.get(
            (observation.counts, observation.place, observation.begin, observation.end), ""
        )
        if not why and not passable:
            why = "no trip of the matrix passes here at that time"
        if not why:
            why = "other counts on the routes past this place, or the prior matrix, oppose it"
    number = round(modelled)
    return CountFit(
        observation.counts,
        observation.place,
        observation.begin,
        observation.end,
        observation.counted,
        number,
        value,
        why,
    )


def _with_trips(scenario: Scenario, cells: Sequence[MatrixCell], trips: FloatArray) -> Scenario:
    """Put one matrix for each slice in the place of each corrected one."""
    rows: dict[int, dict[tuple[float, float], list[tuple[str, str, float]]]]
    rows = defaultdict(lambda: defaultdict(list))
    for cell, number in zip(cells, trips.tolist(), strict=True):
        if number > 0.0:
            rows[cell.matrix][cell.begin, cell.end].append((*cell.pair, number))
    corrected_ones = {cell.matrix for cell in cells}
    matrices: list[Matrix] = []
    for index, matrix in enumerate(scenario.demand.matrices):
        if index not in corrected_ones:
            matrices.append(matrix)
            continue
        matrices += [
            Matrix(
                id=f"{matrix.id}-{number}", begin=when[0], end=when[1], mix=matrix.mix,
                arrivals=matrix.arrivals, trips=tuple(own),
            )
            for number, (when, own) in enumerate(sorted(rows[index].items()), start=1)
        ]  # fmt: skip
    counts = tuple(count.model_copy(update={"use": "compare"}) for count in scenario.demand.counts)
    demand = scenario.demand.model_copy(update={"matrices": tuple(matrices), "counts": counts})
    return scenario.model_copy(update={"demand": demand})
