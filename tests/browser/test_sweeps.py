"""Parameters and sweeps in the page: a slider, a sweep of a few short cases, one of them opened."""

from __future__ import annotations

import json
import re

import polars as pl
import pytest
from playwright.sync_api import expect

from odscen.app.running.runs import run
from odscen.app.scenarios import SUFFIX, write_scenario
from odscen.app.template_scenarios import template_scenario
from odscen.experiments.sweeps import WATCHES_CLOSENESS
from odscen.figures.measures.conflicts import SEEN_PET
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from odscen.scenario import edits
from tests.browser.conftest import SHIPPED
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
    page.get_by_role("textbox", name="Value to vary").click()
    page.get_by_role("option", name=f"{first}: depart, now 0").click()
    page.get_by_label("Name of the parameter").fill("later")
    page.get_by_label("Unit", exact=True).fill("s")
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
    page.get_by_label("Parallel runs").fill("2")
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


WEAVE = "motorway_weave"


@pytest.fixture
def cut_in(served: tool.Served) -> str:
    """Name of the cut-in of the template with two parameters."""
    workspace = Workspace.open(served.workspace)
    workspace.add_map(SHIPPED / f"{WEAVE}.xodr")
    scenario = template_scenario(workspace, "cut-in", WEAVE, values={}, name="cut-in")
    scenario = edits.set_simulation(scenario, duration=20.0)
    speeds = ("actors/challenger/speed", "actors/challenger/initial_speed")
    for name, value, places in (
        ("ttc", 2.0, ("rules/cut-in/when/ttc/below",)),
        ("challenger_speed", 11.0, (*speeds, "rules/cruise/then/0/speed/to")),
    ):
        scenario = edits.set_parameter(scenario, parameter=name, value=value, min=0.5, max=15)
        for place in places:
            scenario = edits.set_formula(scenario, place=place, formula=f"${name}")
    write_scenario(scenario, workspace.scenarios / f"cut-in{SUFFIX}")
    return "cut-in"


@pytest.mark.slow
def test_a_cut_in_is_swept_by_mouse_and_a_case_of_its_plane_runs_alone_with_the_same_figures(
    user: OdscenPage, served: tool.Served, cut_in: str
) -> None:
    page = user.page
    user.open_editor(cut_in)
    user.step("Parameters").click()
    page.get_by_role("link", name="Sweep the parameters").click()
    for name, low, high, count in (("ttc", "1", "3", "2"), ("challenger_speed", "8", "11", "2")):
        page.get_by_label(f"From of {name}").fill(low)
        page.get_by_label(f"To of {name}").fill(high)
        page.get_by_label(f"Values of {name}").fill(count)
    page.get_by_label("Parallel runs").fill("2")
    page.get_by_role("button", name="Plan the sweep").click()
    page.get_by_role("button", name="Run 4 cases").click(timeout=60_000)
    rows = page.get_by_role("table", name="Cases of the sweep").get_by_role("row")
    expect(rows).to_have_count(5, timeout=120_000)

    plane = page.get_by_role("figure").filter(has_text="the line is the boundary")
    dots = plane.locator("circle[data-case]")
    verdicts = [one.get_attribute("data-verdict") for one in dots.all()]
    assert sorted(verdicts) == ["safe", "safe", "unsafe", "unsafe"]
    expect(plane.locator("path.plane-boundary")).to_have_attribute("d", re.compile("M.+L"))
    plane.locator('circle[data-verdict="safe"]').first.click()
    user.wait_for_editor()
    case = user.scenario.removeprefix("cut-in-1-")
    assert user.document()["rules"][0]["id"] == "cruise"

    workspace = Workspace.open(served.workspace)
    table = pl.read_parquet(served.workspace / "sweeps" / "cut-in-1" / "cases.parquet")
    row = table.row(by_predicate=pl.col("case") == case, named=True)
    file = workspace.scenarios / f"{user.scenario}{SUFFIX}"
    settings = RunSettings(recording=WATCHES_CLOSENESS)
    alone = run(workspace, file, settings=settings, out=served.workspace / "alone").figures
    assert row["min_ttc"] is not None
    assert (alone["min_ttc"], alone["max_drac"]) == (row["min_ttc"], row["max_drac"])
    assert alone["min_pet"] == (SEEN_PET if row["min_pet"] is None else row["min_pet"])
