"""Where vehicles can drive into a region: lanes that begin at its boundary."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from odscen.lanegraph.graphs import Relation

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from odscen.scenario.document.scenario_document import VehicleInput
    from odscen.scenario.placing.region import Region

Direction = Literal["forward", "backward"]


class EntryLane(NamedTuple):
    """A lane that leads into the region.

    Attributes
    ----------
    lane
        Its OpenDRIVE id.
    node
        Its first node in the region.
    """

    lane: int
    node: int


class Entry(NamedTuple):
    """The lanes of one direction that lead into the region on one segment.

    Attributes
    ----------
    direction
        ``forward`` with growing s of the road.
    lanes
        From the outer edge of the road inwards.
    """

    segment: str
    direction: Direction
    lanes: tuple[EntryLane, ...]


def entries(region: Region) -> tuple[Entry, ...]:
    """Find all entries of a region, by segment (in the order of the map), forward first.

    A lane leads into the region where its node has no predecessor inside, and the lanes beside it
    have none there either: one that begins where the road widens is no entry. Junctions have none.
    """
    graph = region.graph
    lanes, ids = graph.lanes, graph.segments.ids
    found: dict[tuple[int, bool], list[EntryLane]] = defaultdict(list)
    for group in _first_nodes(region).values():
        for node in group:
            if _alone(region, node, group):
                row = int(lanes.lane[node])
                key = int(lanes.segment[node]), bool(lanes.lanes.forward[row])
                found[key].append(EntryLane(lanes.lanes.keys[row].lane, node))
    return tuple(
        Entry(
            str(ids[segment]),
            "forward" if forward else "backward",
            tuple(sorted(found[segment, forward], key=lambda one: -abs(one.lane))),
        )
        for segment, forward in sorted(found, key=lambda key: (key[0], not key[1]))
    )


def entries_of(part: VehicleInput, every: Iterable[Entry]) -> list[Entry]:
    """Entries that an input may mean: those of its segment and, if it has one, its direction."""
    return [
        entry
        for entry in every
        if entry.segment == part.segment and part.direction in (None, entry.direction)
    ]


def entry_lanes(part: VehicleInput, entry: Entry) -> tuple[EntryLane, ...]:
    """Lanes of an entry that an input uses, from the outer edge of the road inwards."""
    if not part.lanes:
        return entry.lanes
    return tuple(one for one in entry.lanes if one.lane in part.lanes)


def _first_nodes(region: Region) -> dict[tuple[int, bool], list[int]]:
    """Nodes outside junctions without predecessor inside, by section of a road and direction.

    The key is the first row of the lanes of the section.
    """
    lanes = region.graph.lanes
    inside = region.lanes
    led_to = np.zeros(len(inside), dtype=np.bool_)
    follows = (lanes.relation == Relation.SUCCESSOR) & inside[lanes.source]
    led_to[lanes.target[follows]] = True
    sections: dict[tuple[str, int], int] = {}
    found: dict[tuple[int, bool], list[int]] = defaultdict(list)
    for node in np.flatnonzero(inside & ~led_to).tolist():
        row = int(lanes.lane[node])
        if lanes.lanes.junctions[row] is None:
            key = lanes.lanes.keys[row]
            section = sections.setdefault((key.road, key.section), len(sections))
            found[section, bool(lanes.lanes.forward[row])].append(node)
    return found


def _alone(region: Region, node: int, firsts: Sequence[int]) -> bool:
    """Whether all lanes beside a first node begin there, too."""
    lanes = region.graph.lanes
    near = 1.5 * lanes.spacing
    begin = {int(lanes.lane[n]) for n in firsts if abs(lanes.s[n] - lanes.s[node]) <= near}
    return all(
        row in begin or not _passes(region, row, float(lanes.s[node]), near)
        for row in _beside(region, int(lanes.lane[node]))
    )


def _beside(region: Region, row: int) -> Iterable[int]:
    """Rows of the lanes of the same section and direction."""
    lanes = region.graph.lanes.lanes
    own = lanes.keys[row]
    for step in (-1, 1):
        other = row + step
        while 0 <= other < len(lanes.keys) and lanes.keys[other][:2] == own[:2]:
            if lanes.forward[other] == lanes.forward[row]:
                yield other
            other += step


def _passes(region: Region, row: int, s: float, near: float) -> bool:
    """Whether a lane has a node of the region near ``s``."""
    lanes = region.graph.lanes
    nodes = slice(int(lanes.lanes.first_node[row]), int(lanes.lanes.first_node[row + 1]))
    return bool(np.any(region.lanes[nodes] & (np.abs(lanes.s[nodes] - s) <= near)))
