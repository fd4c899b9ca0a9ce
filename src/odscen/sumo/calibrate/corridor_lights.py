"""Lights along a corridor: who drives through them, how far they are apart, and their windows."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

from odscen.base.errors import InputError
from odscen.scenario.signals.green_wave import GreenWindow, WaveLight
from odscen.sumo.calibrate.turning_volumes import DRIVEN, Turn, turns_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.records.light_programs import ProgramPhase
    from odscen.sumo.realize.sumo_map import SumoMap


@dataclass(frozen=True, slots=True)
class CorridorDirection:
    """One direction of a corridor.

    Attributes
    ----------
    links
        For each light, in the order of the corridor, places in its states of those who drive along.
    metres, seconds
        From the first light of this direction to each; seconds at the progression speed.
    """

    links: tuple[tuple[int, ...], ...]
    metres: tuple[float, ...]
    seconds: tuple[float, ...]


class CorridorFinder:
    """Finds the ways between lights of a map, which go by their numbers."""

    def __init__(self, sumo_map: SumoMap) -> None:
        self._map = sumo_map
        self._net = sumo_map.net
        self._turns = [turns_of(light, sumo_map) for light in sumo_map.lights]

    def in_order(self, numbers: Sequence[int]) -> list[int]:
        """Lights in the order in which they lie along their road, from one of the outermost."""
        apart = {
            (number, other): min(
                self._path_length(self._path_between(number, other)),
                self._path_length(self._path_between(other, number)),
            )
            for number in numbers
            for other in numbers
            if number < other
        }
        first, _ = max(apart, key=lambda pair: (apart[pair], -pair[0]))
        return sorted(
            numbers, key=lambda n: 0.0 if n == first else apart[min(n, first), max(n, first)]
        )

    def direction(
        self, numbers: Sequence[int], *, speed: float | None = None
    ) -> CorridorDirection | None:
        """Follow the corridor over lights in this order; ``None`` where one cannot drive so.

        Parameters
        ----------
        speed
            m/s; the speed limits if not given.

        Raises
        ------
        InputError
            If another light lies on the way.
        """
        paths = [self._path_between(one, other) for one, other in pairwise(numbers)]
        if any(path is None for path in paths):
            return None
        ways = [path for path in paths if path is not None]
        self._refuse_lights_between(numbers, ways)
        links, metres, seconds = [], [0.0], [0.0]
        for place, number in enumerate(numbers):
            source = ways[place - 1][-1] if place else None
            target = ways[place][0] if place < len(ways) else None
            own = self._links_along(number, source, target)
            if not own:
                return None
            links.append(own)
            if target is not None:
                inside = self._inner_lengths(number, own[0])
                lanes = [*inside, *self._lane_lengths(ways[place])]
                metres.append(metres[-1] + sum(length for length, _ in lanes))
                seconds.append(
                    seconds[-1] + sum(length / (speed or limit) for length, limit in lanes)
                )
        return CorridorDirection(tuple(links), tuple(metres), tuple(seconds))

    def _links_along(self, number: int, source: str | None, target: str | None) -> tuple[int, ...]:
        """Links for those who drive along; at an end of the corridor those straight on, if any."""
        turns = self._turns[number]
        if source is not None and target is not None:
            return turns.get(Turn(source, target), ())
        fitting = [
            links
            for turn, links in turns.items()
            if (source is None or turn.source == source) and target in (None, turn.target)
        ]
        links = self._map.lights[number].links
        straight = [own for own in fitting if links[own[0]].turn == "s"]
        return max(straight or fitting, key=lambda own: (len(own), -own[0]), default=())

    def _path_between(self, one: int, other: int) -> tuple[str, ...] | None:
        """Shortest way from a light to the stop line of another, as edges."""
        exits = sorted({turn.target for turn in self._turns[one]})
        stops = sorted({turn.source for turn in self._turns[other]})
        paths = [
            path for a in exits for b in stops if (path := self._net.path(a, b, DRIVEN)) is not None
        ]
        return min(paths, key=lambda path: (self._path_length(path), path), default=None)

    def _path_length(self, path: Sequence[str] | None) -> float:
        return float("inf") if path is None else self._net.path_length(path)

    def _inner_lengths(self, number: int, link: int) -> list[tuple[float, float]]:
        own = self._map.lights[number].links[link]
        target = self._net.lanes[own.target].edge
        passed = self._net.passage(own.source, target) or ()
        return [(lane.length, lane.speed) for lane in passed[:-1]]

    def _lane_lengths(self, path: Sequence[str]) -> list[tuple[float, float]]:
        """Lengths and speed limits of edges and of what lies between them."""
        lengths = []
        for edge, after in pairwise((*path, "")):
            lanes = [lane for lane in self._net.edge_lanes[edge] if lane.allows(DRIVEN)]
            lengths.append((lanes[-1].length, lanes[-1].speed))
            passages = (self._net.passage(lane.id, after) for lane in lanes) if after else ()
            passed = next((passage for passage in passages if passage), ())
            lengths += [(lane.length, lane.speed) for lane in passed[:-1]]
        return lengths

    def _refuse_lights_between(
        self, numbers: Sequence[int], ways: Sequence[tuple[str, ...]]
    ) -> None:
        for (one, other), way in zip(pairwise(numbers), ways, strict=True):
            steps = {Turn(*step) for step in pairwise(way)}
            for number, turns in enumerate(self._turns):
                if steps & turns.keys():
                    between, before, behind = (self._name_light(n) for n in (number, one, other))
                    raise InputError(
                        f"the light of junction {between} lies between those of {before} and "
                        f"{behind}: name it too"
                    )

    def _name_light(self, number: int) -> str:
        light = self._map.lights[number]
        return ", ".join(light.junctions) or light.id


def green_windows(phases: Sequence[ProgramPhase], links: Sequence[int]) -> tuple[GreenWindow, ...]:
    """Stretches of a program in which all of these links have green."""
    cycle = sum(phase.seconds for phase in phases)
    windows: list[GreenWindow] = []
    now = 0.0
    for phase in phases:
        if all(phase.state[n] in "Gg" for n in links):
            last = windows[-1] if windows else None
            if last is not None and abs(last.begin + last.seconds - now) < 1e-9:
                windows[-1] = last._replace(seconds=last.seconds + phase.seconds)
            else:
                windows.append(GreenWindow(now, phase.seconds))
        now += phase.seconds
    if len(windows) > 1 and windows[0].begin == 0.0:
        last = windows[-1]
        if abs(last.begin + last.seconds - cycle) < 1e-9:
            windows[-1] = last._replace(seconds=last.seconds + windows.pop(0).seconds)
    return tuple(windows)


def wave_lights(
    out: CorridorDirection | None,
    back: CorridorDirection | None,
    programs: Sequence[Sequence[ProgramPhase]],
) -> tuple[WaveLight, ...]:
    """Lights of a corridor with their windows, in its order.

    Parameters
    ----------
    back
        The other direction, whose first light is the last of the corridor.
    """
    count = len(programs)
    lights = []
    for place, phases in enumerate(programs):
        there = count - 1 - place
        lights.append(
            WaveLight(
                green_windows(phases, out.links[place]) if out else (),
                green_windows(phases, back.links[there]) if back else (),
                out.seconds[place] if out else 0.0,
                back.seconds[there] if back else 0.0,
            )
        )
    return tuple(lights)
