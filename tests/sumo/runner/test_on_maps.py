"""Whole way on shipped maps: road model, network, sampled scenario, run."""

from __future__ import annotations

import hashlib
import subprocess
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from odscen.app.running.reports import write_report
from odscen.base.categories import Category
from odscen.convert.building.network import build_network
from odscen.figures.measures.summary import actors_from_json
from odscen.lanegraph.build_graphs import build_map_graph
from odscen.lanegraph.query import node_id
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse
from odscen.records.run_plan import Plan
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.sampling_config import SamplingConfig, overridden
from odscen.scenario.document.scenario_document import Actor, Flow, Scenario
from odscen.scenario.document.signals_document import Signals
from odscen.scenario.edits.actor_edits import add_actor
from odscen.scenario.sampling.sampler import sample_scenario
from odscen.simulators.assets import shipped_assets
from odscen.sumo.realize.sumo_map import SumoMap, pos_per_metre
from odscen.sumo.realize.usable import usable_places
from odscen.sumo.runner.prepare import prepare
from odscen.sumo.runner.run_jobs import run_prepared
from tests.sumo.conftest import BIN

MAPS = Path(__file__).parents[3] / "maps"
SHIPPED = ("signal_crossing", "left_hand_crossing", "roundabout", "rural_hills")


@dataclass(frozen=True, eq=False)
class Built:
    sumo: SumoMap
    net_xml: bytes


@cache
def built(name: str) -> Built:
    path = MAPS / f"{name}.xodr"
    content = path.read_bytes()
    odr = parse(content, file=path.name)
    table = RoadTable.of(odr)
    sha256 = hashlib.sha256(content).hexdigest()
    graph = build_map_graph(odr, name=name, sha256=sha256, table=table)
    network = build_network(odr, table, graph.walks)
    return Built(SumoMap.of(graph, network.table), network.net_xml)


def net_file(name: str, folder: Path) -> Path:
    net = folder / f"{name}.net.xml"
    net.write_bytes(built(name).net_xml)
    return net


