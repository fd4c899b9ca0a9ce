"""The road users of a plan with the bodies that they have on a CARLA server.

Which doors of vehicles near the ego are open: of those that stand at a stop.

Pure planning. On a server an open door is a body of its own, on a joint (``OpenDoorPhys`` of
CarlaWheeledVehicle.cpp): it does not go with its vehicle. So a door opens a step after its vehicle
has come to its place, and is shut before the vehicle leaves it.

What to do in a tick so that a server shows a step of SUMO's: pure planning, no server needed.

A :class:`Mirror` knows which actor on the server represents which road user. Each tick it turns
where road users are into a :class:`~odscen.carla.server.batch.Batch`, and learns what came of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np

from odscen.base.errors import InputError
from odscen.base.frames import CarlaPose, XodrPose, xodr_to_carla
from odscen.carla.mirror.foreign_actors import ForeignActors, front_of
from odscen.carla.mirror.lane_surface import LaneSurface
from odscen.carla.mirror.nearby import Nearby
from odscen.carla.mirror.walking_ground import WalkingGround
from odscen.carla.mirror.wheels import NEAR, Wheels
from odscen.carla.server.batch import (
    BRAKE,
    FOG,
    HEROES,
    HIGH_BEAM,
    LEFT,
    LIFTS,
    LOW_BEAM,
    RIGHT,
    ROLE,
    SIREN,
    ActorPlace,
    Batch,
    DoorMove,
    Move,
    Spawn,
    SwitchLights,
    Velocity,
)
from odscen.carla.server.blueprints import Shape, choose_blueprints, size_differences
from odscen.carla.server.environment import vehicle_lights, weather_parameters
from odscen.sumo.runner.in_step import Step
from odscen.sumo.worker.protocol import EgoPose as SumoPlace
from odscen.sumo.worker.simulation.observed import VehicleSignal

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from odscen.carla.mirror.cosim_options import CosimOptions
    from odscen.carla.server.carla_server import Server
    from odscen.records.run_plan import Plan
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.realize.run_map import RunMap


# ------------------------------------- what to do in a tick so that a server shows a step of SUMO's
PAUSE = 10
"""Ticks between two more tries, once all lifts were refused."""
JUMP = 12.0
"""Metres that a road user moves in a step more than driving takes: a teleport, shown as one."""

_NO_SHAPE = Shape((0.0, 0.0, 0.0))


@dataclass(slots=True)
class Refusal:
    """A road user whom the server would not take, and why in its own words."""

    actor: str
    tries: int
    reason: str


class Mirror:
    """Which actor represents which road user.

    Parameters
    ----------
    blueprints
        One for each actor of the plan.
    shapes
        Bounding boxes by blueprint.
    nearby
        Who is shown.
    lights
        Lights that every vehicle has on, by night or in fog.
    left_out
        Row of the plan of the one who is driven in CARLA.
    ego_role
        Role of the ego; as all others' if not given.
    walkers_within
        Metres from the ego beyond which pedestrians are not shown: actors are dormant there on
        large maps, and a server is said to crash when a dormant walker is moved.
    spectator
        x and y that count as the ego's for that while there is no ego: a server without a hero goes
        by its spectator.
    on_ground
        Puts pedestrians on the ground in what is shown between two steps.

    Attributes
    ----------
    refusals
        By row of the plan; those who were taken at last are not in it.
    spawned
        How many actors have been made so far.
    shown
        What the last batch shows: a step, or what lies between two; ``None`` before the first.
    """

    def __init__(
        self,
        plan: Plan,
        blueprints: Sequence[str],
        shapes: Mapping[str, Shape],
        *,
        nearby: Nearby | None = None,
        lights: int = 0,
        left_out: int | None = None,
        ego_role: str | None = None,
        walkers_within: float | None = None,
        spectator: tuple[float, float] | None = None,
        on_ground: Callable[[Step], Step] = lambda shown: shown,
    ) -> None:
        self.refusals: dict[int, Refusal] = {}
        self.spawned = 0
        self.shown: Step | None = None
        self._plan = plan
        self._blueprints = tuple(blueprints)
        self._walks = np.array([actor.person for actor in plan.actors], dtype=np.bool_)
        self._ego = next((row for row, actor in enumerate(plan.actors) if actor.ego), None)
        self._left_out = left_out
        self._ego_role = ego_role
        self._walkers_within = walkers_within
        self._spectator = spectator
        self._on_ground = on_ground
        self._nearby = nearby or Nearby()
        self._lights = lights
        known = [shapes.get(name, _NO_SHAPE) for name in self._blueprints]
        self._ahead = np.array([shape.centre[0] for shape in known])
        self._aside = np.array([shape.centre[1] for shape in known])
        self._height = np.array([shape.extent[2] - shape.centre[2] for shape in known])
        self._actor: dict[int, int] = {}
        self._flags: dict[int, int] = {}
        self._wait: dict[int, int] = {}
        self._asked: tuple[int, ...] = ()
        self._last: Step | None = None

    @property
    def actors(self) -> Mapping[int, int]:
        """Actor on the server for each row of the plan that is shown."""
        return self._actor

    def batches(self, step: Step, shares: Iterable[float]) -> Iterator[Batch]:
        """Plan the ticks between the last step and this one; the last of them is exactly it.

        Parameters
        ----------
        shares
            How far the way to this step is in each tick; 1 in the last.

        Notes
        -----
        After each batch :meth:`answered` is to be called before the next one is taken.
        """
        wanted = self._rows_to_show(step)
        last, self._last = self._last, step
        for share in shares:
            if share >= 1.0:
                self.shown = step
                yield self._plan_batch(step, wanted, whole=True)
            elif last is not None:
                self.shown = self._on_ground(between(last, step, share))
                yield self._plan_batch(self.shown, self._mask_of_shown(self.shown), whole=False)
            else:
                yield Batch()

    def answered(self, answers: Sequence[int | str]) -> None:
        """Learn what came of the spawns of the last batch: an actor's id, or why there is none."""
        for row, answer in zip(self._asked, answers, strict=True):
            if isinstance(answer, int):
                self._actor[row] = answer
                self.spawned += 1
                self.refusals.pop(row, None)
                continue
            self._flags.pop(row, None)
            refusal = self.refusals.setdefault(row, Refusal(self._plan.actors[row].id, 0, answer))
            refusal.tries += 1
            refusal.reason = answer
            if refusal.tries >= len(LIFTS):
                self._wait[row] = PAUSE
        self._asked = ()

    def _rows_to_show(self, step: Step) -> np.ndarray:
        centre = self._centre_of_interest(step)
        wanted = self._nearby.chosen(step.x, step.y, self._mask_of_shown(step), centre)
        awake = centre or self._spectator
        if awake is not None and self._walkers_within is not None:
            away = np.hypot(step.x - awake[0], step.y - awake[1])
            wanted &= ~self._walks[step.index] | (away <= self._walkers_within)
        if self._left_out is not None:
            wanted &= step.index != self._left_out
        return wanted

    def _mask_of_shown(self, step: Step) -> np.ndarray:
        return np.array([row in self._actor for row in step.index.tolist()], dtype=np.bool_)

    def _centre_of_interest(self, step: Step) -> tuple[float, float] | None:
        if self._ego is None:
            return None
        ego_rows = np.flatnonzero(step.index == self._ego)
        return (float(step.x[ego_rows[0]]), float(step.y[ego_rows[0]])) if len(ego_rows) else None

    def _plan_batch(self, step: Step, here: np.ndarray, *, whole: bool) -> Batch:
        """Plan one tick; who comes and who goes does so when the step is ``whole``."""
        rows = step.index[here].tolist()
        gone = sorted(self._actor.keys() - set(rows)) if whole else []
        destroy = tuple(self._actor.pop(row) for row in gone)
        for row in gone:
            self._flags.pop(row, None)
        places, velocities = self._actor_places(step, here)
        speeds = step.speed[here].tolist()
        flags = self._convert_flags(step.signals[here])
        moves, shines, spawns, asked = [], [], [], []
        for number, row in enumerate(rows):
            actor, walks = self._actor.get(row), bool(self._walks[row])
            at, velocity, speed = places[number], velocities[number], speeds[number]
            own = 0 if walks else flags[number]
            if actor is not None:
                moves.append(Move(actor, at, velocity, speed, walks))
                if not walks and self._flags.get(row) != own:
                    self._flags[row] = own
                    shines.append(SwitchLights(actor, own))
            elif whole and self._may_try(row):
                self._flags[row] = own
                asked.append(row)
                spawns.append(
                    Spawn(
                        self._blueprints[row],
                        self._role_name_of(row),
                        at,
                        velocity,
                        speed,
                        walks,
                        self._lift_of(row) + (self._height[row] if walks else 0.0),
                        own,
                    )
                )
        self._asked = tuple(asked)
        return Batch(destroy, tuple(spawns), tuple(moves), tuple(shines))

    def _role_name_of(self, row: int) -> str:
        if row == self._ego and self._ego_role is not None:
            return self._ego_role
        return ROLE + self._plan.actors[row].id

    def _actor_places(
        self, step: Step, here: np.ndarray
    ) -> tuple[list[ActorPlace], list[Velocity]]:
        """Origins of the actors: the box's middle is where the body centre is.

        Vehicles and walkers are put on the ground; walkers are upright, and the server itself adds
        what a walker's origin is above it.
        """
        index = step.index[here]
        walks = self._walks[index]
        pitch = np.where(walks, 0.0, step.pitch[here])
        hdg = step.hdg[here]
        level, ahead, aside = np.cos(pitch), self._ahead[index], self._aside[index]
        pose = xodr_to_carla(
            XodrPose(
                step.x[here] - ahead * level * np.cos(hdg) - aside * np.sin(hdg),
                step.y[here] - ahead * level * np.sin(hdg) + aside * np.cos(hdg),
                step.z[here] - ahead * np.sin(pitch),
                hdg,
                pitch,
            )
        )
        speed = step.speed[here]
        columns = np.column_stack([pose.x, pose.y, pose.z, pose.pitch_deg, pose.yaw_deg])
        velocity = np.column_stack(
            [
                speed * level * np.cos(hdg),
                -speed * level * np.sin(hdg),
                speed * np.sin(step.pitch[here]),
            ]
        )
        return (
            [ActorPlace(*values) for values in columns.tolist()],
            [Velocity(*values) for values in velocity.tolist()],
        )

    def _convert_flags(self, signals: np.ndarray) -> list[int]:
        hazard = signals & VehicleSignal.BLINKER_EMERGENCY
        flags = np.full(len(signals), self._lights)
        flags += BRAKE * ((signals & VehicleSignal.BRAKE) > 0)
        flags += RIGHT * (((signals & VehicleSignal.BLINKER_RIGHT) | hazard) > 0)
        flags += LEFT * (((signals & VehicleSignal.BLINKER_LEFT) | hazard) > 0)
        # Lights of the time of day are on already; a rule may switch on more.
        flags |= LOW_BEAM * ((signals & VehicleSignal.FRONT) > 0)
        flags |= FOG * ((signals & VehicleSignal.FOG) > 0)
        flags += HIGH_BEAM * ((signals & VehicleSignal.HIGH_BEAM) > 0)
        flags += SIREN * ((signals & VehicleSignal.EMERGENCY_BLUE) > 0)
        listed: list[int] = flags.tolist()
        return listed

    def _may_try(self, row: int) -> bool:
        left = self._wait.get(row, 0)
        if left:
            self._wait[row] = left - 1
        return not left

    def _lift_of(self, row: int) -> float:
        refusal = self.refusals.get(row)
        return LIFTS[refusal.tries % len(LIFTS)] if refusal else LIFTS[0]


