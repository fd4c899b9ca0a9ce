"""Where one is and what is open stays, from the editor to the run and back."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import expect

from tests.browser.pages import OdscenPage
from tests.browser.test_run_in_sight import run_of_head
from tools.page import Served

NEAR = 0.02
"""Share by which a scale may differ, and metres that a middle may, times the pixels of a metre."""


def assert_same_view(one: tuple[float, float, float], other: tuple[float, float, float]) -> None:
    assert other[2] == pytest.approx(one[2], rel=NEAR)
    assert other[:2] == pytest.approx(one[:2], abs=2.0 / one[2])


@pytest.mark.slow
def test_a_run_shows_the_part_of_the_map_that_was_in_sight_and_the_editor_shows_it_again(
    open_page: Callable[..., OdscenPage], served: Served, sampled: str
) -> None:
    user = open_page(served.url, tour=True)
    user.open_editor(sampled)
    user.close_tour()
    user.step("Rules").click()
    for _ in range(3):
        user.page.get_by_role("button", name="Zoom in").click()
    user.map.drag((0.0, 0.0), (12.0, 4.0))
    before = user.map.view()
    run_of_head(user).click()
    user.wait_until_moving()
    assert_same_view(before, user.map.view())
    user.choose_speed("As fast")
    expect(user.result).to_contain_text("finished", timeout=120_000)
    user.result.get_by_role("button", name="Back to the editor").click()
    user.wait_for_editor()
    assert_same_view(before, user.map.view())
    expect(user.step("Rules")).to_have_attribute("aria-expanded", "true")
    expect(user.tour).to_have_count(0)


@pytest.mark.slow
def test_who_is_chosen_in_the_table_and_in_sight_moves_nothing(
    user: OdscenPage, sampled: str
) -> None:
    user.open_editor(sampled)
    user.step("Road users").click()
    before = user.map.view()
    for row in (0, 3):
        user.names.nth(row).click()
        expect(user.page.get_by_label("Desired speed", exact=True)).to_be_visible()
        assert user.map.view() == before
