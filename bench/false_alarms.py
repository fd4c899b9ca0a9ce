"""Does the gate fail when nothing has changed, and does it see a change of 5 %?

Every scenario of the shipped suite is run with many seeds that redraw its traffic: as it is, with
drivers who keep a longer headway, chosen so that the mean delay grows by about 5 %, and with steps
of 1 s instead of 0.5 s, a change of another kind. From these runs, baselines and reruns are put
together, fifty times each, in an order of the seeds that is drawn anew every time:

- the seeds of the baseline are chosen as ``detect = "5 %"`` chooses them, from the first seeds and
  both changes; then with fixed numbers of seeds, without ``detect``;
- a false alarm is a rerun of the unchanged scenario with as many seeds that the baseline does not
  have, in which any figure or place fails;
- a change is caught if the mean delay fails. The seeds are those of the baseline, and it differs as
  the changed runs differ from seed to seed, but by 5 % on average; with other seeds it is raised by
  5 %.

``--seeds N`` runs each scenario with N seeds (96). ``--keep FOLDER`` stores what was measured of
each scenario, and reads what is there, so that all this is computed again without runs.
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
import numpy.typing as npt

from odscen.app.scenarios import read_scenario, write_scenario
from odscen.experiments.baseline import baseline_of
from odscen.experiments.gates import PILOT, PROBE, run_suite, with_longer_headway
from odscen.experiments.measure import FigureKey, Measured
from odscen.experiments.suite import Case, Suite, read_suite
from odscen.experiments.tolerance import (
    CAUGHT,
    CHANGE,
    FEWEST_SEEDS,
    FLOOR,
    DetectEntry,
    Level,
    Pairs,
    Tolerances,
    allowed_by_chance,
    detection_of,
    seeds_needed,
    size_of,
    usual,
)
from odscen.experiments.verdict import hold_against
from odscen.maps.store import Workspace
from odscen.sumo.realize.driving import HEADWAY

SUITE = Path(__file__).parents[1] / "suites" / "shipped.toml"
RERUNS = 50
PROBE_SEEDS = 12
"""Seeds from which the effect of a longer headway is estimated."""
STEP = 1.0
"""Seconds of a long step."""
SIZES = (8, 16, 24, 32, 48)
DELAY = FigureKey("run", "", "mean_delay")
DETECT = detection_of(DetectEntry(change=f"{100 * CHANGE:g} %"), {"mean_delay": DELAY.entry})

Runs = dict[int, Measured]
FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Pool:
    """Runs of one scenario by seed: as it is, with a longer headway (s), and with long steps."""

    before: Runs
    after: Runs
    stepped: Runs
    headway: float


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=96)
    parser.add_argument("--keep", type=Path)
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="odscen-bench-") as folder:
        keep = chosen.keep or Path(folder)
        keep.mkdir(exist_ok=True)
        suite = replace(read_suite(SUITE), missing=())
        workspace = Workspace.open(Path(folder) / "workspace")
        pools = {
            case.name: pool_of(workspace, suite, case, keep / f"{case.name}.pickle", chosen.seeds)
            for case in suite.cases
        }
    report(pools)


def pool_of(workspace: Workspace, suite: Suite, case: Case, file: Path, count: int) -> Pool:
    """The runs of a scenario, read if they are kept."""
    if file.is_file():
        found = pickle.loads(file.read_bytes())
        assert isinstance(found, Pool)
        return found
    alone = replace(suite, cases=(case,), maps=tuple(suite.maps))
    seeds = range(1, count + 1)
    before = measured(workspace, alone, seeds)
    probed = measured(workspace, slower(alone, HEADWAY + PROBE, file.parent), seeds[:PROBE_SEEDS])
    headway = headway_for(before, probed)
    after = measured(workspace, slower(alone, headway, file.parent), seeds)
    stepped = measured(workspace, alone, seeds, step_length=STEP)
    pool = Pool(before, after, stepped, headway)
    file.write_bytes(pickle.dumps(pool))
    return pool


def measured(
    workspace: Workspace, suite: Suite, seeds: Sequence[int], *, step_length: float | None = None
) -> Runs:
    """Runs of the one scenario of a suite."""
    case = replace(
        suite.cases[0],
        seeds=tuple(seeds),
        redraw="traffic",
        baseline=None,
        expectations=(),
        step_length=step_length,
    )
    found = run_suite(workspace, replace(suite, cases=(case,)))
    return {run.seed: run.figures for run in found.cases[0].runs if run.error is None}


def slower(suite: Suite, headway: float, folder: Path) -> Suite:
    """The suite with another headway for the drivers of its scenario."""
    case = suite.cases[0]
    changed = with_longer_headway(read_scenario(case.file), headway - HEADWAY)
    file = write_scenario(changed, folder / case.file.name)
    return replace(suite, cases=(replace(case, file=file),))


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
          f"{'scatter':>8}   {'delay':>7} {'scatter':>8}")  # fmt: skip
    for name, pool in pools.items():
        old, new = delays_of(pool, pool.after)
        mean = old.mean()
        before, stepped = delays_of(pool, pool.stepped)
        needed = seeds_needed(old.tolist(), level=level_of(pool))
        print(f"{name:<20} {mean:5.1f} s {old.std(ddof=1) / mean:8.1%} {needed:6d}"
              f"   {pool.headway:5.2f} s {effect(old, new)}   {effect(before, stepped)}"
              )  # fmt: skip
    random = np.random.default_rng(18)
    print(f"\n{RERUNS} baselines of each scenario with the seeds that detect chooses, and reruns")
    print(f"{'':<20} {'seeds':>12} {'false alarms':>13} {'caught: headway':>16} {'steps':>6}")
    rows = [chosen_row(name, pool, random) for name, pool in pools.items()]
    total = np.sum(rows, axis=0) / (RERUNS * len(pools))
    print(f"{'all':<20} {'':>12} {total[0]:13.1%} {total[1]:16.1%} {total[2]:6.1%}")
    print(f"\n{RERUNS} reruns of each scenario with as many seeds as the baseline, chosen by hand")
    print(f"{'seeds':>5} {'false alarms':>13} {'other seeds, +5 %':>18} {'same seeds, +5 %':>17}")
    for size in SIZES:
        print_size(pools, size, random)


def effect(old: FloatArray, new: FloatArray) -> str:
    """How far the mean delay is off, and how far the differences scatter."""
    return f"{new.mean() / old.mean() - 1:+7.1%} {(new - old).std(ddof=1) / old.mean():8.1%}"


def chosen_row(name: str, pool: Pool, random: np.random.Generator) -> tuple[int, int, int]:
    """False alarms, and changes that are caught: by a longer headway, and by long steps."""
    old, new = delays_of(pool, pool.after)
    before, stepped = delays_of(pool, pool.stepped)
    counts, alarms, caught, otherwise = [], 0, 0, 0
    for _ in range(RERUNS):
        rows = random.permutation(len(old))
        steps = rows[rows < len(before)]
        kinds = ((old[rows], new[rows]), (before[steps], stepped[steps]))
        count = chosen_seeds(
            [list(zip(*(side.tolist() for side in kind), strict=True)) for kind in kinds]
        )
        counts.append(count)
        alarms += alarmed(pool, rows, count, random)
        caught += caught_by(old, raised(old, new), rows[:count])
        otherwise += caught_by(before, raised(before, stepped), steps[:count])
    some = f"{statistics.median(counts):.0f} ({min(counts)}-{max(counts)})"
    print(f"{name:<20} {some:>12} {alarms:13d} {caught:16d} {otherwise:6d}", flush=True)
    return alarms, caught, otherwise


def chosen_seeds(pairs: Sequence[Pairs]) -> int:
    """How many seeds a suite with ``detect`` would choose, the first ones being the pilot."""
    detect, count = replace(DETECT, seeds_max=len(pairs[0])), PILOT
    while (found := size_of(detect, *(kind[:count] for kind in pairs))).seeds > count:
        count = min(found.seeds, 2 * count)
    return found.seeds


def alarmed(pool: Pool, rows: IntArray, count: int, random: np.random.Generator) -> bool:
    """Whether other seeds, as many as there are up to ``count``, fail against a baseline."""
    seeds = sorted(pool.before.keys() & pool.after.keys())
    mine = [seeds[row] for row in rows[:count]]
    others = [seed for seed in pool.before if seed not in mine]
    if len(others) < FEWEST_SEEDS:
        raise SystemExit(
            f"{count} of {len(seeds)} seeds are chosen; run the bench with more --seeds"
        )
    rest = random.permutation(others)[:count]
    sides = [chosen_of(pool.before, part) for part in (mine, rest)]
    verdict = hold_against(baseline_of(sides[0], {}), sides[1], Tolerances({}), detect=DETECT)
    return bool(verdict.failing)


def raised(old: FloatArray, new: FloatArray) -> FloatArray:
    """Delays that differ from ``old`` as ``new`` does, but by 5 % on average."""
    return new - (new - old).mean() + CHANGE * old.mean()


def caught_by(old: FloatArray, new: FloatArray, rows: IntArray) -> bool:
    sides: list[Runs] = [{int(row): {DELAY: float(side[row])} for row in rows}
                         for side in (old, new)]  # fmt: skip
    verdict = hold_against(baseline_of(sides[0], {}), sides[1], Tolerances({}), detect=DETECT)
    return bool(verdict.failing)


def delays_of(pool: Pool, changed: Runs) -> tuple[FloatArray, FloatArray]:
    """Mean delays of the seeds that both have."""
    seeds = sorted(pool.before.keys() & changed.keys())
    sides = [[runs[seed][DELAY] for seed in seeds] for runs in (pool.before, changed)]
    old, new = (np.array(side, dtype=float) for side in sides)
    return old, new


def level_of(pool: Pool) -> float:
    figures = sum(key.kind == "run" for key in next(iter(pool.before.values())))
    return Level.shared(run=figures, places=1).run


def print_size(pools: dict[str, Pool], size: int, random: np.random.Generator) -> None:
    """Shares over all scenarios, then of how many reruns of each."""
    counts = {name: np.zeros(3) for name in pools}
    alarms = all(2 * size <= len(pool.before) for pool in pools.values())
    for name, pool in pools.items():
        old, new = delays_of(pool, pool.after)
        shifted = raised(old, new)
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
