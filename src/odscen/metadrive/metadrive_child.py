"""The process in which MetaDrive runs; started by its path, by the Python that has MetaDrive.

``python metadrive_child.py FOLDER``, or ``--version``. The folder has ``job.json`` and ``job.npz``,
as :mod:`odscen.metadrive.hand_over` writes them; nothing else of odscen is known here. What there
is after each step goes to stdout, a line of JSON each; what MetaDrive and Panda3D say to stderr.

Models and textures, which MetaDrive would download, are for pictures. Without pictures nothing of
them is opened, so nothing is downloaded.
"""

from __future__ import annotations

import json
import math
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np

PHYSICS_STEP, DECISION = 0.02, 0.1
"""Seconds of a step of MetaDrive's physics, and between two decisions of its drivers: its own."""
FULL_THROTTLE, FULL_BRAKE = 3.0, 20.0
"""m/s^2 for a whole pedal of MetaDrive's default car, as measured; brakes grip up to half of it."""
HARD_BRAKING = 8.0
"""m/s^2, twice the deceleration with which one stops at the end of a way that leads nowhere."""
ON_GROUND = 0.54
"""Metres at which its chassis comes to rest on its wheels."""
AHEAD = 20.0
"""Metres that a path goes on straight behind its end, for a controller that looks ahead."""
STANDING, CLOSE = 0.1, 0.5
"""m/s and metres within which one who follows a standing road user stands, too."""
LEAST_PATH = 0.2
"""Metres that two points of a path are apart, at least."""
REAR_END = 1.0
"""Metres before the end of its path at which a vehicle has arrived, or waits."""


def main(folder: str) -> None:
    """Play a job."""
    # Panda3D writes to stdout, which is for our lines alone.
    lines = os.fdopen(os.dup(1), "w", encoding="utf-8", buffering=1)
    os.dup2(2, 1)
    job = json.loads((Path(folder) / "job.json").read_text(encoding="utf-8"))
    with np.load(Path(folder) / "job.npz") as stored:
        arrays = {name: stored[name] for name in stored.files}
    world = World(job, arrays)
    for line in world.play():
        lines.write(json.dumps(line, allow_nan=False) + "\n")
    lines.close()
    # Panda3D's own threads and destructors have nothing left to do, and may not end.
    os._exit(0)


