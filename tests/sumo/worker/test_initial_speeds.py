"""Vehicles of flows depart at the speed that the flow gives them, and none is lost for it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from odscen.lanegraph.query import node_id
from tests.sumo.story_case import document, loaded, prepared, told

if TYPE_CHECKING:
    from pathlib import Path

CROSSING = "signal_crossing"
WANTED = 10.0
"""m/s; the slowest driver keeps to 11.5 m/s there."""


def node_before_light(metres: float) -> str:
    """Node of the approach's first SUMO lane, so far before its end; 20 m on is the light."""
    sumo = loaded(CROSSING).sumo
    places = sumo.lane_places
    source = next(link.source for link in sumo.lights[0].links if not link.source.startswith(":"))
    into = {sumo.net.lanes[source].edge}
    [approach] = {
        sumo.net.lanes[link.source].edge
        for link in sumo.net.links
        if sumo.net.lanes[link.target].edge in into and not sumo.net.lanes[link.source].internal
    }
    length = sumo.net.edge_length(approach)
    rest = {
        node: length - place[1]
        for node in range(len(sumo.graph.lanes.x))
        if (place := places.of(node)) is not None
        and sumo.net.lanes[place[0]].edge == approach
        and sumo.net.lanes[place[0]].allows("passenger")
    }
    return node_id(sumo.graph, min(rest, key=lambda node: abs(rest[node] - metres)))


@pytest.mark.parametrize("metres", [6.0, 12.0, 25.0, 50.0])
@pytest.mark.parametrize("step", [0.1, 1.0])
def test_every_vehicle_of_a_flow_departs_however_near_the_light_is(
    tmp_path: Path, step: float, metres: float
) -> None:
    flow = {
        "id": "f", "spawn": node_before_light(metres), "per_hour": 400, "end": 300.0,
        "initial_speed": WANTED,
    }  # fmt: skip
    run = prepared(document(CROSSING, [], [], step=step, until=420.0, flows=[flow]))
    found = told(run, tmp_path / "run")
    departed = [event for event in found.events if event.kind == "departed"]
    assert len(departed) == len(found.tracks) == 29
    first = [float(track.speed[0]) for track in found.tracks.values()]
    assert max(first) <= WANTED + 1e-3
    if metres == 50.0:
        assert min(first) == pytest.approx(WANTED, abs=1e-3)
    elif metres < 20.0:  # it could not stop at the light otherwise
        assert max(first) < 0.75 * WANTED


def node_on_approach(name: str, metres: float) -> str:
    """Node of a lane that ends at a light, so far before its end."""
    sumo = loaded(name).sumo
    rest: dict[str, dict[int, float]] = {}
    for node in range(len(sumo.graph.lanes.x)):
        if (place := sumo.lane_places.of(node)) is not None:
            edge = sumo.net.lanes[place[0]].edge
            rest.setdefault(place[0], {})[node] = sumo.net.edge_length(edge) - place[1]
    links = (link for light in sumo.lights for link in light.links)
    own = next(rest[link.source] for link in links if link.source in rest)
    return node_id(sumo.graph, min(own, key=lambda node: abs(own[node] - metres)))


@pytest.mark.slow
def test_who_appears_too_near_a_red_light_to_stop_is_there_at_the_wanted_speed(
    tmp_path: Path,
) -> None:
    actor = {"id": "a", "category": "car", "spawn": node_on_approach("town_5x5", 8.0)}
    rule = {
        "id": "r", "actor": "a", "when": {"time": {"after": 30.0}},
        "then": [{"appear": {"speed": 13.0}}],
    }  # fmt: skip
    run = prepared(document("town_5x5", [actor], [rule], until=33.0))
    found = told(run, tmp_path / "run")
    assert [event.time for event in found.events if event.kind == "departed"] == [30.1]
    speed = found.tracks["a"].speed
    assert speed[0] < 5.0  # with more SUMO would have given up the departure
    assert 13.0 - 0.91 <= speed[1] <= 13.0  # it brakes with 9 m/s² at once
