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

    from odscen.sumo.realize.lights.actuated.call_areas import CallDetectors
    from odscen.sumo.realize.lights.actuated.stage_variants import StageVariant, StageVariants

RESTING = 3600.0
"""Seconds after which a resting light asks again; any call asks before."""

_Key = tuple[int, bool]


def called_phases(
    variants: StageVariants,
    callers: CallDetectors,
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
    return _CalledPhases(variants, callers, ends, conditions).build()


@dataclass
class _CalledPhases:
    variants: StageVariants
    callers: CallDetectors
    ends: Mapping[str, str]
    conditions: dict[str, str]
    phases: list[SumoPhase] = field(default_factory=list)
    greens: dict[_Key, int] = field(default_factory=dict)
    ways: dict[tuple[_Key, _Key], int] = field(default_factory=dict)

    def build(self) -> PhasePlan:
        all_variants = [variant for variants in self.variants.of_stage for variant in variants]
        self._lay_main_cycle()
        main = len(self.phases)
        for variant in all_variants:
            if _variant_key(variant) not in self.greens:
                self.greens[_variant_key(variant)] = self._add_phase(variant.green)
        for variant in all_variants:
            exits = [
                way
                for other in self._other_variants(variant)
                if (way := self._lay_exit(variant, other))
            ]
            if variant.stage == self._find_home_stage:
                self._let_rest(variant, exits)
            else:
                self._set_following(
                    self.greens[_variant_key(variant)], (*exits, self._way_back(variant))
                )
        return PhasePlan(tuple(self.phases), main)

    @property
    def _find_home_stage(self) -> int:
        """Stage with vehicles that has the longest green: there the light rests."""
        driven = [variants[0] for variants in self.variants.of_stage if variants[0].drive]
        return max(driven, key=lambda variant: (variant.green.seconds, -variant.stage)).stage

    def _lay_main_cycle(self) -> None:
        """The map's cycle: all stages in order, with their crossings."""
        stages = self.variants.of_stage
        for number, (first, *_) in enumerate(stages):
            self.greens[_variant_key(first)] = self._add_phase(first.green)
            following = _variant_key(stages[(number + 1) % len(stages)][0])
            between = self.variants.between(number) or [SumoPhase(1.0, first.green.state, "")]
            self.ways[_variant_key(first), following] = len(self.phases)
            self.phases += between
        self._set_following(len(self.phases) - 1, (0,))

    def _other_variants(self, stage_variant: StageVariant) -> list[StageVariant]:
        """Variants of other stages in the order in which they come."""
        stages = self.variants.of_stage
        order = [*range(stage_variant.stage + 1, len(stages)), *range(stage_variant.stage)]
        return [other for number in order for other in stages[number]]

    # Ways and what calls them

    def _lay_exit(self, one: StageVariant, other: StageVariant) -> int | None:
        """First phase of the way to a stage that somebody calls; ``None`` if nobody can."""
        call = self._call_condition(one, other)
        if not call:
            return None
        at = self._way_between(one, other)
        end = self.ends.get(one.green.stage, "")
        early = all_of((end, call)) if end else ""
        self.phases[at] = replace(self.phases[at], early=early, final=call)
        return at

    def _call_condition(self, one: StageVariant, other: StageVariant) -> str:
        """Name of the condition that somebody calls a variant while another has green.

        People call one with crossings, vehicles one without.
        """
        shown, wanted = one.green.state, other.green.state
        if other.walk:
            found = self.callers.people(shown, wanted)
        else:
            found = self.callers.vehicles(shown, wanted)
        following = (one.stage + 1) % len(self.variants.of_stage)
        if one.stage == self._find_home_stage and other is self.variants.of_stage[following][-1]:
            found = any_of((found, self.callers.stuck(shown)))
        return self._add_condition(one, other, found)

    def _add_condition(self, one: StageVariant, other: StageVariant, expression: str) -> str:
        if not expression:
            return ""
        name = f"call{_variant_name(one)}to{_variant_name(other)}"
        self.conditions[name] = expression
        return name

    def _way_between(self, one: StageVariant, other: StageVariant) -> int:
        pair = _variant_key(one), _variant_key(other)
        if pair not in self.ways:
            self.ways[pair] = self._lay_way(
                self.variants.way(one, other), self.greens[_variant_key(other)]
            )
        return self.ways[pair]

    def _lay_way(self, way: list[SumoPhase], target: int) -> int:
        first = len(self.phases)
        for number, phase in enumerate(way, start=first + 1):
            last = number == first + len(way)
            self.phases.append(replace(phase, following=(target if last else number,)))
        return first

    def _way_back(self, stage_variant: StageVariant) -> int:
        """Way to the main stage where nobody calls; its first phase is its own."""
        home = self.variants.of_stage[self._find_home_stage][-1]
        way = self.variants.way(stage_variant, home)
        at = self._lay_way(way, self.greens[_variant_key(home)])
        early = self.ends.get(stage_variant.green.stage, "")
        self.phases[at] = replace(self.phases[at], early=early, final="1")
        return at

    # Resting

    def _let_rest(self, stage_variant: StageVariant, exits: list[int]) -> None:
        """Let the main stage last while nobody calls another; then it is prolonged anew."""
        green = stage_variant.green
        rest, prolonged = len(self.phases), len(self.phases) + 1
        called = any_of(self.phases[way].final for way in exits)
        asked = f"asked{_variant_name(stage_variant)}"
        self.conditions[asked] = called or "0"
        self._add_phase(replace(green, seconds=1.0, least=1.0, most=RESTING))
        self._add_phase(replace(green, seconds=1.0, least=1.0, early=asked))
        walk = None if stage_variant.walk else self._start_walking(stage_variant, asked)
        self._set_following(rest, (prolonged,) if walk is None else (walk, prolonged))
        self._set_following(prolonged, (*exits, rest))
        self._set_following(self.greens[_variant_key(stage_variant)], (*exits, rest))

    def _start_walking(self, stage_variant: StageVariant, asked: str) -> int | None:
        """Way on which crossings get green in a stage that rests."""
        walking = self.variants.of_stage[stage_variant.stage][0]
        waits = (
            self.callers.people(stage_variant.green.state, walking.green.state)
            if walking.walk
            else ""
        )
        if not waits:
            return None
        at = self._way_between(stage_variant, walking)
        call = self._add_condition(stage_variant, walking, waits)
        early = all_of((call, f"{asked} < 1"))
        self.phases[at] = replace(self.phases[at], early=early)
        return at

    def _add_phase(self, phase: SumoPhase) -> int:
        self.phases.append(phase)
        return len(self.phases) - 1

    def _set_following(self, at: int, following: tuple[int, ...]) -> None:
        self.phases[at] = replace(self.phases[at], following=following)


def _variant_key(stage_variant: StageVariant) -> _Key:
    return stage_variant.stage, stage_variant.walk


def _variant_name(stage_variant: StageVariant) -> str:
    return f"{stage_variant.stage + 1}{'walk' if stage_variant.walk else ''}"
