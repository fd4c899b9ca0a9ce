"""Parameters and sweeps in the page: a slider, a sweep of a few short cases, one of them opened."""

from __future__ import annotations

import json

import pytest
from playwright.sync_api import expect

from odscen.app.scenarios import SUFFIX
from tests.browser.pages import OdscenPage
from tools import page as tool


@pytest.fixture
def two(served: tool.Served, sampled: str) -> str:
    """Name of a scenario of a few seconds with two road users, the first of them a vehicle."""
    path = served.workspace / "scenarios" / f"{sampled}{SUFFIX}"
    data = json.loads(path.read_text(encoding="utf-8"))
    vehicles = [one for one in data["actors"] if one["category"] != "pedestrian"]
    data |= {"actors": vehicles[:2], "simulation": {"duration": 4, "step_length": 0.5}}
    path.with_name(f"two{SUFFIX}").write_text(json.dumps(data), encoding="utf-8")
    return "two"


@pytest.mark.slow
def test_a_number_becomes_a_slider_is_swept_and_a_case_opened_by_a_click(
    user: OdscenPage, two: str
) -> None:
    page = user.page
    user.open_editor(two)
    user.step("Parameters").click()
    first = user.document()["actors"][0]["id"]
    page.get_by_role("textbox", name="Number that becomes a parameter").click()
    page.get_by_role("option", name=f"{first}: depart, now 0").click()
    page.get_by_label("Name of the parameter").fill("later")
    page.get_by_label("Unit").fill("s")
    with user.changing():
        page.get_by_role("button", name="Add the parameter").click()
    document = user.document()
    assert document["formulas"] == {f"actors/{first}/depart": "$later"}
    assert document["parameters"]["later"]["max"] == 10

    page.get_by_role("slider", name="later").focus()
    with user.changing():
        page.keyboard.press("End")
    assert user.document()["actors"][0]["depart"] == 10
    with user.changing():
        user.undo.click()
    assert user.document()["actors"][0]["depart"] == 0

    page.get_by_role("link", name="Sweep the parameters").click()
    page.get_by_label("To of later").fill("2")
    page.get_by_label("Values of later").fill("3")
    page.get_by_label("Runs at a time").fill("2")
    page.get_by_role("button", name="Plan the sweep").click()
    expect(page.get_by_text("One of them, case-002, was tried and took")).to_be_visible()
    page.get_by_role("button", name="Run 3 cases").click()
    cases = page.get_by_role("table", name="Cases of the sweep")
    expect(cases.get_by_role("row")).to_have_count(4, timeout=60_000)
    expect(page.get_by_role("status").first).to_contain_text("3 cases of later: 3 safe, 0 not.")

    page.get_by_label("Open case-003 in the editor").click()
    user.wait_for_editor()
    assert user.scenario == "two-1-case-003"
    opened = user.document()
    assert opened["actors"][0]["depart"] == 2
    assert opened["formulas"] == {}
