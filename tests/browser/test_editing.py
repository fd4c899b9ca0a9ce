"""The editor: region, road users, goals, undo, reload, two tabs."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from playwright.sync_api import Route, expect

from tests.browser.conftest import CROSSING
from tests.browser.pages import OdscenPage, settle
from tools.page import Served


@pytest.fixture
def editor(user: OdscenPage) -> OdscenPage:
    """The editor of a new scenario."""
    user.open_catalogue()
    user.new_scenario(CROSSING).click()
    user.wait_for_editor()
    return user


@pytest.fixture
def region(editor: OdscenPage) -> OdscenPage:
    """The editor of a scenario whose region is a junction and all that meets in it."""
    with editor.changing():
        editor.map.click(editor.graph.middle(editor.graph.junction()))
    with editor.changing():
        editor.add_all.click()
    return editor


def place(user: OdscenPage, kind: str, number: int = 0) -> str:
    """Place somebody on the map; the name that is given."""
    before = {actor["id"] for actor in user.document()["actors"]}
    user.step("Road users").click()
    walking = kind == "Pedestrian"
    start = user.graph.starts(user.document()["roi"], number + 1, walking=walking)[number]
    if user.kind(kind).get_attribute("aria-pressed") != "true":
        user.kind(kind).click()
    with user.changing():
        user.map.click(start)
    user.page.keyboard.press("Escape")
    (made,) = (a["id"] for a in user.document()["actors"] if a["id"] not in before)
    return str(made)


@pytest.mark.slow
def test_a_region_grows_only_by_what_touches_it(editor: OdscenPage) -> None:
    graph = editor.graph
    arms = graph.neighbours(graph.junction())
    with editor.changing():
        editor.map.click(graph.middle(arms[0]))
    assert editor.document()["roi"] == [arms[0]]
    with editor.changing():
        editor.map.click(graph.middle(arms[1]))
    expect(editor.refusal).to_be_visible()
    assert editor.document()["roi"] == [arms[0]]


@pytest.mark.slow
def test_a_region_never_falls_apart(region: OdscenPage) -> None:
    before = region.document()["roi"]
    junction = region.graph.junction()
    assert before[0] == junction
    with region.changing():
        region.map.click(region.graph.middle(junction))
    expect(region.refusal).to_be_visible()
    assert region.document()["roi"] == before
    with region.changing():
        region.map.click(region.graph.middle(before[-1]))
    assert region.document()["roi"] == before[:-1]


@pytest.mark.slow
def test_the_whole_map_is_one_click_and_one_step_of_undo(editor: OdscenPage) -> None:
    with editor.changing():
        editor.page.get_by_role("button", name="Select whole map").click()
    assert sorted(editor.document()["roi"]) == sorted(one["id"] for one in editor.graph.segments)
    with editor.changing():
        editor.undo.click()
    assert editor.document()["roi"] == []


@pytest.mark.slow
def test_a_rectangle_and_what_is_in_sight_become_the_region(editor: OdscenPage) -> None:
    graph = editor.graph
    junction = graph.junction()
    x, y = graph.middle(junction)
    keyboard = editor.page.keyboard
    keyboard.down("Shift")
    with editor.changing():
        editor.map.drag((x - 30, y - 30), (x + 30, y + 30))
    keyboard.up("Shift")
    assert editor.document()["roi"] == [junction]
    with editor.changing():
        editor.page.get_by_role("button", name="Select visible area").click()
    assert len(editor.document()["roi"]) == len(graph.segments)


@pytest.mark.slow
def test_roads_and_road_users_are_found_by_name_without_a_mouse(region: OdscenPage) -> None:
    name = place(region, "Bus")
    road = region.graph.neighbours(region.graph.junction())[0]
    keyboard = region.page.keyboard
    for searched, kind in ((road, "Road"), (name, "Bus")):
        keyboard.press("Escape")
        keyboard.press("Control+k")
        field = region.page.get_by_role("combobox", name="Name of a place")
        field.fill(f"{kind.lower()} {searched}")
        expect(region.page.get_by_role("option").first).to_contain_text(searched)
        keyboard.press("Enter")
        expect(region.page.get_by_role("dialog")).to_have_count(0)
        x, y, _ = region.map.view()
        if kind == "Bus":
            spawn = region.graph.place(region.document()["actors"][0]["spawn"])
            assert np.hypot(x - spawn[0], y - spawn[1]) < 5
        else:
            middle = region.graph.middle(road)
            assert np.hypot(x - middle[0], y - middle[1]) < 30
    expect(region.names.first).to_have_attribute("aria-pressed", "true")


@pytest.mark.slow
def test_neighbours_are_not_offered_before_they_are_known(editor: OdscenPage) -> None:
    held: list[Route] = []

    def hold(asked: Route) -> None:
        held.append(asked)

    editor.page.route("**/api/scenarios/*/roi", hold)
    with editor.changing():
        editor.map.click(editor.graph.middle(editor.graph.junction()))
    expect(editor.add_all).to_be_disabled()
    for asked in held:
        asked.continue_()
    with editor.changing():
        editor.add_all.click()
    assert len(editor.document()["roi"]) == 5


@pytest.mark.slow
def test_a_problem_leads_to_its_place(region: OdscenPage) -> None:
    place(region, "Pedestrian", 2)
    expect(region.problems).to_have_count(0)
    region.names.first.click()
    with region.changing():
        late = region.page.get_by_label("Departs after")
        late.fill("80000")  # long after the end of the run
        late.press("Enter")
    expect(region.problems).to_have_count(1)
    region.page.keyboard.press("Escape")
    region.map.area.press("0")
    whole = region.map.view()
    region.problems.first.click()
    expect(region.names).to_have_attribute("aria-pressed", "true")
    x, y, scale = region.map.view()
    assert scale > whole[2]
    spawn = region.graph.place(region.document()["actors"][0]["spawn"])
    assert np.hypot(x - spawn[0], y - spawn[1]) < 5


@pytest.mark.slow
def test_every_kind_of_road_user_can_be_placed(region: OdscenPage) -> None:
    kinds = ("Car", "Van", "Truck", "Bus", "Motorcycle", "Bicycle", "Pedestrian")
    for number, kind in enumerate(kinds):
        place(region, kind, number)
    found = [actor["category"] for actor in region.document()["actors"]]
    assert found == [kind.lower() for kind in kinds]
    expect(region.names).to_have_count(len(kinds))


@pytest.mark.slow
def test_a_goal_is_chosen_on_the_map_and_made_random_again(region: OdscenPage) -> None:
    name = place(region, "Car", 3)
    actor = region.document()["actors"][0]
    goals = region.get(f"/scenarios/{region.scenario}/goals?spawn={actor['spawn']}")["goals"]
    region.page.get_by_role("button", name="Choose on the map").click()
    with region.changing():
        region.map.click(region.graph.place(goals[0]))
    assert region.document()["actors"][0]["goal"] == goals[0]
    with region.changing():
        region.page.get_by_role("button", name="Random goal").click()
    assert region.document()["actors"][0]["goal"] is None
    assert region.document()["actors"][0]["id"] == name


@pytest.mark.slow
def test_undo_and_redo_say_what_they_do_and_do_it(region: OdscenPage) -> None:
    with_region = region.document()
    place(region, "Car")
    with_car = region.document()
    for _ in range(2):
        with region.changing():
            region.undo.click()
        assert region.document() == with_region
        assert region.redo.get_attribute("aria-label") != "Redo"
        with region.changing():
            region.redo.click()
        assert region.document() == with_car
    with region.changing():
        region.page.keyboard.press("Control+z")
    assert region.document() == with_region
    with region.changing():
        region.page.keyboard.press("Control+y")
    assert region.document() == with_car


@pytest.mark.slow
def test_nothing_is_lost_by_a_reload(region: OdscenPage) -> None:
    name = place(region, "Truck")
    before = region.document()
    region.page.reload()
    region.wait_for_editor()
    expect(region.names).to_have_text([name])
    assert region.document() == before
    with region.changing():
        region.undo.click()
    expect(region.names).to_have_count(0)


@pytest.mark.slow
def test_a_second_tab_overwrites_nothing_and_says_so(
    region: OdscenPage, open_page: Callable[..., OdscenPage], served: Served
) -> None:
    other = open_page(served.url, context=region.page.context)
    other.open_editor(region.scenario)
    first = place(region, "Car")
    other.step("Road users").click()
    other.kind("Van").click()
    start = other.graph.starts(other.document()["roi"], 4)[3]
    with other.page.expect_response(lambda answer: "/edits?" in answer.url) as answered:
        other.map.click(start)
    assert answered.value.status == 409
    expect(other.refusal).to_contain_text("another tab")
    expect(other.names).to_have_text([first])
    with other.changing():
        other.map.click(start)
    assert [actor["category"] for actor in other.document()["actors"]] == ["car", "van"]


@pytest.mark.slow
def test_a_scenario_that_is_not_there_is_said_with_a_way_back(user: OdscenPage) -> None:
    user.page.goto("/#/edit/nowhere")
    expect(user.page.get_by_role("alert")).to_contain_text("nowhere")
    user.page.get_by_role("button", name="Back to the maps").click()
    expect(user.maps).to_have_count(1)


@pytest.mark.slow
def test_a_flow_is_placed_and_undone(region: OdscenPage) -> None:
    region.step("Road users").click()
    region.flow("Vehicle flow").click()
    with region.changing():
        region.map.click(region.graph.starts(region.document()["roi"], 3)[2])
    (flow,) = region.document()["flows"]
    assert flow["per_hour"] > 0
    expect(region.names).to_have_count(1)
    with region.changing():
        region.undo.click()
    assert region.document()["flows"] == []


@pytest.mark.slow
def test_a_random_crowd_fills_the_region_in_one_step(region: OdscenPage) -> None:
    region.step("Road users").click()
    region.page.get_by_role("button", name="Generate traffic").click()
    settle(region.page)
    button = region.page.get_by_role("button", name="Fill the region", exact=True)
    with region.changing():
        button.click()
    assert len(region.document()["actors"]) > 5
    with region.changing():
        region.undo.click()
    assert region.document()["actors"] == []
