"""Figures of traffic held against what plain SUMO says of the same traffic by other means.

One run of SUMO writes lane data, which our figures are made of, and beside it tripinfo, induction
loops, and speed and emissions of every vehicle in every step.
"""

from __future__ import annotations

import os
import random
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import polars as pl
import pytest
import sumo
from lxml import etree

from odscen.figures.by_place.control_delay import lost_time, vehicle_passages
from odscen.figures.by_place.facilities import (
    FacilityData,
    NetFacts,
    highway_density,
    movement_facilities,
    passage_sums,
)
from odscen.figures.by_place.lane_groups import LaneGroups, lane_groups
from odscen.figures.by_place.lane_parts import lane_parts
from odscen.figures.by_place.queue_metres import GAP, QUEUED, queue_backs, queue_sums
from odscen.figures.by_place.queues import queue_lengths
from odscen.figures.by_place.station_figures import station_figures
from odscen.figures.by_place.traffic import TrafficFigures, over_run, traffic_figures
from odscen.figures.by_place.traffic_sums import intervals, summable
from odscen.figures.measures.figure import RunData
from odscen.figures.measures.registry import figure_values
from odscen.records.run_plan import PlannedStation, StationKind
from odscen.runs import layout
from odscen.runs.net_facts import read_net_facts
from odscen.sumo.outputs.output_tables import lane_table, trip_table
from odscen.sumo.realize.measure_files import measures_xml
from odscen.sumo.realize.sumo_lane_places import lane_places
from tests.sumo.conftest import BIN
from tests.sumo.runner.test_on_maps import built, net_file

col = pl.col
MAP = "signal_crossing"
STEP = 0.1
UNTIL = 1200.0
NUMBER = 120
"""Of vehicles."""
ARMS = ("1", "2", "3", "4")
CLOSE = 0.005
"""Of a figure: half a per cent."""
LOOP = 0.5
"""Metres before the end of a lane."""

TYPES = (
    '<vType id="car" emissionClass="HBEFA4/PC_petrol_Euro-4" speedFactor="1" speedDev="0"/>'
    '<vType id="truck" vClass="truck" length="9" emissionClass="HBEFA4/RT_le7.5t_Euro-VI_A-C"'
    ' maxSpeed="10" speedFactor="1" speedDev="0"/>'
)


@dataclass(frozen=True)
class Run:
    folder: Path
    figures: TrafficFigures
    steps: pl.DataFrame
    trips: pl.DataFrame
    stretches: pl.DataFrame
    backs: pl.DataFrame
    groups: LaneGroups
    stations: pl.DataFrame

    def loops(self, edge: str) -> int:
        """Vehicles that induction loops counted on all lanes of an edge."""
        root = etree.parse(self.folder / "loops.xml").getroot()
        found = [one for one in root if one.get("id").rpartition("_")[0] == edge]
        assert found
        return sum(int(one.get("nVehContrib")) for one in found)


