"""How far fills of towns not seen are from SUMO where queues begin and grow, by kind of place.

``python -m bench queue_places --data DIR --workspace DIR [--rounds 5]``. The varied towns of the
data are left out in three groups; so are Town01, Town04 and Town05, which are kept to measure the
generator on. After each round the corrections of ``learning/reference/queue_places.py`` are changed
by what is missing, for the rounds that follow; they begin at nothing.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.app.learned.evaluated_scenes import scene_of_actors, scenes_of
from odscen.app.learned.learned_maps import whole_map
from odscen.app.learned.model_files import train_on
from odscen.app.learned.snapshot_data import read_shards
from odscen.learning.fill_check import checked_fill
from odscen.learning.reference.gap_states import gap_states
from odscen.learning.reference.model_training import TrainingSettings
from odscen.learning.reference.queue_places import (
    OCCUPIED_MORE,
    PLACES,
    STOPPED_MORE,
    queue_places,
)
from odscen.learning.reference.reference_generator import ReferenceGenerator
from odscen.learning.traffic_metrics import TrafficScene, frechet_distance, scene_features, together
from odscen.learning.traffic_snapshots import STOPPED
from odscen.scenario.document.named_random import stream
from odscen.workspace.store import Workspace

if TYPE_CHECKING:
    from odscen.app.learned.learned_maps import WholeMap
    from odscen.base.arrays import FloatArray
    from odscen.learning.traffic_snapshots import Shard

KEPT = ("Town01", "Town04", "Town05")
GROUPS = 3
LEAST = 20
"""Vehicles in the mean of the snapshots of a map."""
STEP = 0.7
_FEW = 0.5


class _Held(NamedTuple):
    on: WholeMap
    scenes: list[TrafficScene]
    generator: ReferenceGenerator


def main() -> None:
    options = argparse.ArgumentParser()
    options.add_argument("--data", type=Path, required=True)
    options.add_argument("--workspace", type=Path, required=True)
    options.add_argument("--epochs", type=int, default=14)
    options.add_argument("--most", type=int, default=4, help="fills of each map")
    options.add_argument("--rounds", type=int, default=5)
    given = options.parse_args(sys.argv[1:])
    OCCUPIED_MORE[:], STOPPED_MORE[:] = 0.0, 0.0
    held = _held(Workspace.open(given.workspace), read_shards(given.data), given.epochs)
    np.set_printoptions(precision=2, suppress=True, linewidth=120)
    for number in range(given.rounds):
        _round(held, number, given.most)


def _held(workspace: Workspace, shards: list[Shard], epochs: int) -> list[_Held]:
    names = sorted({one.map_name for one in shards if one.map_name.startswith("varied")})
    found = []
    for group in (names[k::GROUPS] for k in range(GROUPS)):
        kept = [one for one in shards if one.map_name not in group and one.town not in KEPT]
        model = train_on(workspace, kept, settings=TrainingSettings(epochs=epochs))
        for name in group:
            mine = [one for one in shards if one.map_name == name]
            if np.mean([len(some.node) for one in mine for some in one.snapshots]) >= LEAST:
                on = whole_map(workspace.map_for(name, mine[0].map_sha256))
                scenes = scenes_of(workspace, mine)
                found.append(_Held(on, scenes, ReferenceGenerator(model)))
    return found


def _round(held: list[_Held], number: int, most: int) -> None:
    sumo, made = np.zeros((PLACES, 2)), np.zeros((PLACES, 2))
    for one in held:
        scenes = one.scenes[:: -(-len(one.scenes) // most)]
        fills = [_filled(one, scene, number, k) for k, scene in enumerate(scenes)]
        counts, counted = _counts(one.on, scenes), _counts(one.on, fills)
        # Large towns count more, but not by all of their vehicles.
        weight = counts.sum() ** -0.5
        sumo, made = sumo + weight * counts, made + weight * counted
        far = frechet_distance(_features(one.on, one.scenes), _features(one.on, fills))
        shares = [some[:, 1].sum() / some.sum() for some in (counts, counted)]
        name = one.on.region.graph.map_name
        print(f"{name}: stopped {shares[0]:.3f}, filled {shares[1]:.3f}; frechet {far:.2f}")
    print(f"round {number}, by place\n SUMO {sumo.sum(axis=1)}\n fill {made.sum(axis=1)}")
    print(f" stopped in SUMO {_share(sumo)}\n stopped in fills {_share(made)}", flush=True)
    missing = np.log((sumo.sum(axis=1) + _FEW) / (made.sum(axis=1) + _FEW))
    OCCUPIED_MORE[:] += STEP * np.clip(missing - missing[0], -1.0, 1.0)
    STOPPED_MORE[:] += STEP * np.clip(_odds(sumo) - _odds(made), -1.0, 1.0)
    print(f" next: occupied {OCCUPIED_MORE}\n       stopped {STOPPED_MORE}", flush=True)


def _filled(held: _Held, scene: TrafficScene, seed: int, number: int) -> TrafficScene:
    """Fill with as many vehicles and the lights of a scene."""
    request = held.on.request(len(scene.node), scene.lights, seed=seed)
    rng = stream(seed, "evaluation", str(number))
    fill = held.generator.fill(held.on.region.graph, request, rng)
    actors = checked_fill(fill, request, held.on.region).actors
    return scene_of_actors(held.on, actors, scene.lights, name=scene.name)


def _counts(on: WholeMap, scenes: list[TrafficScene]) -> FloatArray:
    """Vehicles by kind of place, moving and stopped: ``(PLACES, 2)``."""
    found = np.zeros((PLACES, 2))
    site = on.learned.site
    for node, category, speed, lights, _ in scenes:
        states = gap_states(site.strips, node=node, category=category, speed=speed)
        place = queue_places(site, lights, states, node)
        np.add.at(found, (place, (speed < STOPPED).astype(np.int64)), 1.0)
    return found


def _features(on: WholeMap, scenes: list[TrafficScene]) -> FloatArray:
    lanes, site = on.region.graph.lanes, on.learned.site
    return together([scene_features(lanes, site, one) for one in scenes]).features


def _share(counts: FloatArray) -> FloatArray:
    found: FloatArray = (counts[:, 1] + _FEW / 2.0) / (counts.sum(axis=1) + _FEW)
    return found


def _odds(counts: FloatArray) -> FloatArray:
    share = _share(counts)
    found: FloatArray = np.log(share / (1.0 - share))
    return found
