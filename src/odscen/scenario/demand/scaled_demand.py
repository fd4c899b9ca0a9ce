"""Demand made larger or smaller, and the busiest part of a scenario."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

from odscen.scenario.demand.day_profiles import DAY, curve
from odscen.scenario.demand.trips import window
from odscen.scenario.document.scenario_document import Background, Matrix

if TYPE_CHECKING:
    from odscen.scenario.document.scenario_document import Demand, Scenario

_Part = TypeVar("_Part", Matrix, Background)

HOUR = 3600.0
BEFORE = 1800.0
"""Seconds of the demand before its busiest hour that belong to an excerpt: the roads fill."""
CALM = 600.0
"""Seconds after it without departures: what has built up can dissolve."""
LONG = 10_800.0
"""Seconds of a run above which its busiest hour stands for all of it."""
_MINUTE = 60.0


def scalable(demand: Demand) -> list[str]:
    """Names of the demand whose amount is a choice: matrices and background traffic."""
    return [part.id for part in _demand_parts(demand)]


def scaled(demand: Demand, factor: float, *, only: str | None = None) -> Demand:
    """``factor`` times the matrices and the background traffic, or the one of a name.

    Inputs and counts were counted, and stay.
    """

    def wanted(part: Matrix | Background) -> bool:
        return only in (None, part.id)

    matrices = (
        _with_trips(matrix, factor) if wanted(matrix) else matrix for matrix in demand.matrices
    )
    background = (
        _with_amount(part, factor) if wanted(part) else part for part in demand.background
    )
    return demand.model_copy(update={"matrices": tuple(matrices), "background": tuple(background)})


def trips_of(demand: Demand) -> float:
    """Trips of the matrices and of the background traffic that is a number of trips."""
    return sum(_number_of_trips(part) for part in _demand_parts(demand))


def busiest_hour(scenario: Scenario) -> tuple[float, float]:
    """Begin and end of the hour with most departures of matrices and background traffic, seconds.

    Background traffic that is an amount on the road counts where there is nothing else.
    """
    parts = _demand_parts(scenario.demand)
    numbers = [_number_of_trips(part) or float(not trips_of(scenario.demand)) for part in parts]
    last = max(scenario.simulation.duration - HOUR, 0.0)

    def departures(begin: float) -> float:
        each = zip(parts, numbers, strict=True)
        return sum(n * _share_between(scenario, part, begin, begin + HOUR) for part, n in each)

    begins = [_MINUTE * minute for minute in range(int(last / _MINUTE) + 1)]
    begin = max(begins, key=lambda begin: (round(departures(begin), 6), -begin))
    return begin, min(begin + HOUR, scenario.simulation.duration)


def part_trips(scenario: Scenario, part: Background, *, per_hour: float) -> float:
    """Trips of background traffic of which ``per_hour`` come in its busiest hour."""
    demand = scenario.demand.model_copy(update={"matrices": (), "background": (part,)})
    begin, end = busiest_hour(scenario.model_copy(update={"demand": demand}))
    share = _share_between(scenario, part, begin, end)
    return per_hour * (end - begin) / HOUR / share if share else 0.0


def excerpt(scenario: Scenario) -> Scenario:
    """Cut the busiest hour of a long run out, with half an hour before and a calm after it.

    A run of up to :data:`LONG` stays whole, and so does one whose traffic is more than matrices and
    background: actors, flows, rules, measures and lines have their own times.
    """
    demand = scenario.demand
    others = (
        *scenario.actors,
        *scenario.flows,
        *scenario.rules,
        *scenario.measures,
        *scenario.transit.lines,
        *demand.inputs,
        *demand.counts,
    )
    if scenario.simulation.duration <= LONG or others:
        return scenario
    begin, end = busiest_hour(scenario)
    begin = max(begin - BEFORE, 0.0)
    matrices = (_cut_part(scenario, matrix, begin, end) for matrix in demand.matrices)
    background = (_cut_part(scenario, part, begin, end) for part in demand.background)
    length = end - begin + CALM
    return scenario.model_copy(
        update={
            "simulation": scenario.simulation.model_copy(update={"duration": length}),
            "demand": demand.model_copy(
                update={
                    "clock": (demand.clock + begin) % DAY,
                    "matrices": tuple(matrix for matrix in matrices if matrix is not None),
                    "background": tuple(part for part in background if part is not None),
                }
            ),
        }
    )


def _cut_part(scenario: Scenario, part: _Part, begin: float, end: float) -> _Part | None:
    """What of a part of the demand comes between two times, as of a run that begins then."""
    own = window(scenario, part)
    first, last = max(own[0], begin), min(own[1], end)
    if first >= last:
        return None
    fewer = _with_trips(part, _share_between(scenario, part, first, last))
    return fewer.model_copy(update={"begin": first - begin, "end": last - begin})


def _share_between(
    scenario: Scenario, part: Matrix | Background, begin: float, end: float
) -> float:
    """Share of a part of the demand that comes between two times."""
    first, last = window(scenario, part)
    passed = curve(scenario.demand, part.profile).amount
    low, high = (min(max(time, first), last) for time in (begin, end))
    whole = passed(last) - passed(first)
    if whole > 0:
        return (passed(high) - passed(low)) / whole
    return (high - low) / (last - first) if last > first else 0.0  # evenly, see Curve.draw


def _demand_parts(demand: Demand) -> list[Matrix | Background]:
    return [*demand.matrices, *demand.background]


def _number_of_trips(part: Matrix | Background) -> float:
    """Trips of a part; 0 of background traffic that is an amount on the road."""
    if isinstance(part, Matrix):
        return sum(row[2] for row in part.trips)
    return part.trips or 0.0


def _with_trips(part: _Part, factor: float) -> _Part:
    """Return a part with so many times its trips; an amount on the road stays."""
    if isinstance(part, Matrix):
        rows = tuple((one, other, round(factor * n, 4)) for one, other, n in part.trips)
        return part.model_copy(update={"trips": rows})
    if part.trips is None:
        return part
    return part.model_copy(update={"trips": max(round(factor * part.trips, 4), 1e-4)})


def _with_amount(part: Background, factor: float) -> Background:
    part = _with_trips(part, factor)
    standing = {
        "fill": None if part.fill is None else min(round(factor * part.fill, 6), 1.0),
        "per_km": None if part.per_km is None else round(factor * part.per_km, 6),
    }
    return part.model_copy(update=standing)
