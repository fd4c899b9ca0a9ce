"""Rules in the page: made, changed, removed and taken back, by mouse and by keyboard."""

from __future__ import annotations

import pytest
from playwright.sync_api import expect

from odscen.app.maps import load_map
from odscen.app.scenarios import SUFFIX
from odscen.lanegraph.query import node_id
from odscen.maps.store import Workspace
from odscen.scenario import edits
from odscen.scenario.document.json_form import dumps
from odscen.scenario.placing.region import Region, name_of, place_of
from tests.browser.conftest import CROSSING
from tests.browser.pages import OdscenPage
from tests.browser.test_keyboard import press
from tools.page import Served


@pytest.fixture
def two(served: Served, request: pytest.FixtureRequest) -> str:
    """Name of a scenario with the ego car-1 and van-1."""
    workspace = Workspace.open(served.workspace)
    graph = load_map(workspace.map(CROSSING)).sumo.graph
    name = request.node.name.replace("_", "-")[:40]
    scenario = edits.new_scenario(graph, name=name, roi=graph.segments.ids)
    region = Region.of(graph, scenario.roi)
    starts = [i for i in range(0, len(graph.lanes.x), 8) if region.router.goal_candidates(i).size]
    for category, start in (("car", starts[0]), ("van", starts[4])):
        place = place_of(graph, node_id(graph, start))
        assert place is not None
        scenario = edits.add_actor(scenario, graph, category=category, spawn=name_of(graph, place))
    scenario = edits.set_ego(scenario, actor="car-1")
    workspace.scenarios.mkdir(exist_ok=True)
    (workspace.scenarios / f"{name}{SUFFIX}").write_text(dumps(scenario), encoding="utf-8")
    return name


@pytest.mark.slow
def test_a_cut_in_is_made_with_the_mouse_changed_removed_and_taken_back(
    user: OdscenPage, two: str
) -> None:
    user.open_editor(two)
    user.step("Rules").click()
    user.page.get_by_role("button", name="Add a rule").click()
    with user.changing():
        user.page.get_by_role("button", name="Add the rule").click()
    words = "When time to collision with car-1 is below 3 s, cut in before car-1 over 3 s."
    expect(user.page.get_by_text(words)).to_be_visible()
    (rule,) = user.document()["rules"]
    assert rule["actor"] == "van-1"
    assert (rule["when"]["ttc"]["to"], rule["when"]["ttc"]["below"]) == ("car-1", 3)
    assert [(one["cut_in"]["to"], one["cut_in"]["over"]) for one in rule["then"]] == [("car-1", 3)]
    user.page.get_by_role("button", name="Change rule-1").click()
    user.choose("Condition", "Reaches a place")
    user.page.get_by_role("button", name="Place on the map").click()
    user.map.click(user.graph.place(user.document()["actors"][0]["spawn"]))
    with user.changing():
        user.page.get_by_role("button", name="Save the rule").click()
    (rule,) = user.document()["rules"]
    assert rule["when"]["reaches"]["within"] == 5
    with user.changing():
        user.page.get_by_role("button", name="Remove rule-1").click()
    assert user.document().get("rules", []) == []
    with user.changing():
        user.undo.click()
    assert user.document()["rules"] == [rule]


@pytest.mark.slow
def test_a_rule_is_made_with_the_keyboard_alone(user: OdscenPage, two: str) -> None:
    user.open_editor(two)
    press(user, user.step("Rules"))
    press(user, user.page.get_by_role("button", name="Add a rule"))
    user.tab_to(user.page.get_by_label("Below", exact=True))
    user.page.keyboard.press("Control+A")
    user.page.keyboard.type("2.5")
    user.page.keyboard.press("Tab")
    with user.changing():
        press(user, user.page.get_by_role("button", name="Add the rule"))
    (rule,) = user.document()["rules"]
    assert rule["when"]["ttc"]["below"] == 2.5
    assert user.actions()["pointer"] == 0
