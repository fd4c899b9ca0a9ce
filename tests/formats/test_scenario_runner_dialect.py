"""1.0 as ScenarioRunner reads it: what its parser demands and refuses, rule by rule.

The parser itself is not run here: the package ``carla-scenario-runner`` 0.9.11 has its folders
where it does not import them from, and a CARLA server is wanted. Each rule names where it stands:
``config`` is ``srunner/scenarioconfigs/openscenario_configuration.py``, ``parser``
``srunner/tools/openscenario_parser.py``, ``scenario`` ``srunner/scenarios/open_scenario.py`` and
``atomics`` ``srunner/scenariomanager/scenarioatomics`` of
github.com/carla-simulator/scenario_runner, in the versions up to 2024.
"""

from __future__ import annotations

import json
import re
from datetime import datetime
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from lxml import etree

from odscen.app.exchange.exports import export, export_run
from odscen.app.template_scenarios import template_scenario
from odscen.formats.openscenario.xosc_actions import UNSAID_GOAL
from tests.formats.test_openscenario_as_run import scenario as scenario_that_ran
from tests.formats.test_openscenario_export import scenario as with_every_rule
from tests.sumo.story_case import entry, run, workspace

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from lxml.etree import _Element

    from odscen.scenario.document.scenario_document import Scenario

TEMPLATES = {
    "cut-in": "motorway_weave",
    "lead-brakes": "motorway_weave",
    "bus-leaves": "motorway_weave",
    "hidden-child": "signal_crossing",
    "mid-block": "signal_crossing",
    "red-light": "signal_crossing",
    "oncoming": "rural_hills",
}


def only_version_1_0(root: _Element) -> bool:
    """config, _check_version: any other is an AttributeError."""
    header = root.find("FileHeader")
    return header is not None and (header.get("revMajor"), header.get("revMinor")) == ("1", "0")


def one_story_and_an_init(root: _Element) -> bool:
    """config, __init__: ``storyboard.find("Story")`` takes the first, and ``Init`` has to be."""
    board = root.find("Storyboard")
    return board is not None and len(board.findall("Story")) == 1 and board.find("Init") is not None


def frame_is_not_said_to_be_carlas(root: _Element) -> bool:
    """config, _set_scenario_name: a description with ``CARLA:`` means the left-handed frame."""
    header = root.find("FileHeader")
    name = "" if header is None else header.get("description", "")
    return bool(name) and not name.startswith("CARLA:")


def catalog_locations_are_there(root: _Element) -> bool:
    """config, _load_catalogs: ``list(catalogs)`` of a missing element is a TypeError."""
    return root.find("CatalogLocations") is not None


def entities_have_properties(root: _Element) -> bool:
    """config, _extract_vehicle_information: the ego is the one whose property says so."""
    things = root.findall("Entities/ScenarioObject/*")
    kinds = [one.find('Properties/Property[@name="type"]') for one in things]
    return all(one is not None for one in kinds)


def pedestrians_have_a_model(root: _Element) -> bool:
    """config, _extract_pedestrian_information."""
    return all(one.get("model") for one in root.iter("Pedestrian"))


def init_places_each_actor_with_its_only_position(root: _Element) -> bool:
    """config, _get_actor_transform: the last Position in a Private wins, none is (0, 0, 0)."""
    privates = {one.get("entityRef"): one for one in root.iterfind("Storyboard/Init//Private")}
    names = [one.get("name") for one in root.iterfind("Entities/ScenarioObject")]
    return all(
        name in privates
        and [one.getparent().tag for one in privates[name].iter("Position")] == ["TeleportAction"]
        for name in names
    )


def lane_positions_have_numbers(root: _Element) -> bool:
    """parser, convert_position_to_transform: ``int(roadId)``, and CARLA must have the lane."""
    return not list(root.iter("LanePosition", "RoutePosition"))


def global_actions_are_environments(root: _Element) -> bool:
    """parser, convert_maneuver_to_atomic: others are refused, or need CARLA's names."""
    return all(one.find("EnvironmentAction") is not None for one in root.iter("GlobalAction"))


