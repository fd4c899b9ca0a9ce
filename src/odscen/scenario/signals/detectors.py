"""Which movements a detector is for."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.scenario.signals.light import SignalMovement


def detector_movements(at: str, movements: Sequence[SignalMovement]) -> tuple[int, ...]:
    """Movements over the lanes of an approach (``r12``), or of one lane (``12.0.-1``)."""
    return tuple(
        n for n, one in enumerate(movements) if not one.walk and at in (one.approach, one.lanes[0])
    )
