"""Places of a scenario as positions of OpenSCENARIO, and bodies with their reference point."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from odscen.base.categories import Category
from odscen.formats.openscenario.dialect import xml
from odscen.lanegraph.query import is_walk_node_id, node_index, walk_node_index
from odscen.scenario.placing.bodies import body_of

if TYPE_CHECKING:
    from lxml.etree import _Element

    from odscen.base.categories import Body
    from odscen.formats.base import ExportSource
    from odscen.lanegraph.graphs import MapGraph
    from odscen.scenario.document.rules_document import RulePlace
    from odscen.scenario.document.scenario_document import Actor

REAR_AXLE: Final = 0.28
"""Metres from the centre of a vehicle back to its rear axle, as a share of its length."""

UNDERGROUND: Final = 100.0
"""Metres."""


def reference_behind(category: str, length: float) -> float:
    """Metres from the centre of a body back to its reference point, of ``length`` metres."""
    return 0.0 if category == Category.PEDESTRIAN else REAR_AXLE * length


@dataclass(frozen=True, slots=True)
class GroundPose:
    """A place on the ground: metres in the OpenDRIVE frame, radians counter-clockwise from x."""

    x: float
    y: float
    z: float
    hdg: float | None

    def back(self, metres: float) -> GroundPose:
        """Return the spot so many metres behind."""
        if self.hdg is None:
            return self
        dx, dy = metres * math.cos(self.hdg), metres * math.sin(self.hdg)
        return GroundPose(self.x - dx, self.y - dy, self.z, self.hdg)

    def left(self, metres: float) -> GroundPose:
        """Return the spot so many metres to the left."""
        hdg = self.hdg or 0.0
        dx, dy = -metres * math.sin(hdg), metres * math.cos(hdg)
        return GroundPose(self.x + dx, self.y + dy, self.z, self.hdg)

    def below(self) -> GroundPose:
        """Return the spot under the ground where who is not there waits for ScenarioRunner."""
        return GroundPose(self.x, self.y, self.z - UNDERGROUND, self.hdg)

    def element(self) -> _Element:
        """``Position`` in world coordinates."""
        return xml("Position", xml("WorldPosition", x=self.x, y=self.y, z=self.z, h=self.hdg))


@dataclass(frozen=True, slots=True)
class RelativePose(GroundPose):
    """A place by metres ahead and left of the reference point of an entity, and its direction."""

    entity: str = ""

    def element(self) -> _Element:
        """``Position`` relative to the entity."""
        turn = xml("Orientation", type="relative", h=self.hdg)
        place = {"entityRef": self.entity, "dx": self.x, "dy": self.y}
        return xml("Position", xml("RelativeObjectPosition", turn, **place))


@dataclass(frozen=True, slots=True)
class Places:
    """Nodes of a map, and the bodies of a scenario's actors."""

    source: ExportSource

    @property
    def graph(self) -> MapGraph:
        """Lane graph and pedestrian graph."""
        return self.source.sumo_map.graph

    def spot(self, place: RulePlace) -> GroundPose:
        """Where a place is; of x and y the height and heading are those of the nearest node."""
        if not isinstance(place, str):
            lanes = self.graph.lanes
            near = int(((lanes.x - place[0]) ** 2 + (lanes.y - place[1]) ** 2).argmin())
            return GroundPose(*place, float(lanes.z[near]), None)
        if is_walk_node_id(place):
            walks, node = self.graph.walks, walk_node_index(self.graph, place)
            return GroundPose(
                float(walks.x[node]), float(walks.y[node]), float(walks.z[node]), None
            )
        lanes, node = self.graph.lanes, node_index(self.graph, place)
        values = (lanes.x[node], lanes.y[node], lanes.z[node], lanes.hdg[node])
        return GroundPose(*map(float, values))

    def start(self, actor: Actor) -> GroundPose:
        """Where the reference point of an actor is at first."""
        if is_walk_node_id(actor.spawn):
            walks, node = self.graph.walks, walk_node_index(self.graph, actor.spawn)
            here = self.spot(actor.spawn)
            centre = GroundPose(here.x, here.y, here.z, float(walks.hdg[node]))
        else:
            centre = self.spot(actor.spawn)
        back = self.centre_ahead(actor) - actor.longitudinal_offset
        return centre.left(actor.lateral_offset).back(back)

    def body(self, actor: Actor) -> Body:
        """Size of an actor."""
        return body_of(actor, self.source.assets)

    def centre_ahead(self, actor: Actor) -> float:
        """Metres from the reference point, the rear axle, ahead to the centre of the body."""
        return reference_behind(actor.category, self.body(actor).length)

    def goal(self, node: str) -> _Element:
        """``Position`` of a lane node by road, lane and s; of others in world coordinates."""
        if is_walk_node_id(node):
            return self.spot(node).element()
        lanes, index = self.graph.lanes, node_index(self.graph, node)
        key = lanes.lanes.keys[int(lanes.lane[index])]
        return xml(
            "Position",
            xml(
                "LanePosition",
                roadId=key.road,
                laneId=key.lane,
                s=float(lanes.s[index]),
                offset=0.0,
            ),
        )
