from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import polars as pl
import pytest

from odscen.base.durations import clock, parse_duration
from odscen.base.errors import InputError, SimulationError
from odscen.runs.parts import tidy_part
from odscen.runs.recording import Recording, parse_recording, region_xml
from odscen.sumo.realize.sumocfg import SumocfgSettings, sumo_config
from odscen.sumo.runner.run_jobs import run_prepared
from odscen.sumo.worker.route_slices import RouteSlices
from tests.sumo.conftest import TYPES, WALK, Prepare


@pytest.mark.parametrize(
    ("text", "seconds"),
    [("24h", 86_400), ("1h30m", 5400), ("90min", 5400), ("10s", 10), ("3600", 3600), (".5h", 1800)],
)
def test_a_length_of_time_is_read_as_people_write_it(text: str, seconds: float) -> None:
    assert parse_duration(text) == seconds


@pytest.mark.parametrize("text", ["", "soon", "-5", "0", "24 hours", "inf", "nan", "1h x"])
def test_what_is_no_length_of_time_is_refused_with_examples(text: str) -> None:
    with pytest.raises(InputError, match="write for example 24h"):
        parse_duration(text)


def test_a_clock_counts_hours_without_end() -> None:
    assert clock(26 * 3600 + 300) == "26:05"


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("often", "'often' is not one of none"),
        ("region=1:2:3", "four numbers"),
        ("region=5:0:1:9", "is empty"),
        ("columns=lane+signals", "no column 'signals'"),
        ("every=never", "no length of time"),
    ],
)
def test_what_cannot_be_recorded_is_refused_with_what_can(text: str, problem: str) -> None:
    with pytest.raises(InputError, match=problem):
        parse_recording(text)


def test_every_part_of_a_recording_is_read() -> None:
    read = parse_recording("every=2s,region=0:-10:50.5:20,columns=pos+lane")
    assert read == Recording(every=2.0, region=(0, -10, 50.5, 20), columns=("lane", "pos"))
    assert parse_recording("none") == Recording(trajectories=False)


def recorded(prepare: Prepare, out: Path, text: str) -> pl.DataFrame:
    """Trajectories of the small run with this recording."""
    run = prepare()
    recording = parse_recording(text)
    settings = SumocfgSettings(until=200.0, step_length=0.5, seed=7, recording=recording)
    files = {**run.sumo_files, "scenario.sumocfg": sumo_config(settings)}
    if recording.region is not None:
        files["region.add.xml"] = region_xml(recording.region, run.plan.net_offset)
    result = run_prepared(replace(run, sumo_files=files), out)
    assert result.status == "completed", result.summary["error"]
    return pl.read_parquet(out / "trajectories.parquet")


@pytest.mark.slow
def test_records_every_two_seconds_are_those_of_all_records_at_these_times(
    prepare: Prepare, tmp_path: Path
) -> None:
    run_prepared(prepare(), tmp_path / "all")
    everything = pl.read_parquet(tmp_path / "all" / "trajectories.parquet")
    some = recorded(prepare, tmp_path / "some", "every=2s")
    assert some.equals(everything.filter(pl.col("timestep_time") % 2 == 0))


@pytest.mark.slow
def test_a_region_records_those_inside_and_nobody_far_from_it(
    prepare: Prepare, tmp_path: Path
) -> None:
    run_prepared(prepare(), tmp_path / "all")
    everything = pl.read_parquet(tmp_path / "all" / "trajectories.parquet")
    some = recorded(prepare, tmp_path / "some", "region=50:-20:100:20,columns=pos")
    assert "vehicle_pos" in some.columns
    assert "vehicle_lane" not in some.columns
    inside = everything.filter(pl.col("vehicle_x").is_between(50, 100))
    assert 0 < some.height < everything.height
    keys = ["timestep_time", "vehicle_id"]
    assert inside.join(some, on=keys, how="anti").is_empty()
    assert some["vehicle_x"].is_between(50 - 5, 100 + 5).all()  # a body's length beside it


