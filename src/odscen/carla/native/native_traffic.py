"""Native mode on a server: spawn who is due, hand them to CARLA's own drivers, see them arrive.

The Traffic Manager is a part of the client, runs in this process, and ends the process when the
server does not answer it. So this is the business of a worker process
(:mod:`odscen.carla.native.native_worker`), which tells of everything as it happens.

Frees a Traffic Manager that waits for its own thread.

In synchronous mode the thread that ticks and the Traffic Manager's own wake each other without
holding the lock that the other one goes to sleep with (issue 9172 of carla-simulator/carla). Now
and then one is called a moment before it sleeps: then both sleep, no time-out applies, and the
tick never ends. Leaving synchronous mode calls the Traffic Manager's thread once more. The thread
that ticks holds the lock of the client's Traffic Managers meanwhile, so this is asked for at the
port on which the Traffic Manager listens for other clients.
"""

from __future__ import annotations

import math
import socket
import threading
import time
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.base.frames import CarlaPose, XodrPose, carla_to_xodr, xodr_to_carla
from odscen.carla.server.batch import LIFTS, ROLE
from odscen.records.run_events import Event, EventKind

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from odscen.carla.native.native_plan import NativeActor
    from odscen.carla.server.carla_server import Server


# -------------------------------------------- frees a Traffic Manager that waits for its own thread
PATIENCE = 2.0
"""Seconds after the frame has come until a tick that has not ended is taken for one that never
will: the Traffic Manager's own step takes milliseconds."""
_LOOK = 0.25
"""Seconds between two looks."""
_ANSWER = 2.0
"""Seconds for an answer of the Traffic Manager."""


class TickWatch:
    """Sees to it that ticks end; looks from a thread of its own until the process ends.

    Parameters
    ----------
    port
        On which the Traffic Manager of this process listens.
    frame
        Number of the newest frame that has come from the server.

    Attributes
    ----------
    freed
        How often a tick had to be freed.
    """

    def __init__(self, port: int, frame: Callable[[], int], *, patience: float = PATIENCE) -> None:
        self._port = port
        self._frame = frame
        self._patience = patience
        self._before: int | None = None
        self.freed = 0
        threading.Thread(target=self._watch_ticks, name="tick-watch", daemon=True).start()

    @contextmanager
    def tick(self) -> Iterator[None]:
        """Watch the tick that is made within."""
        self._before = self._frame()
        try:
            yield
        finally:
            self._before = None

    def _watch_ticks(self) -> None:
        watched, since = None, 0.0
        while True:
            time.sleep(_LOOK)
            before = self._before
            if before is None or self._frame() <= before:
                watched = None
            elif before != watched:
                watched, since = before, time.monotonic()
            elif time.monotonic() - since >= self._patience:
                watched = None
                with suppress(OSError):  # then it is tried again
                    free(self._port)
                    self.freed += 1


def free(port: int) -> None:
    """Call the thread of the Traffic Manager that listens on a port of this machine.

    Both requests are sent at once, so that it makes no step of its own between the two.

    Raises
    ------
    OSError
        If it does not answer.
    """
    import msgpack

    requests = [
        msgpack.packb([0, number, "set_synchronous_mode", [on]])
        for number, on in enumerate((False, True))
    ]
    with socket.create_connection(("127.0.0.1", port), timeout=_ANSWER) as line:
        line.sendall(b"".join(requests))
        answers = msgpack.Unpacker()
        got = 0
        while got < len(requests):
            part = line.recv(4096)
            if not part:
                raise ConnectionError(f"the Traffic Manager at port {port} closed the connection")
            answers.feed(part)
            got += sum(1 for _ in answers)


# ------------------------------------------------- road users of native mode that are still to come
RETRY_SECONDS = 0.5
"""Simulated seconds between two tries to spawn a road user."""


@dataclass(slots=True)
class _SpawnTries:
    next: float = 0.0
    count: int = 0
    reason: str = ""


