"""Detectors of actuated lights: loops in lanes, and places where people wait to cross.

SUMO's own loops count for a stage only where no turn from the lane gives way. Ours count where the
scenario says so, or else for all stages in which a movement of the lane has green; one on which a
vehicle waits for a gap in the green no longer prolongs it.
"""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from odscen.scenario.signals.program_design import detector_movements

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from odscen.convert.lane_table.table import SumoLight
    from odscen.scenario.document.signals_document import SignalDetector
    from odscen.scenario.signals.light import Light
    from odscen.sumo.realize.road_net import RoadNet

GAP = 3.0
"""Seconds between vehicles in which a stage goes on, where the scenario does not say."""

LOOP = 2.0
"""Metres."""

AHEAD = 2.0
"""Seconds at the speed limit from a loop to the stop line, where the scenario does not say."""

PASSING, ROOM = 1.9, 7.5
"""Seconds and metres of a vehicle in a queue that drives off: a stage of the shortest green has to
take all that stand between loop and stop line."""

STANDING, MOVED_OFF = 10.0, 5.0
"""A vehicle on a loop for more seconds waits for a gap, once a queue would have moved off."""

BUS_AREA = 80.0
"""Metres before the stop line in which a bus is seen, if there is as much road."""

AREA_END = 0.1
"""Metres before the end of its lane at which an area ends."""
LEAST_REST = 0.2
"""Metres of an area on the lane where it begins: for less SUMO finds no lane, and says so."""

BUS_GREEN = 15.0
"""Seconds by which a bus may prolong the green of a fixed-time light."""

WAVE = 3.0
"""m/s, at least, at which a queue moves off from the stop line backwards."""

_LEAST = 0.05
"""Metres of a loop, and of what is left of its lane before it, at least."""


@dataclass(frozen=True, slots=True)
class PlacedLoop:
    """A loop in a lane, or where people wait.

    Attributes
    ----------
    id
        Of SUMO's ``inductionLoop``.
    name
        Of the detector in the scenario; empty for one that the scenario does not have.
    lane, pos, length
        Where it lies; metres.
    before
        Lane at the stop line that it is for; empty where people wait.
    stages
        Ids of the stages that it prolongs, or calls.
    movements
        Places in the light's states of the movements of its lane.
    """

    id: str
    name: str
    lane: str
    pos: float
    length: float
    before: str
    stages: tuple[str, ...]
    movements: tuple[int, ...]
    gap: float = GAP
    ahead: float = 0.0

    @property
    def walk(self) -> bool:
        """Whether it is for people on foot."""
        return not self.before


@dataclass(frozen=True, slots=True)
class BusArea:
    """The last metres before the stop line of a lane, in which buses are seen.

    ``movements`` are places in the light's states of the movements of the lane; ``length`` is in
    metres.
    """

    id: str
    lane: str
    movements: tuple[int, ...]
    length: float = BUS_AREA


def bus_areas(light: SumoLight, view: Light, net: RoadNet) -> tuple[BusArea, ...]:
    """One in each lane of vehicles."""
    every = [n for n, movement in enumerate(view.movements) if not movement.walk]
    lanes = _group_by_lane(light, every).items()
    return tuple(
        BusArea(f"{light.id}.bus.{number}", lane, movements, area_length(net, lane, BUS_AREA))
        for number, (lane, movements) in enumerate(lanes)
    )


def area_length(net: RoadNet, lane: str, wanted: float) -> float:
    """Metres of an area that ends with a lane: less than wanted where all of the road is shorter.

    SUMO leads it on over the lanes before, and warns where there are none. Which of several it
    takes is its own choice: the shortest way to where the road begins counts, less what SUMO's
    lengths may be shorter by. Nor does it lead an area on for less than :data:`LEAST_REST`.
    """
    todo, seen = [(net.lanes[lane].length - 2.0 * AREA_END, lane)], set[str]()
    while todo:
        length, farther = heapq.heappop(todo)
        before = net.links_to.get(farther, ())
        if length >= wanted:
            break
        if not before or wanted - length < LEAST_REST:
            return max(math.floor(100.0 * length) / 100.0, AREA_END)
        seen.add(farther)
        for link in before:
            if link.source not in seen:
                heapq.heappush(todo, (length + net.lanes[link.source].length, link.source))
    return wanted


def bus_in(areas: Iterable[BusArea], green: set[int]) -> tuple[str, str]:
    """SUMO's expressions for: a bus comes to one of the green movements, and to another one."""
    own: list[str] = []
    other: list[str] = []
    for area in areas:
        (own if green & set(area.movements) else other).append(f"(a:{area.id} > 0)")
    return " or ".join(own) or "0", " or ".join(other) or "0"


def ended_with_buses(ended: str, areas: Sequence[BusArea], green: set[int]) -> str:
    """SUMO's expression for: a stage ends, but not for a bus to it, and sooner for one elsewhere.

    ``ended`` is the one without buses, which is returned where there are no areas.
    """
    if not areas:
        return ended
    own, other = bus_in(areas, green)
    return f"(({ended}) or ({other})) and (({own}) < 1)"


