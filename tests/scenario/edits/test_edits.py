import pytest

from odscen.base.categories import Category
from odscen.base.errors import NotFoundError, ScenarioError
from odscen.lanegraph.graphs import MapGraph
from odscen.scenario import edits
from odscen.scenario.document.scenario_document import Scenario
from odscen.scenario.document.signals_document import JunctionTiming
from odscen.scenario.signals.light import Light
from tests.graphs import fork, line_of_segments

GRAPH = fork()
WHOLE = ("r1", "j9", "r2", "r3")


def scenario(graph: MapGraph = GRAPH, roi: tuple[str, ...] = WHOLE) -> Scenario:
    return edits.new_scenario(graph, name="test", roi=roi)


def with_car() -> Scenario:
    return edits.add_actor(scenario(), GRAPH, category="car", spawn="1.0.-1.10")


def test_an_edit_leaves_the_old_document_as_it_was() -> None:
    old = scenario()
    new = edits.add_actor(old, GRAPH, category=Category.BUS, spawn="1.0.-1.10", speed=8.0)
    assert old.actors == ()
    assert [(a.id, a.category, a.speed) for a in new.actors] == [("bus-1", Category.BUS, 8.0)]


def test_a_region_grows_only_by_neighbours() -> None:
    one = edits.new_scenario(GRAPH, name="test")
    assert edits.eligible_segments(one, GRAPH) == GRAPH.segments.ids
    one = edits.grow_roi(one, GRAPH, "r1")
    assert edits.eligible_segments(one, GRAPH) == ("j9",)
    with pytest.raises(ScenarioError, match="does not touch"):
        edits.grow_roi(one, GRAPH, "r2")
    with pytest.raises(ScenarioError, match="already"):
        edits.grow_roi(one, GRAPH, "r1")
    two = edits.grow_roi(one, GRAPH, "j9")
    assert edits.eligible_segments(two, GRAPH) == ("r2", "r3")


def test_a_region_is_extended_by_many_segments_in_any_order_but_stays_in_one_piece() -> None:
    one = scenario(roi=("r1",))
    assert edits.extend_roi(one, GRAPH, ["r3", "r1", "j9"]).roi == ("r1", "r3", "j9")
    assert edits.extend_roi(scenario(roi=()), GRAPH, ["r2", "j9"]).roi == ("r2", "j9")
    with pytest.raises(ScenarioError, match="several pieces"):
        edits.extend_roi(one, GRAPH, ["r3"])
    with pytest.raises(ScenarioError, match="already"):
        edits.extend_roi(one, GRAPH, ["r1"])
    with pytest.raises(NotFoundError, match="no segment named 'r77'"):
        edits.extend_roi(one, GRAPH, ["r77"])


def test_removing_a_segment_that_splits_the_region_is_refused() -> None:
    with pytest.raises(ScenarioError, match="several pieces"):
        edits.shrink_roi(scenario(), GRAPH, "j9")
    assert edits.shrink_roi(scenario(), GRAPH, "r3").roi == ("r1", "j9", "r2")


def test_the_last_segment_can_be_removed() -> None:
    assert edits.shrink_roi(scenario(roi=("r1",)), GRAPH, "r1").roi == ()


def test_a_new_scenario_in_two_pieces_is_refused() -> None:
    with pytest.raises(ScenarioError, match="several pieces"):
        scenario(line_of_segments(), ("r1", "r3"))
    with pytest.raises(ScenarioError, match="no segment 'r77'"):
        scenario(roi=("r77",))


def test_removing_a_segment_in_use_is_refused_unless_asked_for() -> None:
    old = edits.set_goal(with_car(), GRAPH, "car-1", goal="3.0.-1.29")
    with pytest.raises(ScenarioError, match="'car-1'"):
        edits.shrink_roi(old, GRAPH, "r3")
    new = edits.shrink_roi(old, GRAPH, "r3", with_actors=True)
    assert new.actors[0].goal is None
    assert edits.shrink_roi(scenario_on_r3(), GRAPH, "r3", with_actors=True).actors == ()


def scenario_on_r3() -> Scenario:
    return edits.add_actor(scenario(), GRAPH, category="car", spawn="3.0.-1.5")


