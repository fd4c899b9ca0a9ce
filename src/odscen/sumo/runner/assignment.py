"""Routes by travel time: the scenario is run again and again, and trips change to quicker routes.

The method of successive averages: after iteration ``n`` one in ``n + 1`` of the trips takes the
route that is quickest in the interval of its departure, by the mean travel times of all iterations
so far, those first who would save the largest share of their time (Sbayti, Lu and Mahmassani 2007,
Transportation Research Record 2029). Of all iterations the routes with the smallest gap are kept.

Where two routes take nearly as long, which of them is quickest is chance, and all would take it.
With a spread trips are shared by the logit model among the routes that have been quickest so far,
and the method finds a stochastic user equilibrium (Sheffi and Powell 1982, Networks 12(2)).
"""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from odscen.base.atomic_folders import scratch_folder
from odscen.base.categories import DEFAULT_BODY
from odscen.base.errors import SimulationError
from odscen.records.assignment_steps import Assignment, AssignmentStep
from odscen.records.run_events import EventKind, events_from_json
from odscen.runs.layout import EVENTS_FILE
from odscen.runs.recorded import read_lanes, read_trips
from odscen.runs.recording import Recording
from odscen.scenario.placing.region import Region
from odscen.sumo.realize.realization import all_road_users, as_run
from odscen.sumo.realize.route_choice.chosen_paths import RoutesOfDemand
from odscen.sumo.realize.route_choice.known_routes import KnownRoutes, chosen_route, taste
from odscen.sumo.realize.route_choice.travel_times import (
    EdgeSteps,
    TimedNetwork,
    TravelTimes,
    path_costs,
)
from odscen.sumo.realize.route_paths import CostRouter
from odscen.sumo.realize.traffic_measures.measure_actions import measure_actions
from odscen.sumo.runner.prepare import prepare
from odscen.sumo.runner.worker_process import run_worker

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping
    from pathlib import Path

    from odscen.base.arrays import FloatArray, Int32Array
    from odscen.runs.run_settings import RunSettings
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.realize.road_users.free_flow import ModelSizes
    from odscen.sumo.realize.sumo_map import SumoMap
    from odscen.sumo.runner.run_folder import SumoPreparedRun


_SETTLED = 0.05
"""Share of trips that may want another route when, with a spread, routes are found."""
_FEWEST = 7
"""Iterations, with a spread: means of fewer runs still have their chance in them."""


@dataclass(frozen=True, slots=True)
class AssignedRoutes:
    """What an assignment found.

    Attributes
    ----------
    paths
        Nodes of the lane graph by the id of the trip.
    found
        How they were found.
    """

    paths: Mapping[str, Int32Array]
    found: Assignment


def wants_assignment(scenario: Scenario) -> bool:
    """Whether routes of a scenario have to be found by runs."""
    demand = scenario.demand
    chooses = demand.inputs or demand.matrices or demand.background
    return demand.routes.by == "travel_time" and bool(chooses)


def prepare_assigned(
    scenario: Scenario,
    sumo_map: SumoMap,
    net: Path,
    assets: ModelSizes | None = None,
    *,
    settings: RunSettings,
    on_step: Callable[[AssignmentStep], None] | None = None,
) -> SumoPreparedRun:
    """Prepare a run; where the scenario wants routes by travel time, they are found first.

    Parameters and errors as of :func:`assign_routes`.
    """
    if not wants_assignment(scenario):
        return prepare(scenario, sumo_map, net, assets, settings=settings)
    assigned = assign_routes(scenario, sumo_map, net, assets, settings=settings, on_step=on_step)
    return prepare(
        scenario,
        sumo_map,
        net,
        assets,
        settings=settings,
        assigned=assigned.paths,
        assignment_json=assigned.found.to_json(),
    )