def routes() -> str:
    chance = random.Random(5)
    departs = sorted(round(chance.uniform(0.0, 800.0), 1) for _ in range(NUMBER))
    lines = ["<routes>", TYPES]
    for number, depart in enumerate(departs):
        source, target = chance.sample(ARMS, 2)
        kind = "truck" if number % 8 == 0 else "car"
        edges = f"{source}.0.f {source}.1.f {target}.1.b {target}.0.b"
        lines.append(
            f'<vehicle id="v{number}" type="{kind}" depart="{depart}" departLane="best"'
            f' departPos="0" departSpeed="max"><route edges="{edges}"/></vehicle>'
        )
    return "\n".join([*lines, "</routes>"])


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    folder = tmp_path_factory.mktemp("plain")
    sumo_map = built(MAP).sumo
    net_file(MAP, folder)
    lanes: dict[str, dict[str, float]] = {}
    for lane in sumo_map.net.lanes.values():
        if lane.allows("passenger"):
            lanes.setdefault(lane.edge, {})[lane.id] = lane.length
    (folder / "routes.rou.xml").write_text(routes())
    (folder / "measures.add.xml").write_text(measures_xml(60.0, emissions=True))
    loops = [
        f'<inductionLoop id="{lane}" lane="{lane}" pos="-{LOOP}" period="{UNTIL:g}"'
        ' file="loops.xml"/>'
        for edge, own in lanes.items()
        if not edge.startswith(":")
        for lane in own
    ]
    ends = [
        f'<det{end} lane="{lane}" pos="{pos}"/>'
        for end, direction, pos in (("Entry", "f", 5), ("Exit", "b", -15))
        for arm in ARMS
        for lane in lanes[f"{arm}.0.{direction}"]
    ]
    around = f'<entryExitDetector id="around" period="{UNTIL:g}" file="around.xml">'
    loops += [around, *ends, "</entryExitDetector>"]
    loops += [
        f'<laneAreaDetector id="{last}" lanes="{first} {last}" pos="0" endPos="-0.01"'
        f' friendlyPos="true" period="{STEP:g}" file="queues.xml" speedThreshold="{QUEUED}"'
        f' timeThreshold="0" jamThreshold="{GAP:g}"/>'
        for arm in ARMS
        for first, last in zip(lanes[f"{arm}.0.f"], lanes[f"{arm}.1.f"], strict=True)
    ]
    (folder / "loops.add.xml").write_text("\n".join(["<additional>", *loops, "</additional>"]))
    subprocess.run(
        [
            BIN / "sumo", "-n", f"{MAP}.net.xml", "-r", "routes.rou.xml",
            "-a", "measures.add.xml,loops.add.xml", "--tripinfo-output", "trips.xml",
            "--emission-output", "steps.csv", "--fcd-output", "fcd.parquet",
            "--fcd-output.attributes", "id,x,y,speed,lane", "--end", str(UNTIL), "--seed", "3",
            "--step-length", str(STEP), "--precision", "6", "--no-step-log", "--no-warnings",
        ],
        cwd=folder,
        env={**os.environ, "SUMO_HOME": sumo.SUMO_HOME},
        check=True,
    )  # fmt: skip
    table = lane_table(folder / "lanes.parquet", folder / "emissions.parquet", lanes)
    places = lane_places(sumo_map)
    queues = queue_lengths(pl.scan_parquet(folder / "fcd.parquet"), places, intervals(table, UNTIL))
    steps = pl.read_csv(folder / "steps.csv", separator=";").drop_nulls("vehicle_id")
    trips = trip_table(folder / "trips.xml", unfinished=True)
    assert trips.height == NUMBER
    assert trips["arrival"].null_count() == 0
    facts = facts_of(folder)
    rows = pl.scan_parquet(folder / "fcd.parquet")
    stretches = lost_time(rows, places, facts.limits, facts.drivers, period=STEP)
    passed = vehicle_passages(rows, places, facts)
    assert stretches is not None
    assert passed is not None
    kinds = movement_facilities(places, facts)
    clock = intervals(table, UNTIL)
    parts = lane_parts(summable(table), places, None)
    facilities = FacilityData(
        kinds, *passage_sums(passed, kinds, clock), highway_density(parts, places, facts, None)
    )
    figures = traffic_figures(table, places, end=UNTIL, queues=queues, facilities=facilities)
    groups = lane_groups(places, facts)
    backs = queue_backs(rows, groups, facts)
    assert backs is not None
    stations = station_figures(rows, planned(lanes), facts, WHOLE)
    assert stations is not None
    return Run(folder, figures, steps, trips, stretches, backs, groups, stations)


def planned(lanes: dict[str, dict[str, float]]) -> list[PlannedStation]:
    """Stations where SUMO's detectors are."""
    last = {lane: length for own in lanes.values() for lane, length in own.items()}
    found = [
        PlannedStation(f"loop {lane}", "detector", ((lane, last[lane] - LOOP),))
        for arm in ARMS
        for lane in lanes[f"{arm}.1.f"]
    ]
    entries = tuple((lane, 5.0) for arm in ARMS for lane in lanes[f"{arm}.0.f"])
    exits = tuple((lane, last[lane] - 15.0) for arm in ARMS for lane in lanes[f"{arm}.0.b"])
    kinds: tuple[StationKind, ...] = ("section", "cordon")
    return found + [PlannedStation(kind, kind, entries, exits) for kind in kinds]