def between(last: Step, step: Step, share: float) -> Step:
    """All who are in both steps, so much of the way from one to the other.

    Headings turn the short way. Who has jumped stays where it was until the step is complete.
    """
    _, old, new = np.intersect1d(last.index, step.index, return_indices=True)
    dx, dy = step.x[new] - last.x[old], step.y[new] - last.y[old]
    usual = (step.speed[new] + last.speed[old]) * max(step.time - last.time, 0.0)
    part = np.where(np.hypot(dx, dy) > usual + JUMP, 0.0, share)
    turn = np.mod(step.hdg[new] - last.hdg[old] + np.pi, 2 * np.pi) - np.pi
    return Step(
        time=last.time + share * (step.time - last.time),
        index=step.index[new],
        ids=step.ids[new],
        x=last.x[old] + part * dx,
        y=last.y[old] + part * dy,
        z=last.z[old] + part * (step.z[new] - last.z[old]),
        hdg=last.hdg[old] + part * turn,
        pitch=last.pitch[old] + part * (step.pitch[new] - last.pitch[old]),
        speed=last.speed[old] + part * (step.speed[new] - last.speed[old]),
        signals=last.signals[old],
        lights=last.lights,
    )


# ---------------------------------------------------- which doors of vehicles near the ego are open
_LEFT, _RIGHT = VehicleSignal.DOOR_OPEN_LEFT, VehicleSignal.DOOR_OPEN_RIGHT
_DOORS = {_LEFT: ("FL",), _RIGHT: ("FR", "RR")}
"""On the left it is the driver's; a model that has no such door leaves it out."""


