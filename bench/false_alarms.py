"""Does the gate fail when nothing has changed, and does it see a change of 5 %?

Every scenario of the shipped suite is run with many seeds that redraw its traffic, as it is and
with drivers who keep a longer headway, chosen so that the mean delay grows by about 5 %. From
these runs, baselines and reruns of several sizes are put together, fifty times each:

- a false alarm is a rerun of the unchanged scenario with seeds that the baseline does not have, in
  which any figure or place fails;
- a change is caught if the mean delay fails. With other seeds it is raised by 5 %; with the
  seeds of the baseline it differs as the longer headway makes it differ from seed to seed, but by
  5 % on average.

``--seeds N`` runs each scenario with N seeds (64), ``--keep FILE`` stores what was measured, or
reads it if the file is there.
"""

from __future__ import annotations

import argparse
import math
import pickle
import statistics
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.stats import t

from odscen.app.scenarios import read_scenario, write_scenario
from odscen.regression.baseline import baseline_of
from odscen.regression.gates import run_suite
from odscen.regression.measure import FigureKey, Measured
from odscen.regression.scatter import (
    CAUGHT,
    CHANGE,
    FEWEST_SEEDS,
    FLOOR,
    Level,
    allowed_by_chance,
    seeds_needed,
)
from odscen.regression.suite import Suite, read_suite
from odscen.regression.tolerance import Tolerances, usual
from odscen.regression.verdict import hold_against
from odscen.scenario.document.validation import validated
from odscen.sumo.realize.driving import HEADWAY
from odscen.workspace.store import Workspace

SUITE = Path(__file__).parents[1] / "suites" / "shipped.toml"
RERUNS = 50
PROBE_SEEDS, PROBE = 12, 1.0
"""Seeds, and seconds more of headway, from which its effect is estimated."""
SIZES = (8, 16, 24, 32, 48)
DELAY = FigureKey("run", "", "mean_delay")

Runs = dict[int, Measured]
FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Pool:
    """Runs of one scenario by seed, as it is and with a longer headway (s)."""

    before: Runs
    after: Runs
    headway: float


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=64)
    parser.add_argument("--keep", type=Path)
    chosen = parser.parse_args()
    if chosen.keep is not None and chosen.keep.is_file():
        pools = pickle.loads(chosen.keep.read_bytes())
    else:
        with tempfile.TemporaryDirectory(prefix="odscen-bench-") as folder:
            pools = measured_pools(Path(folder), chosen.seeds)
        if chosen.keep is not None:
            chosen.keep.write_bytes(pickle.dumps(pools))
    report(pools)


def measured_pools(folder: Path, count: int) -> dict[str, Pool]:
    workspace = Workspace.open(folder / "workspace")
    suite = replace(read_suite(SUITE), missing=())
    before = measured(workspace, suite, range(1, count + 1))
    headways = dict.fromkeys(before, HEADWAY + PROBE)
    probed = measured(workspace, slower(suite, headways, folder), range(1, PROBE_SEEDS + 1))
    headways = {name: headway_for(before[name], probed[name]) for name in before}
    after = measured(workspace, slower(suite, headways, folder), range(1, count + 1))
    return {name: Pool(before[name], after[name], headways[name]) for name in before}


def measured(workspace: Workspace, suite: Suite, seeds: Sequence[int]) -> dict[str, Runs]:
    cases = [
        replace(case, seeds=tuple(seeds), redraw="traffic", baseline=None, expectations=())
        for case in suite.cases
    ]
    found = run_suite(workspace, replace(suite, cases=tuple(cases)))
    return {
        case.name: {run.seed: run.figures for run in case.runs if run.error is None}
        for case in found.cases
    }


def slower(suite: Suite, headways: dict[str, float], folder: Path) -> Suite:
    """The suite with another headway for the drivers of each scenario."""
    cases = []
    for case in suite.cases:
        scenario = read_scenario(case.file)
        drivers = {"headway": round(headways[case.name], 3)}
        changed = validated(type(scenario), {**dict(scenario), "drivers": drivers})
        file = write_scenario(changed, folder / case.file.name)
        cases.append(replace(case, file=file))
    return replace(suite, cases=tuple(cases))


def headway_for(before: Runs, probed: Runs) -> float:
    """Headway with which the mean delay grows by 5 %, if its effect is proportional."""
    old = statistics.fmean(delays({seed: before[seed] for seed in probed}))
    effect = statistics.fmean(delays(probed)) / old - 1
    return HEADWAY + PROBE * min(1.5, max(0.02, CHANGE / effect if effect > 0 else 1.5))


