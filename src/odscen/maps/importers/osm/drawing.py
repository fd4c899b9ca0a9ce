"""A network of streets as an OpenDRIVE map, and a report of what was kept, guessed and left out."""

from __future__ import annotations

import itertools
import math
from collections import defaultdict
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.convert.model.conversion_report import ElementOutcome, ReportEntry
from odscen.maps.importers.osm import furniture as street_furniture
from odscen.maps.importers.osm import junctions as places
from odscen.maps.importers.osm import scenery
from odscen.maps.importers.osm.junctions import Approach, Junction, Leg, Movement
from odscen.maps.importers.osm.road_plan import (
    RoadPlan,
    ease,
    lane_access,
    lane_type,
    make_road,
    model_id,
    plan_sections,
    street_kind,
    write_geometry,
)
from odscen.maps.importers.osm.street_line import (
    DRIVABLE,
    Cubic,
    Pose,
    curve_between,
    curves_between,
    least_radius,
)
from odscen.maps.importers.osm.street_tags import CLASSES, NO_LIMIT, StreetLane, rank_street
from odscen.opendrive import road_model as model

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.base.ids import RoadId
    from odscen.maps.importers.osm.furniture import Furniture, LegControl, StreetCrossing
    from odscen.maps.importers.osm.junctions import Layout
    from odscen.maps.importers.osm.osm_file import Extract
    from odscen.maps.importers.osm.street_network import Street, StreetNetwork

FIRST_JUNCTION = 1_000_000
"""Id of the first junction: CARLA confuses a junction with a road of the same id."""
CROSSWALK = 3.0
"""Metres of a crosswalk along its street (RASt 06: 3 to 4 m)."""
ISLAND_WIDTH = 1.2
"""Metres of an island in the middle of a street, where no lane gives it room: cars drive beside."""
ISLAND_LENGTH = 2.0
ISLAND_HEIGHT = 0.15
LESS_ROUND = 1.5
"""Metres by which a crossing before a junction may make the radius of its kerb smaller."""
KERB_GAP = 0.5
"""Metres between a junction and a crosswalk before it."""
STOP_GAP = 1.0
"""Metres between a stop line and the crosswalk behind it."""
REACH = 0.3
"""Metres that a crosswalk reaches onto the sidewalks."""
TURN_SPEED = 50 / 3.6
SHARPEST = 5.0
"""Metres of the radius of a lane up to which a turn is said to be too sharp for a bus."""
LOOP = 9.0
"""Metres of the handles of a turn at a dead end."""
DETOUR = 6.0
"""Metres between a path through a large junction and a curve that is then led along it."""


class DrawnMap(NamedTuple):
    """A map and the rows of its report."""

    map: model.OpenDrive
    entries: list[ReportEntry]


@dataclass(slots=True)
class _Drawn:
    """What has been drawn so far; ids count up."""

    roads: dict[RoadId, model.Road]
    junctions: list[model.Junction]
    controllers: dict[str, model.Controller]
    entries: list[ReportEntry]
    next_road: int = 1
    next_object: int = 1
    next_signal: int = 1
    next_controller: int = 1

    def new_road(self) -> int:
        self.next_road += 1
        return self.next_road - 1

    def new_object(self) -> str:
        self.next_object += 1
        return str(self.next_object - 1)

    def new_signal(self) -> str:
        self.next_signal += 1
        return str(self.next_signal - 1)

    def new_controller(self) -> str:
        self.next_controller += 1
        return str(self.next_controller - 1)

    def note(
        self,
        outcome: ElementOutcome,
        element: str,
        reason: str,
        confidence: float | None,
        source: str | None,
    ) -> None:
        self.entries.append(ReportEntry(outcome, element, reason, confidence, source))


def draw_map(extract: Extract, network: StreetNetwork, *, name: str) -> DrawnMap:
    """Lay out junctions, draw roads and connecting roads, and put up what controls traffic."""
    drawn = _Drawn({}, [], {}, [])
    crossings, crossing_rows = street_furniture.find_crossings(extract, network)
    ringed = {street.number for street in network.streets if places.is_ring(network, street)}
    layout = places.lay_out(
        network,
        lit=street_furniture.signal_nodes(extract, network),
        keep=lambda street: street.number in ringed,
    )
    inner = {number: junction for junction in layout.junctions for number in junction.inner}
    ranks = {
        leg: rank_street(network.ways[places.leg_way(network, leg)].tags)
        for junction in layout.junctions
        for leg in junction.legs
    }
    _make_room_for_crossings(network, layout, crossings)
    controls, midway, control_rows = street_furniture.find_controls(
        extract, network, layout, ranks, crossings
    )
    found = street_furniture.Furniture(crossings, controls, midway, [*crossing_rows, *control_rows])

    plans = _plan_roads(extract, network, layout, set(inner), drawn)
    _note_ways(extract, network, plans, inner, drawn)
    at_junctions = _place_crosswalks(network, plans, inner, found, drawn)
    applied: set[int] = set()
    for junction in layout.junctions:
        _draw_junction(network, junction, plans, found, at_junctions, ranks, applied, drawn)
    _light_crossings(plans, found, at_junctions, drawn)
    _draw_midway_signals(plans, found, drawn)
    heights = scenery.find_heights(network)
    _raise_connecting_roads(plans, heights, drawn)
    rows = scenery.draw_scenery(extract, network, plans, drawn.new_object)
    for seen in [*heights.rows, *rows]:
        outcome = ElementOutcome.GUESSED if seen.kept else ElementOutcome.LOST
        drawn.note(outcome, seen.element, seen.reason, seen.confidence, seen.source)
    for plan in plans.values():
        street = network.streets[plan.street]
        elevation = heights.elevation(plan)
        made = make_road(plan, kind=street_kind(network, street), elevation=elevation)
        drawn.roads[made.id] = made
    drawn.roads = dict(sorted(drawn.roads.items(), key=lambda item: int(item[0])))

    for row in found.rows:
        outcome = ElementOutcome.KEPT if row.kept else ElementOutcome.LOST
        drawn.note(outcome, row.source, row.reason, row.confidence, row.source)
    for turn in network.turns:
        source = f"relation {turn.relation}"
        if turn.relation in applied:
            drawn.note(
                ElementOutcome.KEPT, source, "restriction: holds for the turns there", 0.95, source
            )
        else:
            reason = "restriction: no turn that it could forbid is on the map"
            drawn.note(ElementOutcome.LOST, source, reason, 0.9, source)
    for relation, reason in network.unread:
        source = f"relation {relation}"
        drawn.note(ElementOutcome.LOST, source, f"restriction: {reason}", 0.9, source)

    xy = np.array([(g.x, g.y) for road in drawn.roads.values() for g in road.geometry] or [(0, 0)])
    (west, south), (east, north) = np.floor(xy.min(axis=0) - 20), np.ceil(xy.max(axis=0) + 20)
    header = model.Header(
        1, 7, name, float(north), float(south), float(east), float(west), network.georeference, None
    )
    drawn_map = model.OpenDrive(
        header,
        drawn.roads,
        {junction.id: junction for junction in drawn.junctions},
        drawn.controllers,
    )
    return DrawnMap(mirror_map(drawn_map) if network.mirrored else drawn_map, drawn.entries)


