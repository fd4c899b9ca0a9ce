"""The process in which CARLA's Traffic Manager lives, for it may end its process at any time.

What happens is reported tick by tick over a pipe: whatever becomes of this process, the one that
started it has all until then.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from odscen.base.errors import CarlaError, OdscenError
from odscen.carla.native.native_traffic import Traffic
from odscen.carla.sensors.camera import View, watch_from_above
from odscen.carla.sensors.pictures import Wish
from odscen.carla.server.batch import ENOUGH_TRIES
from odscen.carla.server.blueprints import choose_blueprints
from odscen.carla.server.carla_server import Server
from odscen.carla.server.server_map import ensure_map
from odscen.sumo.worker.output_capture import captured_output
from odscen.sumo.worker.protocol import Done, Failed

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from multiprocessing.connection import Connection
    from pathlib import Path

    import numpy as np

    from odscen.carla.native.native_plan import NativeActor
    from odscen.carla.sensors.camera import Camera
    from odscen.carla.server.client import Address
    from odscen.records.run_events import Event
    from odscen.records.run_plan import Plan
    from odscen.simulators.assets import Assets

NO_NAVIGATION = (
    "the world has no navigation mesh: pedestrians are led along their routes and do not look "
    "around them"
)

FREED = (
    "CARLA's Traffic Manager waited for its own thread in {} ticks and was freed after 2 s each "
    "(issue 9172 of carla-simulator/carla)"
)

ROAD_ENDS = (
    "the Traffic Manager removed {} vehicles {:.0f} to {:.0f} m before their goals, "
    "where it saw the road end; they count as arrived"
)


@dataclass(frozen=True, slots=True)
class NativeJob:
    """All that the worker needs.

    Attributes
    ----------
    delta
        Simulated seconds of a tick.
    xodr
        OpenDRIVE text of the scenario's map.
    view
        Where a camera begins.
    watched
        Whether pictures are also to be reported, as JPEG.
    """

    address: Address
    plan: Plan
    assets: Assets
    actors: tuple[NativeActor, ...]
    delta: float
    map_name: str
    xodr: str
    log: Path
    view: View
    weather: Mapping[str, float] = field(default_factory=dict)
    load_map: bool = True
    physics: bool = True
    pictures: Wish = field(default_factory=Wish)
    watched: bool = False


@dataclass(frozen=True, slots=True)
class Tick:
    """What a tick has brought; rows as :meth:`odscen.carla.native.native_traffic.Traffic.rows`.

    ``own`` are the actors that would be left on the server if this process ended now.
    """

    time: float
    rows: np.ndarray
    events: tuple[Event, ...]
    notes: tuple[str, ...]
    running: int
    own: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Note:
    """Something to know of the run, in words."""

    words: str


@dataclass(frozen=True, slots=True)
class Shot:
    """A picture as JPEG."""

    jpeg: bytes


Told = Tick | Note | Shot | Done | Failed


def work(job: NativeJob, pipe: Connection) -> None:
    """Run a job; tells of it over ``pipe``, and stops when anything is said there."""
    # Ctrl-C is for the process that started this one, which then says so.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    sending = threading.Lock()

    def tell(message: Told) -> None:
        with sending:
            pipe.send(message)

    def asked() -> bool:
        """Whether this is to end. Takes what was said: unread, it would cut off our last words."""
        if not pipe.poll():
            return False
        with suppress(EOFError):  # the listener is gone
            pipe.recv()
        return True

    with captured_output(job.log):
        try:
            tell(_run_job(job, tell, asked))
        except OdscenError as error:
            tell(Failed(str(error)))
        except RuntimeError as error:  # the client's own, met outside of our door
            tell(Failed(f"the CARLA server at {job.address}: {error}"))
        except OSError:  # no one listens any more
            pass
        sys.stdout.flush()
    pipe.close()
    # The Traffic Manager's threads may turn an orderly exit into an abort.
    os._exit(0)


def _run_job(job: NativeJob, tell: Callable[[Told], None], asked: Callable[[], bool]) -> Done:
    with ExitStack() as stack:
        server = stack.enter_context(Server(job.address))
        ensure_map(server, job.map_name, job.xodr, load=job.load_map)
        server.synchronize(job.delta)
        server.set_weather(job.weather)
        names = choose_blueprints(job.plan.actors, job.assets, server.library())
        traffic = Traffic(server, job.actors, names, seed=job.plan.seed, physics=job.physics)
        stack.callback(traffic.close)
        camera = None
        if job.pictures.any or job.watched:
            shoot = (lambda jpeg: tell(Shot(jpeg))) if job.watched else None
            camera = stack.enter_context(watch_from_above(server, job.view, job.pictures, shoot))
        if not traffic.has_navigation and any(actor.person for actor in job.actors):
            tell(Note(NO_NAVIGATION))
        done = _step_until_done(job, tell, asked, traffic, camera)
    for words in server.left_behind:
        tell(Note(words))
    return done


def _step_until_done(
    job: NativeJob,
    tell: Callable[[Told], None],
    asked: Callable[[], bool],
    traffic: Traffic,
    camera: Camera | None,
) -> Done:
    begin, steps, now, stopped, made = time.perf_counter(), 0, 0.0, False, False
    ego = next((actor.row for actor in job.actors if actor.ego), None)
    while now < job.plan.until - job.delta / 2 and traffic.expected and not stopped:
        happened = traffic.step(now, job.delta)
        made = made or traffic.running > 0
        if not made and traffic.most_tries >= ENOUGH_TRIES:
            refused = traffic.refusals()
            raise CarlaError(
                f"the CARLA server at {job.address} takes no road user, {len(refused)} were "
                f"tried: {next(iter(refused.values()))}"
            )
        rows = traffic.rows(job.delta)
        events, notes = tuple(happened.events), tuple(happened.notes)
        tell(Tick(now, rows, events, notes, traffic.running, traffic.own))
        if camera is not None and ego is not None:
            for row in rows[rows[:, 0] == ego]:
                camera.follow(row[1], row[2], row[3])
        steps += 1
        now = steps * job.delta
        stopped = asked()
    if traffic.road_ends:
        low, high = min(traffic.road_ends), max(traffic.road_ends)
        tell(Note(ROAD_ENDS.format(len(traffic.road_ends), low, high)))
    if traffic.freed:
        tell(Note(FREED.format(traffic.freed)))
    for actor, reason in traffic.refusals().items():
        tell(Note(f"{actor}: the server would not take it: {reason}"))
    return Done(now, steps, time.perf_counter() - begin, stopped)