def facts_of(folder: Path) -> NetFacts:
    """What net and routes of the folder say, laid out as in a run."""
    inside = folder / "run" / layout.SUMO_FOLDER
    inside.mkdir(parents=True)
    shutil.copy(folder / f"{MAP}.net.xml", inside / layout.NET_FILE)
    shutil.copy(folder / "routes.rou.xml", inside / layout.ROUTES_FILE)
    facts = read_net_facts(folder / "run")
    assert facts is not None
    return facts


def of(table: pl.DataFrame, **key: str) -> dict[str, float]:
    """Row of a place over the whole run."""
    ((name, value),) = key.items()
    return over_run(table).row(by_predicate=col(name) == value, named=True)


@pytest.mark.slow
def test_delay_and_travel_time_are_those_of_tripinfo(run):
    network = over_run(run.figures.network).row(0, named=True)
    assert network["vehicles"] == network["departed"] == network["arrived"] == NUMBER
    assert network["delay"] == pytest.approx(run.trips["time_loss"].mean(), rel=CLOSE)
    assert network["seconds"] / NUMBER == pytest.approx(run.trips["duration"].mean(), rel=CLOSE)
    assert network["distance"] == pytest.approx(run.trips["route_length"].sum(), rel=CLOSE)
    assert run.trips["time_loss"].mean() > 10.0, "else there is nothing to be measured"


@pytest.mark.slow
def test_time_lost_on_all_stretches_is_that_of_tripinfo_for_each_vehicle(run):
    parts = ("behind", "on_the_way", "before", "inside")
    ours = run.stretches.group_by("id").agg(pl.sum_horizontal(parts).sum().alias("ours"))
    both = ours.join(run.trips.select("id", "time_loss"), on="id")
    assert both.height == NUMBER
    assert both["ours"].sum() == pytest.approx(both["time_loss"].sum(), rel=2.0 * CLOSE)
    # Trucks, every eighth, are slower in turns by restrictions of edge types, which are not in the
    # limits of lanes: for SUMO they lose less.
    heavy = both["id"].str.slice(1).cast(int) % 8 == 0
    error = both["ours"] - both["time_loss"]
    assert error.filter(~heavy).abs().max() < 0.5
    assert 0.0 <= error.filter(heavy).max() < 2.0


def test_control_delay_is_what_a_detector_around_the_junction_measures_but_for_the_cruise(run):
    """SUMO's E3 detector: time lost from 5 m behind the start to 15 m before the end."""
    (found,) = etree.parse(run.folder / "around.xml").getroot()
    assert int(found.get("vehicleSum")) == NUMBER
    on_the_way = run.stretches["on_the_way"].sum() / NUMBER
    junction = of(run.figures.junctions, junction="j10001")
    assert (junction["facility"], junction["passages"]) == ("signal", NUMBER)
    lost = float(found.get("meanTimeLoss"))
    assert junction["control_delay"] == pytest.approx(lost - on_the_way, rel=2 * CLOSE)
    assert 0.0 < on_the_way < 0.05 * lost
    assert junction["level"] == "C" if junction["control_delay"] > 20.0 else "B"
    movements = over_run(run.figures.movements)
    assert movements["passages"].sum() == NUMBER
    assert movements["control_seconds"].sum() == pytest.approx(junction["control_seconds"])


def test_flows_are_those_of_induction_loops(run):
    hours = UNTIL / 3600.0
    for arm in ARMS:
        into, out = run.loops(f"{arm}.0.f"), run.loops(f"{arm}.1.b")
        segment = of(run.figures.segments, segment=f"r{arm}")
        assert segment["vehicles"] == into + out
        assert segment["flow"] == pytest.approx((into + out) / hours, rel=CLOSE)
    junction = of(run.figures.junctions, junction="j10001")
    assert junction["throughput"] == sum(run.loops(f"{arm}.1.f") for arm in ARMS) == NUMBER


