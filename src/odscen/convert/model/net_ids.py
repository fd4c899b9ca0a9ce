"""Names of what we put into a SUMO network: the only place where ids of SUMO are built.

SUMO and netconvert name lanes after their edge and index, and what is inside a junction after the
junction behind a colon (https://sumo.dlr.de/docs/Networks/SUMO_Road_Networks.html). We write the
network, so we give the names; everybody else looks them up in the lane table or asks SUMO.
"""

from __future__ import annotations

from odscen.base.ids import SumoEdgeId, SumoLaneId


def lane_id(edge: str, index: int = 0) -> SumoLaneId:
    """Lane of an edge, counted from the outer one."""
    return SumoLaneId(f"{edge}_{index}")


def internal_edge_id(junction: str, number: int) -> SumoEdgeId:
    """Edge of one connection through a junction; ``number`` is that of its first lane there."""
    return SumoEdgeId(f":{junction}_{number}")


def crossing_id(junction: str, number: int) -> SumoEdgeId:
    """Crossing of a junction, counted from 0."""
    return SumoEdgeId(f":{junction}_c{number}")


def walking_area_id(junction: str, number: int) -> SumoEdgeId:
    """Walking area of a junction, counted from 0."""
    return SumoEdgeId(f":{junction}_w{number}")
