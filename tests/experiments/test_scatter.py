import math

import numpy as np
import pytest
from scipy import stats

from odscen.experiments.baseline import Baseline, baseline_of
from odscen.experiments.measure import FigureKey
from odscen.experiments.tolerance import (
    FALSE_ALARMS,
    Level,
    Tolerance,
    Tolerances,
    allowed_by_chance,
    hardly_varying,
    seeds_needed,
)
from odscen.experiments.verdict import hold_against

DELAY = FigureKey("run", "", "mean_delay")
USUAL = Tolerances({})


def by_seed(values, first=1):
    return {first + number: float(value) for number, value in enumerate(values)}


def normal(seed, count, mean=20.0, deviation=3.0):
    return np.random.default_rng(seed).normal(mean, deviation, count)


def runs(values, first=1, key=DELAY):
    return {seed: {key: value} for seed, value in by_seed(values, first).items()}


def test_what_is_allowed_between_other_seeds_is_the_interval_of_a_difference_of_means():
    old, new = by_seed(normal(1, 10)), by_seed(normal(2, 12), first=101)
    allowed = allowed_by_chance(old, new, level=0.02, both_sides=False)
    variances = [np.var(list(side.values()), ddof=1) for side in (old, new)]
    pooled = math.sqrt((9 * variances[0] + 11 * variances[1]) / 20)
    error = pooled * math.sqrt(1 / 10 + 1 / 12)
    assert allowed == pytest.approx(stats.t.ppf(0.99, 20) * error)
    wider = allowed_by_chance(old, new, level=0.02, both_sides=True)
    assert wider == pytest.approx(stats.t.ppf(0.995, 20) * error)


def test_the_same_seeds_are_compared_in_pairs_which_allows_less():
    old = by_seed(normal(1, 10))
    new = {seed: value + 1.0 + 0.01 * seed for seed, value in old.items()}
    pairs = [new[seed] - old[seed] for seed in old]
    allowed = allowed_by_chance(old, new, level=0.02, both_sides=False)
    expected = stats.t.ppf(0.98, 9) * np.std(pairs, ddof=1) / math.sqrt(10)
    assert allowed == pytest.approx(expected)


def test_few_seeds_allow_nothing_by_chance():
    assert allowed_by_chance(by_seed([1, 2]), by_seed([1, 2]), level=0.1, both_sides=True) is None


def test_a_first_long_wait_among_seeds_that_had_none_is_no_alarm():
    wait = FigureKey("run", "", "pedestrian_mean_waiting_time")
    before = baseline_of(runs([0.0] * 10, key=wait), {})
    once = runs([0.0] * 9 + [12.0], first=101, key=wait)
    assert hold_against(before, once, USUAL).failing == ()
    often = runs([4.0, 6.0] * 5, first=101, key=wait)
    assert hold_against(before, often, USUAL).failing


def test_a_count_that_is_another_one_in_every_run_fails():
    planned = FigureKey("run", "", "planned")
    before = baseline_of(runs([45.0] * 10, key=planned), {})
    assert hold_against(before, runs([46.0] * 10, key=planned), USUAL).failing


def test_false_alarms_are_shared_out_evenly_half_for_the_run_and_half_for_places():
    level = Level.shared(run=20, places=100)
    assert 20 * level.run + 100 * level.place == pytest.approx(FALSE_ALARMS)


@pytest.mark.slow
def test_of_a_thousand_reruns_with_other_seeds_at_most_two_in_a_hundred_fail():
    random = np.random.default_rng(18)
    keys = [FigureKey("run", "", f"figure_{number}") for number in range(30)]
    failed = 0
    for _ in range(1000):
        shared = random.normal(20, 2, (20, 1))  # figures of a run go together, as in traffic
        values = shared + random.normal(0, 2, (20, 30))
        sides = [
            {seed: dict(zip(keys, values[row + seed], strict=True)) for seed in range(10)}
            for row in (0, 10)
        ]
        baseline = baseline_of(sides[0], {})
        other = {seed + 100: figures for seed, figures in sides[1].items()}
        failed += bool(hold_against(baseline, other, USUAL).failing)
    assert failed <= 20


def test_a_figure_may_change_by_what_chance_explains_but_by_half_its_own_tolerance_anyhow():
    before = baseline_of(runs(normal(1, 10)), {})
    assert before.by_scatter
    other = runs(normal(2, 10), first=101)
    assert hold_against(before, other, USUAL).failing == ()
    worse = {seed: {DELAY: figures[DELAY] + 15} for seed, figures in other.items()}
    (change,) = hold_against(before, worse, USUAL).failing
    assert change.words.endswith(" s by scatter)")
    steady = baseline_of(runs([20.0] * 10), {})
    assert hold_against(steady, runs([20.2] * 10), USUAL).failing == ()  # half of 0.5 s
    (change,) = hold_against(steady, runs([20.3] * 10), USUAL).failing
    assert change.words.endswith("allowed 1 % or 0.25 s)")


def test_a_tolerance_of_the_suite_goes_before_scatter():
    before = baseline_of(runs(normal(1, 10)), {})
    strict = Tolerances({("run", "mean_delay"): Tolerance(absolute=0.01)})
    assert hold_against(before, runs(normal(1, 10) + 0.02), strict).failing


def test_baselines_of_few_seeds_and_of_before_have_fixed_tolerances():
    assert not baseline_of(runs([20.0, 25.0, 30.0]), {}).by_scatter
    old = Baseline(tuple(range(1, 11)), {}, {DELAY: tuple(normal(1, 10))})
    shifted = runs(normal(1, 10) + 1.0)
    assert hold_against(old, shifted, USUAL).failing


def test_a_figure_that_only_some_seeds_have_does_not_fail_where_none_has_it():
    values = {1: 4.0} | dict.fromkeys(range(2, 11))
    before = baseline_of({seed: {DELAY: value} for seed, value in values.items()}, {})
    none = {seed: {DELAY: None} for seed in range(1, 11)}
    assert hold_against(before, none, USUAL).failing == ()
    before = baseline_of(runs([4.0] * 10), {})
    assert hold_against(before, none, USUAL).failing


def test_the_seeds_that_a_small_change_takes_catch_it_nine_times_in_ten():
    level, scatter = 0.01 / 30, 0.1
    needed = seeds_needed(list(normal(1, 5000, 20.0, 20.0 * scatter)), level=level)
    assert 150 < needed < 250
    caught = 0
    for round_ in range(200):
        old = by_seed(normal(2 * round_, needed, 20.0, 2.0))
        new = by_seed(normal(2 * round_ + 1, needed, 21.0, 2.0), first=10_000)
        allowed = allowed_by_chance(old, new, level=level, both_sides=False)
        caught += np.mean(list(new.values())) - np.mean(list(old.values())) > allowed
    assert 0.84 < caught / 200 < 0.96
    assert seeds_needed([20.0], level=level) is None
    assert seeds_needed([0.0, 0.0], level=level) is None


def test_seeds_that_make_no_difference_are_named():
    assert hardly_varying([107.44, 107.35, 107.31]).startswith("the seeds hardly vary")
    assert hardly_varying([107.0, 120.0]) is None
    assert hardly_varying([107.44, 107.35, None]) is None
