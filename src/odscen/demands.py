"""Demand as functions: what ``odscen demand`` and scripts call."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import polars as pl

from odscen import workflow
from odscen.errors import InputError, in_file
from odscen.lanegraph.paths import Router
from odscen.scenario import demand_edits, edits
from odscen.scenario.counting import Observation, transitions
from odscen.scenario.profiles import Curve, known_profiles
from odscen.scenario.region import Region
from odscen.scenario.tables import read_counts, read_matrix, read_profile, read_zones
from odscen.sumo.fit import planned_fit, run_fit
from odscen.sumo.layout import SCENARIO_FILE, TRAJECTORIES_FILE
from odscen.sumo.passages import planned_passages
from odscen.sumo.realize import everybody

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.catalog.store import Workspace
    from odscen.scenario.document import Demand, Scenario
    from odscen.sumo.fit import Fit
    from odscen.workflow import LoadedMap

DAY = 86_400.0

TOWN_MIX = {"car": 80, "van": 8, "truck": 4, "bus": 2, "motorcycle": 3, "bicycle": 3}
"""Vehicles of a town by kind, per cent; roughly those of counts in European cities."""

SAMPLE = 4000
"""Trips whose ways say which way into a junction is the busiest."""
SATURATION = 1800.0
"""Vehicles per hour that a lane lets off while it has green, the textbook's value."""
LOST = 0.2
"""Share of the time in which nobody has green, or nobody makes use of a gap."""
SPARE = 0.7
"""Share of what the busiest way into a junction carries that a day's demand uses of it."""


class Load(NamedTuple):
    """How much a day's demand asks of the busiest way into a junction, in the busiest hour.

    ``volume`` and ``capacity`` are vehicles per hour at ``place``.
    """

    trips: float
    peak_trips: float
    place: str
    volume: float
    capacity: float


def import_table(
    workspace: Workspace,
    scenario: Scenario,
    file: Path,
    *,
    kind: str,
    name: str | None = None,
    day: str | None = None,
    **fields: Any,
) -> Scenario:
    """Read a table into a scenario.

    Parameters
    ----------
    kind
        ``od``, ``counts``, ``profile`` or ``zones``.
    name
        Of the part of the demand; the kind's if not given. A matrix with times of its own becomes
        one part for each slice, numbered from 1 on.
    day
        Day profile of a matrix without times.
    fields
        Further fields of the part, such as ``mix``.

    Raises
    ------
    InputError
        If the file cannot be read or a value cannot be used; names file and line.
    ScenarioError
        If the scenario has no such places.
    """
    graph = _loaded(workspace, scenario).sumo.graph
    with in_file(str(file)):
        text, clock = _text(file), scenario.demand.clock
        if kind == "zones":
            for zone, segments in read_zones(text).items():
                scenario = demand_edits.set_zone(scenario, graph, zone=zone, segments=segments)
            return scenario
        if kind == "profile":
            shares = read_profile(text)
            return demand_edits.set_profile(
                scenario, graph, profile=name or "profile", shares=shares
            )
        if kind == "counts":
            rows = read_counts(text, clock=clock)
            return demand_edits.set_counts(
                scenario, graph, counts=name or "counts", rows=rows, **fields
            )
        slices = read_matrix(text, clock=clock)
        for number, (when, trips) in enumerate(slices.items(), start=1):
            whole = when is None and len(slices) == 1
            own: dict[str, Any] = {} if when is None else {"begin": when[0], "end": when[1]}
            scenario = demand_edits.set_matrix(
                scenario,
                graph,
                matrix=(name or "trips") + ("" if whole else f"-{number}"),
                trips=trips,
                profile=day,
                **own,
                **fields,
            )
        return scenario


def add_background(
    workspace: Workspace, scenario: Scenario, *, name: str, **fields: Any
) -> Scenario:
    """Add background traffic; ``fields`` are those of ``Background``, such as ``per_km``."""
    graph = _loaded(workspace, scenario).sumo.graph
    return demand_edits.set_background(scenario, graph, background=name, **fields)


def whole_day(
    workspace: Workspace,
    map_name: str,
    *,
    trips: float | None = None,
    day: str = "weekday",
    seed: int = 0,
) -> tuple[Scenario, Load]:
    """Make 24 hours of traffic anywhere on a map, from midnight on.

    Parameters
    ----------
    trips
        Of the day. If not given, as many that in the busiest hour the busiest way into a junction
        gets :data:`SPARE` of what it carries, so that the town does not jam by demand alone.
    day
        A built-in day profile.
    """
    loaded = workflow.load_map(workspace.map(map_name))
    graph = loaded.sumo.graph
    scenario = edits.new_scenario(graph, name=f"{day} on {map_name}", roi=graph.segments.ids)
    scenario = edits.set_seed(scenario, seed=seed)
    scenario = edits.set_simulation(scenario, duration=DAY)

    def with_trips(number: float) -> Scenario:
        return demand_edits.set_background(
            scenario, graph, background=day, trips=number, profile=day, mix=TOWN_MIX
        )

    share = peak_share(scenario.demand, day)
    place, per_trip, capacity = busiest(with_trips(SAMPLE), loaded)
    if trips is None:
        trips = float(int(SPARE * capacity / per_trip / share / 100.0) * 100)
    peak = trips * share
    return with_trips(trips), Load(trips, peak, place, peak * per_trip, capacity)


