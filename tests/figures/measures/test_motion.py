"""Motion that bodies and drivers make is none of the findings; what they do not make is, once."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from odscen.figures.measures import motion
from odscen.figures.measures.motion import RoadLanes, check_motion
from odscen.records.run_events import Event, EventKind
from odscen.records.run_plan import Plan, PlannedActor

STEPS = st.sampled_from((0.05, 0.1, 0.2, 0.5, 1.0))
LANES = RoadLanes(
    edges={"a": "edge", "b": "edge", "turn": ":junction"},
    inside=frozenset({"turn"}),
    names=["a", "b"],
    lines=[np.array([[-100.0, y], [1000.0, y]]) for y in (0.0, 3.5)],
    widths=[3.5, 3.5],
)


def planned(*categories: str, step: float = 0.1) -> Plan:
    actors = tuple(
        PlannedActor(
            id=f"{category}-{n}", category=category, spawn="n0", goal=None, depart=0.0,
            length={"pedestrian": 0.3, "bus": 12.0}.get(category, 4.5),
            width={"pedestrian": 0.5, "bus": 2.5}.get(category, 1.8),
            x=0.0, y=0.0, z=0.0, hdg=0.0,
        )
        for n, category in enumerate(categories)
    )  # fmt: skip
    return Plan(
        scenario="s", seed=0, net_offset=(0.0, 0.0), until=100.0, step_length=step, actors=actors
    )


def table(plan: Plan, *tracks: dict[str, Any]) -> pl.DataFrame:
    """Rows of tracks, one per actor: time, x, y, hdg, speed, and perhaps lane."""
    parts = []
    for number, track in enumerate(tracks):
        count = len(track["time"])
        columns = {
            name: np.broadcast_to(np.asarray(track.get(name, 0.0), dtype=float), (count,))
            for name in ("time", "x", "y", "hdg", "speed")
        }
        lane = track.get("lane", "a")
        parts.append(
            pl.DataFrame(
                {
                    **columns,
                    "id": plan.actors[number].id,
                    "category": plan.actors[number].category,
                    "row": number,
                    "lane": [lane] * count if isinstance(lane, str) else list(lane),
                }
            )
        )
    return pl.concat(parts).sort("time", maintain_order=True)


def straight(speed: Any, step: float, seconds: float = 10.0, **more: Any) -> dict[str, Any]:
    """Track along x with speeds as SUMO has them: that of a record led to its place."""
    time = np.arange(round(seconds / step) + 1) * step
    speeds = np.broadcast_to(np.asarray(speed, dtype=float), time.shape)
    x = np.concatenate(([0.0], np.cumsum(speeds[1:] * step)))
    return {"time": time, "x": x, "speed": speeds, **more}


def kinds(found: pl.DataFrame | None) -> list[tuple[str, str]]:
    assert found is not None
    return list(zip(found["kind"], found["cause"], strict=True))


@given(STEPS, st.floats(0.0, 50.0))
def test_a_constant_speed_on_a_straight_lane_is_plausible(step, speed):
    plan = planned("car", step=step)
    found = check_motion(table(plan, straight(speed, step)), plan, lanes=LANES)
    assert kinds(found) == []


@pytest.mark.slow
@given(STEPS, st.floats(8.0, 200.0), st.floats(0.2, 1.8))
def test_a_circle_is_plausible_as_long_as_its_lateral_acceleration_is(step, radius, share):
    speed = math.sqrt(4.0 * share * radius)
    time = np.arange(0.0, 10.0, step)
    angle = speed / radius * time
    plan = planned("car", step=step)
    track = {
        "time": time,
        "x": radius * np.sin(angle),
        "y": radius * (1.0 - np.cos(angle)),
        "hdg": angle,
        # Of the front, as SUMO's, which is on a larger circle than the centre.
        "speed": speed * math.hypot(1.0, 0.5 * plan.actors[0].length / radius),
    }
    found = check_motion(table(plan, track), plan)
    if share < 0.99:
        assert kinds(found) == []
    # Second differences of positions see less of a turn that is quicker than their window.
    window = max(0.5, step) * speed / radius
    if share > 1.1 and window < 0.5:
        assert kinds(found) == [("lateral acceleration", "lane")]
        assert found["value"][0] == pytest.approx(4.0 * share, rel=0.05)


@pytest.mark.parametrize("step", [0.05, 0.1, 0.5, 1.0])
def test_a_lane_jumped_over_in_a_step_is_one_jump_and_one_moved_over_in_time_is_none(step):
    time = np.arange(round(10.0 / step) + 1) * step
    plan = planned("car", step=step)
    jump = straight(
        16.0, step, y=np.where(time < 5.0, 0.0, 3.5), lane=np.where(time < 5.0, "a", "b")
    )
    found = check_motion(table(plan, jump), plan, lanes=LANES)
    assert ("jump", "lane change") in kinds(found)
    assert {kind for kind, _ in kinds(found)} <= {"jump"}
    row = found.filter(pl.col("kind") == "jump").row(0, named=True)
    assert row["value"] == pytest.approx(3.5)
    assert row["begin"] == pytest.approx(5.0)
    assert row["id"] == "car-0"
    # A half cosine over 4 s; its heading follows the path.
    phase = np.clip((time - 3.0) / 4.0, 0.0, 1.0) * np.pi
    aside = 1.75 * np.sin(phase) * np.pi / 4.0
    smooth = straight(16.0, step, y=1.75 * (1.0 - np.cos(phase)), hdg=np.arctan2(aside, 16.0))
    smooth["x"] = 16.0 * time - 2.25 * (1.0 - np.cos(smooth["hdg"]))
    assert kinds(check_motion(table(plan, smooth), plan, lanes=LANES)) == []


def test_braking_is_hard_beyond_what_drivers_want_and_implausible_beyond_what_bodies_can():
    plan = planned("car", "car", "car")
    tracks = []
    for number, braking in enumerate((4.4, 7.0, 12.0)):
        time = np.arange(101) * 0.1
        speed = np.maximum(20.0 - braking * np.maximum(time - 3.0, 0.0), 0.0)
        tracks.append(straight(speed, 0.1, y=3.5 * number))
    found = check_motion(table(plan, *tracks), plan)
    assert found is not None
    braked = found.filter(pl.col("kind").is_in(["hard braking", "braking"]))
    assert {(row["id"], row["kind"]): row["value"] for row in braked.iter_rows(named=True)} == (
        pytest.approx(
            {
                ("car-1", "hard braking"): 7.0,
                ("car-2", "hard braking"): 12.0,
                ("car-2", "braking"): 12.0,
            }
        )
    )
    # Of the first half a second whose mean is beyond: 0.2, 0.4 and 0.5 s after 3.0 s.
    assert braked["begin"].to_list() == pytest.approx([3.2, 3.4, 3.5])


def test_a_recorded_speed_that_is_not_that_of_positions_is_found_for_people_as_well():
    plan = planned("pedestrian", "car")
    walks, drives = straight(1.39, 0.5), straight(10.0, 0.5, y=3.5)
    walks["speed"] = 0.33
    found = check_motion(table(plan, walks, drives), plan)
    assert kinds(found) == [("recorded speed", "lane")]
    assert found["id"][0] == "pedestrian-0"
    assert found["value"][0] == pytest.approx(1.06, abs=0.01)


def test_turning_on_the_spot_and_driving_backwards_are_found():
    plan = planned("car", "car")
    time = np.arange(41) * 0.1
    spin = {"time": time, "x": np.zeros(41), "y": 50.0, "hdg": 3.0 * time, "speed": 0.0}
    back = {"time": time, "x": -3.0 * time, "y": 0.0, "speed": 3.0}
    found = check_motion(table(plan, spin, back), plan)
    pairs = set(zip(found["id"], found["kind"], strict=True))
    assert {("car-0", "yaw rate"), ("car-1", "backwards")} <= pairs
    assert ("car-1", "yaw rate") not in pairs


@pytest.mark.parametrize(("radius", "cause"), [(3.0, "tight path"), (12.0, "junction")])
def test_a_lane_that_bends_more_than_the_wheels_steer_is_said(radius, cause):
    plan = planned("car")
    angle = np.linspace(0.0, np.pi / 2.0, 91)
    bend = np.column_stack([radius * np.sin(angle), radius * (1.0 - np.cos(angle))])
    lanes = RoadLanes(
        edges={":J_0": ":J"}, inside=frozenset({":J_0"}), names=(":J_0",), lines=(bend,),
        widths=(3.5,),
    )  # fmt: skip
    time = np.arange(41) * 0.1
    spin = {"time": time, "x": np.zeros(41), "y": 0.0, "hdg": 3.0 * time, "speed": 0.0,
            "lane": ":J_0"}  # fmt: skip
    found = check_motion(table(plan, spin), plan, lanes=lanes)
    assert ("yaw rate", cause) in kinds(found)
    assert len(motion.implausible(found)) == len(found)  # its cause is known, not excused


def test_bodies_that_overlap_and_bodies_off_the_road_are_found_with_their_partner():
    plan = planned("car", "bus", "car")
    found = check_motion(
        table(
            plan,
            straight(10.0, 0.1),
            straight(10.0, 0.1, y=1.9),
            straight(10.0, 0.1, y=8.0),
        ),
        plan,
        lanes=LANES,
    )
    assert sorted(kinds(found)) == [("off the road", "lane"), ("overlap", "lane")]
    overlap = found.filter(pl.col("kind") == "overlap").row(0, named=True)
    assert {overlap["id"], overlap["partner"]} == {"car-0", "bus-1"}
    assert overlap["value"] == pytest.approx(0.9 + 1.25 - 1.9)
    assert (overlap["begin"], overlap["end"]) == pytest.approx((0.0, 10.0))
    off = found.filter(pl.col("kind") == "off the road").row(0, named=True)
    assert off["id"] == "car-2"
    assert off["value"] == pytest.approx(8.0 - 3.5 - 1.75)


@pytest.mark.parametrize(
    ("events", "cause"),
    [
        ([(4.0, EventKind.RULE_STARTED), (6.0, EventKind.RULE_ENDED)], "rule"),
        ([(4.0, EventKind.RULE_STARTED)], "rule"),
        ([(4.9, EventKind.TELEPORT_START), (5.0, EventKind.TELEPORT_END)], "teleport"),
        ([(4.5, EventKind.COLLISION)], "collision"),
        ([(7.0, EventKind.RULE_STARTED), (9.0, EventKind.RULE_ENDED)], "lane"),
    ],
)
def test_what_moves_by_force_is_said_and_not_counted(events, cause):
    time = np.arange(101) * 0.1
    plan = planned("car")
    track = straight(10.0, 0.1, y=np.where(time < 5.0, 0.0, 20.0))
    happened = [Event(at, kind, "car-0", rule="r") for at, kind in events]
    found = check_motion(table(plan, track), plan, happened)
    assert kinds(found) == [("jump", cause)]
    assert len(motion.implausible(found)) == (cause == "lane")


def test_a_gap_in_the_records_is_no_jump_and_records_far_apart_are_not_checked():
    plan = planned("car")
    track = straight(10.0, 0.1)
    keep = (track["time"] < 3.0) | (track["time"] > 6.0)
    gap = {name: np.broadcast_to(values, keep.shape)[keep] for name, values in track.items()}
    assert kinds(check_motion(table(plan, gap), plan)) == []
    assert check_motion(table(plan, straight(10.0, 2.0)), plan) is None
    empty = table(plan, straight(10.0, 0.1)).head(0)
    assert kinds(check_motion(empty, plan)) == []


def test_a_long_run_is_checked_in_parts_with_the_same_findings(monkeypatch):
    time = np.arange(1001) * 0.1
    plan = planned("car", "car")
    rows = table(
        plan,
        straight(10.0, 0.1, 100.0, y=np.where(time % 20.0 < 10.0, 0.0, 20.0)),
        straight(10.0 + 4.0 * np.sin(time), 0.1, 100.0, y=100.0),
    )
    whole = check_motion(rows, plan)
    monkeypatch.setattr(motion, "_CHUNK", 300)
    parts = check_motion(rows, plan)
    assert whole is not None
    assert len(whole) == 10
    assert parts.sort("begin", "id").equals(whole.sort("begin", "id"))


def test_findings_are_read_as_they_were_written(tmp_path):
    plan = planned("car", "bus")
    found = check_motion(
        table(plan, straight(10.0, 0.1), straight(10.0, 0.1, y=1.0)), plan, lanes=LANES
    )
    assert found is not None
    assert len(found) == 1
    motion.write_motion(found, tmp_path)
    read = motion.read_motion(tmp_path)
    assert read is not None
    assert read.drop("value").equals(found.drop("value"))
    assert read["value"].to_list() == pytest.approx(found["value"].to_list(), abs=1e-4)