# ------------------------------------------------------------------ roads


def _make_room_for_crossings(
    network: StreetNetwork, layout: Layout, crossings: Sequence[StreetCrossing]
) -> None:
    """Let roads end between the junction and a crossing shortly before it, where there is room.

    Corners keep enough of their rounding for a bus, for which the crossing may have to move.
    """
    for crossing in crossings:
        length = network.streets[crossing.street].line.length
        for at_end in (False, True):
            leg = Leg(crossing.street, at_end)
            away = length - crossing.s if at_end else crossing.s
            if leg not in layout.cuts or away > length / 2:
                continue
            room = away - CROSSWALK / 2 - KERB_GAP
            least = max(layout.bare[leg], layout.cuts[leg] - LESS_ROUND)
            if layout.bare[leg] <= room < layout.cuts[leg]:
                layout.cuts[leg] = max(room, least)


def _plan_roads(
    extract: Extract, network: StreetNetwork, layout: Layout, inner: set[int], drawn: _Drawn
) -> dict[int, RoadPlan]:
    """Plan a road of each street that is not inside a junction."""
    junction_at = {node: junction for junction in layout.junctions for node in junction.nodes}
    plans = {}
    for street in network.streets:
        if street.number in inner:
            continue
        ends = [junction_at[street.nodes[0]], junction_at[street.nodes[-1]]]
        open_ends = [
            len(end.legs) == 1
            and (
                street_furniture.is_open_end(extract, network, node)
                or not _can_turn_round(network, street)
            )
            for end, node in zip(ends, (street.nodes[0], street.nodes[-1]), strict=True)
        ]
        start = layout.cuts[Leg(street.number, False)]
        end = street.line.length - layout.cuts[Leg(street.number, True)]
        crossed = [len(end.legs) > 2 for end in ends]
        tags = network.ways[street.stretches[0].way].tags
        line = street.line.cut(start, end)
        sections = plan_sections(network, street, start, start + line.length, ends_at=crossed)
        label = tags.get("name") or tags.get("ref") or ""
        plan = RoadPlan(drawn.new_road(), street.number, label, line, start, sections)
        if not open_ends[0]:
            plan.start_junction = FIRST_JUNCTION + ends[0].number
        if not open_ends[1]:
            plan.end_junction = FIRST_JUNCTION + ends[1].number
        plans[street.number] = plan
    return plans


def _can_turn_round(network: StreetNetwork, street: Street) -> bool:
    section = network.section(street.stretches[0])
    return all(any(lane.carries_cars for lane in side) for side in (section.right, section.left))


def _note_ways(
    extract: Extract,
    network: StreetNetwork,
    plans: dict[int, RoadPlan],
    inner: dict[int, Junction],
    drawn: _Drawn,
) -> None:
    """Report of each way which road it became, what was guessed, and what its tags did."""
    roads: dict[int, list[str]] = defaultdict(list)
    for street in network.streets:
        where = (
            f"road {plans[street.number].id}"
            if street.number in plans
            else (f"junction {FIRST_JUNCTION + inner[street.number].number}")
        )
        for stretch in street.stretches:
            if where not in roads[stretch.way]:
                roads[stretch.way].append(where)
    for way, reading in network.readings.items():
        source = f"way {way}"
        where = ", ".join(roads[way][:4]) + (", ..." if len(roads[way]) > 4 else "")
        inside = all(place.startswith("junction") for place in roads[way])
        for key, value in sorted(reading.used.items()):
            if not _is_told(key):
                continue
            if inside:
                reason = f"{key}={value}: the OSM way is inside a junction"
                drawn.note(ElementOutcome.LOST, where, reason, 0.8, source)
            else:
                drawn.note(ElementOutcome.KEPT, where, f"{key}={value}", 0.95, source)
        for key, reason in sorted(reading.ignored.items()):
            drawn.note(
                ElementOutcome.LOST,
                where,
                f"{key}={network.ways[way].tags.get(key, '')}: {reason}",
                0.9,
                source,
            )
        if not inside:
            for guess in reading.guesses:
                drawn.note(ElementOutcome.GUESSED, where, guess.reason, guess.confidence, source)
        for key, value in sorted(network.ways[way].tags.items()):
            if _is_told(key) and key not in reading.used and key not in reading.ignored:
                reason = f"{key}={value}: it has no counterpart, or another tag says it"
                drawn.note(ElementOutcome.LOST, where, reason, 0.9, source)
    for skipped in network.skipped:
        source = f"way {skipped.way}"
        tags = extract.ways[skipped.way].tags
        drawn.note(ElementOutcome.LOST, source, skipped.reason, 0.9, source)
        for key, value in sorted(tags.items()):
            if _is_told(key):
                drawn.note(
                    ElementOutcome.LOST, source, f"{key}={value}: {skipped.reason}", 0.9, source
                )


_TOLD = (
    "turn:lanes",
    "change:lanes",
    "maxspeed",
    "lanes",
    "placement",
    "width:lanes",
    "bus:lanes",
    "psv:lanes",
    "bicycle:lanes",
    "access:lanes",
    "vehicle:lanes",
    "cycleway",
    "sidewalk",
    "parking",
    "oneway",
)
_UNTOLD = (
    "surface",
    "condition",
    "orientation",
    "maxspeed:type",
    "buffer",
    "fee",
    "width",
    "conditional",
    "smoothness",
    "wheelchair",
    "marking",
    "reason",
    "restriction",
    "maxstay",
    "oneway:bicycle",
    ":lane",
    "capacity",
    "markings",
)


def _is_told(key: str) -> bool:
    """Whether the report has a row for each use of a tag."""
    if not any(key == name or key.startswith(f"{name}:") for name in _TOLD):
        return False
    return key == "width:lanes" or not any(key.endswith(end) for end in _UNTOLD)


# ------------------------------------------------------------------ crosswalks