def peak_share(demand: Demand, day: str) -> float:
    """Share of a day's demand that comes in its busiest hour."""
    shares = known_profiles(demand).get(day)
    if shares is None:
        msg = f"there is no day profile {day!r}; there are {', '.join(known_profiles(demand))}"
        raise InputError(msg)
    curve = Curve(shares)
    return max(curve.amount(60.0 * m + 3600.0) - curve.amount(60.0 * m) for m in range(1380)) / DAY


def busiest(scenario: Scenario, loaded: LoadedMap) -> tuple[str, float, float]:
    """Busiest way into a junction: the place, its share of all trips, and vehicles it carries.

    A lane lets off :data:`SATURATION` vehicles per hour of green. The ways into a junction share
    the time that is not lost: by the stages of its light, or, without one, by their number.
    """
    graph = loaded.sumo.graph
    region = Region.of(graph, scenario.roi)
    users, _ = everybody(scenario, loaded.sumo, region, until=DAY)
    ways_in = _ways_in(loaded)
    seen = [Observation("busiest", place, 0.0, 2 * DAY, 0.0) for place in ways_in]
    drivable = Router(graph, region.lanes & loaded.sumo.drivable)
    passages = planned_passages(users, region, drivable, seen)
    place = max(
        sorted(ways_in), key=lambda one: passages.get((one, 0.0, 2 * DAY), 0) / ways_in[one]
    )
    return place, passages[place, 0.0, 2 * DAY] / max(len(users), 1), ways_in[place]


def fit(workspace: Workspace, what: Path) -> Fit:
    """Hold traffic against the counts of its scenario: as planned, or as a run had it.

    Parameters
    ----------
    what
        A scenario file, or the folder of a run.

    Raises
    ------
    InputError
        If the scenario has no counts, or the run no trajectories.
    """
    folder = what if what.is_dir() else None
    scenario = workflow.read_scenario(what if folder is None else folder / SCENARIO_FILE)
    if not scenario.demand.counts:
        msg = "the scenario has no counts; import some with: odscen demand import --counts"
        raise InputError(msg, file=str(what))
    loaded = _loaded(workspace, scenario)
    if folder is None:
        return planned_fit(scenario, loaded.sumo)
    trajectories = folder / TRAJECTORIES_FILE
    if not trajectories.is_file():
        msg = "the run has no trajectories to count in"
        raise InputError(msg, file=str(what))
    return run_fit(scenario, loaded.sumo, pl.scan_parquet(trajectories))


def _ways_in(loaded: LoadedMap) -> dict[str, float]:
    """Vehicles per hour that each way into a junction carries, by its place."""
    graph = loaded.sumo.graph
    ids, kinds = graph.segments.ids, graph.segments.kinds
    junctions = {str(name) for name, kind in zip(ids, kinds, strict=True) if kind == "junction"}
    stages = {f"j{name}": len(light.green) for light in loaded.lights for name in light.names}
    before: dict[str, list[str]] = {name: [] for name in junctions}
    for one, others in transitions(graph).items():
        for other in others & junctions:
            before[other].append(one)
    lanes = _lanes_between(loaded)
    return {
        f"{one}>{junction}": lanes[one, junction]
        * SATURATION
        * (1.0 - LOST)
        / max(stages.get(junction, len(ones)), 1)
        for junction, ones in before.items()
        for one in ones
    }


def _lanes_between(loaded: LoadedMap) -> Counter[tuple[str, str]]:
    """How many lanes lead from each segment into each other."""
    graph = loaded.sumo.graph
    lanes, ids = graph.lanes, graph.segments.ids
    crosses = lanes.segment[lanes.source] != lanes.segment[lanes.target]
    source, target = lanes.source[crosses], lanes.target[crosses]
    rows = np.stack([lanes.segment[source], lanes.segment[target], lanes.lane[source]], axis=1)
    found = np.unique(rows, axis=0)[:, :2].tolist()
    return Counter((str(ids[one]), str(ids[other])) for one, other in found)


def _loaded(workspace: Workspace, scenario: Scenario) -> LoadedMap:
    return workflow.load_map(workspace.map_for(scenario.map.name, scenario.map.sha256))


def _text(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(str(error)) from error
