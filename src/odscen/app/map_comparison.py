"""The converters side by side on one map: fidelity, losses, and what the networks carry."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from odscen.app.maps import load_map
from odscen.app.running.batches import run_all
from odscen.app.running.runs import check_run
from odscen.base.atomic_folders import scratch_folder
from odscen.base.errors import InputError, ToolError
from odscen.convert.model.conversion_settings import ConversionSettings
from odscen.lanegraph.query import largest_part, node_id
from odscen.maps.store import Workspace
from odscen.runs.recording import Recording
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.distributions import stream
from odscen.scenario.document.scenario_document import Flow, MapReference, Scenario, Simulation
from odscen.scenario.placing.region import Region
from odscen.sumo.runner.network_fit import route_fit

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from odscen.app.maps import LoadedMap
    from odscen.base.arrays import IntArray
    from odscen.convert.model.conversion_settings import ConverterName
    from odscen.convert.verify.fidelity_result import Fidelity
    from odscen.maps.map_entry import MapEntry
    from odscen.runs.finished_run import Run

PER_FLOW = 60.0
"""Vehicles per hour from one place: far below what a lane takes in from standstill."""

LEAST_TRIP = 100.0
"""Metres between start and goal of a flow, as the crow flies."""

FROM_ENDS = 50.0
"""Metres of a lane ahead of a start, and behind a goal: room to change lanes."""

_HALF = 0.5
_TRIES = 20


@dataclass(frozen=True, slots=True, kw_only=True)
class ComparisonSettings:
    """What is measured beside fidelity.

    Attributes
    ----------
    levels
        Trips per hour and kilometre of driving lane outside junctions; none for no runs.
    seeds
        Random seeds of the runs at each level.
    duration
        Seconds in which vehicles depart; the run ends as many seconds later.

    Raises
    ------
    InputError
        If a value is not possible.
    """

    levels: tuple[float, ...] = (100.0,)
    seeds: tuple[int, ...] = (1,)
    duration: float = 900.0

    def __post_init__(self) -> None:
        for level in self.levels:
            if not 0.0 < level <= 10_000.0:
                raise InputError(
                    f"a level must be above 0 and at most 10,000 per hour and km, not {level:g}"
                )
        if not 60.0 <= self.duration <= 86_400.0:
            raise InputError(f"the duration must be 60 to 86,400 s, not {self.duration:g}")
        if self.levels and not self.seeds:
            raise InputError("the comparison needs a seed")


SMALL_COMPARISON = ComparisonSettings()
"""A quarter of an hour of light traffic, one seed."""


class ConvertedMap(NamedTuple):
    """The map by one converter; ``refused`` is why there is none."""

    converter: ConverterName
    entry: MapEntry | None
    fidelity: Fidelity | None
    refused: str | None = None


class CarriedTraffic(NamedTuple):
    """What became of the trips, means over the seeds; ``delay`` in seconds per trip.

    Delay is time loss and departure delay; for a vehicle that was not inserted, the time until the
    end of the run.
    """

    planned: float
    arrived: float
    delay: float
    teleported: float
    collided: float


class CapacityRow(NamedTuple):
    """The same trips on each network."""

    level: float
    networks: Mapping[ConverterName, CarriedTraffic]


@dataclass(frozen=True, slots=True)
class MapComparison:
    """Networks of one map side by side; ``kilometres`` of driving lanes outside junctions."""

    name: str
    kilometres: float
    networks: tuple[ConvertedMap, ...]
    capacity: tuple[CapacityRow, ...]

    def to_dict(self) -> dict[str, Any]:
        """Form for JSON."""
        return {
            "name": self.name,
            "kilometres": round(self.kilometres, 3),
            "networks": [_network_dict(network) for network in self.networks],
            "capacity": [
                {
                    "level": row.level,
                    "networks": {name: network._asdict() for name, network in row.networks.items()},
                }
                for row in self.capacity
            ],
        }


def _network_dict(converted_map: ConvertedMap) -> dict[str, Any]:
    if converted_map.entry is None or converted_map.fidelity is None:
        return {"converter": converted_map.converter, "refused": converted_map.refused}
    report = converted_map.entry.info["report"]
    return {
        "converter": converted_map.converter,
        "refused": None,
        "sumo": converted_map.entry.info["sumo"],
        "fidelity": converted_map.fidelity.to_dict()["verdicts"],
        "report_counts": report["counts"],
        "lost": [entry for entry in report["entries"] if entry["fate"] == "lost"],
    }


def compare_converters(
    workspace: Workspace,
    name: str,
    *,
    settings: ComparisonSettings = SMALL_COMPARISON,
    processes: int = 1,
    progress: Callable[[str, float], None] | None = None,
) -> MapComparison:
    """Convert a map by each converter, and measure what comes out; the map stays as it is.

    Parameters
    ----------
    name
        Of the map. A network that was brought in for it is compared as well.
    processes
        How many runs at a time.

    Raises
    ------
    NotFoundError
        If there is no such map.
    InputError
        If no places are found from and to which vehicles can drive on all networks.
    """
    entry = workspace.map(name)
    tell = progress or (lambda _what, _share: None)
    with scratch_folder() as folder:
        place = Workspace.open(folder)
        networks = tuple(_convert_by_each(place, entry, tell))
        entries = {
            network.converter: network.entry for network in networks if network.entry is not None
        }
        figures = entries["odscen"].info["report"]["figures"]
        kilometres = figures.get("driving_road_length", 0.0) / 1000.0
        rows = []
        for number, level in enumerate(settings.levels):
            tell(f"{level:g} trips per hour and km", _HALF * (1 + number / len(settings.levels)))
            scenario = _draw_flows(entries, level * kilometres, settings)
            rows.append(
                CapacityRow(
                    level, _run_on_each_network(place, scenario, entries, settings, processes)
                )
            )
        tell("done", 1.0)
        return MapComparison(name, kilometres, networks, tuple(rows))


def _convert_by_each(
    place: Workspace, entry: MapEntry, tell: Callable[[str, float], None]
) -> Iterator[ConvertedMap]:
    """Convert the map by each converter, in a workspace of its own."""
    names: list[ConverterName] = ["odscen", "netconvert"]
    for number, converter in enumerate(names):
        tell(f"converting by {converter}", _HALF * number / len(names))
        own = ConversionSettings(spacing=entry.conversion.spacing, converter=converter)
        try:
            made = place.add_map(entry.checked("xodr"), name=converter, settings=own)
        except ToolError as error:
            yield ConvertedMap(converter, None, None, str(error))
        else:
            yield ConvertedMap(converter, made, made.fidelity())
    if entry.converter == "file":
        own = ConversionSettings(spacing=entry.conversion.spacing, converter="odscen")
        place.add_map(entry.checked("xodr"), name="file", settings=own)
        made = place.set_network("file", entry.checked("net"))
        yield ConvertedMap("file", made, made.fidelity())


def _draw_flows(
    entries: Mapping[ConverterName, MapEntry], per_hour: float, settings: ComparisonSettings
) -> Scenario:
    """Flows between places that all networks have, with routes on all of them."""
    loaded = [load_map(entry) for entry in entries.values()]
    graph, entry = loaded[0].sumo.graph, loaded[0].entry
    everywhere = Region.of(graph, largest_part(graph.segments))
    usable = np.array([graph.lanes.lanes.junctions[lane] is None for lane in graph.lanes.lane])
    usable &= everywhere.lanes
    ahead = graph.lanes.lanes.lengths[graph.lanes.lane] - graph.lanes.offset
    for network in loaded:
        usable &= True if network.usable.spawnable is None else network.usable.spawnable
    random = stream(0, "compare", entry.sha256)
    reference = MapReference(name=entry.name, sha256=entry.sha256, spacing=graph.lanes.spacing)
    count = max(1, round(per_hour / PER_FLOW))
    kept: dict[int, Flow] = {}
    for _ in range(_TRIES):
        pairs = _draw_start_goal_pairs(
            random,
            np.flatnonzero(usable & (ahead >= FROM_ENDS)),
            np.flatnonzero(usable & (graph.lanes.offset >= FROM_ENDS)),
            everywhere,
            2 * count,
        )
        flows = {
            spawn: Flow(
                id=f"trips-{spawn}",
                spawn=node_id(graph, spawn),
                goal=node_id(graph, goal),
                per_hour=max(per_hour / count, 0.001),
                end=settings.duration,
            )
            for spawn, goal in pairs
            if spawn not in kept
        }
        scenario = Scenario(
            name="compare",
            map=reference,
            roi=everywhere.segments,
            simulation=Simulation(duration=2.0 * settings.duration),
        )
        routed = _keep_routed_flows(scenario, flows, loaded)
        kept |= dict(list(routed.items())[: count - len(kept)])
        if len(kept) == count:
            return scenario.model_copy(update={"flows": tuple(kept.values())})
    raise InputError(
        f"only {len(kept)} of {count} pairs of places have a route on all networks of the map"
    )


def _draw_start_goal_pairs(
    random: np.random.Generator,
    starts: IntArray,
    goals: IntArray,
    region: Region,
    count: int,
) -> list[tuple[int, int]]:
    """Random pairs of a start and a goal with a path between them, each start once."""
    if not len(starts) or not len(goals):
        return []
    starts = random.choice(starts, size=min(count, len(starts)), replace=False)
    goals = random.choice(goals, size=len(starts))
    lanes = region.graph.lanes
    apart = np.hypot(lanes.x[starts] - lanes.x[goals], lanes.y[starts] - lanes.y[goals])
    starts, goals = starts[apart >= LEAST_TRIP], goals[apart >= LEAST_TRIP]
    if not len(starts):
        return []
    led = region.router.leads(starts.astype(np.int32), goals.astype(np.int32))
    return list(zip(starts[led].tolist(), goals[led].tolist(), strict=True))


def _keep_routed_flows(
    scenario: Scenario, flows: Mapping[int, Flow], loaded: Sequence[LoadedMap]
) -> dict[int, Flow]:
    """Flows whose vehicles have a route on every network."""
    from odscen.scenario.document.scenario_document import Actor

    actors = tuple(
        Actor(id=flow.id, category="car", spawn=flow.spawn, goal=flow.goal)
        for flow in flows.values()
    )
    routed = scenario.model_copy(update={"actors": actors})
    without = {problem.nodes for network in loaded for problem in route_fit(routed, network.sumo)}
    return {spawn: flow for spawn, flow in flows.items() if (flow.spawn,) not in without}


def _run_on_each_network(
    place: Workspace,
    scenario: Scenario,
    entries: Mapping[ConverterName, MapEntry],
    settings: ComparisonSettings,
    processes: int,
) -> dict[ConverterName, CarriedTraffic]:
    """Run the same scenario on each network with each seed."""
    recording = Recording(trajectories=False, emissions=False)
    jobs = [
        check_run(
            place,
            scenario,
            name=f"{converter}-{seed}",
            settings=RunSettings(seed=seed, recording=recording),
            entry=entry,
        )
        for converter, entry in entries.items()
        for seed in settings.seeds
    ]
    ended = run_all(jobs, processes=processes, reports=False, figures=False)
    by_converter: dict[ConverterName, list[CarriedTraffic]] = {}
    for converter, run in zip(
        [name for name in entries for _ in settings.seeds], ended, strict=True
    ):
        by_converter.setdefault(converter, []).append(_read_carried_traffic(run))
    return {
        converter: CarriedTraffic(*np.mean(np.array(some), axis=0).tolist())
        for converter, some in by_converter.items()
    }


def _read_carried_traffic(run: Run) -> CarriedTraffic:
    if run.known["error"]:
        raise ToolError(f"a run of the comparison failed: {run.known['error']}")
    end, counts = float(run.known["sim_seconds"]), run.counts
    delays = [
        max(end - row["depart"], 0.0)
        if row["inserted"] is None
        else (row["time_loss"] or 0.0) + (row["depart_delay"] or 0.0)
        for row in run.actors().iter_rows(named=True)
    ]
    return CarriedTraffic(
        counts["planned"],
        counts["arrived"],
        float(np.mean(delays)) if delays else 0.0,
        counts["teleported"],
        counts["collided"],
    )
