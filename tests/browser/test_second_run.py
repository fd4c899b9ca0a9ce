"""What is changed after the first run, all by mouse and all by keyboard, and what came of it."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import expect

from tests.browser.pages import OdscenPage
from tests.browser.test_measures import outer_lane
from tests.browser.test_rule_scenes import (
    EGO_LANE,
    HANDS,
    OTHER_LANE,
    Hand,
    Keyboard,
    crossing,
    node_near,
    placed,
)
from tests.browser.test_signals import LIGHT, drag
from tests.signal_case import JUNCTION

__all__ = ["crossing"]
VERDICT = re.compile(r"(Met|Not met): .*, is \d+")
STEP = 2.0
"""Metres from a node to the next."""


def opened(user: OdscenPage, hand: Hand, title: str) -> None:
    heading = user.step(title)
    expect(heading).to_be_visible()
    if heading.get_attribute("aria-expanded") != "true":
        hand.press(heading)


def run(user: OdscenPage, hand: Hand) -> None:
    opened(user, hand, "Run")
    hand.press(user.run)
    user.wait_until_moving()
    hand.choose("Speed", "As fast as possible")
    expect(user.result).to_contain_text("finished", timeout=90_000)


def move(user: OdscenPage, hand: Hand, number: int) -> None:
    """Move a road user one node on."""
    hand.press(user.names.nth(number))
    x, y = user.graph.place(user.document()["actors"][number]["spawn"])
    with user.changing():
        if isinstance(hand, Keyboard):
            user.page.keyboard.press(".")
        else:
            # To choose it in the table moves nothing: from afar a step is less than a drag.
            user.page.mouse.move(*user.map.at(x, y))
            for _ in range(8):
                user.page.mouse.wheel(0, -240)
            user.map.drag((x, y), (x - STEP, y))
    assert user.graph.place(user.document()["actors"][number]["spawn"]) == pytest.approx(
        (x - STEP, y), abs=0.1
    )


def close_a_lane(user: OdscenPage, hand: Hand, lane: str) -> None:
    opened(user, hand, "Measures")
    if isinstance(hand, Keyboard):
        with user.changing():
            hand.write("or type its name", lane)
        return
    hand.press(user.page.get_by_role("button", name="Show the whole map"))
    what = user.page.get_by_role("radiogroup", name="What it is about")
    what.get_by_text("Lane", exact=True).click()
    hand.press(user.page.get_by_role("button", name="Choose it on the map"))
    with user.changing():
        user.map.click(user.graph.place(f"{lane}.5"))


def lengthen_a_green(user: OdscenPage, hand: Hand) -> None:
    opened(user, hand, "Traffic lights")
    hand.press(user.first_light)
    light = user.page.get_by_role("region", name=LIGHT)
    green, cycle = (light.get_by_role("slider", name=n) for n in ("Green of stage 1", "Cycle"))
    before = float((green.get_attribute("aria-valuetext") or "").split()[0])
    span = 1.25 * float((cycle.get_attribute("aria-valuetext") or "").split()[0])
    if isinstance(hand, Keyboard):
        user.tab_to(green)
        with user.changing():
            user.page.keyboard.press("PageUp")
            user.page.keyboard.press("Enter")
    else:
        with user.changing():
            drag(user, green, light.locator(".ring"), 5.0, span=span)
    expect(green).to_have_attribute("aria-valuetext", f"{before + 5:g} s")
    hand.press(light.get_by_role("button", name="Close the traffic light"))


@pytest.mark.slow
@HANDS
def test_after_the_first_run_all_is_changed_run_again_and_compared(
    user: OdscenPage, crossing: str, hand_of: Callable[[OdscenPage], Hand]
) -> None:
    user.open_editor(crossing)
    hand = hand_of(user)
    page = user.page
    ego = node_near(user, EGO_LANE[0] - 12, EGO_LANE[1])
    other = node_near(user, OTHER_LANE[0] - 26, OTHER_LANE[1])
    placed(user, hand, (("Car", ego), ("Van", other)))
    page.keyboard.press("Escape")
    run(user, hand)
    expect(user.result).to_contain_text("This is the first run of this scenario")
    hand.press(user.result.get_by_role("button", name="Back to the editor"))
    user.wait_for_editor()

    opened(user, hand, "Road users")
    for number in (1, 0):
        move(user, hand, number)
    hand.press(page.get_by_role("button", name="Show the whole map"))
    hand.press(page.get_by_role("button", name="Add a waypoint"))
    passed = node_near(user, 100.0, EGO_LANE[1])
    with user.changing():
        hand.point(user.graph.place(passed))
    page.keyboard.press("Escape")
    assert user.document()["actors"][0]["via"] == [passed]

    opened(user, hand, "Rules")
    hand.press(page.get_by_role("button", name="Add a rule"))
    hand.choose("Condition", "Distance travelled")
    hand.choose("Bound", "Above")
    hand.write("Above", "10")
    with user.changing():
        hand.press(page.get_by_role("button", name="Add the rule"))
    lane = outer_lane(user, "r3")
    close_a_lane(user, hand, lane)
    lengthen_a_green(user, hand)
    opened(user, hand, "Criteria")
    with user.changing():
        hand.press(page.get_by_role("button", name="Add the criterion"))

    document = user.document()
    assert [one["then"][0]["cut_in"]["to"] for one in document["rules"]] == ["car-1"]
    assert [(one["kind"], one["places"]) for one in document["measures"]] == [("closure", [lane])]
    assert [one["junction"] for one in document["signals"]["junctions"]] == [JUNCTION]
    assert document["criteria"] == ["collided == 0"]
    run(user, hand)
    expect(user.result).to_contain_text("The scenario was changed in between")
    expect(page.get_by_role("region", name="Criteria")).to_contain_text(VERDICT)
    expect(page.get_by_role("table", name="Compared with the last run")).to_be_visible()
    if isinstance(hand, Keyboard):
        assert user.actions()["pointer"] == 0
