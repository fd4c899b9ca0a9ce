"""Stations of a study as a run has them: lines across lanes of the SUMO network."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Self

if TYPE_CHECKING:
    from collections.abc import Mapping

StationKind = Literal["detector", "section", "cordon"]
StationLine = tuple[tuple[str, float], ...]
"""SUMO lanes and metres along them."""


@dataclass(frozen=True, slots=True)
class PlannedStation:
    """A station of the scenario's study.

    Attributes
    ----------
    first, second
        Lines: of a detector where it lies, and none; of a section its begin and end; of a cordon
        its entries and exits.
    """

    id: str
    kind: StationKind
    first: StationLine
    second: StationLine = ()

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """Inverse of ``dataclasses.asdict``, after JSON too."""
        lines = (
            tuple((str(lane), float(pos)) for lane, pos in data[name])
            for name in ("first", "second")
        )
        return cls(str(data["id"]), data["kind"], *lines)
