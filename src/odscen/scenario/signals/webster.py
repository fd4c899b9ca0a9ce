"""Cycle and splits by Webster: green in proportion to the critical flow ratios of the stages.

F. V. Webster, Traffic Signal Settings, Road Research Technical Paper 39, 1958: the cycle of least
delay is ``(1.5 L + 5) / (1 - Y)``, with ``L`` the lost time of a cycle and ``Y`` the sum of the
critical flow ratios (volume over saturation flow) of the stages. Start-up loss and the use of
yellow are taken as equal (2 s each, HCM), so that effective and shown green are the same, and
yellow and all-red are lost.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

SATURATION_FLOW = 1900.0
"""Passenger cars an hour and lane of green that drive straight on (HCM, base saturation flow)."""

RIGHT_TURN = 1.18
PROTECTED_LEFT = 1.05
"""Passenger cars that drive straight on in the time of one that turns so (HCM)."""

HEAVY = 2.0
"""Passenger cars that drive off in the time of one truck or bus (HCM)."""

CRITICAL_GAP, FOLLOW_UP = 4.5, 2.5
"""Seconds of those who turn left across oncoming traffic (HCM, permitted left turns)."""

HARDEST_LEFT = 8.0
"""Passenger cars for one permissive left turn, at most: some turn when the green ends."""

_ROUNDS = 8
"""What gaps carry depends on the greens, and these on what it leaves: found in rounds."""

SHORTEST_CYCLE, LONGEST_CYCLE = 40.0, 120.0
"""Seconds."""


class StageNeed(NamedTuple):
    """One stage of a light.

    Attributes
    ----------
    least
        Seconds of its shortest green.
    more
        Seconds after it in which vehicles still have green: while crossings are cleared.
    fixed
        Whether it is no vehicle's, and lasts ``least``.
    """

    least: float
    more: float = 0.0
    fixed: bool = False


class GapGreen(NamedTuple):
    """Green through gaps of a lane that in other stages has it without giving way.

    Attributes
    ----------
    stage
        Number of the stage.
    share
        Part of its saturation flow that a lane has through gaps.
    blocked
        Flow ratio of the oncoming queue that leaves none.
    """

    stage: int
    share: float
    blocked: float


class LaneNeed(NamedTuple):
    """Flow ratio of a lane at the stop line, and the stages (by number) in which it has green.

    ``gaps`` are those in which a protected-permissive turn gives way; what they carry its
    protected ``stages`` need not.
    """

    ratio: float
    stages: tuple[int, ...]
    gaps: tuple[GapGreen, ...] = ()


@dataclass(frozen=True, slots=True)
class Splits:
    """Cycle and greens.

    Attributes
    ----------
    cycle
        Seconds.
    greens
        Seconds of each stage.
    ratios
        Critical flow ratio of each stage.
    lost
        Lost time of a cycle, seconds: all in which no stage with traffic has green.
    wanted
        Cycle of Webster's formula before its bounds; infinite if the flow ratios reach 1.
    """

    cycle: float
    greens: tuple[float, ...]
    ratios: tuple[float, ...]
    lost: float
    wanted: float

    @property
    def flow_ratio(self) -> float:
        """Webster's Y."""
        return sum(self.ratios)


def left_turn_equivalent(opposing: float, saturation: float = SATURATION_FLOW) -> float:
    """Cars straight on in the time of one that turns left across ``opposing`` vehicles an hour.

    By the capacity of a gap-acceptance movement, as HCM has it for permitted left turns:
    ``v exp(-v tc / 3600) / (1 - exp(-v tf / 3600))``.
    """
    if opposing <= 0.0:
        filtered = 3600.0 / FOLLOW_UP
    else:
        late = -math.expm1(-opposing * FOLLOW_UP / 3600.0)
        filtered = opposing * math.exp(-opposing * CRITICAL_GAP / 3600.0) / late
    return min(max(saturation / filtered, PROTECTED_LEFT), HARDEST_LEFT)


