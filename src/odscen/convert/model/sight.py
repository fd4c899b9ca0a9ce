"""How far before a line drivers see whom they have to let go: SUMO's ``visibility`` of links."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.convert.model.right_of_way import Sign

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.convert.model.net import Request
    from odscen.convert.model.right_of_way import Movement

SIGHT_BOTH_WAYS, SIGHT_ONE_WAY = 0.3, 1.25
"""Metres before a yield line from which one sees whom to let go: on two roads, and on one.

Calibrated: those who find nobody follow each other in 3.0 s, and in 2.5 s where they only merge,
as into a roundabout. The Highway Capacity Manual (7th edition, chapters 20 and 22) has 3.5 s at a
sign and 2.6 s at a roundabout; from SUMO's 4.5 m one passes the sign at 8 m/s, in 2.1 s.
"""

_SIGHT_SPEEDS = (20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 90.0, 100.0, 110.0, 120.0, 130.0)
_SIGHT_LEGS = (20.0, 25.0, 35.0, 45.0, 55.0, 65.0, 75.0, 90.0, 105.0, 120.0, 135.0, 150.0)
"""Speed, km/h, and leg of the sight triangle, metres, of junctions without control (case A).

AASHTO, A Policy on Geometric Design of Highways and Streets, 7th edition, section 9.5.3.
"""

SIGHT_MAKING_ROOM = 100.0
"""Metres before a merge from which drivers who make room see the others, as SUMO's zipper has it.

Enough to stop from 30 m/s, so that nobody slows down on a motorway for a ramp that is empty.
"""


def sight_before(
    movement: Movement, right: Request, movements: Sequence[Movement], *, room: bool
) -> float | None:
    """Metres before the line from which one sees whom to let go; ``None``: as SUMO has it.

    ``room``: it makes room for those who merge
    (:func:`odscen.convert.model.right_of_way.making_room`).
    """
    roads = {movements[n].source[0] for n in right.yields_to if n < len(movements)}
    if movement.sign is Sign.STOP or not roads:
        return None
    if movement.sign is Sign.NONE:
        return SIGHT_MAKING_ROOM if room else sight_without_sign(movement.speed)
    return SIGHT_BOTH_WAYS if len(roads) > 1 else SIGHT_ONE_WAY


def sight_without_sign(speed: float) -> float:
    """Metres before a line without a sign, or a waiting place, from which one sees whom to let go.

    Far enough to stop for them in comfort: from SUMO's 4.5 m all who have a clear road slow down
    to 6.4 m/s.

    Parameters
    ----------
    speed
        m/s, of the edge before.
    """
    return round(float(np.interp(speed * 3.6, _SIGHT_SPEEDS, _SIGHT_LEGS)), 1)
