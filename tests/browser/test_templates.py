"""Templates in the gallery: placed by mouse and by keyboard."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from playwright.sync_api import expect

from tests.browser.conftest import PATIENCE

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.browser.pages import OdscenPage
    from tools import page as tool


@pytest.mark.slow
def test_a_newcomer_places_the_walker_by_mouse(
    served: tool.Served, open_page: Callable[..., OdscenPage]
) -> None:
    user = open_page(served.url)
    user.open_catalogue()
    page = user.page
    page.get_by_role("button", name="Place on a map: Pedestrian mid-block").click()
    dialog = page.get_by_role("dialog", name="Pedestrian mid-block")
    dialog.get_by_label("Map").first.click()
    page.get_by_role("option", name="signal_crossing").click()
    dialog.get_by_role("button", name="Create scenario").click()
    user.wait_for_editor()
    document = user.document()
    assert [rule["id"] for rule in document["rules"]] == ["wait", "cross"]
    assert [actor["id"] for actor in document["actors"]] == ["ego", "walker"]


@pytest.mark.slow
def test_a_template_is_placed_by_keyboard_and_says_why_it_has_no_room(
    served: tool.Served, open_page: Callable[..., OdscenPage]
) -> None:
    user = open_page(served.url)
    user.open_catalogue()
    page = user.page
    page.get_by_role("button", name="Place on a map: Cut-in", exact=True).focus()
    page.keyboard.press("Enter")
    dialog = page.get_by_role("dialog", name="Cut-in")
    expect(dialog).to_be_visible()
    field = dialog.get_by_label("Map").first
    field.focus()
    page.keyboard.type("signal_crossing")
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    button = dialog.get_by_role("button", name="Create scenario")
    button.focus()
    page.keyboard.press("Enter")
    alert = dialog.get_by_role("alert")
    expect(alert).to_contain_text("has no room for a cut-in", timeout=PATIENCE)
    for name, value in (("Ego speed", "28.8"), ("Cut-in vehicle speed", "14.4")):
        number = dialog.get_by_role("textbox", name=f"{name} (km/h)", exact=True)
        number.focus()
        page.keyboard.press("Control+a")
        page.keyboard.type(value)
    button.focus()
    page.keyboard.press("Enter")
    user.wait_for_editor()
    document = user.document()
    assert [actor["speed"] for actor in document["actors"]] == [8, 4]
    assert [rule["id"] for rule in document["rules"]] == ["cruise", "cut-in"]