def critical_ratios(
    lanes: Sequence[LaneNeed], stages: int, *, spare: float = 1.0
) -> tuple[float, ...]:
    """Flow ratio of each stage that its critical lane needs.

    Lanes with green in one stage come first; what one with several still lacks is divided among
    those stages in proportion to what they have. Protected-permissive turns come last, with what
    the gaps in the green of others do not carry (HCM 7th edition, chapter 31).

    Parameters
    ----------
    spare
        Share of the cycle that a stage has as green, over its flow ratio.
    """
    ratios = [0.0] * stages
    for lane in sorted(lanes, key=lambda lane: (len(lane.gaps), len(lane.stages), -lane.ratio)):
        had = sum(ratios[stage] for stage in lane.stages)
        filtered = sum(
            max(ratios[n] * spare - blocked, 0.0) / (1.0 - blocked) * share
            for n, share, blocked in lane.gaps
        )
        lack = lane.ratio - had - filtered
        if not lane.stages or lack <= 0.0:
            continue
        for stage in lane.stages:
            ratios[stage] += lack * (ratios[stage] / had if had else 1.0 / len(lane.stages))
    return tuple(ratios)


def webster(
    stages: Sequence[StageNeed],
    lanes: Sequence[LaneNeed],
    *,
    between: float,
    bounds: tuple[float, float] = (SHORTEST_CYCLE, LONGEST_CYCLE),
    cycle: float | None = None,
) -> Splits:
    """Cycle and greens of a light.

    Parameters
    ----------
    between
        Seconds of a cycle that are no stage's green: intergreens, and the ``more`` of all stages.
    bounds
        Shortest and longest cycle, seconds. Least greens that need more get it.
    cycle
        Seconds of a cycle that is given.
    """
    ratios = critical_ratios(lanes, len(stages))
    lost = _lost_time(stages, ratios, between)
    wanted = _optimal_cycle(lost, sum(ratios))
    if any(lane.gaps for lane in lanes):
        for _ in range(_ROUNDS):
            length = min(max(wanted if cycle is None else cycle, bounds[0]), bounds[1])
            spare = max((1.0 - lost / length) / sum(ratios), 1.0) if any(ratios) else 1.0
            ratios = critical_ratios(lanes, len(stages), spare=spare)
            lost = _lost_time(stages, ratios, between)
            wanted = _optimal_cycle(lost, sum(ratios))
    if cycle is None:
        cycle = min(max(wanted, bounds[0]), bounds[1])
        cycle = float(math.ceil(cycle - 1e-9))
    least = between + sum(stage.least for stage in stages)
    cycle = max(cycle, least)
    greens = divided_greens(stages, ratios, cycle - between)
    return Splits(cycle, greens, ratios, lost, wanted)


def _lost_time(stages: Sequence[StageNeed], ratios: Sequence[float], between: float) -> float:
    """Seconds of a cycle in which no stage with traffic has green."""
    return between + sum(
        -stage.more if ratio > 0.0 and not stage.fixed else stage.least
        for stage, ratio in zip(stages, ratios, strict=True)
    )


def _optimal_cycle(lost: float, total: float) -> float:
    return (1.5 * lost + 5.0) / (1.0 - total) if total < 1.0 else math.inf


def divided_greens(
    stages: Sequence[StageNeed], ratios: Sequence[float], seconds: float
) -> tuple[float, ...]:
    """Divide ``seconds`` of green: in proportion to flow ratios, not less than least greens.

    In whole seconds; stages without a flow ratio get their least green, or all are alike.
    """
    greens = {n: stage.least for n, stage in enumerate(stages)}
    free = {n for n, ratio in enumerate(ratios) if ratio > 0.0 and not stages[n].fixed}
    if not free:  # nobody comes: those who may are alike
        free = {n for n, stage in enumerate(stages) if not stage.fixed} or set(greens)
        ratios = [1.0] * len(stages)
    while free:
        rest = seconds - sum(greens[n] for n in greens if n not in free)
        unit = (rest + sum(stages[n].more for n in free)) / sum(ratios[n] for n in free)
        shares = {n: unit * ratios[n] - stages[n].more for n in free}
        short = {n for n, share in shares.items() if share < stages[n].least}
        if not short:
            greens.update(shares)
            break
        free -= short
    return whole_seconds(greens, seconds)


def whole_seconds(greens: Mapping[int, float], seconds: float) -> tuple[float, ...]:
    """Greens in whole seconds that add up to ``seconds``; the longest has a fraction of it."""
    whole = {n: float(math.floor(green + 1e-9)) for n, green in greens.items()}
    rest = seconds - sum(whole.values())
    by_part = sorted(greens, key=lambda n: (whole[n] - greens[n], n))
    for n in by_part:
        if rest >= 1.0 - 1e-9:
            whole[n] += 1.0
            rest -= 1.0
    longest = max(whole, key=lambda n: (whole[n], -n))
    whole[longest] = round(whole[longest] + rest, 6)
    return tuple(whole[n] for n in sorted(whole))
