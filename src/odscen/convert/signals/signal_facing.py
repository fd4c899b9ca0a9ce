"""What signals control whose orientation or place in the file contradicts the junctions.

Some writers give the direction that a lamp or sign looks in, towards its drivers, where the
standard asks for the direction of the traffic that it is valid for (section 14.1); LGSVL's exports
do so throughout. And poles of lights may stand beyond their junction, on a road that leaves it.
What controls something of its junction as it is written is never touched.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple, Protocol

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from collections.abc import Set as AbstractSet

    from odscen.base.ids import RoadId
    from odscen.opendrive.road_model import OpenDrive, Validity

STANDS_NEAR = 20.0
"""Metres from a junction within which signals on a road stand that are for this junction."""

REVERSED_SHARE = 0.8
"""Share of the signals near junctions that must face away for all to be taken reversed."""

AWAY_FROM_HOME = "it faces away from the junction whose controller names it: taken reversed"
AWAY_THROUGHOUT = (
    "signals of this file face away from the junctions at which they stand: taken reversed"
)
FAR_SIDE = (
    "it is placed beyond the junction whose controller names it: taken for the approach before"
)
WHOLE_JUNCTION = (
    "no lane leads from it to the junction whose controller names it: taken for all movements there"
)

_FLIPPED = {"+": "-", "-": "+"}


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


def signal_homes(
    odr: OpenDrive, junctions: Sequence[AbstractSet[str]]
) -> dict[str, frozenset[int]]:
    """Movements of the junctions that list a controller of each signal.

    Parameters
    ----------
    junctions
        By movement: ids of the junctions through which it leads.
    """
    through: dict[str, set[int]] = {}
    for number, passed in enumerate(junctions):
        for junction_id in passed:
            through.setdefault(junction_id, set()).add(number)
    homes: dict[str, set[int]] = {}
    for junction in odr.junctions.values():
        for controller in junction.controllers:
            for signal, _ in odr.controllers[controller].controls:
                homes.setdefault(signal, set()).update(through.get(junction.id, ()))
    return {signal: frozenset(home) for signal, home in homes.items() if home}


def settle_signals(
    places: Sequence[Acting], reach: SignalReach, homes: Mapping[str, frozenset[int]]
) -> list[SettledSignal]:
    """Say what each signal controls at each of its places, in their order.

    Parameters
    ----------
    homes
        As :func:`signal_homes` gives them.
    """
    settled = [SettledSignal(place, tuple(reach.controls(place))) for place in places]
    backwards = _facing_away(places, reach, homes)
    astray = _astray(settled, homes)
    settled = [
        _reversed(one, reach, homes.get(one.place.signal))
        if one.place.signal in astray or one.place in backwards
        else one
        for one in settled
    ]
    astray = _astray(settled, homes)
    settled = [
        _replaced(one, reach.before(one.place, homes[one.place.signal]), FAR_SIDE)
        if one.place.signal in astray and one.place.kind == "traffic_light"
        else one
        for one in settled
    ]
    lit = {n for one in settled if one.place.kind == "traffic_light" for n in one.numbers}
    dark = {signal for signal in _astray(settled, homes) if not homes[signal] & lit}
    return [
        _replaced(one, sorted(homes[one.place.signal]), WHOLE_JUNCTION)
        if one.place.signal in dark and one.place.kind == "traffic_light"
        else one
        for one in settled
    ]


def _astray(
    settled: Iterable[SettledSignal], homes: Mapping[str, frozenset[int]]
) -> frozenset[str]:
    """Signals that control nothing of the junctions whose controllers name them."""
    found: dict[str, bool] = {}
    for one in settled:
        home = homes.get(one.place.signal)
        if home:
            at_home = not home.isdisjoint(one.numbers)
            found[one.place.signal] = found.get(one.place.signal, False) or at_home
    return frozenset(signal for signal, at_home in found.items() if not at_home)


def _flipped(place: Acting) -> Acting | None:
    """A place facing the other way; none where a validity decides, or it faces both ways."""
    if place.validities or place.orientation not in _FLIPPED:
        return None
    return place._replace(orientation=_FLIPPED[place.orientation])


def _reversed(one: SettledSignal, reach: SignalReach, home: frozenset[int] | None) -> SettledSignal:
    flipped = _flipped(one.place)
    if flipped is None:
        return one
    numbers = reach.controls(flipped)
    if home is None:
        return _replaced(one, numbers, AWAY_THROUGHOUT)
    return one if home.isdisjoint(numbers) else _replaced(one, numbers, AWAY_FROM_HOME)


def _replaced(one: SettledSignal, numbers: Sequence[int], guess: str) -> SettledSignal:
    return SettledSignal(one.place, tuple(numbers), guess) if numbers else one


def _looks(place: Acting, reach: SignalReach) -> int:
    """1 if a signal faces the junction at which it stands, -1 if it faces away, 0 if unclear."""
    if _flipped(place) is None:
        return 0
    growing = place.orientation == "+"
    ahead = reach.distance(place, growing=growing)
    behind = reach.distance(place, growing=not growing)
    nearer = min(ahead, behind)
    if not math.isfinite(nearer) or nearer > STANDS_NEAR or abs(ahead - behind) <= STANDS_NEAR:
        return 0
    return 1 if ahead < behind else -1


def _facing_away(
    places: Sequence[Acting], reach: SignalReach, homes: Mapping[str, frozenset[int]]
) -> frozenset[Acting]:
    """Places without a controller's junction to be taken reversed: none, or all of the file.

    All but those that do face the junction at which they stand.
    """
    looks = {place: _looks(place, reach) for place in places if place.signal not in homes}
    away = sum(look < 0 for look in looks.values())
    towards = sum(look > 0 for look in looks.values())
    if not away or away < REVERSED_SHARE * (away + towards):
        return frozenset()
    return frozenset(place for place, look in looks.items() if look <= 0)