def sampled(name: str, *, seed: int = 1, fill: float = 0.4) -> Scenario:
    where = built(name).sumo
    config = overridden(SamplingConfig(), fill=fill, roi_segments=30)
    return sample_scenario(
        where.graph, config, seed=seed, name=f"{name}-{seed}", usable=usable_places(where)
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", SHIPPED)
def test_sampled_actors_start_in_their_places_and_arrive(name: str, tmp_path: Path) -> None:
    prepared = prepare(
        sampled(name),
        built(name).sumo,
        net_file(name, tmp_path),
        shipped_assets(),
        settings=RunSettings(until=1800),
    )
    result = run_prepared(prepared, tmp_path / "run")
    assert result.status == "completed", result.summary["error"]
    actors = result.summary["actors"]
    assert prepared.problems == ()
    assert actors["planned"] >= 20
    assert actors["inserted"] == actors["planned"]
    outcomes = actors_from_json((tmp_path / "run" / "actors.json").read_text())
    errors = [o.insertion_error for o in outcomes if o.insertion_error is not None]
    assert np.mean(np.array(errors) <= 0.10) >= 0.97
    assert max(errors) < 0.5
    assert actors["arrived"] >= 0.97 * actors["planned"]
    assert all(o.depart_delay == 0 for o in outcomes)


@pytest.mark.slow
def test_a_scenario_gives_the_same_bytes_twice(tmp_path: Path) -> None:
    name = "signal_crossing"
    net = net_file(name, tmp_path)
    folders = tmp_path / "one", tmp_path / "deep" / "two"
    for folder in folders:
        run_prepared(prepare(sampled(name), built(name).sumo, net, shipped_assets()), folder)
    for file in ("trajectories.parquet", "events.json", "actors.json", "plan.json",
                 "scenario.json", "sumo/routes.rou.xml", "sumo/scenario.sumocfg"):  # fmt: skip
        assert (folders[0] / file).read_bytes() == (folders[1] / file).read_bytes(), file


@pytest.mark.slow
def test_in_long_steps_plain_sumo_gives_the_same_trajectories(tmp_path: Path) -> None:
    """In short ones odscen lets drivers take gaps that plain SUMO does not.

    Cautious ones, who want no more than the limit: others slow down for bends in any step.
    """
    name, folder = "signal_crossing", tmp_path / "run"
    calm = tuple(
        actor.model_copy(update={"speed": None, "style": "cautious"})
        for actor in sampled(name).actors
    )
    settings = RunSettings(step_length=1.0)
    net = net_file(name, tmp_path)
    assets = shipped_assets()
    scenario = sampled(name).model_copy(update={"actors": calm})
    run_prepared(prepare(scenario, built(name).sumo, net, assets, settings=settings), folder)
    ours = (folder / "trajectories.parquet").read_bytes()
    sumo = folder / "sumo"
    subprocess.run(
        [BIN / "sumo", "-c", "scenario.sumocfg"], cwd=sumo, check=True, capture_output=True
    )
    assert (sumo / "trajectories.parquet").read_bytes() == ours


@pytest.mark.slow
def test_sumo_loads_the_files_without_a_word(tmp_path: Path) -> None:
    name = "roundabout"
    prepared = prepare(sampled(name), built(name).sumo, net_file(name, tmp_path))
    run_prepared(prepared, tmp_path / "run")
    said = (tmp_path / "run" / "sumo.log").read_text()
    lines = [line for line in said.splitlines() if "Column based formats" not in line]
    assert not [line for line in lines if "rror" in line]
    assert not [line for line in lines if "disconnect" in line.lower()]


@pytest.mark.slow
@pytest.mark.parametrize("buses", [False, True])
@pytest.mark.parametrize("name", ["signal_crossing", "left_hand_crossing", "town_5x5"])
def test_sumo_has_nothing_to_say_of_actuated_lights_and_their_detectors(
    name: str, buses: bool, tmp_path: Path
) -> None:
    signals = Signals(control="actuated", bus_priority=buses)
    one = sampled(name).model_copy(update={"signals": signals})
    prepared = prepare(
        one, built(name).sumo, net_file(name, tmp_path), settings=RunSettings(until=300)
    )
    done = run_prepared(prepared, tmp_path / "run")
    assert done.status == "completed"
    assert all(light.detectors for light in prepared.lights)
    said = (tmp_path / "run" / "sumo.log").read_text()
    assert "etector" not in said
    assert "tlLogic" not in said


@pytest.mark.slow
def test_recorded_speeds_stay_below_what_each_actor_wants(tmp_path: Path) -> None:
    name = "signal_crossing"
    result = run_prepared(
        prepare(sampled(name), built(name).sumo, net_file(name, tmp_path)), tmp_path / "run"
    )
    plan = Plan.from_json((tmp_path / "run" / "plan.json").read_text())
    frame = pl.read_parquet(result.to_dict()["files"]["trajectories"])
    fastest = dict(frame.group_by("vehicle_id").agg(pl.col("vehicle_speed").max()).iter_rows())
    for actor in plan.actors:
        if actor.speed is not None:
            assert fastest[actor.id] <= actor.speed + 0.06, actor.id


@pytest.mark.slow
def test_a_flow_drives_and_walks(tmp_path: Path) -> None:
    name = "signal_crossing"
    where = built(name).sumo
    base = sampled(name)
    spawn, walker = base.actors[0].spawn, next(
        actor.spawn for actor in base.actors if actor.category is Category.PEDESTRIAN
    )  # fmt: skip
    flows = (
        Flow(id="cars", spawn=spawn, per_hour=600, end=120.0),
        Flow(id="people", spawn=walker, per_hour=600, end=120.0, mix={Category.PEDESTRIAN: 1}),
    )
    scenario = base.model_copy(update={"actors": (), "flows": flows})
    result = run_prepared(prepare(scenario, where, net_file(name, tmp_path)), tmp_path / "run")
    outcomes = actors_from_json((tmp_path / "run" / "actors.json").read_text())
    assert {o.flow for o in outcomes} == {"cars", "people"}
    assert len(outcomes) > 20
    assert result.summary["actors"]["arrived"] == len(outcomes)
    assert max(o.insertion_error or 0.0 for o in outcomes) < 0.15


@pytest.mark.slow
def test_a_hand_placed_spawn_inside_a_junction_is_kept(tmp_path: Path) -> None:
    name = "signal_crossing"
    where = built(name).sumo
    lanes = where.graph.lanes
    inside = np.array([one is not None for one in lanes.lanes.junctions])[lanes.lane]
    straight = inside & (np.abs(lanes.curvature) < 0.001)
    whole = sampled(name).model_copy(update={"roi": tuple(where.graph.segments.ids), "actors": ()})
    spawn = node_id(where.graph, int(np.flatnonzero(straight)[3]))
    scenario = add_actor(whole, where.graph, category=Category.CAR, spawn=spawn)
    result = run_prepared(prepare(scenario, where, net_file(name, tmp_path)), tmp_path / "run")
    assert result.summary["actors"]["arrived"] == 1
    assert result.summary["insertion_error_max"] < 0.5


@pytest.mark.slow
def test_the_report_is_written_before_the_folder_appears(tmp_path: Path) -> None:
    name = "roundabout"
    prepared = prepare(sampled(name), built(name).sumo, net_file(name, tmp_path))
    result = run_prepared(prepared, tmp_path / "run", finish=write_report)
    page = Path(result.to_dict()["files"]["report"]).read_text()
    assert page.startswith("<!DOCTYPE html>")
    assert "roundabout" in page


def test_usable_places_leave_most_of_a_map_and_nothing_unknown() -> None:
    where = built("signal_crossing").sumo
    usable = usable_places(where)
    assert usable.spawnable is not None
    assert usable.walkable is not None
    assert usable.spawnable.mean() > 0.4
    assert np.all(where.lane_places.lane[usable.spawnable] >= 0)
    assert np.all(where.lane_places.deviation[usable.spawnable] <= 0.05)
    assert usable.walkable.mean() > 0.6


def test_positions_per_metre_are_measured_between_neighbours() -> None:
    lane = np.array([0, 0, 0, 1, 1, -1, 2], dtype=np.int32)
    pos = np.array([0.0, 2.0, 4.0, 8.0, 4.0, np.nan, 1.0])
    x = np.array([0.0, 1.0, 2.0, 10.0, 14.0, 20.0, 30.0])
    scale = pos_per_metre(lane, pos, x, np.zeros(7), lanes=3)
    assert scale[:2].tolist() == [2.0, 1.0]
    assert np.isnan(scale[2])


@pytest.mark.slow
def test_actors_wait_for_their_departure(tmp_path: Path) -> None:
    name = "roundabout"
    first = next(a for a in sampled(name).actors if a.category is Category.CAR)
    late = Actor(id="late", category=Category.CAR, spawn=first.spawn, depart=7.3)
    scenario = sampled(name).model_copy(update={"actors": (late,)})
    run_prepared(prepare(scenario, built(name).sumo, net_file(name, tmp_path)), tmp_path / "run")
    (outcome,) = actors_from_json((tmp_path / "run" / "actors.json").read_text())
    assert outcome.inserted == 7.5  # the first step at or after the departure
    assert outcome.depart_delay == pytest.approx(0.2)
