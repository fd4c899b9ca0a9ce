import numpy as np
import pytest

from odscen.base.errors import ScenarioError
from odscen.lanegraph.query import node_index, walk_node_index
from odscen.scenario import edits
from odscen.scenario.document.distributions import stream
from odscen.scenario.document.scenario_document import Scenario
from odscen.scenario.sampling.actor_goals import flow_goals, resolve_goals, with_goals
from tests.graphs import fork, ring

GRAPH = fork()
ENDS = {"2.0.-1.29", "3.0.-1.29"}


def scenario(*spawns: str, seed: int = 0) -> Scenario:
    one = edits.new_scenario(GRAPH, name="test", roi=("r1", "j9", "r2", "r3"), seed=seed)
    for spawn in spawns:
        one = edits.add_actor(one, GRAPH, category="car", spawn=spawn, id="at-" + spawn)
    return one


SPAWNS = [f"1.0.-1.{k}" for k in range(0, 48, 4)]


def test_an_open_goal_is_drawn_from_the_candidates() -> None:
    ends = {node_index(GRAPH, name) for name in ENDS}
    drawn = set(resolve_goals(scenario(*SPAWNS), GRAPH).values())
    assert drawn == ends


def test_a_goal_does_not_depend_on_other_actors_or_their_order() -> None:
    goals = resolve_goals(scenario(*SPAWNS), GRAPH)
    assert resolve_goals(scenario(*reversed(SPAWNS)), GRAPH) == goals
    alone = resolve_goals(scenario(SPAWNS[3]), GRAPH)
    assert alone == {"at-" + SPAWNS[3]: goals["at-" + SPAWNS[3]]}


def test_the_seed_decides() -> None:
    runs = [tuple(resolve_goals(scenario(*SPAWNS, seed=s), GRAPH).values()) for s in (1, 2, 1)]
    assert runs[0] == runs[2]
    assert runs[0] != runs[1]


def test_a_given_goal_is_kept_and_a_pedestrian_walks() -> None:
    one = edits.set_goal(scenario("1.0.-1.4"), GRAPH, "at-1.0.-1.4", goal="2.0.-1.29")
    one = edits.add_actor(one, GRAPH, category="pedestrian", spawn="ped.1.0.-2.20", id="w")
    goals = resolve_goals(one, GRAPH)
    assert goals["at-1.0.-1.4"] == node_index(GRAPH, "2.0.-1.29")
    walks = {walk_node_index(GRAPH, name) for name in ("ped.1.0.-2.0", "ped.2.0.-2.29")}
    assert goals["w"] in walks


def test_goals_can_be_written_into_the_document() -> None:
    fixed = with_goals(scenario(*SPAWNS), GRAPH)
    assert {actor.goal for actor in fixed.actors} == ENDS
    assert resolve_goals(fixed, GRAPH) == resolve_goals(scenario(*SPAWNS), GRAPH)


def test_a_spawn_without_a_goal_is_named() -> None:
    with pytest.raises(ScenarioError, match=r"at-1\.0\.1\.49"):
        resolve_goals(scenario("1.0.-1.3", "1.0.1.49"), GRAPH)


def test_a_ring_has_the_farthest_node_as_goal() -> None:
    graph = ring()
    one = edits.new_scenario(graph, name="ring", roi=("r1",))
    one = edits.add_actor(one, graph, category="car", spawn="1.0.-1.10")
    assert resolve_goals(one, graph) == {"car-1": 9}


def test_a_flow_has_all_candidates_or_the_goal_given() -> None:
    one = edits.add_flow(scenario(), GRAPH, spawn="1.0.-1.0", per_hour=100)
    both = flow_goals(one, GRAPH)["flow-1"]
    assert both.tolist() == sorted(node_index(GRAPH, name) for name in ENDS)
    given = edits.change_flow(one, GRAPH, "flow-1", goal="3.0.-1.29")
    assert flow_goals(given, GRAPH)["flow-1"].tolist() == [node_index(GRAPH, "3.0.-1.29")]


def test_random_streams_differ_by_their_names() -> None:
    draws = {tuple(stream(1, *names).integers(1000, size=4)) for names in ("a", "b", ("a", "b"))}
    assert len(draws) == 3
    assert np.array_equal(stream(5, "x").random(3), stream(5, "x").random(3))


def test_whom_the_story_drives_without_a_goal_follows_its_lane_straight_on() -> None:
    actors = tuple(
        actor.model_copy(update={"driver": "story"}) for actor in scenario(*SPAWNS).actors
    )
    for seed in range(3):
        one = scenario(*SPAWNS, seed=seed).model_copy(update={"actors": actors})
        assert set(resolve_goals(one, GRAPH).values()) == {node_index(GRAPH, "2.0.-1.29")}
