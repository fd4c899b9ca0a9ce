from math import cos, pi, radians, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon

from odscen.base.categories import DEFAULT_BODY, Body, Category
from odscen.lanegraph.shortest_paths import Router
from odscen.scenario.placing.bodies import Box, Crowd, box_at, overlap
from odscen.scenario.placing.spawn_room import Reach, distance_to_end, max_fit, standing_room
from tests.graphs import fork, ring, two_lane_road

CAR = {Category.CAR: Body(5.0, 1.8, 1.5)}
ONLY_CARS = {Category.CAR: 1.0}

boxes = st.builds(
    lambda x, y, angle, length, width: Box(x, y, 0.0, cos(angle), sin(angle), length, width),
    st.floats(-10, 10),
    st.floats(-10, 10),
    st.floats(-pi, pi),
    st.floats(0.1, 8),
    st.floats(0.1, 2),
)


def polygon(box: Box) -> Polygon:
    corners = [(1, 1), (1, -1), (-1, -1), (-1, 1)]
    return Polygon(
        [
            (
                box.x + i * box.half_length * box.ux - j * box.half_width * box.uy,
                box.y + i * box.half_length * box.uy + j * box.half_width * box.ux,
            )
            for i, j in corners
        ]
    )


@given(boxes, boxes)
def test_overlap_is_that_of_the_polygons(a: Box, b: Box) -> None:
    first, second = polygon(a), polygon(b)
    depth = first.intersection(second).area
    if depth > 1e-3:
        assert overlap(a, b)
    elif first.distance(second) > 1e-3:
        assert not overlap(a, b)
    assert overlap(a, b) == overlap(b, a)


@settings(max_examples=30)
@given(st.lists(boxes, min_size=1, max_size=25), boxes)
def test_a_crowd_finds_what_a_search_of_all_pairs_finds(crowd_of: list[Box], box: Box) -> None:
    crowd = Crowd(2 * max(one.radius for one in [*crowd_of, box]))
    for label, one in enumerate(crowd_of):
        crowd.add(label, one)
    expected = [label for label, one in enumerate(crowd_of) if overlap(box, one)]
    assert sorted(crowd.touching(box)) == expected
    assert crowd.is_free(box) == (not expected)


def test_boxes_that_touch_or_lie_on_two_levels_do_not_overlap() -> None:
    a = Box(0, 0, 0, 1, 0, 2.5, 0.9)
    assert not overlap(a, a._replace(x=5.0))
    assert overlap(a, a._replace(x=4.99))
    assert not overlap(a, a._replace(z=5.0))


def test_a_lateral_offset_is_to_the_left_of_the_driving_direction() -> None:
    graph = two_lane_road().lanes
    box = box_at(graph, 0, CAR[Category.CAR], lateral_offset=0.5)
    assert (box.x, box.y) == pytest.approx((1.0, -4.75))


def test_a_lane_of_known_length_takes_a_known_number_of_cars() -> None:
    # 100 m, nodes every 2 m from 1 m on; 5 m and 3 m gap make one car every 8 m. The first whose
    # body is on the lane with whole nodes to spare is at 7 m, the last at or before 93 m.
    graph = two_lane_road().lanes
    room = standing_room(graph, CAR[Category.CAR], allowed=np.ones(100, dtype=bool))
    assert np.flatnonzero(room[:50]).tolist() == list(range(2, 48))
    fit = max_fit(graph, CAR, {Category.CAR: room}, shares=ONLY_CARS, minimum_gap=3.0)
    assert [node for node in fit.nodes if node < 50] == list(range(2, 48, 4))
    assert len(fit) == 2 * 12


def test_a_maximal_crowd_keeps_its_gap_and_has_room_for_no_more() -> None:
    graph = fork().lanes
    room = standing_room(graph, CAR[Category.CAR], allowed=np.ones(len(graph.x), dtype=bool))
    fit = max_fit(graph, CAR, {Category.CAR: room}, shares=ONLY_CARS, minimum_gap=3.0)
    taken = [box_at(graph, node, CAR[Category.CAR], gap=3.0) for node in fit.nodes]
    for i, box in enumerate(taken):
        assert not any(overlap(box, other) for other in taken[:i])
    for node in np.flatnonzero(room):
        more = box_at(graph, int(node), CAR[Category.CAR], gap=3.0)
        assert any(overlap(more, other) for other in taken)


def test_a_mixed_crowd_keeps_the_shares() -> None:
    graph = two_lane_road(2000.0).lanes
    bodies = {c: DEFAULT_BODY[c] for c in (Category.CAR, Category.BUS, Category.BICYCLE)}
    everywhere = np.ones(len(graph.x), dtype=bool)
    allowed = {c: standing_room(graph, bodies[c], allowed=everywhere) for c in bodies}
    shares = {Category.CAR: 6.0, Category.BUS: 1.0, Category.BICYCLE: 3.0}
    fit = max_fit(graph, bodies, allowed, shares=shares, minimum_gap=2.0)
    counts = {c: fit.categories.count(c) / len(fit) for c in bodies}
    assert counts == pytest.approx({c: share / 10 for c, share in shares.items()}, abs=0.02)


@pytest.mark.parametrize(("radius", "fits"), [(61.0, False), (64.0, True)])
def test_a_body_fits_in_a_curve_only_if_its_middle_stays_on_the_lane(
    radius: float, *, fits: bool
) -> None:
    # 5^2 / (8 R) <= 0.05 m needs R >= 62.5 m.
    graph = ring(radius).lanes
    room = standing_room(graph, CAR[Category.CAR], allowed=np.ones(len(graph.x), dtype=bool))
    assert room.all() == room.any() == fits


def test_nodes_that_are_not_allowed_are_kept_clear_of_the_whole_body() -> None:
    graph = two_lane_road().lanes
    allowed = np.ones(100, dtype=bool)
    allowed[25] = False
    room = standing_room(graph, CAR[Category.CAR], allowed=allowed)
    assert np.flatnonzero(~room[3:47]).tolist() == [20, 21, 22, 23, 24]


def test_a_lane_narrower_than_the_body_has_no_room() -> None:
    graph = two_lane_road().lanes
    wide = Body(5.0, 3.45, 1.5)
    assert not standing_room(graph, wide, allowed=np.ones(100, dtype=bool)).any()


def test_the_path_to_the_nearest_end_follows_the_lanes() -> None:
    graph = fork().lanes
    ends = np.array([len(graph.x) - 1])
    to_end = distance_to_end(ends, graph, np.ones(len(graph.x), dtype=bool))
    # From the first node of road 1 to the last of road 3: 99 m, the quarter circle, 59 m.
    assert to_end[0] == pytest.approx(99 + 12 * radians(90) + 59, abs=0.2)
    assert np.isinf(to_end[50])


@pytest.mark.parametrize("graph", [fork(), ring(), two_lane_road()])
def test_what_is_reached_is_told_for_each_node_and_inside_the_mask_only(graph) -> None:
    mask = np.arange(len(graph.lanes.x)) % 50 != 49
    reach = Reach(graph.lanes, mask)
    for node in range(0, len(mask), 3):
        within = (
            Router(graph, mask).reachable(node) if mask[node] else np.zeros(len(mask), np.bool_)
        )
        assert reach.of(node).tolist() == within.tolist()
