"""One run in two views: each has its place, its colours and whom it follows; the rest is shared."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest
from lxml import etree
from playwright.sync_api import Locator, expect

from tests.browser.pages import MapView, OdscenPage
from tests.browser.test_accessibility import Inspector
from tests.browser.test_running import stand_still, start
from tests.browser.test_sharing import SVG

MOMENT = 40
"""Seconds of the run at which its recording is looked at."""
NEAR = 0.1
"""Metres by which the middle of a view may differ from the road user that it follows."""
NARROW = {"width": 390, "height": 844}


@pytest.fixture
def run(user: OdscenPage, sampled: str) -> str:
    answer = user.page.request.post("/api/runs", data={"scenario": sampled, "speed": None})
    name: str = answer.json()["run"]
    while user.get(f"/runs/{name}")["state"] != "completed":
        user.page.wait_for_timeout(300)
    return name


def open_recording(user: OdscenPage, scenario: str, run: str) -> None:
    user.page.goto(f"/#/run/{scenario}/{run}?time={MOMENT}")
    expect(user.page.get_by_label("Moment of the run")).to_have_value(str(MOMENT))


def view(user: OdscenPage, number: int) -> Locator:
    return user.page.get_by_role("group", name=f"View {number} of 2", exact=True)


def map_of(user: OdscenPage, number: int) -> MapView:
    """The map of one of two views."""
    found = MapView(user.page)
    found.area = view(user, number).get_by_role("application")
    return found


def follow(user: OdscenPage, name: str) -> None:
    """Choose from the list beside the maps."""
    user.page.get_by_role("tab", name="Road users").click()
    listed = user.page.get_by_role("list", name="Follow a road user")
    listed.get_by_role("button", name=re.compile(rf"^{name} ")).click()


def places(user: OdscenPage, run: str, moment: float) -> dict[str, tuple[float, float]]:
    """Where cars are at a recorded moment, metres."""
    columns = user.get(f"/runs/{run}/trajectories")
    row = int(np.argmin(np.abs(np.asarray(columns["times"]) - moment)))
    assert columns["times"][row] == pytest.approx(moment)
    return {
        columns["actors"][columns["actor"][k]]["id"]: (columns["x"][k], columns["y"][k])
        for k in range(columns["first"][row], columns["first"][row + 1])
        if columns["actors"][columns["actor"][k]]["category"] == "car"
    }


def two_apart(cars: dict[str, tuple[float, float]]) -> tuple[str, str]:
    """Two cars, far from each other."""
    names = sorted(cars)
    return max(
        ((a, b) for a in names for b in names),
        key=lambda pair: np.hypot(*np.subtract(cars[pair[0]], cars[pair[1]])),
    )


def shown(user: OdscenPage, number: int) -> tuple[float, float, float]:
    return map_of(user, number).view()


@pytest.mark.slow
def test_a_second_view_has_its_own_place_colours_and_road_user_and_a_reload_keeps_them(
    user: OdscenPage, sampled: str, run: str
) -> None:
    asked: Counter[str] = Counter()
    user.page.on("request", lambda request: asked.update([urlsplit(request.url).path]))
    open_recording(user, sampled, run)
    cars = places(user, run, MOMENT)
    one, other = two_apart(cars)
    follow(user, one)
    user.page.get_by_role("button", name="Add a view").click()
    expect(map_of(user, 2).area).to_have_accessible_name(re.compile("view 2 of 2", re.IGNORECASE))
    assert shown(user, 1)[:2] == pytest.approx(cars[one], abs=NEAR)
    assert shown(user, 2) == pytest.approx(shown(user, 1), abs=NEAR)

    # The view that was opened is the one in use.
    follow(user, other)
    scale = shown(user, 1)[2]
    map_of(user, 2).area.hover()
    user.page.mouse.wheel(0, -400)
    assert shown(user, 1) == pytest.approx((*cars[one], scale), abs=NEAR)
    assert shown(user, 2)[:2] == pytest.approx(cars[other], abs=NEAR)
    assert shown(user, 2)[2] > scale + 1
    view(user, 2).get_by_role("textbox", name="Colour by").click()
    user.page.get_by_role("option", name="Speed", exact=True).click()
    plain, speeds = (view(user, n).get_by_role("list", name="What is shown") for n in (1, 2))
    expect(speeds).to_contain_text("60 km/h and more")
    expect(plain).to_contain_text("Car")
    expect(plain).not_to_contain_text("km/h")
    for name, number in ((one, 1), (other, 2)):
        expect(view(user, number).get_by_role("figure")).to_contain_text(f"Speed of {name}: ")
    once = [
        path for path in asked if path.endswith(("/trajectories", "/drawing", "/graph", "/lights"))
    ]
    assert len(once) >= 3
    assert {path: asked[path] for path in once} == dict.fromkeys(once, 1)

    view(user, 2).get_by_role("textbox", name="Colour the lanes by").click()
    user.page.get_by_role("option", name="Flow", exact=True).click()
    expect(speeds).to_contain_text("Lanes: Flow")
    before = shown(user, 1), shown(user, 2)
    user.page.wait_for_function("() => /chosen2=.*by2=speed&lanes2=flow/.test(location.hash)")
    user.page.reload()
    expect(speeds).to_contain_text("60 km/h and more")
    expect(speeds).to_contain_text("Lanes: Flow")
    expect(plain).not_to_contain_text("Lanes")
    for name, number in ((one, 1), (other, 2)):
        expect(view(user, number).get_by_role("figure")).to_contain_text(f"Speed of {name}: ")
        assert shown(user, number) == pytest.approx(before[number - 1], abs=NEAR)

    # Time is shared.
    user.page.get_by_label("Moment of the run").fill(str(MOMENT + 1))
    later = places(user, run, MOMENT + 1)
    for name, number in ((one, 1), (other, 2)):
        if name in later:
            assert shown(user, number)[:2] == pytest.approx(later[name], abs=NEAR)


@pytest.mark.slow
def test_pictures_and_what_stands_beside_the_maps_act_on_the_view_that_was_used_last(
    user: OdscenPage, sampled: str, run: str, tmp_path: Path
) -> None:
    open_recording(user, sampled, run)
    user.page.get_by_role("button", name="Add a view").click()
    view(user, 2).get_by_role("textbox", name="Colour by").click()
    user.page.get_by_role("option", name="Stopped delay", exact=True).click()
    words = []
    for number in (1, 2):
        menu = view(user, number).get_by_role("button", name="Share")
        menu.click()
        with user.page.expect_download() as download:
            user.page.get_by_role("menuitem", name="Drawing of the map (SVG)").click()
        path = tmp_path / f"{number}.svg"
        download.value.save_as(path)
        words.append({one.text for one in etree.parse(path).iter(f"{SVG}text")})
    assert "Car" in words[0] - words[1]
    assert "Not stopped yet" in words[1] - words[0]

    view(user, 2).get_by_role("textbox", name="Colour by").click()
    user.page.get_by_role("option", name="Light ahead", exact=True).click()
    lights = view(user, 2).get_by_role("list", name="What is shown")
    expect(lights).to_contain_text("No light ahead")
    expect(lights).to_contain_text("May go, gives way")

    map_of(user, 1).area.focus()
    expect(view(user, 1)).to_have_attribute("aria-current", "true")
    still = shown(user, 2)
    cars = places(user, run, MOMENT)
    one = min(cars)
    follow(user, one)
    expect(user.page.get_by_text("View 1 of 2 was used last")).to_be_visible()
    assert shown(user, 1)[:2] == pytest.approx(cars[one], abs=NEAR)
    assert shown(user, 2) == still


@pytest.mark.slow
def test_views_are_opened_used_and_closed_by_keys(user: OdscenPage, sampled: str, run: str) -> None:
    open_recording(user, sampled, run)
    user.tab_to(user.page.get_by_role("button", name="Add a view"))
    user.page.keyboard.press("Enter")
    expect(map_of(user, 2).area).to_be_focused()
    before = shown(user, 1)
    user.page.keyboard.press("+")
    user.page.keyboard.press("ArrowUp")
    assert shown(user, 1) == before
    moved = shown(user, 2)
    assert moved[2] > before[2]
    assert moved[1] > before[1]
    expect(user.page.get_by_role("button", name="Add a view")).to_have_count(0)
    close = user.page.get_by_role("button", name="Close this view: View 1 of 2")
    user.tab_to(close, back=True)
    user.page.keyboard.press("Enter")
    expect(user.map.area).to_have_count(1)
    expect(user.map.area).to_be_focused()
    assert user.map.view() == moved
    user.page.wait_for_function("() => !location.hash.includes('at2')")
    user.page.reload()
    expect(user.map.area).to_have_count(1)
    assert user.map.view() == pytest.approx(moved, abs=0.01)


@pytest.mark.slow
def test_a_live_run_is_followed_in_both_views_over_one_connection(
    user: OdscenPage, sampled: str
) -> None:
    sockets: list[str] = []
    user.page.on("websocket", lambda socket: sockets.append(socket.url))
    start(user, sampled)
    stand_still(user)
    user.page.get_by_role("button", name="Add a view").click()
    user.page.get_by_role("tab", name="Road users").click()
    rows = user.page.get_by_role("list", name="Follow a road user").get_by_role("button")
    expect(rows.nth(1)).to_be_visible()
    names = [rows.nth(k).inner_text().split()[0] for k in (0, 1)]
    follow(user, names[1])
    map_of(user, 1).area.focus()
    follow(user, names[0])
    before = shown(user, 1), shown(user, 2)
    assert before[0][:2] != pytest.approx(before[1][:2], abs=1)
    user.control("Resume").click()
    for number in (1, 2):
        place = ",".join(f"{value:.3f}" for value in before[number - 1])
        area = map_of(user, number).area.element_handle()
        user.page.wait_for_function(
            "([map, at]) => map.dataset.view.split(' ').map(v => (+v).toFixed(3)).join() !== at",
            arg=[area, place],
        )
    assert len(sockets) == 1
    user.page.wait_for_function("() => /[?&]chosen=.*&chosen2=/.test(location.hash)")
    user.page.reload()
    # It may have left the road meanwhile, and is followed all the same.
    for name, number in ((names[0], 1), (names[1], 2)):
        expect(view(user, number).get_by_role("status")).to_contain_text(name)
    assert len(sockets) == 2
    user.control("Stop").click()


@pytest.mark.slow
def test_two_views_are_stacked_in_a_narrow_window_and_axe_finds_nothing(
    user: OdscenPage, sampled: str, run: str
) -> None:
    open_recording(user, sampled, run)
    user.page.get_by_role("button", name="Add a view").click()
    follow(user, min(places(user, run, MOMENT)))
    beside = [map_of(user, number).area.bounding_box() for number in (1, 2)]
    assert beside[0]
    assert beside[1]
    assert beside[0]["y"] == beside[1]["y"]
    assert beside[0]["width"] == pytest.approx(beside[1]["width"], abs=1)
    inspector = Inspector(user, "light")
    inspector.look("run-views")
    assert not inspector.wrong.views, str(inspector.wrong)
    user.page.set_viewport_size(NARROW)
    stacked = [map_of(user, number).area.bounding_box() for number in (1, 2)]
    assert stacked[0]
    assert stacked[1]
    assert stacked[0]["x"] == stacked[1]["x"]
    assert stacked[1]["y"] >= stacked[0]["y"] + stacked[0]["height"]
    assert min(one["height"] for one in stacked if one) > 300
    map_of(user, 2).area.focus()
    head = user.page.get_by_role("banner").bounding_box()
    first, second = (map_of(user, number).area.bounding_box() for number in (1, 2))
    assert head
    assert first
    assert second
    assert first["y"] >= head["y"] + head["height"], "nothing of the first lies under the head"
    assert second["y"] + second["height"] <= NARROW["height"] + 1
    view(user, 2).get_by_role("button", name="Close this view: View 2 of 2").click()
    expect(user.map.area).to_have_count(1)