def assign_routes(
    scenario: Scenario,
    sumo_map: SumoMap,
    net: Path,
    assets: ModelSizes | None = None,
    *,
    settings: RunSettings,
    wider: Scenario | None = None,
    on_step: Callable[[AssignmentStep], None] | None = None,
) -> AssignedRoutes:
    """Find routes by travel time for the trips of a scenario.

    Parameters
    ----------
    sumo_map, net, assets, settings
        As of :func:`odscen.sumo.runner.prepare.prepare`.
    wider
        The scenario with more trips in its rows. These choose routes as the others do, but are not
        run, and the gap is without them: which routes are taken can then be told where a row has
        one trip.
    on_step
        Called after each iteration.

    Raises
    ------
    ScenarioError
        With every actor and flow whose spawn or goal is not usable.
    SimulationError
        If a run fails.
    """
    choice = scenario.demand.routes
    until = settings.times(scenario)[0]
    search = _Search(as_run(scenario, settings), sumo_map, until=until)
    if wider is not None:
        real = search.paths()
        search = _Search(as_run(wider, settings), sumo_map, until=until, real=real.keys())
    plain = replace(
        settings,
        recording=Recording(trajectories=False, emissions=False),
        expectations=(),
        slice_length=None,
    )
    steps: list[AssignmentStep] = []
    best = search.paths()
    changed = len(best)
    for iteration in range(1, choice.iterations + 1):
        prepared = prepare(scenario, sumo_map, net, assets, settings=plain, assigned=search.paths())
        with scratch_folder() as folder:
            prepared.write(folder)
            ended = run_worker(folder, time_limit=settings.time_limit, forked=True)
            if ended.sim_seconds is None:
                raise SimulationError(f"iteration {iteration} of the assignment: {ended.error}")
            times = search.measured(folder)
            outcome = _read_outcome(
                folder, vehicles=sum(not actor.person for actor in prepared.plan.actors)
            )
        wanting = search.compare(times)
        travel_time, *counts = outcome
        steps.append(AssignmentStep(iteration, round(search.gap, 6), travel_time, changed, *counts))
        if search.gap <= min(step.gap for step in steps):
            best = search.paths()
        if on_step is not None:
            on_step(steps[-1])
        settled = not choice.spread or (wanting <= _SETTLED and iteration >= _FEWEST)
        if (search.gap <= choice.gap and settled) or not wanting:
            break
        changed = search.change(share=1.0 / (iteration + 1.0))
    used = min(steps, key=lambda step: (step.gap, step.iteration)).iteration
    return AssignedRoutes(best, Assignment(choice.gap, used, tuple(steps)))


