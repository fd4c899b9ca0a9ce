"""Whom the story drives along a lane covers on the ground the metres that its speed says.

All lanes of an edge of SUMO's have one length, so that beside the middle of a road a bend is driven
too fast or too slowly, and one that leads beside its lane drives its own bend.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.scenario.story.road_view import ActorView

_MOST = 0.15
"""Share by which a speed is changed at most; what differs by more has been put somewhere else."""
_SLOW = 0.2
"""Metres of a step below which the share is not measured anew."""

_GAIN, _CHANGE, _BACK = 0.2, 0.002, 0.003
"""Of a new share in a step, by how much it changes at most, and of the metres what is given back.

Lines of lanes have corners, and centimetres are lost where they meet: both would be jerks.
"""


@dataclass(slots=True)
class _Pace:
    """Front of a vehicle, and what it was to cover and was given by then; metres.

    ``share`` is what it covers on the ground for each metre of SUMO's, ``owed`` what is missing,
    and ``extra`` how much more SUMO has counted than it was to cover since it departed.
    """

    x: float
    y: float
    wanted: float
    given: float
    share: float = 1.0
    owed: float = 0.0
    extra: float = 0.0


class GroundPaces:
    """Finds the speeds that SUMO has to be given."""

    def __init__(self, step: float) -> None:
        self._step = step
        self._paces: dict[str, _Pace] = {}

    def speed(self, actor: ActorView, wanted: float) -> float:
        """Speed for SUMO so that a vehicle covers ``wanted`` metres a second in the next step."""
        half = actor.length / 2.0
        x, y = actor.x + half * math.cos(actor.hdg), actor.y + half * math.sin(actor.hdg)
        metres = wanted * self._step
        pace = self._paces.get(actor.id)
        if pace is None:
            pace = self._paces[actor.id] = _Pace(x, y, 0.0, 0.0)
        self._measure_share(pace, math.hypot(x - pace.x, y - pace.y))
        back = min(max(pace.owed, -_BACK * metres), _BACK * metres)
        given = (metres + back) / pace.share if metres > 0.0 else 0.0
        pace.x, pace.y, pace.wanted, pace.given = x, y, metres, given
        pace.extra += given - metres
        return given / self._step

    @staticmethod
    def _measure_share(pace: _Pace, covered: float) -> None:
        """Take over what was covered on the ground in the last step."""
        if abs(covered - pace.wanted) > _MOST * pace.wanted:
            pace.owed = 0.0
            return
        pace.owed += pace.wanted - covered
        if pace.given > _SLOW:
            change = _GAIN * (covered / pace.given - pace.share)
            pace.share += min(max(change, -_CHANGE), _CHANGE)

    def given(self, name: str) -> float | None:
        """Speed that SUMO was given last."""
        pace = self._paces.get(name)
        return None if pace is None else pace.given / self._step

    def rest(self, name: str) -> None:
        """Forget where a vehicle was that something else moves now."""
        pace = self._paces.get(name)
        if pace is not None:
            pace.wanted, pace.given, pace.share, pace.owed = 0.0, 0.0, 1.0, 0.0

    def extra(self, name: str) -> float:
        """Metres that SUMO has counted more than the vehicle has covered."""
        pace = self._paces.get(name)
        return 0.0 if pace is None else pace.extra

    def state(self) -> dict[str, Any]:
        """What has to be remembered, for JSON."""
        return {name: asdict(pace) for name, pace in self._paces.items()}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Inverse of :meth:`state`."""
        self._paces = {name: _Pace(**pace) for name, pace in state.items()}