@pytest.mark.parametrize(
    ("category", "spawn", "reason"),
    [
        ("car", "7.0.-1.0", "does not have"),
        ("car", "1.0.-1.10", "same node"),
        ("car", "ped.1.0.-2.3", "pedestrian node"),
        ("pedestrian", "1.0.-1.3", "node of a lane"),
        ("rocket", "1.0.-1.3", "category"),
    ],
)
def test_a_spawn_that_can_never_be_right_is_refused(category: str, spawn: str, reason: str) -> None:
    with pytest.raises(ScenarioError, match=reason):
        edits.add_actor(with_car(), GRAPH, category=category, spawn=spawn)


def test_a_spawn_outside_the_region_is_refused() -> None:
    with pytest.raises(ScenarioError, match="outside the region"):
        edits.add_actor(scenario(roi=("r1",)), GRAPH, category="car", spawn="2.0.-1.0")


def test_an_id_is_taken_by_actors_and_flows_alike() -> None:
    with_flow = edits.add_flow(with_car(), GRAPH, id="x", spawn="1.0.1.0", per_hour=100)
    with pytest.raises(ScenarioError, match="taken"):
        edits.add_actor(with_flow, GRAPH, category="car", spawn="1.0.-1.20", id="x")


def test_a_goal_must_be_reachable() -> None:
    with pytest.raises(ScenarioError, match="cannot get"):
        edits.set_goal(with_car(), GRAPH, "car-1", goal="1.0.1.49")
    with pytest.raises(NotFoundError, match="car-1"):
        edits.set_goal(with_car(), GRAPH, "car-7", goal=None)


def test_moving_keeps_the_goal_only_where_it_can_be_reached() -> None:
    car = edits.set_goal(with_car(), GRAPH, "car-1", goal="2.0.-1.29")
    assert edits.move_actor(car, GRAPH, "car-1", spawn="1.0.-1.20").actors[0].goal == "2.0.-1.29"
    assert edits.move_actor(car, GRAPH, "car-1", spawn="3.0.-1.5").actors[0].goal is None


def test_moving_keeps_the_places_on_the_way_only_where_they_can_be_reached() -> None:
    car = edits.change_actor(with_car(), "car-1", via=("1.0.-1.15", "2.0.-1.3"))
    before = edits.move_actor(car, GRAPH, "car-1", spawn="1.0.-1.5").actors[0]
    assert before.via == ("1.0.-1.15", "2.0.-1.3")
    assert edits.move_actor(car, GRAPH, "car-1", spawn="1.0.-1.20").actors[0].via == ()


def test_a_goal_must_be_reachable_from_the_last_place_on_the_way() -> None:
    car = edits.change_actor(with_car(), "car-1", via=("2.0.-1.3",))
    assert edits.set_goal(car, GRAPH, "car-1", goal="2.0.-1.29").actors[0].goal == "2.0.-1.29"
    with pytest.raises(ScenarioError, match=r"from '2.0.-1.3' to '3.0.-1.29'"):
        edits.set_goal(car, GRAPH, "car-1", goal="3.0.-1.29")


def test_removing_a_segment_removes_the_places_on_the_way_in_it() -> None:
    car = edits.change_actor(with_car(), "car-1", via=("1.0.-1.15", "2.0.-1.3"))
    with pytest.raises(ScenarioError, match="'car-1'"):
        edits.shrink_roi(car, GRAPH, "r2")
    new = edits.shrink_roi(car, GRAPH, "r2", with_actors=True)
    assert new.actors[0].via == ("1.0.-1.15",)


def test_fields_change_and_a_new_category_drops_the_model() -> None:
    car = edits.change_actor(with_car(), "car-1", model="vehicle.x", style="sporty")
    assert (car.actors[0].model, car.actors[0].style) == ("vehicle.x", "sporty")
    assert edits.change_actor(car, "car-1", category=Category.VAN).actors[0].model is None
    with pytest.raises(ScenarioError, match="add a new one"):
        edits.change_actor(car, "car-1", category=Category.PEDESTRIAN)
    with pytest.raises(ScenarioError, match="move_actor"):
        edits.change_actor(car, "car-1", spawn="1.0.-1.0")
    with pytest.raises(ScenarioError, match="speed"):
        edits.change_actor(car, "car-1", speed=-3.0)
    with pytest.raises(ScenarioError, match="wings"):
        edits.change_actor(car, "car-1", wings=2)


