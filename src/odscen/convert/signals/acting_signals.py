"""Places where signals act, and what reading them asks of the movements around."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Protocol

if TYPE_CHECKING:
    from collections.abc import Set as AbstractSet

    from odscen.base.ids import RoadId
    from odscen.opendrive.road_model import Validity


class Acting(NamedTuple):
    """One place where a signal acts; ``element`` is the signal's own, for the report."""

    signal: str
    element: str
    kind: str
    road: RoadId
    s: float
    orientation: str
    validities: tuple[Validity, ...]

    def applies_to(self, lane_id: int) -> bool:
        """Whether it is valid for a lane; without validity it is for all."""
        if not self.validities:
            return True
        return any(
            min(v.from_lane, v.to_lane) <= lane_id <= max(v.from_lane, v.to_lane)
            for v in self.validities
        )

    def faces(self, *, growing: bool) -> bool:
        """Whether it faces traffic that runs with growing s, or else against it.

        Where a validity names lanes, these decide: tools write the orientation of the pole.
        """
        if self.validities:
            return True
        return {"+": growing, "-": not growing}.get(self.orientation, True)


class SignalReach(Protocol):
    """How signals and movements (their numbers) lie to each other."""

    def controls(self, place: Acting) -> list[int]:
        """Movements that a signal at a place controls, by its orientation and validity."""

    def distance(self, place: Acting, *, growing: bool) -> float:
        """Metres from a place to the next junction along or against s; infinite if there is none.

        Infinite also for places on connecting roads.
        """

    def before(self, place: Acting, home: AbstractSet[int]) -> list[int]:
        """Movements of a junction that come straight towards a place behind it."""


class SettledSignal(NamedTuple):
    """What a signal controls at one place; ``guess`` says why, if not because it is written so."""

    place: Acting
    numbers: tuple[int, ...]
    guess: str = ""
