"""What the volumes at a light ask of its lanes: flow ratios, green and degree of saturation."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

from odscen.scenario.signals.webster import (
    HEAVY,
    PROTECTED_LEFT,
    RIGHT_TURN,
    GapGreen,
    LaneNeed,
    left_turn_equivalent,
)
from odscen.sumo.calibrate.turning_volumes import DRIVEN, TurnVolume, turns_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.convert.lane_table.table import SumoLight
    from odscen.records.light_programs import ProgramPhase
    from odscen.scenario.signals.light import Light
    from odscen.sumo.calibrate.turning_volumes import Turn
    from odscen.sumo.realize.sumo_map import SumoMap

_SHARES = 40
"""Parts in which the vehicles of a movement choose among its lanes."""


class MovementVolume(NamedTuple):
    """Vehicles an hour of one movement, from segment to segment."""

    movement: str
    turn: str
    vehicles: float
    heavy: float


@dataclass(frozen=True, slots=True)
class LaneLoad:
    """A lane at the stop line.

    Attributes
    ----------
    lane
        OpenDRIVE lane, ``12.0.-1``.
    turns
        Turns of the vehicles on it.
    volume
        Vehicles an hour.
    saturation
        Vehicles an hour of green that it carries with these turns and vehicles.
    links
        Places in the light's states of the movements that use it.
    blocked
        Flow ratio of the oncoming queue that its permissive turns wait for: as long as that moves
        off, there are no gaps (HCM, permitted left turns: unsaturated green).
    gaps
        Of protected-permissive turns: part of ``saturation`` that they have where they give way.
    """

    lane: str
    turns: tuple[str, ...]
    volume: float
    saturation: float
    links: tuple[int, ...]
    blocked: float = 0.0
    gaps: float | None = None

    @property
    def ratio(self) -> float:
        """Flow ratio: share of the cycle that it needs as green without giving way, if it has."""
        ratio = self.volume / self.saturation
        return ratio if self.gaps is not None else self.blocked + (1.0 - self.blocked) * ratio

    def green(self, phases: Sequence[ProgramPhase]) -> float:
        """Seconds of a cycle in which all movements that use it have green."""
        shown = (phase for phase in phases if all(phase.state[n] in "Gg" for n in self.links))
        return sum(phase.seconds for phase in shown)

    def degree(self, phases: Sequence[ProgramPhase]) -> float | None:
        """Degree of saturation (v/c); ``None`` if its movements never have green together."""
        cycle = sum(phase.seconds for phase in phases)
        share = self.green(phases) / cycle
        if self.gaps is not None:
            yields = [p for p in phases if any(p.state[n] == "g" for n in self.links)]
            filtered = sum(phase.seconds for phase in yields) / cycle
            unsaturated = max(filtered - self.blocked, 0.0) / (1.0 - self.blocked)
            share += unsaturated * self.gaps - filtered
        return self.ratio / share if share > 0.0 else None


class _Stream(NamedTuple):
    """Vehicles an hour of one turn, and the links that they may take."""

    links: tuple[int, ...]
    turn: Turn
    vehicles: float
    heavy: float


class LightDemand:
    """Volumes at one light, on its movements and lanes.

    Parameters
    ----------
    phases
        Of its program: they say which turns give way.
    saturation
        Base saturation flow, passenger cars an hour and lane.
    """

    def __init__(
        self,
        light: SumoLight,
        view: Light,
        sumo_map: SumoMap,
        volumes: Mapping[Turn, TurnVolume],
        *,
        phases: Sequence[ProgramPhase],
        saturation: float,
    ) -> None:
        self._light, self._view, self._phases = light, view, phases
        self._net = sumo_map.net
        self._base = saturation
        self._near_side = "left" if sumo_map.net.lefthand else "right"
        self._turns = turns_of(light, sumo_map)
        nothing = TurnVolume(0.0, 0.0)
        self._volumes = {turn: volumes.get(turn, nothing) for turn in self._turns}
        self.lanes = self._load_lanes()

    @property
    def movements(self) -> tuple[MovementVolume, ...]:
        """Volume of each movement of vehicles."""
        volumes = []
        for turn, links in self._turns.items():
            movement = self._view.movements[links[0]]
            volume = self._volumes[turn]
            volumes.append(
                MovementVolume(movement.name, movement.turn, volume.vehicles, volume.heavy)
            )
        return tuple(volumes)

    def needs(self) -> tuple[LaneNeed, ...]:
        """Flow ratio of each lane, with the numbers of the stages in which it has green."""
        stages = [phase for phase in self._phases if phase.stage]
        needs = []
        for lane in self.lanes:
            if lane.gaps is not None:
                shown = [{phase.state[n] for n in lane.links} for phase in stages]
                free = tuple(number for number, letters in enumerate(shown) if letters == {"G"})
                gaps = tuple(
                    GapGreen(number, lane.gaps, lane.blocked)
                    for number, letters in enumerate(shown)
                    if "g" in letters
                )
                needs.append(LaneNeed(lane.ratio, free, gaps))
                continue
            for quorum in (all, any):
                green = tuple(
                    number
                    for number, phase in enumerate(stages)
                    if quorum(phase.state[n] in "Gg" for n in lane.links)
                )
                if green:
                    break
            needs.append(LaneNeed(lane.ratio, green))
        return tuple(needs)

    def _load_lanes(self) -> tuple[LaneLoad, ...]:
        """Divide movements among their lanes: each part takes the lane of least ratio."""
        work: dict[str, float] = defaultdict(float)
        cars: dict[str, float] = defaultdict(float)
        links: dict[str, set[int]] = defaultdict(set)
        for stream in sorted(
            self._list_streams(), key=lambda stream: (len(stream.links), stream.turn)
        ):
            weight = 1.0 + (HEAVY - 1.0) * stream.heavy / stream.vehicles
            needs = {n: weight * self._equivalent_of_through(n) / self._base for n in stream.links}
            for _ in range(_SHARES):
                n = min(needs, key=lambda n: (work[self._light.links[n].source] + needs[n], n))
                lane = self._light.links[n].source
                work[lane] += stream.vehicles / _SHARES * needs[n]
                cars[lane] += stream.vehicles / _SHARES
                links[lane].add(n)
        loads = [
            LaneLoad(
                self._view.movements[min(links[lane])].lanes[0],
                tuple(dict.fromkeys(self._view.movements[n].turn for n in sorted(links[lane]))),
                cars[lane], cars[lane] / work[lane], tuple(sorted(links[lane])),
            )
            for lane in sorted(cars, key=lambda lane: min(links[lane]))
        ]  # fmt: skip
        return tuple(
            replace(
                load,
                blocked=self._blocked_flow_ratio(load, loads),
                gaps=self._share_through_gaps(load),
            )
            for load in loads
        )

    def _list_streams(self) -> list[_Stream]:
        """Vehicles by the lanes that are open to them: bicycles take theirs, if there is one."""
        streams = []
        for turn, own in self._turns.items():
            volume, lanes = self._volumes[turn], self._net.lanes
            driven = tuple(n for n in own if lanes[self._light.links[n].source].allows(DRIVEN))
            beside = tuple(n for n in own if n not in driven)
            apart = volume.bicycles if driven and beside else 0.0
            streams += [
                _Stream(driven or own, turn, volume.vehicles - apart, volume.heavy),
                _Stream(beside, turn, apart, 0.0),
            ]
        return [stream for stream in streams if stream.vehicles > 0.0]

    def _share_through_gaps(self, load: LaneLoad) -> float | None:
        """What a lane of protected-permissive turns alone carries through gaps, as a share."""
        if not all(self._is_protected_permissive(n) for n in load.links):
            return None
        across = max(self._opposing_flow(n) for n in load.links)
        return PROTECTED_LEFT / left_turn_equivalent(across, self._base)

    def _blocked_flow_ratio(self, load: LaneLoad, loads: Sequence[LaneLoad]) -> float:
        """Flow ratio of the queue that a lane of turns through gaps alone waits for."""
        if not all(self._is_permissive(n) or self._is_protected_permissive(n) for n in load.links):
            return 0.0
        before = {other for n in load.links for other in self._find_given_way(n)}
        return max((load.ratio for load in loads if before & set(load.links)), default=0.0)

    def _equivalent_of_through(self, link: int) -> float:
        turn = self._view.movements[link].turn
        if turn == "straight":
            return 1.0
        if turn == self._near_side:
            return RIGHT_TURN
        if not self._is_permissive(link):
            return PROTECTED_LEFT
        return left_turn_equivalent(self._opposing_flow(link), self._base)

    def _is_permissive(self, link: int) -> bool:
        """Whether a turn across has the green that gives way in all of its stages."""
        return self._green_letters(link) == {"g"}

    def _is_protected_permissive(self, link: int) -> bool:
        """Whether a turn across gives way in some of its stages and is protected in others."""
        return self._green_letters(link) == {"g", "G"}

    def _green_letters(self, link: int) -> set[str]:
        """Greens of a turn across in its stages; none of other movements."""
        if self._view.movements[link].turn in {"straight", self._near_side}:
            return set()
        return {phase.state[link] for phase in self._phases if phase.stage} & {"g", "G"}

    def _find_given_way(self, link: int) -> set[int]:
        """Movements that have green together with one that gives way to them."""
        greens = [phase.state for phase in self._phases if phase.stage and phase.state[link] == "g"]
        before = {
            meeting.other if meeting.one == link else meeting.one
            for meeting in self._view.meetings
            if meeting.yields == link
        }
        return {n for n in before if any(state[n] in "Gg" for state in greens)}

    def _opposing_flow(self, link: int) -> float:
        """Vehicles an hour that a permissive movement gives way to while both have green."""
        before = self._find_given_way(link)
        return sum(
            self._volumes[turn].vehicles
            for turn, links in self._turns.items()
            if before & set(links)
        )
