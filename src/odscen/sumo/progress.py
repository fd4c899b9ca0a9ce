"""Messages from the worker to the runner: JSON, one object per line."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a run is: simulated seconds, counts of vehicles and persons."""

    time: float
    until: float
    running: int
    departed: int
    arrived: int
    planned: int

    @property
    def share(self) -> float:
        """Share done, 0 to 1: of the time, or of the arrivals if those are further on."""
        arrivals = self.arrived / self.planned if self.planned else 0.0
        return min(1.0, max(self.time / self.until, arrivals))


@dataclass(frozen=True, slots=True)
class Done:
    """The run has ended by itself: simulated seconds, steps, wall seconds of the simulation."""

    sim_seconds: float
    steps: int
    wall_seconds: float


@dataclass(frozen=True, slots=True)
class Failed:
    """The run has ended in an error; ``reason`` is one line, the log has SUMO's words."""

    reason: str


Message = Progress | Done | Failed
OnProgress = Callable[[Progress], None]

_KINDS: dict[str, type[Message]] = {"progress": Progress, "done": Done, "failed": Failed}
_NAMES = {kind: name for name, kind in _KINDS.items()}


def encode(message: Message) -> str:
    """One line, newline included."""
    return json.dumps({"kind": _NAMES[type(message)], **asdict(message)}) + "\n"


def decode(line: str) -> Message | None:
    """Inverse of :func:`encode`; ``None`` for a line that is no message."""
    try:
        data = json.loads(line)
        return _KINDS[data.pop("kind")](**data)
    except (ValueError, KeyError, TypeError, AttributeError):
        return None
