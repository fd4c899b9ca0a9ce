"""Recorded traffic in the page: from a dropped file to a scene that has run and is judged."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import polars as pl
import pytest
from playwright.sync_api import Page, expect

from odscen.app.exchange.kept_recordings import SEARCHED_AT_ONCE
from tests.browser.clipped_text import clipped_texts
from tests.browser.pages import OdscenPage
from tests.browser.test_accessibility import AXE
from tests.browser.test_narrow import AXE_RULES, SIZES
from tests.browser.test_openscenario import drop
from tests.formats.tracks.test_tracks_on_maps import crossing_traffic

if TYPE_CHECKING:
    from pathlib import Path

    from tools import page as tool

MOST_CLICKS = 15


@pytest.fixture
def opened(served: tool.Served, open_page: Callable[..., OdscenPage]) -> OdscenPage:
    """A user who has just dropped a recording."""
    user = open_page(served.url)
    user.open_catalogue()
    drop(user.page, {"crossing.csv": crossing_traffic().write_csv()})
    expect(user.page.get_by_role("heading", name="crossing.csv")).to_be_visible()
    expect(user.map.area).to_be_visible()
    return user


def choose_scene(page: Page, words: str) -> None:
    page.get_by_role("list", name="Scenes").get_by_role("button", name=words).first.click()


@pytest.mark.slow
def test_a_dropped_recording_becomes_a_scene_that_is_run_and_judged(opened: OdscenPage) -> None:
    page = opened.page
    side = page.get_by_role("region", name="The recording", exact=True)
    expect(side).to_contain_text("4 road users from 0:10.0 to 0:22.0")
    expect(side).to_contain_text("Vehicles on a lane")
    expect(side.get_by_role("textbox", name="Map of the recording")).to_have_value(
        "signal_crossing (100.0 % on its lanes)"
    )
    choose_scene(page, "Cut-in: cuts and behind")
    expect(side.get_by_role("textbox", name="Ego")).to_have_value("behind (Truck)")
    expect(side).to_contain_text("From 0:10.0 to 0:16.")
    page.get_by_role("button", name="Make a scenario").click()

    opened.wait_for_editor()
    assert opened.document()["criteria"] == ["collided(ego) == 0"]
    assert {actor["id"] for actor in opened.document()["actors"]} >= {"cuts", "behind", "brakes"}
    with opened.changing():
        opened.remove_actor("brakes").click()
        # It has rules: that it follows its track, and that it reacts.
        page.get_by_role("button", name="Remove all of these").click()
    opened.step("Run").click()
    opened.run.click()
    expect(opened.result).to_be_visible()
    judged = page.get_by_role("region", name="Criteria")
    expect(judged).to_contain_text("All criteria are met")
    actions = opened.actions()
    assert actions["key"] == 0
    assert actions["pointer"] <= MOST_CLICKS


@pytest.mark.slow
def test_a_scene_is_chosen_made_run_and_judged_by_keys(opened: OdscenPage) -> None:
    page = opened.page
    first = page.get_by_role("list", name="Scenes").get_by_role("button", name="Cut-in").first
    first.focus()
    page.keyboard.press("Enter")
    expect(first).to_have_attribute("aria-pressed", "true")
    page.get_by_role("button", name="Make a scenario").focus()
    page.keyboard.press("Enter")
    opened.wait_for_editor()
    opened.step("Run").focus()
    page.keyboard.press("Enter")
    opened.run.focus()
    page.keyboard.press("Enter")
    expect(opened.result).to_be_visible()
    judged = page.get_by_role("region", name="Criteria")
    expect(judged).to_contain_text("collide")
    actions = opened.actions()
    assert actions["pointer"] == 0
    assert actions["key"] <= MOST_CLICKS


@pytest.mark.slow
def test_a_large_recording_says_how_far_the_search_for_scenes_is(
    served: tool.Served, open_page: Callable[..., OdscenPage], tmp_path: Path
) -> None:
    # 17 MB: the same traffic again and again, so that scenes are looked for when it is shown.
    traffic = crossing_traffic()
    again = [
        traffic.with_columns(
            id=pl.col("id") + f"-{k}", time=pl.col("time") + 20.0 * k
        ) for k in range(430)
    ]  # fmt: skip
    file = tmp_path / "large.csv"
    pl.concat(again).write_csv(file)
    assert file.stat().st_size > SEARCHED_AT_ONCE
    user = open_page(served.url)
    user.open_catalogue()
    page = user.page
    with page.expect_file_chooser() as chooser:
        page.get_by_role("button", name="Open a recording").click()
    chooser.value.set_files(file)
    expect(page.get_by_role("heading", name="large.csv")).to_be_visible(timeout=60_000)
    strip = page.get_by_role("region", name="Time of the recording")
    expect(strip.locator(".figure").filter(has_text="On the road").locator("b")).to_have_text("3")
    scenes = page.get_by_role("list", name="Scenes")
    expect(
        page.get_by_role("progressbar", name="Progress of the search for scenes").or_(scenes)
    ).to_be_visible()
    expect(scenes).to_be_visible(timeout=120_000)
    expect(page.get_by_text("Cut-in (430)")).to_be_visible()
    expect(page.get_by_text("at most 4 at once")).to_be_visible()


@pytest.mark.slow
def test_the_time_bar_shows_who_is_where_and_the_mouse_chooses_part_and_ego(
    opened: OdscenPage,
) -> None:
    page = opened.page
    moment = page.get_by_role("slider", name="Moment of the recording")
    strip = page.get_by_role("region", name="Time of the recording")
    road = strip.locator(".figure").filter(has_text="On the road").locator("b")
    expect(road).to_have_text("3")
    bar = page.get_by_test_id("recording-bar").bounding_box()
    assert bar is not None
    # The pedestrian comes at 15 s; vehicles go at 18 s.
    page.mouse.click(bar["x"] + bar["width"] * 6 / 12, bar["y"] + 20)
    expect(road).to_have_text("4")
    page.mouse.click(bar["x"] + bar["width"] * 10 / 12, bar["y"] + 20)
    expect(road).to_have_text("1")
    page.mouse.move(bar["x"] + bar["width"] * 2 / 12, bar["y"] + 20)
    page.mouse.down()
    page.mouse.move(bar["x"] + bar["width"] * 6 / 12, bar["y"] + 20, steps=6)
    page.mouse.up()
    side = page.get_by_role("region", name="The recording", exact=True)
    expect(side).to_contain_text("From 0:12.0 to 0:16.0: 4.0 s with 4 road users")
    # By keys: the begin of the part, and the moment.
    page.get_by_role("slider", name="Begin of the part").focus()
    page.keyboard.press("Shift+ArrowLeft")
    expect(side).to_contain_text("From 0:10.0 to 0:16.0")
    moment.focus()
    page.keyboard.press("Home")
    expect(road).to_have_text("3")
    # "behind" is at (-90, -3.25) then.
    opened.map.click((-90.0, -3.25))
    expect(page.get_by_text("Ego: behind")).to_be_visible()
    strip.get_by_role("button", name="Play").click()
    expect(moment).not_to_have_value("10")
    strip.get_by_role("button", name="Pause").click()


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_recording_in_windows_of_all_sizes(
    served: tool.Served, open_page: Callable[..., OdscenPage], scheme: str
) -> None:
    user = open_page(served.url, color_scheme=scheme)
    user.open_catalogue()
    drop(user.page, {"sizes.csv": crossing_traffic().write_csv()})
    expect(user.page.get_by_role("heading", name="sizes.csv")).to_be_visible()
    found = []
    for size, (width, height) in SIZES.items():
        user.page.set_viewport_size({"width": width, "height": height})
        user.page.evaluate(AXE.read_text(encoding="utf-8"))
        found += [f"{size}: {one}" for one in user.page.evaluate(AXE_RULES)]
        found += [f"{size}: cut off {one}" for one in clipped_texts(user.page)]
    assert found == []


@pytest.mark.slow
def test_a_recording_in_german(served: tool.Served, open_page: Callable[..., OdscenPage]) -> None:
    user = open_page(served.url, locale="de-DE")
    user.open_catalogue()
    drop(user.page, {"deutsch.csv": crossing_traffic().write_csv()})
    expect(user.page.get_by_role("button", name="Szenario erstellen")).to_be_visible()
    choose_scene_de = user.page.get_by_role("list", name="Szenen").get_by_role("button")
    expect(choose_scene_de.filter(has_text="Starkes Bremsen").first).to_be_visible()
