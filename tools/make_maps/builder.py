"""Puts roads and junctions of one map together."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from scenariogeneration import xodr

from tools.make_maps.parts import (
    End,
    LaneSpec,
    Pose,
    Profile,
    RoadRecord,
    carriageway,
    curve,
    driving,
    inner_border,
    lane_section,
    plan,
)

CROSSWALK = (1.0, 4.0)
"""Metres before the end of the road: where a crosswalk begins and ends."""
STOP_LINE = 5.0
"""Metres before the end of the road."""


class Builder:
    """Collects roads, junctions and controllers; ids count up, the same each time."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.roads: list[RoadRecord] = []
        self.junctions: list[xodr.Junction] = []
        self.controllers: list[tuple[int, str, list[str]]] = []
        self.priorities: dict[int, list[tuple[int, int]]] = {}
        self.junction_controllers: dict[int, list[int]] = {}
        self._next = {"road": 0, "junction": 1000, "object": 0, "signal": 0, "controller": 0}

    def _id(self, kind: str) -> int:
        self._next[kind] += 1
        return self._next[kind]

    def road(
        self,
        start: Pose,
        geometries: Sequence[object],
        profile: Profile,
        *,
        speed: float = 50.0,
        kind: str = "town",
        sections: Sequence[tuple[float, Profile]] = (),
        junction: int = -1,
        links: dict[int, dict[str, int]] | None = None,
    ) -> RoadRecord:
        """Add a road; ``speed`` in km/h; further lane ``sections`` as (s, profile)."""
        view, end, length = plan(start, geometries)
        profiles = [(0.0, profile), *sections]
        lanes = xodr.Lanes()
        for index, (s, part) in enumerate(profiles):
            stop = profiles[index + 1][0] if index + 1 < len(profiles) else length
            found = links or _section_links([p for _, p in profiles], index)
            lanes.add_lanesection(lane_section(s, stop - s, part, found))
        road = xodr.Road(self._id("road"), view, lanes, road_type=junction, name="")
        road.add_type(getattr(xodr.RoadType, kind), 0, speed=speed, speed_unit="km/h")
        record = RoadRecord(road.id, road, profile, profiles[-1][1], start, end, length)
        self.roads.append(record)
        return record

    def link(self, first: End, second: End) -> None:
        """Join two road ends without a junction; lanes are tied by position."""
        for one, other in ((first, second), (second, first)):
            add = one.record.road.add_successor
            add = add if one.contact == "end" else one.record.road.add_predecessor
            add(xodr.ElementType.road, other.record.id, other.contact_point)
            section = one.record.road.lanes.lanesections[-1 if one.contact == "end" else 0]
            same = one.contact != other.contact
            which = "successor" if one.contact == "end" else "predecessor"
            for lane in (*section.leftlanes, *section.rightlanes):
                lane.add_link(which, lane.lane_id if same else -lane.lane_id)

    def new_junction(self, ends: Sequence[End], name: str = "") -> xodr.Junction:
        """Add a junction that all ``ends`` lead to."""
        junction = xodr.Junction(name, self._id("junction"))
        self.junctions.append(junction)
        for end in ends:
            add = end.record.road.add_successor
            add = add if end.contact == "end" else end.record.road.add_predecessor
            add(xodr.ElementType.junction, junction.id)
        return junction

    def connect(
        self,
        junction: xodr.Junction,
        start: End,
        end: End,
        pairs: Sequence[tuple[int, int]],
        *,
        speed: float = 30.0,
        kind: str = "town",
    ) -> RoadRecord:
        """Add a connecting road for lanes side by side: ``pairs`` of positions, inner first."""
        coming, going = start.lanes(arriving=True), end.lanes(arriving=False)
        begin = start.approach.left(-inner_border(coming, pairs[0][0]))
        finish = end.departure.left(-inner_border(going, pairs[0][1]))
        geometries, _ = curve(begin, finish)
        lanes = tuple(
            LaneSpec(
                coming[i].kind,
                coming[i].width,
                "broken" if coming[i].kind == "driving" and place + 1 < len(pairs) else "none",
                "both" if coming[i].kind == "driving" and place + 1 < len(pairs) else "none",
                width_end=going[j].width,
            )
            for place, (i, j) in enumerate(pairs)
        )
        lanes = tuple(
            replace(lane, mark="none", change="none")
            if place + 1 < len(lanes) and lanes[place + 1].kind != "driving"
            else lane
            for place, lane in enumerate(lanes)
        )
        from_side, to_side = start.side(arriving=True), end.side(arriving=False)
        links = {
            -(place + 1): {"predecessor": from_side * (i + 1), "successor": to_side * (j + 1)}
            for place, (i, j) in enumerate(pairs)
        }
        record = self.road(
            begin,
            geometries,
            Profile(lanes),
            speed=speed,
            kind=kind,
            junction=junction.id,
            links=links,
        )
        record.road.add_predecessor(xodr.ElementType.road, start.record.id, start.contact_point)
        record.road.add_successor(xodr.ElementType.road, end.record.id, end.contact_point)
        connection = xodr.Connection(
            start.record.id, record.id, xodr.ContactPoint.start, len(junction.connections)
        )
        for place, (i, _) in enumerate(pairs):
            connection.add_lanelink(from_side * (i + 1), -(place + 1))
        junction.add_connection(connection)
        return record

    def crossing(
        self,
        ends: Sequence[End],
        *,
        control: str = "none",
        major: Sequence[int] = (),
        crosswalks: bool = True,
        speed: float = 30.0,
    ) -> xodr.Junction:
        """Add a junction with every movement, and its furniture.

        Parameters
        ----------
        ends
            The road ends that meet.
        control
            ``lights``, ``stop``, ``yield`` or ``none`` (right before left).
        major
            Positions of the ends that have priority where signs rule.
        crosswalks
            Whether each arm with sidewalks gets one.
        """
        junction = self.new_junction(ends)
        approaches: dict[int, list[RoadRecord]] = {i: [] for i in range(len(ends))}
        for number, start in enumerate(ends):
            for end, pairs in movements(start, [e for e in ends if e is not start]):
                made = self.connect(junction, start, end, pairs, speed=speed)
                approaches[number].append(made)
        for end in ends:
            if crosswalks and end.lanes(arriving=True) and end.lanes(arriving=False):
                self.crosswalk(end)
            if control != "none" or crosswalks:
                self.stop_line(end, back=STOP_LINE if crosswalks else 1.0)
        if control == "lights":
            self._lights(junction, ends, approaches, crosswalks=crosswalks)
        elif control != "none":
            self._signs(junction, ends, control, major)
        return junction

    def crosswalk(self, end: End) -> None:
        """Paint a crosswalk across the carriageway, reaching 0.3 m onto both sidewalks."""
        near, far = CROSSWALK
        middle, width = end.at((near + far) / 2), far - near
        right = end.record.last if end.contact == "end" else end.record.first
        t0, t1 = -carriageway(right.right) - 0.3, carriageway(right.left) + 0.3
        crosswalk = xodr.Object(
            middle,
            (t0 + t1) / 2,
            xodr.ObjectType.crosswalk,
            id=str(self._id("object")),
            name="Crosswalk",
            length=width,
            width=t1 - t0,
            height=0.0,
        )
        outline = xodr.Outline(closed=True)
        v = (t1 - t0) / 2
        # CARLA expects the first corner once more at the end.
        for corner in ((-1.5, -v), (1.5, -v), (1.5, v), (-1.5, v), (-1.5, -v)):
            outline.add_corner(xodr.CornerLocal(*corner, 0.0, 0.0))
        crosswalk.add_outline(outline)
        end.record.road.add_object(crosswalk)

    def stop_line(self, end: End, *, back: float) -> None:
        """Paint a stop line across the lanes that arrive."""
        lanes = end.lanes(arriving=True)
        if not driving(lanes):
            return
        width, side = carriageway(lanes), end.side(arriving=True)
        line = xodr.Object(
            end.at(back),
            side * width / 2,
            xodr.ObjectType.none,
            id=str(self._id("object")),
            name="StopLine",
            orientation=_orientation(end),
            length=0.4,
            width=width,
            height=0.0,
        )
        end.record.road.add_object(line)

    def signal(
        self, end: End, kind: str, *, back: float = STOP_LINE, dynamic: bool = False, name: str = ""
    ) -> str:
        """Put up a sign or light beside the lanes that arrive; returns its id."""
        lanes, side = end.lanes(arriving=True), end.side(arriving=True)
        number = str(self._id("signal"))
        made = xodr.Signal(
            end.at(back),
            side * (carriageway(lanes) + 0.6),
            "OpenDRIVE",
            kind,
            "-1",
            id=number,
            name=name,
            dynamic=xodr.Dynamic.yes if dynamic else xodr.Dynamic.no,
            zOffset=3.0 if dynamic else 2.0,
            orientation=_orientation(end),
            height=1.0,
            width=0.6,
        )
        ids = sorted(side * (i + 1) for i in driving(lanes))
        made.add_validity(ids[0], ids[-1])
        end.record.road.add_signal(made)
        return number

    def _lights(
        self,
        junction: xodr.Junction,
        ends: Sequence[End],
        approaches: dict[int, list[RoadRecord]],
        *,
        crosswalks: bool,
    ) -> None:
        # Arms whose axes differ by less than 45 degrees get green together.
        axis = [
            math.remainder(2.0 * (e.approach.h - ends[0].approach.h), 2.0 * math.pi) for e in ends
        ]
        groups: dict[bool, list[str]] = {True: [], False: []}
        for number, end in enumerate(ends):
            along = abs(axis[number]) < math.pi / 2
            light = self.signal(end, "1000001", dynamic=True, name="Light")
            groups[along].append(light)
            for record in approaches[number]:
                reference = xodr.SignalReference(0.0, 0.0, light)
                reference.add_validity(-1, -1)
                record.road.add_signal(reference)
                reference.id = light  # the library insists on a new id when it is added
            if crosswalks:
                # Who crosses an arm walks while that arm's traffic waits.
                groups[not along].append(
                    self.signal(end, "1000002", back=CROSSWALK[1], dynamic=True, name="WalkLight")
                )
        numbers = []
        for sequence, along in enumerate((True, False)):
            if groups[along]:
                number = self._id("controller")
                name = f"junction {junction.id} group {sequence}"
                self.controllers.append((number, name, groups[along]))
                numbers.append(number)
        self.junction_controllers[junction.id] = numbers

    def _signs(
        self, junction: xodr.Junction, ends: Sequence[End], control: str, major: Sequence[int]
    ) -> None:
        kind, name = {"stop": ("206", "Stop"), "yield": ("205", "Yield")}[control]
        pairs = []
        for number, end in enumerate(ends):
            if number in major or not driving(end.lanes(arriving=True)):
                continue
            self.signal(end, kind, name=name)
            pairs += [(ends[high].record.id, end.record.id) for high in major]
        self.priorities[junction.id] = pairs


