"""Traffic that is driven in SUMO before the scenario begins, so that it begins as traffic is.

Whoever places road users knows little of the queues that lights and junctions make. After a minute
in SUMO they stand and move as they do in a run; where they are then is where the scenario begins.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.app.learned.snapshot_data import nodes_under, vehicles_of
from odscen.app.light_moments import signals_at
from odscen.app.running.batches import run_all
from odscen.app.running.runs import check_run
from odscen.base.atomic_folders import scratch_folder
from odscen.base.categories import Category
from odscen.base.errors import InputError
from odscen.learning.fill import VEHICLES
from odscen.learning.reference.binned_statistics import NOBODY, PlacedTraffic
from odscen.learning.reference.reference_generator import (
    draw_desired_speeds,
    fill_with_walkers,
    onward_goals,
    road_limits,
)
from odscen.runs.recording import Recording
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.distributions import stream
from odscen.scenario.document.sampling_config import SamplingConfig
from odscen.scenario.document.scenario_document import (
    Background,
    Demand,
    MapReference,
    Scenario,
    Simulation,
)
from odscen.scenario.placing.region import place_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.app.maps import LoadedMap
    from odscen.learning.fill import Fill, FillRequest
    from odscen.maps.store import Workspace
    from odscen.scenario.document.scenario_document import Actor
    from odscen.scenario.document.signals_document import Signals
    from odscen.scenario.placing.region import Region

STEP = 0.5
"""Seconds of a step while traffic is driven."""
COMING = 0.5
"""Share of the vehicles wanted that come anywhere while others arrive, in the first run."""
CLOSE = 0.1
"""Share of the vehicles wanted by which their number may be off."""
ATTEMPTS = 4
"""Runs until their number is close, each with more or fewer that come."""
DENSEST = 200.0
"""Vehicles per kilometre of lane."""


def driven_fill(
    workspace: Workspace,
    loaded: LoadedMap,
    region: Region,
    request: FillRequest,
    *,
    actors: Sequence[Actor],
    seconds: float,
    moment: float = 0.0,
) -> Fill | None:
    """Drive vehicles for a while, and place road users where they are then.

    Vehicles that get to their goals are made up for by others that come. Pedestrians stay where
    they are.

    Parameters
    ----------
    actors
        Where traffic begins.
    seconds
        Simulated time.
    moment
        What lights show at its end, see :func:`odscen.app.light_moments.signals_at`.

    Returns
    -------
    Fill or None
        ``None`` if no vehicle is left that could be placed.

    Raises
    ------
    InputError
        If SUMO does not get through.
    """
    vehicles = [actor for actor in actors if actor.category is not Category.PEDESTRIAN]
    lanes = region.graph.lanes
    allowed = np.stack(
        [
            request.allowed.get(category, np.zeros(len(lanes.x), dtype=np.bool_))
            for category in VEHICLES
        ]
    )
    before = signals_at(loaded, moment - seconds)
    kilometres = float(allowed.any(axis=0).sum()) * lanes.spacing / 1000.0
    if not vehicles or kilometres <= 0.0 or not request.vehicles:
        return None
    density = COMING * request.vehicles / kilometres
    best = NOBODY
    for _ in range(ATTEMPTS):
        scenario = warm_up_scenario(
            loaded, region, vehicles,
            density=density, seed=request.seed, seconds=seconds, signals=before,
        )  # fmt: skip
        found = _drive_traffic(workspace, loaded, scenario, allowed)
        if _count_distance(found, request.vehicles) < _count_distance(best, request.vehicles):
            best = found
        if _count_distance(best, request.vehicles) <= CLOSE:
            break
        share = (request.vehicles + 1) / (len(found.node) + 1)
        density = min(density * float(np.clip(share**2, 0.25, 4.0)), DENSEST)
    if not len(best.node):
        return None
    rng = stream(request.seed, "moving start")
    keep = np.sort(rng.permutation(len(best.node))[: request.vehicles])
    traffic = PlacedTraffic(best.node[keep], best.category[keep], best.speed[keep])
    desired = draw_desired_speeds(traffic, road_limits(region.graph)[traffic.node], rng)
    goal = onward_goals(
        region.graph, request.roads, node=traffic.node, speed=traffic.speed, rng=rng
    )
    return fill_with_walkers(traffic, desired, goal, _walker_nodes(region, actors))


def _count_distance(found: PlacedTraffic, wanted: int) -> float:
    """How far a number of vehicles is from the number wanted, as a share of it."""
    return abs(len(found.node) - wanted) / max(wanted, 1)


def _walker_nodes(region: Region, actors: Sequence[Actor]) -> np.ndarray:
    places = [place_of(region.graph, actor.spawn) for actor in actors]
    return np.array(
        [place.node for place in places if place is not None and place.walk], dtype=np.int64
    )


def warm_up_scenario(
    loaded: LoadedMap,
    region: Region,
    vehicles: Sequence[Actor],
    *,
    density: float,
    seed: int,
    seconds: float,
    signals: Signals,
) -> Scenario:
    """Vehicles of a region that drive to their goals, and others that come and go.

    Parameters
    ----------
    density
        Vehicles per kilometre of lane that come and go.
    seconds
        Simulated time.
    """
    graph = loaded.sumo.graph
    coming = Background(
        id="coming", per_km=round(max(density, 0.001), 3), mix=SamplingConfig().vehicles
    )
    return Scenario(
        name=f"{graph.map_name}-{seed:04d}",
        map=MapReference(name=graph.map_name, sha256=graph.map_sha256, spacing=graph.lanes.spacing),
        seed=seed,
        roi=region.segments,
        actors=tuple(vehicles),
        demand=Demand(background=(coming,)),
        signals=signals,
        simulation=Simulation(duration=seconds, step_length=STEP),
    )


def _drive_traffic(
    workspace: Workspace, loaded: LoadedMap, scenario: Scenario, allowed: np.ndarray
) -> PlacedTraffic:
    """Vehicles at the end of a run that are on nodes where they may be placed."""
    with scratch_folder() as folder:
        checked = check_run(
            workspace,
            scenario,
            name=scenario.name,
            out=folder,
            settings=RunSettings(warm_up=0.0, recording=Recording(emissions=False)),
        )
        (run,) = run_all([checked], reports=False, figures=False)
        if run.exit_code == 3:
            raise InputError(
                f"traffic could not be driven before the scenario: {run.known.get('error')}",
                element="warm_up",
            )
        rows = vehicles_of(run)
    times = rows["time"].to_numpy()
    if not len(times):
        return NOBODY
    rows = rows.filter(times > times.max() - 0.01).sort("id")
    node, good = nodes_under(loaded, rows)
    names = [str(category) for category in Category]
    category = np.array([names.index(name) for name in rows["category"]], dtype=np.int64)
    good &= allowed[category, node]
    speed = rows["speed"].to_numpy().astype(np.float64)
    return PlacedTraffic(node[good], category[good], speed[good])
