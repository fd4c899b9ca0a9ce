"""Criteria in the page: as sentences, by mouse and by keyboard."""

from __future__ import annotations

from playwright.sync_api import expect

from tests.browser.pages import OdscenPage
from tests.browser.test_keyboard import press
from tests.browser.test_measures import card, crossing, opened

__all__ = ["crossing"]


def test_criteria_are_added_removed_and_taken_back_with_the_mouse(
    user: OdscenPage, crossing: str
) -> None:
    opened(user, crossing, "Criteria")
    new = card(user, "New criterion")
    with user.changing():
        new.get_by_role("button", name="Add the criterion").click()
    assert user.document()["criteria"] == ["collided == 0"]
    user.choose("What", "mean delay")
    user.choose("Is", "at most")
    new.get_by_label("Number").fill("40")
    with user.changing():
        new.get_by_role("button", name="Add the criterion").click()
    assert user.document()["criteria"] == ["collided == 0", "mean_delay <= 40 s"]
    expect(user.page.get_by_text("Mean delay: at most 40 s")).to_be_visible()
    with user.changing():
        user.page.get_by_role("button", name="Remove criterion 1").click()
    assert user.document()["criteria"] == ["mean_delay <= 40 s"]
    with user.changing():
        user.undo.click()
    assert user.document()["criteria"] == ["collided == 0", "mean_delay <= 40 s"]


def test_a_criterion_is_added_with_the_keyboard_alone(user: OdscenPage, crossing: str) -> None:
    user.open_editor(crossing)
    press(user, user.step("Criteria"))
    user.tab_to(user.page.get_by_label("Number"))
    user.page.keyboard.press("Control+A")
    user.page.keyboard.type("2")
    with user.changing():
        press(user, user.page.get_by_role("button", name="Add the criterion"))
    assert user.document()["criteria"] == ["collided == 2"]