class World:
    """MetaDrive's engine with the road users of a job.

    Parameters
    ----------
    job, arrays
        See :mod:`odscen.metadrive.hand_over`.
    """

    def __init__(self, job: dict[str, Any], arrays: dict[str, Any]) -> None:
        self._job, self._arrays = job, arrays
        self._step = float(job["step"])
        self._decisions = max(1, round(self._step / DECISION))
        self._frames = max(1, round(self._step / self._decisions / PHYSICS_STEP))
        physics_step = self._step / self._decisions / self._frames
        self._engine = _start_engine(physics_step, job["seed"])
        self._classes = _own_classes()
        self._bodies: dict[int, Any] = {}
        self._drivers: dict[int, Any] = {}
        self._places: dict[int, tuple[float, float]] = {}
        self._gone: set[int] = set()
        self._map = self._build_map()

    def play(self) -> Any:
        """Yield what there is after each step, until the job ends."""
        start = self._arrays["start"]
        before: dict[int, int] = {}
        for index in range(int(self._job["steps"])):
            recorded: dict[int, int] = {}
            if index < len(start) - 1:
                for at in range(int(start[index]), int(start[index + 1])):
                    recorded[int(self._arrays["row"][at])] = at
            touched = self._advance_body(index, before, recorded) if index else []
            self._show_recorded(recorded)
            yield self._take_down(index, touched)
            if index >= len(start) - 2 and not self._drivers:
                return
            before = recorded

    def _advance_body(
        self, index: int, before: dict[int, int], recorded: dict[int, int]
    ) -> list[list[int]]:
        """Make a step: drivers act, MetaDrive's physics moves, and the replayed go on."""
        engine, part = self._engine, self._step / self._decisions
        touched = set()
        for decision in range(self._decisions):
            engine.episode_step += 1
            time = (index - 1) * self._step + decision * part
            for row in sorted(self._drivers):
                body = self._bodies[row]
                body.before_step(self._drivers[row].act(body, time, part))
            engine.step(self._frames)
            share = (decision + 1) / self._decisions
            for row in sorted(self._bodies):
                if row not in self._drivers and row in before and row in recorded:
                    self._place_body(row, before[row], recorded[row], share)
            touched |= {(row, other) for row in self._drivers for other in self._find_contacts(row)}
        for row in sorted(self._drivers):
            driver = self._drivers[row]
            if row not in recorded if driver.timed else driver.arrived(self._bodies[row]):
                self._remove_body(row)
        return [list(pair) for pair in sorted(touched)]

    def _show_recorded(self, recorded: dict[int, int]) -> None:
        """Put the replayed where they were recorded; those who are new come in."""
        for row in [
            row for row in self._bodies if row not in recorded and row not in self._drivers
        ]:
            self._remove_body(row)
        for row, at in recorded.items():
            if row in self._gone:
                continue
            if row not in self._bodies:
                self._bring_in(row, at)

    def _take_down(self, index: int, touched: list[list[int]]) -> dict[str, Any]:
        users, off = [], []
        for row in sorted(self._bodies):
            body = self._bodies[row]
            x, y = (float(part) for part in body.position)
            users.append([row, x, y, float(body.heading_theta), self._speed_of(row, x, y)])
            if row in self._drivers and self._map is not None and not self._is_on_lane(x, y):
                off.append(row)
        return {"step": index, "users": users, "contacts": touched, "off_road": off}

    def _speed_of(self, row: int, x: float, y: float) -> float:
        """Metres in the last step over its seconds: a body that brakes trembles in its place."""
        before = self._places.get(row)
        self._places[row] = (x, y)
        if before is None:
            return float(math.hypot(*self._bodies[row].velocity))
        return math.hypot(x - before[0], y - before[1]) / self._step

    # ------------------------------------------------------------------------------- road users
    def _bring_in(self, row: int, at: int) -> None:
        user, arrays = self._job["users"][row], self._arrays
        x, y, hdg, speed = (float(arrays[name][at]) for name in ("x", "y", "hdg", "speed"))
        name, engine = user["id"], self._engine
        size = {"width": user["width"], "length": user["length"], "height": user["height"]}
        kind = user["body"]
        if kind == "vehicle":
            config = {
                **size,
                "navigation_module": None,
                "show_lidar": False,
                "enable_reverse": False,
                "wheel_friction": 0.9 * user["grip"],
                "spawn_velocity": [speed * math.cos(hdg), speed * math.sin(hdg)],
                "spawn_position_heading": None,
            }
            body = engine.spawn_object(
                self._classes["vehicle"],
                vehicle_config=config,
                position=[x, y, ON_GROUND],
                heading=hdg,
                name=name,
                random_seed=self._job["seed"],
                force_spawn=True,
            )
        else:
            body = engine.spawn_object(
                self._classes[kind],
                position=[x, y],
                heading_theta=hdg,
                name=name,
                random_seed=self._job["seed"],
                force_spawn=True,
                **size,
            )
        self._bodies[row] = body
        drive = user["drive"]
        if drive == "replay":
            body.set_static(True)
            self._place_body(row, at, at, 1.0)
            return
        first, last = (int(arrays["path_start"][user["path"] + k]) for k in (0, 1))
        path = Way(*(arrays[name][first:last] for name in ("path_xy", "path_time", "path_speed")))
        driver = Tracker if drive == "tracking" else Follower
        self._drivers[row] = driver(body, path, self._job["seed"], user["arrives"])

    def _place_body(self, row: int, start: int, end: int, share: float) -> None:
        """Put one who is replayed between two of its recorded states."""
        body, arrays = self._bodies[row], self._arrays
        x, y, speed = (
            float(arrays[name][start]) * (1.0 - share) + float(arrays[name][end]) * share
            for name in ("x", "y", "speed")
        )
        turn = float(arrays["hdg"][end] - arrays["hdg"][start])
        turn = math.atan2(math.sin(turn), math.cos(turn))
        hdg = float(arrays["hdg"][start]) + share * turn
        body.set_position([x, y])
        body.set_heading_theta(hdg)
        body.set_velocity([speed * math.cos(hdg), speed * math.sin(hdg)])

    def _remove_body(self, row: int) -> None:
        body = self._bodies.pop(row)
        self._drivers.pop(row, None)
        self._gone.add(row)
        self._engine.clear_objects([body.id], force_destroy=True)

    def _find_contacts(self, row: int) -> list[int]:
        """Rows of the road users that a body touches."""
        from metadrive.utils.utils import get_object_from_node

        body = self._bodies[row]
        rows = {id(other): number for number, other in self._bodies.items()}
        others = set()
        world = self._engine.physics_world.dynamic_world
        for contact in world.contactTest(body.chassis.node(), True).getContacts():
            for node in (contact.getNode0(), contact.getNode1()):
                other = rows.get(id(get_object_from_node(node)))
                if other is not None and other != row:
                    others.add(other)
        return sorted(others)

    # -------------------------------------------------------------------------------------- map
    def _build_map(self) -> Any:
        """Lanes of the scenario's map in MetaDrive's world; ``None`` if there are none."""
        arrays = self._arrays
        if len(arrays["lane_start"]) < 2:
            return None
        from metadrive.component.map.scenario_map import ScenarioMap
        from metadrive.manager.base_manager import BaseManager

        features = {}
        for lane in range(len(arrays["lane_start"]) - 1):
            centre = slice(int(arrays["lane_start"][lane]), int(arrays["lane_start"][lane + 1]))
            border = slice(int(arrays["border_start"][lane]), int(arrays["border_start"][lane + 1]))
            features[f"lane_{lane}"] = {
                "type": "LANE_SURFACE_STREET",
                "polyline": arrays["lane_xy"][centre],
                "polygon": arrays["border_xy"][border],
                "speed_limit_kmh": float(arrays["lane_limit"][lane]) * 3.6,
                "entry_lanes": [],
                "exit_lanes": [],
                "left_neighbor": [],
                "right_neighbor": [],
            }
        made = ScenarioMap(map_index=0, map_data=features, need_lane_localization=True)
        made.attach_to_world()
        # Its lanes are looked up there.
        keeper = BaseManager()
        keeper.current_map = made
        self._engine.register_manager("map_manager", keeper)
        return made

    def _is_on_lane(self, x: float, y: float) -> bool:
        from metadrive.type import MetaDriveType
        from panda3d.core import Vec3

        world = self._engine.physics_world.static_world
        hits = world.rayTestAll(Vec3(x, y, 1.0), Vec3(x, y, -1.0)).getHits()
        return any(MetaDriveType.is_lane(hit.getNode().getName()) for hit in hits)


