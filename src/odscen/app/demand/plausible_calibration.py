"""What is not plausible of the targets or the result of a calibration, in words."""

from __future__ import annotations

from collections import Counter, defaultdict
from typing import TYPE_CHECKING, Final

from odscen.scenario.demand.scaled_demand import trips_of
from odscen.scenario.demand.targets import FLOW

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from odscen.app.demand.target_values import Measured
    from odscen.scenario.demand.targets import Target
    from odscen.scenario.document.scenario_document import Scenario

MOST_FACTOR: Final = 2.0
"""Times the vehicles that targets may ask for, and that trips may become, without a doubt."""
MOST_CELL: Final = 5.0
LEAST_TRIPS: Final = 10.0
"""Trips of a row from which its factor says something."""
WORSE: Final = 1.1


def doubts_of(
    before: Scenario,
    after: Scenario,
    targets: Sequence[Target],
    shown: Measured,
    found: Measured,
    distances: Mapping[str, float | None],
) -> tuple[str, ...]:
    """Doubts about a calibration: targets against traffic, changes of demand, runs, validation.

    Parameters
    ----------
    shown, found
        What runs of ``before`` and ``after`` show.
    distances
        See :class:`odscen.app.demand.calibration.Calibration`.
    """
    return (
        *_doubt_passages(targets, shown),
        *_doubt_demand(before, after),
        *(f"a run of the calibrated scenario: {verdict}" for verdict in found.verdicts),
        *_doubt_validation(distances),
    )


def _doubt_passages(targets: Sequence[Target], shown: Measured) -> Iterator[str]:
    """Passages that were counted need vehicles that make them: not 60,000 where 3,000 drive."""
    flows = [target for target in targets if target.kind == FLOW]
    counted = sum(target.value for target in flows)
    if not flows or not counted or not shown.passages:
        return
    each = shown.passages / max(shown.vehicles, 1.0)
    needed = counted / each
    if not shown.vehicles / MOST_FACTOR <= needed <= shown.vehicles * MOST_FACTOR:
        yield (
            f"{counted:,.0f} passages were counted; the {shown.vehicles:,.0f} vehicles of the "
            f"scenario make {shown.passages:,.0f} at these places ({each:.1f} each), so it would "
            f"take {needed:,.0f} vehicles: look at units, slices and places of the counts"
        )


def _doubt_demand(before: Scenario, after: Scenario) -> Iterator[str]:
    old, new = trips_of(before.demand), trips_of(after.demand)
    if old and not 1.0 / MOST_FACTOR <= new / old <= MOST_FACTOR:
        yield f"{old:,.0f} trips have become {new:,.0f}: the matrix and the counts do not fit"
    pairs = _trips_of_pairs(before), _trips_of_pairs(after)
    changed = []
    for pair, number in pairs[0].items():
        factor = pairs[1][pair] / number if number else 1.0
        if max(number, pairs[1][pair]) >= LEAST_TRIPS and not 1 / MOST_CELL <= factor <= MOST_CELL:
            changed.append((abs(pairs[1][pair] - number), pair))
    if changed:
        _, (origin, destination) = max(changed)
        yield (
            f"{len(changed)} of {len(pairs[0])} pairs of the matrix have changed by more than "
            f"{MOST_CELL:g} times, most {origin} to {destination} "
            f"({pairs[0][origin, destination]:,.0f} to {pairs[1][origin, destination]:,.0f} trips)"
        )


def _trips_of_pairs(scenario: Scenario) -> Counter[tuple[str, str]]:
    found: Counter[tuple[str, str]] = Counter()
    sums: dict[tuple[str, str], float] = defaultdict(float)
    for matrix in scenario.demand.matrices:
        for origin, destination, number in matrix.trips:
            sums[origin, destination] += number
    found.update({pair: round(number) for pair, number in sums.items()})
    return found


def _doubt_validation(distances: Mapping[str, float | None]) -> Iterator[str]:
    before, after = distances["validation_before"], distances["validation_after"]
    if before is None or after is None:
        yield "no target was held back, so nothing says whether the result holds elsewhere"
    elif after > WORSE * before:
        yield (
            f"targets that were held back are further off than before ({before:.2f} to "
            f"{after:.2f}): the result is fitted to the others only"
        )
