"""Road users that another program drives, and traffic lights that it switches.

SUMO's traffic sees them, and nothing of SUMO's moves them. The road users are none of the
scenario's: they are in no recording, table or count of the run, but a collision with one of them
is an event.
"""

from __future__ import annotations

import math
from contextlib import suppress
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from odscen.convert.lane_table.light_heads import UNKNOWN
from odscen.sumo.worker.protocol import EgoPose

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from odscen.sumo.worker.protocol import ForeignUser
    from odscen.sumo.worker.simulation.road_lanes import RoadLanes


class PlaceVehicle(Protocol):
    """Puts a vehicle somewhere; false if it cannot."""

    def __call__(self, vehicle: str, at: EgoPose, *, again: bool = False) -> bool:
        """Put it there; ``again`` if that was done before."""


PREFIX = "carla:"
"""Beginning of their ids; no id of a scenario's has a colon."""
_PEDESTRIAN = "pedestrian"
_FAST = 200.0
"""m/s; no limit of a model, for one whose speed is set."""
_DRIVER = "passenger"
"""Class whose lanes are those on which drivers brake for who is on foot."""
_BY_THE_END = 0.01
"""Metres to an end of a lane, over which somebody may be."""
_FARTHEST = 1e7
"""Metres, and more than any angle or speed: nobody is farther from a map."""
_GOING = ("G", "g", "y", "Y")
"""Letters of links that vehicles may be on."""
_DEVICES = ("fcd", "tripinfo", "ssm", "emissions", "rerouting", "friction", "stationfinder")
"""Devices of SUMO's that none of them has."""


def is_foreign(name: str) -> bool:
    """Whether an id is one of theirs."""
    return name.startswith(PREFIX)


class ForeignTraffic:
    """Those that SUMO knows of.

    Parameters
    ----------
    sumo, errors
        libsumo, and what it raises.
    place
        Puts a vehicle somewhere, as :meth:`odscen.sumo.worker.simulation.session.Session.place`.
    lanes
        Those of the network.
    """

    def __init__(
        self,
        sumo: Any,
        errors: tuple[type[Exception], ...],
        place: PlaceVehicle,
        lanes: RoadLanes,
    ) -> None:
        self._sumo = sumo
        self._errors = errors
        self._place = place
        self._lanes = lanes
        self._known: set[str] = set()

    def __len__(self) -> int:
        """How many there are."""
        return len(self._known)

    def show(self, users: Iterable[ForeignUser]) -> None:
        """Put those where they are whose front is on a lane, and take all others out.

        SUMO's drivers see nobody elsewhere, and SUMO ends in a fault where one is placed off the
        road at first, or comes off it at some places, or is at a number that is none. Who is on
        foot is a short vehicle: SUMO ends in a fault, too, where its own persons are moved from a
        crossing, and so drivers see them inside junctions as well.
        """
        named = {PREFIX + user.id: user for user in users if self._is_on_a_lane(user)}
        for name in [name for name in self._known if name not in named]:
            self._take_out(name)
        for name, user in named.items():
            at = EgoPose(user.x, user.y, user.angle_deg, user.speed)
            if name in self._known and self._place(name, at, again=True):
                continue
            self._take_out(name)
            if self._add_user(name, user):
                self._known.add(name)
                self._place(name, at)

    def _is_on_a_lane(self, user: ForeignUser) -> bool:
        """Whether the middle of a front is on a lane of its class, drivers' lanes if on foot."""
        if not _has_a_place(user):
            return False
        simulation, lanes = self._sumo.simulation, self._sumo.lane
        kind = _DRIVER if user.kind == _PEDESTRIAN else user.kind
        try:
            edge, pos, index = simulation.convertRoad(user.x, user.y, False, kind)
            x, y = simulation.convert2D(edge, pos, index)
        except self._errors:  # no lane is near
            return False
        lane = self._lanes.in_order(edge)[index]
        if not _BY_THE_END <= pos <= lanes.getLength(lane) - _BY_THE_END:
            return False
        width: float = lanes.getWidth(lane)
        return math.dist((user.x, user.y), (x, y)) <= width / 2.0

    def _add_user(self, name: str, user: ForeignUser) -> bool:
        try:
            self._sumo.vehicle.add(name, "", self._type_for(user))
        except self._errors:
            return False
        return True

    def _type_for(self, user: ForeignUser) -> str:
        """Id of the type of such a body, which is made if there is none."""
        types = self._sumo.vehicletype
        name = f"{PREFIX}{user.kind} {user.length:.2f} {user.width:.2f}"
        if name not in types.getIDList():
            types.copy("DEFAULT_VEHTYPE", name)
            types.setVehicleClass(name, _DRIVER if user.kind == _PEDESTRIAN else user.kind)
            types.setLength(name, user.length)
            types.setWidth(name, user.width)
            types.setMaxSpeed(name, _FAST)
            for device in _DEVICES:
                types.setParameter(name, f"has.{device}.device", "false")
        return name

    def _take_out(self, name: str) -> None:
        if name in self._known:
            self._known.remove(name)
            with suppress(*self._errors):
                self._sumo.vehicle.remove(name, self._sumo.REMOVE_VAPORIZED)


def _has_a_place(user: ForeignUser) -> bool:
    """Whether all that is said of one are numbers, and the place is one of this world."""
    values = (user.x, user.y, user.angle_deg, user.speed)
    return all(math.isfinite(value) and abs(value) <= _FARTHEST for value in values)


class _Links(NamedTuple):
    """Links of a traffic light: their letters of green, and which of them cross each one."""

    greens: str
    crossed: tuple[tuple[int, ...], ...]


class ForeignLights:
    """Traffic lights that another program switches; SUMO's own programs stop at the first word."""

    def __init__(self, sumo: Any) -> None:
        self._sumo = sumo
        self._links: dict[str, _Links] = {}

    def show(self, states: Mapping[str, str]) -> None:
        """Set lights, by SUMO id: a letter of ``GyroO`` for each link, ``-`` where it is unknown.

        A link to which SUMO's own program ever gives a green that yields (``g``) yields, whoever
        switches it. Where nothing is known, as of crossings for pedestrians, it is green while no
        link that crosses it may go.
        """
        for light, letters in states.items():
            links = self._links.get(light) or self._links.setdefault(light, self._links_of(light))
            shown = [
                links.greens[link] if letter == "G" else letter
                for link, letter in enumerate(letters)
            ]
            for link, letter in enumerate(letters):
                if letter == UNKNOWN:
                    busy = any(shown[other] in _GOING for other in links.crossed[link])
                    shown[link] = "r" if busy else "G"
            self._sumo.trafficlight.setRedYellowGreenState(light, "".join(shown))

    def _links_of(self, light: str) -> _Links:
        lights, foes = self._sumo.trafficlight, self._sumo.lane.getInternalFoes
        own = lights.getProgram(light)
        phases = [
            phase.state
            for logic in lights.getAllProgramLogics(light)
            if logic.programID == own
            for phase in logic.phases
        ]
        lanes = [
            {link[2] for link in links if link[2]} for links in lights.getControlledLinks(light)
        ]
        crossing = [{foe for lane in sorted(via) for foe in foes(lane)} for via in lanes]
        return _Links(
            "".join("g" if any(p[k] == "g" for p in phases) else "G" for k in range(len(lanes))),
            tuple(
                tuple(other for other, via in enumerate(lanes) if via & foes_of)
                for foes_of in crossing
            ),
        )
