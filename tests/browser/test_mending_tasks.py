"""The tasks of mending a map on the page, by mouse and by keyboard alone."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pytest
from playwright.sync_api import expect

from odscen.base.ids import RoadId
from odscen.maps.map_edits import check_edits, mend_map
from odscen.maps.shipped import shipped_maps
from odscen.maps.store import Workspace
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.objects import is_crosswalk, is_stop_line
from odscen.opendrive.parse import parse
from tests.browser.test_mending import bench, changes
from tests.maps.test_map_edits import BEFORE, CROSSING, place

if TYPE_CHECKING:
    from playwright.sync_api import Locator

    from odscen.opendrive.road_model import OpenDrive
    from tests.browser.pages import OdscenPage
    from tools.page import Served

Spot = tuple[float, float]


class Task(NamedTuple):
    """What is done at a place, and what the list of changes says then."""

    at: Spot
    button: str
    words: str
    to: Spot | None = None


def spot(road: str, lane: int, s: float, at: float = 0.5) -> Spot:
    found = place(road, lane, s, at)
    return found["x"], found["y"]


def spot_beside(road: str, lane: int, s: float, left: float) -> Spot:
    found = place(road, lane, s)
    return found["x"] - left * np.sin(found["hdg"]), found["y"] + left * np.cos(found["hdg"])


(LINE,) = [o for o in BEFORE.roads[RoadId("3")].objects if is_stop_line(o)]
(WALK,) = [o for o in BEFORE.roads[RoadId("4")].objects if is_crosswalk(o)]
TASKS = (
    Task(spot("1", -1, 60, 0.95), "Bend lane border …", "Lane border bent", spot("1", -1, 60, 0.7)),
    Task(spot("2", -1, 60), "Bend road …", "Road bent", spot_beside("2", -1, 60, 2.0)),
    Task(
        spot("4", -1, 128),
        "Move end of road …",
        "End of a road moved",
        spot_beside("4", -1, 128, 1.5),
    ),
    Task(spot("3", -1, LINE.s), "Move stop line …", "Stop line moved", spot("3", -1, LINE.s - 4)),
    Task(spot("4", -1, WALK.s), "Remove crosswalk", "Crosswalk removed"),
    Task(spot("2", -1, 90), "Add island", "Island added"),
    Task(spot("3", -1, 90), "Add traffic light", "Traffic light added"),
    Task(spot("1", -2, 100), "Remove turn …", "Turn removed", spot("3", 1, 110)),
)


class Hand:
    """Does tasks by mouse."""

    def __init__(self, user: OdscenPage) -> None:
        self.user = user

    def choose(self, at: Spot) -> None:
        self.user.map.click(at)

    def press(self, button: Locator) -> None:
        button.click()

    def do(self, task: Task, number: int) -> None:
        side = bench(self.user)
        self.choose(task.at)
        self.press(side.get_by_role("button", name=task.button, exact=True))
        if task.to:
            expect(side.get_by_role("button", name="Cancel")).to_be_visible()
            self.choose(task.to)
        expect(changes(self.user)).to_have_count(number)
        expect(changes(self.user).last).to_have_text(task.words)
        expect(side.get_by_text("The map is being built anew")).to_have_count(0)


class Keys(Hand):
    """Does tasks by keyboard."""

    def choose(self, at: Spot) -> None:
        self.user.map.area.focus()
        # An arrow key moves the map by 12 pixels.
        for _ in range(20):
            if self.user.map.view()[2] > 16.0:
                break
            self.user.page.keyboard.press("+")
        self.user.map.steer(at)
        self.user.page.keyboard.press("Enter")

    def press(self, button: Locator) -> None:
        self.user.map.area.focus()
        self.user.tab_to(button, back=True)
        self.user.page.keyboard.press("Enter")


def check_road_shapes(model: OpenDrive) -> None:
    """The border, the bend and the end are where the second places were, within a pixel."""
    table = RoadTable.of(model)
    row = np.array([table.lane_index[k] for k in table.lane_keys if (k.road, k.lane) == ("1", -1)])
    assert table.lane_width(row, np.array([60.0]))[0] == pytest.approx(0.7 * 3.25, abs=0.35)
    for road, most in (("2", 0.3), ("4", 0.1)):
        gained = model.roads[RoadId(road)].length - BEFORE.roads[RoadId(road)].length
        assert 0.0 < gained < most
    (line,) = [o for o in model.roads[RoadId("3")].objects if is_stop_line(o)]
    assert line.s == pytest.approx(LINE.s - 4, abs=0.5)


def mended(served: Served, name: str) -> OpenDrive:
    return parse(Workspace.open(served.workspace).map(name).read("xodr"))


@pytest.mark.slow
@pytest.mark.parametrize("by", [Hand, Keys])
def test_a_map_is_bent_moved_and_furnished_and_a_newer_file_has_it_again(
    by: type[Hand], user: OdscenPage, served: Served
) -> None:
    name = f"crossing-{by.__name__.lower()}"
    workspace = Workspace.open(served.workspace)
    workspace.add_map_content(CROSSING, file="crossing.xodr", name=name)
    user.page.goto(f"/#/mend/{name}")
    hand, side = by(user), bench(user)
    expect(user.map.area).to_be_visible()
    for number, task in enumerate(TASKS, 1):
        hand.do(task, number)
    # Signs, like uses and marks, are chosen from lists.
    hand.choose(spot("1", 1, 40))
    sign = side.get_by_role("textbox", name="Add sign")
    if by is Keys:
        user.map.area.focus()
        user.tab_to(sign, back=True)
        for key in ("ArrowDown", "ArrowDown", "Enter"):
            user.page.keyboard.press(key)
    else:
        sign.click()
        user.page.get_by_role("option", name="Stop").click()
    expect(changes(user)).to_have_count(len(TASKS) + 1)
    expect(changes(user).last).to_have_text("Sign added: Stop")
    expect(side.get_by_text("Does not fit")).to_have_count(0)
    user.page.screenshot(path=f"build/browser/mending-{by.__name__.lower()}.png")
    copy = f"{name}-mended"
    check_road_shapes(mended(served, copy))

    # Each is undone, and done again.
    undo, redo = (side.get_by_role("button", name=word, exact=True) for word in ("Undo", "Redo"))
    hand.press(undo)
    expect(changes(user)).to_have_count(len(TASKS))
    hand.press(redo)
    expect(changes(user)).to_have_count(len(TASKS) + 1)

    # A newer file of the place, without one crosswalk: all fits but its removal.
    gone = {"kind": "remove_crosswalk", "at": place("4", -1, WALK.s)}
    newer = mend_map(CROSSING, check_edits([gone])).xodr
    expect(side.get_by_text("The map is being built anew")).to_have_count(0)
    file = {"name": "newer.xodr", "mimeType": "text/xml", "buffer": newer}
    with user.page.expect_file_chooser() as chooser:
        hand.press(side.get_by_role("button", name="Choose a newer file"))
    chooser.value.set_files([file])  # type: ignore[list-item]
    expect(side.get_by_text("Does not fit: there is no crosswalk")).to_be_visible()
    expect(changes(user)).to_have_count(len(TASKS) + 1)
    entry = Workspace.open(served.workspace).map(copy)
    assert entry.info["source"] == "newer.xodr"
    fates = [row["fate"] for row in entry.edit_rows()]
    assert (fates.count("repaired"), fates.count("lost")) == (len(TASKS), 1)
    check_road_shapes(parse(entry.read("xodr")))
    assert len(json.loads(entry.importing.edits or "")["edits"]) == len(TASKS) + 1


@pytest.mark.slow
@pytest.mark.parametrize("by", [Hand, Keys])
def test_junctions_are_joined_and_what_does_not_fit_is_said_before_anything_is_built(
    by: type[Hand], user: OdscenPage, served: Served
) -> None:
    name = f"signs-{by.__name__.lower()}"
    file = next(path for path in shipped_maps() if path.stem == "t_junction_signs")
    workspace = Workspace.open(served.workspace)
    if name not in workspace.map_names():
        workspace.add_map(file, name=name)
    model = mended(served, name)
    table = RoadTable.of(model)
    (between,) = [
        road
        for road in model.roads.values()
        if road.predecessor and road.successor
        and road.predecessor.element_type == road.successor.element_type == "junction"
    ]  # fmt: skip
    row = np.full(3, table.road_index[between.id])
    s = np.array([1.0, between.length / 2, between.length - 1.0])
    x, y, _ = table.points(row, s, np.full(3, -1.0))
    first, middle, second = ((float(a), float(b)) for a, b in zip(x, y, strict=True))
    user.page.goto(f"/#/mend/{name}")
    hand, side = by(user), bench(user)
    expect(user.map.area).to_be_visible()
    hand.choose(first)
    join = side.get_by_role("button", name="Join junctions …")
    hand.press(join)
    hand.choose(middle)
    expect(user.page.get_by_text("there is no junction within 25 m")).to_be_visible()
    expect(changes(user)).to_have_count(0)
    hand.press(join)
    hand.choose(second)
    expect(changes(user)).to_have_text(["Junctions joined"])
    joined = mended(served, f"{name}-mended")
    assert len(joined.junctions) == len(model.junctions) - 1
    assert between.id not in joined.roads
    hand.press(side.get_by_role("button", name="Undo", exact=True))
    expect(changes(user)).to_have_count(0)
    assert len(mended(served, f"{name}-mended").junctions) == len(model.junctions)


@pytest.mark.slow
def test_a_lane_is_widened_and_limited_by_keyboard(user: OdscenPage, served: Served) -> None:
    name = "crossing-widened"
    workspace = Workspace.open(served.workspace)
    workspace.add_map_content(CROSSING, file="crossing.xodr", name=name)
    user.page.goto(f"/#/mend/{name}")
    expect(user.map.area).to_be_visible()
    hand, side = Keys(user), bench(user)
    for number, (field, typed, button) in enumerate(
        (("Lane width, m", "4", "Change width"), ("Speed limit, km/h", "30", "Change limit")), 1
    ):
        hand.choose(spot("2", -2, 70.0))
        user.map.area.focus()
        user.tab_to(side.get_by_label(field), back=True)
        user.page.keyboard.press("Control+a")
        user.page.keyboard.type(typed)
        hand.press(side.get_by_role("button", name=button))
        expect(changes(user)).to_have_count(number)
        expect(side.get_by_text("The map is being built anew")).to_have_count(0)
    assert user.actions()["pointer"] == 0
    model = mended(served, f"{name}-mended")
    table = RoadTable.of(model)
    row = np.array([table.lane_index[k] for k in table.lane_keys if (k.road, k.lane) == ("2", -2)])
    assert table.lane_width(row, np.array([70.0]))[0] == pytest.approx(4.0)
    assert model.roads[RoadId("2")].sections[0].lanes[-2].speeds[0].max == pytest.approx(30 / 3.6)
