"""Signal programs: stages without conflicts, and safe changes between them.

OpenDRIVE says which signals there are and which of them a controller switches together, but nothing
on timing. A program of ours never shows green to two movements that meet, pedestrians included:
no vehicle turns left through oncoming traffic, and none over a crossing with green. Times follow
common practice:

- yellow by speed: 3 s up to 50 km/h, 4 s up to 60, 5 s above (RiLSA 2015, section 2.4);
- all-red until the last vehicle has left, (path through the junction + 6 m) / speed, but for the
  second that the next ones need to start; whole seconds, from 1 to 8;
- a crossing turns red so early that one who has just started walks over at 1.2 m/s.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from odscen.convert.model.net import STAGE, Phase

if TYPE_CHECKING:
    from collections.abc import Sequence

CYCLE = 90.0
"""Seconds that the stages share, within the bounds of green."""

LEAST_GREEN = 8.0
MOST_GREEN = 40.0
WALK_GREEN = 7.0
"""Seconds of green of a stage only for pedestrians, at least."""

REST = 15.0
"""Seconds of red where a light has nothing to take turns with."""

WALKER = 1.2
"""m/s."""

CLEARING = 14.0
"""m/s at which vehicles are taken to leave a junction, at most."""

STARTING = 1.0
"""Seconds after the change to green before any road user moves."""

VEHICLE = 6.0
"""Metres of a vehicle that must have left."""

PROLONGED = 2.0
"""An actuated green may last this many times its planned duration."""


class SignalGroup(NamedTuple):
    """Links of one light that always show the same.

    Attributes
    ----------
    links
        Positions among the light's links.
    controller
        The OpenDRIVE controller, or empty.
    walkers
        Whether it is a crossing.
    speed
        m/s of the approach.
    path
        Metres through the junction, or of the crossing.
    """

    links: tuple[int, ...]
    controller: str
    walkers: bool
    speed: float
    path: float

    @property
    def yellow(self) -> float:
        """Seconds of yellow."""
        if self.walkers:
            return 0.0
        kmh = self.speed * 3.6
        return 3.0 if kmh <= 51.0 else 4.0 if kmh <= 61.0 else 5.0

    @property
    def clearance(self) -> float:
        """Seconds after yellow, or after the crossing's green, until others may go."""
        if self.walkers:
            return math.ceil(self.path / WALKER)
        pace = min(max(self.speed, 3.0), CLEARING)
        return min(max(math.ceil((self.path + VEHICLE) / pace - STARTING), 1.0), 8.0)


@dataclass(frozen=True, slots=True)
class Stages:
    """Which groups show green in which stage."""

    groups: tuple[SignalGroup, ...]
    green: tuple[frozenset[int], ...]


def plan_stages(groups: Sequence[SignalGroup], foes: frozenset[tuple[int, int]]) -> Stages:
    """Divide groups into stages so that no two in a stage are foes.

    Every group has a stage; groups of one controller share one if they can; what else fits into a
    stage is added to it.

    Parameters
    ----------
    foes
        Pairs of groups (smaller first) that meet.
    """
    vehicles = [n for n, group in enumerate(groups) if not group.walkers]
    walkers = [n for n, group in enumerate(groups) if group.walkers]
    stages: list[set[int]] = []
    for number in vehicles:
        if any(number in stage for stage in stages):
            continue
        controller = groups[number].controller
        mates = [n for n in vehicles if controller and groups[n].controller == controller]
        left = [n for n in (*mates, *vehicles) if not any(n in stage for stage in stages)]
        stages.append(_filled({number}, left, foes))
    stages = [_filled(stage, walkers, foes) for stage in stages]
    waiting = {n for n in walkers if not any(n in stage for stage in stages)}
    if waiting:
        stages.append(waiting)
    full = [_filled(stage, (*vehicles, *walkers), foes) for stage in stages]
    return Stages(tuple(groups), tuple(frozenset(stage) for stage in full))


def _filled(
    stage: set[int], candidates: Sequence[int], foes: frozenset[tuple[int, int]]
) -> set[int]:
    """Add to a stage what meets nothing in it, in the order given."""
    result = set(stage)
    for one in candidates:
        if all((min(one, other), max(one, other)) not in foes for other in result):
            result.add(one)
    return result


def program(stages: Stages, links: int) -> tuple[Phase, ...]:
    """Phases of a program: for each stage green, then what its end needs.

    Parameters
    ----------
    links
        Number of links of the light.
    """
    groups, order = stages.groups, stages.green
    if len(order) == 1:
        order = (*order, frozenset())
    losses = [_loss(groups, order[k], order[(k + 1) % len(order)]) for k in range(len(order))]
    lost = sum(sum(part) for part in losses)
    share = (CYCLE - lost) / len(order)
    phases: list[Phase] = []
    for number, stage in enumerate(order):
        following = order[(number + 1) % len(order)]
        walk, yellow, red = losses[number]
        vehicles = any(not groups[g].walkers for g in stage)
        green = float(round(min(max(share, LEAST_GREEN), MOST_GREEN))) if vehicles else WALK_GREEN
        if not stage:
            green = REST
        name = f"{STAGE}{number + 1}"
        bounds = (LEAST_GREEN, PROLONGED * green) if vehicles else (0.0, 0.0)
        phases.append(Phase(green, _state(groups, stage, "G", links), name, *bounds))
        ending = stage - following
        if walk:
            still = frozenset(g for g in stage if not (g in ending and groups[g].walkers))
            phases.append(Phase(walk, _state(groups, still, "G", links), "pedestrian clearance"))
        staying = _state(groups, stage & following, "G", links)
        if yellow:
            state = _state(
                groups, frozenset(g for g in ending if not groups[g].walkers), "y", links
            )
            phases.append(Phase(yellow, _over(staying, state), "yellow"))
        if red:
            phases.append(Phase(red, staying, "all red"))
    return tuple(phases)


def _loss(
    groups: Sequence[SignalGroup], stage: frozenset[int], following: frozenset[int]
) -> tuple[float, float, float]:
    """Seconds of pedestrian clearance, of yellow, and of all-red, at the end of a stage."""
    ending = [groups[g] for g in sorted(stage - following)]
    yellow = max((group.yellow for group in ending), default=0.0)
    red = max((group.clearance for group in ending if not group.walkers), default=0.0)
    walk = max((group.clearance for group in ending if group.walkers), default=0.0)
    return max(walk - yellow - red, 0.0), yellow, red


def _state(groups: Sequence[SignalGroup], chosen: frozenset[int], sign: str, links: int) -> str:
    letters = ["r"] * links
    for group in chosen:
        for link in groups[group].links:
            letters[link] = sign
    return "".join(letters)


def _over(below: str, above: str) -> str:
    return "".join(b if a == "r" else a for b, a in zip(below, above, strict=True))
