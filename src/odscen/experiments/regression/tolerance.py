"""How far a figure may be from its baseline: ``"5 %"``, ``"1.5 s"``, or ``"5 % or 1.5 s"``."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING

from odscen.base.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.experiments.regression.measure import FigureKey
    from odscen.figures.measures.figure import Figure

_PART = re.compile(r"(?P<number>\d+\.?\d*|\.\d+)\s*(?P<unit>%|[A-Za-z][A-Za-z/]*)?")


@dataclass(frozen=True, slots=True)
class Tolerance:
    """Allowed are ``relative`` times the baseline or ``absolute``, whichever is more.

    ``by_scatter`` says that ``absolute`` is what the scatter of the seeds explains.
    """

    relative: float = 0.0
    absolute: float = 0.0
    by_scatter: bool = False

    def allowed(self, baseline: float) -> float:
        """Return the largest difference that passes, in the unit of the figure."""
        return max(self.relative * abs(baseline), self.absolute)

    def times(self, factor: float) -> Tolerance:
        """Return a part of it."""
        return Tolerance(factor * self.relative, factor * self.absolute)

    def words(self, figure: Figure) -> str:
        """``"5 % or 1.50 s"``, as it may be written in a suite, or ``"1.50 s by scatter"``."""
        if self.by_scatter:
            return f"{figure.written(self.absolute)} by scatter"
        parts = [f"{100 * self.relative:g} %"] if self.relative else []
        if self.absolute or not parts:
            parts.append(figure.written(self.absolute))
        return " or ".join(parts)


def parse_tolerance(text: str, figure: Figure) -> Tolerance:
    """Read a tolerance of a figure.

    Raises
    ------
    InputError
        If it is none, or in a unit that the figure does not have.
    """
    relative = absolute = 0.0
    for part in text.split(" or "):
        match = _PART.fullmatch(part.strip())
        if match is None:
            raise InputError(
                f"{text!r} is no tolerance; write for example '5 %', '1.5 s' or '5 % or 1.5 s'"
            )
        number, unit = float(match["number"]), match["unit"] or ""
        if unit == "%":
            relative = max(relative, number / 100.0)
        else:
            absolute = max(absolute, figure.in_unit_of(number, unit))
    return Tolerance(relative, absolute)


EXACT = Tolerance()


@cache
def usual(figure: Figure) -> Tolerance:
    """Tolerance of a figure that a suite says nothing of."""
    return parse_tolerance(figure.tolerance, figure)


@dataclass(frozen=True, slots=True)
class Tolerances:
    """Tolerances by kind of place and figure, for whatever differs from the usual."""

    given: Mapping[tuple[str, str], Tolerance]
    own: Mapping[str, Figure] = field(default_factory=dict)
    """Figures of the run that the suite defines, by name."""

    def entry(self, key: FigureKey) -> Figure:
        """What is known of a figure, be it the suite's own."""
        own = self.own.get(key.figure) if key.kind == "run" else None
        return own or key.entry

    def of(self, key: FigureKey) -> Tolerance:
        """Tolerance of one figure."""
        given = self.given.get((key.kind, key.figure))
        return usual(self.entry(key)) if given is None else given
