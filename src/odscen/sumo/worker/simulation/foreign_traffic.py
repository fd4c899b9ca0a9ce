"""Road users that another program drives, and traffic lights that it switches.

SUMO's traffic sees them, and nothing of SUMO's moves them. The road users are none of the
scenario's: they are in no recording, table or count of the run, but a collision with one of them
is an event.
"""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from odscen.convert.lane_table.light_heads import UNKNOWN
from odscen.sumo.worker.protocol import EgoPose

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from odscen.sumo.worker.protocol import ForeignUser


class PlaceVehicle(Protocol):
    """Puts a vehicle somewhere; false if it cannot."""

    def __call__(self, vehicle: str, at: EgoPose, *, again: bool = False) -> bool:
        """Put it there; ``again`` if that was done before."""


PREFIX = "carla:"
"""Beginning of their ids; no id of a scenario's has a colon."""
_PEDESTRIAN = "pedestrian"
_FAST = 200.0
"""m/s; no limit of a model, for one whose speed is set."""
_OFF_ROUTE = 6
"""``keepRoute`` of persons that drivers see: exactly there, off their route as well."""
_NEAR = 10.0
"""Metres around a place in which SUMO looks for its lane."""
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
    """

    def __init__(self, sumo: Any, errors: tuple[type[Exception], ...], place: PlaceVehicle) -> None:
        self._sumo = sumo
        self._errors = errors
        self._place = place
        self._known: dict[str, bool] = {}

    def __len__(self) -> int:
        """How many there are."""
        return len(self._known)

    def show(self, users: Iterable[ForeignUser]) -> None:
        """Put all of them where they are; those that are not named any more are taken out.

        A person can only be where people may walk on the nearest edge; others are left out.
        """
        named = {PREFIX + user.id: user for user in users}
        for name in [name for name in self._known if name not in named]:
            self._take_out(name)
        for name, user in named.items():
            if name in self._known and self._move_user(name, user, again=True):
                continue
            self._take_out(name)
            if self._add_user(name, user):
                self._known[name] = user.kind == _PEDESTRIAN
                self._move_user(name, user)

    def _add_user(self, name: str, user: ForeignUser) -> bool:
        sumo, kind = self._sumo, self._type_for(user)
        try:
            if user.kind == _PEDESTRIAN:
                edge, pos, _ = sumo.simulation.convertRoad(user.x, user.y, False, _PEDESTRIAN)
                sumo.person.add(name, edge, pos, typeID=kind)
                sumo.person.appendWalkingStage(name, [edge], pos)
            else:
                sumo.vehicle.add(name, "", kind)
        except self._errors:
            return False
        return True

    def _type_for(self, user: ForeignUser) -> str:
        """Id of the type of such a body, which is made if there is none."""
        types = self._sumo.vehicletype
        name = f"{PREFIX}{user.kind} {user.length:.2f} {user.width:.2f}"
        if name not in types.getIDList():
            on_foot = user.kind == _PEDESTRIAN
            types.copy("DEFAULT_PEDTYPE" if on_foot else "DEFAULT_VEHTYPE", name)
            types.setVehicleClass(name, user.kind)
            types.setLength(name, user.length)
            types.setWidth(name, user.width)
            types.setMaxSpeed(name, _FAST)
            for device in _DEVICES:
                types.setParameter(name, f"has.{device}.device", "false")
        return name

    def _move_user(self, name: str, user: ForeignUser, *, again: bool = False) -> bool:
        if not self._known[name]:
            at = EgoPose(user.x, user.y, user.angle_deg, user.speed)
            return self._place(name, at, again=again)
        try:
            self._sumo.person.moveToXY(name, "", user.x, user.y, user.angle_deg, _OFF_ROUTE, _NEAR)
        except self._errors:
            return False
        return True

    def _take_out(self, name: str) -> None:
        person = self._known.pop(name, None)
        if person is None:
            return
        with suppress(*self._errors):
            if person:
                self._sumo.person.removeStages(name)
            else:
                self._sumo.vehicle.remove(name, self._sumo.REMOVE_VAPORIZED)


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