def _place_crosswalks(
    network: StreetNetwork,
    plans: dict[int, RoadPlan],
    inner: dict[int, Junction],
    found: Furniture,
    drawn: _Drawn,
) -> dict[Leg, tuple[float, StreetCrossing]]:
    """Paint the crosswalks.

    Returns
    -------
    dict
        Of each leg that has one shortly before the junction: how far its outer side is from the
        end of the road, and the crossing.
    """
    at_legs: dict[Leg, tuple[float, StreetCrossing]] = {}
    taken: dict[int, list[float]] = defaultdict(list)
    for crossing in found.crossings:
        plan = plans.get(crossing.street)
        if plan is None:
            junction = inner[crossing.street]
            place = f"junction {FIRST_JUNCTION + junction.number}"
            reason = "crossing: inside a junction, where its street is no road any more"
            drawn.note(ElementOutcome.LOST, place, reason, 0.7, crossing.source)
            continue
        street = network.streets[crossing.street]
        length = plan.line.length
        wished = crossing.s - plan.before
        margin = CROSSWALK / 2 + KERB_GAP
        if length < 2 * margin + 0.5:
            drawn.note(
                ElementOutcome.LOST,
                f"road {plan.id}",
                "crossing: the road is too short for a crosswalk",
                0.8,
                crossing.source,
            )
            continue
        s = min(max(wished, margin), length - margin)
        if any(abs(s - other) < CROSSWALK + 1.0 for other in taken[plan.id]):
            reason = "crossing: another crosswalk is there already"
            drawn.note(ElementOutcome.LOST, f"road {plan.id}", reason, 0.8, crossing.source)
            continue
        taken[plan.id].append(s)
        _paint_crosswalk(plan, s, drawn)
        where = f"road {plan.id}, s={s:.1f}"
        kind = "crossing with lights" if crossing.lights else "crossing"
        if abs(s - wished) > 1.0:
            reason = f"{kind}: moved by {abs(s - wished):.1f} m, out of the junction"
            drawn.note(ElementOutcome.REPAIRED, where, reason, 0.7, crossing.source)
        elif crossing.source.startswith("way"):
            reason = f"{kind}: a footway runs across the road"
            drawn.note(ElementOutcome.GUESSED, where, reason, crossing.confidence, crossing.source)
        elif not crossing.marked:
            reason = f"{kind}: unmarked; drawn as a crosswalk, so that pedestrians cross"
            drawn.note(ElementOutcome.GUESSED, where, reason, 0.4, crossing.source)
        else:
            drawn.note(ElementOutcome.KEPT, where, kind, crossing.confidence, crossing.source)
        if crossing.island:
            _note_island(plan, s, where, crossing.source, drawn)
        for at_end in (False, True):
            leg = Leg(street.number, at_end)
            back = (length - s if at_end else s) + CROSSWALK / 2
            if back < 14.0 and (leg not in at_legs or at_legs[leg][0] > back):
                at_legs[leg] = (back, crossing)
    return at_legs


def _edges_at(plan: RoadPlan, s: float) -> tuple[float, float]:
    """The right and the left edge of the carriageway at s, without sidewalks."""
    section = plan.section_at(s)
    beside = ("sidewalk",)
    right = sum(k.lane.width for k in section.right if k.lane.kind not in beside)
    left = sum(k.lane.width for k in section.left if k.lane.kind not in beside)
    return section.offset - right, section.offset + left


def _note_island(plan: RoadPlan, s: float, where: str, source: str, drawn: _Drawn) -> None:
    """Draw the island of a crossing before and behind the crosswalk, and say what became of it."""
    section = plan.section_at(s)
    kinds = [{k.lane.kind for k in lanes} for lanes in (section.left, section.right)]
    if not all(seen & {"driving", "bus"} for seen in kinds):
        reason = "crossing: its island is not drawn, as traffic has one direction here"
        drawn.note(ElementOutcome.LOST, where, reason, 0.8, source)
        return
    for side in (-1, 1):
        at = s + side * (CROSSWALK / 2 + ISLAND_LENGTH / 2)
        if at - ISLAND_LENGTH / 2 <= 0.0 or at + ISLAND_LENGTH / 2 >= plan.line.length:
            continue
        u, v = ISLAND_LENGTH / 2, ISLAND_WIDTH / 2
        corners = tuple(
            model.Corner(True, a, b, 0.0, ISLAND_HEIGHT)
            for a, b in ((-u, -v), (u, -v), (u, v), (-u, v), (-u, -v))
        )
        plan.objects.append(
            _draw_object(
                drawn,
                "trafficIsland",
                "Island",
                at,
                plan.section_at(at).offset,
                length=ISLAND_LENGTH,
                width=ISLAND_WIDTH,
                height=ISLAND_HEIGHT,
                outlines=(model.Outline(corners, True, True),),
            )
        )
    reason = (
        f"crossing: its island of {ISLAND_WIDTH:g} m is drawn between the directions; "
        "pedestrians cross in one go"
    )
    drawn.note(ElementOutcome.GUESSED, where, reason, 0.5, source)


def _paint_crosswalk(plan: RoadPlan, s: float, drawn: _Drawn) -> None:
    low, high = _edges_at(plan, s)
    low, high = low - REACH, high + REACH
    u, v = CROSSWALK / 2, (high - low) / 2
    # CARLA expects the first corner once more at the end.
    corners = tuple(
        model.Corner(True, a, b, 0.0, 0.0)
        for a, b in ((-u, -v), (u, -v), (u, v), (-u, v), (-u, -v))
    )
    plan.objects.append(
        _draw_object(
            drawn,
            "crosswalk",
            "Crosswalk",
            s,
            (low + high) / 2,
            length=CROSSWALK,
            width=high - low,
            outlines=(model.Outline(corners, True, True),),
        )
    )


def _draw_object(
    drawn: _Drawn,
    kind: str,
    name: str,
    s: float,
    t: float,
    *,
    length: float,
    width: float,
    orientation: str = "none",
    height: float = 0.0,
    outlines: tuple[model.Outline, ...] = (),
) -> model.RoadObject:
    return model.RoadObject(
        id=drawn.new_object(),
        type=kind,
        subtype="",
        name=name,
        s=s,
        t=t,
        z_offset=0.0,
        hdg=0.0,
        pitch=0.0,
        roll=0.0,
        orientation=orientation,
        length=length,
        width=width,
        height=height,
        radius=None,
        valid_length=None,
        outlines=outlines,
    )


# ------------------------------------------------------------------ junctions


def _plan_approach(plan: RoadPlan, leg: Leg, *, arriving: bool) -> Approach:
    pose = plan.divider(at_end=leg.at_end)
    return Approach(
        leg,
        tuple(plan.lanes(at_end=leg.at_end, arriving=arriving)),
        pose if arriving else pose.back(),
    )


