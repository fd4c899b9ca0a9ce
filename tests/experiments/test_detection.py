import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from odscen.base.errors import InputError
from odscen.experiments.baseline import baseline_of
from odscen.experiments.measure import FigureKey
from odscen.experiments.tolerance import (
    ASSURANCE,
    FALSE_ALARMS,
    DetectEntry,
    Tolerances,
    detection_of,
    scatter_of_differences,
    size_of,
)
from odscen.experiments.verdict import hold_against
from odscen.figures.measures.registry import ALL_FIGURES

DELAY = FigureKey("run", "", "mean_delay")
FIGURES = {figure.name: figure for figure in ALL_FIGURES if figure.kind == "run"}
MEAN = 20.0


def detect(change="5 %", **fields):
    return detection_of(DetectEntry(change=change, **fields), FIGURES)


def runs(values, first=1):
    return {first + row: {DELAY: float(value)} for row, value in enumerate(values)}


def caught(watched, before, after):
    baseline = baseline_of(runs(before), {})
    return bool(hold_against(baseline, runs(after), Tolerances({}), detect=watched).failing)


def sized(watched, before, after):
    return size_of(watched, list(zip(before, after, strict=True)))


def share_caught(watched, count, change, scatter, rounds=400):
    """Share of baselines of that many seeds that see a true change, differences being normal."""
    random = np.random.default_rng(7)
    found = 0
    for _ in range(rounds):
        before = random.normal(MEAN, 5.0, count)
        found += caught(watched, before, before + random.normal(change, scatter, count))
    return found / rounds


@pytest.mark.parametrize("scatter", [0.8, 2.0])
@pytest.mark.parametrize("power", [0.8, 0.9])
def test_the_seeds_that_a_known_scatter_takes_catch_the_change_as_often_as_wanted(scatter, power):
    watched = detect(power=power)
    count = watched.seeds_for(scatter, mean=MEAN)
    assert watched.smallest_caught(scatter, count, mean=MEAN) <= 0.05 * MEAN
    assert share_caught(watched, count, 0.05 * MEAN, scatter) == pytest.approx(power, abs=0.06)
    if count > 8:
        assert watched.smallest_caught(scatter, count - 1, mean=MEAN) > 0.05 * MEAN


def test_the_chosen_seeds_catch_the_change_though_the_pilot_only_estimates_the_scatter():
    watched, scatter = detect(), 2.0
    exact = watched.seeds_for(scatter, mean=MEAN)
    random = np.random.default_rng(18)
    chosen = []
    for _ in range(300):
        before = random.normal(MEAN, 5.0, 16)
        after = before + random.normal(0.05 * MEAN, scatter, 16)
        chosen.append(sized(watched, before, after).needed)
    # The mean and the effect of a pilot vary as well, which moves some of the counts.
    assert np.mean(np.array(chosen) >= exact) == pytest.approx(ASSURANCE, abs=0.1)
    assert exact < np.median(chosen) < 2 * exact


@pytest.mark.slow
def test_watching_a_figure_leaves_false_alarms_at_two_in_a_hundred():
    random = np.random.default_rng(3)
    keys = [DELAY, *(FigureKey("run", "", f"figure_{number}") for number in range(29))]
    failed = {"any": 0, "watched": 0}
    for _ in range(1000):
        shared = random.normal(MEAN, 2, (20, 1))
        values = shared + random.normal(0, 2, (20, 30))
        sides = [
            {seed + shift: dict(zip(keys, values[row + seed], strict=True)) for seed in range(10)}
            for row, shift in ((0, 0), (10, 100))
        ]
        baseline = baseline_of(sides[0], {})
        failing = hold_against(baseline, sides[1], Tolerances({}), detect=detect()).failing
        failed["any"] += bool(failing)
        failed["watched"] += DELAY in [change.key for change in failing]
    assert failed["any"] <= FALSE_ALARMS * 1000
    assert failed["watched"] <= 1.6 * FALSE_ALARMS / 4 * 1000


