"""Measures in real runs: who is led around, who is stranded, and what is reported."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import polars as pl
import pytest

from bench.measures import accident, counted, motorway, queue
from odscen.app.maps import LoadedMap, load_map
from odscen.app.running.runs import check_file, prepare_run
from odscen.figures.measures.summary import actors_from_json
from odscen.maps.store import Workspace
from odscen.records.run_events import EventKind, events_from_json
from odscen.runs.recorded import read_trajectories
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.json_form import dumps
from odscen.scenario.document.scenario_document import MapReference, Scenario
from odscen.sumo.realize.sumo_lane_places import lane_segments
from odscen.sumo.runner.long_runs import resume
from odscen.sumo.runner.run_jobs import run_prepared
from tests.sumo.runner.test_long_runs import TOWN, killed, results

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.records.run_events import Event
    from odscen.sumo.runner.run_folder import SumoPreparedRun


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    made = Workspace.open(tmp_path_factory.mktemp("measures"))
    made.add_map(TOWN)
    made.add_map(TOWN.with_name("motorway_weave.xodr"))
    return made


@pytest.fixture(scope="module")
def town(workspace: Workspace) -> LoadedMap:
    return load_map(workspace.map("town_5x5"))


def scenario(loaded: LoadedMap, **fields: Any) -> Scenario:
    graph = loaded.sumo.graph
    place = MapReference(name=graph.map_name, sha256=graph.map_sha256, spacing=graph.lanes.spacing)
    return Scenario.model_validate(
        {"name": "test", "map": place, "roi": tuple(map(str, graph.segments.ids)), **fields}
    )


def traffic(loaded: LoadedMap, *measures: dict[str, Any], **fields: Any) -> Scenario:
    """600 trips in 15 minutes on the whole town."""
    return scenario(
        loaded,
        demand={"background": [{"id": "b", "trips": 600.0}]},
        simulation={"duration": 900.0},
        measures=measures,
        **fields,
    )


def prepared(workspace: Workspace, one: Scenario, folder: Path, **settings: Any) -> SumoPreparedRun:
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / "scenario.json"
    file.write_text(dumps(one), encoding="utf-8")
    return prepare_run(check_file(workspace, file, settings=RunSettings(**settings)))


class Ended:
    """A run: events, outcomes by id, rows of trajectories."""

    def __init__(self, workspace: Workspace, one: Scenario, folder: Path, **settings: Any) -> None:
        result = run_prepared(prepared(workspace, one, folder, **settings), folder / "run")
        assert result.status == "completed", result.summary.get("error")
        self.folder = result.folder
        self.summary = result.summary
        self.events: tuple[Event, ...] = events_from_json(
            (self.folder / "events.json").read_text(encoding="utf-8")
        )
        text = (self.folder / "actors.json").read_text(encoding="utf-8")
        self.outcomes = {actor.id: actor for actor in actors_from_json(text)}
        recorded = read_trajectories(self.folder, most=10**9)
        assert recorded is not None
        self.rows = recorded.rows

    def on(self, loaded: LoadedMap, segment: str, begin: float, end: float) -> set[str]:
        """Vehicles on the lanes of a segment at some time between two."""
        lanes = [lane for lane, own in lane_segments(loaded.sumo).items() if own[0] == segment]
        rows = self.rows.filter(
            pl.col("timestep_time").is_between(begin, end) & pl.col("vehicle_lane").is_in(lanes)
        )
        return set(rows["vehicle_id"])

    def kinds(self, *kinds: EventKind) -> list[tuple[float, str, str]]:
        return [(one.time, one.kind.value, one.actor) for one in self.events if one.kind in kinds]


MEASURES = (EventKind.MEASURE_BEGIN, EventKind.MEASURE_END)
SHUT = {"id": "shut", "kind": "closure", "begin": 300.0, "end": 700.0, "places": ["r25"]}


@pytest.mark.slow
def test_nobody_enters_a_closed_road_and_the_parallel_roads_get_more(
    workspace: Workspace, town: LoadedMap, tmp_path: Path
) -> None:
    free = Ended(workspace, traffic(town), tmp_path / "free")
    shut = Ended(workspace, traffic(town, SHUT), tmp_path / "shut")
    assert shut.kinds(*MEASURES) == [
        (300.0, "measure_begin", "shut"),
        (700.0, "measure_end", "shut"),
    ]
    started = {one.id for one in shut.outcomes.values() if one.spawn.startswith("25.")}
    assert shut.on(town, "r25", 400.0, 700.0) <= started
    before, after = (counted(town, one.rows, begin=400.0, end=700.0) for one in (free, shut))
    assert before["r25"] > 20
    assert after["r23"] > before["r23"]
    assert after["r27"] > before["r27"]
    assert len(shut.on(town, "r25", 750.0, 900.0) - started) > 5  # open again
    assert shut.summary["actors"]["stranded"] == 0


@pytest.mark.slow
def test_a_closure_between_two_steps_ends_as_well(
    workspace: Workspace, town: LoadedMap, tmp_path: Path
) -> None:
    car = {"id": "late", "category": "car", "spawn": "15.0.-1.10", "goal": "25.0.-1.30"}
    closed = {"id": "shut", "kind": "closure", "begin": 0.0, "end": 20.2, "places": ["r25"]}
    short = {"id": "short", "kind": "closure", "begin": 0.0, "end": 0.1, "places": ["r13"]}
    one = scenario(
        town,
        actors=[car | {"depart": 40.0}],
        measures=[closed, short],
        simulation={"duration": 300.0, "step_length": 0.5},
    )
    run = Ended(workspace, one, tmp_path, time_limit=60.0)
    assert run.outcomes["late"].status.value == "arrived"
    assert run.summary["actors"]["stranded"] == 0


@pytest.mark.slow
def test_who_is_bound_for_a_closed_road_is_stranded_and_counted(
    workspace: Workspace, town: LoadedMap, tmp_path: Path
) -> None:
    cars = [
        {"id": "early", "category": "car", "spawn": "13.0.-1.20", "goal": "25.0.-1.30"},
        {"id": "late", "category": "car", "spawn": "15.0.-1.10", "goal": "25.0.-1.30"},
        {"id": "other", "category": "car", "spawn": "3.0.-1.10", "goal": "27.0.-1.30"},
    ]
    cars[1]["depart"] = 30.0  # type: ignore[assignment]
    closed = {"id": "shut", "kind": "closure", "begin": 10.0, "places": ["r25"]}
    run = Ended(
        workspace,
        scenario(town, actors=cars, measures=[closed], simulation={"duration": 300.0}),
        tmp_path,
    )
    assert {one.id: one.status.value for one in run.outcomes.values()} == {
        "early": "stranded",
        "late": "stranded",
        "other": "arrived",
    }
    (early, _, one), (late, _, other) = run.kinds(EventKind.STRANDED)
    assert (one, other) == ("early", "late")
    assert 10.0 <= early < 15.0  # it is inside a junction when the closure begins
    assert late == 30.5  # right after it has departed
    assert run.summary["actors"]["stranded"] == 2
    assert run.kinds(EventKind.MEASURE_END) == [(run.summary["sim_seconds"], "measure_end", "shut")]


@pytest.mark.slow
@pytest.mark.parametrize("destinations", ["end", "wait"])
def test_trips_to_a_closed_road_end_or_wait_before_it_if_the_measure_says_so(
    workspace: Workspace, town: LoadedMap, tmp_path: Path, destinations: str
) -> None:
    cars = [
        {"id": "early", "category": "car", "spawn": "13.0.-1.20", "goal": "25.0.-1.30"},
        {"id": "late", "category": "car", "spawn": "15.0.-1.10", "goal": "25.0.-1.30"},
    ]
    cars[1]["depart"] = 30.0  # type: ignore[assignment]
    closed = {
        "id": "shut",
        "kind": "closure",
        "begin": 10.0,
        "end": 200.0,
        "places": ["r25"],
        "destinations": destinations,
    }
    run = Ended(
        workspace,
        scenario(town, actors=cars, measures=[closed], simulation={"duration": 400.0}),
        tmp_path,
    )
    assert run.kinds(EventKind.STRANDED, EventKind.TELEPORT_START) == []
    assert {one.status.value for one in run.outcomes.values()} == {"arrived"}
    arrivals = [time for time, _, _ in run.kinds(EventKind.ARRIVED)]
    if destinations == "end":
        assert max(arrivals) < 200.0
        assert run.on(town, "r25", 0.0, 400.0) == set()
    else:
        assert 200.0 < min(arrivals) < max(arrivals) < 300.0
        assert run.on(town, "r25", 200.0, 400.0) == {"early", "late"}
        assert run.on(town, "r25", 10.0, 200.0) == set()


@pytest.mark.slow
def test_a_closed_turn_is_driven_around_and_only_by_those_that_it_is_closed_to(
    workspace: Workspace, town: LoadedMap, tmp_path: Path
) -> None:
    banned = {
        "id": "no-left",
        "kind": "permission",
        "places": ["r23>r33", "r23>r35"],
        "banned": ["car"],
    }
    run = Ended(workspace, traffic(town, banned, seed=2), tmp_path)
    rows = run.rows.sort("vehicle_id", "timestep_time")
    roads = {lane: own[0] for lane, own in lane_segments(town.sumo).items()}
    passed = rows.with_columns(
        pl.col("vehicle_lane").replace_strict(roads, default=None).alias("road")
    ).filter(pl.col("road").str.starts_with("r"))
    passed = passed.with_columns(pl.col("road").shift(1).over("vehicle_id").alias("before"))
    turns = set(passed.filter(pl.col("before") == "r23").filter(pl.col("road") != "r23")["road"])
    free = {"r34", "r22", "r24", "r12"}  # straight on, or back over the other end
    assert "r34" in turns
    assert turns <= free


@pytest.mark.slow
def test_a_sliced_run_that_is_killed_while_measures_act_ends_with_the_same_bytes(
    workspace: Workspace, town: LoadedMap, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    measures = [
        {**SHUT, "begin": 90.0, "end": 250.0},
        {"id": "slow", "kind": "speed_limit", "begin": 60, "end": 300, "places": ["r23"],
         "speed": 5.0},
        {"id": "bus", "kind": "permission", "places": ["12.0.-2"], "allowed": ["bus"]},
        {"id": "dark", "kind": "signal_outage", "begin": 50, "end": 290, "junction": "10016"},
        {"id": "broken", "kind": "incident", "begin": 80, "end": 260, "lane": "34.0.-1", "s": 40},
    ]  # fmt: skip
    one = traffic(town, *measures).model_copy(
        update={"simulation": traffic(town).simulation.model_copy(update={"duration": 360.0})}
    )
    town_run = prepared(workspace, one, tmp_path / "one", slice_length=120.0)
    alone = run_prepared(town_run, tmp_path / "alone")
    assert alone.status == "completed", alone.summary.get("error")
    events = events_from_json((alone.folder / "events.json").read_text(encoding="utf-8"))
    assert sum(event.kind in MEASURES for event in events) == 2 * len(measures)
    for after in (1, 2):
        run = tmp_path / f"after{after}"
        killed(town_run, run, monkeypatch, KILL_AFTER_SLICE=after)
        resume(run)
        assert results(run) == results(alone.folder)
    shut = Ended(workspace, one, tmp_path / "again", slice_length=120.0)
    started = {actor.id for actor in shut.outcomes.values() if actor.spawn.startswith("25.")}
    started |= shut.on(town, "r25", 0.0, 90.0)  # who was there when it was closed drives out
    assert shut.on(town, "r25", 150.0, 250.0) <= started  # closed on both sides of a boundary
    speeds = shut.rows.filter(
        pl.col("vehicle_lane").is_in(
            [lane for lane, own in lane_segments(town.sumo).items() if own == ("r23",)]
        )
        & pl.col("timestep_time").is_between(100.0, 290.0)
        & (pl.col("vehicle_id") != "broken")
    )["vehicle_speed"]
    fastest = max(one.speed_factor for one in town_run.plan.actors) * 5.0
    assert 4.0 < float(speeds.max() or 0.0) < fastest + 0.1  # type: ignore[arg-type]
    states = pl.read_parquet(shut.folder / "signal_states" / "*.parquet")
    assert states.height > 0


@pytest.mark.slow
def test_the_vehicle_of_an_incident_stops_where_and_when_it_is_to(
    workspace: Workspace, town: LoadedMap, tmp_path: Path
) -> None:
    broken = {"id": "broken", "kind": "incident", "begin": 100, "end": 200, "lane": "34.0.-1",
              "s": 40}  # fmt: skip
    car = {"id": "a", "category": "car", "spawn": "1.0.-1.10"}
    run = Ended(
        workspace,
        scenario(town, actors=[car], measures=[broken], simulation={"duration": 300.0}),
        tmp_path,
    )
    stopped = run.rows.filter((pl.col("vehicle_id") == "broken") & (pl.col("vehicle_speed") < 0.1))
    assert 99.0 <= float(stopped["timestep_time"].min()) <= 103.0  # type: ignore[arg-type]
    assert 199.0 <= float(stopped["timestep_time"].max()) <= 200.5  # type: ignore[arg-type]
    assert "broken" not in run.outcomes  # it is no actor, and in no figure of actors


@pytest.mark.slow
def test_the_queue_before_an_accident_grows_and_dissolves(
    workspace: Workspace, tmp_path: Path
) -> None:
    loaded = load_map(workspace.map("motorway_weave"))
    short = motorway(loaded)
    short = short.model_copy(
        update={
            "simulation": short.simulation.model_copy(update={"duration": 1800.0}),
            "measures": accident(begin=300.0, end=1500.0),
        }
    )
    run = Ended(workspace, short, tmp_path)
    queued = queue(loaded, run.rows, every=60.0)
    assert max(queued.get(float(time), 0) for time in range(0, 301, 60)) <= 3
    assert queued.get(900.0, 0) > 10
    assert queued.get(1440.0, 0) > 1.5 * queued.get(900.0, 0)
    assert max(queued.get(float(time), 0) for time in (1680, 1740)) <= 3
    assert run.summary["actors"]["teleported"] == 0


def test_a_light_that_fails_shows_nothing_and_comes_back(
    workspace: Workspace, town: LoadedMap, tmp_path: Path
) -> None:
    dark = {"id": "dark", "kind": "signal_outage", "begin": 50, "end": 150, "junction": "10016"}
    flash = {**dark, "id": "flash", "junction": "10022", "shows": "flashing"}
    car = {"id": "a", "category": "car", "spawn": "1.0.-1.10"}
    car2 = {"id": "b", "category": "car", "spawn": "3.0.-1.10", "depart": 250}
    run = Ended(
        workspace,
        scenario(town, actors=[car, car2], measures=[dark, flash], simulation={"duration": 300.0}),
        tmp_path,
    )
    states = pl.read_parquet(run.folder / "signal_states.parquet")
    for light in ("J10016", "J10022"):
        own = states.filter(pl.col("light") == light)
        failed = own.filter(pl.col("time").is_between(50.5, 149.5))
        assert set("".join(failed["state"])) <= set("oO")
        later = own.filter(pl.col("time") > 150.0)
        assert "G" in "".join(later["state"])


@pytest.mark.slow
def test_a_bus_that_is_led_around_keeps_the_stops_that_it_can_reach(
    workspace: Workspace, town: LoadedMap, tmp_path: Path
) -> None:
    transit = {
        "stops": [
            {"id": "on", "node": "23.0.-1.25"},
            {"id": "beyond", "node": "36.0.-1.15"},
        ],
        "lines": [
            {
                "id": "line",
                "start": "12.0.-1.5",
                "goal": "36.0.-1.30",
                "stops": [{"stop": "on"}, {"stop": "beyond"}],
                "departures": [0, 60],
                "dwell": {"kind": "constant", "value": 10},
            }
        ],
    }
    closed = {"id": "m", "kind": "closure", "begin": 20.0, "places": ["r35"]}
    free, led = (
        Ended(
            workspace,
            scenario(town, transit=transit, measures=measures, simulation={"duration": 500.0}),
            tmp_path / name,
        )
        for name, measures in (("free", []), ("led", [closed]))
    )
    for run in (free, led):
        assert {one.status.value for one in run.outcomes.values()} == {"arrived"}
        visited = run.rows.filter(pl.col("vehicle_speed") < 0.1)
        roads = {lane: own[0] for lane, own in lane_segments(town.sumo).items()}
        at = {
            (name, roads.get(lane))
            for name, lane in visited.select("vehicle_id", "vehicle_lane").iter_rows()
        }
        for bus in run.outcomes:
            assert {(bus, "r23"), (bus, "r36")} <= at
    assert free.on(town, "r35", 0.0, 500.0)
    assert not led.on(town, "r35", 60.0, 500.0)