def test_movements_are_the_routes_that_were_driven(run):
    root = etree.fromstring(routes().encode())
    driven = [vehicle[0].get("edges").split() for vehicle in root.iter("vehicle")]
    planned = pl.Series([f"r{way[0][0]}>j10001>r{way[-1][0]}" for way in driven]).value_counts()
    found = over_run(run.figures.movements).select("movement", "vehicles").sort("movement")
    assert found.rows() == sorted(planned.rows())


@pytest.mark.parametrize(
    ("ours", "theirs"),
    [("co2", "vehicle_CO2"), ("fuel", "vehicle_fuel"), ("nox", "vehicle_NOx")],
)
def test_emissions_and_fuel_are_those_of_every_vehicle_and_step(run, ours, theirs):
    grams = run.steps[theirs].sum() * STEP / 1000.0
    whole = over_run(run.figures.network)[ours][0]
    assert whole == pytest.approx(grams, rel=CLOSE)
    places = run.figures.segments[ours].sum() + run.figures.junctions[ours].sum()
    assert places == pytest.approx(whole), "every lane is in exactly one place"


def test_speed_and_density_of_a_segment_are_those_of_its_vehicles(run):
    # Between its two edges lies a lane of 0.1 m on which one can stop, too.
    on = run.steps.filter(col("vehicle_lane").str.contains(r"^3\.|^:N3\."))
    segment = of(run.figures.segments, segment="r3")
    assert segment["speed"] == pytest.approx(on["vehicle_speed"].mean(), rel=2 * CLOSE)
    number = on.height * STEP / UNTIL
    assert segment["density"] * segment["length"] == pytest.approx(number, rel=2 * CLOSE)
    assert segment["flow"] == pytest.approx(segment["density"] * segment["speed"] * 3.6)


def test_delay_of_a_junction_is_lost_before_and_in_it(run):
    limits = {lane.id: lane.speed for lane in built(MAP).sumo.net.lanes.values()}
    to_it = col("vehicle_lane").str.contains(r"^:J10001|^\d\.\d\.f_|^:N\d\.105\.0_[12]_0")
    wished = pl.min_horizontal(
        col("vehicle_lane").replace_strict(limits, return_dtype=pl.Float64),
        pl.when(col("vehicle_type") == "truck").then(10.0).otherwise(1000.0),
    )
    lost = (
        run.steps.filter(to_it)
        .select(((1.0 - col("vehicle_speed") / wished).clip(0.0) * STEP).sum())
        .item()
    )
    junction = of(run.figures.junctions, junction="j10001")
    assert junction["delay"] == pytest.approx(lost / NUMBER, rel=2 * CLOSE)
    movements = over_run(run.figures.movements)
    shared = (movements["delay"] * movements["vehicles"]).sum()
    assert shared == pytest.approx(lost, rel=0.05), "what is lost where nobody gets on is nobody's"
    assert junction["control"] == "signal"


def test_queues_are_those_who_stand_at_one_time(run):
    to_it = col("vehicle_lane").str.contains(r"^:J10001|^\d\.\d\.f_|^:N\d\.105\.0_[12]_0")
    standing = (
        run.steps.filter(to_it & (col("vehicle_speed") < 0.1)).group_by("timestep_time").len()
    )
    row = of(run.figures.junctions, junction="j10001")
    assert row["queue_max"] == standing["len"].max()
    assert row["standing"] == pytest.approx(standing["len"].sum() * STEP / UNTIL, rel=0.02)
    junction = run.figures.junctions.filter(col("junction") == "j10001")
    assert (junction["queue_p95"] <= junction["queue_max"]).all()


