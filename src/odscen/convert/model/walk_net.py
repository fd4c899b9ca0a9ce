"""The pedestrian network as values: lanes to walk on, crossings, walking areas."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from odscen.base.ids import SumoEdgeId
    from odscen.convert.model.lane_alignment import LaneAlignment, Line
    from odscen.convert.model.net import (
        NetEdge,
        NetJunction,
        NetLink,
    )
    from odscen.convert.model.right_of_way import Walkway


class WalkLane(NamedTuple):
    """A pedestrian edge and what it lies on."""

    edge: NetEdge
    line: Line
    alignment: LaneAlignment


class PlacedCrossing(NamedTuple):
    """A crossing of a junction and the walking area at which it starts."""

    edge: NetEdge
    walkway: Walkway
    start: SumoEdgeId
    link: NetLink


@dataclass(frozen=True, slots=True)
class WalkNet:
    """All that persons walk on.

    ``crossings`` are those of each junction, in the order in which the junction counts them;
    ``junctions`` those that exist for persons only.
    """

    lanes: tuple[WalkLane, ...]
    areas: tuple[NetEdge, ...]
    crossings: dict[str, tuple[PlacedCrossing, ...]]
    links: tuple[NetLink, ...]
    walk_links: tuple[tuple[SumoEdgeId, SumoEdgeId], ...]
    junctions: tuple[NetJunction, ...]
