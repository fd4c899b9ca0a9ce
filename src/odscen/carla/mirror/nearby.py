"""What is shown of much traffic: all that is near the ego, and no more than so many."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

HYSTERESIS = 1.15
"""A road user that has come within the radius stays until this many times as far away."""


@dataclass(frozen=True, slots=True)
class Nearby:
    """How far and how many; ``None`` for no limit.

    Attributes
    ----------
    radius
        Metres around the ego.
    most
        Actors at most, the nearest ones first.
    """

    radius: float | None = None
    most: int | None = None

    def chosen(
        self,
        x: NDArray[np.float64],
        y: NDArray[np.float64],
        shown: NDArray[np.bool_],
        centre: tuple[float, float] | None,
    ) -> NDArray[np.bool_]:
        """Who is to be shown, shape ``(N,)``.

        Parameters
        ----------
        x, y
            Of all road users.
        shown
            Who is shown now.
        centre
            Where the ego is; without one the radius is no limit, and who is shown stays.
        """
        chosen = np.ones(len(x), dtype=np.bool_)
        far = np.zeros(len(x)) if centre is None else np.hypot(x - centre[0], y - centre[1])
        if self.radius is not None and centre is not None:
            chosen &= far <= np.where(shown, self.radius * HYSTERESIS, self.radius)
        if self.most is not None and np.count_nonzero(chosen) > self.most:
            # Who is shown counts as nearer than it is, so that neighbours do not take turns.
            rank = np.lexsort((~shown, np.where(shown, far / HYSTERESIS, far)))
            rank = rank[chosen[rank]]
            chosen[rank[self.most :]] = False
        return chosen
