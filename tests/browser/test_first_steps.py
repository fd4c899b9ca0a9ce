"""What stood in the way of people who saw the page for the first time."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import Route, expect

from tests.browser.conftest import CROSSING
from tests.browser.pages import OdscenPage, settle
from tools.page import Served


@pytest.fixture
def region(user: OdscenPage) -> OdscenPage:
    """The editor of a scenario whose region is a junction and all that meets in it."""
    user.open_catalogue()
    user.new_scenario(CROSSING).click()
    user.wait_for_editor()
    with user.changing():
        user.map.click(user.graph.middle(user.graph.junction()))
    with user.changing():
        user.add_all.click()
    return user


@pytest.mark.slow
def test_the_map_does_not_move_under_the_pointer_while_road_users_are_placed(
    region: OdscenPage,
) -> None:
    region.step("Road users").click()
    region.kind("Car").click()
    before = region.map.view(), region.map.area.bounding_box()
    for start in region.graph.starts(region.document()["roi"], 3):
        with region.changing():
            region.map.click(start)
        assert (region.map.view(), region.map.area.bounding_box()) == before
    expect(region.names).to_have_count(3)


@pytest.mark.slow
def test_a_click_while_placing_never_sets_the_goal_of_the_one_before(region: OdscenPage) -> None:
    region.step("Road users").click()
    region.kind("Car").click()
    with region.changing():
        region.map.click(region.graph.starts(region.document()["roi"], 1)[0])
    first = region.document()["actors"][0]
    goals = region.get(f"/scenarios/{region.scenario}/goals?spawn={first['spawn']}")["goals"]
    with region.changing():
        region.map.click(region.graph.place(goals[0]))
    actors = region.document()["actors"]
    assert [actor["goal"] for actor in actors] == [None, None]


@pytest.mark.slow
def test_a_new_name_is_seen_in_the_head_the_list_and_the_runs(region: OdscenPage) -> None:
    region.choose_in_menu("Rename")
    dialog = region.page.get_by_role("dialog")
    dialog.get_by_label("Name").fill("Morning peak")
    with region.changing():
        dialog.get_by_role("button", name="Rename").click()
    crumbs = region.page.get_by_role("navigation", name="Where you are")
    expect(crumbs).to_contain_text("Morning peak")
    name = region.scenario
    region.page.goto(f"/#/runs/{name}")
    expect(region.page.get_by_role("heading", level=1)).to_have_text("Runs of Morning peak")
    region.open_catalogue()
    listed = region.page.get_by_role("table", name="Your scenarios")
    expect(listed.get_by_role("link", name="Morning peak").first).to_have_attribute(
        "href", f"#/edit/{name}"
    )


@pytest.mark.slow
def test_what_is_typed_and_not_finished_outlives_a_reload_and_the_back_button(
    region: OdscenPage,
) -> None:
    region.step("Road users").click()
    region.kind("Car").click()
    with region.changing():
        region.map.click(region.graph.starts(region.document()["roi"], 1)[0])
    for number, leave in enumerate((region.page.reload, region.page.go_back)):
        region.page.get_by_label("Departs after").fill(str(7 + number))
        name = region.scenario
        leave()
        region.page.wait_for_timeout(300)
        region.page.goto(f"/#/edit/{name}")
        region.wait_for_editor()
        assert region.document()["actors"][0]["depart"] == 7 + number
        region.step("Road users").click()
        region.names.first.click()


@pytest.mark.slow
def test_a_map_that_cannot_be_read_is_said_in_sight_and_in_plain_words(user: OdscenPage) -> None:
    user.open_catalogue()
    with user.page.expect_file_chooser() as chooser:
        user.page.get_by_role("button", name="Choose a file").click()
    chooser.value.set_files(
        {"name": "broken.xodr", "mimeType": "text/xml", "buffer": b"<OpenDRIVE><road></OpenDRIVE>"}
    )
    said = user.page.get_by_role("alert").filter(has_text="broken.xodr could not be added")
    expect(said).to_be_in_viewport(ratio=0.95)
    expect(said).to_contain_text("export it again")
    expect(said.locator("pre")).to_be_hidden()


@pytest.mark.slow
def test_a_change_that_takes_long_is_said_on_the_map(region: OdscenPage) -> None:
    region.step("Road users").click()
    region.kind("Car").click()
    held: list[Route] = []

    def hold(asked: Route) -> None:
        held.append(asked)

    region.page.route("**/api/scenarios/*/edits?*", hold)
    region.map.click(region.graph.starts(region.document()["roi"], 1)[0])
    working = region.page.get_by_text("Applying the change")
    expect(working).to_be_visible()
    with region.changing():
        held[0].continue_()
    expect(working).to_have_count(0)


def test_without_a_clock_no_time_of_day_is_shown_that_the_weather_contradicts(
    region: OdscenPage,
) -> None:
    region.step("Demand").click()
    field = region.page.get_by_role("textbox", name="Time of day at the start")
    expect(field).to_have_value("")
    with region.changing():
        field.fill("17:15")
        field.press("Enter")
    assert region.document()["demand"]["clock"] == 17 * 3600 + 15 * 60
    with region.changing():
        field.fill("")
        field.press("Enter")
    assert region.document()["demand"]["clock"] == 0
    field.fill("half past")
    field.press("Enter")
    expect(region.page.get_by_text("such as 07:30")).to_be_visible()


@pytest.mark.slow
def test_the_comparison_of_two_runs_is_not_clipped_on_a_narrow_screen(
    served: Served, sampled: str, open_page: Callable[..., OdscenPage]
) -> None:
    user = open_page(served.url, viewport={"width": 1024, "height": 768})
    user.page.goto(f"/#/runs/{sampled}")
    for _ in range(2):
        answer = user.page.request.post("/api/runs", data={"scenario": sampled, "speed": None})
        run = answer.json()["run"]
        while user.get(f"/runs/{run}")["state"] not in ("completed", "failed"):
            user.page.wait_for_timeout(200)
    user.page.goto(f"/#/run/{sampled}/{run}")
    table = user.page.get_by_role("table", name="Compared with the last run")
    expect(table).to_be_visible()
    settle(user.page)
    box, side = table.bounding_box(), user.page.get_by_role("complementary").bounding_box()
    assert box is not None
    assert side is not None
    assert box["x"] + box["width"] <= side["x"] + side["width"]
    cells = "[...table.querySelectorAll('td, th')]"
    clipped = table.evaluate(f"table => {cells}.some(c => c.scrollWidth > c.clientWidth + 1)")
    assert not clipped
