"""Routes by travel time: the scenario is run again and again, and trips change to quicker routes.

The method of successive averages: after iteration ``n`` one in ``n + 1`` of the trips takes the
route that is quickest in the interval of its departure, by the mean travel times of all iterations
so far, those first who would save the largest share of their time (Sbayti, Lu and Mahmassani 2007,
Transportation Research Record 2029). Of all iterations the routes with the smallest gap are kept.
"""

from __future__ import annotations

import math
import tempfile
from collections import defaultdict
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from odscen.base.categories import DEFAULT_BODY
from odscen.base.errors import SimulationError
from odscen.lanegraph.shortest_paths import Router
from odscen.results.records.assignment_steps import Assignment, AssignmentStep
from odscen.results.records.run_records import EventKind, events_from_json
from odscen.scenario.placing.region import Region
from odscen.sumo.folder.layout import EVENTS_FILE
from odscen.sumo.folder.recorded import read_lanes, read_trips
from odscen.sumo.realize.realization import all_road_users, as_run
from odscen.sumo.realize.recording import Recording
from odscen.sumo.realize.route_choice.chosen_paths import RoutesOfDemand
from odscen.sumo.realize.route_choice.travel_times import (
    EdgeSteps,
    TimedNetwork,
    TravelTimes,
    path_costs,
)
from odscen.sumo.realize.route_paths import CostRouter
from odscen.sumo.realize.traffic_measures.measure_actions import measure_actions
from odscen.sumo.runner.prepare import prepare
from odscen.sumo.runner.run_folder import write_run_folder
from odscen.sumo.runner.worker_process import run_worker

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from odscen.base.arrays import FloatArray, Int32Array
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.realize.realization import ModelSizes
    from odscen.sumo.realize.run_settings import RunSettings
    from odscen.sumo.realize.sumo_map import SumoMap
    from odscen.sumo.runner.run_folder import PreparedRun


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
) -> PreparedRun:
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
    on_step: Callable[[AssignmentStep], None] | None = None,
) -> AssignedRoutes:
    """Find routes by travel time for the trips of a scenario.

    Parameters
    ----------
    sumo_map, net, assets, settings
        As of :func:`odscen.sumo.runner.prepare.prepare`.
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
    search = _Search(as_run(scenario, settings), sumo_map, until=settings.times(scenario)[0])
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
        with tempfile.TemporaryDirectory(prefix="odscen-routes-") as name:
            folder = Path(name)
            write_run_folder(prepared, folder)
            ended = run_worker(folder, time_limit=settings.time_limit)
            if ended.done is None:
                msg = f"iteration {iteration} of the assignment: {ended.error}"
                raise SimulationError(msg)
            times = search.measured(folder)
            outcome = _outcome(folder, vehicles=sum(not one.person for one in prepared.plan.actors))
        gain = search.compare(times)
        travel_time, *counts = outcome
        steps.append(AssignmentStep(iteration, round(search.gap, 6), travel_time, changed, *counts))
        if search.gap <= min(step.gap for step in steps):
            best = search.paths()
        if on_step is not None:
            on_step(steps[-1])
        if search.gap <= choice.gap or not (gain > 0).any():
            break
        changed = search.change(gain, share=1.0 / (iteration + 1.0))
    used = min(steps, key=lambda step: (step.gap, step.iteration)).iteration
    return AssignedRoutes(best, Assignment(choice.gap, used, tuple(steps)))


class _Search:
    """The trips of one scenario that choose, with the paths they have and the quickest ones."""

    def __init__(self, scenario: Scenario, sumo_map: SumoMap, *, until: float) -> None:
        region = Region.of(sumo_map.graph, scenario.roi)
        users, _ = all_road_users(scenario, sumo_map, region, until=until)
        self.gap = 0.0
        self._until, self._interval = until, scenario.demand.routes.interval
        self._lanes = sumo_map.graph.lanes
        self._network = TimedNetwork(sumo_map)
        self._closings = measure_actions(scenario, sumo_map, until=until).closings
        self._edges = EdgeSteps(self._lanes)
        self._drivable = Router(sumo_map.graph, region.lanes & sumo_map.drivable)
        routes = RoutesOfDemand(scenario, region, self._drivable)
        self._trips = [user for user in users if routes.chooses(user) and not routes.shared(user)]
        found = dict(routes.each_path(self._trips))
        kept = [index for index in sorted(found) if len(found[index]) > 1]
        self._trips = [self._trips[index] for index in kept]
        self._paths = [found[index] for index in kept]
        self._steps = [self._edges.of(path) for path in self._paths]
        self._departs = np.array([user.depart for user in self._trips])
        self._quick = list(self._paths)
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

    def compare(self, times: TravelTimes) -> FloatArray:
        """Measure the gap, and find the paths that are quickest by the mean of all iterations.

        Returns
        -------
        What each trip would save by these means, as a share of its time, shape ``(trips,)``.
        """
        rows = times.row(self._departs)
        own, best, _ = self._compared(times, rows)
        self.gap = float((own - best).sum() / max(best.sum(), 1e-9))
        self._iterations += 1
        if self._mean is None:
            self._mean = times
        else:
            more = (times.costs - self._mean.costs) / self._iterations
            self._mean = TravelTimes(times.interval, self._mean.costs + more)
        own, best, self._quick = self._compared(self._mean, rows)
        return np.asarray((own - best) / np.maximum(own, 1e-9))

    def _compared(
        self, times: TravelTimes, rows: Int32Array
    ) -> tuple[FloatArray, FloatArray, list[Int32Array]]:
        """Seconds of each trip on its path and on the quickest, and the latter."""
        own = path_costs(times, self._steps, rows)
        quick = self._quickest(times, rows)
        best = path_costs(times, [self._edges.of(path) for path in quick], rows)
        return own, np.minimum(own, best), quick

    def change(self, gain: FloatArray, *, share: float) -> int:
        """Give a share of the trips the quickest paths; how many have changed."""
        most = max(1, round(share * len(gain)))
        order = np.argsort(-gain, kind="stable")[:most]
        changed = 0
        for index in order[gain[order] > 0].tolist():
            self._paths[index] = self._quick[index]
            self._steps[index] = self._edges.of(self._paths[index])
            changed += 1
        return changed

    def _quickest(self, times: TravelTimes, rows: Int32Array) -> list[Int32Array]:
        groups: dict[int, dict[int, dict[int, int]]] = defaultdict(lambda: defaultdict(dict))
        for index, row in enumerate(rows.tolist()):
            groups[row][self._trips[index].goal][index] = self._trips[index].spawn
        bodies = [DEFAULT_BODY[user.category] for user in self._trips]
        found = list(self._paths)
        for row, goals in sorted(groups.items()):
            costs = times.costs[row]
            ways = CostRouter(self._drivable.with_costs(costs), self._lanes, costs)
            for goal, spawns in sorted(goals.items()):
                for index, path in ways.paths_to(goal, spawns, bodies):
                    if len(path) > 1:
                        found[index] = path
        return found


def _outcome(folder: Path, *, vehicles: int) -> tuple[float | None, int, int, int]:
    """Mean travel time, seconds, and how many arrived, were teleported and were not inserted."""
    import polars as pl

    table = read_trips(folder)
    events = events_from_json((folder / EVENTS_FILE).read_text(encoding="utf-8"))
    teleported = {one.actor for one in events if one.kind is EventKind.TELEPORT_START}
    if table is None:
        return None, 0, 0, vehicles
    trips = table.filter(~pl.col("person"))
    durations = trips.filter(pl.col("arrival").is_not_null())["duration"].to_list()
    mean = round(math.fsum(durations) / len(durations), 2) if durations else None
    return mean, len(durations), len(teleported), vehicles - len(trips)
