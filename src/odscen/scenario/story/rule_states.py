"""What a rule has done in a run, and what it does."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclass
class Running:
    """An action that runs: its place in the item of ``then``, and when it is over."""

    number: int
    end: float

    def state(self) -> dict[str, Any]:
        """Values that JSON can hold."""
        return {"number": self.number, "end": None if self.end == math.inf else self.end}

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> Running:
        """Inverse of :meth:`state`."""
        return cls(state["number"], math.inf if state["end"] is None else state["end"])


@dataclass
class RuleState:
    """A rule: how often it has fired, what it does, and when it may fire again.

    ``started`` and ``ended`` have the first instant of each, if there was one.
    """

    fired: int = 0
    ready: float = 0.0
    item: int | None = None
    running: list[Running] = field(default_factory=list)
    started: list[float] = field(default_factory=list)
    ended: list[float] = field(default_factory=list)
