"""Who calls a stage: vehicles between loop and stop line, buses, and people who wait to cross."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from odscen.sumo.realize.lights.light_detectors import area_length

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from odscen.convert.lane_table.table import SumoLight
    from odscen.scenario.signals.light import Light
    from odscen.sumo.realize.lights.light_detectors import BusArea, PlacedLoop
    from odscen.sumo.realize.road_net import RoadNet

STUCK = 20.0
"""Seconds of standing at a green that gives way, after which a vehicle needs another stage."""


SEEN = 20.0
"""Metres before the stop line of a lane without a loop in which a vehicle calls."""


class CallArea(NamedTuple):
    """The metres of a lane from its loop to the stop line, in which a vehicle calls.

    A loop alone would forget who passed it in yellow and stands behind it at red.

    Attributes
    ----------
    movements
        Places in the light's states of the movements of the lane.
    length
        Metres.
    """

    id: str
    lane: str
    movements: tuple[int, ...]
    length: float


def call_areas(
    light: SumoLight, view: Light, net: RoadNet, loops: Iterable[PlacedLoop]
) -> tuple[CallArea, ...]:
    """One in each lane of vehicles, from its farthest loop on; all lanes call, loop or not."""
    lengths = dict[str, float]()
    for loop in loops:
        if not loop.walk:
            lengths[loop.before] = max(lengths.get(loop.before, loop.length), loop.ahead)
    lanes = dict[str, list[int]]()
    for n, movement in enumerate(view.movements):
        if movement.drive:
            lanes.setdefault(light.links[n].source, []).append(n)
    return tuple(
        CallArea(
            f"{light.id}.area.{number}",
            lane,
            tuple(own),
            area_length(net, lane, lengths.get(lane, SEEN)),
        )
        for number, (lane, own) in enumerate(lanes.items())
    )


def called(
    loops: Iterable[PlacedLoop], areas: Iterable[CallArea], stage: str, calling: set[int]
) -> str:
    """SUMO's expression for: somebody waits to cross in a stage, or a vehicle for its green.

    ``calling`` are places in the light's states of the movements that may call it.
    """
    waiting = [f"w:{loop.id} > 0" for loop in loops if loop.walk and stage in loop.stages]
    vehicles = [f"a:{area.id} > 0" for area in areas if calling & set(area.movements)]
    return any_of((*waiting, *vehicles))


@dataclass(frozen=True, slots=True)
class CallDetectors:
    """Detectors of a light that call stages, as SUMO's expressions."""

    areas: Sequence[CallArea]
    places: Sequence[PlacedLoop]
    buses: Sequence[BusArea]

    def vehicles(self, shown: str, wanted: str) -> str:
        """Say that a vehicle waits for what ``wanted`` shows and ``shown`` does not.

        Both are states of the light. One that has to give way waits for its own green, too.
        """
        missing = {
            n
            for n, (now, then) in enumerate(zip(shown, wanted, strict=True))
            if (then in "Gg" and now not in "Gg") or (then == "G" and now == "g")
        }
        seen = [(area.id, area.movements) for area in self.areas]
        seen += [(bus.id, bus.movements) for bus in self.buses]
        return any_of(f"a:{name} > 0" for name, own in seen if missing & set(own))

    def people(self, shown: str, wanted: str) -> str:
        """Say that somebody waits at a crossing that has green in ``wanted`` only."""
        missing = {
            n
            for n, (now, then) in enumerate(zip(shown, wanted, strict=True))
            if then in "Gg" and now not in "Gg"
        }
        return any_of(
            f"w:{place.id} > 0" for place in self.places if missing & set(place.movements)
        )

    def stuck(self, shown: str) -> str:
        """Say that a vehicle finds no gap in a green that gives way."""
        yielding = {n for n, letter in enumerate(shown) if letter == "g"}
        areas = (area for area in self.areas if yielding & set(area.movements))
        return any_of(f"w:{area.id} > {STUCK:g}" for area in areas)


def any_of(expressions: Iterable[str]) -> str:
    """SUMO's expression for one of several; empty for none."""
    return " or ".join(f"({expression})" for expression in expressions if expression)


def all_of(expressions: Iterable[str]) -> str:
    """SUMO's expression for all of several; empty for none."""
    return " and ".join(f"({expression})" for expression in expressions if expression)
