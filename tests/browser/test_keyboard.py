"""The whole way without a pointer."""

from __future__ import annotations

import pytest
from playwright.sync_api import Locator, expect

from tests.browser.conftest import CROSSING
from tests.browser.pages import OdscenPage


def press(user: OdscenPage, wanted: Locator, key: str = "Enter") -> None:
    user.tab_to(wanted)
    user.page.keyboard.press(key)


@pytest.mark.slow
def test_a_scenario_is_made_and_run_with_the_keyboard_alone(user: OdscenPage) -> None:
    keyboard = user.page.keyboard
    user.open_catalogue()
    press(user, user.new_scenario(CROSSING))
    user.wait_for_editor()

    user.tab_to(user.map.area)
    user.map.steer(user.graph.middle(user.graph.junction()))
    with user.changing():
        keyboard.press("Enter")
    with user.changing():
        press(user, user.add_all)
    roi = user.document()["roi"]

    press(user, user.step("Road users"))
    for digit, walking in (("1", False), ("3", False), ("7", True)):
        keyboard.press(digit)
        user.tab_to(user.map.area)
        user.map.steer(user.graph.starts(roi, 4, walking=walking)[int(digit) % 3])
        with user.changing():
            keyboard.press("Enter")
    keyboard.press("Escape")
    kinds = [actor["category"] for actor in user.document()["actors"]]
    assert kinds == ["car", "truck", "pedestrian"]

    press(user, user.names.first)
    with user.changing():
        press(user, user.ego, "Space")
    assert user.document()["actors"][0]["ego"]
    press(user, user.names.nth(1))
    with user.changing():
        keyboard.press("Delete")
    with user.changing():
        keyboard.press("Control+z")
    expect(user.names).to_have_count(3)

    press(user, user.step("Run"))
    press(user, user.run)
    user.wait_until_moving()
    press(user, user.control("Pause"))
    expect(user.control("One step")).to_be_enabled()
    shown = user.figure("Time").first.inner_text()
    press(user, user.control("One step"))
    expect(user.figure("Time").first).not_to_have_text(shown)
    press(user, user.control("Stop"))
    expect(user.result).to_contain_text("stopped")
    press(user, user.result.get_by_role("button", name="Back to the editor"))
    user.wait_for_editor()
    assert user.actions()["pointer"] == 0


@pytest.mark.slow
def test_shortcuts_are_listed_and_the_list_gives_the_focus_back(
    user: OdscenPage, sampled: str
) -> None:
    user.open_editor(sampled)
    user.tab_to(user.help)
    user.page.keyboard.press("Enter")
    sheet = user.page.get_by_role("dialog")
    expect(sheet).to_contain_text("Ctrl+Z")
    expect(sheet).to_contain_text("Ctrl+K")
    user.page.keyboard.press("Escape")
    expect(sheet).to_have_count(0)
    expect(user.help).to_be_focused()


@pytest.mark.slow
def test_a_dialog_keeps_the_focus_and_escape_keeps_the_map(user: OdscenPage) -> None:
    user.open_catalogue()
    press(user, user.remove(CROSSING))
    dialog = user.page.get_by_role("dialog")
    expect(dialog).to_be_visible()
    for _ in range(6):
        user.page.keyboard.press("Tab")
        assert dialog.evaluate("element => element.contains(document.activeElement)")
    user.page.keyboard.press("Escape")
    expect(dialog).to_have_count(0)
    expect(user.maps).to_have_text([CROSSING])