def _draw_junction(
    network: StreetNetwork,
    junction: Junction,
    plans: dict[int, RoadPlan],
    found: Furniture,
    at_legs: dict[Leg, tuple[float, StreetCrossing]],
    ranks: dict[Leg, int],
    applied: set[int],
    drawn: _Drawn,
) -> None:
    """Draw connecting roads, and put up what controls traffic."""
    number = FIRST_JUNCTION + junction.number
    legs = [leg for leg in junction.legs if leg.street in plans]
    linked = [
        leg
        for leg in legs
        if (plans[leg.street].end_junction if leg.at_end else plans[leg.street].start_junction)
        == number
    ]
    if not linked:
        return
    connections: list[model.Connection] = []
    movements = _find_movements(network, junction, linked, plans, applied, drawn)
    for movement in movements:
        connections.append(
            _connect_lanes(network, movement, plans, number, len(connections), drawn)
        )
    for start, end in _find_corners(linked, plans):
        connections.append(_connect_walk(start, end, plans, number, len(connections), drawn))
    if not connections:
        # Nothing leads on: roads just end here.
        for leg in linked:
            plan = plans[leg.street]
            if leg.at_end:
                plan.end_junction = None
            else:
                plan.start_junction = None
        source = f"node {min(junction.nodes)}"
        reason = "nothing leads on from here: its streets end"
        drawn.note(ElementOutcome.GUESSED, f"junction {number}", reason, 0.6, source)
        return
    controls = {leg: found.controls.get(leg, []) for leg in linked}
    arriving = {movement.start.leg for movement in movements}
    lit = [
        leg for leg in linked if leg in arriving and any(c.kind == "light" for c in controls[leg])
    ]
    with_lit_crossing = [leg for leg in linked if leg in at_legs and at_legs[leg][1].lights]
    if not lit and len(linked) > 2 and len(with_lit_crossing) * 2 >= len(linked) + 1:
        lit = [leg for leg in linked if leg in arriving]
        for leg in with_lit_crossing[:1]:
            reason = "lights for all approaches: most of its crossings have lights"
            drawn.note(
                ElementOutcome.GUESSED, f"junction {number}", reason, 0.6, at_legs[leg][1].source
            )
    groups: dict[tuple[int, bool], list[str]] = {}
    axis = plans[linked[0].street].divider(at_end=linked[0].at_end).hdg
    signed = False
    for leg in linked:
        plan = plans[leg.street]
        coming = plan.lanes(at_end=leg.at_end, arriving=True)
        cars = [i for i, lane in enumerate(coming) if lane.carries_cars]
        back = at_legs[leg][0] if leg in at_legs else 0.0
        line = back + STOP_GAP
        turned = abs(math.remainder(2 * (plan.divider(at_end=leg.at_end).hdg - axis), 2 * math.pi))
        across = int(turned > math.pi / 2)
        if leg in lit and leg in arriving:
            own = [c for c in controls[leg] if c.kind == "light"]
            line = _line_place(plan, leg, own, line, network)
            lefts = {
                i
                for i in cars
                if (mine := [m for m in movements if m.start.leg == leg and m.lane == i])
                and all(m.turn > places.STRAIGHT_ON for m in mine)
            }
            rest = [i for i in cars if i not in lefts]
            alone = len(rest) == 0
            for lanes, is_left in ((rest, False), (sorted(lefts), not alone)):
                if lanes:
                    light = _put_up(plan, leg, "1000001", "Light", line, lanes, drawn, dynamic=True)
                    groups.setdefault((across, is_left), []).append(light)
            if leg in at_legs:
                walk = groups.setdefault((1 - across, False), [])
                walk += _walk_lights(plan, leg, back - CROSSWALK, drawn)
        else:
            kinds = {c.kind for c in controls[leg]} & {"stop", "yield"}
            if kinds and cars:
                kind = "stop" if "stop" in kinds else "yield"
                signed = True
                line = _line_place(
                    plan, leg, [c for c in controls[leg] if c.kind == kind], line, network
                )
                code, label = {"stop": ("206", "Stop"), "yield": ("205", "Yield")}[kind]
                _put_up(plan, leg, code, label, line, cars, drawn)
            elif leg not in at_legs:
                continue
        if cars:
            _paint_stop_line(plan, leg, line, coming, drawn)
    controllers = []
    for sequence, (_, signals) in enumerate(sorted(groups.items())):
        if signals:
            controller = drawn.new_controller()
            drawn.controllers[controller] = model.Controller(
                controller,
                f"junction {number} group {sequence}",
                0,
                tuple((s, "0") for s in signals),
            )
            controllers.append(controller)
    priorities: tuple[model.JunctionPriority, ...] = ()
    if not lit and not signed:
        priorities = _rank_priorities(network, linked, plans, ranks, number, drawn)
    drawn.junctions.append(
        model.Junction(
            id=str(number),  # type: ignore[arg-type]
            name="",
            type="default",
            connections=tuple(connections),
            priorities=priorities,
            controllers=tuple(controllers),
        )
    )
    if len(junction.nodes) > 1:
        nodes = ", ".join(str(node) for node in sorted(junction.nodes)[:6])
        reason = f"one junction of {len(junction.nodes)} nodes: {nodes}"
        source = f"node {min(junction.nodes)}"
        drawn.note(ElementOutcome.GUESSED, f"junction {number}", reason, 0.7, source)


def _line_place(
    plan: RoadPlan, leg: Leg, controls: Sequence[LegControl], line: float, network: StreetNetwork
) -> float:
    """Metres from the end of a road to its stop line: at its signal, where that is farther out."""
    street = network.streets[leg.street]
    cut = street.line.length - plan.before - plan.line.length if leg.at_end else plan.before
    own = [c.back - cut for c in controls if c.back > 0.0]
    if own and line < max(own) < line + 20.0:
        line = max(own)
    return min(line, 0.8 * plan.line.length)


def _rank_priorities(
    network: StreetNetwork,
    legs: Sequence[Leg],
    plans: dict[int, RoadPlan],
    ranks: dict[Leg, int],
    number: int,
    drawn: _Drawn,
) -> tuple[model.JunctionPriority, ...]:
    """Who goes first where no sign says it: the roundabout, or the more important street."""
    rings = [leg for leg in legs if places.is_ring(network, network.streets[leg.street])]
    if rings:
        high = [leg for leg in rings if leg.at_end]
        low = [leg for leg in legs if leg not in rings and street_furniture.arrives(network, leg)]
    else:
        top = max(ranks[leg] for leg in legs)
        high = [leg for leg in legs if ranks[leg] == top]
        low = [leg for leg in legs if ranks[leg] < top]
        if len(legs) < 3 or not low or len(high) < 2:
            return ()
        source = f"way {places.leg_way(network, low[0])}"
        has_priority_road = top > max(street.rank for street in CLASSES.values())
        reason = (
            "gives way to the priority road: no sign says who does"
            if has_priority_road
            else "gives way to the more important street: no sign says who does"
        )
        element = f"junction {number} > road {plans[low[0].street].id}"
        drawn.note(
            ElementOutcome.GUESSED, element, reason, 0.9 if has_priority_road else 0.6, source
        )
    pairs = {
        (plans[a.street].id, plans[b.street].id) for a in high for b in low if a.street != b.street
    }
    return tuple(model.JunctionPriority(model_id(a), model_id(b)) for a, b in sorted(pairs))


