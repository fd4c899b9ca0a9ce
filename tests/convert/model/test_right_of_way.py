"""Who lets whom go first, shown by hand-made movements over a junction around (0, 0)."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from odscen.convert.building.junction_ruling import sight_before, sight_without_sign
from odscen.convert.model.right_of_way import (
    Movement,
    Rules,
    Sign,
    Walkway,
    find_conflicts,
    in_turn,
    making_room,
    requests,
    wrapped,
)

RIGHT = Rules()
LEFT = Rules(lefthand=True)

EAST, NORTH, WEST, SOUTH = 0.0, math.pi / 2, math.pi, -math.pi / 2


def movement(
    come: float, go: float, *, rules: Rules = RIGHT, name: str = "", speed: float = 13.9,
    **more: object,
) -> Movement:  # fmt: skip
    """A movement in by heading ``come`` and out by heading ``go``, 2 m beside the axes."""
    side = 2.0 if rules.lefthand else -2.0

    def place(heading: float, ahead: float) -> np.ndarray:
        along, left = (
            (math.cos(heading), math.sin(heading)),
            (-math.sin(heading), math.cos(heading)),
        )
        return np.array([*(ahead * np.array(along) + side * np.array(left)), 0.0])

    start, end = place(come, -10.0), place(go, 10.0)
    corner = start + 10.0 * np.array([math.cos(come), math.sin(come), 0.0])
    share = np.linspace(0.0, 1.0, 9)[:, None]
    shape = (1 - share) ** 2 * start + 2 * share * (1 - share) * corner + share**2 * end
    given_ = {
        "source": (f"in{round(math.degrees(come))}{name}", 0),
        "target": (f"out{round(math.degrees(go))}", 0),
        "width": 3.5,
        "sign": Sign.NONE,
        "in_roundabout": False,
        "roads": frozenset[str](),
    }
    return Movement(
        shape=shape, heading_in=come, heading_out=go, speed=speed, **{**given_, **more}
    )  # fmt: skip


def waits(one: Movement, other: Movement, rules: Rules = RIGHT) -> bool:
    """Whether the first of two movements waits; exactly one of them does."""
    pair = [one, other]
    rights = requests(pair, find_conflicts(pair, []), rules)
    assert rights[0].foes == {1}, "they should meet"
    assert bool(rights[0].yields_to) != bool(rights[1].yields_to)
    return rights[0].yields_to == {1}


@pytest.mark.parametrize(
    ("come", "from_the_right"),
    [(EAST, NORTH), (NORTH, WEST), (WEST, SOUTH), (SOUTH, EAST)],
)
def test_right_before_left_on_all_arms_and_left_before_right_in_left_hand_traffic(
    come: float, from_the_right: float
) -> None:
    assert waits(movement(come, come), movement(from_the_right, from_the_right))
    assert not waits(movement(from_the_right, from_the_right), movement(come, come))
    one, other = (movement(h, h, rules=LEFT) for h in (come, from_the_right))
    assert not waits(one, other, LEFT)
    assert waits(other, one, LEFT)


def test_one_who_turns_across_gives_way_to_oncoming_traffic() -> None:
    turning, oncoming = movement(EAST, NORTH), movement(WEST, WEST)
    assert waits(turning, oncoming)
    assert not waits(oncoming, turning)
    turning, oncoming = (movement(EAST, SOUTH, rules=LEFT), movement(WEST, WEST, rules=LEFT))
    assert waits(turning, oncoming, LEFT)


def test_one_who_turns_left_gives_way_to_one_who_turns_right_into_the_same_road() -> None:
    assert waits(movement(EAST, NORTH), movement(WEST, NORTH))


@pytest.mark.parametrize(
    ("less", "more"),
    [(Sign.STOP, Sign.YIELD), (Sign.STOP, Sign.NONE), (Sign.YIELD, Sign.NONE)],
)
def test_signs_come_before_right_before_left(less: Sign, more: Sign) -> None:
    from_the_right = movement(NORTH, NORTH, sign=less)
    assert waits(from_the_right, movement(EAST, EAST, sign=more))


def test_a_left_turn_of_the_main_road_goes_before_a_side_road_with_a_sign() -> None:
    assert not waits(movement(EAST, NORTH), movement(SOUTH, SOUTH, sign=Sign.YIELD))


def test_two_with_the_same_sign_go_by_right_before_left() -> None:
    assert waits(movement(EAST, EAST, sign=Sign.YIELD), movement(NORTH, NORTH, sign=Sign.YIELD))


def test_priorities_of_the_junction_come_before_right_before_left_and_after_signs() -> None:
    one, other = movement(EAST, EAST, roads=frozenset("a")), movement(NORTH, NORTH, roads={"b"})
    rules = Rules(frozenset({("a", "b")}))
    assert not waits(one, other, rules)
    assert waits(one, other, Rules(frozenset({("b", "a")})))
    assert waits(replace(one, sign=Sign.STOP), other, rules)


def test_what_is_in_the_roundabout_goes_before_what_comes_from_outside() -> None:
    inside, outside = movement(EAST, EAST, in_roundabout=True), movement(NORTH, EAST)
    assert waits(outside, inside)
    assert not waits(replace(inside, sign=Sign.YIELD), outside)


def test_a_ramp_gives_way_to_the_faster_road() -> None:
    road = movement(EAST, EAST, speed=30.0)
    ramp = movement(EAST, EAST, name="ramp", speed=20.0)
    assert waits(ramp, road)
    assert not waits(road, ramp)


def test_two_roads_as_fast_as_each_other_that_only_merge_go_in_turn() -> None:
    pair = [movement(EAST, EAST), movement(0.4, EAST)]
    found = find_conflicts(pair, [])
    one, other = requests(pair, found, Rules())
    assert one.yields_to == {1}
    assert other.yields_to == {0}
    assert in_turn(pair, found, Rules()) == {(0, 1)}


def test_a_motorway_makes_room_for_an_equally_fast_ramp_as_it_has_lanes_beside() -> None:
    road = movement(EAST, EAST)
    beside = replace(
        road,
        source=(road.source[0], road.source[1] + 1),
        target=(road.target[0], road.target[1] + 1),
        shape=road.shape + np.array([0.0, 3.5, 0.0]),
    )
    listed = [road, beside, movement(0.4, EAST)]
    found = find_conflicts(listed, [])
    assert in_turn(listed, found, Rules()) == frozenset()
    assert making_room(listed, found, Rules()) == {(0, 2)}
    rights = requests(listed, found, Rules())
    assert [right.yields_to for right in rights] == [{2}, frozenset(), frozenset()]
    assert sight_before(road, rights[0], listed, room=True) == 100.0


def test_a_ramp_gives_way_to_an_equally_fast_road_with_traffic_in_both_directions() -> None:
    road = movement(EAST, EAST)
    beside = replace(
        road,
        source=(road.source[0], road.source[1] + 1),
        target=(road.target[0], road.target[1] + 1),
        shape=road.shape + np.array([0.0, 3.5, 0.0]),
    )
    against = movement(EAST + math.pi, EAST + math.pi)
    against = replace(against, shape=against.shape + np.array([0.0, 7.0, 0.0]))
    listed = [road, beside, movement(0.4, EAST), against]
    found = find_conflicts(listed, [])
    assert making_room(listed, found, Rules()) == {(2, 0)}
    rights = requests(listed, found, Rules())
    assert [right.yields_to for right in rights[:3]] == [frozenset(), frozenset(), {0}]
    # Beyond a median it is a motorway, which makes room though one junction has both directions.
    beyond = replace(against, shape=against.shape + np.array([0.0, 5.0, 0.0]))
    listed[3] = beyond
    assert making_room(listed, find_conflicts(listed, []), Rules()) == {(0, 2)}


def test_without_a_sign_one_sees_others_from_where_one_can_stop_for_them_in_comfort() -> None:
    """AASHTO's legs of sight triangles; a car stops with 4.5 m/s2, SUMO's least anticipation."""
    assert [sight_without_sign(kmh / 3.6) for kmh in (10.0, 30.0, 50.0, 75.0)] == [20, 25, 45, 70]
    for kmh in range(20, 135, 5):
        speed = kmh / 3.6
        assert sight_without_sign(speed) > speed**2 / (2.0 * 4.5)


def test_nobody_goes_in_turn_where_lanes_cross_or_somebody_must_wait() -> None:
    road, bending = movement(EAST, EAST), movement(0.4, EAST)
    across = [road, bending, movement(NORTH, NORTH)]
    assert in_turn(across, find_conflicts(across, []), Rules()) == frozenset()
    sign = [road, replace(bending, sign=Sign.YIELD)]
    assert in_turn(sign, find_conflicts(sign, []), Rules()) == frozenset()
    fast = [replace(road, speed=33.3), bending]
    assert in_turn(fast, find_conflicts(fast, []), Rules()) == frozenset()
    assert waits(bending, fast[0])


def test_where_all_must_stop_each_waits_for_each() -> None:
    pair = [movement(EAST, EAST, sign=Sign.STOP), movement(NORTH, NORTH, sign=Sign.STOP)]
    one, other = requests(pair, find_conflicts(pair, []), Rules(all_stop=True))
    assert one.yields_to == {1}
    assert other.yields_to == {0}


@pytest.mark.parametrize(
    "pair",
    [
        (movement(EAST, EAST), movement(WEST, WEST)),
        (movement(EAST, SOUTH), movement(WEST, NORTH)),
        (movement(EAST, EAST), movement(EAST, NORTH)),
        (movement(EAST, SOUTH), movement(NORTH, WEST)),
    ],
    ids=["oncoming", "right turns", "same lane", "right turn and left turn elsewhere"],
)
def test_some_never_meet(pair: tuple[Movement, Movement]) -> None:
    assert find_conflicts(pair, []).pairs == ()


def test_what_runs_over_a_bridge_meets_no_vehicle_below() -> None:
    above = movement(NORTH, NORTH)
    above = replace(above, shape=above.shape + np.array([0.0, 0.0, 6.0]))
    assert find_conflicts([movement(EAST, EAST), above], []).pairs == ()
    crossing = Walkway(np.array([[-1.0, -5.0, 6.0], [-1.0, 1.0, 6.0]]), 3.0)
    assert find_conflicts([movement(EAST, EAST)], [crossing]).crossed == ((),)


def test_side_by_side_lanes_of_one_road_do_not_meet() -> None:
    one = movement(EAST, EAST)
    beside = replace(
        one, source=("in0", 1), target=("out0", 1), shape=one.shape + np.array([0.0, 1.5, 0.0])
    )
    assert find_conflicts([one, beside], []).pairs == ()


headings = st.sampled_from([EAST, NORTH, WEST, SOUTH, 0.7, 2.3, -0.7, -2.3])
movements = st.builds(
    movement,
    headings,
    headings,
    name=st.sampled_from(["", "x"]),
    speed=st.floats(3.0, 40.0),
    sign=st.sampled_from(Sign),
    in_roundabout=st.booleans(),
    roads=st.frozensets(st.sampled_from("abc"), max_size=1),
)
crossings = st.builds(
    lambda x, y, hdg: Walkway(
        np.array(
            [[x, y, 0.0], [x + 7.0 * math.cos(hdg), y + 7.0 * math.sin(hdg), 0.0]]
        ),
        4.0,
    ),
    *(st.floats(-12.0, 12.0) for _ in range(2)),
    st.floats(-4.0, 4.0),
)  # fmt: skip
all_rules = st.builds(
    Rules,
    st.frozensets(st.tuples(st.sampled_from("abc"), st.sampled_from("abc")), max_size=3),
    st.booleans(),
    all_stop=st.just(False),
)


@pytest.mark.slow
@given(st.lists(movements, max_size=8), st.lists(crossings, max_size=3), all_rules)
def test_of_two_that_meet_one_waits_or_both_in_turn_and_all_wait_for_persons(
    listed: list[Movement], walkways: list[Walkway], rules: Rules
) -> None:
    found = find_conflicts(listed, walkways)
    rights = requests(listed, found, rules)
    assert len(rights) == len(listed) + len(walkways)
    for number, right in enumerate(rights):
        assert right.yields_to <= right.foes
        assert all(number in rights[foe].foes for foe in right.foes)
    turns = in_turn(listed, found, rules)
    for i, j in found.pairs:
        waiting = {j in rights[i].yields_to, i in rights[j].yields_to}
        assert waiting == ({True} if (i, j) in turns else {True, False})
    for number, crossed in enumerate(found.crossed, start=len(listed)):
        assert rights[number].yields_to == frozenset()
        assert rights[number].foes == set(crossed)
        assert all(number in rights[link].yields_to for link in crossed)


@pytest.mark.slow
@given(st.lists(movements, max_size=6), all_rules)
def test_who_waits_does_not_depend_on_the_order(listed: list[Movement], rules: Rules) -> None:
    for i, one in enumerate(listed):
        for other in listed[i + 1 :]:
            if (one.source, one.target) == (other.source, other.target):
                continue
            found = find_conflicts([one, other], [])
            if not found.pairs or in_turn([one, other], found, rules):
                continue
            both_ways = [("a", "b"), ("b", "a"), ("a", "c"), ("c", "a"), ("b", "c"), ("c", "b")]
            if any((b, a) in rules.high_low for a, b in both_ways if (a, b) in rules.high_low):
                continue  # a file that contradicts itself
            assert waits(one, other, rules) != waits(other, one, rules)


@given(st.floats(-50.0, 50.0))
def test_angles_are_wrapped(angle: float) -> None:
    found = wrapped(angle)
    assert -math.pi < found <= math.pi
    assert math.cos(found) == pytest.approx(math.cos(angle), abs=1e-9)
    assert math.sin(found) == pytest.approx(math.sin(angle), abs=1e-9)