class SpawnQueue:
    """Road users that are to be spawned, in order of departure.

    Parameters
    ----------
    server
        Synchronized.
    actors
        Who is to come.
    blueprints
        By row of the plan.
    """

    def __init__(
        self, server: Server, actors: Sequence[NativeActor], blueprints: Sequence[str]
    ) -> None:
        self._server = server
        self._blueprints = blueprints
        self._waiting = sorted(actors, key=lambda actor: (actor.depart, actor.row))
        self._tries: dict[int, _SpawnTries] = {}

    def __len__(self) -> int:
        """How many are still to come."""
        return len(self._waiting)

    @property
    def most_tries(self) -> int:
        """How often the one who was refused most often was tried."""
        return max((tries.count for tries in self._tries.values()), default=0)

    def refusals(self) -> dict[str, str]:
        """Why the server refused a road user, by id; of those that were not spawned."""
        return {
            actor.id: self._tries[actor.row].reason
            for actor in self._waiting
            if actor.row in self._tries
        }

    def spawn_due(self, time: float) -> Iterator[tuple[NativeActor, int]]:
        """Spawn who is due at ``time``, seconds; yields each with the number of its actor."""
        due = [
            actor for actor in self._waiting if actor.depart <= time and self._may_try(actor, time)
        ]
        for _ in LIFTS:  # all in this tick: a body on the ground is refused, and one above it taken
            commands = [self._spawn_command(actor) for actor in due]
            answers = self._server.spawn(commands) if commands else []
            refused = []
            for actor, answer in zip(due, answers, strict=True):
                if isinstance(answer, int):
                    self._waiting.remove(actor)
                    yield actor, answer
                else:
                    self._note_refusal(actor, answer, time)
                    refused.append(actor)
            due = refused

    def _may_try(self, actor: NativeActor, time: float) -> bool:
        tries = self._tries.get(actor.row)
        return tries is None or tries.next <= time

    def _note_refusal(self, actor: NativeActor, reason: str, time: float) -> None:
        tries = self._tries.setdefault(actor.row, _SpawnTries())
        tries.next, tries.reason = time + RETRY_SECONDS, reason
        tries.count += 1

    def _spawn_command(self, actor: NativeActor) -> Any:
        """At the exact place; only the height gives way, and physics lets a vehicle settle."""
        tries = self._tries.get(actor.row)
        lift = LIFTS[tries.count % len(LIFTS)] if tries else LIFTS[0]
        if actor.person:
            lift += actor.height / 2.0
        at = xodr_to_carla(actor.at)
        return self._server.spawn_command(
            self._blueprints[actor.row],
            "hero" if actor.ego else ROLE + actor.id,
            (float(at.x), float(at.y), float(at.z) + lift),
            pitch=float(at.pitch_deg),
            yaw=float(at.yaw_deg),
        )


# -------------------------------------------------------------------------- native mode on a server
ARRIVED = 2.5
"""Metres from the goal at which a road user has arrived."""
END_OF_ROAD = 40.0
"""Metres of route left within which the Traffic Manager may remove a vehicle: a road that ends."""
STRAYED = 15.0
"""Metres from its route at which a vehicle has taken another."""
_SEARCH = 30
"""Points of its route that a road user may pass in one tick, at most."""
_TURN_AHEAD = 2
"""Points before a change of lane at which it is commanded."""

CONTROLLER = "controller.ai.walker"

COLUMNS = 7
"""Of :meth:`Traffic.rows`: row of the plan, x, y, z, hdg, pitch, speed."""


@dataclass(slots=True, eq=False)
class _DrivenActor:
    """A road user on the road: its actor on the server, and how far along its route it is."""

    plan: NativeActor
    number: int
    since: float
    handle: Any = None
    guide: int | None = None
    controller: Any = None
    at: int = 0
    turned: int = 0
    speed: float = -1.0
    strayed: bool = False


@dataclass(frozen=True, slots=True)
class TickOutcome:
    """What one tick has brought: events, and notes in words about single actors."""

    events: list[Event] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


