"""Pictures of runs: live, their results, and their recordings."""

from __future__ import annotations

import re

from playwright.sync_api import expect

from tools.screenshots import scenarios
from tools.screenshots.camera import Camera, Studio

PATIENCE = 300_000
"""Milliseconds that a run may take on a busy machine."""
JUNCTION = "j10016"
"""A junction of the town's avenue."""
SEEN_LIVE = 30.0
"""Simulated seconds at which the live run is seen."""


def run_at_once(camera: Camera) -> None:
    """Run the scenario of the editor as fast as possible, to its end."""
    user = camera.user
    user.step("Run").click()
    user.choose_pace("As fast as possible")
    user.run.click()
    expect(user.result).to_contain_text("finished", timeout=PATIENCE)


def watch_again(camera: Camera) -> None:
    """Open the recording of the run that is over."""
    camera.user.page.get_by_role("button", name="Watch again").click()
    expect(camera.user.page.get_by_label("Moment of the run")).to_be_visible()


def results(studio: Studio) -> None:
    """A run of a town: live, its key figures, its charts, and its lanes in colours."""
    with studio.visit() as camera:
        user, page = camera.user, camera.user.page
        user.open_editor(scenarios.TOWN)
        user.step("Run").click()
        user.run.click()
        user.wait_until_moving()
        user.control("Pause").click()
        expect(user.control("Resume")).to_be_enabled()
        while user.time() < SEEN_LIVE:
            before = user.figure("Time").first.inner_text()
            user.control("One step").click()
            expect(user.figure("Time").first).not_to_have_text(before)
        camera.look_at(user.graph.middle(JUNCTION), closer=3)
        camera.take("run")
        user.choose_speed("As fast")
        user.control("Resume").click()
        expect(user.result).to_contain_text("finished", timeout=PATIENCE)
        expect(user.result.get_by_role("link", name="Full report")).to_be_visible()
        page.get_by_role("button", name="Hide the time bar").click()
        camera.take("result", page.get_by_role("complementary"))
        _report(studio, user.result.get_by_role("link", name="Full report").get_attribute("href"))
        page.get_by_role("tab", name="Charts").click()
        expect(page.get_by_text("Arrivals", exact=True)).to_be_visible()
        page.wait_for_load_state("networkidle")
        camera.take("charts", page.get_by_role("complementary"))
        watch_again(camera)
        page.get_by_label("Moment of the run").fill("300")
        user.choose("Colour the lanes by", "Delay per km")
        legend = page.get_by_role("list", name="What is shown")
        expect(legend.get_by_text(re.compile(r"s/km and more$"))).to_be_visible()
        camera.take("lanes")
        user.choose("Colour the lanes by", "Plain")
        _two_views(camera)


def _two_views(camera: Camera) -> None:
    """A junction by the lights ahead, and a road user that is followed by speeds."""
    user, page = camera.user, camera.user.page
    camera.look_at(user.graph.middle(JUNCTION), closer=2)
    user.choose("Colour by", "Light ahead")
    page.get_by_role("button", name="Add a view").click()
    page.get_by_role("tab", name="Road users").click()
    second = page.get_by_role("group", name="View 2 of 2")
    second.get_by_role("textbox", name="Colour by").click()
    page.get_by_role("option", name="Speed", exact=True).click()
    users = page.get_by_role("list", name="Follow a road user").get_by_role("button")
    users.first.click()
    expect(second.get_by_role("figure")).to_be_visible()
    camera.take("views")


def _report(studio: Studio, address: str | None) -> None:
    """The report of a run: its verdict, the level of service on the map, and a corridor."""
    assert address is not None
    with studio.visit(width=1080, height=1240) as camera:
        camera.user.page.goto(address)
        expect(camera.user.page.get_by_role("heading", level=1)).to_be_visible()
        camera.take("report")
        corridor = camera.user.page.locator("#corridor")
        camera.user.page.get_by_role("button", name="Open all parts").click()
        corridor.evaluate("section => section.scrollIntoView()")
        camera.take("corridor", corridor)


def time_of_a_run(studio: Studio) -> None:
    """The time bar of a recording at the instant of a rule."""
    with studio.visit() as camera:
        user, page = camera.user, camera.user.page
        user.open_editor(scenarios.TIMED)
        run_at_once(camera)
        watch_again(camera)
        user.time_bar.get_by_role("button", name="Next event").click()
        page.wait_for_timeout(1000)  # the curve is computed in turns
        camera.take("time-run")


def interrupted(studio: Studio) -> None:
    """A long run that was interrupted after a part of it."""
    with studio.visit() as camera:
        user, page = camera.user, camera.user.page
        user.open_editor(scenarios.LONG)
        user.step("Run").click()
        user.run.click()
        parts = page.get_by_text(re.compile(r"^\d of \d parts completed"))
        expect(parts).to_be_visible(timeout=PATIENCE)
        user.control("Pause and save").click()
        expect(user.result).to_contain_text("interrupted", timeout=PATIENCE)
        camera.take("interrupted", user.result, margin=8)