def movements(start: End, exits: Sequence[End]) -> list[tuple[End, list[tuple[int, int]]]]:
    """All movements from ``start``: exit and lane pairs; the rightmost takes the curb's lanes."""
    coming = start.lanes(arriving=True)
    lanes = driving(coming)
    exits = [end for end in exits if driving(end.lanes(arriving=False))]
    if not lanes or not exits:
        return []
    turns = [math.remainder(end.departure.h - start.approach.h, 2.0 * math.pi) for end in exits]
    found: list[tuple[End, list[tuple[int, int]]]] = []
    used: set[int] = set()
    for end, turn in sorted(zip(exits, turns, strict=True), key=lambda item: item[1]):
        going = end.lanes(arriving=False)
        for pair in _lane_pairs(lanes, driving(going), turn, turns):
            used.add(pair[0])
            pairs = [pair]
            if turn == min(turns) and pair[0] == lanes[-1]:
                pairs += _curb_pairs(coming, going, pair)
            found.append((end, pairs))
        if abs(turn) < math.pi / 4:
            found += _bike_movement(coming, going, end, carried=turn == min(turns))
    missing = [lane for lane in lanes if lane not in used]
    if missing:
        msg = f"lanes {missing} of road {start.record.id} lead nowhere"
        raise ValueError(msg)
    return found


