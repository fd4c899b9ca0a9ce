"""Corridors on a shipped map, and vehicles of a real run along them."""

from pathlib import Path

import numpy as np
import polars as pl
import pytest

from odscen.base.errors import InputError, NotFoundError
from odscen.figures.by_place.corridors import busiest_corridor, corridor_along, path_between
from odscen.figures.by_place.traffic import over_run
from odscen.reports.report_maps import place_shapes
from odscen.reports.report_sections import NONE_RECORDED
from odscen.runs.measured import read_figures
from odscen.runs.run_settings import RunSettings
from odscen.sumo.outputs.corridor_traces import corridor_traces
from odscen.sumo.runner.prepare import prepare
from odscen.sumo.runner.run_jobs import run_prepared
from tests.sumo.runner.test_on_maps import built, net_file, sampled

NAME = "town_5x5"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("corridor")
    scenario = sampled(NAME, fill=0.2)
    run_prepared(
        prepare(
            scenario, built(NAME).sumo, net_file(NAME, folder), settings=RunSettings(until=240.0)
        ),
        folder / "run",
    )
    return folder / "run"


def movements(run: Path) -> pl.DataFrame:
    figures = read_figures(run, end=240.0)
    assert figures is not None
    return over_run(figures.movements)


@pytest.mark.slow
def test_the_busiest_way_goes_through_several_junctions_that_follow_each_other(run: Path) -> None:
    graph = built(NAME).sumo.graph
    turns = movements(run)
    corridor = busiest_corridor(turns, graph)
    assert corridor is not None
    inside = [name for name in corridor.segments if name.startswith("j")]
    assert len(inside) >= 2
    assert len(set(corridor.segments)) == len(corridor.segments)
    assert np.all(np.diff(corridor.starts) > 0)
    # It leads straight on: its ends are about as far apart as it is long.
    nodes = graph.lanes
    ends = corridor.nodes[[corridor.along.argmin(), corridor.along.argmax()]]
    apart = np.hypot(*np.diff([nodes.x[ends], nodes.y[ends]], axis=1).ravel())
    assert apart > 0.8 * corridor.length


@pytest.mark.slow
def test_a_corridor_is_where_most_drive_and_does_not_turn_off_with_the_crowd(run: Path) -> None:
    graph = built(NAME).sumo.graph
    corridor = busiest_corridor(movements(run), graph)
    assert corridor is not None
    along = corridor.segments
    counts = {
        ">".join(along[k - 1 : k + 2]): 100 for k, name in enumerate(along) if name.startswith("j")
    }
    inside = next(k for k, name in enumerate(along) if name.startswith("j"))
    onto, junction = along[inside - 1], along[inside]
    turning_off = [
        name
        for name in movements(run)["movement"]
        if name.startswith(f"{onto}>{junction}>") and name not in counts
    ]
    assert turning_off
    counts |= dict.fromkeys(turning_off, 900)
    table = pl.DataFrame({"movement": list(counts), "vehicles": list(counts.values())})
    chosen = busiest_corridor(table, graph)
    assert chosen is not None
    assert chosen.segments == along


@pytest.mark.slow
def test_vehicles_advance_along_a_corridor_as_fast_as_they_drive(run: Path) -> None:
    where = built(NAME).sumo
    corridor = busiest_corridor(movements(run), where.graph)
    assert corridor is not None
    traces = corridor_traces(run, where, corridor)
    assert not isinstance(traces, str)
    same = np.diff(traces.piece) == 0
    advanced, passed = np.diff(traces.along)[same], np.diff(traces.time)[same]
    driven = traces.speed[1:][same] * passed
    within = (traces.along[1:][same] > 1.0) & (traces.along[1:][same] < corridor.length - 1.0)
    assert within.sum() > 500
    # Bends are cut or gone round on other lanes, and the way changes lanes now and then.
    assert np.abs(advanced - driven)[within].mean() < 0.05 * driven[within].mean()
    assert advanced[within].sum() == pytest.approx(driven[within].sum(), rel=0.03)
    assert {name for name, _, _ in traces.junctions} == {
        name for name in corridor.segments if name.startswith("j")
    }


def test_junctions_between_named_segments_are_found_and_gaps_are_refused() -> None:
    graph = built(NAME).sumo.graph
    way = path_between(graph, "r27", "r35")
    assert way[0] == "r27"
    assert way[-1] == "r35"
    roads = [name for name in way if name.startswith("r")]
    assert corridor_along(graph, roads).segments == way
    with pytest.raises(InputError, match="does not follow"):
        corridor_along(graph, [roads[0], roads[-1]])
    with pytest.raises(NotFoundError):
        corridor_along(graph, ["r27", "r9999"])
    with pytest.raises(InputError) as long:
        corridor_along(graph, [roads[0], roads[-1]] * 1000)
    assert len(str(long.value)) < 500


def test_a_run_without_trajectories_has_no_diagram(tmp_path: Path) -> None:
    where = built(NAME).sumo
    corridor = corridor_along(where.graph, path_between(where.graph, "r27", "r35"))
    assert corridor_traces(tmp_path, where, corridor) == NONE_RECORDED


def test_every_place_on_which_vehicles_drive_has_a_shape() -> None:
    graph = built(NAME).sumo.graph
    shapes = place_shapes(graph)
    driven = {graph.segments.ids[row] for row in np.unique(graph.lanes.segment)}
    assert {*shapes.segments, *shapes.junctions} == driven
    on_roads = [n for n, kind in zip(graph.segments.ids, graph.segments.kinds, strict=True)
                if kind == "road"]  # fmt: skip
    assert set(shapes.segments) == {*on_roads} & driven
