"""Checks of a car and a walker: where they may be made, where they are put, what they report."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from odscen.base.errors import CarlaError
from odscen.carla.selfcheck.check_line import judged
from odscen.carla.server.batch import (
    BRAKE,
    LIFTS,
    LOW_BEAM,
    ROLE,
    ActorPlace,
    Batch,
    Move,
    Spawn,
    SwitchLights,
    Velocity,
)
from odscen.carla.server.client import answering

if TYPE_CHECKING:
    from odscen.carla.selfcheck.check_line import CheckLimits, CheckLine
    from odscen.carla.server.blueprints import Shape
    from odscen.carla.server.carla_server import Server

GROUND = "ground below places"
CAR_LIFT, WALKER_LIFT = "height at which a car is made", "height at which a walker is made"
CAR_PLACE, CAR_HEIGHT = "place of a car", "height of a car"
CAR_PITCH = "pitch of a car"
STILL_SPEED, LAMPS = "speed reported without physics", "lights of a car"
SENSED_PLACE, SENSED_SPEED = "place with --sensed-speed", "speed with --sensed-speed"
FEET, DRIFT = "feet of a walker", "walk of a walker"
LIFT_NAMES = (CAR_LIFT, WALKER_LIFT)
CAR_NAMES = (CAR_PLACE, CAR_HEIGHT, CAR_PITCH, STILL_SPEED, LAMPS)
SENSED_NAMES = (SENSED_PLACE, SENSED_SPEED)
WALKER_NAMES = (FEET, DRIFT)
BODY_NAMES = (*LIFT_NAMES, *CAR_NAMES, *SENSED_NAMES, *WALKER_NAMES)
"""In the order in which they are checked."""
TRIED = (0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.6, 1.2)
"""Metres above the ground at which bodies are tried."""
TILT = 4.0
"""Degrees by which the car is tilted: a slope of 7 %."""
SPEED, WALK = 10.0, 1.4
"""m/s of the car and of the walker."""
_NAME = ROLE + "selfcheck"
_PLACES = 10
"""Places at which the ground is looked at."""
_REACH = 5.0
"""Metres below a place in which the ground is looked for."""
_ROOM = 15.0
"""Metres around a place in which others must not be."""
_STILL = Velocity(0.0, 0.0, 0.0)


def usual_car(server: Server) -> str:
    """Blueprint of a car: the one that most people know, if it is there.

    Raises
    ------
    CarlaError
        If the server has none.
    """
    described = server.describe(("vehicle.",))
    cars = [
        name for name, attributes in described.items() if attributes.get("number_of_wheels") == "4"
    ]
    known = [name for name in cars if name == "vehicle.tesla.model3"]
    return _first_name(known or sorted(cars), "car")


def usual_walker(server: Server) -> str:
    """Blueprint of a pedestrian.

    Raises
    ------
    CarlaError
        If the server has none.
    """
    return _first_name(sorted(server.describe(("walker.pedestrian.",))), "pedestrian")


def _first_name(names: list[str], what: str) -> str:
    if not names:
        raise CarlaError(f"the CARLA server has no blueprint of a {what}")
    return names[0]


@dataclass(slots=True)
class BodyChecks:
    """The checks, on one car and one walker where nobody else is.

    Attributes
    ----------
    delta
        Seconds of a tick.
    """

    server: Server
    limits: CheckLimits
    delta: float
    _car_at: ActorPlace = field(init=False)
    _walker_at: ActorPlace = field(init=False)
    _car: str = field(init=False)
    _walker: str = field(init=False)
    _shapes: dict[str, Shape] = field(init=False)

    def prepare(self) -> list[CheckLine]:
        """Look for two places, and at the ground below all.

        Raises
        ------
        CarlaError
            If the map has no places for vehicles, or the server no models.
        """
        server = self.server
        places = self._free_places(server.spawn_places())
        if not places:
            raise CarlaError(f"the map {server.map_name} has no free place for vehicles")
        off = []
        for place in places[:_PLACES]:
            ground = server.ground_below(*_point_above(place), _REACH)
            surface = server.lane_place(place)
            if ground is not None and surface is not None:
                off.append(abs(ground - surface.z))
        self._car_at = self._place_on_ground(places[0], server.lane_place(places[0]))
        beside = server.lane_place(places[0], sidewalk=True) or _place_ahead(
            self._car_at, 2 * _ROOM
        )
        self._walker_at = self._place_on_ground(beside, beside)
        self._car, self._walker = usual_car(server), usual_walker(server)
        self._shapes = server.shapes((self._car, self._walker))
        looked = min(len(places), _PLACES)
        worst = max(off, default=math.nan)
        return [
            judged(
                GROUND,
                f"found, at most {self.limits.ground:g} m off the map's surface",
                f"found at {len(off)} of {looked} places; at most {worst:.3f} m off",
                ok=len(off) == looked and worst <= self.limits.ground,
                note="pedestrians are put on it; where none is found, on the map's surface",
            )
        ]

    def lifts(self) -> list[CheckLine]:
        """How high above the ground bodies must be made."""
        shape = self._find_shape(self._walker)
        middle = shape.extent[2] - shape.centre[2]
        return [
            self._lift_line(CAR_LIFT, self._car, self._car_at, 0.0),
            self._lift_line(WALKER_LIFT, self._walker, self._walker_at, middle),
        ]

    def car(self) -> list[CheckLine]:
        """A car without physics, put elsewhere in each tick."""
        actor = self._spawn_body(self._car, self._car_at, walks=False)
        wanted = self._move_forward(actor)
        seen, speed = self.server.place(actor), self._speed_of(actor)  # before another tick
        self.server.apply(Batch(shine=(SwitchLights(actor, BRAKE | LOW_BEAM),)))
        with answering(self.server.address):
            (handle,) = self.server.actors([actor])
            lamps = int(handle.get_light_state())
        pitch = self._tilt_car(actor, wanted)
        self._remove_body(actor)
        turn = abs((seen.yaw - wanted.yaw + 180.0) % 360.0 - 180.0)
        off = math.hypot(seen.x - wanted.x, seen.y - wanted.y)
        up = seen.z - wanted.z
        limits = self.limits
        return [
            judged(
                CAR_PLACE,
                f"within {limits.place:g} m and {limits.heading:g} degrees of where it is put",
                f"{off:.4f} m, {turn:.3f} degrees off",
                ok=off <= limits.place and turn <= limits.heading,
            ),
            judged(
                CAR_HEIGHT,
                f"within {limits.place:g} m of where it is put",
                f"{up:+.4f} m",
                ok=abs(up) <= limits.place,
            ),
            judged(
                CAR_PITCH,
                f"within {limits.heading:g} degrees of {TILT:g} degrees, to which it is tilted",
                f"{pitch:.3f} degrees",
                ok=abs(pitch - TILT) <= limits.heading,
            ),
            judged(
                STILL_SPEED,
                "0 m/s",
                f"{speed:.2f} m/s at {SPEED:g} m/s from place to place",
                ok=speed <= limits.speed,
                note="if it were the true speed, --sensed-speed would not be needed",
            ),
            judged(
                LAMPS,
                f"{BRAKE | LOW_BEAM} (brake, low beam)",
                str(lamps),
                ok=lamps == BRAKE | LOW_BEAM,
            ),
        ]

    def sensed(self) -> list[CheckLine]:
        """A car with physics and without gravity, that goes the last of each step by itself."""
        self.server.synchronize(self.delta, sensed_speed=True)
        try:
            actor = self._spawn_body(self._car, self._car_at, walks=False)
            wanted = self._move_forward(actor)
            seen, speed = self.server.place(actor), self._speed_of(actor)
            self._remove_body(actor)
        finally:
            self.server.synchronize(self.delta)
        off = math.dist(seen[:3], wanted[:3])
        limits = self.limits
        return [
            judged(
                SENSED_PLACE,
                f"within {limits.place:g} m of where it is to be",
                f"{off:.4f} m off, of that {seen.z - wanted.z:+.4f} m up",
                ok=off <= limits.place,
            ),
            judged(
                SENSED_SPEED,
                f"{SPEED:g} m/s, within {limits.speed:g}",
                f"{speed:.2f} m/s",
                ok=abs(speed - SPEED) <= limits.speed,
            ),
        ]

    def walker(self) -> list[CheckLine]:
        """A walker that is put a step further in each tick."""
        first = self._walker_at
        path = [_place_ahead(first, WALK * self.delta * k) for k in (1, 2)]
        path = [self._place_on_ground(at, at) for at in path]  # asked now: later it is in between
        actor = self._spawn_body(self._walker, first, walks=True)
        for at in path:
            self.server.apply(Batch(move=(Move(actor, at, _STILL, WALK, True),)))
        seen, shape = self.server.place(actor), self.server.shape(actor)
        self._remove_body(actor)
        feet = seen.z + shape.centre[2] - shape.extent[2] - path[-1].z
        off = math.hypot(seen.x - path[-1].x, seen.y - path[-1].y)
        limits = self.limits
        return [
            judged(
                FEET,
                f"on the ground, within {limits.feet:g} m",
                f"{feet:+.3f} m",
                ok=abs(feet) <= limits.feet,
                note="the server is taken to add half of a walker's height to where it is put",
            ),
            judged(
                DRIFT,
                f"within {limits.feet:g} m of where it is put",
                f"{off:.4f} m off at {WALK:g} m/s",
                ok=off <= limits.feet,
                note="whether the animation moves it as well",
            ),
        ]

    def _lift_line(self, name: str, blueprint: str, at: ActorPlace, height: float) -> CheckLine:
        taken, refused = [], []
        for lift in TRIED:
            place = (at.x, at.y, at.z + height + lift)
            command = self.server.spawn_command(blueprint, _NAME, place, yaw=at.yaw)
            (answer,) = self.server.spawn([command])
            if isinstance(answer, int):
                taken.append(lift)
                self._remove_body(answer)
            else:
                refused.append(lift)
        seen = f"refused at {_list_lifts(refused)}; taken at {_list_lifts(taken)}"
        return judged(
            name,
            f"taken {LIFTS[0]:g} m above the ground",
            seen,
            ok=LIFTS[0] in taken,
            note=f"tried at {_list_lifts(list(LIFTS))} above the ground",
        )

    def _spawn_body(self, blueprint: str, at: ActorPlace, *, walks: bool) -> int:
        shape = self._find_shape(blueprint)
        lift = LIFTS[0] + (shape.extent[2] - shape.centre[2] if walks else 0.0)
        spawn = Spawn(blueprint, _NAME, at, _STILL, 0.0, walks, lift, 0)
        (answer,) = self.server.apply(Batch(spawn=(spawn,)))
        if not isinstance(answer, int):
            raise CarlaError(
                f"the server refused {blueprint} {lift:g} m above the ground: {answer}"
            )
        return answer

    def _find_shape(self, blueprint: str) -> Shape:
        shape = self._shapes.get(blueprint)
        if shape is None:
            raise CarlaError(f"the server refused {blueprint} where nothing is, to be measured")
        return shape

    def _move_forward(self, actor: int) -> ActorPlace:
        """Put a car forward in two ticks; where it is to be then."""
        at = self._car_at
        ahead = Velocity(
            SPEED * math.cos(math.radians(at.yaw)), SPEED * math.sin(math.radians(at.yaw)), 0.0
        )
        for _ in range(2):
            at = _place_ahead(at, SPEED * self.delta)
            self.server.apply(Batch(move=(Move(actor, at, ahead, SPEED, False),)))
        return at

    def _tilt_car(self, actor: int, at: ActorPlace) -> float:
        """Tilt a car where it stands, for two ticks; its pitch then, degrees."""
        for _ in range(2):
            self.server.apply(
                Batch(move=(Move(actor, at._replace(pitch=TILT), _STILL, 0.0, False),))
            )
        return self.server.place(actor).pitch

    def _remove_body(self, actor: int) -> None:
        self.server.destroy([actor])
        self.server.tick()

    def _speed_of(self, actor: int) -> float:
        velocity = self.server.world.get_snapshot().find(actor).get_velocity()
        return math.hypot(velocity.x, velocity.y, velocity.z)

    def _place_on_ground(self, at: ActorPlace, surface: ActorPlace | None) -> ActorPlace:
        """The same place on the server's ground, or else on the map's surface."""
        ground = self.server.ground_below(*_point_above(at), _REACH)
        if ground is None:
            ground = at.z if surface is None else surface.z
        return ActorPlace(at.x, at.y, ground, 0.0, at.yaw)

    def _free_places(self, places: list[ActorPlace]) -> list[ActorPlace]:
        """Places with nobody near."""
        with answering(self.server.address):
            actors = self.server.world.get_actors()
            others = [*actors.filter("vehicle.*"), *actors.filter("walker.*")]
            at = [actor.get_location() for actor in others]
        return [
            place
            for place in places
            if all(math.hypot(place.x - taken.x, place.y - taken.y) > _ROOM for taken in at)
        ]


def _point_above(at: ActorPlace) -> tuple[float, float, float]:
    return at.x, at.y, at.z + 1.0


def _place_ahead(at: ActorPlace, metres: float) -> ActorPlace:
    yaw = math.radians(at.yaw)
    return at._replace(x=at.x + metres * math.cos(yaw), y=at.y + metres * math.sin(yaw))


def _list_lifts(lifts: list[float]) -> str:
    return ", ".join(f"{lift:g}" for lift in lifts) + " m" if lifts else "none"
