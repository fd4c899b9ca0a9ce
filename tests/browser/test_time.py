"""The time bar: departures moved by mouse and keys, what is planned, and events of a run."""

from __future__ import annotations

import pytest
from playwright.sync_api import Locator, expect

from tests.browser.pages import OdscenPage


@pytest.fixture
def timed(user: OdscenPage, sampled: str) -> OdscenPage:
    """The editor with the time bar of a sampled scenario, once its plan is there."""
    user.open_editor(sampled)
    user.open_time_bar()
    return user


def departure(user: OdscenPage, name: str) -> Locator:
    return user.time_bar.get_by_role("slider", name=f"Departure of {name}", exact=True)


def departs(user: OdscenPage, row: int = 0) -> float:
    return float(user.document()["actors"][row]["depart"])


@pytest.mark.slow
def test_a_departure_is_dragged_and_moved_by_keys_and_undo_brings_it_back(
    timed: OdscenPage,
) -> None:
    before = timed.document()
    name = before["actors"][0]["id"]
    assert departs(timed) == 0.0
    view = timed.map.area.get_attribute("data-view")
    block = departure(timed, name)
    box = block.bounding_box()
    assert box is not None
    mouse = timed.page.mouse
    mouse.move(box["x"] + 8, box["y"] + 8)
    with timed.changing():
        mouse.down()
        mouse.move(box["x"] + 108, box["y"] + 8, steps=6)
        mouse.up()
    dragged = departs(timed)
    assert dragged > 2.0
    moved = block.bounding_box()
    assert moved is not None
    assert moved["x"] - box["x"] == pytest.approx(100, abs=6)
    # Some keys in a row are one change.
    block.focus()
    with timed.changing():
        for keys in ("ArrowRight", "ArrowRight", "Shift+ArrowRight", "Alt+ArrowLeft"):
            timed.page.keyboard.press(keys)
    assert departs(timed) == pytest.approx(dragged + 11.9)
    assert timed.document()["actors"][1:] == before["actors"][1:]
    with timed.changing():
        timed.undo.click()
    assert departs(timed) == dragged
    with timed.changing():
        timed.undo.click()
    assert timed.document() == before
    assert timed.map.area.get_attribute("data-view") == view


@pytest.mark.slow
def test_the_plan_is_shown_at_a_moment_before_any_run_and_says_that_it_is_one(
    timed: OdscenPage,
) -> None:
    page = timed.page
    moment = timed.time_bar.get_by_role("slider", name="Planned moment")
    plan = timed.get(f"/scenarios/{timed.scenario}/plan")
    there = [
        sum(
            plan["time"][plan["first"][n]] <= at <= plan["time"][plan["first"][n + 1] - 1]
            for n in range(len(plan["users"]))
        )
        for at in (0, 10)
    ]
    assert there[0] > there[1] > 0
    moment.focus()
    page.keyboard.press("PageUp")
    expect(moment).to_have_attribute("aria-valuenow", "10")
    said = f"Planned, not simulated: {there[1]} road user"
    expect(page.get_by_text(said)).to_be_visible()
    expect(page.get_by_text("each alone on the road")).to_be_visible()
    page.get_by_role("button", name="Back to the starts").click()
    expect(page.get_by_text("each alone on the road")).to_have_count(0)


@pytest.mark.slow
def test_the_bar_of_a_replay_jumps_to_the_instants_of_its_events(
    user: OdscenPage, sampled: str
) -> None:
    user.open_editor(sampled)
    first = user.document()["actors"][0]["id"]
    rule = {
        "id": "halts",
        "actor": first,
        "when": {"time": {"after": 4}},
        "then": [{"brake": {"by": 3, "hold": 1}}],
    }
    version = user.get(f"/scenarios/{sampled}")["version"]
    wishes = [{"kind": "set_rule", "rule": rule}, {"kind": "set_simulation", "duration": 20}]
    changed = user.page.request.post(
        f"/api/scenarios/{sampled}/edits",
        data={"version": version, "edits": wishes, "label": "rule"},
    )
    assert changed.ok, changed.text()
    user.page.reload()
    user.wait_for_editor()
    user.open_time_bar()
    waits = user.time_bar.get_by_role("slider", name="Time of rule halts")
    waits.focus()
    with user.changing():
        user.page.keyboard.press("ArrowRight")
    assert user.document()["rules"][0]["when"]["time"]["after"] == 5
    user.step("Run").click()
    user.choose_pace("As fast as possible")
    user.run.click()
    expect(user.result).to_contain_text("finished", timeout=90_000)
    user.page.get_by_role("button", name="Watch again").click()
    slider = user.page.get_by_label("Moment of the run")
    expect(slider).to_be_visible()
    bar = user.time_bar
    bar.get_by_role("button", name="Next event").click()
    expect(bar.get_by_role("status")).to_contain_text("0:05.0")
    expect(bar.get_by_role("status")).to_contain_text("triggered rule halts")
    assert float(slider.input_value()) == pytest.approx(5.0, abs=0.3)
    expect(bar.get_by_text("Light 10001")).to_be_visible()
    axis = bar.locator(".time-axis").bounding_box()
    assert axis is not None
    user.page.mouse.click(axis["x"] + axis["width"] / 2, axis["y"] + 12)
    assert float(slider.input_value()) == pytest.approx(10.0, abs=0.5)
