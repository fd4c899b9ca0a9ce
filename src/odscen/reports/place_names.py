"""Names of places for people: streets, points of the compass and turns in place of ids."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.markup import number

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.base.arrays import FloatArray
    from odscen.lanegraph.graphs import MapGraph

COMPASS = (
    "east", "north-east", "north", "north-west", "west", "south-west", "south", "south-east",
)  # fmt: skip
"""Directions in steps of 45 degrees, counter-clockwise from the x axis of OpenDRIVE."""

_REACH = 30.0
"""Metres of a segment, from its end at a junction on, that say on which side of it it lies."""
_STRAIGHT = math.radians(40.0)
_BACK = math.radians(150.0)
_AT = 25.0
"""Metres from the middle of a junction within which a spot is said to be at it."""


def compass_point(direction: float) -> str:
    """Name of a direction.

    Parameters
    ----------
    direction
        Radians counter-clockwise from the x axis, which points east.
    """
    return COMPASS[round(direction / (math.pi / 4.0)) % 8]


class JunctionName(NamedTuple):
    """What the name of a junction is made of.

    Attributes
    ----------
    streets
        At most two that meet; none if the map names none.
    which
        Point of the compass, or the id, where several junctions would have one name; else empty.
    """

    streets: tuple[str, ...]
    which: str = ""

    def to_words(self, junction: str) -> str:
        """``"East Street 5 / North Street 3 (north)"``, or ``"Junction 10"``."""
        name = " / ".join(self.streets) or _name_of_id(junction)
        return f"{name} ({self.which})" if self.which else name


class RoadName(NamedTuple):
    """What the name of a road segment is made of.

    Attributes
    ----------
    street
        Empty if the map names none.
    ends
        Junctions at its ends, with the street that crosses there; that is empty where the junction
        is to be named itself.
    side
        Point of the compass in which it lies from the junction, if it has one only.
    """

    street: str
    ends: tuple[tuple[str, str], ...]
    side: str

    def to_words(self, segment: str, junctions: Mapping[str, str]) -> str:
        """``"North Street 3 between East Street 2 and East Street 3"``."""
        road = self.street or f"Road {segment.removeprefix('r')}"
        crossed = sorted({street or junctions.get(end, end) for end, street in self.ends})
        if len(crossed) == 2:
            return f"{road} between {crossed[0]} and {crossed[1]}"
        if len(crossed) == 1:
            side = self.side
            return f"{road}, {side} of {crossed[0]}" if side else f"{road} at {crossed[0]}"
        return road


@dataclass(frozen=True, slots=True, eq=False)
class PlaceNames:
    """Names of segments, junctions, turning movements and spots of a map; ids where it has none.

    Attributes
    ----------
    junctions
        Name of each junction by its segment id, unique on the map.
    segments
        Name of each road segment.
    legs
        For each junction the direction, rad counter-clockwise from east, in which each of its
        road segments lies.
    middles
        Middle of each junction, shape ``(2,)``, metres, OpenDRIVE frame.
    junction_names, road_names
        What the names are made of, for those who say them in another language.
    """

    junctions: Mapping[str, str] = field(default_factory=dict)
    segments: Mapping[str, str] = field(default_factory=dict)
    legs: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    middles: Mapping[str, FloatArray] = field(default_factory=dict)
    junction_names: Mapping[str, JunctionName] = field(default_factory=dict)
    road_names: Mapping[str, RoadName] = field(default_factory=dict)

    def name_junction(self, junction: str) -> str:
        """``"East Street 5 / North Street 3"``, or ``"Junction 10"``."""
        return self.junctions.get(junction) or _name_of_id(junction)

    def name_segment(self, segment: str) -> str:
        """``"North Street 3 between East Street 2 and East Street 3"``."""
        return self.segments.get(segment) or segment

    def name_place(self, place: str) -> str:
        """Name of a segment or a junction."""
        return self.junctions.get(place) or self.name_segment(place)

    def name_movement(self, movement: str, *, junction: str | None = None) -> str:
        """Approach and turn of a movement ``r1>j10>r2``: ``"from the west, left turn"``.

        Parameters
        ----------
        junction
            Begin with the name of the junction unless it is this one.
        """
        parts = movement.split(">")
        middle = parts[1] if len(parts) > 2 else ""
        legs = self.legs.get(middle, {})
        if parts[0] not in legs or parts[-1] not in legs:
            return movement.replace(">", " > ")
        words = f"from the {self._name_side(middle, parts[0])}, {_name_turn(legs, parts)}"
        return words if middle == junction else f"{self.name_junction(middle)}, {words}"

    def name_approaches(self, junction: str, movements: str) -> str:
        """Movements of a signal group: ``"from the west, from the east left"``.

        Parameters
        ----------
        junction
            Segment id of the junction.
        movements
            As signal groups have them, joined by commas: ``r1``, ``r1 left``, ``walk r1``.
        """
        legs = self.legs.get(junction, {})
        words = []
        for movement in movements.split(", "):
            parts = movement.split(" ")
            walk = parts[0] == "walk"
            segment, *turn = parts[1:] if walk else parts
            if segment not in legs:
                words.append(movement)
                continue
            side = self._name_side(junction, segment)
            words.append(
                f"crossing in the {side}" if walk else " ".join([f"from the {side}", *turn])
            )
        return ", ".join(words)

    def name_lane_group(self, lane_group: str) -> str:
        """Movements of a lane group, joined by ``+``, in words."""
        movements = lane_group.split(" + ")
        parts = [movement.split(">") for movement in movements]
        middle = parts[0][1] if len(parts[0]) > 2 else ""
        legs = self.legs.get(middle, {})
        ends = [end for part in parts for end in (part[0], part[-1])]
        if len({part[0] for part in parts}) > 1 or any(end not in legs for end in ends):
            return lane_group.replace(">", " > ")
        turns = list(dict.fromkeys(_name_turn(legs, part) for part in parts))
        side = self._name_side(middle, parts[0][0])
        return f"{self.name_junction(middle)}, from the {side}, {_join_words(turns)}"

    def describe_spot(self, x: float, y: float) -> str:
        """``"120 m west of East Street 5 / North Street 3"``; coordinates without junctions.

        Parameters
        ----------
        x, y
            Metres, OpenDRIVE frame.
        """
        if not self.middles:
            return f"x {number(x, 0)} m, y {number(y, 0)} m"
        offsets = {
            name: (x - float(middle[0]), y - float(middle[1]))
            for name, middle in self.middles.items()
        }
        nearest = min(offsets, key=lambda name: (math.hypot(*offsets[name]), name))
        east, north = offsets[nearest]
        distance = math.hypot(east, north)
        name = self.name_junction(nearest)
        if distance < _AT:
            return name
        side = compass_point(math.atan2(north, east))
        return f"{number(round(distance, -1), 0)} m {side} of {name}"

    def _name_side(self, junction: str, segment: str) -> str:
        """Point of the compass; with the segment where another one lies on the same side."""
        legs = self.legs[junction]
        side = compass_point(legs[segment])
        others = [compass_point(way) for other, way in legs.items() if other != segment]
        return f"{side} ({self.name_segment(segment)})" if side in others else side


NO_NAMES = PlaceNames()
"""Of a map that is not there: ids."""


def _name_of_id(junction: str) -> str:
    return f"Junction {junction.removeprefix('j')}"


def _join_words(words: Sequence[str]) -> str:
    return " and ".join(filter(None, [", ".join(words[:-1]), words[-1]]))


def _name_turn(legs: Mapping[str, float], movement: Sequence[str]) -> str:
    """``legs`` point away from the junction; one drives in against the first of them."""
    if movement[0] == movement[-1]:
        return "U-turn"
    turned = legs[movement[-1]] - legs[movement[0]] - math.pi
    turned = (turned + math.pi) % (2.0 * math.pi) - math.pi
    if abs(turned) <= _STRAIGHT:
        return "straight on"
    if abs(turned) > _BACK:
        return "U-turn"
    return "left turn" if turned > 0 else "right turn"


def place_names(graph: MapGraph, road_names: Mapping[str, str]) -> PlaceNames:
    """Name the places of a map.

    Parameters
    ----------
    road_names
        By road id, from :func:`odscen.opendrive.road_names.road_names`.
    """
    lanes, segments = graph.lanes, graph.segments
    ids = [str(name) for name in segments.ids]
    is_junction = [kind == "junction" for kind in segments.kinds]
    streets = {
        name: _street_of(
            [road_names.get(str(part.road), "") for part in parts],
            [abs(part.s_to - part.s_from) for part in parts],
        )
        for name, parts, inside in zip(ids, segments.parts, is_junction, strict=True)
        if not inside
    }
    xy = np.column_stack([lanes.x, lanes.y])
    order = np.argsort(lanes.segment, kind="stable")
    starts = np.searchsorted(lanes.segment[order], np.arange(len(ids) + 1))
    points = [xy[order[starts[row] : starts[row + 1]]] for row in range(len(ids))]
    neighbours: dict[int, list[int]] = defaultdict(list)
    for one, other in segments.adjacency.tolist():
        neighbours[one].append(other)
        neighbours[other].append(one)
    middles = {
        ids[row]: points[row].mean(axis=0)
        for row in range(len(ids))
        if is_junction[row] and len(points[row])
    }
    legs = {
        ids[row]: {
            ids[other]: _direction_to(points[other], middles[ids[row]])
            for other in neighbours[row]
            if not is_junction[other] and len(points[other])
        }
        for row in range(len(ids))
        if ids[row] in middles
    }
    meeting = _name_junctions(legs, streets, middles)
    roads = {
        name: _name_road(
            name,
            [ids[other] for other in neighbours[row] if is_junction[other]],
            streets,
            legs,
        )
        for row, name in enumerate(ids)
        if not is_junction[row]
    }
    junctions = {name: parts.to_words(name) for name, parts in meeting.items()}
    named = {name: parts.to_words(name, junctions) for name, parts in roads.items()}
    return PlaceNames(junctions, named, legs, middles, meeting, roads)


def _street_of(names: Sequence[str], lengths: Sequence[float]) -> str:
    """Name of the most metres; empty if no part has one."""
    metres: dict[str, float] = defaultdict(float)
    for name, length in zip(names, lengths, strict=True):
        if name:
            metres[name] += length
    return min(metres, key=lambda name: (-metres[name], name)) if metres else ""


def _direction_to(points: FloatArray, middle: FloatArray) -> float:
    """Direction from the middle of a junction to the near part of a segment, rad from east."""
    distance = np.hypot(*(points - middle).T)
    near = points[distance <= distance.min() + _REACH].mean(axis=0) - middle
    return math.atan2(near[1], near[0])


def _name_junctions(
    legs: Mapping[str, Mapping[str, float]],
    streets: Mapping[str, str],
    middles: Mapping[str, FloatArray],
) -> dict[str, JunctionName]:
    """Two streets that meet; with a side where several junctions would have one name."""
    names = {}
    for junction, around in legs.items():
        count = Counter(streets[leg] for leg in around if streets.get(leg))
        met = sorted(sorted(count), key=lambda street: -count[street])[:2]
        names[junction] = JunctionName(tuple(sorted(met)))
    alike: dict[tuple[str, ...], list[str]] = defaultdict(list)
    for junction, name in names.items():
        if name.streets:
            alike[name.streets].append(junction)
    for together, group in alike.items():
        if len(group) > 1:
            for junction, which in _tell_apart(group, middles).items():
                names[junction] = JunctionName(together, which)
    return names


def _tell_apart(group: Sequence[str], middles: Mapping[str, FloatArray]) -> dict[str, str]:
    """Side of each junction among those of one name; the ids where two are on the same side."""
    centre = np.mean([middles[junction] for junction in group], axis=0)
    sides = {}
    for junction in group:
        east, north = (middles[junction] - centre).tolist()
        sides[junction] = compass_point(math.atan2(north, east))
    if len(set(sides.values())) == len(group):
        return sides
    return {junction: junction.removeprefix("j") for junction in group}


def _name_road(
    segment: str,
    ends: Sequence[str],
    streets: Mapping[str, str],
    legs: Mapping[str, Mapping[str, float]],
) -> RoadName:
    """Street, and the streets or junctions at its ends."""
    own = streets.get(segment, "")
    crossed = []
    for end in ends:
        others = {streets[leg] for leg in legs.get(end, {}) if streets.get(leg)} - {own}
        # Of a street between two squares both ends would have its own name.
        crossed.append((end, min(others) if own and len(others) == 1 else ""))
    around = legs.get(ends[0], {}) if ends else {}
    side = compass_point(around[segment]) if segment in around else ""
    return RoadName(own, tuple(crossed), side)
