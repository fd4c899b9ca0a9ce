"""The shipped crossing with lights, and the engineer's program of the guide on it."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.convert.building.network import build_network
from odscen.lanegraph.build_graphs import build_map_graph
from odscen.lanegraph.query import node_id, walk_node_id
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse
from odscen.runs.run_settings import RunSettings
from odscen.scenario import edits
from odscen.scenario.document.scenario_document import Demand
from odscen.scenario.document.signals_document import JunctionTiming, Signals
from odscen.scenario.signals.light import Light
from odscen.sumo.realize.lights.light_views import scenario_lights
from odscen.sumo.realize.sumo_map import SumoMap
from odscen.sumo.runner.prepare import prepare
from odscen.sumo.runner.run_jobs import run_prepared

if TYPE_CHECKING:
    from odscen.runs.finished_run import Run
    from odscen.scenario.document.scenario_document import Scenario

ROOT = Path(__file__).parents[1]
MAP = ROOT / "maps" / "signal_crossing.xodr"
JUNCTION = "10001"


@dataclass(frozen=True, eq=False)
class Case:
    """A map in memory."""

    sumo: SumoMap
    net_xml: bytes

    def net(self, folder: Path) -> Path:
        net = folder / "case.net.xml"
        net.write_bytes(self.net_xml)
        return net


@cache
def crossing() -> Case:
    odr = parse(MAP.read_bytes(), file=MAP.name)
    roads = RoadTable.of(odr)
    graph = build_map_graph(odr, name="signal_crossing", sha256="0" * 64, table=roads)
    network = build_network(odr, roads, graph.walks)
    return Case(SumoMap.of(graph, network.table), network.net_xml)


@cache
def light() -> Light:
    return scenario_lights(crossing().sumo)[0]


def program(**changes: Any) -> dict[str, Any]:
    """The program of the guide; ``None`` leaves a field out."""
    guide = (ROOT / "docs" / "signals.md").read_text(encoding="utf-8")
    found = re.search(r"```json\n(.*?)```", guide, re.DOTALL)
    assert found
    fields = {**json.loads(found[1]), **changes}
    return {key: value for key, value in fields.items() if value is not None}


def one_plan(**changes: Any) -> dict[str, Any]:
    """The same without plans of the day."""
    return program(plans=None, **changes)


def timing(**fields: Any) -> JunctionTiming:
    return JunctionTiming.model_validate_json(json.dumps(fields), strict=True)


def scenario(
    junction: dict[str, Any] | None,
    *,
    control: str | None = "fixed",
    clock: float = 0.0,
    walkers: float = 60.0,
    vehicles: float = 300.0,
    until: float = 600.0,
) -> Scenario:
    """Cars on all legs and people over the first leg, for ten minutes."""
    graph = crossing().sumo.graph
    one = edits.new_scenario(graph, name="signals", roi=graph.segments.ids, seed=3)
    for spawn in entries():
        one = edits.add_flow(one, graph, spawn=spawn, per_hour=vehicles, end=until)
    if walkers:
        one = edits.add_flow(
            one, graph, spawn=walk_from("1"), goal=walk_to("1"), per_hour=walkers,
            mix={"pedestrian": 1.0}, end=until,
        )  # fmt: skip
    signals = Signals.model_validate_json(
        json.dumps({"control": control, "junctions": [junction] if junction else []})
    )
    demand = Demand(clock=clock)
    simulation = one.simulation.model_copy(update={"duration": until})
    return one.model_copy(update={"signals": signals, "demand": demand, "simulation": simulation})


def carried_out(
    one: Scenario, folder: Path, *, sumo_map: SumoMap | None = None, **settings: object
) -> Run:
    """Run a scenario on the crossing (or with other lights on it), to its end."""
    folder.mkdir(exist_ok=True)
    prepared = prepare(
        one,
        sumo_map or crossing().sumo,
        crossing().net(folder),
        settings=RunSettings(**settings),  # type: ignore[arg-type]
    )
    done = run_prepared(prepared, folder / "run")
    assert done.status == "completed"
    return done


def entries() -> list[str]:
    """First node of a car lane of each leg."""
    graph = crossing().sumo.graph
    lanes = graph.lanes
    found = {}
    starts = set(range(len(lanes.x))) - set(lanes.target.tolist())
    for node in sorted(starts):
        key = lanes.lanes.keys[lanes.lane[node]]
        if key.lane == -2:
            found[key.road] = node_id(graph, node)
    return [found[road] for road in sorted(found)]


def walk_from(road: str) -> str:
    return _walk_node(road, first=True)


def walk_to(road: str) -> str:
    return _walk_node(road, first=False)


def _walk_node(road: str, *, first: bool) -> str:
    graph = crossing().sumo.graph
    walks = graph.walks
    keys = [walks.lane_keys[lane] for lane in walks.lane]
    sides = sorted({key.lane for key in keys if key.road == road})
    side = sides[0] if first else sides[-1]
    own = [n for n, key in enumerate(keys) if key.road == road and key.lane == side]
    middle = own[int(np.argsort([walks.s[n] for n in own])[len(own) // 2])]
    return walk_node_id(graph, middle)
