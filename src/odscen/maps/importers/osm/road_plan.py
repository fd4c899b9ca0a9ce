"""A street as a road: its lane sections, with tapers where the number of lanes changes."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

from odscen.maps.importers.osm.street_line import Arc, Cubic, Pose, StreetLine
from odscen.maps.importers.osm.street_tags import CLASSES, NO_LIMIT, StreetLane
from odscen.opendrive import road_model as model

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.base.ids import RoadId
    from odscen.maps.importers.osm.street_network import Street, StreetNetwork

TAPERS = {"driving": 25.0, "bus": 25.0, "biking": 8.0, "parking": 3.0}
"""Metres over which a lane opens or closes, by kind; others have :data:`BESIDE_TAPER`."""
BESIDE_TAPER = 5.0
BAY = 30.0
"""Metres that lanes for turning have at least before a junction, where there is room."""
NO_PARKING = 8.0
"""Metres before a junction without parking (5 m by StVO section 12, 6 m in the US)."""
_THIN = 0.3

_LEFT_ONLY = {"left", "sharp_left", "slight_left", "reverse"}
_RIGHT_ONLY = {"right", "sharp_right", "slight_right"}


class KeyedLane(NamedTuple):
    """A lane of a section; ``key`` is the same in all sections that it runs through."""

    key: int
    lane: StreetLane


@dataclass(slots=True)
class PlannedSection:
    """A stretch of a road with the same lanes.

    They are those of a :class:`~odscen.maps.importers.osm.street_tags.CrossSection`.
    """

    s: float
    s_end: float
    way: int
    right: list[KeyedLane]
    left: list[KeyedLane]
    offset: float
    speed_right: float
    speed_left: float


@dataclass(eq=False, slots=True)
class RoadPlan:
    """A road of a street.

    Attributes
    ----------
    line
        What junctions leave of the street's line.
    before
        Metres of the street before it: ``s`` of the road is ``s`` of the street less this.
    """

    id: int
    street: int
    name: str
    line: StreetLine
    before: float
    sections: list[PlannedSection]
    start_junction: int | None = None
    end_junction: int | None = None
    objects: list[model.RoadObject] = field(default_factory=list)
    signals: list[model.Signal] = field(default_factory=list)

    def section_at(self, s: float) -> PlannedSection:
        """The section at ``s``."""
        return next((section for section in self.sections if s < section.s_end), self.sections[-1])

    def lanes(self, *, at_end: bool, arriving: bool) -> list[StreetLane]:
        """Lanes that arrive at an end, or leave it, from the divider outwards."""
        section = self.sections[-1 if at_end else 0]
        return [keyed.lane for keyed in (section.right if at_end == arriving else section.left)]

    def divider(self, *, at_end: bool) -> Pose:
        """The pose of the divider at an end, as who arrives there looks."""
        section = self.sections[-1 if at_end else 0]
        pose = self.line.pose(self.line.length if at_end else 0.0).left(section.offset)
        return pose if at_end else pose.back()


def plan_sections(
    network: StreetNetwork, street: Street, start: float, end: float, *, ends_at: Sequence[bool]
) -> list[PlannedSection]:
    """Lane sections of the part of a street that is a road; s counts from its start.

    Parameters
    ----------
    ends_at
        Whether start and end of the road are at junctions.
    """
    length = end - start
    plans: list[PlannedSection] = []
    for stretch in street.stretches:
        section = network.section(stretch)
        s0, s1 = street.s[stretch.first] - start, street.s[stretch.last] - start
        plans.append(
            PlannedSection(
                s0,
                s1,
                stretch.way,
                [KeyedLane(-1, lane) for lane in section.right],
                [KeyedLane(-1, lane) for lane in section.left],
                section.offset,
                section.speed_right,
                section.speed_left,
            )
        )
    # Lanes for turning are as long as drivers need, even where the way that has them is short.
    most = 0.5 * length
    if len(plans) > 1:
        for place, side, limit in ((-1, "right", 1), (0, "left", -1)):
            plan, other = plans[place], plans[place - limit]
            if not ends_at[1 if place else 0] or _count_car_lanes(plan, side) <= _count_car_lanes(
                other, side
            ):
                continue
            want = min(BAY, most)
            if limit > 0 and length - plan.s < want:
                for earlier in plans[:-1]:
                    earlier.s_end = min(earlier.s_end, length - want)
                    earlier.s = min(earlier.s, earlier.s_end)
                plan.s = length - want
            elif limit < 0 and plan.s_end < want:
                for later in plans[1:]:
                    later.s = max(later.s, want)
                    later.s_end = max(later.s_end, later.s)
                plan.s_end = want
    kept = []
    for plan in plans:
        s0, s1 = max(plan.s, 0.0), min(plan.s_end, length)
        if s1 - s0 > _THIN:
            plan.s, plan.s_end = s0, s1
            kept.append(plan)
    if not kept:
        middle = max(plans, key=lambda plan: min(plan.s_end, length) - max(plan.s, 0.0))
        kept = [middle]
    kept = _end_parking(kept, length, ends_at)
    kept[0].s, kept[-1].s_end = 0.0, length
    for before, after in pairwise(kept):
        after.s = before.s_end
    joined = [kept[0]]
    for plan in kept[1:]:
        last = joined[-1]
        same = all(
            getattr(plan, name) == getattr(last, name)
            for name in ("right", "left", "offset", "speed_right", "speed_left")
        )
        if same:
            last.s_end = plan.s_end
        else:
            joined.append(plan)
    count = 0
    for i, plan in enumerate(joined):
        for side in ("right", "left"):
            lanes = [keyed.lane for keyed in getattr(plan, side)]
            before = getattr(joined[i - 1], side) if i else []
            pairs = _match_sections([k.lane for k in before], lanes, ahead=side == "right")
            keyed = []
            for place, lane in enumerate(lanes):
                if place in pairs:
                    keyed.append(KeyedLane(before[pairs[place]].key, lane))
                else:
                    keyed.append(KeyedLane(count, lane))
                    count += 1
            setattr(plan, side, keyed)
    return joined


def _count_car_lanes(plan: PlannedSection, side: str) -> int:
    return sum(keyed.lane.carries_cars for keyed in getattr(plan, side))


def _end_parking(
    plans: list[PlannedSection], length: float, ends_at: Sequence[bool]
) -> list[PlannedSection]:
    """Leave parking out near junctions."""

    def bare(plan: PlannedSection, s: float, s_end: float) -> PlannedSection:
        lanes = ([k for k in side if k.lane.kind != "parking"] for side in (plan.right, plan.left))
        right, left = lanes
        return replace(plan, s=s, s_end=s_end, right=right, left=left)

    result = []
    for plan in plans:
        if not any(k.lane.kind == "parking" for k in (*plan.right, *plan.left)):
            result.append(plan)
            continue
        low = NO_PARKING if ends_at[0] else 0.0
        high = length - NO_PARKING if ends_at[1] else length
        begin, end = max(plan.s, low), min(plan.s_end, high)
        if end - begin < 10.0:
            result.append(bare(plan, plan.s, plan.s_end))
            continue
        if begin - plan.s > _THIN:
            result.append(bare(plan, plan.s, begin))
        result.append(replace(plan, s=begin, s_end=end))
        if plan.s_end - end > _THIN:
            result.append(bare(plan, end, plan.s_end))
    return result


def _match_sections(
    before: Sequence[StreetLane], after: Sequence[StreetLane], *, ahead: bool
) -> dict[int, int]:
    """Which lane of the section before each lane of a section continues, as places outwards.

    Parameters
    ----------
    ahead
        Whether traffic runs from ``before`` to ``after``.
    """
    source, target = (before, after) if ahead else (after, before)
    cars = [[i for i, lane in enumerate(side) if lane.carries_cars] for side in (source, target)]
    more = len(cars[1]) - len(cars[0])
    wide, own, names = (
        (cars[1], target, (_LEFT_ONLY, _RIGHT_ONLY))
        if more >= 0
        else (cars[0], source, ({"merge_to_right"}, {"merge_to_left"}))
    )
    spare = abs(more)
    inner = 0
    while inner < spare and own[wide[inner]].turns and own[wide[inner]].turns <= names[0]:
        inner += 1
    # Lanes that open or close on the left, the others do on the right.
    used = wide[inner : len(wide) - (spare - inner)]
    pairs = (
        list(zip(cars[0], used, strict=True))
        if more >= 0
        else list(zip(used, cars[1], strict=True))
    )
    for kind in ("biking", "parking", "sidewalk", "shoulder", "border"):
        first, second = (
            [i for i, lane in enumerate(side) if lane.kind == kind] for side in (source, target)
        )
        pairs += list(zip(reversed(first), reversed(second), strict=False))
    pairs.sort()
    # Lanes do not cross each other.
    straight: list[tuple[int, int]] = []
    for pair in pairs:
        if not straight or pair[1] > straight[-1][1]:
            straight.append(pair)
    return {b: a for a, b in straight} if ahead else dict(straight)


# ------------------------------------------------------------------ to the road model


def ease(s: float, start: float, end: float, length: float) -> list[model.Cubic]:
    """From a value to another over a length, level at both ends, and constant behind."""
    change = end - start
    if abs(change) < 1e-9 or length < 1e-6:
        return [model.Cubic(s, end, 0.0, 0.0, 0.0)]
    return [
        model.Cubic(s, start, 0.0, 3 * change / length**2, -2 * change / length**3),
        model.Cubic(s + length, end, 0.0, 0.0, 0.0),
    ]


def write_geometry(parts: Sequence[Arc | Cubic]) -> tuple[model.Geometry, ...]:
    """Lines, arcs and cubics one after the other."""
    s, written = 0.0, []
    for part in parts:
        x, y, hdg = part.start
        place = (s, x, y, hdg, part.length)
        if isinstance(part, Cubic):
            power = [part.length**k for k in range(4)]
            params = tuple(c / power[k] for row in (part.u, part.v) for k, c in enumerate(row))
            written.append(model.Geometry(*place, model.GeometryKind.PARAM_POLY3, params))
        elif abs(part.curvature) < 1e-9:
            written.append(model.Geometry(*place, model.GeometryKind.LINE, ()))
        else:
            written.append(model.Geometry(*place, model.GeometryKind.ARC, (part.curvature,)))
        s += part.length
    return tuple(written)


def lane_type(lane: StreetLane) -> str:
    """The type in OpenDRIVE."""
    return lane.kind


def make_road(plan: RoadPlan, *, kind: str, elevation: tuple[model.Cubic, ...] = ()) -> model.Road:
    """The road of a plan, in right-hand traffic."""
    sections = plan.sections
    widths: dict[tuple[int, int], list[model.Cubic]] = {}
    offsets: list[model.Cubic] = []
    for i, section in enumerate(sections):
        keyed = {k.key: k.lane for k in (*section.right, *section.left)}
        length = section.s_end - section.s
        before = sections[i - 1] if i else None
        after = sections[i + 1] if i + 1 < len(sections) else None
        old = {} if before is None else {k.key: k.lane for k in (*before.right, *before.left)}
        new = {} if after is None else {k.key: k.lane for k in (*after.right, *after.left)}
        opens = before is not None and (
            keyed.keys() != old.keys()
            or any(keyed[k].width != old[k].width for k in keyed)
            or before.offset != section.offset
        )
        closes = after is not None and bool(keyed.keys() - new.keys())
        most = (0.45 if opens and closes else 0.9) * length
        for key, lane in keyed.items():
            taper = min(TAPERS.get(lane.kind, BESIDE_TAPER), most)
            start = lane.width
            if before is not None:
                start = old[key].width if key in old else 0.0
            records = ease(section.s, start, lane.width, taper)
            if after is not None and key not in new:
                records += ease(section.s_end - taper, lane.width, 0.0, taper)[:1]
            widths[i, key] = records
        # The divider moves with the lanes: before where lanes close, else behind.
        closing_before = before is not None and bool(old.keys() - keyed.keys())
        opening_here = before is not None and bool(keyed.keys() - old.keys())
        start_offset = section.offset
        if before is not None and not (closing_before and not opening_here):
            start_offset = before.offset
        kinds = [keyed[k].kind for k in keyed.keys() - old.keys()]
        kinds += [keyed[k].kind for k in keyed.keys() - new.keys()]
        taper = min(max((TAPERS.get(k, 0.0) for k in kinds), default=BESIDE_TAPER), most)
        taper = max(taper, min(BESIDE_TAPER, most))
        offsets += ease(section.s, start_offset, section.offset, taper)
        if after is not None and closes and not (new.keys() - keyed.keys()):
            offsets += ease(section.s_end - taper, section.offset, after.offset, taper)[:1]
    made = []
    for i, section in enumerate(sections):
        ids = _lane_ids(section)
        lanes = [_centre_lane(section)]
        for side, sign in ((section.right, -1), (section.left, 1)):
            for place, (key, lane) in enumerate(side):
                outer = side[place + 1].lane if place + 1 < len(side) else None
                links = [
                    (_lane_ids(sections[j]).get(key),) if 0 <= j < len(sections) else ()
                    for j in (i - 1, i + 1)
                ]
                lanes.append(
                    model.Lane(
                        sign * (place + 1),
                        lane_type(lane),
                        widths=tuple(widths[i, key]),
                        heights=(model.LaneHeight(section.s, 0.12, 0.12),)
                        if lane.kind == "sidewalk"
                        else (),
                        road_marks=_border_marks(section.s, lane, outer, sign),
                        speeds=_lane_speeds(section, sign, lane),
                        access=lane_access(section.s, lane),
                        predecessors=tuple(link for link in links[0] if link is not None),
                        successors=tuple(link for link in links[1] if link is not None),
                    )
                )
        del ids
        lanes.sort(key=lambda lane: -lane.id)
        made.append(model.LaneSection(section.s, section.s_end, {lane.id: lane for lane in lanes}))
    types = tuple(
        model.RoadType(
            section.s,
            kind,
            _written_speed(
                max(section.speed_right, section.speed_left)
                if NO_LIMIT not in (section.speed_right, section.speed_left)
                else NO_LIMIT
            ),
        )
        for section in sections
    )
    types = tuple(
        road_type
        for i, road_type in enumerate(types)
        if i == 0 or road_type.speed != types[i - 1].speed
    )
    kept_offsets = [c for c in offsets if any(c[1:])] and offsets
    return model.Road(
        id=model_id(plan.id),
        name=plan.name,
        length=plan.line.length,
        junction=None,
        rule="RHT",
        predecessor=_junction_link(plan.start_junction),
        successor=_junction_link(plan.end_junction),
        types=types,
        geometry=write_geometry(plan.line.arcs),
        elevation=elevation,
        superelevation=(),
        lane_offset=tuple(_without_doubles(kept_offsets)),
        sections=tuple(made),
        objects=tuple(plan.objects),
        signals=tuple(plan.signals),
    )


def model_id(number: int) -> RoadId:
    """An id of the road model."""
    return str(number)  # type: ignore[return-value]


def _without_doubles(records: Sequence[model.Cubic]) -> list[model.Cubic]:
    """Of records at one place the last, and none that says what the one before does."""
    kept: list[model.Cubic] = []
    for record in records:
        if kept and abs(record.s - kept[-1].s) < 1e-6:
            kept.pop()
        if kept and not any(record[2:]) and not any(kept[-1][2:]) and record.a == kept[-1].a:
            continue
        kept.append(record)
    return kept


def _written_speed(speed: float) -> float:
    return math.inf if speed == NO_LIMIT else speed


def _junction_link(junction: int | None) -> model.RoadLink | None:
    return None if junction is None else model.RoadLink("junction", str(junction), None)


def _lane_ids(section: PlannedSection) -> dict[int, int]:
    ids = {k.key: -(place + 1) for place, k in enumerate(section.right)}
    return ids | {k.key: place + 1 for place, k in enumerate(section.left)}


def _centre_lane(section: PlannedSection) -> model.Lane:
    right = [k.lane for k in section.right if k.lane.carries_cars]
    left = [k.lane for k in section.left if k.lane.carries_cars]
    kind = "none"
    if right and left:
        kind = "broken" if len(right) == len(left) == 1 else "solid"
    elif right or left:
        kind = "solid"
    return model.Lane(0, "none", road_marks=(_make_mark(section.s, kind, "none"),))


def _make_mark(s: float, kind: str, change: model.LaneChange) -> model.RoadMark:
    return model.RoadMark(s, kind, "standard", "standard", 0.12 if kind != "none" else 0.0, change)


def _border_marks(
    s: float, lane: StreetLane, outer: StreetLane | None, sign: int
) -> tuple[model.RoadMark, ...]:
    """What is painted between a lane and the next one outwards, and who may cross it."""
    if lane.kind == "sidewalk":
        return ()
    if outer is None or outer.kind == "sidewalk":
        return (_make_mark(s, "solid" if lane.carries_cars else "none", "none"),)
    if not (lane.carries_cars and outer.carries_cars):
        # Bicycles come and go, cars stay where they are; a car never parks in the run of a lane.
        return (
            _make_mark(s, "broken" if "biking" in (lane.kind, outer.kind) else "solid", "none"),
        )
    outwards = lane.change in ("yes", "only_right")
    inwards = outer.change in ("yes", "only_left")
    if outwards and inwards:
        return (_make_mark(s, "broken", "both"),)
    if not outwards and not inwards:
        return (_make_mark(s, "solid", "none"),)
    # Ids grow to the left: outwards they fall right of the reference line.
    grows = inwards if sign < 0 else outwards
    return (_make_mark(s, "broken", "increase" if grows else "decrease"),)


def _lane_speeds(
    section: PlannedSection, sign: int, lane: StreetLane
) -> tuple[model.LaneSpeed, ...]:
    if section.speed_left == section.speed_right or not lane.carries_cars or not section.left:
        return ()
    speed = section.speed_right if sign < 0 else section.speed_left
    return (model.LaneSpeed(section.s, _written_speed(speed)),)


def lane_access(s: float, lane: StreetLane) -> tuple[model.LaneAccess, ...]:
    """Who may not use a lane."""
    return tuple(model.LaneAccess(s, "deny", name) for name in lane.denied)


def street_kind(network: StreetNetwork, street: Street) -> str:
    """Road type of OpenDRIVE."""
    return CLASSES[network.ways[street.stretches[0].way].tags["highway"]].kind