class Doors:
    """Which doors are to be opened and shut in each tick.

    Parameters
    ----------
    plan
        Road users.
    able
        Whose models have doors that open, shape ``(N,)``.
    calls
        Calls in a tick at most; no more doors than that are ever open, so that all can be shut.
    """

    def __init__(self, plan: Plan, able: NDArray[np.bool_], *, calls: int) -> None:
        self._calls = calls
        self._able = able
        self._ego = next((row for row, actor in enumerate(plan.actors) if actor.ego), None)
        self._open: dict[int, tuple[str, ...]] = {}
        self._at_stop: dict[int, int] = {}
        self._wanted: dict[int, tuple[str, ...]] = {}

    def before(self, step: Step) -> None:
        """Learn where everybody will be after the next ticks."""
        last, self._at_stop = self._at_stop, self._doors_of_stopped(step)
        stay = {row: bits & last.get(row, 0) for row, bits in self._at_stop.items()}
        near = self._rows_near_ego(step)
        self._wanted = {
            row: sum((doors for side, doors in _DOORS.items() if bits & side), ())
            for row, bits in stay.items()
            if bits and row in near
        }

    def moved(self, actors: Mapping[int, int]) -> dict[int, tuple[DoorMove, ...]]:
        """Doors to open and to shut before the next tick, by actor on the server.

        Parameters
        ----------
        actors
            Actor for each row of the plan that is on the server already.
        """
        self._open = {row: doors for row, doors in self._open.items() if row in actors}
        moves: dict[int, tuple[DoorMove, ...]] = {}
        left = self._calls
        for row in [row for row in self._open if row not in self._wanted]:
            doors = self._open.pop(row)
            left -= len(doors)
            moves[actors[row]] = tuple(DoorMove(door, opens=False) for door in doors)
        room = self._calls - sum(map(len, self._open.values()))
        for row, doors in self._wanted.items():
            if row in actors and row not in self._open and len(doors) <= min(left, room):
                left, room = left - len(doors), room - len(doors)
                self._open[row] = doors
                moves[actors[row]] = tuple(DoorMove(door, opens=True) for door in doors)
        return moves

    def _doors_of_stopped(self, step: Step) -> dict[int, int]:
        bits = step.signals & (_LEFT | _RIGHT)
        stopped_rows = np.flatnonzero((bits > 0) & self._able[step.index])
        return {int(step.index[k]): int(bits[k]) for k in stopped_rows.tolist()}

    def _rows_near_ego(self, step: Step) -> set[int]:
        """Rows of those near the ego."""
        ego_rows = [] if self._ego is None else np.flatnonzero(step.index == self._ego).tolist()
        if not ego_rows or not self._at_stop:
            return set()
        away = np.hypot(step.x - step.x[ego_rows[0]], step.y - step.y[ego_rows[0]])
        return set(step.index[away <= NEAR].tolist())


