"""How far a figure may be from its baseline: ``"5 %"``, ``"1.5 s"``, or ``"5 % or 1.5 s"``."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from odscen.base.errors import InputError
from odscen.results.measures.expectations import COUNTS
from odscen.results.measures.units import in_unit_of, with_unit

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.regression.measure import FigureKey

_PART = re.compile(r"(?P<number>\d+\.?\d*|\.\d+)\s*(?P<unit>%|[A-Za-z][A-Za-z/]*)?")


@dataclass(frozen=True, slots=True)
class Tolerance:
    """Allowed are ``relative`` times the baseline or ``absolute``, whichever is more."""

    relative: float = 0.0
    absolute: float = 0.0

    def allowed(self, baseline: float) -> float:
        """Return the largest difference that passes, in the unit of the figure."""
        return max(self.relative * abs(baseline), self.absolute)

    def words(self, figure: str) -> str:
        """``"5 % or 1.50 s"``, as it may be written in a suite."""
        parts = [f"{100 * self.relative:g} %"] if self.relative else []
        if self.absolute or not parts:
            parts.append(with_unit(self.absolute, figure))
        return " or ".join(parts)


def parse_tolerance(text: str, figure: str) -> Tolerance:
    """Read a tolerance of the figure ``figure``.

    Raises
    ------
    InputError
        If it is none, or in a unit that the figure does not have.
    """
    relative = absolute = 0.0
    for part in text.split(" or "):
        match = _PART.fullmatch(part.strip())
        if match is None:
            msg = f"{text!r} is no tolerance; write for example '5 %', '1.5 s' or '5 % or 1.5 s'"
            raise InputError(msg)
        number, unit = float(match["number"]), match["unit"] or ""
        if unit == "%":
            relative = max(relative, number / 100.0)
        else:
            absolute = max(absolute, in_unit_of(figure, number, unit))
    return Tolerance(relative, absolute)


EXACT = Tolerance()
ORDINARY = Tolerance(relative=0.02)
"""Of figures of a run that nothing else is said of."""

_USUAL: dict[tuple[str, str], Tolerance] = {
    **{("run", name): EXACT for name in COUNTS},
    ("run", "mean_delay"): Tolerance(0.02, 0.5),
    ("run", "pedestrian_mean_delay"): Tolerance(0.02, 0.5),
    ("run", "mean_waiting_time"): Tolerance(0.02, 0.5),
    ("run", "pedestrian_mean_waiting_time"): Tolerance(0.02, 0.5),
    ("run", "mean_stops"): Tolerance(0.05, 0.1),
    ("run", "insertion_error_max"): Tolerance(0.0, 0.05),
    ("run", "insertion_error_mean"): Tolerance(0.0, 0.05),
    ("run", "depart_delay_max"): Tolerance(0.05, 1.0),
    ("segment", "vehicles"): Tolerance(0.05, 1.0),
    ("segment", "mean_speed"): Tolerance(0.1, 1.0),
    ("segment", "free_speed"): Tolerance(0.05, 0.5),
    ("junction", "vehicles"): Tolerance(0.05, 1.0),
    ("junction", "waiting_time"): Tolerance(0.1, 1.5),
    ("actor", "travel_time"): Tolerance(0.1, 5.0),
}

PLACE_FIGURES = frozenset(key for key in _USUAL if key[0] != "run")


@dataclass(frozen=True, slots=True)
class Tolerances:
    """Tolerances by kind of place and figure, for whatever differs from the usual."""

    given: Mapping[tuple[str, str], Tolerance]

    def of(self, key: FigureKey) -> Tolerance:
        """Tolerance of one figure."""
        own = (key.kind, key.figure)
        return self.given.get(own, _USUAL.get(own, ORDINARY))