def test_there_is_one_ego_and_it_is_a_vehicle() -> None:
    both = edits.add_actor(with_car(), GRAPH, category="car", spawn="1.0.-1.20", ego=True)
    assert [a.ego for a in both.actors] == [False, True]
    assert [a.ego for a in edits.set_ego(both, "car-1").actors] == [True, False]
    assert [a.ego for a in edits.set_ego(both, None).actors] == [False, False]
    walker = edits.add_actor(both, GRAPH, category="pedestrian", spawn="ped.1.0.-2.3")
    with pytest.raises(ScenarioError, match="pedestrian"):
        edits.set_ego(walker, "pedestrian-1")


def test_copies_get_new_ids_and_are_not_the_ego() -> None:
    ego = edits.set_ego(edits.change_actor(with_car(), "car-1", speed=9.0), "car-1")
    copies = edits.copy_actors(ego, GRAPH, {"1.0.-1.20": "car-1", "2.0.-1.3": "car-1"})
    assert [(a.id, a.speed, a.ego) for a in copies.actors] == [
        ("car-1", 9.0, True),
        ("car-2", 9.0, False),
        ("car-3", 9.0, False),
    ]
    assert [a.id for a in edits.remove_actors(copies, ["car-1", "car-3"]).actors] == ["car-2"]


def test_flows_are_added_changed_and_removed() -> None:
    one = edits.add_flow(scenario(), GRAPH, spawn="1.0.-1.0", per_hour=600)
    assert one.flows[0].id == "flow-1"
    two = edits.change_flow(one, GRAPH, "flow-1", per_hour=300, goal="2.0.-1.29")
    assert (two.flows[0].per_hour, two.flows[0].goal) == (300.0, "2.0.-1.29")
    with pytest.raises(ScenarioError, match="pedestrian"):
        edits.change_flow(two, GRAPH, "flow-1", mix={"pedestrian": 1})
    assert edits.remove_flow(two, "flow-1").flows == ()


def test_a_new_preset_drops_the_old_parameters() -> None:
    foggy = edits.set_environment(scenario(), preset="FogNoon", parameters={"wetness": 50})
    assert foggy.environment.parameters == {"wetness": 50.0}
    clear = edits.set_environment(foggy, preset="ClearNoon")
    assert (clear.environment.preset, clear.environment.parameters) == ("ClearNoon", {})
    assert edits.set_environment(foggy, affects_driving=False).environment.parameters != {}


def test_name_seed_and_simulation_change() -> None:
    new = edits.rename(scenario(), name="other", description="why")
    new = edits.set_simulation(edits.set_seed(new, seed=7), duration=60)
    assert (new.name, new.description, new.seed, new.simulation.duration) == ("other", "why", 7, 60)
    with pytest.raises(ScenarioError, match="duration"):
        edits.set_simulation(new, duration=0)


LIGHTS = (Light(("5", "6"), (20.0, 7.0)), Light(("X0",), (30.0, 7.0)))


def test_lights_are_timed_one_by_one_and_given_back() -> None:
    one = edits.set_timing(scenario(), LIGHTS, "5", green=[25, 8])
    two = edits.set_timing(one, LIGHTS, "X0", control="actuated")
    three = edits.set_timing(two, LIGHTS, "6", offset=12)  # the same light as 5
    assert three.signals.junctions == (
        JunctionTiming(junction="5", green=(25.0, 8.0), offset=12.0),
        JunctionTiming(junction="X0", control="actuated"),
    )
    assert edits.clear_timing(three, "5").signals.junctions == two.signals.junctions[1:]
    assert scenario().signals == edits.clear_timing(one, "5").signals
    with pytest.raises(NotFoundError, match="'6'"):
        edits.clear_timing(three, "6")


@pytest.mark.parametrize(
    ("junction", "fields", "reason"),
    [
        ("7", {}, "no traffic light"),
        ("5", {"green": [20]}, "2 stages"),
        ("5", {"green": [20, 1]}, "too short"),
        ("5", {"control": "by hand"}, "control"),
        ("5", {"yellow": 1}, "yellow"),
    ],
)
def test_timing_that_can_never_be_right_is_refused(
    junction: str, fields: dict[str, object], reason: str
) -> None:
    with pytest.raises(ScenarioError, match=reason):
        edits.set_timing(scenario(), LIGHTS, junction, **fields)


def test_all_lights_are_actuated_at_once() -> None:
    new = edits.set_signal_control(scenario(), control="actuated")
    assert new.signals.control == "actuated"
    assert edits.set_signal_control(new, control=None) == scenario()
