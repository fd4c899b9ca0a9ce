"""Does the gate fail when nothing has changed, and does it see a change of 5 %?

Every scenario of the shipped suite is run with many seeds that redraw its traffic, as it is and
with drivers who keep a longer headway, chosen so that the mean delay grows by about 5 %. From
these runs, baselines and reruns of several sizes are put together, fifty times each:

- a false alarm is a rerun of the unchanged scenario with seeds that the baseline does not have, in
  which any figure or place fails;
- a change is caught, with the seeds of the baseline, if a rerun with the longer headway fails, and,
  with other seeds, if one whose mean delay is 5 % up does in its mean delay.

``--seeds N`` runs each scenario with N seeds (64), ``--keep FILE`` stores what was measured, or
reads it if the file is there.
"""

from __future__ import annotations

import argparse
import pickle
import statistics
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from odscen.app.scenarios import read_scenario, write_scenario
from odscen.regression.baseline import baseline_of
from odscen.regression.gates import run_suite
from odscen.regression.measure import FigureKey, Measured
from odscen.regression.scatter import CHANGE, FEWEST_SEEDS, Level, seeds_needed
from odscen.regression.suite import Suite, read_suite
from odscen.regression.tolerance import Tolerances
from odscen.regression.verdict import BaselineVerdict, hold_against
from odscen.scenario.document.validation import validated
from odscen.sumo.realize.driving import HEADWAY
from odscen.workspace.store import Workspace

SUITE = Path(__file__).parents[1] / "suites" / "shipped.toml"
RERUNS = 50
PROBE_SEEDS, PROBE = 12, 1.0
"""Seeds, and seconds more of headway, from which its effect is estimated."""
SIZES = (8, 10, 16, 24, 32)
DELAY = FigureKey("run", "", "mean_delay")

Runs = dict[int, Measured]


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


def verdict(before: Runs, now: Runs) -> BaselineVerdict:
    return hold_against(baseline_of(before, {}), now, Tolerances({}))


def chosen_of(runs: Runs, seeds: Sequence[int]) -> Runs:
    return {int(seed): runs[int(seed)] for seed in seeds}


def with_more_delay(runs: Runs) -> Runs:
    factor = 1 + CHANGE
    return {
        seed: run | {DELAY: None if run[DELAY] is None else run[DELAY] * factor}  # type: ignore[operator]
        for seed, run in runs.items()
    }


def report(pools: dict[str, Pool]) -> None:
    random = np.random.default_rng(18)
    print(f"{'scenario':<20} {'delay, s':>8} {'scatter':>8} {'headway':>8} {'delay':>8}"
          f" {'seeds needed':>13}")  # fmt: skip
    for name, pool in pools.items():
        one, other = delays(pool.before), delays(pool.after)
        mean = statistics.fmean(one)
        needed = seeds_needed(one, level=Level.shared(run=len_of_run(pool), places=1).run)
        print(f"{name:<20} {mean:8.1f} {statistics.stdev(one) / mean:8.1%} {pool.headway:8.2f} "
              f"{statistics.fmean(other) / mean - 1:+8.1%} {needed or 0:13d}")  # fmt: skip
    print(f"\n{RERUNS} reruns of each scenario; share that fails")
    print(f"{'seeds':>5} {'other seeds':>12} {'longer headway':>15} {'in its delay':>13}"
          f" {'other seeds, delay +5 %':>24}")  # fmt: skip
    for size in SIZES:
        if 2 * size <= min(len(pool.before) for pool in pools.values()) and size >= FEWEST_SEEDS:
            print_size(pools, size, random)


def len_of_run(pool: Pool) -> int:
    return sum(key.kind == "run" for key in next(iter(pool.before.values())))


def print_size(pools: dict[str, Pool], size: int, random: np.random.Generator) -> None:
    counts = {name: np.zeros(4) for name in pools}
    for name, pool in pools.items():
        seeds = sorted(pool.before.keys() & pool.after.keys())
        for _ in range(RERUNS):
            drawn = random.permutation(seeds)[: 2 * size]
            before, other = (
                chosen_of(pool.before, drawn[:size]),
                chosen_of(pool.before, drawn[size:]),
            )
            same = verdict(before, chosen_of(pool.after, drawn[:size])).failing
            counts[name] += (
                bool(verdict(before, other).failing),
                bool(same),
                DELAY in {change.key for change in same},
                DELAY in {c.key for c in verdict(before, with_more_delay(other)).failing},
            )
    total = sum(counts.values()) / (RERUNS * len(pools))
    print(f"{size:5d} {total[0]:12.1%} {total[1]:15.1%} {total[2]:13.1%} {total[3]:24.1%}")
    for name, found in counts.items():
        print(f"      {name:<20} {found[0]:4.0f} {found[1]:4.0f} {found[2]:4.0f} {found[3]:4.0f}")


if __name__ == "__main__":
    main()