class _Search:
    """The trips of one scenario that choose, with the paths they have and the quickest ones.

    Parameters
    ----------
    real
        Ids of the trips that are run, and make the gap; all without.
    """

    def __init__(
        self,
        scenario: Scenario,
        sumo_map: SumoMap,
        *,
        until: float,
        real: Collection[str] | None = None,
    ) -> None:
        region = Region.of(sumo_map.graph, scenario.roi)
        users, _ = all_road_users(scenario, sumo_map, region, until=until)
        self.gap = 0.0
        choice = scenario.demand.routes
        self._until, self._interval, self._spread = until, choice.interval, choice.spread
        self._lanes = sumo_map.graph.lanes
        self._network = TimedNetwork(sumo_map)
        step_length = scenario.simulation.step_length
        actions = measure_actions(scenario, sumo_map, until=until, step_length=step_length)
        self._closings = actions.closings
        self._edges = EdgeSteps(self._lanes)
        self._drivable = region.router_over(sumo_map.drivable)
        routes = RoutesOfDemand(scenario, region, self._drivable)
        self._trips = [user for user in users if routes.chooses(user) and not routes.shared(user)]
        found = dict(routes.each_path(self._trips))
        kept = [index for index in sorted(found) if len(found[index]) > 1]
        self._trips = [self._trips[index] for index in kept]
        self._paths = [found[index] for index in kept]
        self._steps = [self._edges.of(path) for path in self._paths]
        self._departs = np.array([user.depart for user in self._trips])
        self._real = np.array([real is None or user.id in real for user in self._trips])
        self._known = [
            KnownRoutes([path], [steps])
            for path, steps in zip(self._paths, self._steps, strict=True)
        ]
        self._taste = np.array([taste(user.id) for user in self._trips])
        self._wants = np.zeros(len(self._paths), dtype=np.bool_)
        self._wanted = np.zeros(len(self._paths), dtype=np.int64)
        self._gain = np.zeros(len(self._paths))
        self._mean: TravelTimes | None = None
        self._iterations = 0

    def paths(self) -> dict[str, Int32Array]:
        """Paths that the trips have now, by their ids."""
        return {user.id: path for user, path in zip(self._trips, self._paths, strict=True)}

    def measured(self, folder: Path) -> TravelTimes:
        """Travel times of a run."""
        import polars as pl

        table = read_lanes(folder)
        rows = (
            []
            if table is None
            else table.group_by("begin", "edge")
            .agg(pl.col("seconds").sum(), pl.col("distance").sum())
            .sort("begin", "edge")
            .rows()
        )
        return self._network.measured(
            rows, until=self._until, interval=self._interval, closings=self._closings
        )

    def compare(self, times: TravelTimes) -> float:
        """Measure the gap, and find what each trip wants by the means of all iterations.

        Returns
        -------
        Share of the trips that want another route than they have.
        """
        rows = times.row(self._departs)
        own = path_costs(times, self._steps, rows)
        quick = [self._edges.of(path) for path in self._quickest_paths(times, rows)]
        best = np.minimum(own, path_costs(times, quick, rows))
        self.gap = float((own - best)[self._real].sum() / max(best[self._real].sum(), 1e-9))
        self._iterations += 1
        if self._mean is None:
            self._mean = times
        else:
            more = (times.costs - self._mean.costs) / self._iterations
            self._mean = TravelTimes(times.interval, self._mean.costs + more)
        for known, path in zip(self._known, self._quickest_paths(self._mean, rows), strict=True):
            known.learn(path, self._edges)
        return self._mean_wish(path_costs(self._mean, self._steps, rows), self._mean, rows)

    def _mean_wish(self, own: FloatArray, times: TravelTimes, rows: Int32Array) -> float:
        counts = [len(known.steps) for known in self._known]
        steps = [step for known in self._known for step in known.steps]
        costs = path_costs(times, steps, np.repeat(rows, counts))
        of_each = np.split(costs, np.cumsum(counts)[:-1]) if counts else []
        for index, seconds in enumerate(of_each):
            wanted = chosen_route(seconds, self._taste[index], spread=self._spread)
            self._wanted[index] = wanted
            self._gain[index] = (own[index] - seconds[wanted]) / max(own[index], 1e-9)
        if self._spread:
            wants = [
                self._steps[index] is not known.steps[wanted]
                for index, (known, wanted) in enumerate(
                    zip(self._known, self._wanted.tolist(), strict=True)
                )
            ]
            self._wants = np.array(wants, dtype=np.bool_)
        else:
            self._wants = self._gain > 0.0
        return float(np.mean(self._wants)) if len(self._wants) else 0.0

    def change(self, *, share: float) -> int:
        """Give a share of the trips what they want; how many have changed."""
        most = max(1, round(share * len(self._gain)))
        order = np.argsort(-self._gain, kind="stable")
        changing = order[self._wants[order]][:most].tolist()
        for index in changing:
            known, wanted = self._known[index], int(self._wanted[index])
            self._paths[index], self._steps[index] = known.paths[wanted], known.steps[wanted]
        return len(changing)

    def _quickest_paths(self, times: TravelTimes, rows: Int32Array) -> list[Int32Array]:
        groups: dict[int, dict[int, dict[int, int]]] = defaultdict(lambda: defaultdict(dict))
        for index, row in enumerate(rows.tolist()):
            groups[row][self._trips[index].goal][index] = self._trips[index].spawn
        bodies = [DEFAULT_BODY[user.category] for user in self._trips]
        paths = list(self._paths)
        for row, goals in sorted(groups.items()):
            costs = times.costs[row]
            ways = CostRouter(self._drivable.with_costs(costs), self._lanes, costs)
            for goal, spawns in sorted(goals.items()):
                for index, path in ways.paths_to(goal, spawns, bodies):
                    if len(path) > 1:
                        paths[index] = path
        return paths


def _read_outcome(folder: Path, *, vehicles: int) -> tuple[float | None, int, int, int]:
    """Mean travel time, seconds, and how many arrived, were teleported and were not inserted."""
    import polars as pl

    table = read_trips(folder)
    events = events_from_json((folder / EVENTS_FILE).read_text(encoding="utf-8"))
    teleported = {event.actor for event in events if event.kind is EventKind.TELEPORT_START}
    if table is None:
        return None, 0, 0, vehicles
    trips = table.filter(~pl.col("person"))
    durations = trips.filter(pl.col("arrival").is_not_null())["duration"].to_list()
    mean = round(math.fsum(durations) / len(durations), 2) if durations else None
    return mean, len(durations), len(teleported), vehicles - len(trips)
