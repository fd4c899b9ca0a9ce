"""Programs of lights against those of today, and volumes with closures in force."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest

from odscen.app.signals.signal_evaluation import SignalEvaluation, evaluate_signals
from odscen.app.signals.signal_optimisation import coming_vehicles, time_signals
from odscen.base.errors import InputError
from odscen.figures.measures.comparison import compare_figure
from odscen.maps.store import Workspace
from odscen.scenario.document.scenario_document import MapReference
from odscen.scenario.document.signals_document import JunctionTiming
from odscen.sumo.calibrate.light_timing import with_timings
from odscen.sumo.calibrate.turning_volumes import planned_vehicles
from tests.signal_case import JUNCTION, MAP, crossing, scenario

if TYPE_CHECKING:
    from odscen.scenario.document.scenario_document import Scenario


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    store = Workspace.open(tmp_path_factory.mktemp("workspace"))
    store.add_map(MAP)
    return store


def placed(workspace: Workspace, one: Scenario) -> Scenario:
    sha256 = workspace.map("signal_crossing").info["sha256"]
    return one.model_copy(update={"map": MapReference(name="signal_crossing", sha256=sha256)})


def with_closure(one: Scenario, *, begin: float) -> Scenario:
    fields = one.model_dump(mode="json", exclude_defaults=True)
    shut = {"id": "shut", "kind": "closure", "places": ["r3"], "begin": begin}
    return type(one).model_validate_json(json.dumps({**fields, "measures": [shut]}))


@pytest.mark.slow
def test_a_program_that_starves_a_street_is_found_to_be_worse_and_its_reverse_better(
    workspace: Workspace,
) -> None:
    today = placed(workspace, scenario(None, control=None, vehicles=500.0, walkers=0.0))
    (light,) = time_signals(workspace, today).lights
    greens = (60.0, *(5.0 for _ in light.before.green[1:]))
    starved = with_timings(today, [JunctionTiming(junction=JUNCTION, green=greens)])
    found = evaluate_signals(workspace, starved, seeds=(1, 2, 3))
    assert found.worse
    assert not found.better
    assert found.delay.difference is not None
    assert found.delay.difference > 5.0
    assert found.words.endswith("worse than today.")
    assert found.to_dict()["verdict"] == "worse"
    # The other way round, with the same seeds: the same runs, so the same numbers.
    mended = starved.model_copy(update={"signals": today.signals, "name": "mended"})
    back = evaluate_signals(workspace, mended, today=starved, seeds=(1, 2, 3))
    assert back.better
    assert (back.delay.a, back.delay.b) == (found.delay.b, found.delay.a)
    with pytest.raises(InputError, match="there is nothing to compare"):
        evaluate_signals(workspace, today, seeds=(1,))


def test_one_seed_and_intervals_over_zero_are_no_finding() -> None:
    def evaluation(a: list[float], b: list[float]) -> SignalEvaluation:
        pairs = compare_figure(dict(enumerate(a)), dict(enumerate(b)))
        return SignalEvaluation(tuple(range(len(a))), {"mean_delay": pairs})

    assert "take more seeds" in evaluation([10.0], [20.0]).words
    unclear = evaluation([10.0, 12.0, 11.0], [11.0, 11.0, 12.0])
    assert (unclear.worse, unclear.better) == (False, False)
    assert unclear.words.endswith("no difference that these seeds can tell.")
    # Differences of 2, 1 and 1.5 s: mean 1.5, standard deviation 0.5, t(0.975, 2) = 4.303.
    worse = evaluation([10.0, 12.0, 11.0], [12.0, 13.0, 12.5])
    assert worse.delay.low == pytest.approx(1.5 - 4.302653 * 0.5 / 3**0.5, abs=1e-4)


@pytest.mark.slow
def test_webster_counts_what_is_driven_with_a_closure(workspace: Workspace) -> None:
    one = placed(workspace, scenario(None, vehicles=360.0, walkers=0.0))
    late = coming_vehicles(workspace, with_closure(one, begin=599.0))
    planned = list(planned_vehicles(one, crossing().sumo))
    # Who departs in the last half minute does not pass any more.
    assert 0.9 * len(planned) < len(late) <= len(planned)
    shut = with_closure(one, begin=0.0)
    net = crossing().sumo.net
    targets = {v.turns[0].target for v in planned}
    gone = targets - {v.turns[0].target for v in coming_vehicles(workspace, shut)}
    assert len(gone) == 1
    assert gone < {lane.edge for lane in net.lanes.values()}
    before, after = (time_signals(workspace, each).lights[0] for each in (one, shut))
    assert before.times.green != after.times.green or before.times.cycle != after.times.cycle
