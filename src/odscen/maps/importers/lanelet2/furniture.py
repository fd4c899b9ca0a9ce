"""Crosswalks, stop lines, lights, signs, right of way and areas of a map of lanelets."""

from __future__ import annotations

import math
import re
from collections import defaultdict
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final

import numpy as np
import shapely

from odscen.base.ids import JunctionId, RoadId
from odscen.base.shown import shown, shown_id
from odscen.convert.model.conversion_report import ElementOutcome, ReportEntry
from odscen.maps.importers.lanelet2.lanelet_roads import read_sign_speed
from odscen.opendrive.road_model import (
    Controller,
    Corner,
    JunctionPriority,
    Outline,
    RoadObject,
    Signal,
    SignalReference,
    Validity,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from odscen.base.arrays import FloatArray
    from odscen.maps.importers.lanelet2.lanelet_file import LaneletMap, RegulatoryElement
    from odscen.maps.importers.lanelet2.lanelet_roads import BuiltRoads, LanePlace
    from odscen.maps.importers.lanelet2.road_fitting import FittedRoad

_NEAR = 15.0
"""Metres from a road at most of what is placed beside it."""
_AREA_NEAR = 60.0
_PAINT = 0.3
_AREAS: Final = {
    "parking": "parkingSpace",
    "vegetation": "vegetation",
    "traffic_island": "trafficIsland",
    "building": "building",
}
# The subtypes of lanelet2's RegulatoryElementTagging.md and Autoware's names, by what VzKat calls
# the sign.
_SIGNS: Final = {"stop_sign": "206", "yield_sign": "205", "give_way": "205", "priority": "306"}
_YIELDING: Final = frozenset({"205", "206"})
_GIVEN: Final = frozenset({"301", "306"})
_CODE = re.compile(r"([a-z]{2})_?([0-9][0-9.]*)(?:-(.+))?")


@dataclass(slots=True, eq=False)
class Furniture:
    """What hangs on roads, as it is collected."""

    source: LaneletMap
    built: BuiltRoads
    objects: dict[RoadId, list[RoadObject]] = field(default_factory=lambda: defaultdict(list))
    signals: dict[RoadId, list[Signal]] = field(default_factory=lambda: defaultdict(list))
    references: dict[RoadId, list[SignalReference]] = field(
        default_factory=lambda: defaultdict(list)
    )
    signal_ids: set[str] = field(default_factory=set)
    outlines: dict[RoadId, shapely.Geometry] = field(default_factory=dict)
    entries: list[ReportEntry] = field(default_factory=list)

    def report(
        self,
        outcome: ElementOutcome,
        element: str,
        reason: str,
        source_id: str,
        confidence: float | None = None,
    ) -> None:
        """Add a row."""
        self.entries.append(ReportEntry(outcome, element, reason, confidence, source_id))

    def road_under(
        self, shape: shapely.Geometry, reach: float, across: FloatArray | None = None
    ) -> RoadId | None:
        """The road that has most of a shape on it, or else the nearest within reach.

        Roads outside junctions go before connecting ones that have no more of it; with a direction
        ``across``, those that it crosses before those that it follows.
        """
        best: tuple[float, float, bool] | None = None
        found = None
        for road, outline in self.outlines.items():
            apart = float(outline.distance(shape))
            if apart > reach:
                continue
            shared = outline.intersection(shape) if apart == 0.0 else None
            much = 0.0 if shared is None else max(shared.area, 0.1 * shared.length)
            connects = self.built.roads[road].road.junction is not None
            if across is not None and shared is not None and much:
                fitted = self.built.roads[road].fitted
                place = shapely.get_coordinates(shared.centroid)
                _, hdg = fitted.frame(float(fitted.locate(place)[0][0]))
                much *= 0.05 + abs(math.cos(hdg) * across[1] - math.sin(hdg) * across[0])
            rank = (-much * (0.5 if connects else 1.0), apart, connects)
            if best is None or rank < best:
                best, found = rank, road
        return found


def add_furniture(
    source: LaneletMap, built: BuiltRoads, driven: Iterable[RoadId]
) -> tuple[dict[str, Controller], list[ReportEntry]]:
    """Put furniture on the roads; gives the controllers of lights, and rows of the report.

    Parameters
    ----------
    driven
        Roads for vehicles.
    """
    things = Furniture(source, built)
    for road in driven:
        fitted = built.roads[road].fitted
        things.outlines[road] = shapely.Polygon(fitted.outline()).buffer(0.0)
    _add_crosswalks(things)
    lines = _add_stop_lines(things)
    controllers = _add_lights(things, lines)
    _add_right_of_way(things)
    _add_other_elements(things, lines)
    _add_areas(things)
    for road in things.outlines:
        if things.objects[road] or things.signals[road] or things.references[road]:
            item = built.roads[road]
            changed = replace(
                item.road,
                objects=tuple(things.objects[road]),
                signals=tuple(things.signals[road]),
                signal_references=tuple(things.references[road]),
            )
            built.roads[road] = replace(item, road=changed)
    return controllers, things.entries


def _place_outline(
    things: Furniture, road: RoadId, ring: FloatArray, kind: str, name: str, identity: str
) -> RoadObject:
    """An object with a polygon, in the coordinates of its own place on the road."""
    fitted = things.built.roads[road].fitted
    middle = ring[:, :2].mean(axis=0)
    s, t = (float(value[0]) for value in fitted.locate(middle[None]))
    point, hdg = fitted.frame(s)
    ahead = np.array([math.cos(hdg), math.sin(hdg)])
    left = np.array([-ahead[1], ahead[0]])
    away = ring[:, :2] - point - t * left
    corners = tuple(
        Corner(True, float(u), float(v), 0.0, 0.0)
        for u, v in zip((away @ ahead).tolist(), (away @ left).tolist(), strict=True)
    )
    size = np.ptp(away @ ahead), np.ptp(away @ left)
    return RoadObject(
        identity,
        kind,
        "",
        name,
        s,
        t,
        0.0,
        0.0,
        0.0,
        0.0,
        "none",
        float(size[0]),
        float(size[1]),
        0.0,
        None,
        None,
        outlines=(Outline(corners, closed=True, outer=True),),
    )


def _add_crosswalks(things: Furniture) -> None:
    for lanelet in things.source.lanelets.values():
        if lanelet.subtype != "crosswalk":
            continue
        left, right = (things.source.line(b.nodes) for b in (lanelet.left, lanelet.right))
        ring = np.concatenate([left, right[::-1]])
        shape = shapely.Polygon(ring[:, :2]).buffer(0.0)
        chord = left[-1, :2] + right[-1, :2] - left[0, :2] - right[0, :2]
        across = chord / max(float(np.hypot(*chord)), 1e-9)
        road = things.road_under(shape, _NEAR, across)
        if road is None:
            things.report(
                ElementOutcome.LOST,
                f"lanelet {shown_id(lanelet.id)}",
                f"a crosswalk with no road within {_NEAR:g} m",
                lanelet.id,
            )
            continue
        item = _place_outline(things, road, ring, "crosswalk", "crosswalk", lanelet.id)
        things.objects[road].append(item)
        is_on = things.outlines[road].intersects(shape)
        things.report(
            ElementOutcome.KEPT if is_on else ElementOutcome.GUESSED,
            f"road {road} > object {shown_id(lanelet.id)}",
            "a crosswalk" if is_on else "a crosswalk beside all roads: put on the nearest",
            lanelet.id,
            None if is_on else 0.5,
        )


def _add_stop_lines(things: Furniture) -> dict[str, tuple[RoadId, float]]:
    """Draw stop lines; gives road and s of each way."""
    source = things.source
    ways = [way for way, tags in source.way_tags.items() if tags.get("type") == "stop_line"]
    for element in source.regulatory.values():
        ways += [way for _, way in element.members.get("ref_line", ())]
    found: dict[str, tuple[RoadId, float]] = {}
    for way in dict.fromkeys(ways):
        nodes = source.ways.get(way, ())
        if len(set(nodes)) < 2:
            things.report(
                ElementOutcome.LOST, f"line {shown_id(way)}", "a stop line without length", way
            )
            continue
        line = source.line(nodes)
        road = things.road_under(shapely.LineString(line[:, :2]), 3.0)
        if road is None:
            things.report(
                ElementOutcome.LOST,
                f"line {shown_id(way)}",
                "a stop line with no road within 3 m",
                way,
            )
            continue
        fitted, lanes = things.built.roads[road].fitted, things.built.roads[road].road.sections[0]
        ends = line[[0, -1], :2]
        middle = ends.mean(axis=0)
        s, t = (float(value[0]) for value in fitted.locate(middle[None]))
        point, hdg = fitted.frame(s)
        across = ends[1] - ends[0]
        sides = np.sort((ends - point) @ np.array([-math.sin(hdg), math.cos(hdg)]))
        crossed = _lanes_between(fitted, lanes.lanes, s, *sides.tolist())
        if not crossed:
            crossed = [lane for lane in lanes.lanes if lane]
        rule = things.built.roads[road].road.rule
        along = {(lane < 0) == (rule == "RHT") for lane in crossed}
        orientation = "none" if len(along) > 1 else "+" if True in along else "-"
        turn = math.atan2(across[1], across[0]) - math.pi / 2.0 - hdg
        turn = math.remainder(turn, math.pi)
        things.objects[road].append(
            RoadObject(
                way,
                "roadMark",
                "signalLines",
                "stopLine",
                s,
                t,
                0.0,
                turn,
                0.0,
                0.0,
                orientation,
                _PAINT,
                float(np.hypot(*across)),
                0.0,
                None,
                None,
                validities=tuple(Validity(lane, lane) for lane in sorted(crossed)),
            )
        )
        found[way] = road, s
        things.report(
            ElementOutcome.KEPT, f"road {road} > object {shown_id(way)}", "a stop line", way
        )
    return found


def _lanes_between(
    fitted: FittedRoad, lanes: Iterable[int], s: float, low: float, high: float
) -> list[int]:
    """Lanes of which at least half lies between two t."""
    sides = [float(np.interp(s, fitted.stations, row)) for row in fitted.sides]
    ids = sorted((lane for lane in lanes if lane), reverse=True)
    found = []
    for k, lane in enumerate(ids):
        width = sides[k] - sides[k + 1]
        shared = min(sides[k], high) - max(sides[k + 1], low)
        if width > 0.1 and shared > 0.5 * width:
            found.append(lane)
    return found


# ----------------------------------------------------------------------------- signals
def _lanelets_with(things: Furniture, element: RegulatoryElement) -> list[str]:
    """Lanelets that name a regulatory element, or that it names."""
    named = [ll.id for ll in things.source.lanelets.values() if element.id in ll.regulations]
    named += [ref for _, ref in element.members.get("lanelets", ())]
    return list(dict.fromkeys(named))


def _find_stop_places(
    things: Furniture,
    lanelet: str,
    lines: dict[str, tuple[RoadId, float]],
    element: RegulatoryElement,
) -> list[tuple[LanePlace, float]]:
    """Where a signal acts on a lanelet: at its stop line, else at the end that leads on.

    On connecting roads it acts at their start: that is where the approach ends.
    """
    places = things.built.places.get(lanelet, [])
    connecting = [p for p in places if things.built.roads[p.road].road.junction is not None]
    if connecting:
        return [(place, min(0.5, place.end)) for place in connecting]
    if not places:
        return []
    last = places[-1]
    s = max(last.start, last.end - 0.5) if last.along else min(last.end, last.start + 0.5)
    for _, way in element.members.get("ref_line", ()):
        if way in lines and lines[way][0] == last.road:
            s = lines[way][1]
    return [(last, s)]


def _signal_on(
    things: Furniture,
    place: LanePlace,
    s: float,
    identity: str,
    at: FloatArray | None,
    **parts: str | float | bool | None,
) -> Signal:
    """A signal for one lane: at its own place beside the road if that is known."""
    fitted = things.built.roads[place.road].fitted
    sides = [float(np.interp(s, fitted.stations, row)) for row in fitted.sides]
    # Beside the outermost lane of its direction.
    t = sides[-1] - 0.5 if place.lane < 0 else sides[0] + 0.5
    z = 0.0
    if at is not None:
        point, hdg = fitted.frame(s)
        t = float((at[:2] - point) @ np.array([-math.sin(hdg), math.cos(hdg)]))
        z = max(0.0, float(at[2]) - _surface_height(things, place.road, s))
    value = parts.get("value")
    return Signal(
        id=identity,
        s=s,
        t=t,
        z_offset=z,
        h_offset=0.0,
        orientation="+" if place.along else "-",
        dynamic=bool(parts.get("dynamic", False)),
        value=float(value) if isinstance(value, int | float) else None,
        name=str(parts.get("name", "")),
        country=str(parts.get("country", "")),
        type=str(parts.get("type", "")),
        subtype=str(parts.get("subtype", "")),
        unit=str(parts.get("unit", "")),
        text="",
        width=None,
        height=None,
        validities=(Validity(place.lane, place.lane),),
    )


def _surface_height(things: Furniture, road: RoadId, s: float) -> float:
    records = [r for r in things.built.roads[road].road.elevation if r.s <= s + 1e-9]
    if not records:
        return 0.0
    ds = s - records[-1].s
    _, a, b, c, d = records[-1]
    return a + ds * (b + ds * (c + ds * d))


def _add_lights(things: Furniture, lines: dict[str, tuple[RoadId, float]]) -> dict[str, Controller]:
    """Lights, and a controller for those that show the same."""
    controllers: dict[str, Controller] = {}
    in_junction: dict[JunctionId, list[str]] = defaultdict(list)
    head_of: dict[str, str] = {}
    for element in things.source.regulatory.values():
        if element.subtype != "traffic_light":
            continue
        heads = [way for kind, way in element.members.get("refers", ()) if kind == "way"]
        acts: list[tuple[LanePlace, float]] = []
        crossed = []
        for lanelet in _lanelets_with(things, element):
            if lanelet in things.source.lanelets and lanelet in things.built.places:
                acts += _find_stop_places(things, lanelet, lines, element)
            else:
                crossed.append(lanelet)
        path = f"regulatory element {shown_id(element.id)}"
        if not acts:
            reason = "a traffic light that no lanelet for vehicles names"
            things.report(ElementOutcome.LOST, path, reason, element.id)
            continue
        controls = []
        for head in heads or [element.id]:
            nodes = things.source.ways.get(head, ())
            at = things.source.line(nodes).mean(axis=0) if nodes else None
            place, s = acts[0]
            if head not in things.signal_ids:
                signal = _signal_on(
                    things,
                    place,
                    s,
                    head,
                    at,
                    name="traffic light",
                    dynamic=True,
                    country="OpenDRIVE",
                    type="1000001",
                    subtype="-1",
                )
                things.signals[place.road].append(signal)
                things.signal_ids.add(head)
                controls.append(head)
                others = acts[1:]
            else:
                others = acts
            # The first head stands for all of them on the other lanes.
            if head == (heads or [element.id])[0]:
                _refer_to_head(things, head, others)
        name = head_of.get((heads or [element.id])[0])
        if controls and name is None:
            name = element.id
            controllers[name] = Controller(
                name, f"traffic light {element.id}", None, tuple((head, "0") for head in controls)
            )
        elif controls and name is not None:
            known = controllers[name]
            more = (*known.controls, *((head, "0") for head in controls))
            controllers[name] = replace(known, controls=more)
        for head in heads or [element.id]:
            head_of.setdefault(head, str(name))
        for junction in _junctions_of(things, [place for place, _ in acts]):
            if name is not None and name not in in_junction[junction]:
                in_junction[junction].append(name)
        lanes = sorted({f"road {p.road} lane {p.lane}" for p, _ in acts})
        things.report(
            ElementOutcome.KEPT,
            f"controller {shown_id(str(name))}",
            f"a traffic light for {', '.join(lanes[:6])}"
            + (" and others" if len(lanes) > 6 else "")
            + (f"; not for the crosswalks {', '.join(crossed)}" if crossed else ""),
            element.id,
        )
    for junction, names in in_junction.items():
        built = things.built.junctions[junction]
        things.built.junctions[junction] = replace(built, controllers=tuple(names))
    return controllers


def _refer_to_head(things: Furniture, head: str, acts: Sequence[tuple[LanePlace, float]]) -> None:
    for place, s in acts:
        things.references[place.road].append(
            SignalReference(
                head,
                s,
                0.0,
                "+" if place.along else "-",
                (Validity(place.lane, place.lane),),
            )
        )


def _junctions_of(things: Furniture, places: Iterable[LanePlace]) -> list[JunctionId]:
    found = []
    for place in places:
        road = things.built.roads[place.road].road
        link = road.successor if place.along else road.predecessor
        if road.junction is not None:
            found.append(road.junction)
        elif link is not None and link.element_type == "junction":
            found.append(JunctionId(link.element_id))
    return list(dict.fromkeys(found))


def _sign_code(things: Furniture, way: str, element: RegulatoryElement) -> tuple[str, str, str]:
    """Country, type and subtype of a sign by the tags of its way."""
    tags = things.source.way_tags.get(way, {})
    text = (tags.get("subtype") or element.tags.get("sign_type") or "").lower()
    if text in _SIGNS:
        return "DE", _SIGNS[text], "-1"
    match = _CODE.fullmatch(text)
    if match is not None:
        return match[1].upper(), match[2], match[3] or "-1"
    return "OpenDRIVE", text or "-1", "-1"


def _add_sign(
    things: Furniture, way: str, element: RegulatoryElement, place: LanePlace, s: float
) -> str:
    """Put up a sign, or let one that is there act here too; gives its path for the report."""
    if way in things.signal_ids:
        _refer_to_head(things, way, [(place, s)])
        return f"road {place.road} > signalReference {shown_id(way)}"
    country, code, subtype = _sign_code(things, way, element)
    nodes = things.source.ways.get(way, ())
    at = things.source.line(nodes).mean(axis=0) if nodes else None
    speed = read_sign_speed(things.source, element.tags, element.members)
    value = speed if code.startswith("274") else None
    things.signals[place.road].append(
        _signal_on(
            things,
            place,
            s,
            way,
            at,
            name="",
            country=country,
            type=code,
            subtype=subtype,
            value=value,
            unit="m/s" if value is not None else "",
        )
    )
    things.signal_ids.add(way)
    return f"road {place.road} > signal {shown_id(way)}"


def _add_right_of_way(things: Furniture) -> None:
    """Right of way of lanelets as priorities of connecting roads, and its signs."""
    priorities: dict[JunctionId, dict[JunctionPriority, None]] = defaultdict(dict)
    for element in things.source.regulatory.values():
        if element.subtype not in ("right_of_way", "all_way_stop"):
            continue
        path = f"regulatory element {shown_id(element.id)}"
        roles = {
            role: [ref for _, ref in element.members.get(role, ())]
            for role in ("right_of_way", "yield")
        }
        if element.subtype == "all_way_stop":
            roles["yield"] = _lanelets_with(things, element)
        inside = {
            role: {r for ref in refs for r in _connecting_roads(things, ref)}
            for role, refs in roles.items()
        }
        count = 0
        for high in sorted(inside["right_of_way"], key=int):
            for low in sorted(inside["yield"] - inside["right_of_way"], key=int):
                junction = things.built.roads[high].road.junction
                if junction is not None and junction == things.built.roads[low].road.junction:
                    priorities[junction][JunctionPriority(high, low)] = None
                    count += 1
        signs = []
        for _, way in element.members.get("refers", ()):
            _, code, _ = _sign_code(things, way, element)
            refs = roles["yield"] if code in _YIELDING else roles["right_of_way"]
            place = _nearest_place(things, way, refs or roles["yield"] or roles["right_of_way"])
            if place is None:
                things.report(
                    ElementOutcome.LOST,
                    f"line {shown_id(way)}",
                    f"a sign {shown(code)} of {path} with no lanelet of it on a road",
                    way,
                )
                continue
            where, s = place
            signs.append(_add_sign(things, way, element, where, s))
            things.report(ElementOutcome.KEPT, signs[-1], f"a sign {code}", way)
        missing = [ref for refs in roles.values() for ref in refs if ref not in things.built.places]
        meaning = (
            f"right of way of {len(roles['right_of_way'])} lanelets over {len(roles['yield'])}"
        )
        if not count and not signs:
            things.report(
                ElementOutcome.LOST,
                path,
                f"{meaning}: they do not meet in one junction, and it has no sign",
                element.id,
            )
            continue
        things.report(
            ElementOutcome.KEPT,
            path,
            f"{meaning}: {count} priorities of connecting roads, {len(signs)} signs"
            + (f"; without {', '.join(missing)}, which are not on roads" if missing else ""),
            element.id,
        )
    for junction, found in priorities.items():
        # What each of two has over the other is no rule.
        kept = [row for row in found if JunctionPriority(row.low, row.high) not in found]
        built = things.built.junctions[junction]
        things.built.junctions[junction] = replace(built, priorities=tuple(kept))


def _connecting_roads(things: Furniture, lanelet: str) -> list[RoadId]:
    """Connecting roads that a lanelet is on, or else those that begin where it leads."""
    places = things.built.places.get(lanelet, [])
    inside = [p.road for p in places if things.built.roads[p.road].road.junction is not None]
    if inside or not places:
        return inside
    last = places[-1]
    contact = "end" if last.along else "start"
    return [
        road
        for junction in _junctions_of(things, [last])
        for row in things.built.junctions[junction].connections
        if row.incoming_road == last.road and any(a == last.lane for a, _ in row.lane_links)
        for road in [row.connecting_road]
        if (link := things.built.roads[road].road.predecessor) and link.contact_point == contact
    ]


def _nearest_place(
    things: Furniture, way: str, lanelets: Sequence[str]
) -> tuple[LanePlace, float] | None:
    """The end of a lanelet that a sign is nearest to."""
    nodes = things.source.ways.get(way, ())
    at = things.source.line(nodes).mean(axis=0)[:2] if nodes else None
    best: tuple[float, LanePlace, float] | None = None
    for lanelet in lanelets:
        places = things.built.places.get(lanelet, [])
        if not places:
            continue
        last = places[-1]
        s = max(last.start, last.end - 0.5) if last.along else min(last.end, last.start + 0.5)
        if things.built.roads[last.road].road.junction is not None:
            s = min(0.5, last.end)
        point, _ = things.built.roads[last.road].fitted.frame(s)
        apart = float(np.hypot(*(point - at))) if at is not None else 0.0
        if best is None or apart < best[0]:
            best = apart, last, s
    return None if best is None else best[1:]


def _add_other_elements(things: Furniture, lines: dict[str, tuple[RoadId, float]]) -> None:
    """Speed limits and signs of other kinds; the rest is listed."""
    for element in things.source.regulatory.values():
        if element.subtype in ("traffic_light", "right_of_way", "all_way_stop"):
            continue
        path = f"regulatory element {shown_id(element.id)}"
        lanelets = [n for n in _lanelets_with(things, element) if n in things.built.places]
        if element.subtype in ("speed_limit", "digital_speed_limit", "traffic_sign"):
            speed = read_sign_speed(things.source, element.tags, element.members)
            is_limit = element.subtype != "traffic_sign"
            if is_limit and (speed is None or not lanelets):
                reason = "no lanelet for vehicles names it" if speed else "its limit cannot be read"
                things.report(ElementOutcome.LOST, path, f"a speed limit: {reason}", element.id)
                continue
            signs = []
            for _, way in element.members.get("refers", ()):
                place = None
                for _, line in element.members.get("ref_line", ()):
                    if line in lines:
                        place = _place_at(things, *lines[line])
                place = place or _nearest_place(things, way, lanelets)
                if place is not None:
                    signs.append(_add_sign(things, way, element, *place))
            if is_limit:
                limit = f"{3.6 * (speed or 0.0):.6g} km/h on the lanelets {', '.join(lanelets)}"
                things.report(ElementOutcome.KEPT, path, f"a speed limit: {limit}", element.id)
            elif signs:
                things.report(ElementOutcome.KEPT, signs[0], "a traffic sign", element.id)
            else:
                things.report(
                    ElementOutcome.LOST,
                    path,
                    "a traffic sign that neither a lanelet nor a line on a road names",
                    element.id,
                )
            continue
        things.report(
            ElementOutcome.LOST,
            path,
            f"a regulatory element of the subtype {shown(element.subtype)}: OpenDRIVE has none",
            element.id,
        )


def _place_at(things: Furniture, road: RoadId, s: float) -> tuple[LanePlace, float] | None:
    """The lane that leads along a stop line's road at its s."""
    line = [
        item
        for item in things.objects[road]
        if item.name == "stopLine" and abs(item.s - s) < 1e-9 and item.validities
    ]
    lane = line[0].validities[0].from_lane if line else None
    for places in things.built.places.values():
        for place in places:
            if place.road == road and place.lane == lane and place.start <= s <= place.end + 1e-6:
                return place, s
    return None


# ----------------------------------------------------------------------------- areas
def _add_areas(things: Furniture) -> None:
    """Areas, and what ways draw: parking spaces, polygons."""
    for area in things.source.areas:
        kind = _AREAS.get(area.subtype)
        ring = things.source.line(area.ring)
        if kind is None:
            things.report(
                ElementOutcome.LOST,
                f"area {shown_id(area.id)}",
                f"an area of the subtype {shown(area.subtype)}: OpenDRIVE has none",
                area.id,
            )
            continue
        shape = shapely.Polygon(ring[:, :2]).buffer(0.0)
        road = things.road_under(shape, _AREA_NEAR)
        if road is None:
            reason = f"an area with no road within {_AREA_NEAR:g} m"
            things.report(ElementOutcome.LOST, f"area {shown_id(area.id)}", reason, area.id)
            continue
        item = _place_outline(things, road, ring, kind, area.subtype, area.id)
        things.objects[road].append(item)
        things.report(
            ElementOutcome.KEPT,
            f"road {road} > object {shown_id(area.id)}",
            f"an area: {area.subtype.replace('_', ' ')}",
            area.id,
        )
    for way, tags in things.source.way_tags.items():
        kind = tags.get("type", "")
        nodes = things.source.ways.get(way, ())
        if kind == "parking_space" and len(set(nodes)) >= 2:
            width = _read_positive(tags.get("width", ""))
            line = things.source.line(nodes)
            ahead = line[-1, :2] - line[0, :2]
            side = np.array([-ahead[1], ahead[0]]) / max(float(np.hypot(*ahead)), 1e-9)
            half = 0.5 * (width or 2.5) * side
            start, end = line[0, :2], line[-1, :2]
            ring = np.array([start - half, end - half, end + half, start + half])
            road = things.road_under(shapely.Polygon(ring), _AREA_NEAR)
            if road is not None:
                item = _place_outline(things, road, ring, "parkingSpace", "parking space", way)
                things.objects[road].append(item)
                things.report(
                    ElementOutcome.KEPT if width else ElementOutcome.GUESSED,
                    f"road {road} > object {shown_id(way)}",
                    "a parking space" if width else "a parking space, 2.5 m wide as none is given",
                    way,
                    None if width else 0.6,
                )
                continue
        if tags.get("area") == "yes" or kind == "parking_space" or kind.endswith("_area"):
            things.report(
                ElementOutcome.LOST,
                f"line {shown_id(way)}",
                f"a polygon of the type {shown(kind)}: nothing of OpenDRIVE says the same",
                way,
            )


def _read_positive(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) and value > 0.0 else None
