"""Demand that does not get onto the road: a lane before a stop sign takes less than comes."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest

from odscen.figures.by_place.lane_groups import lane_groups
from odscen.figures.by_place.queue_metres import queue_backs
from odscen.runs.finished_run import Run
from odscen.runs.net_facts import read_net_facts
from odscen.runs.recorded import scan_trajectories
from odscen.runs.run_settings import RunSettings
from odscen.scenario import edits
from odscen.scenario.edits.demand_edits import set_input
from odscen.sumo.runner.prepare import prepare
from odscen.sumo.runner.run_jobs import run_prepared
from tests.sumo.realize.test_routes_file import empty
from tests.sumo.runner.test_on_maps import built, net_file

col = pl.col
MAP = "t_junction_signs"
HOURLY, UNTIL, STEP = 1200, 600.0, 1.0


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    folder = tmp_path_factory.mktemp("outside")
    sumo_map = built(MAP).sumo
    scenario = empty(MAP)
    graph = sumo_map.graph
    scenario = set_input(
        scenario,
        graph,
        inflow="stem",
        segment="r3",
        per_hour=HOURLY,
        arrivals="even",
        to=(("r1", 1), ("r2", 1)),
    )
    scenario = set_input(
        scenario, graph, inflow="main", segment="r2", per_hour=500, arrivals="even", to=(("r1", 1),)
    )
    scenario = edits.set_simulation(scenario, duration=UNTIL, step_length=STEP)
    settings = RunSettings(interval=300.0)
    prepared = prepare(scenario, sumo_map, net_file(MAP, folder), settings=settings)
    return run_prepared(prepared, folder / "run")


def of_stem(run: Run, place: str, *, over_time: bool = False) -> pl.DataFrame:
    table = run.figures_by(place, over_time=over_time)
    return table.filter(col("lane_group").str.contains("r3>"))


@pytest.mark.slow
def test_demand_and_vc_are_of_all_who_wanted_to_come(run: Run) -> None:
    actors = run.summary["actors"]
    assert actors["waiting"] > 20, "a lane that takes all shows nothing"
    groups = of_stem(run, "lane_group")
    wanted = HOURLY * UNTIL / 3600.0
    # Who is on the way to the queue at the end has not come to it yet.
    assert wanted - 25 <= groups["demand"].sum() <= wanted
    assert groups["outside"].sum() > 10.0
    assert of_stem(run, "movement")["demand"].max() == groups["demand"].max()
    assert groups["vc"].max() == pytest.approx(
        groups["demand"].sum() / groups["capacity"].sum(), rel=0.01
    )
    assert groups["vc"].max() > 1.3


def test_control_delay_has_the_wait_outside(run: Run) -> None:
    actors = run.actors().filter(col("id").str.starts_with("stem"))
    waited = sum(
        (UNTIL if late is None else depart + late) - depart
        for depart, late in actors.select("depart", "depart_delay").rows()
    )
    movements = of_stem(run, "movement")
    junction = run.figures_by("junction").filter(col("passages") > 0)
    seconds = junction["control_seconds"].sum()  # who is still in the queue at the end, too
    assert seconds > waited > 0.5 * seconds
    assert (movements["control_delay"] > 100.0).all()
    assert set(movements["level"]) == {"F"}
    assert set(movements["graded_by"]) == {"control delay"}
    assert set(junction["graded_by"]) == {"control delay of minor movements"}
    assert movements["passages"].sum() >= movements["vehicles"].sum() + 20


def test_the_95th_percentile_of_a_queue_is_over_all_that_is_analysed(run: Run) -> None:
    facts, rows = read_net_facts(run.folder), scan_trajectories(run.folder)
    assert facts is not None
    assert rows is not None
    backs = queue_backs(rows, lane_groups(run.lane_places(), facts), facts)
    assert backs is not None
    over_time = of_stem(run, "lane_group", over_time=True)
    for row in of_stem(run, "lane_group").iter_rows(named=True):
        name = row["lane_group"]
        metres = np.zeros(int(UNTIL / STEP))
        own = backs.filter(col("lane_group") == name)["metres"].to_numpy()
        metres[: len(own)] = own
        rank = int(0.05 * len(metres))
        assert row["queue_metres_p95"] == pytest.approx(np.sort(metres)[::-1][rank], abs=0.01)
        each = over_time.filter(col("lane_group") == name)
        assert set(each["queue_metres_p95_run"]) == {row["queue_metres_p95"]}