def test_what_is_watched_is_caught_below_what_the_figure_is_allowed_otherwise():
    steady = [5.0] * 8
    slightly = [5.2] * 8
    assert not caught(None, steady, slightly)  # half of 0.5 s
    assert caught(detect("3 %"), steady, slightly)
    assert not caught(detect("9 %"), steady, slightly)


def test_seeds_that_hardly_vary_take_the_fewest():
    sizing = sized(detect(), [20.0] * 8, [21.0] * 8)
    assert (sizing.seeds, sizing.needed, sizing.scatter) == (8, 8, 0.0)
    assert sizing.words == "8 seeds catch a change of mean_delay by 5 % with probability 0.9"


def test_where_the_suite_does_not_allow_the_seeds_it_is_said_what_those_catch():
    before = [15.0, 25.0] * 8
    after = [value + (3.0 if row < 8 else -1.0) for row, value in enumerate(before)]
    sizing = sized(detect(seeds_max=12), before, after)
    assert sizing.seeds == 12 < sizing.needed
    assert sizing.words == (
        "12 seeds, the most that the suite allows, catch a change of mean_delay by "
        f"{sizing.caught} with probability 0.9; 5 % takes {sizing.needed}"
    )
    assert 5.0 < float(sizing.caught.split()[0]) < 40.0
    alone = detect(sizing.caught, seeds_max=12)
    assert alone.seeds_for(sizing.scatter, mean=sizing.mean) <= 12


def test_a_pilot_that_changes_less_than_is_wanted_is_taken_to_scatter_more():
    before = [18.0, 22.0, 19.0, 21.0] * 4
    steps = np.tile([0.1, 0.3], 8)
    pairs = list(zip(before, np.array(before) + steps, strict=True))
    found = scatter_of_differences(pairs, wanted=1.0)
    margin = math.sqrt(15 / stats.chi2.ppf(1 - ASSURANCE, 15))
    assert found == pytest.approx(5 * np.std(steps, ddof=1) * margin)
    assert scatter_of_differences(pairs) == pytest.approx(found / 5)
    same = scatter_of_differences(list(zip(before, before, strict=True)), wanted=1.0)
    assert same == pytest.approx(math.sqrt(2) * np.std(before, ddof=1) * margin)


def test_of_two_kinds_of_change_the_one_that_scatters_more_counts():
    aimed = [(20.0, 21.0), (20.0, 21.2)] * 8
    jolted = [(20.0, 23.0), (20.0, 17.0)] * 8
    alone, both = size_of(detect(), aimed), size_of(detect(), aimed, jolted)
    assert alone.seeds == 8
    assert both.seeds > 40
    assert both.scatter == pytest.approx(scatter_of_differences(jolted), abs=1e-4)
    assert size_of(detect(), jolted, aimed).seeds >= both.seeds


def test_a_baseline_is_good_for_the_change_that_its_seeds_were_chosen_for():
    sizing = sized(detect(), [20.0] * 8, [21.0] * 8)
    assert sizing.is_for(detect())
    assert not sizing.is_for(detect("4 %"))
    assert not sizing.is_for(detect(power=0.95))
    short = sized(detect(seeds_max=10), [15.0, 25.0] * 8, [20.0] * 16)
    assert short.is_for(detect(seeds_max=10))
    assert not short.is_for(detect(seeds_max=20))
    assert not short.is_for(detect(seeds_max=9))


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"figure": "mean_delai"}, "figure: no figure has the name 'mean_delai'"),
        ({"change": "5 apples"}, "change: "),
        ({"change": "0 %"}, "change: '0 %' is no change"),
    ],
)
def test_what_cannot_be_caught_is_refused(fields, words):
    entry = DetectEntry(change="5 %").model_copy(update=fields)
    with pytest.raises(InputError) as error:
        detection_of(entry, FIGURES)
    assert words in str(error.value)


def test_a_change_may_be_given_in_the_unit_of_the_figure():
    assert detect("2 s").size(MEAN) == 2.0
    assert detect("5 % or 2 s").size(100.0) == 5.0
    assert replace(detect(), power=0.5).words == "a change of mean_delay by 5 %"
