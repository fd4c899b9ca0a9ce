"""Greens that last longer while vehicles follow each other: how a light runs if nobody times it.

No greens suit a demand that is not known (``docs/signals.md``): with fixed ones full towns lock,
which lights that wait for the end of queues carry. So the programs of a network that is made here
are SUMO's ``actuated`` ones, with the stages of the map and their greens as the shortest.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Sequence

LONGEST_CYCLE = 120.0
"""Seconds; HCM advises against longer ones."""

CONTROL_PARAM = "odscen.control"
"""Parameter that says what control the program is meant to have."""

STAGES_PARAM, MAP_STAGES = "odscen.stages", "map"
"""Parameter of a program that calls or extends the stages of the map, and its value."""

EXTENDING_GAP = 2.0
"""Seconds between vehicles that end an extended green, as SUMO's ``max-gap``."""

EXTENDED_PARAMS = {
    STAGES_PARAM: MAP_STAGES,
    "max-gap": f"{EXTENDING_GAP:g}",
    CONTROL_PARAM: "extended",
}
"""Parameters of a ``<tlLogic>`` whose greens are extended."""


class BoundedPhase(Protocol):
    """A phase that vehicles may prolong if it has a longest duration above its least."""

    @property
    def least(self) -> float:
        """Seconds."""

    @property
    def most(self) -> float:
        """Seconds."""


def longer_by(phases: Sequence[BoundedPhase], cycle: float) -> float:
    """Seconds by which each green for vehicles may last longer than planned.

    All together up to a cycle of :data:`LONGEST_CYCLE`: greens in proportion would give most to
    those that have most, though nothing is known of the demand.

    Parameters
    ----------
    phases
        Of the program; those with bounds are prolonged.
    cycle
        Seconds of all phases.
    """
    greens = sum(phase.most > phase.least for phase in phases)
    return round(max(0.0, LONGEST_CYCLE - cycle) / greens, 1) if greens else 0.0