class Way:
    """What a driver is to follow.

    Parameters
    ----------
    xy, time, speed
        Shapes ``(K, 2)``, ``(K,)``, ``(K,)``: metres, when it was there as recorded (s), and the
        speed that is wanted (m/s).
    """

    def __init__(self, xy: Any, time: Any, speed: Any) -> None:
        from metadrive.component.lane.point_lane import PointLane

        steps = np.hypot(*np.diff(xy, axis=0).T)
        self.along = np.concatenate([[0.0], np.cumsum(steps)])
        self.time, self.speed = time, speed
        self.length = float(self.along[-1])
        # MetaDrive's controllers look ahead, beyond the end; no two points may be in one place.
        apart = np.concatenate([[True], steps > LEAST_PATH])
        points = xy[apart]
        last = xy[-1] - xy[-2] if len(xy) > 1 else np.array([1.0, 0.0])
        ahead = last / max(float(np.hypot(*last)), 1e-9)
        points = np.concatenate([points, [points[-1] + ahead * AHEAD]])
        self.lane = PointLane(points, 3.0)

    def gone(self, body: Any) -> float:
        """Metres along it at which a body is."""
        return float(self.lane.local_coordinates(body.position)[0])


class Follower:
    """MetaDrive's IDM on a path, which keeps its distance to all in front of it."""

    timed = False

    def __init__(self, body: Any, path: Way, seed: int, arrives: bool) -> None:
        from metadrive.policy.idm_policy import TrajectoryIDMPolicy

        self._path, self._arrives = path, arrives
        self.policy = TrajectoryIDMPolicy(body, seed, path.lane, 0)

    def arrived(self, body: Any) -> bool:
        """Whether it is at the end of a path that leads to its goal."""
        return self._arrives and self._path.gone(body) >= self._path.length - REAR_END

    def act(self, body: Any, time: float, step: float) -> list[float]:
        """Steering and pedals, -1 to 1 each."""
        del time, step
        gone = self._path.gone(body)
        wanted = float(np.interp(gone, self._path.along, self._path.speed))
        self.policy.target_speed = max(wanted * 3.6, 1.0)
        steering, pedals = self.policy.act(True)
        # The recorded road user got no further: what is behind is not known to be its way.
        left = self._path.length - REAR_END - gone
        if not self._arrives and left < float(body.speed) ** 2 / HARD_BRAKING:
            pedals = -1.0
        return [float(np.clip(steering, -1.0, 1.0)), float(np.clip(pedals, -1.0, 1.0))]