def _find_movements(
    network: StreetNetwork,
    junction: Junction,
    legs: Sequence[Leg],
    plans: dict[int, RoadPlan],
    applied: set[int],
    drawn: _Drawn,
) -> list[Movement]:
    """Movements of cars, buses and bicycles between the lanes of the legs."""
    movements: list[Movement] = []
    flows: list[_Flow] = []
    outs = {leg: _plan_approach(plans[leg.street], leg, arriving=False) for leg in legs}
    for leg in legs:
        start = _plan_approach(plans[leg.street], leg, arriving=True)
        if not start.lanes:
            continue
        if len(legs) == 1:
            movements += _turn_round(start, outs[leg])
            continue
        paths = places.find_paths(network, junction, leg, applied)
        paths = {other: nodes for other, nodes in paths.items() if other in outs}
        turns = {
            other: math.remainder(outs[other].pose.hdg - start.pose.hdg, 2 * math.pi)
            for other in paths
        }
        wants_back = any("reverse" in lane.turns for lane in start.lanes)
        ahead = [other for other in paths if abs(turns[other]) < places.BACK]
        if ahead and not wants_back:
            paths = {other: paths[other] for other in ahead}
        exits = sorted(paths, key=lambda other: (-turns[other], other))
        if not any(_car_lanes(outs[e].lanes, "driving") for e in exits) and outs[leg].lanes:
            movements += _turn_round(start, outs[leg])  # only one-way streets that lead here
            continue
        for kind in ("driving", "bus"):
            coming = [i for i, lane in enumerate(start.lanes) if lane.kind == kind]
            lanes_at = {e: _car_lanes(outs[e].lanes, kind) for e in exits}
            usable = [e for e in exits if lanes_at[e]]
            if not coming or not usable:
                continue
            chosen, by_turn_lanes = places.choose_exits(
                [start.lanes[i] for i in coming],
                [turns[e] for e in usable],
                [len(lanes_at[e]) for e in usable],
            )
            for place, exit_leg in enumerate(usable):
                lanes = [coming[i] for i, exits_of in enumerate(chosen) if place in exits_of]
                from_left = bool(lanes) and lanes[0] == coming[0]
                if not lanes and by_turn_lanes:
                    reason = "turn:lanes has no arrow for it: no connection"
                    element = f"road {plans[leg.street].id} to road {plans[exit_leg.street].id}"
                    source = f"way {places.leg_way(network, leg)}"
                    drawn.note(ElementOutcome.GUESSED, element, reason, 0.6, source)
                if lanes:
                    flows.append(
                        _Flow(
                            start,
                            lanes,
                            outs[exit_leg],
                            lanes_at[exit_leg],
                            turns[exit_leg],
                            paths[exit_leg],
                            from_left and len(lanes) < len(coming),
                        )
                    )
        movements += _bicycle_movements(start, exits, outs, turns, paths)
    for flow in flows:
        # Roads that merge have lanes of their own behind, if there are enough of them.
        merging = [
            other
            for other in flows
            if other.end.leg == flow.end.leg
            and other.going == flow.going
            and abs(other.turn) <= places.STRAIGHT_ON
        ]
        merging.sort(key=_Flow.lateral_place)
        needed = sum(len(other.lanes) for other in merging)
        if flow in merging and len(merging) > 1 and needed <= len(flow.going):
            before = sum(len(other.lanes) for other in merging[: merging.index(flow)])
            pairs = list(zip(flow.lanes, flow.going[before:], strict=False))
        else:
            pairs = places.match_lanes(flow.lanes, flow.going, flow.turn, from_left=flow.from_left)
        movements += [
            Movement(flow.start, lane, flow.end, target, flow.turn, flow.path)
            for lane, target in pairs
        ]
    return movements


class _Flow(NamedTuple):
    """Lanes of an approach that lead to an exit, and the lanes there, from left to right."""

    start: Approach
    lanes: list[int]
    end: Approach
    going: list[int]
    turn: float
    path: tuple[int, ...]
    from_left: bool

    def lateral_place(self) -> float:
        """How far to the right of the exit, as traffic there looks, the approach is."""
        exit_pose, pose = self.end.pose, self.start.pose
        dx, dy = pose.x - exit_pose.x, pose.y - exit_pose.y
        return dx * math.sin(exit_pose.hdg) - dy * math.cos(exit_pose.hdg)


def _car_lanes(lanes: Sequence[StreetLane], kind: str) -> list[int]:
    own = [i for i, lane in enumerate(lanes) if lane.kind == kind]
    if kind == "bus" and not own:
        return [i for i, lane in enumerate(lanes) if lane.kind == "driving"]
    return own


def _bicycle_movements(
    start: Approach,
    exits: Sequence[Leg],
    outs: dict[Leg, Approach],
    turns: dict[Leg, float],
    paths: dict[Leg, tuple[int, ...]],
) -> list[Movement]:
    """Bicycle lanes straight on and to the right, into bicycle lanes or else lanes for all."""
    coming = [i for i, lane in enumerate(start.lanes) if lane.kind == "biking"]
    if not coming or not exits:
        return []
    straight = min(exits, key=lambda e: abs(turns[e]))
    wanted = [e for e in exits if e == straight or turns[e] < -places.STRAIGHT_ON]
    result = []
    for lane in coming:
        tokens = start.lanes[lane].turns
        chosen = wanted if lane == coming[-1] else [straight]
        if tokens and not tokens & {"through", "right", "slight_right", "none", "sharp_right"}:
            chosen = [max(exits, key=lambda e: turns[e])]
        for leg in chosen:
            lanes = outs[leg].lanes
            bikes = [i for i, lane in enumerate(lanes) if lane.kind == "biking"]
            general = [i for i, lane in enumerate(lanes) if lane.kind == "driving"]
            targets = bikes or general
            if targets:
                result.append(Movement(start, lane, outs[leg], targets[-1], turns[leg], paths[leg]))
    return result