# ----------------------------------------------------- the ego that another program drives in CARLA
LIFT = 0.3
"""Metres above the road at which a hero of ours is made; it has physics and comes down."""


class ExternalEgo:
    """The hero on the server.

    Attributes
    ----------
    row
        Row of the plan of SUMO's ego.
    hero
        Its actor.
    """

    def __init__(self, server: Server, plan: Plan, row: int, hero: int, ahead: float) -> None:
        self.row = row
        self._server = server
        self._offset = plan.net_offset
        self._length = plan.actors[row].length
        self.hero = hero
        self._ahead = ahead

    @classmethod
    def take(cls, server: Server, plan: Plan, row: int, blueprint: str) -> Self:
        """Take the hero that is there; make one at the ego's spawn if there is none.

        One that we make has physics and no driver: the program that is to drive it finds it by
        its role. It is taken away at the end; one that was there stays.
        """
        hero = server.find_role(*HEROES)
        if hero is None:
            actor = plan.actors[row]
            pose = xodr_to_carla(XodrPose(actor.x, actor.y, actor.z, actor.hdg))
            at = ActorPlace(
                float(pose.x), float(pose.y), float(pose.z) + LIFT, 0.0, float(pose.yaw_deg)
            )
            hero = server.spawn_free(blueprint, HEROES[0], at)
        return cls(server, plan, row, hero, server.shape(hero).centre[0])

    def place(self) -> tuple[float, float, float]:
        """Where the hero is in the newest state; metres, OpenDRIVE frame."""
        at = self._server.place(self.hero)
        return at.x, -at.y, at.z

    def driven(self, step: Step) -> SumoPlace | None:
        """Where the hero is now, as SUMO has it; ``None`` while SUMO's ego is not on the road."""
        if self.row not in step.index:
            return None
        at = self._server.place(self.hero)
        front = front_of(
            CarlaPose(at.x, at.y, at.z, at.yaw, at.pitch),
            ahead=self._ahead,
            length=self._length,
            net_offset=self._offset,
        )
        speed = self._server.speed(self.hero, at)
        return SumoPlace(float(front.x), float(front.y), float(front.angle_deg), speed)