@pytest.mark.slow
def test_a_run_that_records_no_trajectories_has_everything_else(
    prepare: Prepare, tmp_path: Path
) -> None:
    run = prepare()
    settings = SumocfgSettings(
        until=200.0, step_length=0.5, seed=7, recording=Recording(trajectories=False)
    )
    files = {**run.sumo_files, "scenario.sumocfg": sumo_config(settings)}
    quiet = replace(run, plan=replace(run.plan, trajectories=False), sumo_files=files)
    result = run_prepared(quiet, tmp_path / "quiet")
    assert result.summary["actors"]["arrived"] == 5
    assert "trajectories" not in result.summary["files"]
    run_prepared(run, tmp_path / "run")
    first, second = (tmp_path / name / "actors.json" for name in ("quiet", "run"))
    assert first.read_bytes() == second.read_bytes()


def test_a_part_in_which_persons_come_first_gets_the_columns_of_all(tmp_path: Path) -> None:
    part = tmp_path / "part.parquet"
    pl.DataFrame({"timestep_time": [0.0], "person_id": ["a"], "person_x": [1.0]}).write_parquet(
        part
    )
    tidy_part(part)
    assert pl.read_parquet(part).columns == ["timestep_time", "vehicle_id", "vehicle_x"]


def test_a_torn_part_is_refused_and_an_empty_one_left_out(tmp_path: Path) -> None:
    part = tmp_path / "part.parquet"
    part.write_bytes(b"PAR1 and then the disk was full")
    with pytest.raises(SimulationError, match="disk may be full"):
        tidy_part(part)
    pl.DataFrame({"timestep_time": pl.Series([], dtype=pl.Float64)}).write_parquet(part)
    tidy_part(part)
    assert not part.exists()


ROUTES = """<routes>
    <vType id="car"/>
    <vehicle id="a" type="car" depart="0"><route edges="x"/></vehicle>
    <person id="p" depart="59.5">
        <walk edges="x"/>
    </person>
    <vehicle id="b" type="car" depart="60"><route edges="x"/></vehicle>
</routes>
"""


def test_routes_are_cut_by_departure_and_every_part_knows_the_types(tmp_path: Path) -> None:
    routes, target = tmp_path / "r.xml", tmp_path / "t.xml"
    routes.write_text(ROUTES)
    slices = RouteSlices(routes)
    first = slices.cut(0, 60.0, target)
    lines = ROUTES.splitlines(keepends=True)
    assert target.read_text() == "".join(lines[:6]) + "</routes>\n"
    assert slices.more(first)
    second = slices.cut(first, 120.0, target)
    assert target.read_text() == "".join([*lines[:2], lines[6]]) + "</routes>\n"
    assert not slices.more(second)
    assert slices.cut(second, 180.0, target) == second
    assert target.read_text() == "".join(lines[:2]) + "</routes>\n"


def test_routes_out_of_order_are_refused(tmp_path: Path) -> None:
    routes = tmp_path / "r.xml"
    routes.write_text(ROUTES.replace('depart="59.5"', 'depart="61"'))
    with pytest.raises(SimulationError, match="not in order of departure at 60 s"):
        RouteSlices(routes).cut(0, 200.0, tmp_path / "t.xml")


@pytest.mark.slow
def test_columns_have_one_name_whoever_comes_first(prepare: Prepare, tmp_path: Path) -> None:
    """SUMO names them after a walker who is on the road before any vehicle."""
    car = (
        '<vehicle id="car0" type="car" depart="10" departLane="1">'
        '<route edges="A0B0 B0C0"/></vehicle>'
    )
    routes = f"<routes>{TYPES}\n{WALK}\n{car}\n</routes>"
    result = run_prepared(prepare(cars=1, until=30.0, routes=routes), tmp_path / "run")
    rows = pl.read_parquet(result.folder / "trajectories.parquet")
    assert rows["vehicle_id"][0] == "walker"
    assert set(rows["vehicle_id"]) == {"walker", "car0"}
    assert not [name for name in rows.columns if name.startswith("person_")]
