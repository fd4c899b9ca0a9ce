"""Criteria in the page: as sentences, by mouse and by keyboard."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import expect

from odscen.app.scenarios import SUFFIX
from odscen.maps.store import Workspace
from odscen.scenario import edits
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.document.scenario_document import Scenario
from tests.browser.pages import OdscenPage
from tests.browser.test_keyboard import press
from tests.browser.test_measures import card, crossing, opened
from tools.page import Served

__all__ = ["crossing"]


@pytest.mark.slow
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


@pytest.mark.slow
def test_a_criterion_is_added_with_the_keyboard_alone(user: OdscenPage, crossing: str) -> None:
    user.open_editor(crossing)
    press(user, user.step("Criteria"))
    user.tab_to(user.page.get_by_label("Number"))
    user.page.keyboard.press("Control+A")
    user.page.keyboard.type("2")
    with user.changing():
        press(user, user.page.get_by_role("button", name="Add the criterion"))
    assert user.document()["criteria"] == ["collided == 2"]


@pytest.mark.slow
def test_a_finished_run_says_which_criteria_it_met_and_with_what_value(
    user: OdscenPage, served: Served, sampled: str
) -> None:
    path = Workspace.open(served.workspace).scenarios / f"{sampled}{SUFFIX}"
    document = loads(path.read_text(encoding="utf-8"))
    assert isinstance(document, Scenario)
    named = document.actors[0].id
    asked = ["collided == 0", "mean_delay >= 1000 s", f"max_speed({named}) <= 0.5 m/s"]
    path.write_text(dumps(edits.set_criteria(document, criteria=asked)), encoding="utf-8")
    user.open_editor(sampled)
    user.step("Run").click()
    user.run.click()
    user.wait_until_moving()
    user.choose_speed("As fast")
    expect(user.result).to_contain_text("finished")
    judged = user.page.get_by_role("region", name="Criteria").filter(has_text="criteria not met")
    expect(judged).to_contain_text("2 of 3 criteria not met")
    rows = judged.get_by_role("listitem")
    run = user.page.url.partition("?")[0].rsplit("/", 1)[1]
    delay = user.get(f"/runs/{run}")["summary"]["figures"]["mean_delay"]
    expect(rows.nth(0)).to_contain_text("Met: In collisions: exactly 0, is 0")
    expect(rows.nth(1)).to_contain_text("Not met: Mean delay: at least 1000 s, is ")
    shown = re.search(r", is ([\d.]+) s", rows.nth(1).inner_text())
    assert shown
    assert float(shown[1]) == pytest.approx(delay, abs=0.006)
    expect(rows.nth(2)).to_contain_text(re.compile(rf"^Not met: .*{named}"))
