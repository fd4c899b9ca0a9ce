"""Pictures of the two guides: a scene of a domain expert, and before and after of a light."""

from __future__ import annotations

from playwright.sync_api import expect

from tests.browser.test_clicks import Clicks, compare_control, make_story
from tests.browser.test_run_in_sight import run_of_head
from tools.screenshots import scenarios
from tools.screenshots.camera import Studio
from tools.screenshots.run_scenes import PATIENCE, watch_again

WIDE, HIGH = 1200, 860
"""Pixels of a window in which all that is clicked is in sight."""
CROSSING = (100.0, 0.0)
"""Where the scene takes place, metres."""
CROSSES = 14.0
"""Simulated seconds at which the pedestrian is before the ego, which stops."""


def expert(studio: Studio) -> None:
    """A cut-in and a pedestrian: rules, criteria, the verdict, and the view from behind."""
    with studio.visit(width=WIDE, height=HIGH) as camera:
        user, page = camera.user, camera.user.page
        make_story(user, Clicks(user))
        page.get_by_role("button", name="Hide the table").click()
        criteria = page.get_by_role("region", name="Criteria", exact=True)
        with user.changing():  # so that a suggestion is seen again
            criteria.get_by_role("button", name="Remove criterion 2").click()
        criteria.evaluate("one => one.scrollIntoView({block: 'start'})")
        camera.take("guide-criteria", criteria)
        with user.changing():
            user.undo.click()
        user.step("Rules").click()
        camera.look_at(CROSSING, closer=4)
        camera.take("guide-rules")
        run_of_head(user).click()
        user.wait_until_moving()
        user.choose_speed("As fast")
        expect(user.result).to_contain_text("finished", timeout=PATIENCE)
        page.get_by_role("button", name="Hide the time bar").click()
        camera.take("guide-verdict", page.get_by_role("complementary"))
        watch_again(camera)
        page.get_by_label("Moment of the run").fill(str(CROSSES))
        user.choose("View", "3D, following")
        expect(page.locator(".scenery canvas")).to_be_visible()
        page.wait_for_timeout(1500)  # drawn as sharp as can be
        camera.take("guide-following", page.locator(".run-view"))


def engineer(studio: Studio) -> None:
    """A light that is actuated in a copy, and both compared over ten seeds."""
    with studio.visit(width=WIDE, height=HIGH) as camera:
        user, page = camera.user, camera.user.page
        compare_control(user, Clicks(user), scenarios.PEAK)
        said = page.get_by_role("list", name="In a sentence").get_by_role("listitem")
        expect(page.get_by_role("status").first).to_contain_text(
            "all runs completed", timeout=PATIENCE
        )
        expect(said).to_contain_text("Mean delay")
        camera.take("guide-difference")
        user.open_editor(f"{scenarios.PEAK}-copy")
        page.get_by_role("button", name="Hide the table").click()
        user.step("Traffic lights").click()
        camera.take("guide-lights")
        user.choose_in_menu("Compare with")
        dialog = page.get_by_role("dialog")
        expect(dialog).to_be_visible()
        camera.take("guide-compare", dialog)
