"""A small study of a shipped map, and an executor that makes up what comes out."""

from __future__ import annotations

import json
import zlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from odscen.experiments.work import Outcome
from tests.sumo.story_case import entry, workspace

if TYPE_CHECKING:
    from collections.abc import Iterator

    from odscen.experiments.work import Orders
    from odscen.maps.store import Workspace

SCENARIO = Path(__file__).parents[2] / "suites" / "scenarios" / "signal_crossing.scenario.json"
WARM = {"name": "slow", "edits": [{"kind": "set_simulation", "duration": 20}]}


def place() -> Workspace:
    entry("signal_crossing")
    return workspace()


def short_scenario(folder: Path, *, seconds: float = 15.0) -> Path:
    """A shipped scenario whose first flow has its volume from a parameter."""
    data = json.loads(SCENARIO.read_text(encoding="utf-8"))
    data["simulation"]["duration"] = seconds
    data["flows"][0]["per_hour"] = "60 * $per_minute"
    data["parameters"] = {"per_minute": {"value": 3, "min": 1, "max": 20}}
    file = folder / "crossing.scenario.json"
    file.write_text(json.dumps(data), encoding="utf-8")
    return file


def plan_file(folder: Path, **parts: Any) -> Path:
    """A plan of that scenario; two seeds if ``parts`` do not say otherwise."""
    if not (folder / "crossing.scenario.json").exists():
        short_scenario(folder)
    data = {"name": "study", "scenarios": ["crossing.scenario.json"], "seeds": 2, **parts}
    file = folder / "plan.json"
    file.write_text(json.dumps(data), encoding="utf-8")
    return file


@dataclass
class MadeUp:
    """Gives rows that follow from the names of runs, in another order than asked for.

    It dies after ``most`` runs, and gives each outcome ``times`` times.
    """

    most: int | None = None
    times: int = 1
    broken: frozenset[str] = frozenset()
    ran: list[str] = field(default_factory=list)

    def outcomes(self, orders: Orders) -> Iterator[list[Outcome]]:
        while (order := orders.next(3)) is not None:
            for run, _ in reversed(order.runs):
                if len(self.ran) == self.most:
                    raise KeyboardInterrupt
                self.ran.append(run.name)
                yield [Outcome(run.name, self.row(run.name))] * self.times

    def row(self, name: str) -> dict[str, Any]:
        if name in self.broken:
            return {"status": "failed", "detail": "out of luck", "seconds": len(self.ran) * 0.1}
        speed = zlib.crc32(name.encode()) % 1000 / 10
        return {"status": "completed", "mean_speed": speed, "seconds": len(self.ran) * 0.1}
