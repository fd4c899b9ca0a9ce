"""Figures of a T-junction with a stop sign, held against SUMO's detectors in the same run.

For ten minutes the stem (road 3) has gaps enough; for ten more it is sent more than it can carry.
"""

from __future__ import annotations

import math
import os
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import polars as pl
import pytest
import sumo
from lxml import etree

from odscen.figures.by_place.control_delay import vehicle_passages
from odscen.figures.by_place.facility_levels import place_level
from odscen.figures.by_place.group_figures import group_rates, group_sums
from odscen.figures.by_place.queue_metres import GAP, QUEUED
from odscen.runs import layout
from odscen.runs.net_facts import read_net_facts
from odscen.sumo.realize.sumo_lane_places import lane_places
from tests.sumo.conftest import BIN
from tests.sumo.runner.test_on_maps import built, net_file

col = pl.col
MAP = "t_junction_signs"
HALF, UNTIL, STEP = 600.0, 1200.0, 0.2
LENGTH = 5.0
"""Metres, of a car."""
CLOCK = pl.DataFrame({"begin": [0.0, HALF], "end": [HALF, UNTIL]})
STEM = "r3>j10001>r1 + r3>j10001>r2"
TURNS = {
    "r1>j10001>r2": "1.2.f 2.1.b",
    "r1>j10001>r3": "1.2.f 3.1.b",
    "r2>j10001>r1": "2.1.f 1.2.b",
    "r2>j10001>r3": "2.1.f 3.1.b",
    "r3>j10001>r1": "3.0.f 3.1.f 1.2.b",
    "r3>j10001>r2": "3.0.f 3.1.f 2.1.b",
}
"""Movements, and the edges before and behind the junction."""
HOURLY = {"r1>j10001>r2": 180, "r1>j10001>r3": 60, "r2>j10001>r1": 240, "r2>j10001>r3": 48,
          "r3>j10001>r1": 60, "r3>j10001>r2": 60}  # fmt: skip


@dataclass(frozen=True)
class Run:
    folder: Path
    table: pl.DataFrame
    passed: pl.DataFrame

    def group(self, name: str, begin: float) -> dict[str, float]:
        found = (col("lane_group") == name) & (col("begin") == begin)
        return self.table.row(by_predicate=found, named=True)

    def loop(self, lane: str, begin: float) -> int:
        """Vehicles that an induction loop at the stop line counted in an interval."""
        root = etree.parse(self.folder / "loops.xml").getroot()
        return sum(
            int(one.get("nVehEntered"))
            for one in root
            if one.get("id") == lane and float(one.get("begin")) == begin
        )


