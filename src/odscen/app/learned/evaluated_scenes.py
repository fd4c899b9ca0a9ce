"""Scenes that are evaluated: of snapshots, of fills, of scenarios whoever has made them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.app.learned.learned_maps import examples_of
from odscen.base.categories import Category
from odscen.base.errors import InputError
from odscen.learning.fill import Fill
from odscen.learning.reference.model_training import placed
from odscen.learning.traffic_metrics import TrafficScene
from odscen.scenario.document.scenario_document import MapReference, Scenario, Simulation
from odscen.scenario.placing.region import place_of
from odscen.scenario.placing.sampled_places import place_at_random

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.app.learned.learned_maps import WholeMap
    from odscen.learning.fill import FillRequest
    from odscen.learning.traffic_snapshots import LightView, Shard
    from odscen.maps.store import Workspace
    from odscen.scenario.document.scenario_document import Actor


def scenes_of(workspace: Workspace, shards: Sequence[Shard]) -> list[TrafficScene]:
    """Vehicles of snapshots that a generator might have placed; empty snapshots are left out."""
    scenes = []
    for shard in shards:
        for example in examples_of(workspace, [shard]):
            good, snapshot = placed(example), example.snapshot
            if good.any():
                scenes.append(
                    TrafficScene(
                        snapshot.node[good],
                        snapshot.category[good],
                        snapshot.speed[good],
                        snapshot.lights,
                        str(shard.about.get("seed")),
                    )
                )
    if not scenes:
        raise InputError(f"the snapshots of {shards[0].map_name} have no vehicles to compare with")
    return scenes


def placed_at_random(on: WholeMap, request: FillRequest, rng: np.random.Generator) -> Fill:
    """Place vehicles as sampling does: anywhere, from rest."""
    spots = place_at_random(on.places, request.vehicles, rng)
    node = np.array([spot.node for spot in spots], dtype=np.int64)
    return Fill(node, np.array([str(spot.category) for spot in spots], dtype=np.str_))


def scene_of_actors(
    on: WholeMap, actors: Sequence[Actor], lights: LightView, *, name: str
) -> TrafficScene:
    """Vehicles that depart at the beginning; those without an initial speed are stopped."""
    names = [*Category]
    places = [place_of(on.region.graph, actor.spawn) for actor in actors]
    kept = [
        (place.node, names.index(actor.category), actor.initial_speed or 0.0)
        for place, actor in zip(places, actors, strict=True)
        if place is not None and not place.walk and actor.depart == 0.0
    ]
    node, category, speed = zip(*kept, strict=True) if kept else ((), (), ())
    return TrafficScene(
        np.array(node, dtype=np.int64), np.array(category, dtype=np.int64),
        np.array(speed, dtype=np.float64), lights, name,
    )  # fmt: skip


def scene_of_scenario(
    on: WholeMap, scenario: Scenario, lights: LightView
) -> tuple[TrafficScene, float]:
    """Vehicles of a scenario on allowed nodes, and the share of those that are on no such node."""
    scene = scene_of_actors(on, scenario.actors, lights, name=scenario.name)
    good = on.learned.allowed[scene.category, scene.node]
    vehicles = sum(actor.category is not Category.PEDESTRIAN for actor in scenario.actors)
    kept = TrafficScene(
        scene.node[good], scene.category[good], scene.speed[good], lights, scene.name
    )
    return kept, 1.0 - int(good.sum()) / vehicles if vehicles else 0.0


def scenario_of(on: WholeMap, actors: Sequence[Actor], number: int) -> Scenario:
    """Scenario of a fill of a whole map."""
    graph = on.region.graph
    return Scenario(
        name=f"{graph.map_name}-{number:04d}",
        map=MapReference(name=graph.map_name, sha256=graph.map_sha256, spacing=graph.lanes.spacing),
        seed=number,
        roi=on.region.segments,
        actors=tuple(actors),
        simulation=Simulation(duration=60.0, step_length=0.5),
    )