def _turn_round(start: Approach, end: Approach) -> list[Movement]:
    """The turn at a dead end: from the inner lane to the inner one."""
    coming = [i for i, lane in enumerate(start.lanes) if lane.carries_cars]
    going = [i for i, lane in enumerate(end.lanes) if lane.carries_cars]
    pairs = (
        [(lane, going[min(i, len(going) - 1)]) for i, lane in enumerate(coming)] if going else []
    )
    return [Movement(start, lane, end, target, math.pi, ()) for lane, target in pairs]


def _lane_id(leg: Leg, place: int, *, arriving: bool) -> int:
    sign = -1 if leg.at_end == arriving else 1
    return sign * (place + 1)


def _connect_lanes(
    network: StreetNetwork,
    movement: Movement,
    plans: dict[int, RoadPlan],
    junction: int,
    index: int,
    drawn: _Drawn,
) -> model.Connection:
    """Draw the connecting road of a movement: one lane, right of its reference line."""
    start, end = movement.start, movement.end
    first, last = start.lanes[movement.lane], end.lanes[movement.target]
    begin = start.centre(movement.lane).left(first.width / 2)
    finish = end.centre(movement.target).left(last.width / 2)
    bulge = LOOP if start.leg.street == end.leg.street else 0.0
    parts = curves_between(begin, finish, bulge=bulge)
    if len(movement.through) > 1:
        parts = _follow_path(network, movement, begin, finish, parts)
    kinds = (first.kind, last.kind)
    aside = math.copysign(min(first.width, last.width) / 2.0, movement.turn)
    radius = least_radius(parts) + aside  # of the middle of the lane, right of the line
    if radius < SHARPEST and "biking" not in kinds and abs(movement.turn) < places.BACK:
        way = f"way {places.leg_way(network, start.leg)}"
        reason = f"a turn with a radius of {max(radius, 1.0):.0f} m: too sharp for a bus"
        drawn.note(ElementOutcome.GUESSED, f"junction {junction}", reason, 0.3, way)
    kind = "biking" if "biking" in kinds else "bus" if "bus" in kinds else "driving"
    lane = replace(first, kind=kind)
    plan, onto = plans[start.leg.street], plans[end.leg.street]
    speeds = [
        _speed_at(plan, at_end=start.leg.at_end, arriving=True),
        _speed_at(onto, at_end=end.leg.at_end, arriving=False),
    ]
    speed = min((s for s in speeds if s != NO_LIMIT), default=NO_LIMIT)
    if abs(movement.turn) > places.STRAIGHT_ON and speed != NO_LIMIT:
        speed = min(speed, TURN_SPEED)
    source, target = (
        _lane_id(start.leg, movement.lane, arriving=True),
        _lane_id(end.leg, movement.target, arriving=False),
    )
    road = _connecting_road(
        drawn,
        parts,
        lane,
        last.width,
        (start.leg, plan),
        (end.leg, onto),
        junction,
        (source, target),
        math.inf if speed == NO_LIMIT else speed,
    )
    return model.Connection(str(index), model_id(plan.id), road, "start", ((source, -1),))


def _connecting_road(
    drawn: _Drawn,
    parts: Sequence[Cubic],
    lane: StreetLane,
    end_width: float,
    start: tuple[Leg, RoadPlan],
    end: tuple[Leg, RoadPlan],
    junction: int,
    linked: tuple[int, int],
    speed: float,
) -> RoadId:
    length = sum(part.length for part in parts)
    road_id = model_id(drawn.new_road())
    lanes = {
        0: model.Lane(0, "none"),
        -1: model.Lane(
            -1,
            lane_type(lane),
            widths=tuple(ease(0.0, lane.width, end_width, length)[:1]),
            heights=(model.LaneHeight(0.0, 0.12, 0.12),) if lane.kind == "sidewalk" else (),
            access=lane_access(0.0, lane),
            predecessors=(linked[0],),
            successors=(linked[1],),
        ),
    }
    (from_leg, from_plan), (to_leg, to_plan) = start, end
    drawn.roads[road_id] = model.Road(
        id=road_id,
        name="",
        length=length,
        junction=str(junction),  # type: ignore[arg-type]
        rule="RHT",
        predecessor=model.RoadLink(
            "road", str(from_plan.id), "end" if from_leg.at_end else "start"
        ),
        successor=model.RoadLink("road", str(to_plan.id), "end" if to_leg.at_end else "start"),
        types=(model.RoadType(0.0, "town", speed),),
        geometry=write_geometry(parts),
        elevation=(),
        superelevation=(),
        lane_offset=(),
        sections=(model.LaneSection(0.0, length, lanes),),
    )
    return road_id


def _raise_connecting_roads(
    plans: dict[int, RoadPlan], heights: scenery.StreetHeights, drawn: _Drawn
) -> None:
    """Give connecting roads the heights and grades of the roads that they connect."""
    by_id = {model_id(plan.id): plan for plan in plans.values()}
    for road in list(drawn.roads.values()):
        if road.junction is None or road.predecessor is None or road.successor is None:
            continue
        ends = []
        for link, same_way in ((road.predecessor, "end"), (road.successor, "start")):
            plan = by_id[model_id(int(link.element_id))]
            z, grade = heights.at_end(plan, at_end=link.contact_point == "end")
            ends.append((z, grade if link.contact_point == same_way else -grade))
        (z0, g0), (z1, g1) = ends
        if max(abs(z0), abs(z1)) > scenery.LEVEL:
            profile = scenery.hermite(0.0, road.length, np.array([z0, z1]), np.array([g0, g1]))
            drawn.roads[road.id] = replace(road, elevation=(profile,))


def _speed_at(plan: RoadPlan, *, at_end: bool, arriving: bool) -> float:
    section = plan.sections[-1 if at_end else 0]
    return section.speed_right if at_end == arriving else section.speed_left


def _follow_path(
    network: StreetNetwork, movement: Movement, begin: Pose, finish: Pose, direct: list[Cubic]
) -> list[Cubic]:
    """Curves along the nodes inside a large junction, where the direct one strays from them."""
    drawn = np.vstack([part.places() for part in direct])
    inside = [network.places[node] for node in movement.through]
    astray = [place for place in inside if np.hypot(*(drawn - np.array(place)).T).min() > DETOUR]
    ahead = [begin.x, begin.y]
    astray = [
        place
        for place in astray
        if math.hypot(place[0] - ahead[0], place[1] - ahead[1]) > 6.0
        and math.hypot(place[0] - finish.x, place[1] - finish.y) > 6.0
        and (place[0] - begin.x) * math.cos(begin.hdg) + (place[1] - begin.y) * math.sin(begin.hdg)
        > 3.0
    ]
    if not astray:
        return direct
    route = [(begin.x, begin.y), *astray, (finish.x, finish.y)]
    poses = [begin]
    for before, here, after in zip(route[:-2], route[1:-1], route[2:], strict=True):
        poses.append(Pose(*here, math.atan2(after[1] - before[1], after[0] - before[0])))
    poses.append(finish)
    led = [part for a, b in itertools.pairwise(poses) for part in curves_between(a, b)]
    # Better beside the nodes than along a bend that nobody can drive.
    sharp = least_radius(led)
    return led if sharp > DRIVABLE or sharp > least_radius(direct) else direct


