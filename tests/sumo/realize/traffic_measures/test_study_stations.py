"""Stations of a scenario in a run, with its figures, its report and other intervals."""

from __future__ import annotations

from pathlib import Path

import polars as pl
import pytest

from odscen.app.running.reports import interval_rows, write_report
from odscen.base.errors import InputError
from odscen.maps.store import Workspace
from odscen.runs.finished_run import Run
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.scenario_document import Cordon, Detector, Study, TravelTimeSection
from odscen.scenario.edits.demand_edits import set_input
from odscen.scenario.placing.region import NodePlace, name_of
from odscen.sumo.runner.prepare import prepare
from odscen.sumo.runner.run_jobs import run_prepared
from tests.sumo.realize.test_routes_file import empty
from tests.sumo.runner.test_on_maps import built, net_file

col = pl.col
MAP = "signal_crossing"
UNTIL = 240.0


def inward(segment: str, share: float) -> tuple[str, ...]:
    """A node on each lane of a segment that leads to the junction, at a share of their length."""
    sumo_map = built(MAP).sumo
    graph, lanes = sumo_map.graph, sumo_map.lane_places.lanes
    inside = [
        node
        for node, own in enumerate(graph.lanes.segment.tolist())
        if str(graph.segments.ids[own]) == segment
    ]
    there: dict[str, list[tuple[float, int]]] = {}
    for node in inside:
        place = sumo_map.lane_places.of(node)
        if place is not None and place[0] in lanes and ".0.f_" in place[0]:
            there.setdefault(place[0], []).append((place[1], node))
    chosen = [sorted(nodes)[int(share * len(nodes))][1] for _, nodes in sorted(there.items())]
    return tuple(name_of(graph, NodePlace(walk=False, node=node)) for node in chosen)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    folder = tmp_path_factory.mktemp("stations")
    sumo_map = built(MAP).sumo
    scenario = set_input(
        empty(MAP, duration=UNTIL), sumo_map.graph, inflow="in", segment="r1", per_hour=900
    )
    begin, end = inward("r1", 0.3), inward("r1", 0.7)
    assert len(begin) == len(end) == 2
    study = Study(
        interval=60,
        detectors=(Detector(id="loop", nodes=begin),),
        sections=(TravelTimeSection(id="along", begin=begin, end=end),),
        cordons=(Cordon(id="part", entries=begin, exits=end),),
    )
    scenario = scenario.model_copy(update={"study": study})
    return run_prepared(prepare(scenario, sumo_map, net_file(MAP, folder)), folder / "run")


@pytest.mark.slow
def test_stations_of_the_study_are_measured_by_interval(run: Run) -> None:
    table = run.stations()
    assert table["station"].unique(maintain_order=True).to_list() == ["loop", "along", "part"]
    loop, along, part = (table.filter(col("station") == one) for one in ("loop", "along", "part"))
    assert loop.select("begin", "end").rows() == [(60.0 * k, 60.0 * (k + 1)) for k in range(4)]
    assert loop["vehicles"].sum() > 40
    assert loop["vehicles"].to_list() == part["vehicles"].to_list()
    assert along["vehicles"].to_list() == part["left"].to_list()
    balance = (part["vehicles"] - part["left"]).cum_sum()
    assert part["balance"].to_list() == balance.to_list()
    taken = along.drop_nulls("travel_time")
    assert (taken["travel_time"] > 2.0).all()
    assert (taken["travel_time_p95"] >= taken["travel_time"]).all()


def test_a_finished_run_is_asked_for_other_intervals_of_its_stations(
    run: Run, tmp_path: Path
) -> None:
    rows = interval_rows(Workspace.open(tmp_path), run, warm_up=60.0, interval=180.0)
    loop = [row for row in rows["stations"] if row["station"] == "loop"]
    assert [(row["begin"], row["end"]) for row in loop] == [(60.0, 240.0)]
    fine = run.stations().filter((col("station") == "loop") & (col("begin") >= 60.0))
    assert loop[0]["vehicles"] == fine["vehicles"].sum()


def test_the_report_has_the_stations(run: Run, tmp_path: Path) -> None:
    page = write_report(run.folder, run.summary, out=tmp_path / "report.html").read_text()
    assert "Stations by interval" in page
    assert "loop" in page


@pytest.mark.slow
def test_a_run_without_stations_says_so(tmp_path: Path) -> None:
    sumo_map = built(MAP).sumo
    prepared = prepare(
        empty(MAP), sumo_map, net_file(MAP, tmp_path), settings=RunSettings(until=5.0)
    )
    with pytest.raises(InputError, match="no stations"):
        run_prepared(prepared, tmp_path / "run").stations()
