"""A map is mended on the page: by mouse and by keyboard, with undo, and built anew."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np
import pytest
from playwright.sync_api import expect

from odscen.base.ids import LaneKey, RoadId
from odscen.maps.store import Workspace
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.objects import is_crosswalk
from odscen.opendrive.parse import parse
from tests.maps.test_map_edits import place

if TYPE_CHECKING:
    from playwright.sync_api import Locator

    from odscen.opendrive.road_model import OpenDrive
    from tests.browser.pages import OdscenPage
    from tools.page import Served

MENDED = "signal_crossing-mended"


def spot(road: str, lane: int, s: float) -> tuple[float, float]:
    at = place(road, lane, s)
    return at["x"], at["y"]


def mended(served: Served) -> OpenDrive:
    return parse(Workspace.open(served.workspace).map(MENDED).read("xodr"))


def bench(user: OdscenPage) -> Locator:
    return user.page.get_by_role("region", name="Mend the map")


def changes(user: OdscenPage) -> Locator:
    return user.page.get_by_role("list", name="Changes").get_by_role("listitem")


@pytest.mark.slow
def test_a_lane_is_widened_a_crosswalk_moved_a_turn_removed_and_all_undone(
    user: OdscenPage, served: Served
) -> None:
    user.open_catalogue()
    user.page.get_by_role("link", name="Mend the map signal_crossing").click()
    side = bench(user)
    user.map.click(spot("1", -2, 70.0))
    expect(side.get_by_label("Lane width, m")).to_have_value("3.25")
    side.get_by_label("Lane width, m").fill("4")
    side.get_by_role("button", name="Change width").click()
    # Its scenarios keep the map: a copy is mended.
    expect(user.page).to_have_url(re.compile(f"#/mend/{MENDED}"))
    expect(changes(user)).to_have_text([re.compile("^Lane width 4(.00)? m$")])
    model = mended(served)
    table = RoadTable.of(model)
    row = np.array([table.lane_index[LaneKey(RoadId("1"), 0, -2)]])
    assert table.lane_width(row, np.array([70.0]))[0] == pytest.approx(4.0)

    (walk,) = [o for o in model.roads[RoadId("3")].objects if is_crosswalk(o)]
    user.map.click(spot("3", -1, walk.s))
    side.get_by_role("button", name="Remove crosswalk").click()
    expect(changes(user)).to_have_count(2)
    user.map.click(spot("3", -1, 90.0))
    side.get_by_role("button", name="Add crosswalk").click()
    expect(changes(user)).to_have_count(3)
    side.get_by_label("Speed limit, km/h").fill("30")
    side.get_by_role("button", name="Change limit").click()
    expect(changes(user)).to_have_count(4)
    model = mended(served)
    (walk,) = [o for o in model.roads[RoadId("3")].objects if is_crosswalk(o)]
    assert walk.s == pytest.approx(90.0, abs=0.5)
    assert model.roads[RoadId("3")].sections[0].lanes[-1].speeds[0].max == pytest.approx(30 / 3.6)

    user.map.click(spot("1", -2, 100.0))
    side.get_by_role("button", name="Remove turn").click()
    user.map.click(spot("2", 1, 110.0))
    expect(changes(user)).to_have_count(5)
    expect(side.get_by_text("Does not fit")).to_have_count(0)
    (picture,) = [user.page.screenshot(path="build/browser/mending.png")]
    assert picture
    undo, redo = (side.get_by_role("button", name=word) for word in ("Undo", "Redo"))
    undo.click()
    expect(changes(user)).to_have_count(4)
    redo.click()
    expect(changes(user)).to_have_count(5)
    for left in range(4, 0, -1):
        undo.click()
        expect(changes(user)).to_have_count(left)
    undo.click()
    expect(changes(user)).to_have_count(0)
    original = Workspace.open(served.workspace).map("signal_crossing").read("xodr")
    assert Workspace.open(served.workspace).map(MENDED).read("xodr") == original


@pytest.mark.slow
def test_a_crosswalk_is_removed_by_keyboard_and_what_does_not_fit_is_said(
    user: OdscenPage,
) -> None:
    user.page.goto("/#/mend/signal_crossing")
    side = bench(user)
    expect(user.map.area).to_be_visible()
    user.map.area.focus()
    user.map.steer(spot("4", -1, 121.0))
    user.page.keyboard.press("Enter")
    remove = side.get_by_role("button", name="Remove crosswalk")
    user.tab_to(remove, back=True)
    user.page.keyboard.press("Enter")
    expect(changes(user)).to_have_text(["Crosswalk removed"])
    user.map.area.focus()
    user.page.keyboard.press("Control+z")
    expect(changes(user)).to_have_count(0)
