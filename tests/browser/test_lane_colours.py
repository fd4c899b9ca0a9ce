"""Lanes of a finished run in colours: chosen, read, narrowed in time and taken away."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lxml import etree
from playwright.sync_api import expect

from tests.browser.pages import OdscenPage
from tests.browser.test_accessibility import Inspector
from tests.browser.test_sharing import SVG, taken
from tools.page import Served

PIXEL = """(canvas, [x, y]) => {
    const box = canvas.getBoundingClientRect();
    const k = canvas.width / box.width;
    const at = [Math.round((x - box.left) * k), Math.round((y - box.top) * k), 1, 1];
    return [...canvas.getContext("2d").getImageData(...at).data];
}"""
ROOM = 3.0
"""Metres from the middle of a lane to where no other one is drawn."""
CHOICE = "Colour the lanes by"


@pytest.fixture
def run(user: OdscenPage, sampled: str) -> str:
    answer = user.page.request.post("/api/runs", data={"scenario": sampled, "speed": None})
    name: str = answer.json()["run"]
    while user.get(f"/runs/{name}")["state"] != "completed":
        user.page.wait_for_timeout(300)
    return name


def seen(user: OdscenPage, point: tuple[float, float]) -> list[int]:
    """Red, green, blue and alpha of what is drawn between the map and its road users."""
    canvas = user.page.locator('canvas[data-layer="scene"]')
    found: list[int] = canvas.evaluate(PIXEL, list(user.map.at(*point)))
    return found


def node(columns: dict[str, Any], index: int) -> tuple[float, float]:
    return columns["x"][index], columns["y"][index]


def used(user: OdscenPage, run: str) -> tuple[int, float]:
    """A node in the middle of the longest stretch with traffic, and the delay there, s/km."""
    lanes = user.get(f"/runs/{run}/lanes")
    stretches = zip(lanes["node_end"], lanes["node_first"], lanes["node_lane"], strict=True)
    end, first, lane = max(stretches, key=lambda one: (one[0] - one[1], one))
    rows = [k for k, row in enumerate(lanes["lane"]) if row == lane]
    lost, driven = (sum(lanes[name][k] for k in rows) for name in ("time_loss", "distance"))
    return (first + end) // 2, lost / driven * 1000


def unused(user: OdscenPage, run: str, columns: dict[str, Any]) -> int:
    """A node that nobody drove on, the one farthest from all others."""
    lanes = user.get(f"/runs/{run}/lanes")
    points = np.column_stack((columns["x"], columns["y"]))
    driven = np.zeros(len(points), dtype=bool)
    for first, end in zip(lanes["node_first"], lanes["node_end"], strict=True):
        driven[first:end] = True
    away = np.linalg.norm(points[:, None] - points[driven], axis=2).min(axis=1)
    assert away.max() > ROOM, "vehicles were on all lanes"
    return int(np.argmax(away))


@pytest.mark.slow
def test_lanes_have_the_colours_of_their_delay_and_say_it(
    user: OdscenPage, sampled: str, run: str, tmp_path: Path
) -> None:
    user.page.goto(f"/#/run/{sampled}/{run}")
    columns = user.get(f"/maps/{user.document()['map']['name']}/graph")
    (index, delay), nobody = used(user, run), unused(user, run, columns)
    place = node(columns, index)
    expect(user.page.get_by_role("textbox", name=CHOICE)).to_be_visible()
    assert seen(user, place)[3] == 0
    user.choose(CHOICE, "Delay per km")
    legend = user.page.get_by_role("list", name="What is shown")
    expect(legend).to_contain_text("Lanes: Delay per km")
    expect(legend.get_by_text(re.compile(r"s/km and more$"))).to_be_visible()
    colours = legend.locator("i").evaluate_all(
        "all => all.map(one => getComputedStyle(one).backgroundColor)"
    )
    drawn = seen(user, place)
    assert "rgb({}, {}, {})".format(*drawn[:3]) in colours
    assert seen(user, node(columns, nobody))[3] == 0
    inspector = Inspector(user, "light")
    inspector.look("run-lanes")
    assert not inspector.wrong.views, str(inspector.wrong)
    user.map.area.focus()
    user.map.steer(place)
    for _ in range(6):  # until a press of an arrow key is less than a lane
        user.page.keyboard.press("+")
    user.map.steer(place)
    key = columns["lane_keys"][columns["lane"][index]]
    expect(user.page.get_by_text(f"Lane {key}: {delay:.1f} s/km")).to_be_visible()
    drawing = taken(user, tmp_path, "Share", "Drawing of the map (SVG)")
    tree = etree.parse(drawing)
    assert "Lanes: Delay per km" in [one.text for one in tree.iter(f"{SVG}text")]
    fills = {str(one.get("fill")) for one in tree.iter(f"{SVG}path")}
    red, green, blue = drawn[:3]
    assert f"#{red:02x}{green:02x}{blue:02x}" in fills


@pytest.mark.slow
def test_a_part_of_the_run_is_chosen_by_keys_in_a_narrow_window(
    open_page: Callable[..., OdscenPage], served: Served, sampled: str, run: str
) -> None:
    user = open_page(served.url, viewport={"width": 390, "height": 844}, color_scheme="dark")
    user.page.goto(f"/#/run/{sampled}/{run}")
    user.choose(CHOICE, "Flow")
    expect(user.page.get_by_text("Whole run")).to_be_visible()
    end = user.page.get_by_role("slider", name="End of what colours of lanes show")
    times = user.get(f"/runs/{run}/lanes")["times"]
    user.tab_to(end)
    end.press("ArrowLeft")
    expect(end).to_have_attribute("aria-valuenow", str(len(times) - 2))
    expect(user.page.get_by_text("Whole run")).to_have_count(0)
    expect(user.page.get_by_role("list", name="What is shown")).to_contain_text("veh/h")
    inspector = Inspector(user, "dark")
    inspector.look("run-lanes")
    assert not inspector.wrong.views, str(inspector.wrong)
