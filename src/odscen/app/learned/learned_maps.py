"""Maps of a workspace as the model of traffic sees them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from odscen.app.learned.snapshot_data import connected_segments
from odscen.app.maps import load_map
from odscen.base.errors import InputError
from odscen.learning.fill import VEHICLES, FillRequest
from odscen.learning.reference.model_training import Example, LearnedMap
from odscen.learning.reference.site_features import site_of
from odscen.scenario.document.sampling_config import SamplingConfig
from odscen.scenario.placing.region import Region
from odscen.scenario.sampling.sampler import wanted_users

if TYPE_CHECKING:
    from collections.abc import Iterable

    from odscen.app.maps import LoadedMap
    from odscen.learning.traffic_snapshots import LightView, Shard
    from odscen.maps.map_entry import MapEntry
    from odscen.maps.store import Workspace
    from odscen.scenario.placing.sampled_places import Supply


@dataclass(frozen=True, slots=True, eq=False)
class WholeMap:
    """All of a map that hangs together, as a region that is filled.

    Attributes
    ----------
    loaded
        The map.
    region
        Its connected segments.
    places
        Where vehicles may be put.
    learned
        The map as the model sees it.
    """

    loaded: LoadedMap
    region: Region
    places: Supply
    learned: LearnedMap

    def request(self, vehicles: int, lights: LightView, *, seed: int) -> FillRequest:
        """What a generator is asked for: so many vehicles, and lights as they were."""
        return FillRequest(
            graph=self.region.graph,
            roads=self.region.lanes,
            walks=self.region.walks,
            allowed=self.places.allowed,
            bodies=self.loaded.usable.bodies,
            vehicles=vehicles,
            walkers=0,
            seed=seed,
            given_lights=lights,
        )


@lru_cache(maxsize=16)
def whole_map(entry: MapEntry) -> WholeMap:
    """Look at a map of the workspace; the last few stay in memory."""
    loaded = load_map(entry)
    graph = loaded.sumo.graph
    region = Region.of(graph, connected_segments(graph))
    places = wanted_users(region, SamplingConfig(), loaded.usable, fill=0.5).road_places
    none = np.zeros(len(graph.lanes.x), dtype=np.bool_)
    allowed = np.stack([places.allowed.get(category, none) for category in VEHICLES])
    learned = LearnedMap(site_of(graph.lanes, graph.walks), allowed, graph.lanes.spacing)
    return WholeMap(loaded, region, places, learned)


def examples_of(workspace: Workspace, shards: Iterable[Shard]) -> list[Example]:
    """Put the snapshots of shards on their maps.

    Raises
    ------
    NotFoundError
        If the workspace does not have a map.
    InputError
        If the map of that name has other content.
    """
    examples = []
    for shard in shards:
        entry = workspace.map_for(shard.map_name, shard.map_sha256)
        learned = whole_map(entry).learned
        nodes = len(learned.site.limit)
        for snapshot in shard.snapshots:
            if len(snapshot.node) and int(snapshot.node.max()) >= nodes:
                msg = f"a snapshot of {shard.map_name} has node {int(snapshot.node.max())}, "
                msg += f"but the map has {nodes}: it was taken on other nodes"
                raise InputError(msg)
            examples.append(Example(learned, snapshot))
    return examples