class Traffic:
    """All road users of a scenario, driven by the Traffic Manager and CARLA's walkers.

    Parameters
    ----------
    server
        Synchronized.
    actors
        Who is to come, see :func:`odscen.carla.native.native_plan.native_actors`.
    blueprints
        By row of the plan.
    seed
        Of the Traffic Manager's and the walkers' random choices.
    physics
        Whether vehicles have their own physics. Without, the Traffic Manager moves them itself.

    Attributes
    ----------
    has_navigation
        Whether the world has a navigation mesh; without one walkers are led along their routes.
    road_ends
        Metres to the goal of each vehicle that the Traffic Manager took away where a road ends,
        which it does as soon as it sees the end. They count as arrived.
    """

    def __init__(
        self,
        server: Server,
        actors: Sequence[NativeActor],
        blueprints: Sequence[str],
        *,
        seed: int,
        physics: bool = True,
    ) -> None:
        self._server = server
        self._queue = SpawnQueue(server, actors, blueprints)
        self._underway: dict[int, _DrivenActor] = {}
        self._starting: list[_DrivenActor] = []
        self._physics = physics
        self._seen: dict[int, XodrPose] = {}
        self.road_ends: list[float] = []
        self._port = _free_port()
        self._manager = server.client.get_trafficmanager(self._port)
        self._manager.set_synchronous_mode(True)
        self._manager.set_random_device_seed(seed)
        # Where a road ends, others than OpenStreetMap's users expect a vehicle to go on.
        self._manager.set_osm_mode(True)
        self._manager.set_hybrid_physics_mode(not physics)
        self._watch = TickWatch(self._port, lambda: int(server.world.get_snapshot().frame))
        server.around_tick = self._watch.tick
        server.world.set_pedestrians_seed(seed)
        self.has_navigation = server.world.get_random_location_from_navigation() is not None

    @property
    def expected(self) -> int:
        """How many are on the road or still to come."""
        return len(self._queue) + len(self._underway)

    @property
    def running(self) -> int:
        """How many are on the road."""
        return len(self._underway)

    @property
    def freed(self) -> int:
        """How often the Traffic Manager waited for itself and was freed."""
        return self._watch.freed

    @property
    def own(self) -> tuple[int, ...]:
        """Actors that have been made on the server."""
        return self._server.own

    def refusals(self) -> dict[str, str]:
        """Why the server refused a road user, by id; of those that were not spawned."""
        return self._queue.refusals()

    @property
    def most_tries(self) -> int:
        """How often the one who was refused most often was tried."""
        return self._queue.most_tries

    def step(self, time: float, delta: float) -> TickOutcome:
        """Make the tick that begins at ``time``, seconds."""
        happened = TickOutcome()
        new = self._spawn_due(time)
        self._lead_walkers()
        self._server.tick()
        snapshot = self._server.world.get_snapshot()
        self._start_controllers()
        for driven in new:
            happened.events.append(self._departure_event(driven, snapshot, time))
            self._hand_over(driven)
        self._follow_actors(snapshot, time + delta, happened)
        return happened

    def rows(self, delta: float) -> np.ndarray:
        """All on the road after a tick of ``delta`` seconds, shape ``(N, 7)``.

        Columns: row of the plan, x, y, z, hdg, pitch, speed; origins of the actors in the OpenDRIVE
        frame, metres, radians, m/s.
        """
        snapshot = self._server.world.get_snapshot()
        rows, seen = [], {}
        for row, underway in self._underway.items():
            state = snapshot.find(underway.number)
            if state is None:
                continue
            pose = seen[row] = _pose_of_state(state)
            speed = _ground_speed(state, pose)
            if underway.plan.person or not self._physics:
                # The walker AI, and the Traffic Manager without physics, put road users where
                # they are to be: at no velocity.
                last = self._seen.get(row, pose)
                speed = math.hypot(pose.x - last.x, pose.y - last.y) / delta
            rows.append([row, pose.x, pose.y, pose.z, pose.hdg, pose.pitch, speed])
        self._seen = seen
        return np.array(rows, dtype="<f8").reshape(-1, COLUMNS)

    def close(self) -> None:
        """Let go of all. The Traffic Manager stays as it is, idle, until the process ends.

        To end it here is to wait for its thread, which may have missed the call that ends it.
        """
        for driven in self._underway.values():
            self._let_go(driven)
        self._destroy_actors(list(self._underway.values()))
        self._underway.clear()

    # ------------------------------------------------------------------------------- coming
    def _spawn_due(self, time: float) -> list[_DrivenActor]:
        new = [_DrivenActor(actor, number, time) for actor, number in self._queue.spawn_due(time)]
        self._underway |= {driven.plan.row: driven for driven in new}
        return new

    def _departure_event(self, underway: _DrivenActor, snapshot: Any, time: float) -> Event:
        state = snapshot.find(underway.number)
        if state is None:
            return Event(time, EventKind.DEPARTED, underway.plan.id)
        pose = _pose_of_state(state)
        planned = underway.plan.at
        error = math.hypot(float(pose.x - planned.x), float(pose.y - planned.y))
        return Event(
            time,
            EventKind.DEPARTED,
            underway.plan.id,
            x=float(pose.x),
            y=float(pose.y),
            error=error,
        )

    def _hand_over(self, underway: _DrivenActor) -> None:
        """Give a road user that has just come to CARLA's drivers or walkers."""
        underway.handle = self._server.world.get_actor(underway.number)
        plan = underway.plan
        if plan.person:
            if self.has_navigation:
                self._give_controller(underway)
            return
        manager, car = self._manager, underway.handle
        car.set_autopilot(True, self._port)
        manager.auto_lane_change(car, False)
        manager.random_left_lanechange_percentage(car, 0)
        manager.random_right_lanechange_percentage(car, 0)
        self._server.release.stay_in_lane(manager, car)
        manager.update_vehicle_lights(car, True)
        manager.distance_to_leading_vehicle(car, plan.gap)
        if plan.offset:
            manager.vehicle_lane_offset(car, -plan.offset)  # CARLA's is to the right
        if len(plan.path):
            manager.set_path(car, [self._carla_location(point) for point in plan.path])
        self._set_speed(underway)

    def _give_controller(self, underway: _DrivenActor) -> None:
        """Let CARLA's walker AI find the route; on its own mesh, which is not the scenario's.

        A controller can be started when a tick has shown it: the next one, which is made anyway.
        """
        world, carla = self._server.world, self._server.package
        blueprint = world.get_blueprint_library().find(CONTROLLER)
        command = carla.command.SpawnActor(blueprint, carla.Transform(), underway.number)
        (controller,) = self._server.spawn([command])
        if not isinstance(controller, int):  # then it is led, as without a mesh
            return
        underway.guide = controller
        self._starting.append(underway)

    def _start_controllers(self) -> None:
        """Start the controllers that were made before the last tick."""
        for driven in self._starting:
            if driven.plan.row in self._underway:
                driven.controller = self._server.world.get_actor(driven.guide)
                driven.controller.start()
                driven.controller.go_to_location(self._carla_location(driven.plan.route[-1]))
                driven.controller.set_max_speed(float(driven.plan.speed[0]))
        self._starting.clear()

    # ------------------------------------------------------------------------------- under way
    def _follow_actors(self, snapshot: Any, time: float, happened: TickOutcome) -> None:
        gone = []
        for driven in self._underway.values():
            state = snapshot.find(driven.number)
            if state is None:
                if self._report_vanished(driven, time, happened):
                    gone.append(driven)
                continue
            left = self._advance_on_route(driven, _pose_of_state(state), happened)
            if left <= ARRIVED:
                gone.append(driven)
                happened.events.append(_arrival_event(driven, time))
            elif not driven.plan.person:
                self._set_speed(driven)
                self._change_lane(driven)
        for driven in gone:
            del self._underway[driven.plan.row]
            self._let_go(driven)
        self._destroy_actors(gone)

    def _advance_on_route(
        self, underway: _DrivenActor, pose: XodrPose, happened: TickOutcome
    ) -> float:
        """Move on to the nearest point of the route; metres from here to the goal, straight."""
        route = underway.plan.route
        ahead = route[underway.at : underway.at + _SEARCH, :2] - (float(pose.x), float(pose.y))
        distance = np.hypot(ahead[:, 0], ahead[:, 1])
        nearest = int(np.argmin(distance))
        underway.at += nearest
        if distance[nearest] > STRAYED and not underway.strayed:
            underway.strayed = True
            happened.notes.append(
                f"{underway.plan.id}: left its route {_metres_left(underway):.0f} m before its goal"
            )
        return math.hypot(route[-1, 0] - float(pose.x), route[-1, 1] - float(pose.y))

    def _report_vanished(self, underway: _DrivenActor, time: float, happened: TickOutcome) -> bool:
        """Report the outcome of one that the server has no longer; false if it is yet to come."""
        if time - underway.since < 2 * RETRY_SECONDS and underway.at == 0:
            return False
        left = _metres_left(underway)
        if left <= END_OF_ROAD:
            happened.events.append(_arrival_event(underway, time))
            self.road_ends.append(left)
            return True
        happened.notes.append(
            f"{underway.plan.id}: the Traffic Manager took it away {left:.0f} m before its goal"
        )
        return True

    def _set_speed(self, underway: _DrivenActor) -> None:
        wanted = float(underway.plan.speed[underway.at])
        if wanted != underway.speed:
            underway.speed = wanted
            self._manager.set_desired_speed(underway.handle, wanted * 3.6)

    def _change_lane(self, underway: _DrivenActor) -> None:
        changes = underway.plan.changes
        while (
            underway.turned < len(changes)
            and underway.at + _TURN_AHEAD >= changes[underway.turned][0]
        ):
            self._manager.force_lane_change(underway.handle, changes[underway.turned][1])
            underway.turned += 1

    def _lead_walkers(self) -> None:
        """Without a navigation mesh: every pedestrian walks to the next point of its route."""
        commands = []
        carla, snapshot = self._server.package, self._server.world.get_snapshot()
        for driven in self._underway.values():
            if not driven.plan.person or driven.guide is not None:
                continue
            state = snapshot.find(driven.number)
            if state is None:
                continue
            pose = _pose_of_state(state)
            target = driven.plan.route[min(driven.at + 1, len(driven.plan.route) - 1)]
            dx, dy = float(target[0] - pose.x), float(target[1] - pose.y)
            norm = math.hypot(dx, dy) or 1.0
            speed = float(driven.plan.speed[driven.at])
            control = carla.WalkerControl(carla.Vector3D(dx / norm, -dy / norm, 0.0), speed, False)
            commands.append(carla.command.ApplyWalkerControl(driven.number, control))
        self._server.send(commands)

    # ------------------------------------------------------------------------------- leaving
    def _let_go(self, underway: _DrivenActor) -> None:
        """Take it from the Traffic Manager before it is destroyed, or the manager would ask."""
        if underway.handle is None:
            return
        with suppress(RuntimeError):
            if underway.controller is not None:
                underway.controller.stop()
            elif not underway.plan.person:
                underway.handle.set_autopilot(False, self._port)

    def _destroy_actors(self, gone: Sequence[_DrivenActor]) -> None:
        controllers = [driven.guide for driven in gone if driven.guide is not None]
        self._server.destroy([*controllers, *(driven.number for driven in gone)])

    def _carla_location(self, point: np.ndarray) -> Any:
        x, y, z = (float(value) for value in point)
        return self._server.package.Location(x, -y, z)


def _arrival_event(underway: _DrivenActor, time: float) -> Event:
    return Event(time, EventKind.ARRIVED, underway.plan.id, travel_time=time - underway.since)


def _metres_left(underway: _DrivenActor) -> float:
    """Metres of route from the last known point to the goal."""
    rest = np.diff(underway.plan.route[underway.at :, :2], axis=0)
    return float(np.sum(np.hypot(rest[:, 0], rest[:, 1])))


def _pose_of_state(state: Any) -> XodrPose:
    at = state.get_transform()
    place, turn = at.location, at.rotation
    return carla_to_xodr(CarlaPose(place.x, place.y, place.z, turn.yaw, turn.pitch))


def _ground_speed(state: Any, pose: XodrPose) -> float:
    """Speed along the slope, m/s; a vehicle that has just been made still falls, which is none."""
    velocity = state.get_velocity()
    return math.hypot(velocity.x, velocity.y) / math.cos(float(pose.pitch))


def _free_port() -> int:
    """Port for the Traffic Manager of its own: another program may have one at the usual port."""
    with socket.socket() as probe:
        probe.bind(("", 0))
        return int(probe.getsockname()[1])
