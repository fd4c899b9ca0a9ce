"""Scenarios on a network by netconvert, whose lanes in junctions lie beside those of the map."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from odscen.app.maps import LoadedMap, load_map
from odscen.convert.model.conversion_settings import ConversionSettings
from odscen.lanegraph.query import node_id, walk_node_id
from odscen.maps.store import Workspace
from odscen.scenario.document.scenario_document import Actor, Flow, MapReference, Scenario
from odscen.sumo.runner.network_fit import ASIDE, place_fit, route_fit

MAPS = Path(__file__).parents[3] / "maps"


@pytest.fixture(scope="module", params=["odscen", "netconvert"])
def loaded(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> LoadedMap:
    workspace = Workspace.open(tmp_path_factory.mktemp("workspace"))
    settings = ConversionSettings(converter=request.param)
    return load_map(workspace.add_map(MAPS / "town_5x5.xodr", settings=settings))


def scenario(loaded: LoadedMap, *spawns: int) -> Scenario:
    graph = loaded.sumo.graph
    return Scenario(
        name="placed",
        map=MapReference(
            name=loaded.entry.name, sha256=loaded.entry.sha256, spacing=graph.lanes.spacing
        ),
        roi=tuple(str(name) for name in graph.segments.ids),
        actors=tuple(
            Actor(id=f"car-{number}", category="car", spawn=node_id(graph, node))
            for number, node in enumerate(spawns)
        ),
    )


@pytest.mark.slow
def test_every_node_with_a_lane_aside_is_warned_of_with_its_distance(loaded: LoadedMap) -> None:
    aside = loaded.sumo.lane_places.deviation
    chosen = np.argsort(-aside)[:5].tolist()
    found = list(place_fit(scenario(loaded, *chosen), loaded.sumo))
    if loaded.entry.converter == "odscen":
        assert float(np.nanmax(aside)) < ASIDE
        assert found == []
        return
    assert [problem.code for problem in found] == ["sumo_lane_aside"] * 5
    for node, problem in zip(chosen, found, strict=True):
        assert f"{aside[node]:.2f} m beside it" in problem.message
        assert problem.severity == "warning"


def test_a_place_to_walk_that_the_network_has_not_is_named(loaded: LoadedMap) -> None:
    missing = np.flatnonzero(np.isnan(loaded.sumo.walk_places.deviation))
    if loaded.entry.converter == "odscen":
        assert len(missing) == 0
        return
    graph = loaded.sumo.graph
    flow = Flow(
        id="walkers",
        spawn=walk_node_id(graph, int(missing[0])),
        mix={"pedestrian": 1.0},
        per_hour=60.0,
        begin=0.0,
        end=60.0,
    )
    one = scenario(loaded).model_copy(update={"flows": (flow,)})
    (problem,) = place_fit(one, loaded.sumo)
    assert (problem.code, problem.where) == ("no_sumo_lane", "flows[0].spawn")


def test_on_lanes_that_are_there_every_actor_has_a_route(loaded: LoadedMap) -> None:
    spawnable = np.flatnonzero(loaded.usable.spawnable)
    chosen = spawnable[:: len(spawnable) // 20].tolist()
    one = scenario(loaded, *chosen)
    assert list(place_fit(one, loaded.sumo)) == []
    assert list(route_fit(one, loaded.sumo)) == []
