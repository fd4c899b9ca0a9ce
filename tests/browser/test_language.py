"""The page in German, and in miles, feet and twelve hours: nothing of it reaches the document."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect

from tests.browser.clipped_text import clipped_texts
from tests.browser.conftest import ARTEFACTS
from tests.browser.pages import OdscenPage, settle
from tests.browser.test_accessibility import AXE
from tools.page import Served

MILE = 1609.344
WINDOWS = ((1440, 900), (1024, 768), (390, 844))


def choose_preferences(page: Page, **wishes: str) -> None:
    """Choose in the window of language and units, by the labels of the language before."""
    page.get_by_role("button", name="Language and units").click()
    form = page.get_by_role("dialog")
    for label, choice in wishes.items():
        form.get_by_label(label.replace("_", " ")).select_option(choice)
    page.keyboard.press("Escape")
    expect(form).to_have_count(0)


def look(page: Page, view: str) -> list[str]:
    """What axe finds, and the texts that are cut off, in windows of three sizes."""
    wrong: list[str] = []
    for width, height in WINDOWS:
        page.set_viewport_size({"width": width, "height": height})
        settle(page)
        folder = ARTEFACTS / "german"
        folder.mkdir(parents=True, exist_ok=True)
        page.screenshot(path=folder / f"{view}-{width}.png")
        page.evaluate(AXE.read_text(encoding="utf-8"))
        found = page.evaluate("async () => (await axe.run()).violations.map((one) => one.id)")
        wrong += [f"{view} at {width} px: {one}" for one in [*found, *clipped_texts(page)]]
    page.set_viewport_size({"width": 1440, "height": 900})
    return wrong


@pytest.mark.slow
def test_a_scenario_is_made_and_run_in_german(
    open_page: Callable[..., OdscenPage], served: Served, sampled: str
) -> None:
    user = open_page(served.url)
    page = user.page
    user.open_catalogue()
    choose_preferences(page, Language="de")
    expect(page.get_by_role("heading", level=1)).to_have_text("Karte wählen")
    assert page.evaluate("document.documentElement.lang") == "de"
    wrong = look(page, "catalogue")

    page.goto(f"/#/edit/{sampled}")
    region = page.get_by_role("region", name="Verkehrsteilnehmer", exact=True)
    region.locator("button[aria-expanded]").first.click()
    before = len(user.document()["actors"])
    page.get_by_role("group", name="Art des zu platzierenden Verkehrsteilnehmers").get_by_role(
        "button", name="Pkw", exact=True
    ).click()
    with page.expect_response(lambda answer: "/edits" in answer.url):
        page.get_by_role("button", name="Nächsten freien Punkt verwenden").click()
    expect(page.get_by_text("Alles gespeichert")).to_be_visible()
    assert len(user.document()["actors"]) == before + 1
    page.keyboard.press("Escape")
    wrong += look(page, "editor")

    page.get_by_role("region", name="Lauf", exact=True).locator(
        "button[aria-expanded]"
    ).first.click()
    page.get_by_role("radiogroup", name="Tempo zu Beginn").get_by_text(
        "So schnell wie möglich", exact=True
    ).click()
    head = page.get_by_role("banner")
    head.get_by_role("button", name="Lauf starten", exact=True).click()
    expect(page.get_by_role("region", name="Ergebnis des Laufs")).to_be_visible(timeout=180_000)
    expect(page.get_by_text("Lauf beendet")).to_be_visible()
    expect(page.get_by_text("Mittlere Reisezeit", exact=True)).to_be_visible()
    wrong += look(page, "result")
    assert "\n".join(wrong) == ""

    # The browser remembers the language.
    page.reload()
    expect(page.get_by_role("tab", name="Ergebnis")).to_be_visible()


@pytest.mark.slow
def test_a_speed_in_miles_and_a_length_in_feet_are_metres_and_seconds_in_the_document(
    open_page: Callable[..., OdscenPage], served: Served, sampled: str
) -> None:
    user = open_page(served.url)
    page = user.page
    user.open_editor(sampled)
    choose_preferences(page, Speeds_in="mph", Lengths_in="ft", Times_of_day_in="12")
    user.wait_for_editor()
    user.step("Road users").click()
    user.names.first.click()
    before = user.document()
    speed = page.get_by_role("textbox", name="Desired speed")
    with user.changing():
        speed.fill("30")
        speed.press("Enter")
    name = before["actors"][0]["id"]
    actor = next(one for one in user.document()["actors"] if one["id"] == name)
    assert actor["speed"] == pytest.approx(30 * MILE / 3600)
    expect(speed).to_have_value("30 mph")
    # What is left as it is stays as it was, to the last digit.
    speed.focus()
    speed.press("Enter")
    speed.blur()
    after = user.document()
    assert next(one for one in after["actors"] if one["id"] == name) == actor
    expect(page.locator(".map-scale")).to_contain_text("ft")

    user.step("Demand").click()
    clock = page.get_by_role("textbox", name="Time of day at the start")
    with user.changing():
        clock.fill("5:15 pm")
        clock.press("Enter")
    assert user.document()["demand"]["clock"] == 17 * 3600 + 15 * 60
    expect(clock).to_have_value("5:15 PM")
