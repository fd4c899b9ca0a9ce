"""Identifiers. Each is a type of its own, so that one cannot be passed for another.

A node id is readable and stable: the same file and the same spacing give the same ids on any
machine. A SUMO id is never parsed or built, always looked up in the lane table.
"""

from __future__ import annotations

from typing import NamedTuple, NewType

RoadId = NewType("RoadId", str)
"""``id`` of an OpenDRIVE ``<road>``, a string as in the file."""
JunctionId = NewType("JunctionId", str)
"""``id`` of an OpenDRIVE ``<junction>``."""
NodeId = NewType("NodeId", str)
"""Lane-graph node ``road.section.lane.k``, pedestrian node ``ped.road.section.lane.k``."""
SegmentId = NewType("SegmentId", str)
ActorId = NewType("ActorId", str)
SumoEdgeId = NewType("SumoEdgeId", str)
SumoLaneId = NewType("SumoLaneId", str)


class LaneKey(NamedTuple):
    """A lane of one lane section: OpenDRIVE road id, index of the section, lane id."""

    road: RoadId
    section: int
    lane: int

    def __str__(self) -> str:
        return f"{self.road}.{self.section}.{self.lane}"


class Roadside(NamedTuple):
    """The walk beside a lane (:mod:`odscen.lanegraph.pedestrian_graph`); the lane as in `LaneKey`.

    ``beside`` is always true: it tells the walk from the lane, as tuples are compared by content.
    """

    road: RoadId
    section: int
    lane: int
    beside: bool = True