class Tracker:
    """Follows a recorded road user in place and time: pure pursuit, and pedals by its distance."""

    timed = True

    def __init__(self, body: Any, path: Way, seed: int, arrives: bool) -> None:
        del seed, arrives
        self._path = path
        self._axles = float(body.FRONT_WHEELBASE + body.REAR_WHEELBASE)
        self._rear = float(body.REAR_WHEELBASE)
        self._most = math.radians(float(body.max_steering))

    def arrived(self, body: Any) -> bool:
        """Never by its place: it goes when the recorded one goes."""
        del body
        return False

    def act(self, body: Any, time: float, step: float) -> list[float]:
        """Steering and pedals, -1 to 1 each, for a step that begins at a time, s."""
        path = self._path
        whens = (time, time + step, time + 2.0 * step)
        at, soon, then = (float(np.interp(when, path.time, path.along)) for when in whens)
        wanted, gain = (soon - at) / step, (then - 2.0 * soon + at) / step**2
        gone, speed = path.gone(body), float(body.speed)
        steering = self._steer_body(body, gone, speed)
        if wanted < STANDING and at - gone < CLOSE:
            return [steering, -1.0]
        # a = a_recorded + 3/s (v_recorded - v) + 2/s^2 (s_recorded - s)
        gain += 3.0 * (wanted - speed) + 2.0 * (at - gone)
        pedals = gain / (FULL_THROTTLE if gain > 0.0 else FULL_BRAKE)
        return [steering, float(np.clip(pedals, -1.0, 1.0))]

    def _steer_body(self, body: Any, gone: float, speed: float) -> float:
        """Share of the steering to a point ahead: ``tan(delta) = 2 L sin(alpha) / l_d``.

        ``alpha`` is its direction as seen from the rear axle, ``l_d`` its distance.
        """
        hdg = float(body.heading_theta)
        ahead = self._path.lane.position(gone + max(3.0, 0.4 * speed), 0.0)
        x = float(ahead[0] - body.position[0]) + self._rear * math.cos(hdg)
        y = float(ahead[1] - body.position[1]) + self._rear * math.sin(hdg)
        aside = -x * math.sin(hdg) + y * math.cos(hdg)
        turn = math.atan(2.0 * self._axles * aside / max(x * x + y * y, 1.0))
        return float(np.clip(turn / self._most, -1.0, 1.0))


def _start_engine(physics_step: float, seed: int) -> Any:
    """MetaDrive's engine without pictures."""
    from metadrive.component.sensors.lidar import Lidar
    from metadrive.engine.base_engine import BaseEngine
    from metadrive.engine.engine_utils import initialize_engine, set_global_random_seed
    from metadrive.envs.base_env import BaseEnv

    BaseEngine.try_pull_asset = staticmethod(lambda: None)
    config = BaseEnv.default_config()
    changes = {
        "use_render": False,
        "image_observation": False,
        "log_level": 40,
        "physics_world_step_size": physics_step,
        "_render_mode": "none",
        "sensors": {"lidar": (Lidar,)},
    }
    for name, value in changes.items():
        config[name] = value
    engine = initialize_engine(config)
    set_global_random_seed(seed)
    engine.reset()
    return engine


def _own_classes() -> dict[str, Any]:
    """Bodies of any size, with axles as far apart for their length as those of a car."""
    from metadrive.component.traffic_participants.cyclist import CyclistBoundingBox
    from metadrive.component.traffic_participants.pedestrian import PedestrianBoundingBox
    from metadrive.component.vehicle.vehicle_type import (
        DefaultVehicle,
        VaryingDynamicsVehicle,
        vehicle_class_to_type,
    )

    class SizedVehicle(VaryingDynamicsVehicle):  # type: ignore[misc]
        @property
        def FRONT_WHEELBASE(self) -> float:  # noqa: N802
            share = DefaultVehicle.FRONT_WHEELBASE / DefaultVehicle.DEFAULT_LENGTH
            return float(self.LENGTH * share)

        @property
        def REAR_WHEELBASE(self) -> float:  # noqa: N802
            share = DefaultVehicle.REAR_WHEELBASE / DefaultVehicle.DEFAULT_LENGTH
            return float(self.LENGTH * share)

    vehicle_class_to_type[SizedVehicle] = vehicle_class_to_type[VaryingDynamicsVehicle]
    return {
        "vehicle": SizedVehicle,
        "cyclist": CyclistBoundingBox,
        "pedestrian": PedestrianBoundingBox,
    }


def tell_version() -> None:
    """Write the releases of MetaDrive and of this Python."""
    import platform
    from importlib.metadata import version

    sys.stdout.write(f"{version('metadrive-simulator')} {platform.python_version()}\n")


if __name__ == "__main__":
    if sys.argv[1] == "--version":
        tell_version()
    else:
        main(sys.argv[1])
