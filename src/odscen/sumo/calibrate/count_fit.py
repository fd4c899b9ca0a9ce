"""How well traffic meets counts: as planned, or as a run had it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.scenario.demand.count_stations import (
    GOOD,
    StationFinder,
    contradictions,
    geh,
    observations,
)
from odscen.scenario.demand.zones import TripEnds
from odscen.scenario.placing.region import Region
from odscen.sumo.realize.counted_traffic import routes_past
from odscen.sumo.realize.passages import planned_passages, seen_passages
from odscen.sumo.realize.realization import all_road_users
from odscen.sumo.realize.route_choice.chosen_paths import RoutesOfDemand
from odscen.sumo.realize.usable import usable_places

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    import polars as pl

    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.realize.sumo_map import SumoMap


_HOUR = 3600.0
_TOGETHER = 1e-6
"""Seconds between two slices that follow each other."""


class CountFit(NamedTuple):
    """One count and what traffic makes of it; ``why`` says why it is not met, where it is not."""

    counts: str
    place: str
    begin: float
    end: float
    counted: float
    modelled: int
    geh: float
    why: str

    @property
    def met(self) -> bool:
        """Whether GEH is good."""
        return self.geh <= GOOD


class HourFit(NamedTuple):
    """The counts of a place over a whole hour from ``begin`` on, and what traffic makes of them."""

    counts: str
    place: str
    begin: float
    counted: float
    modelled: int
    geh: float

    @property
    def met(self) -> bool:
        """Whether GEH is good."""
        return self.geh <= GOOD


@dataclass(frozen=True, slots=True)
class CountFits:
    """All counts of a scenario against traffic.

    Attributes
    ----------
    source
        ``planned`` (routes at free flow) or ``run``.
    vehicles
        How many vehicles there are in all.
    contradictions
        Counts that cannot be right together, in words.
    """

    source: str
    rows: tuple[CountFit, ...]
    vehicles: int
    contradictions: tuple[str, ...]

    @property
    def share_met(self) -> float | None:
        """Share of the counts with a good GEH; ``None`` without counts."""
        return sum(row.met for row in self.rows) / len(self.rows) if self.rows else None

    @property
    def hours(self) -> tuple[HourFit, ...]:
        """Whole hours that are made of shorter slices, for which GEH is defined."""
        groups: dict[tuple[str, str], list[CountFit]] = {}
        for row in self.rows:
            groups.setdefault((row.counts, row.place), []).append(row)
        return tuple(whole_hour for rows in groups.values() for whole_hour in _whole_hours(rows))

    @property
    def hours_met(self) -> float | None:
        """Share of the hours with a good GEH; ``None`` if no hour is made of slices."""
        hours = self.hours
        return sum(hour.met for hour in hours) / len(hours) if hours else None

    @property
    def rmse(self) -> float | None:
        """Root of the mean squared difference, vehicles per slice."""
        if not self.rows:
            return None
        squares = [(row.modelled - row.counted) ** 2 for row in self.rows]
        return math.sqrt(sum(squares) / len(squares))

    def to_dict(self) -> dict[str, Any]:
        """All of it as data."""
        return {
            "source": self.source,
            "counts": len(self.rows),
            "met": sum(row.met for row in self.rows),
            "share_met": self.share_met,
            "hours": len(self.hours),
            "hours_met": self.hours_met,
            "rmse": self.rmse,
            "vehicles": self.vehicles,
            "observations": sum(row.counted for row in self.rows),
            "passages": sum(row.modelled for row in self.rows),
            "contradictions": list(self.contradictions),
            "rows": [{**row._asdict(), "met": row.met} for row in self.rows],
        }


def _whole_hours(rows: Sequence[CountFit]) -> Iterator[HourFit]:
    """Yield hours of one place that slices without gaps between them make up."""
    slices: list[CountFit] = []
    for row in sorted(rows, key=lambda row: row.begin):
        if slices and abs(row.begin - slices[-1].end) > _TOGETHER:
            slices = []
        slices.append(row)
        lasts = row.end - slices[0].begin
        if lasts < _HOUR - _TOGETHER:
            continue
        if len(slices) > 1 and lasts < _HOUR + _TOGETHER:
            counted, modelled = (
                sum(count_fit.counted for count_fit in slices),
                sum(count_fit.modelled for count_fit in slices),
            )
            value = geh(modelled, counted, _HOUR)
            yield HourFit(row.counts, row.place, slices[0].begin, counted, modelled, value)
        slices = []


def planned_fit(scenario: Scenario, sumo_map: SumoMap) -> CountFits:
    """Compare the traffic that a scenario plans, without congestion, with its counts.

    Raises
    ------
    ScenarioError
        With every actor and flow whose spawn or goal is not usable.
    """
    region = Region.of(sumo_map.graph, scenario.roi)
    users, _ = all_road_users(scenario, sumo_map, region, until=scenario.simulation.duration)
    ground = TripEnds(region, usable_places(sumo_map))
    seen = observations(scenario.demand)
    routes = RoutesOfDemand(scenario, region, ground.router)
    passages = planned_passages(users, region, ground.router, seen, routes=routes)
    vehicles = sum(not user.person for user in users)
    return _fit_counts(scenario, sumo_map, passages, source="planned", vehicles=vehicles)


def run_fit(scenario: Scenario, sumo_map: SumoMap, trajectories: pl.LazyFrame) -> CountFits:
    """Hold the traffic of a run against the counts of its scenario."""
    seen = observations(scenario.demand)
    passages, vehicles = seen_passages(trajectories, sumo_map, seen)
    return _fit_counts(scenario, sumo_map, passages, source="run", vehicles=vehicles)


def _fit_counts(
    scenario: Scenario,
    sumo_map: SumoMap,
    passages: Mapping[tuple[str, float, float], int],
    *,
    source: str,
    vehicles: int,
) -> CountFits:
    opposed, problems = counts_apart(scenario, sumo_map)
    passable = _PassablePlaces(scenario, sumo_map)
    rows = []
    for name, place, begin, end, counted in observations(scenario.demand):
        modelled = passages.get((place, begin, end), 0)
        value = geh(modelled, counted, end - begin)
        why = ""
        if value > GOOD:
            why = opposed.get((name, place, begin, end), "")
            if not why and place not in passable:
                why = "no route inside the region passes here"
            if not why:
                why = _explain_difference(modelled, counted, source)
        rows.append(CountFit(name, place, begin, end, counted, modelled, value, why))
    return CountFits(source, tuple(rows), vehicles, problems)


class CountsApart(NamedTuple):
    """Counts that contradict each other: why, by set, place, begin and end; and all in words."""

    by_count: dict[tuple[str, str, float, float], str]
    words: tuple[str, ...]


def counts_apart(scenario: Scenario, sumo_map: SumoMap) -> CountsApart:
    """Find counts of a scenario that cannot be right together."""
    opposed: dict[tuple[str, str, float, float], str] = {}
    problems: list[str] = []
    for part in scenario.demand.counts:
        for contradiction in contradictions(part, sumo_map.graph):
            problems.append(
                f"{contradiction.counts}, {contradiction.begin:g} to {contradiction.end:g} s: "
                f"{contradiction.message}"
            )
            for place in contradiction.places:
                opposed.setdefault(
                    (contradiction.counts, place, contradiction.begin, contradiction.end),
                    contradiction.message,
                )
    return CountsApart(opposed, tuple(problems))


def _explain_difference(modelled: float, counted: float, source: str) -> str:
    if source == "run":
        return "vehicles were late" if modelled < counted else "vehicles of another slice came late"
    if modelled > counted:
        return "other counts, or other traffic of the scenario, bring more"
    return "other counts on the routes past this place allow no more"


class _PassablePlaces:
    """Places that some route inside the region passes; found out when first asked."""

    def __init__(self, scenario: Scenario, sumo_map: SumoMap) -> None:
        self._scenario = scenario
        self._map = sumo_map

    def __contains__(self, place: str) -> bool:
        return place in self._passable_places

    @cached_property
    def _passable_places(self) -> set[str]:
        region = Region.of(self._map.graph, self._scenario.roi)
        ground = TripEnds(region, usable_places(self._map))
        passable_places: set[str] = set()
        for part in self._scenario.demand.counts:
            passing = StationFinder(region.graph, [row[0] for row in part.rows])
            kinds = routes_past(ground, part, passing)
            passable_places.update(passing.places[place] for kind in kinds for place in kind)
        return passable_places