def delays(runs: Runs) -> list[float]:
    return [value for run in runs.values() if (value := run[DELAY]) is not None]


def chosen_of(runs: Runs, seeds: Sequence[int]) -> Runs:
    return {int(seed): runs[int(seed)] for seed in seeds}


def report(pools: dict[str, Pool]) -> None:
    print(f"{'':<20} {'delay':>7} {'scatter':>8} {'seeds':>6}   {'headway':>7} {'delay':>7} "
          f"{'scatter':>8} {'seeds':>6}")  # fmt: skip
    for name, pool in pools.items():
        old, new = paired_delays(pool)
        mean, level = old.mean(), level_of(pool)
        pairs = (new - old).std(ddof=1) / mean
        print(f"{name:<20} {mean:5.1f} s {old.std(ddof=1) / mean:8.1%} "
              f"{seeds_needed(old.tolist(), level=level):6d}   {pool.headway:5.2f} s "
              f"{new.mean() / mean - 1:+7.1%} {pairs:8.1%} {pairs_needed(pairs, level):6d}"
              )  # fmt: skip
    random = np.random.default_rng(18)
    print(f"\n{RERUNS} reruns of each scenario with as many seeds as the baseline")
    print(f"{'seeds':>5} {'false alarms':>13} {'other seeds, +5 %':>18} {'same seeds, +5 %':>17}")
    for size in SIZES:
        print_size(pools, size, random)


def paired_delays(pool: Pool) -> tuple[FloatArray, FloatArray]:
    seeds = sorted(pool.before.keys() & pool.after.keys())
    sides = [[runs[seed][DELAY] for seed in seeds] for runs in (pool.before, pool.after)]
    old, new = (np.array(side, dtype=float) for side in sides)
    return old, new


def level_of(pool: Pool) -> float:
    figures = sum(key.kind == "run" for key in next(iter(pool.before.values())))
    return Level.shared(run=figures, places=1).run


def pairs_needed(share: float, level: float) -> int:
    """Seeds with which 5 % is caught, the same on both sides; differences scatter by a share."""
    count = FEWEST_SEEDS
    while (t.isf(level / 2, count - 1) + t.isf(1 - CAUGHT, count - 1)) * share > CHANGE * (
        math.sqrt(count)
    ):
        count += 1
    return count


def print_size(pools: dict[str, Pool], size: int, random: np.random.Generator) -> None:
    """Shares over all scenarios, then of how many reruns of each."""
    counts = {name: np.zeros(3) for name in pools}
    alarms = all(2 * size <= len(pool.before) for pool in pools.values())
    for name, pool in pools.items():
        old, new = paired_delays(pool)
        shifted = new - (new - old).mean() + CHANGE * old.mean()
        seeds = sorted(pool.before.keys() & pool.after.keys())
        for _ in range(RERUNS):
            rows = random.permutation(len(seeds))
            mine, others = rows[:size], rows[size : 2 * size]
            counts[name][2] += fails(old, shifted, mine, mine, level_of(pool))
            if alarms:
                counts[name][1] += fails(old, old * (1 + CHANGE), mine, others, level_of(pool))
                sides = [chosen_of(pool.before, [seeds[row] for row in part])
                         for part in (mine, others)]  # fmt: skip
                verdict = hold_against(baseline_of(sides[0], {}), sides[1], Tolerances({}))
                counts[name][0] += bool(verdict.failing)
    total = sum(counts.values()) / (RERUNS * len(pools))
    good = sum(found[2] >= CAUGHT * RERUNS for found in counts.values())
    first = f"{total[0]:13.1%} {total[1]:18.1%}" if alarms else f"{'-':>13} {'-':>18}"
    print(f"{size:5d} {first} {total[2]:17.1%}   nine in ten in {good} of {len(pools)} scenarios")
    for name, found in counts.items():
        print(f"      {name:<20}" + "".join(f" {value:4.0f}" for value in found), flush=True)


def fails(old: FloatArray, new: FloatArray, before: IntArray, now: IntArray, level: float) -> bool:
    sides = [{int(row): float(side[row]) for row in rows}
             for side, rows in ((old, before), (new, now))]  # fmt: skip
    allowed = allowed_by_chance(*sides, level=level, both_sides=False) or 0.0
    mean = old[before].mean()
    return bool(
        new[now].mean() - mean > max(allowed, usual(DELAY.entry).times(FLOOR).allowed(mean))
    )


if __name__ == "__main__":
    main()
