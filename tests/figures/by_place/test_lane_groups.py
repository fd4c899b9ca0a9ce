"""An approach with a turn bay, written by hand: its lane groups, queues, demand and capacity."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest

from odscen.figures.by_place.capacity import (
    capacity_sums,
    demand_sums,
    saturation_flows,
    shown_greens,
    through_gaps,
)
from odscen.figures.by_place.facilities import NetFacts
from odscen.figures.by_place.group_figures import group_rates, group_sums, over_capacity
from odscen.figures.by_place.lane_groups import lane_groups
from odscen.figures.by_place.lane_places import LanePlaces
from odscen.figures.by_place.queue_metres import queue_backs, queue_sums
from odscen.records.light_programs import LightProgram, ShownGroup
from odscen.records.row_text import with_numbered_names

LEFT, THROUGH = "r1>j1>r3", "r1>j1>r2"
# The road (100 m) widens into a bay for the left turn (l, 40 m) beside the lane through (t, 40 m).
PLACES = LanePlaces.of(
    lanes=[("t", 40.0, True, "r1", 1.0, True), ("bike", 40.0, False, "r1", 1.0, True)],
    ways=[
        (lane, "j1", "in", None, None, None) for lane in ("road", "l", "t")
    ] + [(":l", "j1", "in", "l", ":l", LEFT), (":t", "j1", "in", "t", ":t", THROUGH),
         (":b", "j1", "in", "bike", ":b", THROUGH)],
    segments=[],
    junctions=[("j1", "signal", 20.0)],
    movements=[(LEFT, "j1", "signal", 20.0), (THROUGH, "j1", "signal", 20.0)],
)  # fmt: skip
X = {"road": (0.0, 100.0), "l": (100.0, 140.0), "t": (100.0, 140.0), ":l": (140.0, 150.0),
     ":t": (140.0, 150.0)}  # fmt: skip
FACTS = NetFacts(
    limits=pl.DataFrame(
        [(lane, lane, b - a, 15.0) for lane, (a, b) in X.items()],
        schema=("lane", "edge", "length", "limit"),
        orient="row",
    ),
    links=pl.DataFrame(
        {"via": [":l", ":t"], "yields_to": [[":o"], []], "turn": ["l", "s"], "state": ["o", "O"]}
    ).with_columns(
        pl.lit(value=False).alias(name) for name in ("gives_way", "onto_ring", "from_ring")
    ),
    drivers=pl.DataFrame(
        {"id": [f"v{k}" for k in range(40)], "length": [5.0] * 40, "heavy": [False] * 40}
    ),
    follows=pl.DataFrame(
        [("road", "l"), ("road", "t"), ("l", ":l"), ("t", ":t")],
        schema=("lane", "following"),
        orient="row",
    ),
    shapes={lane: np.array([[a, 0.0], [b, 0.0]]) for lane, (a, b) in X.items()},
)
CLOCK = pl.DataFrame({"begin": [0.0, 300.0], "end": [300.0, 600.0]})
GROUPS = lane_groups(PLACES, FACTS)


def rows(*seen: tuple[float, str, str, float, float]) -> pl.LazyFrame:
    """Time, vehicle, lane, metres along it, speed."""
    return pl.DataFrame(
        [(time, who, lane, X[lane][0] + pos, 0.0, speed) for time, who, lane, pos, speed in seen],
        schema=("timestep_time", "vehicle_id", "vehicle_lane", "vehicle_x", "vehicle_y",
                "vehicle_speed"),
        orient="row",
    ).lazy()  # fmt: skip


def passed(*entries: tuple[str, float, float]) -> pl.DataFrame:
    """First lane inside, time, and seconds lost before."""
    return pl.DataFrame(
        [(f"v{k}", "m", via, time, lost) for k, (via, time, lost) in enumerate(entries)],
        schema=("id", "movement", "lane", "time", "before"),
        orient="row",
    )


def test_a_bay_is_a_lane_group_with_its_own_length_as_storage() -> None:
    found = GROUPS.groups.sort("lane_group").rows(named=True)
    assert [one["lane_group"] for one in found] == [THROUGH, LEFT]
    assert [(one["storage"], one["room"]) for one in found] == [(40.0, 140.0)] * 2
    assert [one["lanes"] for one in found] == [1, 1], "a cycle lane is none of them"


def test_a_queue_is_measured_from_the_stop_line_to_its_last_rear_over_all_lanes() -> None:
    queue = [(0.0, f"v{k}", "l", 39.0 - 7.5 * k, 0.0) for k in range(5)]
    upstream = [(0.0, "v5", "road", 96.0, 0.5), (0.0, "v6", "road", 20.0, 0.0)]
    later = [(9.0, f"v{k}", ":l", 5.0, 5.0) for k in range(7)]
    backs = queue_backs(rows(*queue, *upstream, *later), GROUPS, FACTS)
    assert backs is not None
    # v5, on the road, turns left: its front is at 44 m; v6 is too far behind to be in the queue.
    assert backs.rows() == [(LEFT, 0.0, 49.0)]


def test_a_queue_is_the_same_with_numbered_names_and_in_any_order_of_rows() -> None:
    seen = [(t, f"v{k}", "l", 39.0 - 7.5 * k, 0.0) for t in (0.0, 1.0, 2.0) for k in range(5)]
    later = [(9.0, f"v{k}", ":l", 5.0, 5.0) for k in range(5)]
    table = rows(*seen, *later).collect()
    backs = queue_backs(table.lazy(), GROUPS, FACTS)
    assert backs is not None
    assert backs.rows() == [(LEFT, t, 36.0) for t in (0.0, 1.0, 2.0)]
    for other in (with_numbered_names(table), table.reverse()):
        again = queue_backs(other.lazy(), GROUPS, FACTS)
        assert again is not None
        assert again.equals(backs)


def test_who_is_slow_by_itself_before_the_line_is_no_queue() -> None:
    backs = queue_backs(rows((0.0, "v0", "l", 5.0, 0.0), (1.0, "v0", "l", 6.0, 1.0)), GROUPS, FACTS)
    assert backs is not None
    assert backs.is_empty()


def test_the_tail_stays_queued_while_the_front_drives_off() -> None:
    still = [(0.0, f"v{k}", "t", 39.0 - 7.5 * k, 0.0) for k in range(3)]
    front = [(1.0, "v0", ":t", 1.0, 5.0), (1.0, "v1", "t", 35.0, 3.0), (1.0, "v2", "t", 24.0, 0.0)]
    backs = queue_backs(rows(*still, *front), GROUPS, FACTS)
    assert backs is not None
    assert backs["metres"].to_list() == [21.0, 21.0]


def test_overflow_is_beyond_the_bay_and_spillback_reaches_the_junction_behind() -> None:
    lengths = [20.0] * 6 + [41.0] * 3 + [133.0]
    backs = pl.DataFrame(
        {"lane_group": [LEFT] * 10, "time": [float(k) for k in range(10)], "metres": lengths}
    )
    row = queue_sums(backs, GROUPS, CLOCK, step=1.0).row(0, named=True)
    assert (row["overflow_seconds"], row["spillback_seconds"]) == (4.0, 1.0)
    assert row["queue_metre_seconds"] == sum(lengths)
    assert row["queue_metres_max"] == 133.0
    assert row["queue_metres_p95"] == 0.0, "for 290 of 300 s there was no queue"


def test_demand_counts_when_vehicles_would_have_come_and_those_still_queued() -> None:
    waiting = passed((":t", 310.0, 20.0), (":t", 320.0, 5.0)).with_columns(
        movement=pl.Series(["m", None]), lane=pl.Series([":t", "t"])
    )
    found = demand_sums(waiting, GROUPS, CLOCK)
    assert found.rows() == [(THROUGH, 0.0, 1), (THROUGH, 300.0, 1)]


def test_saturation_flow_is_measured_from_the_fifth_vehicle_of_each_queue_on() -> None:
    queues = [(":t", 100.0 * q + 2.0 * k + (3.0 if k else 0.0), 30.0)
              for q in range(2) for k in range(14)]  # fmt: skip
    flows = saturation_flows(passed(*queues), GROUPS)
    own = flows.row(by_predicate=pl.col("lane_group") == THROUGH, named=True)
    assert (own["headways"], own["saturation_flow"]) == (20, pytest.approx(1800.0))
    other = flows.row(by_predicate=pl.col("lane_group") == LEFT, named=True)
    assert (other["headways"], other["saturation_flow"]) == (0, pytest.approx(1800.0))
    few = saturation_flows(passed(*queues[:6]), GROUPS)
    assert few["saturation_flow"].to_list() == [1900.0, 1900.0]


LIGHT = LightProgram(
    "J1", ("j1",), "fixed-time", own=False, plans=(),
    groups=(
        ShownGroup("V1", (0,), (LEFT,), walk=False, lanes=(("l", ":l"),)),
        ShownGroup("V2", (1,), (THROUGH,), walk=False, lanes=(("t", ":t"),)),
        ShownGroup("V3", (2,), ("r2>j1>r1",), walk=False, lanes=(("o", ":o"),)),
    ),
)  # fmt: skip
STATES = pl.DataFrame(
    [("J1", time, state) for cycle in range(10) for time, state in
     ((60.0 * cycle, "gGG"), (60.0 * cycle + 30.0, "rrr"))],
    schema=("light", "time", "state"), orient="row",
)  # fmt: skip


def test_capacity_is_saturation_flow_times_the_green_that_was_shown() -> None:
    nobody = passed((":t", 1.0, 0.0), (":l", 1.0, 0.0))
    greens = shown_greens([LIGHT], STATES, CLOCK, FACTS)
    flows = saturation_flows(nobody, GROUPS)
    found = capacity_sums(greens, flows, nobody, GROUPS, FACTS)
    table = {(group, begin): value for group, begin, value in found.rows()}
    assert table[THROUGH, 0.0] == pytest.approx(1900.0 * 150.0 / 3600.0)
    # Without oncoming vehicles a left turn has all of the gap: 11 by follow-up time, 2 at the end.
    assert table[LEFT, 300.0] == pytest.approx(5 * 13)


def test_a_permitted_turn_has_the_gaps_of_those_it_gives_way_to() -> None:
    assert through_gaps(np.array([]), 0.0, 30.0, most=1900.0) == 13.0
    # 4.4 s are too short, 4.5 s let one through, 7.0 s two, 14.1 s four; and two at the end.
    opposing = np.array([4.4, 8.9, 15.9])
    assert through_gaps(opposing, 0.0, 30.0, most=1900.0) == 0 + 1 + 2 + 4 + 2
    assert through_gaps(np.arange(0.0, 30.0), 0.0, 30.0, most=1900.0) == 2.0


def test_greens_that_did_not_clear_the_queue_say_what_a_permitted_turn_carries() -> None:
    served = [(":l", 60.0 * cycle + 5.0 * k, 100.0) for cycle in range(8) for k in (1, 2, 3, 4)]
    flows = saturation_flows(passed((":t", 1.0, 0.0)), GROUPS)
    greens = shown_greens([LIGHT], STATES, CLOCK, FACTS)
    found = capacity_sums(greens, flows, passed(*served), GROUPS, FACTS)
    left = found.filter(pl.col("lane_group") == LEFT)["capacity"].to_list()
    assert left == [pytest.approx(20.0), pytest.approx(20.0)], "4 in each of 5 greens, not 13"


def test_who_turns_on_yellow_or_when_oncoming_green_has_ended_is_in_what_a_turn_carries() -> None:
    """Oncoming traffic has red after 25 s, the turn 5 s later and 3 s of yellow."""
    states = pl.DataFrame(
        [("J1", 60.0 * cycle + time, state) for cycle in range(10) for time, state in
         ((0.0, "gGG"), (25.0, "GGr"), (30.0, "yyr"), (33.0, "rrr"))],
        schema=("light", "time", "state"), orient="row",
    )  # fmt: skip
    served = [(":l", 60.0 * n + at, 100.0) for n in range(10) for at in (10.0, 26.0, 28.0, 31.0)]
    flows = saturation_flows(passed((":t", 1.0, 0.0)), GROUPS)
    found = capacity_sums(
        shown_greens([LIGHT], states, CLOCK, FACTS), flows, passed(*served), GROUPS, FACTS
    )
    left = found.filter(pl.col("lane_group") == LEFT)["capacity"].to_list()
    assert left == [pytest.approx(20.0), pytest.approx(20.0)], "4 in each of 5 greens"


def test_demand_above_capacity_is_level_f_and_short_intervals_have_no_ratio() -> None:
    light = STATES.clear()
    nobody = passed(*[(":t", float(k), 0.0) for k in range(30)])
    table, of = group_sums(
        rows((0.0, "v0", "road", 5.0, 9.0), (1.0, "v0", "road", 9.0, 9.0)), nobody, PLACES, FACTS,
        CLOCK, programs=[LIGHT], states=light,
    )  # fmt: skip
    assert dict(of.rows()) == {LEFT: LEFT, THROUGH: THROUGH}
    first = table.head(1).with_columns(capacity=pl.lit(25.0))
    rated = first.with_columns(group_rates()).with_columns(f=over_capacity())
    assert rated.select("vc", "f").row(0) == (pytest.approx(1.2), True)
    short = first.with_columns(end=pl.lit(60.0)).with_columns(group_rates())
    assert short["vc"].to_list() == [None]
