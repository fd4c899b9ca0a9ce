"""A run in three dimensions."""

from __future__ import annotations

import re
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Locator, expect

from tests.browser.pages import OdscenPage
from tests.browser.test_interruptions import begun
from tools.page import Served


def colours(stage: Locator, path: str) -> np.ndarray:
    """Pixels of what is seen, rows by columns by red, green and blue."""
    stage.screenshot(path=path)
    with Image.open(path) as opened:
        return np.asarray(opened.convert("RGB"), dtype=float)


@pytest.mark.slow
def test_a_run_is_seen_from_above_from_behind_and_from_the_seat_and_as_a_plan_again(
    open_page: Callable[..., OdscenPage],
    served: Served,
    sampled: str,
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    folder = tmp_path_factory.mktemp("scenery")
    user = open_page(served.url)
    loaded: list[str] = []
    user.page.on("request", lambda request: loaded.append(request.url))
    begun(user, sampled, speed=None)
    expect(user.page.get_by_label("Moment of the run")).to_be_visible()
    assert not [url for url in loaded if "SceneryView" in url]  # it comes when it is wanted
    stage = user.page.locator(".scenery")
    pictures = []
    for look in ("3D, from above", "3D, following", "3D, driver's seat"):
        user.choose("View", look)
        expect(stage.locator("canvas")).to_be_visible()
        stage.evaluate(
            "one => new Promise(done => requestAnimationFrame(() => setTimeout(done, 800)))"
        )
        pictures.append(colours(stage, str(folder / f"{len(pictures)}.png")))
    for picture in pictures:  # land, roads, bodies
        assert len(np.unique(picture[::7, ::7].reshape(-1, 3), axis=0)) > 20
    for one, other in pairwise(pictures):
        assert np.abs(one - other).mean() > 5
    sky = pictures[2][2, pictures[2].shape[1] // 3]
    assert sky[2] > sky[0]  # noon
    assert len([url for url in loaded if "SceneryView" in url and url.endswith(".js")]) == 1
    expect(user.page).to_have_url(re.compile("camera=seat"))
    user.page.reload()
    expect(stage.locator("canvas")).to_be_visible()
    user.choose("View", "Plan")
    expect(stage).to_have_count(0)
    expect(user.page.locator('canvas[data-layer="moving"]').first).to_be_visible()


@pytest.mark.slow
def test_arrow_keys_and_zoom_move_the_camera(
    open_page: Callable[..., OdscenPage],
    served: Served,
    sampled: str,
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    folder = tmp_path_factory.mktemp("keys")
    user = open_page(served.url)
    begun(user, sampled, speed=None)
    expect(user.page.get_by_label("Moment of the run")).to_be_visible()
    user.choose("View", "3D, from above")
    stage = user.page.locator(".scenery")
    expect(stage.locator("canvas")).to_be_visible()
    stage.focus()
    seen = []
    for key in ("", "ArrowLeft", "+", "-"):
        if key:
            user.page.keyboard.press(key)
        user.page.wait_for_timeout(600)
        seen.append(colours(stage, str(folder / f"{len(seen)}.png")))
    assert np.abs(seen[0] - seen[1]).mean() > 1
    assert np.abs(seen[1] - seen[2]).mean() > 1
    assert np.abs(seen[1] - seen[3]).mean() < 1  # nearer and back


@pytest.mark.slow
def test_the_editor_shows_starts_and_plans_in_three_dimensions_and_places_there(
    user: OdscenPage, sampled: str, tmp_path: Path
) -> None:
    user.open_editor(sampled)
    user.step("Road users").click()
    user.choose("View", "3D, from above")
    stage = user.page.locator(".scenery")
    expect(stage.locator("canvas")).to_be_visible()
    seen = []

    def look() -> np.ndarray:
        user.page.wait_for_timeout(800)
        seen.append(colours(stage, str(tmp_path / f"{len(seen)}.png")))
        return seen[-1]

    assert len(np.unique(look()[::7, ::7].reshape(-1, 3), axis=0)) > 20
    user.choose("View", "3D, driver's seat")
    assert np.abs(look() - seen[-2]).mean() > 5
    # As the plan drives on, so does the view; rain and night are seen at once.
    user.open_time_bar()
    user.time_bar.get_by_role("slider", name="Planned moment").press("PageUp")
    expect(user.page.get_by_text("each alone on the road")).to_be_visible()
    assert np.abs(look() - seen[-2]).mean() > 2
    user.step("Weather and time").click()
    with user.changing():
        times = user.page.get_by_role("radiogroup", name="Time of day")
        times.get_by_text("Night", exact=True).click()
    assert look().mean() < seen[-2].mean() / 2
    user.page.reload()
    expect(stage.locator("canvas")).to_be_visible()
    # A click places a road user on the road that is seen there.
    user.choose("View", "3D, from above")
    user.step("Road users").click()
    before = len(user.document()["actors"])
    user.kind("Car").click()
    with user.changing():
        stage.click()
    assert len(user.document()["actors"]) == before + 1
    user.choose("View", "Plan")
    expect(stage).to_have_count(0)


SECTIONS = [(0.0, 30.0), (0.0, -32.0), (34.0, 0.0), (-36.0, 0.0), (-60.0, 0.0)]
"""Places on the four arms of the crossing, metres."""


def road_edges(picture: np.ndarray, at: tuple[int, int], *, across: bool) -> tuple[int, int]:
    """First and last pixel of asphalt, bluer than what is beside it, on a line over a road."""
    column, row = at
    line = (
        picture[row, column - 45 : column + 45] if across else picture[row - 45 : row + 45, column]
    )
    asphalt = np.flatnonzero(line[:, 2] - line[:, 0] > 9.0)
    assert asphalt.size > 12
    return int(asphalt[0]), int(asphalt[-1])


@pytest.mark.slow
def test_from_straight_above_the_picture_is_the_plan_within_a_pixel(
    open_page: Callable[..., OdscenPage], served: Served, sampled: str, tmp_path: Path
) -> None:
    user = open_page(served.url)
    begun(user, sampled, speed=None)
    expect(user.page.get_by_label("Moment of the run")).to_be_visible()
    user.page.get_by_role("button", name="Zoom in").click()
    user.page.wait_for_timeout(600)
    stage = user.page.locator(".run-view")
    box = stage.bounding_box()
    assert box is not None
    places = [
        (round(x - box["x"]), round(y - box["y"])) for x, y in (user.map.at(*at) for at in SECTIONS)
    ]
    plan = colours(stage, str(tmp_path / "plan.png"))
    user.choose("View", "3D, from above")
    expect(user.page.locator(".scenery canvas")).to_be_visible()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    user.page.mouse.move(x, y - 100)
    user.page.mouse.down(button="right")
    user.page.mouse.move(x, y + 150, steps=10)
    user.page.mouse.up(button="right")
    user.page.wait_for_timeout(900)
    above = colours(stage, str(tmp_path / "above.png"))
    for place, (east, _) in zip(places, SECTIONS, strict=True):
        seen = [road_edges(one, place, across=east == 0.0) for one in (plan, above)]
        assert np.abs(np.subtract(*seen)).max() <= 1, (place, seen)
    # The left button moves the map, and the wheel brings it nearer.
    user.page.mouse.move(x, y)
    user.page.mouse.down()
    user.page.mouse.move(x + 60, y, steps=5)
    user.page.mouse.up()
    user.page.wait_for_timeout(900)
    moved = colours(stage, str(tmp_path / "moved.png"))
    column, row = places[0]
    before = road_edges(above, (column, row), across=True)
    after = road_edges(moved, (column + 60, row), across=True)
    assert np.abs(np.subtract(before, after)).max() <= 2
    user.page.mouse.wheel(0, -300)
    user.page.wait_for_timeout(900)
    assert np.abs(colours(stage, str(tmp_path / "near.png")) - moved).mean() > 2
