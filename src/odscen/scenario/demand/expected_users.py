"""How many road users a scenario will have, counted before any of them is made."""

from __future__ import annotations

import math
import os
from typing import TYPE_CHECKING, Final

from odscen.base.errors import InputError, LimitError, NotFoundError
from odscen.scenario.demand.day_profiles import curve

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from odscen.scenario.document.scenario_document import Demand, Scenario

VARIABLE: Final = "ODSCEN_MOST_ROAD_USERS"
MOST_ROAD_USERS: Final = 300_000
"""Of one run. Each takes 4.5 kB and 0.14 ms until its run begins: 1.4 GB and 40 s of them."""
_PARTS: Final = 3
"""Of those that put most on the road, so many are named."""


def expected_users(scenario: Scenario, *, until: float) -> dict[str, float]:
    """How many road users each part of a scenario puts on the road, on average, by its name.

    Background traffic that keeps a number of vehicles on the road is not among them, as that
    depends on the map: :func:`refuse_too_many` is asked again where it is drawn.

    Parameters
    ----------
    until
        Seconds at which the run ends. Matrices are drawn whole, whenever it ends.
    """
    found: dict[str, float] = {}
    for place, name, number in _count_parts(scenario, until):
        found[f"{place} {name!r}"] = found.get(f"{place} {name!r}", 0.0) + max(number, 0.0)
    if scenario.actors:
        found["actors"] = len(scenario.actors)
    return found


def _count_parts(scenario: Scenario, until: float) -> Iterator[tuple[str, str, float]]:
    """Yield kind, id and number of each part."""
    demand = scenario.demand
    for flow in scenario.flows:
        span = _weighed_seconds(demand, flow.profile, flow.begin, min(flow.end, until))
        yield "flow", flow.id, flow.per_hour * span / 3600.0
    for line in scenario.transit.lines:
        end = min(scenario.simulation.duration if line.end is None else line.end, until)
        trips = len(line.departures)
        if line.headway is not None:
            trips = max(0, math.ceil((end - line.begin) / line.headway))
        yield "line", line.id, trips
    for part in demand.inputs:
        end = scenario.simulation.duration if part.end is None else part.end
        number = sum(part.volumes)
        if part.per_hour is not None:
            number = (
                part.per_hour * _weighed_seconds(demand, part.profile, part.begin, end) / 3600.0
            )
        yield "vehicle input", part.id, number
    for matrix in demand.matrices:
        yield "matrix", matrix.id, sum(number for _, _, number in matrix.trips)
    for background in demand.background:
        yield "background traffic", background.id, background.trips or 0.0
    for counts in demand.counts:
        if counts.use == "generate":
            yield "counts", counts.id, sum(number for *_, number in counts.rows)


def _weighed_seconds(demand: Demand, profile: str | None, begin: float, end: float) -> float:
    """Seconds between two times, weighed by a day profile; those of an unknown one are even."""
    if end <= begin:
        return 0.0
    try:
        day = curve(demand, profile)
    except NotFoundError:  # which is said elsewhere
        return end - begin
    return day.amount(end) - day.amount(begin)


def most_road_users() -> int:
    """The limit: of the environment, or else :data:`MOST_ROAD_USERS`.

    Raises
    ------
    InputError
        If the environment says something else than a number.
    """
    setting = os.environ.get(VARIABLE)
    if not setting:
        return MOST_ROAD_USERS
    if not setting.isascii() or not setting.isdigit():
        raise InputError(f"{VARIABLE} is {setting!r}, which is no whole number")
    return int(setting)


def refuse_too_many(expected: Mapping[str, float]) -> None:
    """Refuse to make more road users than there may be, and name the parts with most of them.

    Raises
    ------
    LimitError
        With their number, and how to allow them.
    """
    total, most = sum(expected.values()), most_road_users()
    if total <= most:
        return
    parts = sorted(expected.items(), key=lambda part: -part[1])[:_PARTS]
    listed = ", ".join(f"{number:,.0f} by {name}" for name, number in parts)
    raise LimitError(
        f"this makes about {total:,.0f} road users ({listed}); the limit of a run is {most:,}. "
        f"Make it shorter, or allow more with {VARIABLE}"
    )
