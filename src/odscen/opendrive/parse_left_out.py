"""Roads that cannot be read, left out where the others hang together without them.

The rule is :attr:`Rule.ROAD_LEFT_OUT`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from odscen.base.errors import OpenDriveError
from odscen.base.ids import RoadId
from odscen.opendrive.parse_rules import MOST_LEFT_OUT, Notes, Rule

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from odscen.base.ids import JunctionId
    from odscen.opendrive.parse_xml import Element
    from odscen.opendrive.road_model import Junction, Road


class RoadFault(NamedTuple):
    """A road that cannot be read, by the id that it has in the file, and why."""

    road: str
    error: OpenDriveError


def leave_out_faulty(
    roads: dict[RoadId, Road],
    faults: Sequence[RoadFault],
    elements: Sequence[Element],
    junctions: Mapping[JunctionId, Junction],
    notes: Notes,
) -> dict[RoadId, Road]:
    """Leave out the roads that are at fault, and note each.

    Parameters
    ----------
    elements
        All roads of the file; of those that cannot be read only the links are looked at.

    Raises
    ------
    OpenDriveError
        The first fault, if too many roads are at fault or the others would fall apart.
    """
    if not faults:
        return roads
    gone = {fault.road for fault in faults}
    kept = {road_id: road for road_id, road in roads.items() if road_id not in gone}
    first = faults[0].error
    if not kept:
        raise first
    if len(faults) > max(1.0, MOST_LEFT_OUT * len(elements)):
        problem = f"{first.problem}; {len(faults)} of {len(elements)} roads cannot be read"
        raise OpenDriveError(problem, element=first.element)
    joints = [*_links_of(elements), *_connections_of(junctions)]
    for parts in _falling_apart(kept, joints, gone):
        problem = f"{first.problem}; without this road others fall into {parts} parts"
        raise OpenDriveError(problem, element=first.element)
    for fault in faults:
        detail = f"{fault.error.problem}; the road is left out"
        notes.add(Rule.ROAD_LEFT_OUT, fault.error.element or f"road {fault.road}", detail)
    return kept


def _links_of(elements: Sequence[Element]) -> Iterator[tuple[str, str]]:
    for element in elements:
        for end in element.iterfind("link/*"):
            if end.get("elementType") == "road":
                yield element.get("id", ""), end.get("elementId", "")


def _connections_of(junctions: Mapping[JunctionId, Junction]) -> Iterator[tuple[str, str]]:
    for junction in junctions.values():
        for connection in junction.connections:
            yield connection.incoming_road, connection.connecting_road


def _falling_apart(
    kept: Mapping[RoadId, Road], joints: Sequence[tuple[str, str]], gone: set[str]
) -> Iterator[int]:
    """Into how many parts each group of roads falls that hang together in the file."""
    from scipy.cluster.hierarchy import DisjointSet

    whole: DisjointSet[str] = DisjointSet([*kept, *gone])
    rest: DisjointSet[str] = DisjointSet(kept)
    for one, other in joints:
        if one in whole and other in whole:
            whole.merge(one, other)
        if RoadId(one) in kept and RoadId(other) in kept:
            rest.merge(one, other)
    parts: dict[str, set[str]] = {}
    for road in kept:
        parts.setdefault(whole[road], set()).add(rest[road])
    yield from (len(found) for found in parts.values() if len(found) > 1)