# ------------------------ the road users of a plan with the bodies that they have on a CARLA server
WAKE = 0.9
"""Share of the distance within which actors are awake that pedestrians are shown in."""


@dataclass(frozen=True, slots=True)
class MirroredPlan:
    """A plan that is to be shown on a server.

    Attributes
    ----------
    mirror
        Shows its steps.
    blueprints
        Of each road user, in the plan's order.
    shapes
        Boxes of the blueprints.
    ego
        Who is driven in CARLA.
    foreign
        Who else is on the server and is to be seen by SUMO's traffic.
    ground
        Where pedestrians walk on the server.
    wheels
        How wheels are turned, if the server turns any.
    doors
        How doors are opened, if vehicles have no physics.
    sizes
        Metres by which the length of a blueprint differs from the road user it represents.
    """

    mirror: Mirror
    blueprints: tuple[str, ...]
    shapes: Mapping[str, Shape]
    ego: ExternalEgo | None
    foreign: ForeignActors | None
    ground: WalkingGround
    wheels: Wheels | None
    doors: Doors | None
    sizes: dict[str, float]

    @classmethod
    def on(
        cls, server: Server, scenario: Scenario, on: RunMap, plan: Plan, options: CosimOptions
    ) -> MirroredPlan:
        """Choose bodies, under the scenario's sky; none is spawned yet.

        Raises
        ------
        InputError
            If the ego is to be driven in CARLA and there is none.
        """
        sky = weather_parameters(scenario.environment, on.assets)
        server.set_weather(sky)
        blueprints = choose_blueprints(plan.actors, on.assets, server.library())
        shapes = server.shapes(blueprints)
        sizes = size_differences(plan.actors, blueprints, shapes)
        ego = _external_ego(plan, server, blueprints) if options.external_ego else None
        free = ego is None and server.find_role(*HEROES) is None
        if free:
            server.roles.add(HEROES[0])
        walks = np.array([actor.person for actor in plan.actors], dtype=np.bool_)
        ground = WalkingGround(server, walks, lambda: LaneSurface.of(on.file("xodr").read_bytes()))
        mirror = Mirror(
            plan,
            blueprints,
            shapes,
            nearby=options.nearby,
            lights=vehicle_lights(sky),
            left_out=ego.row if ego else None,
            ego_role=HEROES[0] if free else None,
            walkers_within=WAKE * server.active_distance(),
            spectator=_spectator_position(server) if free else None,
            on_ground=ground.between,
        )
        foreign = None
        if options.foreign is not None:
            hero = ego.hero if ego else None
            z = on.graph.lanes.z
            foreign = ForeignActors(
                server,
                plan.net_offset,
                on.assets,
                options.foreign,
                heights=(float(z.min(initial=np.inf)), float(z.max(initial=-np.inf))),
                left_out=hero,
            )
        wheels = doors = None
        if not options.sensed_speed and options.wheel_calls:
            able = server.with_doors(blueprints)
            doors = Doors(
                plan,
                np.array([name in able for name in blueprints], dtype=np.bool_),
                calls=options.wheel_calls,
            )
            if server.release.turns_wheels:
                wheels = Wheels(plan, calls=options.wheel_calls)
        return cls(mirror, blueprints, shapes, ego, foreign, ground, wheels, doors, sizes)


def _spectator_position(server: Server) -> tuple[float, float]:
    """X and y of where the server's window looks from, OpenDRIVE frame."""
    at = server.spectator_place()
    return at.x, -at.y


def _external_ego(plan: Plan, server: Server, blueprints: tuple[str, ...]) -> ExternalEgo:
    row = next((row for row, actor in enumerate(plan.actors) if actor.ego), None)
    if row is None:
        raise InputError(
            "the scenario has no ego that could be driven in CARLA; mark one of its road users"
        )
    return ExternalEgo.take(server, plan, row, blueprints[row])