def vehicle_loops(
    light: SumoLight,
    view: Light,
    net: RoadNet,
    *,
    designed: Sequence[SignalDetector],
    green: Mapping[str, set[int]],
    least: Mapping[str, float],
) -> tuple[PlacedLoop, ...]:
    """Loops of a light: those of the scenario, or else one in each lane.

    Parameters
    ----------
    green
        Movements that have green in each stage.
    least
        Shortest green of each stage, seconds.
    """
    loops: list[PlacedLoop] = []
    for detector in designed:
        own = detector_movements(detector.at, view.movements)
        for lane, movements in _group_by_lane(light, own).items():
            loops.append(
                _place_loop(
                    net, f"{light.id}.{detector.id}.{len(loops)}", lane, movements,
                    name=detector.id, ahead=detector.before, length=detector.length,
                    stages=detector.stages, gap=detector.gap,
                )
            )  # fmt: skip
    if designed:
        return tuple(loops)
    every = [n for n, movement in enumerate(view.movements) if movement.drive]
    for lane, movements in _group_by_lane(light, every).items():
        stages = tuple(stage for stage, some in green.items() if some & set(movements))
        if not stages:
            continue
        shortest = min(least[stage] for stage in stages)
        ahead = min(
            AHEAD * max(light.links[n].speed for n in movements), (shortest / PASSING + 0.5) * ROOM
        )
        loops.append(
            _place_loop(
                net, f"{light.id}.loop.{len(loops)}", lane, movements, ahead=ahead, stages=stages
            )
        )
    return tuple(loops)


def idle_loop(light: SumoLight, net: RoadNet, movement: int) -> PlacedLoop:
    """Make a loop that prolongs nothing: without any SUMO could not load the state of a light."""
    lane = light.links[movement].source
    return _place_loop(net, f"{light.id}.idle", lane, (movement,), ahead=LOOP, stages=())


def idle_loops(light: SumoLight, net: RoadNet, areas: Iterable[BusArea]) -> tuple[PlacedLoop, ...]:
    """Make one in each lane: SUMO warns of actuated greens without a loop."""
    return tuple(
        _place_loop(
            net, f"{light.id}.idle.{number}", area.lane, area.movements, ahead=LOOP, stages=()
        )
        for number, area in enumerate(areas)
    )


def waiting_places(
    light: SumoLight, net: RoadNet, crossings: Mapping[str, Iterable[int]]
) -> tuple[PlacedLoop, ...]:
    """Where people wait who call stages; ``crossings`` are the movements that call each."""
    places: dict[str, tuple[set[str], set[int]]] = {}
    for stage, movements in crossings.items():
        for n in movements:
            for area in (light.links[n].source, light.links[n].target):
                stages, own = places.setdefault(area, (set(), set()))
                stages.add(stage)
                own.add(n)
    return tuple(
        PlacedLoop(
            f"{light.id}.call.{number}", "", area, 0.0, net.lanes[area].length, "",
            tuple(sorted(stages)), tuple(sorted(own)),
        )
        for number, (area, (stages, own)) in enumerate(sorted(places.items()))
    )  # fmt: skip


def may_end(loops: Iterable[PlacedLoop], stage: str, green: set[int]) -> str:
    """SUMO's expression for: no detector prolongs the stage any more; empty without any."""
    parts = []
    for loop in loops:
        shown = sorted(green & set(loop.movements))
        if stage in loop.stages and not loop.walk and shown:
            late = loop.ahead / WAVE + MOVED_OFF
            parts.append(
                f"((z:{loop.id} > {loop.gap:g}) or"
                f" ((w:{loop.id} > {STANDING:g}) and (g:{shown[0]} > {late:g})))"
            )
    return " and ".join(parts)


def _group_by_lane(light: SumoLight, movements: Iterable[int]) -> dict[str, tuple[int, ...]]:
    movements_by_lane: dict[str, list[int]] = {}
    for n in movements:
        movements_by_lane.setdefault(light.links[n].source, []).append(n)
    return {lane: tuple(own) for lane, own in movements_by_lane.items()}


def _place_loop(
    net: RoadNet,
    name_of_loop: str,
    stop_lane: str,
    movements: tuple[int, ...],
    *,
    ahead: float,
    stages: tuple[str, ...],
    name: str = "",
    length: float = LOOP,
    gap: float = GAP,
) -> PlacedLoop:
    """Lay a loop whose front end is ``ahead`` metres before the stop line, on the lane there."""
    lane, front = _position_upstream(net, stop_lane, ahead)
    rear = max(front - length, 0.0)
    return PlacedLoop(
        name_of_loop, name, lane, rear, max(front - rear, _LEAST), stop_lane, stages, movements,
        gap, ahead,
    )  # fmt: skip


def _position_upstream(net: RoadNet, lane: str, ahead: float) -> tuple[str, float]:
    """Lane and position so many metres before the end of a lane; the start of the last one else."""
    while (rest := net.lanes[lane].length - max(ahead, 0.0)) < _LEAST:
        before = lane_before(net, lane)
        if before is None:
            return lane, min(_LEAST, net.lanes[lane].length)
        ahead -= net.lanes[lane].length
        lane = before
    return lane, rest


def lane_before(net: RoadNet, lane: str) -> str | None:
    """Lane that leads onto a lane, of several the one beside the fewest others; else ``None``."""
    same = net.lanes[lane].index
    sources = (link.source for link in net.links_to.get(lane, ()))
    return min(
        sources, key=lambda source: (abs(net.lanes[source].index - same), source), default=None
    )
