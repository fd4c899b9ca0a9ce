"""Who drives: a behaviour model that is chosen for a run, with an option."""

from __future__ import annotations

import pytest
from playwright.sync_api import expect

from tests.browser.pages import OdscenPage


@pytest.mark.slow
def test_a_model_is_chosen_for_a_run_and_for_the_run_after_it(
    user: OdscenPage, sampled: str
) -> None:
    user.open_editor(sampled)
    user.step("Run").click()
    user.choose("Vehicles and lights controlled by", "Intelligent driver model")
    expect(user.page.get_by_text("with lane changes by MOBIL")).to_be_visible()
    user.page.get_by_text("9 options").click()
    user.page.get_by_label("Time headway, s").fill("2.5")
    user.page.get_by_text("As fast as possible").click()
    user.run.click()
    for number in (1, 2):
        expect(user.result).to_contain_text("Controlled by: Intelligent driver model")
        summary = user.get(f"/runs/{sampled}-{number}")["summary"]
        assert summary["behaviour"] == "idm"
        assert summary["behaviour_options"] == {"headway": 2.5}
        if number == 1:
            with user.page.expect_navigation(url="**/*-2*"):
                user.page.get_by_role("button", name="Run again").click()
            user.control("Stop").click()
