"""A tick of the CARLA mirror, 200 vehicles and 100 pedestrians, against a call per actor.

The stand-in server answers; its own time is not CARLA's. Ours is what is left of a tick without
waiting for the server: aim at most 5 ms. The peer moves each actor by calls of its own, as bridges
do, on the same server in the same run; SUMO has no part in either. The wheels near the ego are
turned as in any run. Times are of the wall but where CPU is said: others on the machine count in.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from odscen.carla.mirror.cosim_options import CosimOptions
from odscen.carla.mirror.mirrored import Mirror
from odscen.carla.mirror.wheels import Wheels
from odscen.carla.server.batch import ROLE
from odscen.carla.server.blueprints import choose_blueprints
from odscen.carla.server.carla_server import Server
from odscen.carla.server.client import Address, import_carla
from odscen.maps.store import Workspace
from odscen.records.run_plan import Plan, PlannedActor
from odscen.simulators.assets import shipped_assets
from odscen.sumo.runner.in_step import Step
from odscen.sumo.worker.protocol import ForeignUser
from odscen.sumo.worker.simulation.session import open_session
from tests.carla_standin.process import StandIn

MAP = Path(__file__).parents[1] / "maps" / "town_5x5.xodr"
VEHICLES, WALKERS = 200, 100
TICKS = 100
DELTA = 0.05


def main() -> None:
    plan = _plan()
    with StandIn(MAP) as stand_in:
        address = Address(stand_in.host, stand_in.port)
        with Server(address) as server:
            server.synchronize(DELTA)
            blueprints = choose_blueprints(plan.actors, shipped_assets(), server.library())
            mirror = Mirror(plan, blueprints, server.shapes(blueprints))
            wheels = Wheels(plan, calls=CosimOptions().wheel_calls)
            _show(server, mirror, wheels, _step(0))
            assert mirror.spawned == VEHICLES + WALKERS, mirror.refusals
            stand_in.reset_calls()
            ours, whole = [], []
            for number in range(1, TICKS + 1):
                step = _step(number)
                waited, start = server.waited, time.perf_counter()
                _show(server, mirror, wheels, step)
                took = time.perf_counter() - start
                whole.append(took)
                ours.append(took - (server.waited - waited))
            calls = sum(stand_in.calls().values()) / TICKS
            stand_in.reset_calls()
            peer = _peer(address, TICKS)
            peer_calls = sum(stand_in.calls().values()) / TICKS
    mine, own, theirs = (statistics.median(times) * 1e3 for times in (whole, ours, peer))
    print(f"{VEHICLES} vehicles, {WALKERS} pedestrians; medians of {TICKS} ticks")
    print(f"own share {own:.2f} ms (95th percentile {np.percentile(ours, 95) * 1e3:.2f} ms)")
    print(f"whole tick with the stand-in {mine:.1f} ms, {calls:.1f} RPCs")
    print(f"a call per actor: {theirs:.1f} ms, {peer_calls:.1f} RPCs")
    print(f"ratio of whole ticks {mine / theirs:.2f}")
    (low, high), (cpu, most) = np.percentile(_place_cost(), [50, 95], axis=1).T
    print(f"a vehicle of another program, put in SUMO: {low:.0f} us a step (95 %: {high:.0f} us)")
    print(f"CPU of that: {cpu:.0f} us (95 %: {most:.0f} us)")


def _place_cost() -> np.ndarray:
    """Microseconds of a vehicle that is put where another program has driven it.

    Of the wall and of the CPU, in each step; shape ``(2, N)``.
    """
    times = []
    with tempfile.TemporaryDirectory() as root:
        entry = Workspace.open(Path(root)).add_map(MAP)
        [net] = entry.folder.rglob("net.net.xml")
        lanes, (dx, dy) = entry.graph().lanes, entry.lane_table().net_offset
        rows = np.linspace(0, len(lanes.x) - 1, VEHICLES).astype(int)
        x, y, hdg = lanes.x[rows] + dx, lanes.y[rows] + dy, lanes.hdg[rows]
        angle = np.mod(90.0 - np.degrees(hdg), 360.0)
        with open_session(["-n", str(net), "--step-length", "0.1", "--no-step-log"]) as session:
            for number in range(TICKS):
                places = np.column_stack(
                    [x + 0.1 * number * np.cos(hdg), y + 0.1 * number * np.sin(hdg), angle]
                )
                users = [
                    ForeignUser(str(row), "passenger", *place, 1.0, 4.5, 1.8)
                    for row, place in enumerate(places.tolist())
                ]
                start = np.array([time.perf_counter(), time.thread_time()])
                session.foreign_traffic().show(users)
                now = np.array([time.perf_counter(), time.thread_time()])
                times.append((now - start) / VEHICLES * 1e6)
                session.step()
    return np.array(times[1:]).T


def _show(server: Server, mirror: Mirror, wheels: Wheels, step: Step) -> None:
    for batch in mirror.batches(step, (1.0,)):
        batch.wheels.update(wheels.turned(step, mirror.actors))
        mirror.answered(server.apply(batch))


def _peer(address: Address, ticks: int) -> list[float]:
    carla = import_carla()
    client = carla.Client(address.host, address.port)
    client.set_timeout(10.0)
    world = client.get_world()
    world.tick()
    actors: dict[int, Any] = {}
    for actor in world.get_actors():
        role = actor.attributes.get("role_name", "")
        if role.startswith(ROLE):
            actors[int(role.removeprefix(ROLE + "a"))] = actor
    times = []
    for number in range(ticks):
        step = _step(number)
        start = time.perf_counter()
        for row in step.index.tolist():
            at = carla.Transform(
                carla.Location(step.x[row], -step.y[row], 0.0),
                carla.Rotation(0.0, -np.degrees(step.hdg[row]), 0.0),
            )
            actors[row].set_transform(at)
            actors[row].set_target_velocity(carla.Vector3D(step.speed[row], 0.0, 0.0))
        world.tick()
        times.append(time.perf_counter() - start)
    return times


def _plan() -> Plan:
    kinds = ("car", "van", "truck", "bus", "motorcycle", "bicycle")
    actors = [
        PlannedActor(
            f"a{row}",
            kinds[row % len(kinds)] if row < VEHICLES else "pedestrian",
            "", None, 0.0, 4.5, 1.8, 0.0, 0.0, 0.0, 0.0, ego=not row,
        )
        for row in range(VEHICLES + WALKERS)
    ]  # fmt: skip
    return Plan("bench", 0, 60.0, DELTA, (0.0, 0.0), tuple(actors))


def _step(number: int) -> Step:
    """Everybody on a grid of 20 m, circling; brake lights come and go."""
    count = VEHICLES + WALKERS
    row = np.arange(count)
    turn = 0.02 * number + row
    return Step(
        time=number * DELTA,
        index=row,
        ids=row.astype(np.str_),
        x=20.0 * (row % 20) + 2.0 * np.cos(turn),
        y=20.0 * (row // 20) + 2.0 * np.sin(turn),
        z=np.zeros(count),
        hdg=np.mod(turn, 2 * np.pi) - np.pi,
        pitch=np.zeros(count),
        speed=np.full(count, 1.5),
        signals=np.where((row + number) % 10 == 0, 8, 0),
    )


if __name__ == "__main__":
    main()
