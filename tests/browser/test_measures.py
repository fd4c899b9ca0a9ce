"""Measures and public transport in the page: by mouse, by keyboard, and taken back."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Locator, expect

from odscen.app.maps import load_map
from odscen.app.scenarios import SUFFIX
from odscen.maps.store import Workspace
from odscen.scenario import edits
from odscen.scenario.document.json_form import dumps
from tests.browser.conftest import CROSSING
from tests.browser.pages import OdscenPage
from tests.browser.test_keyboard import press
from tools.page import Served


@pytest.fixture
def crossing(served: Served, request: pytest.FixtureRequest) -> str:
    """Name of an empty scenario on the whole crossing."""
    workspace = Workspace.open(served.workspace)
    graph = load_map(workspace.map(CROSSING)).sumo.graph
    name = request.node.name.replace("_", "-")[:40]
    workspace.scenarios.mkdir(exist_ok=True)
    text = dumps(edits.new_scenario(graph, name=name, roi=graph.segments.ids))
    (workspace.scenarios / f"{name}{SUFFIX}").write_text(text, encoding="utf-8")
    return name


def opened(user: OdscenPage, scenario: str, step: str) -> None:
    user.open_editor(scenario)
    user.step(step).click()


def card(user: OdscenPage, name: str) -> Locator:
    return user.page.get_by_role("region", name=name, exact=True)


def on_lane(user: OdscenPage, lane: str) -> tuple[float, float]:
    """A point in the middle of a lane."""
    columns = user.graph.columns
    row = columns["lane_keys"].index(lane)
    first, end = columns["first_node"][row], columns["first_node"][row + 1]
    return user.graph.place(f"{lane}.{(end - first) // 2}")


def outer_lane(user: OdscenPage, segment: str) -> str:
    """A lane for traffic of a segment."""
    columns = user.graph.columns
    at = [one["id"] for one in user.graph.segments].index(segment)
    rows = [i for i, own in enumerate(columns["segment"]) if own == at]
    return str(columns["lane_keys"][columns["lane"][rows[0]]])


@pytest.mark.slow
def test_a_road_is_closed_by_a_click_and_the_closure_changed_and_taken_back(
    user: OdscenPage, crossing: str
) -> None:
    opened(user, crossing, "Measures")
    user.page.get_by_role("button", name="Choose it on the map").click()
    with user.changing():
        user.map.click(user.graph.middle("r2"))
    closure = card(user, "Closure closure-1")
    for label, minutes in (("From", "10"), ("Until", "30")):
        with user.changing():
            closure.get_by_label(label, exact=True).fill(minutes)
            user.page.keyboard.press("Enter")
    (measure,) = user.document()["measures"]
    assert (measure["kind"], measure["places"]) == ("closure", ["r2"])
    assert (measure["begin"], measure["end"]) == (600, 1800)
    closure.get_by_role("button", name="Road on the map").click()
    with user.changing():
        user.map.click(user.graph.middle("r1"))
    with user.changing():
        user.map.click(user.graph.middle("r2"))
    assert user.document()["measures"][0]["places"] == ["r1"]
    with user.changing():
        closure.get_by_label("Name", exact=True).fill("shut")
        user.page.keyboard.press("Enter")
    assert user.document()["measures"][0]["id"] == "shut"
    with user.changing():
        card(user, "Closure shut").get_by_role("button", name="Remove shut").click()
    assert user.document()["measures"] == []
    with user.changing():
        user.undo.click()
    expect(card(user, "Closure shut")).to_be_visible()
    with user.changing():
        user.redo.click()
    expect(card(user, "Closure shut")).to_have_count(0)


@pytest.mark.slow
def test_a_turn_a_lane_and_a_point_are_picked_on_the_map(user: OdscenPage, crossing: str) -> None:
    opened(user, crossing, "Measures")
    what = user.page.get_by_role("radiogroup", name="What it is about")
    what.get_by_text("Turn", exact=True).click()
    user.page.get_by_role("button", name="Choose it on the map").click()
    user.map.click(user.graph.middle("r2"))
    expect(user.page.get_by_text("From North Street, north of East")).to_be_visible()
    with user.changing():
        user.map.click(user.graph.middle("r1"))
    lane = outer_lane(user, "r3")
    new = card(user, "New measure")
    user.choose("Kind of measure", "Permission")
    new.get_by_text("Lane", exact=True).click()
    new.get_by_role("button", name="Choose it on the map").click()
    with user.changing():
        user.map.click(on_lane(user, lane))
    permission = card(user, "Permission permission-1")
    permission.get_by_text("These may not", exact=True).click()
    user.choose("Kind of measure", "Incident")
    new.get_by_role("button", name="Choose it on the map").click()
    with user.changing():
        user.map.click(on_lane(user, lane))
    turn, banned, incident = user.document()["measures"]
    assert turn["places"] == ["r2>r1"]
    assert (banned["places"], banned["banned"]) == ([lane], ["bus", "bicycle"])
    assert incident["lane"] == lane
    assert incident["s"] > 1


@pytest.mark.slow
def test_a_place_that_is_not_on_the_map_is_refused_with_its_name(
    user: OdscenPage, crossing: str
) -> None:
    opened(user, crossing, "Measures")
    user.page.get_by_label("or type its name").fill("r77")
    user.page.keyboard.press("Enter")
    expect(user.refusal).to_contain_text("'r77' is neither a segment nor a lane")
    assert user.document()["measures"] == []


@pytest.mark.slow
def test_a_light_is_put_out_of_order_with_the_keyboard_alone(
    user: OdscenPage, crossing: str
) -> None:
    user.open_editor(crossing)
    keyboard = user.page.keyboard
    press(user, user.step("Measures"))
    user.tab_to(user.page.get_by_role("textbox", name="Kind of measure"))
    keyboard.press("Enter")
    wanted = user.page.get_by_role("option", name="Signal")
    expect(wanted).to_be_visible()
    while wanted.get_attribute("data-combobox-selected") is None:
        keyboard.press("ArrowDown")
    keyboard.press("Enter")
    user.tab_to(user.page.get_by_role("textbox", name="or its junction"))
    keyboard.press("Enter")
    keyboard.press("ArrowDown")
    with user.changing():
        keyboard.press("Enter")
    (measure,) = user.document()["measures"]
    assert (measure["kind"], measure["shows"]) == ("signal_outage", "off")
    press(user, user.page.get_by_role("button", name="Traffic light on the map"))
    keyboard.press("Escape")
    expect(user.page.get_by_role("button", name="Traffic light on the map")).to_be_visible()
    with user.changing():
        press(user, user.page.get_by_role("button", name=f"Remove {measure['id']}"))
    assert user.document()["measures"] == []
    assert user.actions()["pointer"] == 0


@pytest.mark.slow
def test_a_line_with_two_stops_is_drawn_on_the_map_and_changed(
    user: OdscenPage, crossing: str
) -> None:
    opened(user, crossing, "Public transport")
    lane = entering_lane(user)
    columns = user.graph.columns
    row = columns["lane_keys"].index(lane)
    number = columns["first_node"][row + 1] - columns["first_node"][row]
    start, first, second = (f"{lane}.{number * k // 10}" for k in (1, 4, 7))
    user.page.get_by_role("button", name="Add stops on the map").click()
    for node in (first, second):
        with user.changing():
            user.map.click(user.graph.place(node))
    user.page.get_by_role("button", name="Stop adding stops").click()
    with user.changing():
        card(user, "Stop stop-1").get_by_role("button", name="Change stop-1").click()
        card(user, "Stop stop-1").get_by_label("In a bay beside the lane").click()
    with user.changing():
        user.page.get_by_label("Name for people").fill("Market")
        user.page.keyboard.press("Enter")
    user.page.get_by_role("button", name="Add a line").click()
    user.page.get_by_role("textbox", name="Its stops, in their order").click()
    user.page.get_by_role("option", name=re.compile("Market")).click()
    user.page.get_by_role("option", name="stop-2").click()
    user.page.keyboard.press("Escape")
    user.page.get_by_role("button", name="Choose on the map where it begins").click()
    with user.changing():
        user.map.click(user.graph.place(start))
    line = card(user, "Line line-1")
    with user.changing():
        line.get_by_label("A trip every").fill("5")
        user.page.keyboard.press("Enter")
    with user.changing():
        line.get_by_label(re.compile("1. Market")).fill("60")
        user.page.keyboard.press("Enter")
    transit = user.document()["transit"]
    assert [(one["id"], one["name"], one["bay"]) for one in transit["stops"]] == [
        ("stop-1", "Market", True),
        ("stop-2", "", False),
    ]
    (found,) = transit["lines"]
    assert (found["start"], found["headway"]) == (start, 300)
    assert [(one["stop"], one["after"]) for one in found["stops"]] == [
        ("stop-1", 60),
        ("stop-2", None),
    ]
    card(user, "Stop Market stop-1").get_by_role("button", name="Remove stop-1").click()
    expect(user.refusal).to_contain_text("stop-1")
    with user.changing():
        line.get_by_role("button", name="Remove line-1").click()
    with user.changing():
        user.undo.click()
    assert user.document()["transit"] == transit


def entering_lane(user: OdscenPage) -> str:
    """A lane that leads towards the junction: its last node has a successor inside one."""
    columns = user.graph.columns
    inside = {i for i, lane in enumerate(columns["lane"]) if columns["lane_junctions"][lane]}
    edges = columns["edges"]
    for source, target, relation in zip(
        edges["source"], edges["target"], edges["relation"], strict=True
    ):
        if relation == 0 and target in inside and source not in inside:
            return str(columns["lane_keys"][columns["lane"][source]])
    raise AssertionError("no lane leads into a junction")