def signals_are_not_named_by_id(root: _Element) -> bool:
    """parser, get_traffic_light_from_osc_name: names begin with ``id=`` of CARLA or ``pos=``."""
    return not list(root.iter("TrafficSignalCondition", "TrafficSignalStateAction"))


def time_of_day_has_no_zone(root: _Element) -> bool:
    """parser, get_weather_from_env_action: ``strptime`` with seconds and nothing behind."""
    times = [one.get("dateTime", "") for one in root.iter("TimeOfDay")]
    return all(datetime.strptime(one, "%Y-%m-%dT%H:%M:%S") for one in times)


def weather_has_sun_fog_and_rain(root: _Element) -> bool:
    """parser, get_weather_from_env_action: reads attributes of all three; intensities of 1.0."""
    weathers = list(root.iter("Weather"))
    return all(
        all(one.find(tag) is not None for tag in ("Sun", "Fog", "Precipitation"))
        and one.find("Sun").get("intensity") is not None
        and one.find("Precipitation").get("intensity") is not None
        for one in weathers
    )  # fmt: skip


def conditions_say_freespace_and_route(root: _Element) -> bool:
    """parser, convert_condition_to_atomic: ``strtobool(False)`` of a missing one raises."""
    timed = list(root.iter("TimeHeadwayCondition", "TimeToCollisionCondition", "DistanceCondition"))
    return all(one.get("freespace") and one.get("alongRoute") for one in timed)


def distances_to_places_are_not_between_bodies(root: _Element) -> bool:
    """parser: freespace of a DistanceCondition is a NotImplementedError."""
    return all(one.get("freespace") == "false" for one in root.iter("DistanceCondition"))


def rules_are_those_of_1_0(root: _Element) -> bool:
    """parser, operators; timer.py, SimulationTimeCondition."""
    known = {"greaterThan", "lessThan", "equalTo"}
    return all(one.get("rule") in known for one in root.iterfind(".//EntityCondition/*[@rule]"))


def states_are_starts_or_ends(root: _Element) -> bool:
    """parser: other states than these are a NotImplementedError."""
    known = {"startTransition", "stopTransition", "endTransition", "completeState"}
    return all(one.get("state") in known for one in root.iter("StoryboardElementStateCondition"))


def conditions_are_known(root: _Element) -> bool:
    """parser, convert_condition_to_atomic: others are an AttributeError or do nothing."""
    known = {
        "EndOfRoadCondition", "CollisionCondition", "OffroadCondition", "TimeHeadwayCondition",
        "TimeToCollisionCondition", "AccelerationCondition", "StandStillCondition",
        "SpeedCondition", "RelativeSpeedCondition", "TraveledDistanceCondition",
        "ReachPositionCondition", "DistanceCondition", "RelativeDistanceCondition",
        "SimulationTimeCondition", "StoryboardElementStateCondition",
    }  # fmt: skip
    parts = root.xpath(".//EntityCondition/* | .//ByValueCondition/*")
    return {one.tag for one in parts} <= known


def private_actions_are_known(root: _Element) -> bool:
    """parser, convert_maneuver_to_atomic: visibility and looks are refused, others unknown."""
    known = {
        "LongitudinalAction", "LateralAction", "SynchronizeAction", "ActivateControllerAction",
        "ControllerAction", "TeleportAction", "RoutingAction",
    }  # fmt: skip
    return {one.tag for one in root.iterfind(".//Event//PrivateAction/*")} <= known


def activated_controllers_say_longitudinal(root: _Element) -> bool:
    """parser: ``strtobool(None)`` of a missing one raises."""
    return all(one.get("longitudinal") for one in root.iter("ActivateControllerAction"))


def gaps_are_metres(root: _Element) -> bool:
    """parser: ``timeGap`` is a NotImplementedError."""
    gaps = list(root.iter("LongitudinalDistanceAction"))
    return all(one.get("distance") and not one.get("timeGap") for one in gaps)


