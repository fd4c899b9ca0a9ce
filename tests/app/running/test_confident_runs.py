from __future__ import annotations

import math
import statistics
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import t

from odscen.app.running.confident_runs import confidence_of, parse_share, run_until_confident
from odscen.base.errors import InputError, NotFoundError
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from tests.reporters import Listener

DELAYS = (20.0, 22.0, 18.0, 21.0, 19.0)


def test_the_interval_of_a_difference_is_students_and_the_seeds_needed_are_the_fewest() -> None:
    found = confidence_of([*DELAYS, None], share=0.05, lopsided=False)
    scatter = statistics.stdev(DELAYS)
    assert (found.mean, found.seeds) == (20.0, 5)
    assert found.half_width == pytest.approx(2.776 * scatter / math.sqrt(5), rel=1e-3)
    assert not found.enough
    assert found.needed == 13
    for count, enough in ((12, False), (13, True)):
        half = t.ppf(0.975, count - 1) * scatter / math.sqrt(count)
        assert bool(half <= 0.05 * 20.0) == enough
    assert found.words == (
        "mean_delay 20.00 +- 1.96 s with 5 seeds: too few for the interval wanted, +- 5 %, "
        "it takes about 13"
    )
    assert confidence_of(DELAYS, share=0.11).enough
    assert "too few" in confidence_of([3.0], share=0.05).words


@pytest.mark.slow
def test_an_interval_covers_the_mean_of_a_figure_that_a_few_runs_break_down_in() -> None:
    """Delays as near saturation: of 5 seeds Student's covers in 91 % of cases, this one in 95 %."""
    rng = np.random.default_rng(7)
    mean, spread = 40.0, 0.45
    sets = rng.lognormal(math.log(mean) - spread**2 / 2.0, spread, size=(1000, 5)).tolist()
    covered = {
        lopsided: statistics.fmean(
            abs(found.mean - mean) <= found.half_width
            for found in (confidence_of(one, share=0.05, lopsided=lopsided) for one in sets)
        )
        for lopsided in (True, False)
    }
    assert 0.93 <= covered[True] <= 0.97
    assert covered[False] < 0.93


def test_values_of_which_one_is_no_delay_have_students_interval() -> None:
    for values in ([0.0, *DELAYS], [-1.0, *DELAYS], DELAYS[:4], [5.0] * 6):
        own, plain = (confidence_of(values, share=0.05, lopsided=of) for of in (True, False))
        assert own == plain
    narrow = [one / 100.0 + 20.0 for one in DELAYS]
    own, plain = (confidence_of(narrow, share=0.05, lopsided=of) for of in (True, False))
    assert own.half_width == pytest.approx(plain.half_width, rel=0.01)
    assert confidence_of([1.0, 1.0, 2.0, 1e9, 3.0], share=0.05).half_width > 1e9


@pytest.mark.parametrize("text", ["5 %", "5%", "0.05"])
def test_a_share_is_read_as_people_write_it(text: str) -> None:
    assert parse_share(text) == pytest.approx(0.05)


@pytest.mark.parametrize("text", ["", "5", "0 %", "150 %", "5 % of it", "nan"])
def test_what_is_no_share_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="is no share of the mean"):
        parse_share(text)


@pytest.mark.slow
def test_seeds_are_added_until_the_interval_is_narrow_enough_or_there_are_too_many(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    settings = RunSettings(until=90.0, redraw="traffic")
    wanted = {"figure": "mean_speed", "settings": settings, "seeds": (1, 2, 3)}
    listener = Listener()
    runs, wide = run_until_confident(
        workspace, sampled, share=0.9, out=tmp_path / "wide", reporter=listener, **wanted
    )
    assert (len(runs), wide.seeds, wide.enough) == (3, 3, True)
    assert len(listener.words) == 1
    runs, narrow = run_until_confident(
        workspace, sampled, share=0.0001, most=5, out=tmp_path / "narrow", **wanted
    )
    assert [run.summary["seed"] for run in runs] == [1, 2, 3, 4, 5]
    assert not narrow.enough
    assert narrow.needed is None or narrow.needed > 5
    speeds = [run.figure("mean_speed") for run in runs]
    assert narrow.mean == pytest.approx(statistics.fmean(speeds))


def test_a_figure_that_is_none_is_refused_before_anything_runs(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    with pytest.raises(NotFoundError, match="mean_dlay"):
        run_until_confident(workspace, sampled, share=0.05, figure="mean_dlay", out=tmp_path)
    assert list(tmp_path.iterdir()) == []