def test_figures_of_the_run_are_ratios_of_its_trips(run):
    found = figure_values(RunData(traffic=run.figures, trips=run.trips))
    trips = [
        (float(trip.get("duration")), float(trip.get("timeLoss")))
        for trip in etree.parse(run.folder / "trips.xml").getroot()
    ]
    ratios = sorted(duration / (duration - lost) for duration, lost in trips)
    assert found["travel_time_index"] == pytest.approx(sum(ratios) / len(ratios))
    assert ratios[112] <= found["planning_time_index"] <= ratios[114]
    share = found["planning_time_index"] / found["travel_time_index"] - 1.0
    assert found["buffer_index"] == pytest.approx(share)
    assert found["throughput"] == pytest.approx(NUMBER / UNTIL * 3600.0)
    assert found["co2_per_km"] * found["vehicle_km"] == pytest.approx(1000.0 * found["co2_total"])


@pytest.mark.slow
def test_queues_in_metres_are_those_of_detectors_along_the_lanes(run):
    """SUMO's E2 detectors: jams from the first front to the last rear; ours from the stop line."""
    root = etree.parse(run.folder / "queues.xml").getroot()
    jams = pl.DataFrame(
        [
            (one.get("id"), float(one.get("begin")), float(one.get("maxJamLengthInMeters")))
            for one in root
        ],
        schema=("source", "time", "jam"),
        orient="row",
    ).filter(col("jam") > 0.0)
    alone = run.groups.ways.join(run.groups.groups.filter(col("lanes") == 1), on="lane_group")
    pairs = alone.select("lane_group", "source").unique().rows()
    assert len(pairs) == 2 * len(ARMS)
    table = queue_sums(run.backs, run.groups, WHOLE, step=STEP)
    checked = 0
    for group, source in pairs:
        ours = run.backs.filter(col("lane_group") == group)
        theirs = jams.filter(col("source") == source)
        longest = theirs["jam"].max()
        if longest < 10.0:  # one vehicle that has not come to its stop
            continue
        checked += 1
        row = table.row(by_predicate=col("lane_group") == group, named=True)
        assert row["queue_metres_max"] - TO_LINE == pytest.approx(longest, rel=0.01)
        both = ours.join(theirs, on="time")
        # While the first drive off, a jam begins behind them, and the queue is still at the line.
        assert (both["metres"] - both["jam"]).median() == pytest.approx(TO_LINE, abs=0.1)
        assert both.height > 0.8 * theirs.height, "a jam far from the line is no queue of ours"
    assert checked >= 6


WHOLE = pl.DataFrame({"begin": [0.0], "end": [UNTIL]})
TO_LINE = 1.0
"""Metres before the stop line at which SUMO's vehicles stop."""


def test_detectors_of_a_study_count_what_induction_loops_do(run):
    """SUMO's E1 detectors: vehicles, their mean speed, and occupancy in per cent."""
    loops = {
        one.get("id"): one
        for one in etree.parse(run.folder / "loops.xml").getroot()
        if int(one.get("nVehContrib")) > 0
    }
    ours = run.stations.filter((col("kind") == "detector") & (col("vehicles") > 0))
    assert ours["vehicles"].sum() == NUMBER
    for row in ours.iter_rows(named=True):
        theirs = loops[row["station"].removeprefix("loop ")]
        assert row["vehicles"] == int(theirs.get("nVehContrib"))
        assert row["flow"] == pytest.approx(row["vehicles"] * 3600.0 / UNTIL)
        assert row["speed"] == pytest.approx(float(theirs.get("speed")), rel=0.01)
        assert 100.0 * row["occupancy"] == pytest.approx(float(theirs.get("occupancy")), rel=0.01)


def test_sections_and_cordons_of_a_study_measure_what_entry_exit_detectors_do(run):
    """SUMO's E3 detector with the same lines."""
    (found,) = etree.parse(run.folder / "around.xml").getroot()
    section, cordon = run.stations.filter(col("kind") != "detector").rows(named=True)
    assert section["vehicles"] == cordon["vehicles"] == cordon["left"] == NUMBER
    assert cordon["balance"] == 0
    assert section["travel_time"] == pytest.approx(float(found.get("meanTravelTime")), rel=0.01)
