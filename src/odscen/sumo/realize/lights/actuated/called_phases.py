"""Phases of an actuated light with the stages of the map: what is not called is left out.

A stage comes when a vehicle stands or drives between loop and stop line, or somebody waits at one
of its crossings; crossings have green only then. Without any call the light rests in its main
stage, the one with the longest green: so traffic controllers do (NEMA TS 2: soft recall, rest in
green, pedestrian actuation).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from odscen.sumo.realize.lights.actuated.call_areas import all_of, any_of
from odscen.sumo.realize.lights.stage_phases import PhasePlan, SumoPhase

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.sumo.realize.lights.actuated.call_areas import Callers
    from odscen.sumo.realize.lights.actuated.stage_variants import StageVariant, StageVariants

RESTING = 3600.0
"""Seconds after which a resting light asks again; any call asks before."""

_Key = tuple[int, bool]


def called_phases(
    variants: StageVariants,
    callers: Callers,
    *,
    ends: Mapping[str, str],
    conditions: dict[str, str],
) -> PhasePlan:
    """Phases of a light.

    Parameters
    ----------
    ends
        Names of the conditions under which no vehicle prolongs a stage any more, by its id.
    conditions
        Conditions of the program, to which those of calls are added.
    """
    return _Called(variants, callers, ends, conditions).build()


@dataclass
class _Called:
    variants: StageVariants
    callers: Callers
    ends: Mapping[str, str]
    conditions: dict[str, str]
    phases: list[SumoPhase] = field(default_factory=list)
    greens: dict[_Key, int] = field(default_factory=dict)
    ways: dict[tuple[_Key, _Key], int] = field(default_factory=dict)

    def build(self) -> PhasePlan:
        all_variants = [one for variants in self.variants.of_stage for one in variants]
        self._main()
        main = len(self.phases)
        for one in all_variants:
            if _key(one) not in self.greens:
                self.greens[_key(one)] = self._add(one.green)
        for one in all_variants:
            exits = [way for other in self._others(one) if (way := self._exit(one, other))]
            if one.stage == self._home:
                self._rest(one, exits)
            else:
                self._follow(self.greens[_key(one)], (*exits, self._back(one)))
        return PhasePlan(tuple(self.phases), main)

    @property
    def _home(self) -> int:
        """Stage with vehicles that has the longest green: there the light rests."""
        driven = [variants[0] for variants in self.variants.of_stage if variants[0].drive]
        return max(driven, key=lambda one: (one.green.seconds, -one.stage)).stage

    def _main(self) -> None:
        """The map's cycle: all stages in order, with their crossings."""
        stages = self.variants.of_stage
        for number, (first, *_) in enumerate(stages):
            self.greens[_key(first)] = self._add(first.green)
            following = _key(stages[(number + 1) % len(stages)][0])
            between = self.variants.between(number) or [SumoPhase(1.0, first.green.state, "")]
            self.ways[_key(first), following] = len(self.phases)
            self.phases += between
        self._follow(len(self.phases) - 1, (0,))

    def _others(self, one: StageVariant) -> list[StageVariant]:
        """Variants of other stages in the order in which they come."""
        stages = self.variants.of_stage
        order = [*range(one.stage + 1, len(stages)), *range(one.stage)]
        return [other for number in order for other in stages[number]]

    # Ways and what calls them

    def _exit(self, one: StageVariant, other: StageVariant) -> int | None:
        """First phase of the way to a stage that somebody calls; ``None`` if nobody can."""
        call = self._called(one, other)
        if not call:
            return None
        at = self._way(one, other)
        end = self.ends.get(one.green.stage, "")
        early = all_of((end, call)) if end else ""
        self.phases[at] = replace(self.phases[at], early=early, final=call)
        return at

    def _called(self, one: StageVariant, other: StageVariant) -> str:
        """Name of the condition that somebody calls a variant while another has green.

        People call one with crossings, vehicles one without.
        """
        shown, wanted = one.green.state, other.green.state
        if other.walk:
            found = self.callers.people(shown, wanted)
        else:
            found = self.callers.vehicles(shown, wanted)
        following = (one.stage + 1) % len(self.variants.of_stage)
        if one.stage == self._home and other is self.variants.of_stage[following][-1]:
            found = any_of((found, self.callers.stuck(shown)))
        return self._condition(one, other, found)

    def _condition(self, one: StageVariant, other: StageVariant, expression: str) -> str:
        if not expression:
            return ""
        name = f"call{_name(one)}to{_name(other)}"
        self.conditions[name] = expression
        return name

    def _way(self, one: StageVariant, other: StageVariant) -> int:
        pair = _key(one), _key(other)
        if pair not in self.ways:
            self.ways[pair] = self._laid(self.variants.way(one, other), self.greens[_key(other)])
        return self.ways[pair]

    def _laid(self, way: list[SumoPhase], target: int) -> int:
        first = len(self.phases)
        for number, phase in enumerate(way, start=first + 1):
            last = number == first + len(way)
            self.phases.append(replace(phase, following=(target if last else number,)))
        return first

    def _back(self, one: StageVariant) -> int:
        """Way to the main stage where nobody calls; its first phase is its own."""
        home = self.variants.of_stage[self._home][-1]
        way = self.variants.way(one, home)
        at = self._laid(way, self.greens[_key(home)])
        early = self.ends.get(one.green.stage, "")
        self.phases[at] = replace(self.phases[at], early=early, final="1")
        return at

    # Resting

    def _rest(self, one: StageVariant, exits: list[int]) -> None:
        """Let the main stage last while nobody calls another; then it is prolonged anew."""
        green = one.green
        rest, prolonged = len(self.phases), len(self.phases) + 1
        called = any_of(self.phases[way].final for way in exits)
        asked = f"asked{_name(one)}"
        self.conditions[asked] = called or "0"
        self._add(replace(green, seconds=1.0, least=1.0, most=RESTING))
        self._add(replace(green, seconds=1.0, least=1.0, early=asked))
        walk = None if one.walk else self._start_walking(one, asked)
        self._follow(rest, (prolonged,) if walk is None else (walk, prolonged))
        self._follow(prolonged, (*exits, rest))
        self._follow(self.greens[_key(one)], (*exits, rest))

    def _start_walking(self, one: StageVariant, asked: str) -> int | None:
        """Way on which crossings get green in a stage that rests."""
        walking = self.variants.of_stage[one.stage][0]
        waits = self.callers.people(one.green.state, walking.green.state) if walking.walk else ""
        if not waits:
            return None
        at = self._way(one, walking)
        call = self._condition(one, walking, waits)
        early = all_of((call, f"{asked} < 1"))
        self.phases[at] = replace(self.phases[at], early=early)
        return at

    def _add(self, phase: SumoPhase) -> int:
        self.phases.append(phase)
        return len(self.phases) - 1

    def _follow(self, at: int, following: tuple[int, ...]) -> None:
        self.phases[at] = replace(self.phases[at], following=following)


def _key(one: StageVariant) -> _Key:
    return one.stage, one.walk


def _name(one: StageVariant) -> str:
    return f"{one.stage + 1}{'walk' if one.walk else ''}"
