"""The routes file: vTypes, then vehicles and persons by departure, as deterministic text."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING
from xml.sax.saxutils import quoteattr

from odscen.base.categories import Category
from odscen.records.run_plan import begin_area
from odscen.sumo.realize.driving import number
from odscen.sumo.realize.road_user import appears_at

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping, Sequence

    from odscen.sumo.realize.driving import Driver
    from odscen.sumo.realize.road_user import RoadUser, StopVisit
    from odscen.sumo.realize.route_planner import Route
    from odscen.sumo.realize.traffic_measures.breakdowns import Breakdown
    from odscen.sumo.realize.walk_planner import Walk


FAR = 1000.0
"""Metres of a lane from which the mean speed on it says nothing of its beginning."""


@dataclass(frozen=True, slots=True)
class HeldActor:
    """A road user that is not inserted before a rule says so: SUMO's words for its departure.

    ``attributes`` are those of ``<vehicle>`` or of ``<person>`` with its ``<walk>``; ``mostSpeed``
    is the highest ``departSpeed`` that SUMO takes.
    """

    edges: tuple[str, ...]
    attributes: Mapping[str, str]
    person: bool = False


class RoutesFile:
    """Collects vehicles and persons; equal vTypes are written once.

    Every road user that departs at 0 is inserted unconditionally: the scenario has checked that
    bodies do not overlap, and SUMO's own check, which asks for a full safe gap, would delay most of
    a dense standing crowd. Those who come later wait until SUMO finds room, but for those whom the
    story alone drives.

    Parameters
    ----------
    vehicle_parameters
        Of every vType of vehicles: key and value.
    held_back
        Ids of those that rules let appear: they are not in the file, but in ``held``.
    """

    def __init__(
        self,
        vehicle_parameters: Sequence[tuple[str, str]] = (),
        *,
        held_back: Collection[str] = (),
    ) -> None:
        self.held: dict[str, HeldActor] = {}
        self._held_back = held_back
        self._parameters = vehicle_parameters
        self._types: dict[tuple[tuple[str, str], ...], str] = {}
        self._counts: dict[str, int] = {}
        self._on_foot: set[str] = set()
        self._lines: list[tuple[float, str, list[str]]] = []
        self._breakdowns: list[str] = []

    def add_vehicle(
        self,
        user: RoadUser,
        driver: Driver,
        route: Route,
        *,
        bays: Collection[str] = (),
        speed: float = 0.0,
        most: float = math.inf,
        stretch: float = 0.0,
        looks_every: float | None = None,
    ) -> None:
        """Add a vehicle that drives ``route``.

        Parameters
        ----------
        bays
            Stops at which vehicles stand beside the lane.
        speed
            At departure, m/s, of one that does not enter from outside.
        most
            Highest speed at which SUMO lets it depart, m/s.
        stretch
            Length of the lane that it departs on, m.
        looks_every
            Seconds after which the driver looks for a quicker route again; ``None`` is never.
        """
        appears, held = appears_at(user), self.holds_back(user)
        begin = speed if held else min(speed, most)
        # A queue far ahead, on the same lane, slows nobody down where they drive in.
        entry = "max" if stretch > FAR and not held else "avg"
        attributes = [
            ("id", user.id),
            ("type", self._type_name(user.category.value, driver)),
            ("depart", number(appears)),
            ("departLane", str(route.depart_lane)),
            ("departPos", "stop" if user.begins else number(route.depart_pos, digits=4)),
            # That of the vehicles ahead: a free lane then takes what HCM gives it. With "max" a
            # lane of a motorway takes a tenth less at steps of 1 s.
            ("departSpeed", entry if user.entering else number(_round_speed_down(begin), digits=4)),
            ("departPosLat", number(route.depart_pos_lat, digits=4)),
            ("arrivalLane", "current" if route.arrival_lane is None else str(route.arrival_lane)),
            ("arrivalPos", number(route.arrival_pos, digits=4)),
            ("speedFactor", number(driver.speed_factor, digits=4)),
        ]
        if held:
            attributes.append(("mostSpeed", number(_round_speed_down(most), digits=4)))
            self.held[user.id] = HeldActor(tuple(route.edges), dict(attributes))
            return
        if user.depart == 0.0 or user.design.driver == "story":
            attributes.append(("insertionChecks", "none"))
        lines = [
            f"    <vehicle{_xml_attributes(attributes)}>",
            f'        <route edges="{" ".join(route.edges)}"/>',
            *_first_stay(user),
            *(_stop_element(visit, bay=visit.stop in bays) for visit in user.visits),
            *_last_stay(user),
            *_rerouting_parameters(looks_every),
            "    </vehicle>",
        ]
        self._lines.append((appears, user.id, lines))

    def holds_back(self, user: RoadUser) -> bool:
        """Whether a road user is not inserted before a rule says so."""
        return user.id in self._held_back

    def add_walk(self, user: RoadUser, driver: Driver, walk: Walk) -> None:
        """Add a person that walks ``walk``."""
        person = [
            ("id", user.id),
            ("type", self._type_name(user.category.value, driver)),
            ("depart", number(user.depart)),
            ("departPos", number(walk.depart_pos, digits=4)),
        ]
        stage = [
            ("edges", " ".join(walk.edges)),
            ("departPosLat", number(walk.depart_pos_lat, digits=4)),
            ("arrivalPos", number(walk.arrival_pos, digits=4)),
        ]
        if user.id in self._held_back:
            own = dict([*person, *stage[1:]])
            self.held[user.id] = HeldActor(tuple(walk.edges), own, person=True)
            return
        lines = [
            f"    <person{_xml_attributes(person)}>",
            f"        <walk{_xml_attributes(stage)}/>",
            "    </person>",
        ]
        self._lines.append((user.depart, user.id, lines))

    def add_breakdown(self, vehicle: Breakdown) -> None:
        """Add the vehicle of an incident."""
        self._breakdowns.append(vehicle.type_line())
        self._lines.append((vehicle.depart, vehicle.id, list(vehicle.lines())))

    def to_xml(self) -> str:
        """Text of ``routes.rou.xml``."""
        head = [
            line
            for attributes, name in self._types.items()
            for line in self._type_lines(name, attributes)
        ]
        head += self._breakdowns
        body = [line for _, _, lines in sorted(self._lines) for line in lines]
        return "\n".join(
            ['<?xml version="1.0" encoding="UTF-8"?>', "<routes>", *head, *body, "</routes>", ""]
        )

    def types_of(self, category: Category) -> tuple[str, ...]:
        """Ids of the vTypes of a category."""
        return tuple(f"{category.value}.{n}" for n in range(self._counts.get(category.value, 0)))

    def _type_lines(self, name: str, attributes: tuple[tuple[str, str], ...]) -> list[str]:
        start = f'    <vType id="{name}"{_xml_attributes(attributes)}'
        if not self._parameters or name in self._on_foot:
            return [f"{start}/>"]
        inside = [
            f"        <param{_xml_attributes([('key', key), ('value', value)])}/>"
            for key, value in self._parameters
        ]
        return [f"{start}>", *inside, "    </vType>"]

    def _type_name(self, category: str, driver: Driver) -> str:
        """Name of the vType with these attributes: category and a running number."""
        name = self._types.get(driver.attributes)
        if name is None:
            count = self._counts.get(category, 0)
            self._counts[category] = count + 1
            name = self._types[driver.attributes] = f"{category}.{count}"
            if category == Category.PEDESTRIAN:
                self._on_foot.add(name)
        return name


def _rerouting_parameters(period: float | None) -> list[str]:
    """Parameters of a vehicle with SUMO's rerouting device; they outlive a saved state."""
    if period is None:
        return []
    given = (("has.rerouting.device", "true"), ("device.rerouting.period", f"{period:g}"))
    return [
        f"        <param{_xml_attributes([('key', key), ('value', value)])}/>"
        for key, value in given
    ]


def _stop_element(visit: StopVisit, *, bay: bool) -> str:
    attributes = [("busStop", visit.stop), ("duration", number(visit.dwell))]
    if visit.scheduled is not None:
        attributes.append(("until", number(visit.scheduled)))
    if bay:
        attributes.append(("parking", "true"))
    return f"        <stop{_xml_attributes(attributes)}/>"


def _first_stay(user: RoadUser) -> list[str]:
    if user.begins is None:
        return []
    given = (
        ("parkingArea", begin_area(user.begins.area)),
        ("duration", "0"),
        ("until", number(user.depart)),
    )
    return [f"        <stop{_xml_attributes(given)}/>"]


def _last_stay(user: RoadUser) -> list[str]:
    if user.ends is None:
        return []
    given = (("parkingArea", user.ends.area), ("duration", number(user.ends.seconds)))
    return [f"        <stop{_xml_attributes(given)}/>"]


def _round_speed_down(speed: float) -> float:
    """Round down: SUMO ends a run in which a vehicle departs faster than its lane allows."""
    return math.floor(speed * 1e4) / 1e4


def _xml_attributes(attributes: Iterable[tuple[str, str]]) -> str:
    return "".join(f" {name}={quoteattr(value)}" for name, value in attributes)
