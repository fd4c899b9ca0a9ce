"""Messages between the runner and the worker: JSON, one object per line, either way.

A run that can be watched (see :mod:`odscen.sumo.runner.live_run`) also sends frames: a line
:class:`FrameMessage` and then so many bytes. A run in lockstep (see
:mod:`odscen.sumo.worker.lockstep`) sends a :class:`State` and its bytes after each step. A run that
no one can watch sends :class:`Progress` and its end only.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field, fields
from typing import Any, Literal, NamedTuple

from odscen.runs.reporter import Progress


@dataclass(frozen=True, slots=True)
class Done:
    """The run has ended without an error: simulated seconds, steps, wall seconds of the simulation.

    ``stopped`` if a user who watched it has ended it before its time; ``left`` if the results have
    not been made yet.
    """

    sim_seconds: float
    steps: int
    wall_seconds: float
    stopped: bool = False
    left: Left | None = None


@dataclass(frozen=True, slots=True)
class Left:
    """What the results of a run are made of, beside the files that SUMO has written.

    ``lengths`` are those of lanes, m, by edge; ``recorded`` is what the recorder hands over.
    """

    lengths: dict[str, dict[str, float]]
    recorded: dict[str, Any]


@dataclass(frozen=True, slots=True)
class Failed:
    """The run has ended in an error; ``reason`` is one line, the log has SUMO's words."""

    reason: str


@dataclass(frozen=True, slots=True)
class FrameMessage:
    """Everyone's place after a step; ``size`` bytes follow the line, see ``sumo.snapshots``."""

    size: int


@dataclass(frozen=True, slots=True)
class Lights:
    """State of each traffic light that has changed since the last such message, by SUMO id."""

    states: dict[str, str]


@dataclass(frozen=True, slots=True)
class Detectors:
    """Detectors of lights that a road user came onto or left since the last such message.

    By SUMO id, with whether they are occupied.
    """

    occupied: dict[str, bool]


@dataclass(frozen=True, slots=True)
class Incidents:
    """Events worth a mark on the map, as in ``events.json``: conflicts, jumps, hard stops."""

    events: list[dict[str, Any]] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Pace:
    """How the run goes on: ``speed`` in simulated seconds per second, ``None`` as fast as it can.

    As a message, what is so now; as an argument of the worker, how to start. A run that starts
    ``paused`` makes its first step, so that there is something to see.
    """

    paused: bool = False
    speed: float | None = None


@dataclass(frozen=True, slots=True)
class Command:
    """To the worker; ``speed`` belongs to ``speed``, and ``frame`` asks for the next frame."""

    do: Literal["pause", "resume", "step", "speed", "stop", "frame"]
    speed: float | None = None


@dataclass(frozen=True, slots=True)
class Lockstep:
    """As an argument of the worker: make a step only when asked to, and report all after each.

    ``placed`` is the row in the plan of a vehicle that another program drives, -1 for none. With
    ``rules``, more of them may come between steps, and all act when the next step is asked for.
    """

    placed: int = -1
    rules: bool = False


@dataclass(frozen=True, slots=True)
class State:
    """All after one step; ``size`` bytes follow the line, see ``sumo.lockstep``.

    Attributes
    ----------
    time
        Simulated seconds at which the step began, as in the recorded trajectories.
    lights
        State of each traffic light that has changed, by SUMO id.
    lanes
        Ids of SUMO lanes seen for the first time; rows count all of them in this order.
    departed, arrived
        Road users so far.
    incidents
        As in ``events.json``, new ones.
    """

    size: int
    time: float
    lights: dict[str, str] = field(default_factory=dict)
    lanes: list[str] = field(default_factory=list)
    departed: int = 0
    arrived: int = 0
    incidents: list[dict[str, Any]] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class EgoPose:
    """To the worker: the vehicle that another program drives; front, SUMO frame, m/s."""

    x: float
    y: float
    angle_deg: float
    speed: float


class ForeignUser(NamedTuple):
    """A road user that another program drives; front, SUMO frame, metres and m/s.

    ``kind`` is SUMO's class of vehicles, or ``pedestrian``.
    """

    id: str
    kind: str
    x: float
    y: float
    angle_deg: float
    speed: float
    length: float
    width: float


@dataclass(frozen=True, slots=True)
class Outside:
    """To the worker: what other programs drive and switch until the next such message.

    Attributes
    ----------
    users
        All road users that are driven elsewhere, the ego not among them.
    lights
        State of traffic lights that are switched elsewhere, by SUMO id, a letter for each link
        (``-``: not known): those that have changed.
    """

    users: list[ForeignUser] = field(default_factory=list)
    lights: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class MoreRules:
    """To the worker: rules from now on, as the text of a story file."""

    story: str


@dataclass(frozen=True, slots=True)
class ShotMessage:
    """A camera's picture of a mirrored run; ``size`` bytes of JPEG follow the line."""

    size: int


Message = (
    Progress
    | Done
    | Failed
    | FrameMessage
    | Lights
    | Detectors
    | Incidents
    | Pace
    | Lockstep
    | State
    | ShotMessage
)

_KINDS: dict[str, type[Message | Command | EgoPose | Outside | MoreRules]] = {
    "progress": Progress,
    "done": Done,
    "failed": Failed,
    "frame": FrameMessage,
    "lights": Lights,
    "detectors": Detectors,
    "incidents": Incidents,
    "pace": Pace,
    "lockstep": Lockstep,
    "state": State,
    "shot": ShotMessage,
    "place": EgoPose,
    "outside": Outside,
    "rules": MoreRules,
    "command": Command,
}
_NAMES = {kind: name for name, kind in _KINDS.items()}


def encode(message: Message | Command | EgoPose | Outside | MoreRules) -> str:
    """One line, newline included."""
    return (
        json.dumps(
            {"kind": _NAMES[type(message)], **_shallow_fields(message)}, default=_shallow_fields
        )
        + "\n"
    )


def _shallow_fields(record: Any) -> dict[str, Any]:
    """What ``asdict`` gives, one level; it would copy each text."""
    return {field.name: getattr(record, field.name) for field in fields(record)}


def decode(line: str | bytes) -> Message | Command | EgoPose | Outside | MoreRules | None:
    """Inverse of :func:`encode`; ``None`` for a line that is no message."""
    try:
        data = json.loads(line)
        kind = _KINDS[data.pop("kind")]
        if kind is Outside:
            data["users"] = [ForeignUser(*user) for user in data["users"]]
        elif kind is Done and data.get("left") is not None:
            data["left"] = Left(**data["left"])
        return kind(**data)
    except (ValueError, KeyError, TypeError, AttributeError):
        return None