def lane_changes_are_relative(root: _Element) -> bool:
    """parser: ``find("RelativeTargetLane").attrib`` of another target raises."""
    return all(one[0].tag == "RelativeTargetLane" for one in root.iter("LaneChangeTarget"))


def arrivals_have_a_final_speed(root: _Element) -> bool:
    """parser: ``find("FinalSpeed").find`` of a missing one raises."""
    return all(one.find("FinalSpeed/*") is not None for one in root.iter("SynchronizeAction"))


def trajectories_are_polylines_with_times(root: _Element) -> bool:
    """parser, get_trajectory: ``Trajectory`` in the action itself, ``time`` in every ``Vertex``."""
    actions = list(root.iter("FollowTrajectoryAction"))
    return all(one.find("Trajectory/Shape/Polyline") is not None for one in actions) and all(
        float(one.get("time", "nan")) >= 0.0 for one in root.iter("Vertex")
    )


def events_have_triggers_and_actions(root: _Element) -> bool:
    """scenario, _create_behavior: an event without a StartTrigger begins at once."""
    events = list(root.iter("Event"))
    return all(e.find("StartTrigger") is not None and e.find("Action") is not None for e in events)


def paths_of_elements_are_different(root: _Element) -> bool:
    """scenario, oneshot_with_check: what has a path of names that was there runs never."""
    found: list[tuple[str | None, ...]] = []
    for one in root.iterfind("Storyboard/Story//*[@name]"):
        if one.tag in ("Action", "Event", "Maneuver", "ManeuverGroup", "Condition"):
            above = [one.get("name"), *(up.get("name") for up in one.iterancestors())]
            found.append((str(one.tag), *above))
    return len(set(found)) == len(found)


def nobody_has_a_route(root: _Element) -> bool:
    """atomics 0.9.16, ChangeActorWaypoints: ``len(self._times)`` of a route is a TypeError."""
    return not list(root.iter("AcquirePositionAction", "AssignRouteAction"))


def numbers_are_plain(root: _Element) -> bool:
    """parser since 0.9.13, ParameterRef: what does not match this is no number, as ``1e-05``."""
    plain = re.compile(r"(-)?\d+(\.\d*)?")
    acting = root.find("Storyboard")
    return acting is not None and all(
        plain.fullmatch(value)
        for one in acting.iter("*")
        for value in one.attrib.values()
        if _is_number(value)
    )


def _is_number(text: str | bytes) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def distances_between_actors_are_of_a_known_kind(root: _Element) -> bool:
    """atomics, get_distance_between_actors: others come out as straight distances."""
    kinds = {one.get("relativeDistanceType") for one in root.iter("RelativeDistanceCondition")}
    return kinds <= {"cartesianDistance", "longitudinal", "lateral"}


def signal_controllers_have_phases_with_states(root: _Element) -> bool:
    """parser later, set_traffic_signal_controller: reads the first of each."""
    controllers = list(root.iter("TrafficSignalController"))
    return all(one.find("Phase/TrafficSignalState") is not None for one in controllers)


def it_lasts_as_long_as_the_run(root: _Element) -> bool:
    """scenario, _create_behavior: it ends when all acts are over, whatever stops the storyboard."""
    ends = [
        root.xpath(f"string(Storyboard/{where}//SimulationTimeCondition/@value)")
        for where in ("StopTrigger", "Story/Act/StopTrigger", "Story/Act/ManeuverGroup[last()]")
    ]
    return bool(ends[0]) and ends == ends[:1] * 3


