"""Recorded motion for an actor: from a table, or from an earlier run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.app.exchange.recorded_traffic import read_recorded_traffic
from odscen.base.errors import ScenarioError, in_file
from odscen.formats.tracks.recorded_traffic import trajectory_rows
from odscen.scenario.document.problems import validated
from odscen.scenario.document.rules_document import StoryRule

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.scenario.document.scenario_document import Scenario


def attach_trajectory(
    scenario: Scenario,
    source: Path,
    *,
    actor: str,
    of: str | None = None,
    begin: float | None = None,
) -> Scenario:
    """Let an actor do what a recorded one did: it appears where that begins.

    The recording becomes part of the scenario: a rule ``replay-ACTOR`` with its rows, in place of
    one that there may be.

    Parameters
    ----------
    source
        As of :func:`~odscen.app.exchange.recorded_traffic.read_recorded_traffic`.
    of
        Who was recorded; not needed if there is one only.
    begin
        Second of the run at which it begins; as recorded if not given. At the earliest after one
        step.

    Raises
    ------
    InputError
        If the source cannot be read, or is no trajectory.
    ScenarioError
        If there is no such actor, or its id is too long for a rule.
    """
    if actor not in {actor.id for actor in scenario.actors}:
        known = ", ".join(actor.id for actor in scenario.actors[:8]) or "none"
        raise ScenarioError(f"there is no actor {actor!r}; there are {known}")
    with in_file(str(source)):
        recorded, rows = trajectory_rows(read_recorded_traffic(source).rows, of=of)
    name, step = f"replay-{actor}", scenario.simulation.step_length
    starts = max(recorded if begin is None else begin, step)
    (_, x, y, hdg), (seconds, x1, y1, _) = rows[:2]
    speed = ((x1 - x) ** 2 + (y1 - y) ** 2) ** 0.5 / seconds
    rule = validated(
        StoryRule,
        {
            "id": name,
            "actor": actor,
            # One step earlier: who appears is on the road with the next step.
            "when": {"time": {"after": round(starts - step, 6)}},
            "then": [
                {"appear": {"at": [x, y, hdg], "speed": min(speed, 100.0)}},
                {"replay": {"rows": rows}},
            ],
        },
    )
    others = tuple(rule for rule in scenario.rules if rule.id != name)
    return scenario.model_copy(update={"rules": (*others, rule)})
