"""The study in the page: times and stations, by mouse and by keyboard, and taken back."""

from __future__ import annotations

import pytest
from playwright.sync_api import expect

from tests.browser.pages import OdscenPage
from tests.browser.test_keyboard import press
from tests.browser.test_measures import card, crossing, on_lane, opened, outer_lane

__all__ = ["crossing"]


@pytest.mark.slow
def test_stations_are_placed_changed_removed_and_taken_back_with_the_mouse(
    user: OdscenPage, crossing: str
) -> None:
    opened(user, crossing, "Analysis")
    new = card(user, "New station")
    first, second = (on_lane(user, outer_lane(user, road)) for road in ("r2", "r3"))
    new.get_by_role("button", name="Choose it on the map").click()
    with user.changing():
        user.map.click(first)
    (detector,) = user.document()["study"]["detectors"]
    assert (detector["id"], len(detector["nodes"])) == ("detector-1", 1)
    form = card(user, "Detector detector-1")
    form.get_by_role("button", name="Lanes: choose lanes on the map").click()
    with user.changing():
        user.map.click(second)
    (more,) = user.document()["study"]["detectors"]
    assert more["nodes"][0] == detector["nodes"][0]
    assert len(more["nodes"]) == 2
    with user.changing():
        user.map.click(second)
    assert user.document()["study"]["detectors"] == [detector]
    with user.changing():
        form.get_by_label("Name", exact=True).fill("north")
        user.page.keyboard.press("Enter")
    user.choose("Kind of station", "Travel-time section")
    new.get_by_role("button", name="Choose it on the map").click()
    user.map.click(first)
    expect(new.get_by_role("status")).to_contain_text("Now its End.")
    with user.changing():
        user.map.click(second)
    study = user.document()["study"]
    assert [one["id"] for one in study["detectors"] + study["sections"]] == ["north", "section-1"]
    assert study["sections"][0]["begin"] == detector["nodes"]
    with user.changing():
        card(user, "Detector north").get_by_role("button", name="Remove north").click()
    assert user.document()["study"]["detectors"] == []
    with user.changing():
        user.undo.click()
    assert user.document()["study"] == study


@pytest.mark.slow
def test_times_and_a_cordon_are_set_with_the_keyboard_alone(
    user: OdscenPage, crossing: str
) -> None:
    user.open_editor(crossing)
    keyboard = user.page.keyboard
    press(user, user.step("Analysis"))
    user.tab_to(user.page.get_by_label("Warm-up that figures leave out"))
    keyboard.press("Control+A")
    keyboard.type("10")
    with user.changing():
        keyboard.press("Enter")
    user.tab_to(user.page.get_by_role("textbox", name="Analysis interval"))
    keyboard.press("Enter")
    wanted = user.page.get_by_role("option", name="15 min")
    expect(wanted).to_be_visible()
    while wanted.get_attribute("data-combobox-selected") is None:
        keyboard.press("ArrowDown")
    with user.changing():
        keyboard.press("Enter")
    study = user.document()["study"]
    assert (study["warm_up"], study["interval"]) == (600, 900)
    user.tab_to(user.page.get_by_role("textbox", name="Kind of station"))
    keyboard.press("Enter")
    wanted = user.page.get_by_role("option", name="Cordon")
    expect(wanted).to_be_visible()
    while wanted.get_attribute("data-combobox-selected") is None:
        keyboard.press("ArrowDown")
    keyboard.press("Enter")
    lanes = [f"{outer_lane(user, road)}.1" for road in ("r2", "r3")]
    user.tab_to(user.page.get_by_label("or type the node", exact=True))
    keyboard.type(lanes[0])
    keyboard.press("Enter")
    keyboard.type(lanes[1])
    with user.changing():
        keyboard.press("Enter")
    (cordon,) = user.document()["study"]["cordons"]
    assert (cordon["id"], cordon["entries"], cordon["exits"]) == (
        "cordon-1",
        [lanes[0]],
        [lanes[1]],
    )
    # With the map in focus, arrow keys bring a place to the middle and Enter clicks there.
    press(user, user.page.get_by_role("button", name="Exits: choose lanes on the map"))
    user.tab_to(user.map.area, back=True)
    user.map.steer(on_lane(user, outer_lane(user, "r1")))
    with user.changing():
        keyboard.press("Enter")
    assert len(user.document()["study"]["cordons"][0]["exits"]) == 2
    assert user.actions()["pointer"] == 0


@pytest.mark.slow
def test_a_station_where_there_is_no_lane_is_refused_with_the_name_of_the_node(
    user: OdscenPage, crossing: str
) -> None:
    opened(user, crossing, "Analysis")
    user.page.get_by_label("or type the node", exact=True).fill("77.0.-1.1")
    user.page.keyboard.press("Enter")
    expect(user.refusal).to_contain_text("the map has no node '77.0.-1.1'")
    assert user.document()["study"]["detectors"] == []