RULES: tuple[Callable[[Any], bool], ...] = (
    only_version_1_0, one_story_and_an_init, frame_is_not_said_to_be_carlas,
    catalog_locations_are_there, entities_have_properties, pedestrians_have_a_model,
    init_places_each_actor_with_its_only_position, lane_positions_have_numbers,
    global_actions_are_environments, signals_are_not_named_by_id, time_of_day_has_no_zone,
    weather_has_sun_fog_and_rain, conditions_say_freespace_and_route,
    distances_to_places_are_not_between_bodies, rules_are_those_of_1_0, states_are_starts_or_ends,
    conditions_are_known, private_actions_are_known, activated_controllers_say_longitudinal,
    gaps_are_metres, lane_changes_are_relative, arrivals_have_a_final_speed,
    trajectories_are_polylines_with_times, events_have_triggers_and_actions,
    paths_of_elements_are_different, nobody_has_a_route, numbers_are_plain,
    distances_between_actors_are_of_a_known_kind, signal_controllers_have_phases_with_states,
    it_lasts_as_long_as_the_run,
)  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("runner")


@cache
def exported(name: str, folder: Path) -> tuple[Any, dict[str, Any]]:
    out, options = folder / name, {"version": "1.0"}
    if name == "as run":
        ran = run(scenario_that_ran(until=30.0), folder / "ran").folder
        files = export_run(workspace(), ran, out, to="openscenario", options=options)
    else:
        given: Scenario = with_every_rule()
        if name in TEMPLATES:
            entry(TEMPLATES[name])
            given = template_scenario(workspace(), name, TEMPLATES[name])
        files = export(workspace(), given, out, to="openscenario", options=options)
    (file,) = (one for one in files if one.suffix == ".xosc")
    (notes,) = (one for one in files if one.name.endswith(".export.json"))
    return etree.parse(file).getroot(), json.loads(notes.read_text(encoding="utf-8"))


@pytest.mark.slow
@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.__name__)
@pytest.mark.parametrize("name", [*TEMPLATES, "every rule", "as run"])
def test_scenario_runner_takes_it(rule: Callable[[Any], bool], name: str, folder: Path) -> None:
    assert rule(exported(name, folder)[0]), rule.__doc__


def listed(notes: dict[str, Any]) -> Iterator[str]:
    for rows in notes.values():
        yield from (row["reason"] for row in rows)


@pytest.mark.slow
def test_what_scenario_runner_refuses_is_listed(folder: Path) -> None:
    _, notes = exported("every rule", folder)
    left = [row["reason"] for row in notes["left_out"]]
    assert "a gap in seconds, which ScenarioRunner refuses" in left
    said = set(listed(notes))
    assert "ScenarioRunner takes the rate as seconds" in said
    assert "ScenarioRunner lets it happen once" in said
    _, notes = exported("hidden-child", folder)
    assert "from the reference point, not the body" in set(listed(notes))
    _, notes = exported("red-light", folder)
    assert any("which ScenarioRunner refuses by the id" in one for one in listed(notes))
    _, notes = exported("as run", folder)
    assert notes["left_out"] == [
        {"place": "traffic lights", "reason": "ScenarioRunner refuses them by the id of a signal"}
    ]


def test_who_is_not_there_yet_waits_below_the_ground_and_comes_up(folder: Path) -> None:
    root, _ = exported("every rule", folder)
    (below,) = root.findall('.//Private[@entityRef="late"]//WorldPosition')
    (event,) = root.findall('.//Event[@name="late departs"]')
    there = event.find(".//TeleportAction//WorldPosition")
    assert [there.get(key) for key in "xyh"] == [below.get(key) for key in "xyh"]
    assert float(there.get("z")) - float(below.get("z")) == pytest.approx(100.0)
    assert float(event.find(".//SimulationTimeCondition").get("value")) == 4.0


def test_goals_are_listed_and_kept_in_properties(folder: Path) -> None:
    root, notes = exported("every rule", folder)
    given = with_every_rule()
    for index, actor in enumerate(given.actors):
        property_ = f'.//ScenarioObject[@name="{actor.id}"]//Property[@name="odscen.goal"]'
        assert root.find(property_).get("value") == actor.goal
        assert {"place": f"actors[{index}].goal", "reason": UNSAID_GOAL} in notes["left_out"]
    (rule,) = (n for n, one in enumerate(given.rules) if one.then[0].goal is not None)
    assert {"place": f"rules[{rule}]", "reason": UNSAID_GOAL} in notes["left_out"]
