"""A run in step with another simulator: a step when asked to, and all that is to know after it.

A :class:`~odscen.sumo.worker.protocol.State` is followed by little-endian float64 rows, one for
each vehicle and person of the plan that is on the road:

====== =====================================================================================
row    index, x, y, angle_deg, speed, signals, lane, pos
====== =====================================================================================

``index`` is the actor's row in the plan; x, y, angle_deg are SUMO's own (front, SUMO frame), for
height and slope, which the body centre needs, are not known to SUMO. ``lane`` counts the names of
lanes reported so far, -1 for none. ``pos`` is metres along it.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from odscen.records.run_events import EventKind, event_row
from odscen.sumo.worker.protocol import Command, EgoPose, MoreRules, Outside, State, decode

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np

    from odscen.records.run_plan import Plan
    from odscen.sumo.worker.protocol import Lockstep, Message
    from odscen.sumo.worker.recorder import Recorder
    from odscen.sumo.worker.simulation.observed import Poses
    from odscen.sumo.worker.simulation.session import Session

COLUMNS = 8

INVALID = 1e8
"""SUMO's INVALID_DOUBLE_VALUE is -2^30; no place is this far out."""

_BLOCK = 65536
_COMMANDS = Command | EgoPose | Outside | MoreRules
_PLAIN = (EventKind.DEPARTED, EventKind.ARRIVED)


class LockstepWatch:
    """The worker's side.

    Parameters
    ----------
    how
        Who is driven from outside.
    commands
        File descriptor that commands arrive on. When its other end is closed (the program that
        started the run is gone) the run is to stop.
    send
        Sends a message, and bytes after it.

    Attributes
    ----------
    stopped
        Whether the run has been ended before its time.
    rules
        Whether rules may come between steps; they act when the next step is asked for.
    placed
        Vehicle that another program drives, if there is one.
    heard
        Rules that have come and not been taken: texts of story files.
    """

    def __init__(
        self, plan: Plan, how: Lockstep, commands: int, send: Callable[[Message, bytes], None]
    ) -> None:
        self.stopped = False
        self.rules = how.rules
        self.heard: list[str] = []
        self._row = {actor.id: row for row, actor in enumerate(plan.actors)}
        self.placed = plan.actors[how.placed].id if how.placed >= 0 else None
        self._step_length = plan.step_length
        self._commands = commands
        self._rest = b""
        self._queue: list[Command | EgoPose | Outside | MoreRules] = []
        self._send = send
        self._steps = 0
        self._reported = 0
        self._lights: dict[str, str] = {}
        self._seen: tuple[float, np.ndarray] | None = None
        self._lane: dict[str, int] = {"": -1}
        self._told_lanes = 1

    @property
    def drives(self) -> bool:
        """Whether another program drives a vehicle, or may give rules."""
        return self.rules or self.placed is not None

    def next_step(self, session: Session, recorder: Recorder) -> bool:
        """Tell of the step just made and obey until the next; false if the run is to stop."""
        self.show(session, recorder)
        while True:
            command = self._next_command()
            if isinstance(command, EgoPose):
                if self.placed is not None:
                    session.place(self.placed, command)
            elif isinstance(command, Outside):
                session.foreign_traffic().show(command.users)
                session.foreign_lights.show(command.lights)
            elif isinstance(command, MoreRules):
                self.heard.append(command.story)
            elif command.do == "step":
                self._steps += 1
                return True
            elif command.do == "stop":
                self.stopped = True
                return False

    def show_last(self, session: Session, recorder: Recorder) -> None:
        """Tell of the last step."""
        self.show(session, recorder)

    def look(self, session: Session) -> None:
        """See where all are before rules act on the step: who vanishes then was there in it.

        One that is added then, or a person whose walk is changed, is elsewhere for SUMO at once.
        """
        self._seen = session.time, self._rows_of(session)

    def show(self, session: Session, recorder: Recorder) -> None:
        """Report the step just made; there is nothing to report before the first."""
        if not self._steps:
            return
        if self._seen is None or self._seen[0] != session.time:
            self.look(session)
        assert self._seen is not None
        rows = self._seen[1].tobytes()
        states = session.light_states()
        changed = {name: state for name, state in states.items() if self._lights.get(name) != state}
        self._lights = states
        events, self._reported = recorder.events[self._reported :], len(recorder.events)
        state = State(
            size=len(rows),
            time=session.time - self._step_length,
            lights=changed,
            lanes=list(self._lane)[self._told_lanes :],
            departed=recorder.departed,
            arrived=recorder.arrived,
            incidents=[event_row(event) for event in events if event.kind not in _PLAIN],
        )
        self._told_lanes = len(self._lane)
        self._send(state, rows)

    def _rows_of(self, session: Session) -> np.ndarray:
        import numpy as np

        vehicles, persons = session.vehicle_poses(), session.person_poses()
        doors = session.stop_doors.signals(vehicles.ids, session.time)
        vehicles = vehicles._replace(signals=vehicles.signals | doors)
        return np.concatenate(
            [
                self._rows_to_send(vehicles, session.vehicle_places(vehicles.ids)),
                self._rows_to_send(persons, session.person_places(persons.ids)),
            ]
        )

    def _rows_to_send(self, poses: Poses, places: list[tuple[str, float]]) -> np.ndarray:
        import numpy as np

        rows = np.empty((len(poses.ids), COLUMNS), dtype="<f8")
        rows[:, 0] = [self._row.get(name, -1) for name in poses.ids]
        rows[:, 1] = poses.x
        rows[:, 2] = poses.y
        rows[:, 3] = poses.angle_deg
        rows[:, 4] = poses.speed
        rows[:, 5] = poses.signals
        rows[:, 6] = [self._lane.setdefault(lane, len(self._lane) - 1) for lane, _ in places]
        rows[:, 7] = [pos for _, pos in places]
        return rows[(rows[:, 0] >= 0) & (np.abs(rows[:, 1]) < INVALID)]

    def _next_command(self) -> Command | EgoPose | Outside | MoreRules:
        """Wait for the next command; to stop, once there is no one to give one."""
        while not self._queue:
            block = os.read(self._commands, _BLOCK)
            if not block:
                return Command("stop")
            *lines, self._rest = (self._rest + block).split(b"\n")
            heard = (decode(line) for line in lines)
            self._queue += [message for message in heard if isinstance(message, _COMMANDS)]
        return self._queue.pop(0)
