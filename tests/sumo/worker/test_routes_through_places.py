"""Actors pass the places that their routes are to lead through, in their order."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from odscen.lanegraph.query import node_id, walk_node_id
from odscen.lanegraph.shortest_paths import Router, WalkRouter
from tests.sumo.story_case import Track, document, loaded, run

if TYPE_CHECKING:
    from pathlib import Path

TOWN = "town_5x5"


def nearest(track: Track, x: float, y: float) -> tuple[float, float]:
    """When the front is nearest to a place, and how far from it, m."""
    away = np.hypot(track.x - x, track.y - y)
    return float(track.time[np.argmin(away)]), float(away.min())


def detour(router: Any, start: int, *, at_least: float) -> tuple[int, int]:
    """A place off the shortest way to a goal: through it is longer by so many metres."""
    random = np.random.default_rng(3)
    ahead = router.distances(start)
    near = np.flatnonzero((ahead > 100.0) & (ahead < 400.0))
    for goal in random.permutation(router.goal_candidates(start)).tolist():
        for place in random.permutation(near)[:60].tolist():
            onward = router.distances(place)[goal]
            longer = ahead[place] + onward - ahead[goal]
            turned = router.path(start, place)[-2] == router.path(place, goal)[1:2]
            if at_least < longer < 600.0 and onward > 30.0 and not turned:
                return place, goal
    raise AssertionError


@pytest.mark.parametrize("on_foot", [False, True])
def test_an_actor_passes_a_place_off_its_shortest_way(tmp_path: Path, on_foot: bool) -> None:
    graph = loaded(TOWN).sumo.graph
    places = graph.walks if on_foot else graph.lanes
    router = WalkRouter(graph) if on_foot else Router(graph, loaded(TOWN).sumo.drivable)
    name = walk_node_id if on_foot else node_id
    start = 900 if on_foot else 300
    place, goal = detour(router, start, at_least=60.0)
    one = {
        "id": "one", "category": "pedestrian" if on_foot else "car", "spawn": name(graph, start),
        "goal": name(graph, goal),
    }  # fmt: skip
    past = (float(places.x[place]), float(places.y[place]))
    tracks = []
    for via in ([], [name(graph, place)]):
        actors = [one | ({"via": via} if via else {})]
        found = run(document(TOWN, actors, [], step=0.5, until=900.0), tmp_path / str(len(via)))
        assert [e.kind for e in found.events] == ["departed", "arrived"]
        tracks.append(found.tracks["one"])
    straight, through = tracks
    beside = float(places.width[place]) if on_foot else 0.5
    step = float(through.speed.max()) * 0.5
    assert nearest(straight, *past)[1] > 10.0
    assert nearest(through, *past)[1] <= math.hypot(beside, step)
    longer = router.distances(start)[place] + router.distances(place)[goal]
    assert through.travelled[-1] == pytest.approx(longer, rel=0.1, abs=15.0)
