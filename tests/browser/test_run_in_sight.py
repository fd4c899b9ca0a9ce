"""Run and all steps are in sight, from wherever one is; what hinders a run is said."""

from __future__ import annotations

import pytest
from playwright.sync_api import Locator, expect

from tests.browser.pages import OdscenPage
from tests.browser.test_signals import AT_STOP_LINE, LIGHT

HIGH = 900
GROUPS = ("Place", "Traffic", "Control", "Evaluate")


def run_of_head(user: OdscenPage) -> Locator:
    return user.page.get_by_role("banner").get_by_role("button", name="Run", exact=True)


@pytest.mark.slow
def test_all_steps_and_run_are_in_sight_and_one_click_runs(user: OdscenPage, sampled: str) -> None:
    user.page.set_viewport_size({"width": 1440, "height": HIGH})
    user.open_editor(sampled)
    user.step("Traffic lights").click()
    heads = user.page.locator(".step-head")
    expect(heads).to_have_count(13)
    boxes = [head.bounding_box() for head in heads.all()]
    assert all(box is not None and box["y"] + box["height"] <= HIGH for box in boxes)
    for name in GROUPS:
        expect(user.page.get_by_role("group", name=name, exact=True)).to_be_visible()
    run_of_head(user).click()
    user.wait_until_moving()


@pytest.mark.slow
def test_next_leads_from_step_to_step_and_never_past_one(user: OdscenPage, sampled: str) -> None:
    user.open_editor(sampled)
    user.step("Region").click()
    for title in ("Weather and time", "Road users", "Demand", "Public transport"):
        user.page.get_by_role("button", name=f"Next: {title.lower()}").click()
        expect(user.step(title)).to_have_attribute("aria-expanded", "true")


def test_a_click_on_a_signal_in_the_step_of_the_region_keeps_its_junction(
    user: OdscenPage, sampled: str
) -> None:
    user.open_editor(sampled)
    user.step("Region").click()
    before = user.document()["roi"]
    user.map.click(AT_STOP_LINE)
    light = user.page.get_by_role("region", name=LIGHT)
    expect(light).to_be_visible()
    expect(user.step("Traffic lights")).to_have_attribute("aria-expanded", "true")
    assert user.document()["roi"] == before


@pytest.mark.slow
def test_run_says_what_hinders_it(user: OdscenPage) -> None:
    user.open_catalogue()
    user.new_scenario("signal_crossing").click()
    user.wait_for_editor()
    run_of_head(user).click()
    expect(user.page.get_by_text("Choose the region first: click a road")).to_be_visible()
    expect(user.step("Region")).to_have_attribute("aria-expanded", "true")
    with user.changing():
        user.page.get_by_role("button", name="Select whole map").click()
    run_of_head(user).click()
    expect(user.page.get_by_text("There are no road users yet: choose a kind")).to_be_visible()
    expect(user.step("Road users")).to_have_attribute("aria-expanded", "true")
