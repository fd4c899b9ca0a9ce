"""Lines of public transport in SUMO: the timetable, bays, and runs in slices."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import polars as pl
import pytest

from odscen.base.errors import ScenarioError
from odscen.runs.recorded import read_visits
from odscen.runs.run_settings import RunSettings
from odscen.scenario import edits
from odscen.scenario.document.scenario_document import Scenario
from odscen.sumo.runner.prepare import prepare
from odscen.sumo.runner.run_jobs import run_prepared
from tests.sumo.runner.test_on_maps import built, net_file

MAP = "t_junction_signs"
START, FIRST, SECOND, GOAL = "2.0.-1.5", "2.0.-1.25", "1.0.1.22", "4.0.1.40"
"""Along the major road, in this order."""
INSIDE = "1.0.1.0"
"""Where the junction of the SUMO network still is."""


def line(**fields: Any) -> Scenario:
    """A line over the major road: two stops 142 m apart, a bus every five minutes."""
    graph = built(MAP).sumo.graph
    scenario = edits.new_scenario(graph, name="bus", roi=graph.segments.ids, seed=4)
    scenario = edits.set_simulation(scenario, duration=fields.pop("duration", 900))
    bay = fields.pop("bay", False)
    for stop, node in (("first", FIRST), ("second", SECOND)):
        scenario = edits.set_stop(scenario, graph, stop=stop, node=node, bay=bay, length=14)
    given = {
        "start": START,
        "goal": GOAL,
        "stops": ({"stop": "first", "after": 60}, {"stop": "second", "after": 120}),
        "headway": 300,
        "dwell": {"kind": "uniform", "low": 10, "high": 20},
        **fields,
    }
    return edits.set_line(scenario, graph, line="7", **given)


def run(scenario: Scenario, folder: Path, **options: Any) -> pl.DataFrame:
    settings = RunSettings(**options)
    prepared = prepare(scenario, built(MAP).sumo, net_file(MAP, folder), settings=settings)
    assert prepared.problems == ()
    run_prepared(prepared, folder / "run")
    visits = read_visits(folder / "run")
    assert visits is not None
    return visits


@pytest.mark.slow
def test_buses_keep_their_timetable_on_empty_roads(tmp_path: Path) -> None:
    visits = run(line(), tmp_path)
    assert visits["actor"].to_list() == ["7.0", "7.0", "7.1", "7.1", "7.2", "7.2"]
    assert visits["stop"].to_list() == ["first", "second"] * 3
    scheduled = visits["scheduled"].to_list()
    assert scheduled == pytest.approx([60.01, 120.01, 360, 420, 660, 720], abs=0.02)
    assert (visits["departure"] - visits["scheduled"]).abs().max() <= 0.5
    dwell = visits["departure"] - visits["arrival"]
    assert dwell.min() >= 10.0


def test_without_a_timetable_a_bus_stays_for_its_dwell_time(tmp_path: Path) -> None:
    stops = ({"stop": "first"}, {"stop": "second", "dwell": 30})
    visits = run(line(stops=stops, dwell=12), tmp_path)
    dwell = visits.with_columns(dwell=pl.col("departure") - pl.col("arrival"))
    means = dict(dwell.group_by("stop").agg(pl.col("dwell").mean()).iter_rows())
    assert means == pytest.approx({"first": 12.0, "second": 30.0}, abs=0.5)
    assert visits["scheduled"].null_count() == visits.height


@pytest.mark.slow
def test_a_bus_in_a_bay_holds_up_no_other_vehicle(tmp_path: Path) -> None:
    def car(bay: bool) -> float:
        scenario = line(bay=bay, dwell=60, departures=(0,), headway=None)
        graph = built(MAP).sumo.graph
        scenario = edits.add_actor(
            scenario, graph, id="behind", category="car", spawn=START, depart=15, goal=GOAL
        )
        folder = tmp_path / str(bay)
        folder.mkdir()
        run(scenario, folder)
        trips = pl.read_parquet(folder / "run" / "trips.parquet")
        return float(trips.filter(pl.col("id") == "behind")["duration"][0])

    assert car(bay=False) > car(bay=True) + 15.0


@pytest.mark.slow
def test_a_run_in_slices_has_the_same_visits(tmp_path: Path) -> None:
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    for folder in (whole, cut):
        folder.mkdir()
    scenario = line(dwell=25)
    once = run(scenario, whole)
    # 340 s: the second bus stands at its first stop from 330 to 360 s.
    parts = run(scenario, cut, slice_length=345.0)
    assert once.equals(parts)


def test_a_stop_that_has_no_lane_in_sumo_is_refused_by_name() -> None:
    scenario = line()
    stops = scenario.transit.stops
    short = stops[0].model_copy(update={"node": INSIDE})
    transit = scenario.transit.model_copy(update={"stops": (short, stops[1])})
    with pytest.raises(ScenarioError, match="stop 'first'"):
        prepare(
            scenario.model_copy(update={"transit": transit}), built(MAP).sumo, Path("net.net.xml")
        )
