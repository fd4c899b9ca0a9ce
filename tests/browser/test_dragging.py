"""Road users and goals moved on the map, by the mouse and by the keyboard."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from playwright.sync_api import Route, expect

from tests.browser.conftest import CROSSING
from tests.browser.pages import OdscenPage
from tools.page import Served


@pytest.fixture
def cars(user: OdscenPage) -> OdscenPage:
    """The editor with two cars, of which the second is selected; nothing is in the hand."""
    user.open_catalogue()
    user.new_scenario(CROSSING).click()
    user.wait_for_editor()
    with user.changing():
        user.map.click(user.graph.middle(user.graph.junction()))
    with user.changing():
        user.add_all.click()
    user.step("Road users").click()
    user.kind("Car").click()
    for start in user.graph.starts(user.document()["roi"], 6, apart=20)[4:]:
        with user.changing():
            user.map.click(start)
    user.page.keyboard.press("Escape")
    return user


def where(user: OdscenPage, number: int) -> tuple[float, float]:
    """Where the start of an actor is."""
    return user.graph.place(user.document()["actors"][number]["spawn"])


def away(one: tuple[float, float], other: tuple[float, float]) -> float:
    return float(np.hypot(one[0] - other[0], one[1] - other[1]))


@pytest.mark.slow
def test_a_road_user_is_dragged_to_the_nearest_free_start_and_undo_brings_it_back(
    cars: OdscenPage,
) -> None:
    before = cars.document()
    target = cars.graph.starts(before["roi"], 8, apart=20)[7]
    view = cars.map.view()
    cars.map.drag(where(cars, 0), target)  # not selected: the map is moved
    assert cars.map.view() != view
    assert cars.document() == before
    cars.map.area.press("0")
    cars.map.click(where(cars, 0))
    with cars.changing():
        cars.map.drag(where(cars, 0), target)
    assert away(where(cars, 0), target) < 3
    assert cars.document()["actors"][1] == before["actors"][1]
    with cars.changing():
        cars.undo.click()
    assert cars.document() == before


@pytest.mark.slow
def test_all_that_is_in_a_rectangle_is_selected_dragged_copied_and_removed(
    cars: OdscenPage,
) -> None:
    starts = [where(cars, 0), where(cars, 1)]
    low = np.min(starts, axis=0) - 4
    high = np.max(starts, axis=0) + 4
    cars.page.keyboard.down("Shift")
    cars.map.drag((low[0], low[1]), (high[0], high[1]))
    cars.page.keyboard.up("Shift")
    expect(cars.page.get_by_text("2 selected", exact=True)).to_be_visible()
    free = cars.graph.starts(cars.document()["roi"], 12, apart=20)
    for number, keys in enumerate(("Control+c", "Control+v")):
        cars.page.keyboard.press(keys)
        with cars.changing():
            cars.map.click(free[8 + number])
    names = [actor["id"] for actor in cars.document()["actors"]]
    assert len(set(names)) == len(names) >= 4
    cars.page.keyboard.press("Control+a")
    with cars.changing():
        cars.page.keyboard.press("Delete")
    assert cars.document()["actors"] == []


@pytest.mark.slow
def test_a_goal_is_set_anywhere_and_its_flag_and_its_route_are_dragged_with_a_live_route(
    cars: OdscenPage,
) -> None:
    actor = cars.document()["actors"][1]
    goals = cars.get(f"/scenarios/{cars.scenario}/goals?spawn={actor['spawn']}")["goals"]
    path = cars.get(f"/scenarios/{cars.scenario}/path?spawn={actor['spawn']}&goal={goals[0]}")[
        "nodes"
    ]
    cars.page.get_by_role("button", name="Choose on the map").click()
    half = cars.graph.place(path[len(path) // 2])
    with cars.changing():
        cars.map.click(half)
    chosen = cars.document()["actors"][1]["goal"]
    assert chosen not in goals
    assert away(cars.graph.place(chosen), half) < 4
    with (
        cars.page.expect_response(lambda answer: "/path?" in answer.url),
        cars.changing(),
    ):
        cars.map.drag(cars.graph.place(chosen), cars.graph.place(goals[0]))
    assert cars.document()["actors"][1]["goal"] == goals[0]
    with cars.changing():
        cars.undo.click()
    assert cars.document()["actors"][1]["goal"] == chosen
    quarter = len(path) // 4
    with (
        cars.page.expect_response(lambda answer: "/path?" in answer.url),
        cars.changing(),
    ):
        cars.map.drag(*(cars.graph.place(path[quarter + by]) for by in (0, 3)))
    (passed,) = cars.document()["actors"][1]["via"]
    assert away(cars.graph.place(passed), cars.graph.place(path[quarter + 3])) < 3


@pytest.mark.slow
def test_a_goal_that_cannot_be_reached_is_said_before_the_click_and_not_set(
    cars: OdscenPage,
) -> None:
    actor = cars.document()["actors"][1]
    lane, _, number = actor["spawn"].rpartition(".")
    behind = f"{lane}.{max(0, int(number) - 8)}"
    assert behind != actor["spawn"]
    cars.page.get_by_role("button", name="Choose on the map").click()
    cars.map.area.press("0")
    for _ in range(2):
        cars.page.get_by_role("button", name="Zoom in").click()
    cars.map.hover(cars.graph.place(behind))
    expect(cars.page.get_by_text("No route leads from the start to this point")).to_be_visible()
    with cars.page.expect_response(lambda answer: "/edits?" in answer.url):
        cars.map.click(cars.graph.place(behind))
    expect(cars.refusal).to_contain_text("That is not possible")
    assert cars.document()["actors"][1]["goal"] is None


@pytest.mark.slow
def test_starts_and_goals_are_moved_by_keys_alone(cars: OdscenPage) -> None:
    keyboard = cars.page.keyboard
    first = where(cars, 1)
    with cars.changing():
        keyboard.press(".")
    on = where(cars, 1)
    assert 0 < away(first, on) < 5
    with cars.changing():
        keyboard.press(",")
    assert where(cars, 1) == first
    with cars.changing():
        keyboard.press("l")
    assert cars.document()["actors"][1]["spawn"].rpartition(".")[0] != ""
    assert where(cars, 1) != first
    actor = cars.document()["actors"][1]
    goals = cars.get(f"/scenarios/{cars.scenario}/goals?spawn={actor['spawn']}")["goals"]
    keyboard.press("g")
    cars.tab_to(cars.map.area)
    cars.map.steer(cars.graph.place(goals[-1]))
    with cars.changing():
        keyboard.press("Enter")
    assert cars.document()["actors"][1]["goal"] == goals[-1]


@pytest.mark.slow
def test_a_move_is_shown_before_it_is_saved_and_goes_back_where_there_is_no_server(
    cars: OdscenPage,
) -> None:
    page = cars.page
    address = "**/api/scenarios/*/edits?*"
    held: list[Route] = []

    def hold(route: Route) -> None:
        held.append(route)

    start = cars.table.get_by_role("row").nth(2).get_by_role("cell").nth(3)
    before = cars.document()
    old = start.inner_text()
    page.route(address, hold)
    page.keyboard.press(".")
    expect(start).not_to_have_text(old)
    expect(page.get_by_text("Saving …")).to_be_visible()
    assert cars.document() == before
    held[0].abort()
    expect(cars.refusal).to_contain_text("Your last change is not saved")
    expect(start).to_have_text(old)
    page.unroute(address)
    with cars.changing():
        page.get_by_role("button", name="Apply my change again").click()
    expect(start).not_to_have_text(old)
    assert cars.document() != before


@pytest.mark.slow
def test_three_cars_a_pedestrian_and_an_ego_with_a_goal_run_within_eighteen_clicks(
    served: Served, open_page: Callable[..., OdscenPage]
) -> None:
    user = open_page(served.url, tour=True)
    user.open_catalogue()
    user.new_scenario(CROSSING).click()
    user.wait_for_editor()
    user.close_tour()
    with user.changing():
        user.page.get_by_role("button", name="Select whole map").click()
    user.step("Road users").click()
    roi = user.document()["roi"]
    starts = user.graph.starts(roi, 6, apart=20)[3:]
    user.kind("Car").click()
    for number, start in enumerate(starts):
        with user.changing():
            user.map.click(start)
        if number == 0:
            with user.changing():
                user.ego.click()
            spawn = user.document()["actors"][0]["spawn"]
            found = user.get(f"/scenarios/{user.scenario}/goals?spawn={spawn}")["goals"]
            user.page.get_by_role("button", name="Choose on the map").click()
            with user.changing():
                user.map.click(user.graph.place(found[0]))
            user.kind("Car").click()
            user.page.get_by_role("button", name="Show the whole map").click()
    user.kind("Pedestrian").click()
    with user.changing():
        user.map.click(user.graph.starts(roi, 1, walking=True)[0])
    user.step("Run").click()
    user.run.click()
    user.wait_until_moving()
    # The shipped map takes one click; a map of one's own one to choose its file.
    assert user.actions() == {"pointer": 17, "key": 0}
    actors = user.document()["actors"]
    assert [actor["category"] for actor in actors] == ["car", "car", "car", "pedestrian"]
    assert actors[0]["ego"]
    assert actors[0]["goal"] == found[0]
