from __future__ import annotations

import json
from collections.abc import Callable

import pytest

from odscen.app.demand.sized_demand import MARGIN, SEEDS, largest_share, proposed_background, sized
from odscen.app.maps import load_map
from odscen.app.running.runs import run
from odscen.base.errors import InputError, NotFoundError
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from odscen.scenario import edits
from odscen.scenario.document.scenario_document import Scenario
from tests.app.conftest import CROSSING


@pytest.fixture(scope="module")
def crowded(workspace: Workspace) -> Scenario:
    """Ten minutes with far more background traffic than a crossing with signals carries."""
    graph = load_map(workspace.map(CROSSING)).sumo.graph
    one = edits.new_scenario(graph, name="crowded", roi=graph.segments.ids, seed=3)
    one = edits.set_simulation(one, duration=600)
    return edits.set_background(one, graph, background="all", trips=1500, end=480)


def limited(most: float, tried: list[float]) -> Callable[[float], bool]:
    def usable(share: float) -> bool:
        tried.append(share)
        return share <= most

    return usable


@pytest.mark.parametrize("most", [0.9, 0.5, 0.33, 0.1])
def test_the_share_found_is_usable_and_within_a_tenth_of_the_largest(most: float) -> None:
    tried: list[float] = []
    found = largest_share(limited(most, tried))
    assert found is not None
    assert 0.88 * most < found <= most
    assert len(set(tried)) == len(tried) <= 10


def test_what_fits_is_tried_once_and_what_never_fits_ends() -> None:
    tried: list[float] = []
    assert largest_share(limited(1.0, tried)) == 1.0
    assert tried == [1.0]
    assert largest_share(limited(0.0, tried)) is None


@pytest.mark.slow
def test_too_much_demand_becomes_what_is_usable_with_a_margin_and_the_same_each_time(
    workspace: Workspace, crowded: Scenario
) -> None:
    said: list[str] = []
    less, sizing = sized(workspace, crowded, tell=said.append)
    assert 0.02 <= sizing.share < 1.0
    assert less.demand.background[0].trips == pytest.approx(1500 * sizing.share)
    assert [one.words for one in sizing.trials] == said
    assert not sizing.trials[0].usable
    kept = [one for one in sizing.trials if one.share == sizing.share]
    assert [(one.seed, one.usable) for one in kept] == [(3 + n, True) for n in range(SEEDS)]
    assert kept[0].vehicles == pytest.approx(MARGIN * 1500 * sizing.share, rel=0.02)
    assert f"{sizing.trips:,.0f} trips" in sizing.words
    assert "is too much" in sizing.words
    assert json.loads(json.dumps(sizing.to_dict()))["trials"][0]["usable"] is False
    assert sized(workspace, crowded) == (less, sizing)
    done = run(workspace, less, settings=RunSettings())
    assert done.usability["level"] == "usable"


@pytest.mark.slow
def test_demand_that_fits_stays_as_it_is(workspace: Workspace, crowded: Scenario) -> None:
    graph = load_map(workspace.map(CROSSING)).sumo.graph
    few = edits.set_background(crowded, graph, background="all", trips=40)
    same, sizing = sized(workspace, few)
    assert same is few
    assert (sizing.share, len(sizing.trials)) == (1.0, SEEDS)


@pytest.mark.slow
def test_the_junctions_propose_the_background_of_an_hour(
    workspace: Workspace, crowded: Scenario
) -> None:
    hour = proposed_background(workspace, edits.set_simulation(crowded, duration=3600))
    assert 1000 < hour < 10_000  # a half of the trips does not pass the signals
    ten = proposed_background(workspace, crowded)
    assert ten == pytest.approx(hour / 6, rel=0.01)


def test_nothing_to_size_is_refused_by_name(workspace: Workspace, crowded: Scenario) -> None:
    graph = load_map(workspace.map(CROSSING)).sumo.graph
    empty = edits.remove_demand(crowded, graph, part="all")
    with pytest.raises(InputError, match="no matrices and no background traffic"):
        sized(workspace, empty)
    with pytest.raises(NotFoundError, match="named 'others'; known are all"):
        sized(workspace, crowded, only="others")
