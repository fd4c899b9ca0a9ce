"""What becomes of a generator's fill: good parts stay, the rest is repaired or dropped by name."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from odscen.base.categories import DEFAULT_BODY, Category
from odscen.lanegraph.graphs import MapGraph
from odscen.lanegraph.query import node_id
from odscen.learning.fill import CheckedFill, FillRequest, checked_fill, fill_from_arrays
from odscen.scenario.checks.scenario_checks import check
from odscen.scenario.document.sampling_config import SamplingConfig
from odscen.scenario.document.scenario_document import MapReference, Scenario, Simulation
from odscen.scenario.placing.bodies import box_at, overlap
from odscen.scenario.placing.region import Region, Usable
from odscen.scenario.sampling.sampler import wanted_users
from tests.graphs import fork, ring, two_lane_road

GRAPHS = {"fork": fork(), "road": two_lane_road(300.0), "ring": ring()}
ROAD = GRAPHS["road"]


def filled(graph: MapGraph, **columns: Any) -> CheckedFill:
    region = Region.of(graph, graph.segments.ids)
    crew = wanted_users(region, SamplingConfig(), Usable(), fill=0.5)
    request = FillRequest(
        graph,
        region.lanes,
        region.walks,
        {**crew.road_places.allowed, **crew.walk_places.allowed},
        DEFAULT_BODY,
        crew.vehicles,
        crew.walkers,
        seed=1,
    )
    columns = {"category": np.array(["car"] * len(columns["node"]))} | columns
    arrays = {name: np.asarray(values) for name, values in columns.items()}
    return checked_fill(fill_from_arrays(arrays), request, region)


def scenario_of(graph: MapGraph, found: CheckedFill) -> Scenario:
    return Scenario(
        name="filled",
        map=MapReference(name=graph.map_name, sha256=graph.map_sha256, spacing=graph.lanes.spacing),
        roi=graph.segments.ids,
        actors=found.actors,
        simulation=Simulation(duration=60.0),
    )


def test_a_good_fill_is_taken_as_it_is() -> None:
    found = filled(
        ROAD, node=[20, 40], category=["car", "truck"], initial_speed=[8.0, 7.5],
        desired_speed=[12.0, np.nan], goal=[-1, 60], lateral_offset=[0.1, -0.1], depart=[0.0, 3.0],
    )  # fmt: skip
    assert found.remarks == ()
    one, other = found.actors
    assert (one.id, one.spawn, one.goal) == ("car-1", node_id(ROAD, 20), None)
    assert (one.initial_speed, one.speed, one.lateral_offset, one.depart) == (8.0, 12.0, 0.1, 0.0)
    assert (other.id, other.goal, other.depart) == ("truck-1", node_id(ROAD, 60), 3.0)
    assert other.initial_speed == 7.5


BROKEN: dict[str, tuple[dict[str, Any], tuple[str, str, str]]] = {
    "a node that is not there": ({"node": [20, 99_999]}, ("dropped", "node", "no node 99999")),
    "a negative node": ({"node": [20, -4]}, ("dropped", "node", "no node -4")),
    "a node that is no number": ({"node": [20.0, np.nan]}, ("dropped", "node", "has no node")),
    "an unknown category": (
        {"node": [20, 40], "category": ["car", "tank"]}, ("dropped", "category", "'tank'")
    ),
    "an unknown number of a category": (
        {"node": [20, 40], "category": [0, 17]}, ("dropped", "category", "no category '17'")
    ),
    "the same node twice": ({"node": [20, 20]}, ("moved", "node", "node 20 is taken")),
    "bodies that overlap": ({"node": [20, 21]}, ("moved", "node", "node 21 is taken")),
    "too near the end": ({"node": [20, 149]}, ("moved", "node", "has no room for it")),
    "a negative speed": (
        {"node": [20, 40], "initial_speed": [0, -3]}, ("clamped", "initial_speed", "it is 0")
    ),
    "faster than it wants": (
        {"node": [20, 40], "initial_speed": [0, 20], "desired_speed": [9, 9]},
        ("clamped", "initial_speed", "it is 9"),
    ),
    "an infinite speed": (
        {"node": [20, 40], "initial_speed": [0, np.inf]}, ("opened", "initial_speed", "from rest")
    ),
    "a speed that nobody drives": (
        {"node": [20, 40], "desired_speed": [10, 900]}, ("clamped", "desired_speed", "it is 55.6")
    ),
    "a goal that is not there": (
        {"node": [20, 40], "goal": [-1, 5_000_000]}, ("opened", "goal", "no node 5000000")
    ),
    "a goal behind": ({"node": [20, 40], "goal": [-1, 4]}, ("opened", "goal", "no path inside")),
    "a goal where it starts": ({"node": [20, 40], "goal": [-1, 40]}, ("opened", "goal", "no path")),
    "beside the lane": (
        {"node": [20, 40], "lateral_offset": [0, 5]}, ("clamped", "lateral_offset", "not between")
    ),
    "a departure in the past": (
        {"node": [20, 40], "depart": [0, -5]}, ("clamped", "depart", "it is 0")
    ),
    "a departure that never comes": (
        {"node": [20, 40], "depart": [0, np.inf]}, ("clamped", "depart", "it is 86400")
    ),
    "too fast for the gap": (
        {"node": [40, 30], "initial_speed": [0, 13], "desired_speed": [20, 20]},
        ("clamped", "initial_speed", "too fast for the gap ahead"),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BROKEN)
def test_what_is_broken_is_repaired_or_dropped_with_a_reason(name: str) -> None:
    columns, (what, column, why) = BROKEN[name]
    found = filled(ROAD, **columns)
    [remark] = found.remarks
    assert (remark.row, remark.what, remark.column) == (1, what, column)
    assert why in remark.why
    assert len(found.actors) == (1 if what == "dropped" else 2)
    assert found.actors[0].spawn == node_id(ROAD, int(columns["node"][0]))
    problems = check(scenario_of(ROAD, found), ROAD)
    assert [one for one in problems if one.severity == "error"] == []


def test_who_asks_for_a_free_place_keeps_it_from_who_has_to_move() -> None:
    found = filled(ROAD, node=[20, 20, 23])
    assert [actor.spawn for actor in found.actors][::2] == [
        node_id(ROAD, 20),
        node_id(ROAD, 23),
    ]
    assert [one.row for one in found.remarks] == [1]


def test_an_empty_fill_is_an_empty_road() -> None:
    assert filled(ROAD, node=np.array([], dtype=int)).actors == ()


COLUMNS = st.fixed_dictionaries(
    {},
    optional={
        name: st.floats(allow_nan=True, allow_infinity=True, width=32)
        for name in ("initial_speed", "desired_speed", "lateral_offset", "depart")
    },
)


@pytest.mark.slow
@settings(max_examples=80, deadline=None)
@given(st.sampled_from(sorted(GRAPHS)), st.data())
def test_whatever_comes_back_what_is_kept_passes_every_check_and_touches_nothing(
    name: str, data: st.DataObject
) -> None:
    graph = GRAPHS[name]
    count = data.draw(st.integers(1, 12))
    nodes = st.integers(-2, len(graph.lanes.x) + 2)
    number = st.floats(allow_nan=True, allow_infinity=True, width=32)
    columns: dict[str, Any] = {
        "node": data.draw(st.lists(nodes, min_size=count, max_size=count)),
        "category": data.draw(st.lists(st.integers(-1, 7), min_size=count, max_size=count)),
        "goal": data.draw(st.lists(nodes, min_size=count, max_size=count)),
    }
    for column in ("initial_speed", "desired_speed", "lateral_offset", "depart"):
        if data.draw(st.booleans()):
            columns[column] = data.draw(st.lists(number, min_size=count, max_size=count))
    found = filled(graph, **columns)
    dropped = {one.row for one in found.remarks if one.what == "dropped"}
    assert len(found.actors) == count - len(dropped)
    problems = check(scenario_of(graph, found), graph)
    assert [one for one in problems if one.severity == "error"] == []
    region = Region.of(graph, graph.segments.ids)
    boxes = []
    for actor in found.actors:
        place = region.place(actor.spawn)
        assert place is not None
        boxes.append(
            box_at(
                region.nodes_of(place),
                place.node,
                DEFAULT_BODY[Category(actor.category)],
                lateral_offset=actor.lateral_offset,
            )
        )
    assert not any(overlap(one, other) for one, other in combinations(boxes, 2))
