"""Which movements a detector is for, and signals that need none."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.scenario.document.signals_document import Signals
    from odscen.scenario.signals.light import SignalMovement


def detector_movements(at: str, movements: Sequence[SignalMovement]) -> tuple[int, ...]:
    """Movements over the lanes of an approach (``r12``), or of one lane (``12.0.-1``)."""
    return tuple(
        n for n, one in enumerate(movements) if one.drive and at in (one.approach, one.lanes[0])
    )


def without_detectors(signals: Signals) -> Signals:
    """All lights fixed-time and every stage in every cycle: the mesoscopic model sees nobody."""
    junctions = [
        timing.model_copy(
            update={
                "control": None,
                "stages": tuple(
                    stage.model_copy(update={"on_call": False}) for stage in timing.stages
                ),
            }
        )
        for timing in signals.junctions
    ]
    return signals.model_copy(update={"control": "fixed", "junctions": tuple(junctions)})
