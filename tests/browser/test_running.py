"""The live view: a run is watched, held, sped up, ended and left."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import psutil
import pytest
from playwright.sync_api import expect

from tests.browser.pages import FAILED, OdscenPage
from tools.page import Served


def start(user: OdscenPage, scenario: str) -> None:
    user.open_editor(scenario)
    user.step("Run").click()
    user.run.click()
    user.wait_until_moving()


def stand_still(user: OdscenPage) -> None:
    """Pause, until the page shows where the run stands."""
    user.control("Pause").click()
    expect(user.control("Resume")).to_be_enabled()
    expect(user.control("One step")).to_be_enabled()
    run = user.page.url.partition("?")[0].rsplit("/", 1)[1]
    while user.get(f"/runs/{run}")["state"] != "paused":
        pass
    # The last picture comes after the word that the run stands.
    seen, shown = None, user.time()
    while seen != shown:
        user.page.wait_for_timeout(500)
        seen, shown = shown, user.time()


@pytest.mark.slow
def test_a_run_is_held_stepped_and_sped_up_and_the_scenario_stays_as_it_is(
    user: OdscenPage, sampled: str
) -> None:
    user.open_editor(sampled)
    before = user.document()
    start(user, sampled)
    stand_still(user)
    times = [user.time()]
    for _ in range(2):
        shown = user.figure("Time").first.inner_text()
        user.control("One step").click()
        expect(user.figure("Time").first).not_to_have_text(shown)
        times.append(user.time())
    step = before["simulation"]["step_length"]
    assert [round(b - a, 6) for a, b in pairwise(times)] == [round(step, 6)] * 2
    user.control("Resume").click()
    user.choose_speed("As fast")
    expect(user.result).to_contain_text("finished")
    expect(user.result.get_by_role("link", name="Full report")).to_be_visible()
    user.result.get_by_role("button", name="Back to the editor").click()
    user.wait_for_editor()
    assert user.document() == before


@pytest.mark.slow
def test_a_stopped_run_shows_what_there_is(user: OdscenPage, sampled: str) -> None:
    start(user, sampled)
    user.control("Stop").click()
    expect(user.result).to_contain_text("stopped")


@pytest.mark.slow
def test_a_run_that_crashes_says_so_and_harms_no_other(
    user: OdscenPage, open_page: Callable[..., OdscenPage], served: Served, sampled: str
) -> None:
    server = psutil.Process(served.process.pid)
    start(user, sampled)
    workers = set(server.children(recursive=True))
    other = open_page(served.url, context=user.page.context)
    start(other, sampled)
    (crashing,) = {
        child for child in set(server.children(recursive=True)) - workers if not child.children()
    }
    crashing.kill()
    expect(other.result).to_contain_text(FAILED)
    expect(user.result).to_have_count(0)
    shown, clock = user.time(), user.figure("Time").first.inner_text()
    expect(user.figure("Time").first).not_to_have_text(clock)
    assert user.time() > shown
    user.control("Stop").click()
    expect(user.result).to_contain_text("stopped")
    other.result.get_by_role("button", name="Back to the editor").click()
    other.wait_for_editor()
