"""The major road of a junction: who goes first where signs and lights do not say."""

from __future__ import annotations

import math

import numpy as np

from odscen.convert.building.junction_ruling import major_edges, stands_out
from odscen.convert.model.right_of_way import Movement, Sign
from tests.convert.maps import converted, named


def approach(edge: str, degrees: float, *, lane: int = 0, speed: float = 13.9) -> Movement:
    """A movement straight on from one direction."""
    heading = math.radians(degrees)
    step = np.array([math.cos(heading), math.sin(heading), 0.0])
    shape = np.vstack((-10.0 * step, 10.0 * step))
    return Movement(
        (edge, lane), (f"{edge} out", lane), shape, 3.5, heading, heading, speed, Sign.NONE,
        in_roundabout=False, roads=frozenset(),
    )  # fmt: skip


def major(*movements: Movement) -> frozenset[str]:
    return major_edges(movements, [True] * len(movements))


def test_the_faster_road_goes_first() -> None:
    slow = approach("n", 90, speed=8.3), approach("s", -90, speed=8.3)
    assert major(*slow, approach("w", 0), approach("e", 180)) == {"w", "e"}


def test_of_equally_fast_roads_the_wider_one_goes_first() -> None:
    wide = approach("n", 90), approach("n", 90, lane=1), approach("s", -90)
    assert major(approach("w", 0), approach("e", 180), *wide) == {"n", "s"}


def test_a_road_that_ends_in_another_is_not_major() -> None:
    assert major(approach("n", -90), approach("w", 0), approach("e", 180)) == {"w", "e"}


def test_three_roads_of_a_star_have_none() -> None:
    assert major(approach("a", 0), approach("b", 120), approach("c", 240)) == frozenset()


def test_a_road_stands_out_where_an_approach_has_two_lanes_for_cars() -> None:
    assert not stands_out([approach("a", 0), approach("b", 90)], [True, True])
    assert stands_out([approach("a", 0), approach("a", 0, lane=1)], [True, True])
    assert not stands_out([approach("a", 0), approach("a", 0, lane=1)], [True, False])


def test_a_road_stands_out_that_is_faster_than_all_others() -> None:
    fast = approach("w", 0, speed=13.9), approach("e", 180, speed=13.9)
    assert stands_out([*fast, approach("n", -90, speed=8.3)], [True] * 3)
    assert not stands_out([*fast, approach("n", -90, speed=13.9)], [True] * 3)
    assert not stands_out([*fast, approach("n", -90, speed=14.2)], [True] * 3)


def test_above_50_kmh_there_is_no_right_before_left() -> None:
    side = approach("n", -90, speed=16.7)
    assert stands_out([approach("w", 0), approach("e", 180), side], [True] * 3)


def test_a_carriageway_of_its_own_goes_before_the_road_that_meets_it() -> None:
    """105 km/h and three lanes from the west, a minor street in both directions across it."""
    main = [approach("w", 0, lane=lane, speed=29.2) for lane in range(3)]
    assert major(*main, approach("n", -90), approach("s", 90)) == {"w"}
    assert major(*main, approach("n", 60, speed=25.0)) == {"w"}


def test_of_two_that_are_alike_in_all_one_goes_first_where_the_junction_is_large() -> None:
    pair = [
        approach(edge, angle, lane=lane) for edge, angle in (("w", 0), ("s", 90)) for lane in (0, 1)
    ]
    assert major(*pair) == frozenset()
    assert len(major_edges(pair, [True] * 4, decide=True)) == 1


def test_with_the_lights_off_a_crossing_has_a_major_road() -> None:
    links = converted(named("signal_crossing")).xml.findall("connection[@tl]")
    states = [link.get("state") for link in links if link.get("via")]
    assert states.count("O") >= 6
    assert set(states) == {"O", "o"}