def _lane_pairs(
    coming: Sequence[int], going: Sequence[int], turn: float, turns: Sequence[float]
) -> list[tuple[int, int]]:
    left, right = turn > math.pi / 4, turn < -math.pi / 4
    if len(coming) == 1:
        return [(coming[0], going[0] if left else going[-1])]
    if left:
        return [(coming[0], going[0])]
    if right:
        return [(coming[-1], going[-1])]
    # Straight on: with as many lanes there, all of them; else the inner ones only turn left, if
    # there is a left turn at all.
    count = min(len(coming), len(going))
    if not any(other > math.pi / 4 for other in turns) and len(going) < len(coming):
        return [(coming[-1], going[-1])]
    return list(zip(coming[-count:], going[-count:], strict=True))


def _curb_pairs(
    coming: Sequence[LaneSpec], going: Sequence[LaneSpec], pair: tuple[int, int]
) -> list[tuple[int, int]]:
    pairs = []
    for step in range(1, len(coming) - pair[0]):
        i, j = pair[0] + step, pair[1] + step
        if j >= len(going) or coming[i].kind != going[j].kind:
            break
        pairs.append((i, j))
    return pairs


def _bike_movement(
    coming: Sequence[LaneSpec], going: Sequence[LaneSpec], end: End, *, carried: bool
) -> list[tuple[End, list[tuple[int, int]]]]:
    ins = [i for i, lane in enumerate(coming) if lane.kind == "biking"]
    outs = [j for j, lane in enumerate(going) if lane.kind == "biking"]
    return [] if carried or not ins or not outs else [(end, [(ins[0], outs[0])])]


def _orientation(end: End) -> xodr.Orientation:
    positive = end.contact == "end"
    return xodr.Orientation.positive if positive else xodr.Orientation.negative


def _section_links(profiles: Sequence[Profile], index: int) -> dict[int, dict[str, int]]:
    """Links between the lane sections of one road, by the lanes' keys."""
    links: dict[int, dict[str, int]] = {}
    for which, other in (("predecessor", index - 1), ("successor", index + 1)):
        if not 0 <= other < len(profiles):
            continue
        for sign in (1, -1):
            keys = [lane.key for lane in profiles[other].lanes(sign)]
            for place, lane in enumerate(profiles[index].lanes(sign)):
                if lane.key in keys:
                    links.setdefault(sign * (place + 1), {})[which] = sign * (
                        keys.index(lane.key) + 1
                    )
    return links
