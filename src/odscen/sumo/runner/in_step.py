"""The runner's side of a run in lockstep: each state as values, and the word to go on."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from odscen.base.categories import Category
from odscen.base.frames import SumoPose
from odscen.sumo.worker.lockstep import COLUMNS
from odscen.sumo.worker.protocol import (
    Command,
    EgoPose,
    Lockstep,
    MoreRules,
    Outside,
    State,
    encode,
)

if TYPE_CHECKING:
    import subprocess
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    from odscen.records.run_plan import Plan
    from odscen.sumo.runner.elevation import ElevationLookup
    from odscen.sumo.worker.protocol import Message


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """Everyone after one step; body centres in the OpenDRIVE frame, arrays of shape ``(N,)``.

    Attributes
    ----------
    time
        Simulated seconds at which the step began, as in the recorded trajectories.
    index
        Row of the plan, each at most once.
    ids
        Id of each road user, as in the scenario; ``<flow>.<k>`` of those that a flow made.
    x, y, z, hdg, pitch
        Metres and radians, ``hdg`` counter-clockwise from +x; z is the ground below the centre,
        pitch its slope, positive uphill.
    speed
        m/s.
    signals
        SUMO's bits, see :class:`~odscen.sumo.worker.simulation.observed.VehicleSignal`.
    lights
        State of every traffic light by SUMO id.
    departed, arrived
        Road users so far.
    incidents
        New events but departures and arrivals, as in ``events.json``.
    """

    time: float
    index: NDArray[np.int64]
    ids: NDArray[np.str_]
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    z: NDArray[np.float64]
    hdg: NDArray[np.float64]
    pitch: NDArray[np.float64]
    speed: NDArray[np.float64]
    signals: NDArray[np.int64]
    lights: Mapping[str, str] = field(default_factory=dict)
    departed: int = 0
    arrived: int = 0
    incidents: Sequence[Mapping[str, Any]] = ()


class InStep:
    """A companion of a run that is called after each step.

    Parameters
    ----------
    on_step
        Called with each step; returns where the vehicle driven from outside is before the next
        step, if there is one. May call :meth:`stop`; must not raise.
    placed
        Row in the plan of the vehicle that is driven from outside.
    rules
        Whether rules may be given between steps, with :meth:`add_rules`.

    Attributes
    ----------
    failure
        Why the run was stopped, if that is a failure.

    Notes
    -----
    Without any of these and without :meth:`show_outside` SUMO makes its next step while
    ``on_step`` works on the last one.
    """

    def __init__(
        self,
        plan: Plan,
        ground: ElevationLookup,
        on_step: Callable[[Step], EgoPose | None],
        *,
        placed: int | None = None,
        rules: bool = False,
    ) -> None:
        self._plan = plan
        self._ground = ground
        self._on_step = on_step
        self._placed = placed
        self._rules = rules
        self._waits = rules or placed is not None
        self._ids = np.array([actor.id for actor in plan.actors], dtype=np.str_)
        self._lengths = np.array([actor.length for actor in plan.actors])
        self._z = np.array([actor.z for actor in plan.actors])
        self._walks = np.array([actor.category == Category.PEDESTRIAN for actor in plan.actors])
        self._lanes: list[str] = []
        self._lights: dict[str, str] = {}
        self.failure: str | None = None
        self._stdin: IO[bytes] | None = None
        self._stopped = False

    @property
    def start(self) -> Lockstep:
        """How the worker is to go."""
        return Lockstep(-1 if self._placed is None else self._placed, self._rules)

    def attach(self, process: subprocess.Popen[bytes]) -> None:
        """Let the worker make its first step."""
        self._stdin = process.stdin
        self._send_command(Command("step"))

    def take(self, message: Message, payload: bytes) -> None:
        """Work on a step."""
        if not isinstance(message, State):
            return
        waited = self._waits
        if not waited and not self._stopped:
            self._send_command(Command("step"))
        step = self._make_step(message, payload)
        if self._stopped:
            return
        driven = self._on_step(step)
        if driven is not None:
            self._send_command(driven)
        if waited and not self._stopped:
            self._send_command(Command("step"))

    def detach(self) -> None:
        """Close the way to the worker, which has ended."""
        if self._stdin is not None:
            with suppress(OSError):
                self._stdin.close()
        self._stdin = None

    def stop(self, failure: str | None = None) -> None:
        """End the run, which has failed if there is a reason; its results so far are written."""
        self.failure = self.failure or failure
        if not self._stopped:
            self._stopped = True
            self._send_command(Command("stop"))

    def show_outside(self, outside: Outside) -> None:
        """Let SUMO see what other programs drive and switch; it waits for that from now on.

        To be called by ``on_step``. SUMO sees it in its next step; the first time, in the one after
        that, unless it waits already.
        """
        self._waits = True
        self._send_command(outside)

    def add_rules(self, story: str) -> None:
        """Give the worker rules, the text of a story file, while it waits for the next step."""
        self._send_command(MoreRules(story))

    def _send_command(self, command: Command | EgoPose | Outside | MoreRules) -> None:
        if self._stdin is None:
            return
        with suppress(OSError, ValueError):  # the worker has just ended
            self._stdin.write(encode(command).encode())
            self._stdin.flush()

    def _make_step(self, state: State, payload: bytes) -> Step:
        self._lanes += state.lanes
        self._lights |= state.lights
        rows = np.frombuffer(payload, dtype="<f8").reshape(-1, COLUMNS)
        index = rows[:, 0].astype(np.int64)
        lane, pos = rows[:, 6].astype(np.int64), rows[:, 7]
        near = self._z[index]
        for row, (number, along) in enumerate(zip(lane.tolist(), pos.tolist(), strict=True)):
            known = self._ground.height(self._lanes[number], along) if number >= 0 else None
            if known is not None:
                near[row] = known
        pose = self._ground.centres(
            SumoPose(rows[:, 1], rows[:, 2], 0.0, rows[:, 3]),
            self._lengths[index],
            self._plan.net_offset,
            near,
            self._walks[index],
        )
        x, y, z, hdg, pitch = (np.asarray(part, dtype=np.float64) for part in pose)
        self._z[index] = z
        return Step(
            time=state.time,
            index=index,
            ids=self._ids[index],
            x=x,
            y=y,
            z=z,
            hdg=hdg,
            pitch=pitch,
            speed=rows[:, 4],
            signals=rows[:, 5].astype(np.int64),
            lights=dict(self._lights),
            departed=state.departed,
            arrived=state.arrived,
            incidents=state.incidents,
        )
