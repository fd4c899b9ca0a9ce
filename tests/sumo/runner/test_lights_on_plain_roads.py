"""A run past lights on a plain road: who stops where, what is logged, and what signals show."""

from __future__ import annotations

import csv
from pathlib import Path

import polars as pl
import pytest

from odscen.convert.lane_table.light_heads import SignalHeads
from odscen.lanegraph.query import node_id
from odscen.opendrive.parse import parse
from odscen.runs.run_settings import RunSettings
from odscen.scenario import edits
from odscen.sumo.realize.sumo_map import SumoMap
from odscen.sumo.runner.prepare import prepare
from odscen.sumo.runner.run_jobs import run_prepared
from tests.convert.maps import of_model
from tests.convert.signals.test_road_lights import CROSSWALK, WALKS, light, straight, walk_light
from tests.opendrive.snippets import document

RED_UNTIL = 48.0
"""Seconds to the end of the first red of a light alone: 30 s of green, 3 of yellow, 15 of red."""


@pytest.mark.slow
def test_vehicles_stop_at_a_light_on_a_plain_road_while_it_is_red(tmp_path: Path) -> None:
    map_ = of_model(parse(document(straight("1", light(7, 250.0), length=400.0))))
    graph, network = map_.graph, map_.network
    net_file = tmp_path / "net.net.xml"
    net_file.write_bytes(network.net_xml)
    scenario = edits.new_scenario(graph, name="light", roi=graph.segments.ids)
    lanes = graph.lanes
    rows = [n for n in range(len(lanes.s)) if lanes.lanes.keys[lanes.lane[n]].lane == -1]

    def near(s: float) -> str:
        return node_id(graph, min(rows, key=lambda n: abs(lanes.s[n] - s)))

    # At 13.9 m/s they are at the light in green, after some 17 s, and in red.
    for spawn, depart in ((40.0, 2.0), (20.0, 20.0)):
        scenario = edits.add_actor(
            scenario, graph, category="car", spawn=near(spawn), goal=near(400.0), depart=depart
        )
    prepared = prepare(
        scenario, SumoMap.of(graph, network.table), net_file, settings=RunSettings(until=120.0)
    )
    run_prepared(prepared, tmp_path / "run")
    driven = pl.read_parquet(tmp_path / "run" / "trajectories.parquet")
    halts = driven.filter(pl.col("vehicle_speed") < 0.1, pl.col("timestep_time") > 25.0)
    assert halts["vehicle_id"].unique().to_list() == ["car-2"]
    assert float(halts["timestep_time"].max() or 0.0) == pytest.approx(RED_UNTIL, abs=1.5)
    # The centre of the body: half of it behind the stop line, half a metre before the light.
    # It waits with its front within 2 m of the stop line, half a metre before the light.
    assert 243.0 < float(halts["vehicle_x"].max() or 0.0) < 249.5
    with (tmp_path / "run" / "figures" / "signals.csv").open() as file:
        (row,) = csv.DictReader(file)
    # Of the first green, which is over when the run ends.
    assert (row["junction"], row["vehicles"]) == ("N1.249.5", "1")


def test_signals_show_what_their_links_have() -> None:
    text = document(straight("1", walk_light(9, 78.0), lanes=WALKS, inside=CROSSWALK))
    (own,) = of_model(parse(text)).network.table.lights
    heads = SignalHeads([own])
    shown = {phase.name: heads.states({own.id: phase.state})["9"] for phase in own.phases}
    assert (shown["stage 1"], shown["stage 2"]) == ("Red", "Green")
