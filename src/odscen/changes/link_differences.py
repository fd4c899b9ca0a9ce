"""What differs in how lanes lead on: turns, links of lanes, junctions, controllers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from odscen.base.shown import shown_id
from odscen.changes.map_change import ChangePlace, MapChange, of_lane, of_road
from odscen.changes.paired_lanes import SAME
from odscen.opendrive.lanes import is_forward
from odscen.opendrive.topology import lane_successors

if TYPE_CHECKING:
    from collections.abc import Container, Iterable, Iterator, Mapping, Sequence

    from odscen.base.ids import LaneKey, RoadId
    from odscen.changes.lane_differences import RoadPair
    from odscen.changes.map_change import ChangedThing, ChangeKind
    from odscen.opendrive.road_model import Controller, Junction, OpenDrive


class _LinkEnd(NamedTuple):
    """A lane where it meets another, named as in the map before: road, id, s of the meeting."""

    road: RoadId
    lane: int
    s: float


_Link = tuple[_LinkEnd, _LinkEnd]


@dataclass(frozen=True, slots=True)
class PairedRoads:
    """Roads that both maps have, by their ids in each."""

    by_before: Mapping[str, RoadPair]
    by_after: Mapping[str, RoadPair]


def lane_link_differences(
    before: OpenDrive, after: OpenDrive, roads: PairedRoads
) -> Iterator[MapChange]:
    """Links from lane to lane that only one map has, where both have both lanes.

    What a lane that came or went takes with it is not told: the lane is.
    """
    old = set(_links(before, roads.by_before, 0))
    new = set(_links(after, roads.by_after, 1))
    kinds: tuple[tuple[ChangeKind, set[_Link]], ...] = (
        ("removed", old - new),
        ("added", new - old),
    )
    for kind, links in kinds:
        for here, there in sorted(links):
            within = here.road == there.road
            what: ChangedThing = "lane link" if within else "connection"
            junction = None if within else _junction(roads, here.road, there.road)
            through = f" (junction {shown_id(junction)})" if junction else ""
            subject = f"from {of_lane(here.road, here.lane)} to {of_lane(there.road, there.lane)}"
            place = ChangePlace(here.road, here.s, here.s, here.lane)
            yield MapChange(kind, what, f"{what} {subject}{through}", place=place)


def _junction(roads: PairedRoads, *names: str) -> str | None:
    found = [roads.by_before[name].before.junction for name in names]
    return next((str(one) for one in found if one), None)


def _links(odr: OpenDrive, pairs: Mapping[str, RoadPair], side: int) -> Iterator[_Link]:
    """Links of a map between lanes that both maps have, named as before."""
    for key, followers in lane_successors(odr).items():
        for follower in followers:
            if key.road == follower.road and key.section != follower.section:
                link = _within(pairs, key, follower, side)
            else:
                link = _between(odr, pairs, (key, follower), side)
            if link is not None:
                yield link


def _within(
    pairs: Mapping[str, RoadPair], key: LaneKey, follower: LaneKey, side: int
) -> _Link | None:
    """Link over the border of two sections that both maps have there."""
    pair = pairs.get(key.road)
    if pair is None:
        return None
    later = max(key, follower, key=lambda one: one.section)
    at = [
        number
        for number, stretch in enumerate(pair.stretches)
        if stretch.sections[side] == later.section
    ]
    if not at or at[0] == 0:
        return None
    low, high = pair.stretches[at[0] - 1], pair.stretches[at[0]]
    if low.sections[1 - side] == high.sections[1 - side]:
        return None  # the other map has one section here: its lanes go on
    ends = []
    for one in (key, follower):
        number = at[0] if one.section == later.section else at[0] - 1
        ends.append(_named(pair, number, one.lane, side, high.s0))
    return (ends[0], ends[1]) if ends[0] and ends[1] else None


def _between(
    odr: OpenDrive, pairs: Mapping[str, RoadPair], link: tuple[LaneKey, LaneKey], side: int
) -> _Link | None:
    ends = []
    for key, leaves in zip(link, (True, False), strict=True):
        pair = pairs.get(key.road)
        if pair is None:
            return None
        road = odr.roads[key.road]
        lane = road.sections[key.section].lanes[key.lane]
        forward = is_forward(road, lane)
        number = len(pair.stretches) - 1 if forward == leaves else 0
        at = pair.before.length if forward == leaves else 0.0
        ends.append(_named(pair, number, key.lane, side, at))
    return (ends[0], ends[1]) if ends[0] and ends[1] else None


def _named(pair: RoadPair, number: int, lane: int, side: int, s: float) -> _LinkEnd | None:
    """Lane of one map by its name in the map before; none if only one map has it."""
    for both in pair.stretches[number].pairs:
        one = both[side]
        if one is not None and one.id == lane:
            return None if both[0] is None or both[1] is None else _end(pair, both[0].id, s)
    return None


def _end(pair: RoadPair, lane: int, s: float) -> _LinkEnd:
    at = pair.before.length if abs(s - pair.before.length) <= SAME else s
    return _LinkEnd(pair.before.id, lane, round(at, 3))


# ------------------------------------------------------------------------- junctions, controllers
def junction_differences(
    before: OpenDrive, after: OpenDrive, roads: PairedRoads
) -> Iterator[MapChange]:
    """Junctions that came, went or have other priorities, controllers, types or roads."""
    names = {str(pair.after.id): str(pair.before.id) for pair in roads.by_before.values()}
    old, new = before.junctions, after.junctions
    for one in _only(old, new):
        yield MapChange("removed", "junction", f"junction {shown_id(one)}")
    for one in _only(new, old):
        yield MapChange("added", "junction", f"junction {shown_id(one)}")
    for key, junction in old.items():
        if key in new:
            yield from _junction_values(junction, new[key], names)
    for pair in roads.by_before.values():
        old_one, new_one = (str(road.junction or "none") for road in (pair.before, pair.after))
        if old_one != new_one:
            subject = f"junction of {of_road(pair.before.id)}"
            place = ChangePlace(pair.before.id, 0.0, pair.before.length)
            yield MapChange("changed", "junction", subject, old_one, new_one, place)


def _only(these: Iterable[str], others: Container[str]) -> list[str]:
    return [str(key) for key in these if key not in others]


def _junction_values(old: Junction, new: Junction, names: Mapping[str, str]) -> Iterator[MapChange]:
    name = f"junction {shown_id(old.id)}"
    ways = {f"road {one.high} over road {one.low}" for one in old.priorities}
    others = {
        f"road {names.get(one.high, one.high)} over road {names.get(one.low, one.low)}"
        for one in new.priorities
    }
    for said in sorted(ways - others):
        yield MapChange("removed", "priority", f"priority of {said} at {name}")
    for said in sorted(others - ways):
        yield MapChange("added", "priority", f"priority of {said} at {name}")
    for what, before, after in (
        ("type", old.type, new.type),
        ("name", old.name, new.name),
        ("controllers", _list(old.controllers), _list(new.controllers)),
        ("main road", old.main_road, new.main_road),
    ):
        if before != after:
            said_both = before or "none", after or "none"
            yield MapChange("changed", "junction", f"{what} of {name}", *said_both)


def _list(items: Iterable[str]) -> str:
    return ", ".join(sorted(items))


def controller_differences(
    before: Mapping[str, Controller], after: Mapping[str, Controller]
) -> Iterator[MapChange]:
    """Controllers that came, went, or control other signals."""
    for key in _only(before, after):
        yield MapChange("removed", "controller", f"controller {shown_id(key)}")
    for key in _only(after, before):
        yield MapChange("added", "controller", f"controller {shown_id(key)}")
    for key, old in before.items():
        new = after.get(key)
        if new is None:
            continue
        said = _controlled(old.controls), _controlled(new.controls)
        if said[0] != said[1]:
            subject = f"signals of controller {shown_id(key)}"
            yield MapChange("changed", "controller", subject, *said)


def _controlled(controls: Sequence[tuple[str, str]]) -> str:
    return _list(signal for signal, _ in controls) or "none"