def routes() -> str:
    lines = [
        "<routes>",
        '<vType id="car" speedFactor="1" speedDev="0"/>',
        '<vType id="late" speedFactor="1" speedDev="0"/>',
    ]
    departs = [
        (HALF * (k + 0.5) / (hourly / 6), movement)
        for movement, hourly in HOURLY.items()
        for k in range(hourly // 6)
    ]
    # In the second half the street goes on as before, and the stem is full.
    departs += [
        (HALF + depart, movement) for depart, movement in departs if not movement.startswith("r3")
    ]
    departs += [(HALF + 2.0 * k, f"r3>j10001>r{1 + k % 2}") for k in range(280)]
    for number, (depart, movement) in enumerate(sorted(departs)):
        lines.append(
            f'<vehicle id="v{number}" type="car" depart="{depart:.1f}" departPos="0"'
            f' departSpeed="max"><route edges="{TURNS[movement]}"/></vehicle>'
        )
    return "\n".join([*lines, "</routes>"])


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    folder = tmp_path_factory.mktemp("stop")
    sumo_map = built(MAP).sumo
    inside = folder / "run" / layout.SUMO_FOLDER
    inside.mkdir(parents=True)
    shutil.copy(net_file(MAP, folder), inside / layout.NET_FILE)
    (inside / layout.ROUTES_FILE).write_text(routes())
    _, stem = stem_lanes()
    (folder / "detectors.add.xml").write_text(
        "<additional>"
        f'<inductionLoop id="{stem}" lane="{stem}" pos="-0.1" period="{HALF:g}" file="loops.xml"/>'
        "</additional>"
    )
    subprocess.run(
        [
            BIN / "sumo", "-n", f"{MAP}.net.xml", "-r", str(inside / layout.ROUTES_FILE),
            "-a", "detectors.add.xml", "--fcd-output", "fcd.parquet",
            "--fcd-output.attributes", "id,x,y,pos,speed,lane", "--end", str(UNTIL), "--seed", "3",
            "--step-length", str(STEP), "--precision", "6", "--no-step-log", "--no-warnings",
            "--time-to-teleport", "-1",
        ],
        cwd=folder,
        env={**os.environ, "SUMO_HOME": sumo.SUMO_HOME},
        check=True,
    )  # fmt: skip
    rows = pl.scan_parquet(folder / "fcd.parquet")
    places, facts = lane_places(sumo_map), read_net_facts(folder / "run")
    assert facts is not None
    passed = vehicle_passages(rows, places, facts)
    assert passed is not None
    table, _ = group_sums(rows, passed, places, facts, CLOCK)
    return Run(folder, table.with_columns(group_rates()), passed)


def stem_lanes() -> list[str]:
    """The lane before the stop line, after that which leads to it."""
    net = built(MAP).sumo.net
    return [
        lane.id
        for edge in ("3.0.f", "3.1.f")
        for lane in net.lanes.values()
        if lane.edge == edge and lane.allows("passenger")
    ]


def entered(run: Run, movement: str) -> float:
    """Vehicles an hour of the first half, by the routes that were driven."""
    number = run.passed.filter((col("movement") == movement) & (col("time") < HALF)).height
    assert number == pytest.approx(HOURLY[movement] / 6, abs=2)
    return number * 6.0


@pytest.mark.slow
def test_a_stop_sign_carries_what_hcm_computes_from_the_flows_that_were_driven(run):
    """HCM chapter 20 for movements 4, 7 and 9, written out, with what induction loops count."""

    def potential(v: float, t_c: float, t_f: float) -> float:
        return v * math.exp(-v * t_c / 3600) / (1 - math.exp(-v * t_f / 3600))

    flow = {movement: entered(run, movement) for movement in HOURLY}
    # Road 2 comes from the right of road 1, or from its left: who crosses whom says the turn.
    letters = {
        one.get("via"): (one.get("from"), one.get("to"), one.get("dir"))
        for one in etree.fromstring(built(MAP).net_xml).iterfind("connection")
    }
    left = {(a, b) for a, b, turn in letters.values() if turn == "l"}
    assert ("1.2.f", "3.1.b") in left
    near, through, opposite = "r2>j10001>r3", "r2>j10001>r1", "r1>j10001>r2"
    v2, v3, v4, v5 = flow[through], flow[near], flow["r1>j10001>r3"], flow[opposite]
    c4 = potential(v2 + v3, 4.1, 2.2)
    c9 = potential(v2 + 0.5 * v3, 6.2, 3.3)
    c7 = potential(v2 + 0.5 * v3 + v5 + 2 * v4, 7.1 - 0.7, 3.5) * (1 - v4 / c4)
    right, across = ("r3>j10001>r1", "r3>j10001>r2")
    if ("3.1.f", "1.2.b") in left:
        right, across = across, right
    every = run.passed.filter(col("movement").is_in([right, across]))["movement"].value_counts()
    shares = dict(every.rows())
    total = sum(shares.values())
    shared = 1.0 / (shares[across] / total / c7 + shares[right] / total / c9)
    row = run.group(STEM, 0.0)
    assert row["capacity"] * 6.0 == pytest.approx(shared, rel=0.01)
    assert row["vc"] == pytest.approx(20.0 / (shared / 6.0), rel=0.06)
    assert row["vc"] == pytest.approx(row["demand"] / (shared / 6.0), rel=0.01)
    assert row["vc"] < 0.5


def test_a_stem_that_is_never_empty_carries_what_an_induction_loop_counts(run):
    _, stem = stem_lanes()
    row = run.group(STEM, HALF)
    assert row["capacity"] == pytest.approx(run.loop(stem, HALF), abs=1)
    came = run.passed.filter(
        col("time") - col("before") >= HALF,
        col("lane").str.contains(r"^:J10001_[45]_0|^3\.[01]\.f|^:N3"),
    )
    assert row["demand"] == came.height
    assert row["vc"] > 1.0
    level = pl.DataFrame(
        [{"vehicles": 100, "standing": 5.0, "control_delay": 12.0, "delay": 12.0, "passages": 100,
          "facility": "minor movement", "control": "priority", "vc": row["vc"],
          "demand": row["demand"]}]
    ).select(place_level(capacity=True))  # fmt: skip
    assert level.item() == "F", "whatever the delay"


@pytest.mark.slow
def test_queue_and_spillback_of_a_full_stem_are_those_of_its_vehicles_one_by_one(run):
    """The definition as it is written, step by step, on positions along the lanes."""
    net = built(MAP).sumo.net
    behind, stem = stem_lanes()
    length = net.lanes[stem].length
    joint = next(one.via for one in net.links if one.source == behind and one.via)
    to_line = {stem: 0.0, joint: length, behind: length + net.lanes[joint].length}
    room = sum(net.lanes[lane].length for lane in to_line)
    rows = (
        pl.read_parquet(run.folder / "fcd.parquet")
        .with_columns(lane=col("vehicle_lane").cast(str), id=col("vehicle_id").cast(str))
        .filter(col("lane").is_in(list(to_line)) & (col("timestep_time") >= HALF))
        .filter(col("timestep_time") < UNTIL)
    )
    backs, queued = [], set[str]()
    for _, step in rows.group_by("timestep_time", maintain_order=True):
        seen = sorted(
            (to_line[lane] + net.lanes[lane].length - pos, name, speed)
            for name, lane, pos, speed in step.select(
                "id", "lane", "vehicle_pos", "vehicle_speed"
            ).rows()
        )
        reach, back = 0.0, 0.0
        before, queued = queued, set()
        for away, name, speed in seen:
            if speed < QUEUED and (name in before or away - reach <= GAP):
                queued.add(name)
                reach = back = away + LENGTH
        backs.append(back)
    row = run.group(STEM, HALF)
    assert row["queue_metres"] == pytest.approx(sum(backs) * STEP / HALF, rel=0.01)
    assert row["queue_metres_max"] == pytest.approx(max(backs), rel=0.01)
    full = sum(back > room - 7.5 for back in backs) * STEP / HALF
    assert full > 0.3
    assert row["spillback"] == pytest.approx(full, rel=0.01)
    over = sum(back > row["storage"] for back in backs) * STEP / HALF
    assert row["overflow"] == pytest.approx(over, rel=0.01, abs=0.005)