# ------------------------------------------------------------------ pedestrians at junctions


class _Walk(NamedTuple):
    """A sidewalk at an end of a road: its place outwards, and its inner side as seen going in."""

    leg: Leg
    place: int
    width: float
    border: Pose


def _find_corners(legs: Sequence[Leg], plans: dict[int, RoadPlan]) -> list[tuple[_Walk, _Walk]]:
    """Sidewalks that go on round a corner: on the right of who arrives, to the next leg there."""
    if len(legs) < 2:
        return []
    pairs = []
    for i, leg in enumerate(legs):
        # Counter-clockwise order: on the right of who arrives is the leg before... the next one.
        start = _walk_at(plans[leg.street], leg, arriving=True)
        other = legs[(i + 1) % len(legs)]
        end = _walk_at(plans[other.street], other, arriving=False)
        if start is not None and end is not None:
            pairs.append((start, end))
    return pairs


def _walk_at(plan: RoadPlan, leg: Leg, *, arriving: bool) -> _Walk | None:
    """The sidewalk on the right of who arrives at a road's end, or of who leaves there."""
    lanes = plan.lanes(at_end=leg.at_end, arriving=arriving)
    place = next((i for i, lane in enumerate(lanes) if lane.kind == "sidewalk"), None)
    if place is None:
        return None
    pose = plan.divider(at_end=leg.at_end)
    pose = pose if arriving else pose.back()
    before = sum(lane.width for lane in lanes[:place])
    return _Walk(leg, place, lanes[place].width, pose.left(-before))


def _connect_walk(
    start: _Walk,
    end: _Walk,
    plans: dict[int, RoadPlan],
    junction: int,
    index: int,
    drawn: _Drawn,
) -> model.Connection:
    plan, onto = plans[start.leg.street], plans[end.leg.street]
    linked = (
        _lane_id(start.leg, start.place, arriving=True),
        _lane_id(end.leg, end.place, arriving=False),
    )
    road = _connecting_road(
        drawn,
        [curve_between(start.border, end.border)],
        StreetLane("sidewalk", start.width),
        end.width,
        (start.leg, plan),
        (end.leg, onto),
        junction,
        linked,
        30 / 3.6,
    )
    return model.Connection(str(index), model_id(plan.id), road, "start", ((linked[0], -1),))


# ------------------------------------------------------------------ lights, signs, stop lines


def _side_of(leg: Leg) -> int:
    """Sign of t where traffic arrives at a leg."""
    return -1 if leg.at_end else 1


def _put_up(
    plan: RoadPlan,
    leg: Leg,
    code: str,
    label: str,
    back: float,
    lanes: Sequence[int],
    drawn: _Drawn,
    *,
    dynamic: bool = False,
) -> str:
    """Put up a light or sign for lanes that arrive; returns its id."""
    side = _side_of(leg)
    coming = plan.lanes(at_end=leg.at_end, arriving=True)
    section = plan.sections[-1 if leg.at_end else 0]
    cars = [i for i, lane in enumerate(coming) if lane.carries_cars]
    aside = sum(lane.width for lane in coming if lane.kind != "sidewalk") + 0.6
    if lanes[-1] != cars[-1]:
        aside = sum(lane.width for lane in coming[: lanes[0]]) + coming[lanes[0]].width / 2
    ids = sorted(_lane_id(leg, i, arriving=True) for i in lanes)
    signal = drawn.new_signal()
    s = plan.line.length - back if leg.at_end else back
    plan.signals.append(
        model.Signal(
            id=signal,
            name=label,
            s=max(s, 0.0),
            t=section.offset + side * aside,
            z_offset=3.0 if dynamic else 2.0,
            h_offset=0.0,
            orientation="+" if leg.at_end else "-",
            dynamic=dynamic,
            country="OpenDRIVE" if dynamic else "DE",
            type=code,
            subtype="-1",
            value=None,
            unit="",
            text="",
            width=0.4 if dynamic else 0.6,
            height=1.0 if dynamic else 0.6,
            validities=tuple(model.Validity(a, b) for a, b in _runs_of_lanes(ids)),
        )
    )
    return signal


def _runs_of_lanes(ids: Sequence[int]) -> list[tuple[int, int]]:
    """Runs of neighbouring lane ids."""
    runs: list[tuple[int, int]] = []
    for lane in ids:
        if runs and lane == runs[-1][1] + 1:
            runs[-1] = (runs[-1][0], lane)
        else:
            runs.append((lane, lane))
    return runs


def _walk_lights(plan: RoadPlan, leg: Leg, back: float, drawn: _Drawn) -> list[str]:
    """Lights for pedestrians on both sides of a crosswalk at a leg."""
    section = plan.sections[-1 if leg.at_end else 0]
    signals = []
    for sign, lanes in ((-1, section.right), (1, section.left)):
        walks = [place for place, k in enumerate(lanes) if k.lane.kind == "sidewalk"]
        aside = sum(k.lane.width for k in lanes if k.lane.kind != "sidewalk") + 0.6
        signal = drawn.new_signal()
        s = plan.line.length - back if leg.at_end else back
        validities: tuple[model.Validity, ...] = ()
        if walks:
            lane = sign * (walks[0] + 1)
            validities = (model.Validity(lane, lane),)
        plan.signals.append(
            model.Signal(
                id=signal,
                name="WalkLight",
                s=max(s, 0.0),
                t=section.offset + sign * aside,
                z_offset=2.2,
                h_offset=0.0,
                orientation="+" if leg.at_end else "-",
                dynamic=True,
                country="OpenDRIVE",
                type="1000002",
                subtype="-1",
                value=None,
                unit="",
                text="",
                width=0.3,
                height=0.8,
                validities=validities,
            )
        )
        signals.append(signal)
    return signals


def _paint_stop_line(
    plan: RoadPlan, leg: Leg, back: float, coming: Sequence[StreetLane], drawn: _Drawn
) -> None:
    side = _side_of(leg)
    section = plan.sections[-1 if leg.at_end else 0]
    width = sum(lane.width for lane in coming if lane.kind not in ("sidewalk", "parking"))
    s = plan.line.length - back if leg.at_end else back
    plan.objects.append(
        _draw_object(
            drawn,
            "roadMark",
            "StopLine",
            min(max(s, 0.0), plan.line.length),
            section.offset + side * width / 2,
            length=0.4,
            width=width,
            orientation="+" if leg.at_end else "-",
        )
    )


