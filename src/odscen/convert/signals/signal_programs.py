"""Signal programs: stages as practice makes them, and safe changes between them.

OpenDRIVE says which signals there are and which of them a controller switches together, but nothing
on timing. Opposing approaches go together; who turns across them, or over a crossing that walks in
parallel, has the green that gives way (``g``), as long as SUMO's right of way says that it does.
What must not meet never has green together. Times follow common practice:

- yellow by speed: 3 s up to 50 km/h, 4 s up to 60, 5 s above (RiLSA 2015, section 2.4);
- all-red by the paths of those that end and of those that begin next, to where they meet
  (:mod:`odscen.convert.signals.shared_green`);
- crossings turn red, while their stage goes on, so early that one who has just started walks over;
- the cycle by Webster, (1.5 L + 5) / (1 - Y), and equal greens: no demand is known when a map is
  converted, and numbers of lanes say nothing of it. What other programs would gain or lose for
  which loads of the main and the side road is in ``docs/signals.md``.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

from odscen.convert.model.extended_greens import LONGEST_CYCLE
from odscen.convert.model.net import STAGE, Phase

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

FLOW_RATIO = 0.45
"""Sum of the critical flow ratios (Webster's Y) that programs are made for.

Moderate traffic: a cycle for saturated roads would let everybody wait long on all others.
"""

SHORTEST_CYCLE = 40.0
"""Seconds."""

LEAST_GREEN = 8.0
WALK_GREEN = 7.0
"""Seconds of green of a crossing, at least."""

REST = 15.0
"""Seconds of red where a light has nothing to take turns with."""

PROLONGED = 2.0
"""An actuated green may last this many times its planned duration."""


class SignalGroup(NamedTuple):
    """Links of one light that are green in the same stages.

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
    """

    links: tuple[int, ...]
    controller: str
    walkers: bool
    speed: float

    @property
    def yellow(self) -> float:
        """Seconds of yellow."""
        if self.walkers:
            return 0.0
        kmh = self.speed * 3.6
        return 3.0 if kmh <= 51.0 else 4.0 if kmh <= 61.0 else 5.0


@dataclass(frozen=True, slots=True)
class GroupConflicts:
    """What keeps groups apart.

    Attributes
    ----------
    apart
        Pairs of groups (smaller first) that never have green together.
    yielding
        Pairs of links that may have it: the first gives way to the second.
    clearing
        For groups that are apart, as (ending, beginning): whole seconds from the end of yellow, or
        of a crossing's green, until the other may begin.
    """

    apart: frozenset[tuple[int, int]] = frozenset()
    yielding: frozenset[tuple[int, int]] = frozenset()
    clearing: Mapping[tuple[int, int], float] | None = None

    def seconds(self, ending: int, beginning: int) -> float:
        """Seconds of :attr:`clearing`; 0 for groups that are not apart."""
        if (min(ending, beginning), max(ending, beginning)) not in self.apart:
            return 0.0
        return (self.clearing or {}).get((ending, beginning), 1.0)


@dataclass(frozen=True, slots=True)
class Stages:
    """Which groups show green in which stage."""

    groups: tuple[SignalGroup, ...]
    green: tuple[frozenset[int], ...]
    conflicts: GroupConflicts


def plan_stages(groups: Sequence[SignalGroup], conflicts: GroupConflicts) -> Stages:
    """Divide groups into stages so that none in a stage are to be kept apart.

    Every group has a stage. Groups of one controller share one if they can, else those before in
    ``groups`` choose first; what else fits into a stage is added to it. Crossings that fit into no
    stage share a last one.
    """
    apart = conflicts.apart
    vehicles = [n for n, group in enumerate(groups) if not group.walkers]
    walkers = [n for n, group in enumerate(groups) if group.walkers]
    stages: list[set[int]] = []
    for number in vehicles:
        if any(number in stage for stage in stages):
            continue
        controller = groups[number].controller
        mates = [n for n in vehicles if controller and groups[n].controller == controller]
        left = [n for n in (*mates, *vehicles) if not any(n in stage for stage in stages)]
        stages.append(_fill_stage({number}, left, apart))
    stages = [_fill_stage(stage, walkers, apart) for stage in stages]
    waiting = {n for n in walkers if not any(n in stage for stage in stages)}
    if waiting:
        stages.append(waiting)
    full = [_fill_stage(stage, (*vehicles, *walkers), apart) for stage in stages]
    return Stages(tuple(groups), tuple(frozenset(stage) for stage in full), conflicts)


def _fill_stage(
    stage: set[int], candidates: Sequence[int], apart: frozenset[tuple[int, int]]
) -> set[int]:
    """Add to a stage what may go with all in it, in the order given."""
    result = set(stage)
    for candidate in candidates:
        if all((min(candidate, other), max(candidate, other)) not in apart for other in result):
            result.add(candidate)
    return result


class _Change(NamedTuple):
    """End of a stage, in seconds.

    Attributes
    ----------
    walk
        Pedestrian clearance within the green: crossings are red before vehicles are.
    yellow
        Of the vehicles that end.
    starts
        From the end of the vehicles' green until each group of the next stage begins.
    lost
        From there until vehicles begin, all at a time.
    """

    walk: float
    yellow: float
    starts: Mapping[int, float]
    lost: float

    @property
    def late(self) -> float:
        """Seconds from when the vehicles have begun until the last crossing begins."""
        return max(*self.starts.values(), self.lost) - self.lost if self.starts else 0.0


def program(stages: Stages, links: int) -> tuple[Phase, ...]:
    """Phases of a program: for each stage green, then what its end needs.

    Vehicles begin as soon as all that they wait for have cleared, and persons when those have that
    they wait for: mostly some seconds later, as for them vehicles clear the whole junction.

    Parameters
    ----------
    links
        Number of links of the light.
    """
    order = stages.green if len(stages.green) > 1 else (*stages.green, frozenset[int]())
    turns = [(stage, order[(k + 1) % len(order)]) for k, stage in enumerate(order)]
    changes = [_plan_change(stages, stage, following) for stage, following in turns]
    greens = _green_seconds(stages.groups, order, changes)
    phases: list[Phase] = []
    for number, (stage, following) in enumerate(turns):
        green, change = greens[number], changes[number]
        vehicles = any(not stages.groups[g].walkers for g in stage)
        bounds = (min(LEAST_GREEN, green), PROLONGED * green) if vehicles else (0.0, 0.0)
        shown = _stage_state(stages, stage, links)
        phases.append(Phase(green, shown, f"{STAGE}{number + 1}", *bounds))
        if change.walk:
            ending = frozenset(g for g in stage - following if stages.groups[g].walkers)
            still = _darken_state(shown, stages.groups, ending)
            phases.append(Phase(change.walk, still, "pedestrian clearance"))
        phases += _ending_phases(stages, stage, following, change, links)
    return tuple(phases)


def _ending_phases(
    stages: Stages,
    stage: frozenset[int],
    following: frozenset[int],
    change: _Change,
    links: int,
) -> list[Phase]:
    """Phases from the end of the vehicles' green to where all of the next stage have begun."""
    groups, ending = stages.groups, stage - following
    after = _stage_state(stages, following, links)
    staying = _careful_state(
        _darken_state(_stage_state(stages, stage, links), groups, ending), after
    )
    times = sorted({0.0, change.yellow, *change.starts.values()})
    phases = []
    for start, end in pairwise(times):
        begun = [g for g, seconds in change.starts.items() if seconds <= start]
        state = _begin_state(staying, after, groups, begun)
        cars = any(not groups[g].walkers for g in begun)
        name = "vehicles first" if cars else "crossings first" if begun else "all red"
        if start < change.yellow:
            vehicles = frozenset(g for g in ending if not groups[g].walkers)
            state, name = _darken_state(state, groups, vehicles, "y"), "yellow"
        phases.append(Phase(end - start, state, name))
    return phases


def _plan_change(stages: Stages, stage: frozenset[int], following: frozenset[int]) -> _Change:
    groups, seconds = stages.groups, stages.conflicts.seconds
    ending, beginning = stage - following, following - stage
    cars = [g for g in ending if not groups[g].walkers]
    walkers = [g for g in ending if groups[g].walkers]
    yellow = max((groups[g].yellow for g in cars), default=0.0)
    cleared = {
        b: max((yellow + seconds(g, b) for g in cars if seconds(g, b)), default=0.0)
        for b in sorted(beginning)
    }
    lost = max((cleared[b] for b in cleared if not groups[b].walkers), default=yellow)
    starts = {b: cleared[b] if groups[b].walkers else lost for b in cleared}
    latest = max((*starts.values(), lost))
    others = frozenset(range(len(groups))) - stage
    walk = max(
        (seconds(g, o) - starts.get(o, latest + WALK_GREEN) for g in walkers for o in others),
        default=0.0,
    )
    return _Change(max(walk, 0.0), yellow, starts, lost)


def _green_seconds(
    groups: Sequence[SignalGroup], order: Sequence[frozenset[int]], changes: Sequence[_Change]
) -> list[float]:
    """Seconds in which all of a stage are green."""
    cars = [any(not groups[g].walkers for g in stage) for stage in order]
    walks = sum(
        WALK_GREEN + change.walk for some, change in zip(cars, changes, strict=True) if not some
    )
    lost = walks + sum(change.lost for change in changes)
    cycle = (1.5 * lost + 5.0) / (1.0 - FLOW_RATIO)
    cycle = min(max(cycle, SHORTEST_CYCLE), LONGEST_CYCLE)
    split = (cycle - lost) / max(sum(cars), 1)
    greens = []
    for number, (stage, some, change) in enumerate(zip(order, cars, changes, strict=True)):
        if not stage:
            greens.append(REST)
        elif not some:
            greens.append(WALK_GREEN)
        else:
            only_cars = change.walk + changes[number - 1].late
            greens.append(float(max(round(split - only_cars), LEAST_GREEN)))
    return greens


def _stage_state(stages: Stages, stage: frozenset[int], links: int) -> str:
    """Letters of a stage: who gives way to another that is green has ``g``."""
    green = {link for group in stage for link in stages.groups[group].links}
    waiting = {one for one, other in stages.conflicts.yielding if other in green}
    return "".join(
        ("g" if link in waiting else "G") if link in green else "r" for link in range(links)
    )


def _darken_state(
    state: str, groups: Sequence[SignalGroup], ending: frozenset[int], letter: str = "r"
) -> str:
    """State with another letter for the links of some groups."""
    links = {link for group in ending for link in groups[group].links}
    return "".join(letter if n in links else one for n, one in enumerate(state))


def _begin_state(
    state: str, after: str, groups: Sequence[SignalGroup], begun: Sequence[int]
) -> str:
    """State in which some groups show already what they do in the next stage."""
    links = {link for group in begun for link in groups[group].links}
    pairs = zip(state, after, strict=True)
    return "".join(new if n in links else old for n, (old, new) in enumerate(pairs))


def _careful_state(state: str, following: str) -> str:
    """State between two stages: what gives way in the next one does so already."""
    pairs = zip(state, following, strict=True)
    return "".join("g" if one == "G" and other == "g" else one for one, other in pairs)