def _light_crossings(
    plans: dict[int, RoadPlan],
    found: Furniture,
    at_legs: dict[Leg, tuple[float, StreetCrossing]],
    drawn: _Drawn,
) -> None:
    """Give crossings with lights, but without a node for the lights of the road, these lights."""
    for crossing in found.crossings:
        plan = plans.get(crossing.street)
        if plan is None or not crossing.lights:
            continue
        if any(
            m.street == crossing.street and abs(m.s - crossing.s) < street_furniture.AT_CROSSING
            for m in found.midway
        ):
            continue
        where = f"road {plan.id}, s={crossing.s - plan.before:.1f}"
        if any(
            at_legs.get(Leg(crossing.street, end), (0, None))[1] is crossing
            for end in (False, True)
        ):
            number = (
                plan.end_junction
                if crossing.s > plan.before + plan.line.length / 2
                else plan.start_junction
            )
            lit = any(j.id == str(number) and j.controllers for j in drawn.junctions)
            if not lit and number is not None:
                reason = "lights of the crossing: the junction beside it has none"
                drawn.note(ElementOutcome.LOST, where, reason, 0.7, crossing.source)
                continue
            if lit:
                continue
        for ahead in (True, False):
            found.midway.append(
                street_furniture.MidwaySignal(crossing.street, crossing.s, ahead, crossing.source)
            )
        reason = "lights for the road: the crossing has lights"
        drawn.note(ElementOutcome.GUESSED, where, reason, 0.8, crossing.source)


def _draw_midway_signals(plans: dict[int, RoadPlan], found: Furniture, drawn: _Drawn) -> None:
    """Lights between junctions, and their stop lines."""
    by_place: dict[tuple[int, str], list[str]] = defaultdict(list)
    for midway in found.midway:
        plan = plans.get(midway.street)
        if plan is None:
            continue
        s = min(max(midway.s - plan.before, 0.5), plan.line.length - 0.5)
        near = [
            c.s - plan.before
            for c in found.crossings
            if c.street == midway.street and abs(c.s - midway.s) < street_furniture.AT_CROSSING
        ]
        gap = CROSSWALK / 2 + STOP_GAP
        if near:
            s = min(s, min(near) - gap) if midway.ahead else max(s, max(near) + gap)
            s = min(max(s, 0.3), plan.line.length - 0.3)
        section = plan.section_at(s)
        lanes = section.right if midway.ahead else section.left
        cars = [i for i, k in enumerate(lanes) if k.lane.carries_cars]
        if not cars:
            continue
        sign = -1 if midway.ahead else 1
        aside = sum(k.lane.width for k in lanes if k.lane.kind != "sidewalk") + 0.6
        width = sum(k.lane.width for k in lanes if k.lane.kind not in ("sidewalk", "parking"))
        ids = sorted(sign * (i + 1) for i in cars)
        signal = drawn.new_signal()
        orientation = "+" if midway.ahead else "-"
        plan.signals.append(
            model.Signal(
                id=signal,
                name="Light",
                s=s,
                t=section.offset + sign * aside,
                z_offset=3.0,
                h_offset=0.0,
                orientation=orientation,
                dynamic=True,
                country="OpenDRIVE",
                type="1000001",
                subtype="-1",
                value=None,
                unit="",
                text="",
                width=0.4,
                height=1.0,
                validities=tuple(model.Validity(a, b) for a, b in _runs_of_lanes(ids)),
            )
        )
        plan.objects.append(
            _draw_object(
                drawn,
                "roadMark",
                "StopLine",
                s,
                section.offset + sign * width / 2,
                length=0.4,
                width=width,
                orientation=orientation,
            )
        )
        by_place[midway.street, midway.source].append(signal)
    for (_, source), signals in by_place.items():
        controller = drawn.new_controller()
        drawn.controllers[controller] = model.Controller(
            controller, source, 0, tuple((signal, "0") for signal in signals)
        )


# ------------------------------------------------------------------ left-hand traffic


def mirror_map(drawn: model.OpenDrive) -> model.OpenDrive:
    """Mirror a map at the y axis: traffic that keeps right then keeps left."""
    roads = {key: _mirror_road(road) for key, road in drawn.roads.items()}
    junctions = {
        key: replace(
            junction,
            connections=tuple(
                c._replace(lane_links=tuple((-a, -b) for a, b in c.lane_links))
                for c in junction.connections
            ),
        )
        for key, junction in drawn.junctions.items()
    }
    header = drawn.header
    assert header.west is not None
    assert header.east is not None
    header = replace(header, west=-header.east, east=-header.west)
    return replace(drawn, header=header, roads=roads, junctions=junctions)


def _mirror_road(road: model.Road) -> model.Road:
    negated = {
        model.GeometryKind.ARC: (-1.0,),
        model.GeometryKind.PARAM_POLY3: (1.0,) * 4 + (-1.0,) * 4,
    }
    geometry = tuple(
        g._replace(
            x=-g.x,
            hdg=math.pi - g.hdg,
            params=tuple(a * b for a, b in zip(g.params, negated.get(g.kind, ()), strict=True)),
        )
        for g in road.geometry
    )
    changes: dict[model.LaneChange, model.LaneChange] = {
        "increase": "decrease",
        "decrease": "increase",
    }
    sections = []
    for section in road.sections:
        lanes = [
            replace(
                lane,
                id=-lane.id,
                predecessors=tuple(-i for i in lane.predecessors),
                successors=tuple(-i for i in lane.successors),
                road_marks=tuple(
                    m._replace(lane_change=changes.get(m.lane_change, m.lane_change))
                    for m in lane.road_marks
                ),
            )
            for lane in section.lanes.values()
        ]
        lanes.sort(key=lambda lane: -lane.id)
        sections.append(replace(section, lanes={lane.id: lane for lane in lanes}))
    objects = tuple(
        replace(
            item,
            t=-item.t,
            hdg=-item.hdg,
            outlines=tuple(
                o._replace(corners=tuple(c._replace(b=-c.b) for c in o.corners))
                for o in item.outlines
            ),
        )
        for item in road.objects
    )
    signals = tuple(
        replace(
            signal,
            t=-signal.t,
            h_offset=-signal.h_offset,
            validities=tuple(model.Validity(-v.to_lane, -v.from_lane) for v in signal.validities),
        )
        for signal in road.signals
    )
    return replace(
        road,
        rule="LHT",
        geometry=geometry,
        lane_offset=tuple(model.Cubic(c.s, *(-v for v in c[1:])) for c in road.lane_offset),
        sections=tuple(sections),
        objects=objects,
        signals=signals,
    )
