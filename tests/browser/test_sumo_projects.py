"""A SUMO project dropped on the page: opened with its map, run, and compared without typing."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import polars as pl
import pytest
from playwright.sync_api import expect

from odscen.maps.store import Workspace
from odscen.runs.finished_run import Run
from odscen.runs.layout import TRIPS_FILE
from tests.app.test_sumo_projects import Original, assert_agrees, original, project
from tests.browser.test_openscenario import drop
from tests.browser.test_signals import drag as drag_green

if TYPE_CHECKING:
    from pathlib import Path

    from tests.browser.pages import OdscenPage
    from tools.page import Served

__all__ = ["original", "project"]
FILES = ("run.sumocfg", "grid.net.xml", "sub/cars.rou.xml", "people.rou.xml", "things.add.xml")


def drop_project(user: OdscenPage, project: Path) -> None:
    """Drop all files of a project at once, and open what has become of them in the editor."""
    user.open_catalogue()
    drop(user.page, {name.rpartition("/")[2]: (project / name).read_text() for name in FILES})
    side = user.page.get_by_role("region", name="Report of the import")
    expect(side.get_by_role("heading", name="run.sumocfg was imported")).to_be_visible()
    side.get_by_role("button", name="Open in the editor").click()
    user.wait_for_editor()


@pytest.mark.slow
def test_a_dropped_project_has_its_map_and_runs_with_its_own_files(
    user: OdscenPage,
    served: Served,
    project: Path,
    original: Original,
) -> None:
    drop_project(user, project)
    document = user.document()
    assert document["map"]["name"] == "grid"
    assert document["simulation"]["duration"] == 1200
    assert {file["name"] for file in document["sumo"]["files"]} == {
        "things.add.xml", "cars.rou.xml", "people.rou.xml",
    }  # fmt: skip
    user.step("Run").click()
    user.choose_pace("As fast as possible")
    user.run.click()
    expect(user.result).to_contain_text("finished")
    (folder,) = [path.parent for path in served.workspace.rglob(TRIPS_FILE)]
    assert_agrees(Run.open(folder), original)


@pytest.mark.slow
def test_a_study_of_a_changed_light_and_a_closure_goes_from_drop_to_intervals_by_mouse(
    user: OdscenPage, served: Served, project: Path
) -> None:
    drop_project(user, project)
    page = user.page
    before = user.scenario
    drop_project(user, project)
    after = user.scenario
    assert before != after
    user.open_first_light()
    light = page.get_by_role("region", name=re.compile("^Traffic light of junction"))
    green = light.get_by_role("slider", name="Green of stage 1")
    was = green.get_attribute("aria-valuetext")
    with user.changing():
        drag_green(user, green, light.locator(".ring"), 5.0, span=112.5)
    assert green.get_attribute("aria-valuetext") != was
    light.get_by_role("button", name="Close the traffic light").click()
    user.step("Measures").click()
    page.get_by_role("button", name="Choose it on the map").click()
    page.get_by_role("button", name="Show the whole map").click()
    page.wait_for_timeout(500)
    roads = [name for name in user.document()["roi"] if "j" not in name]
    with user.changing():
        user.map.click(user.graph.middle(roads[len(roads) // 2]))
    document = user.document()
    assert [measure["kind"] for measure in document["measures"]] == ["closure"]
    assert document["signals"]["junctions"]
    user.open_catalogue()
    page.get_by_role("link", name="Studies").click()
    page.get_by_role("textbox", name="Scenarios").click()
    options = page.get_by_role("option")
    expect(options.first).to_be_visible()
    for row in range(options.count()):
        if options.nth(row).inner_text().startswith("grid"):
            options.nth(row).click()
    page.keyboard.press("Escape")
    page.get_by_role("button", name=re.compile(r"^Start \d+ runs$")).click()
    expect(page.get_by_role("status").first).to_contain_text("all runs completed.", timeout=180_000)
    means = page.get_by_role("table", name="Means")
    for name in (before, after):
        expect(means.get_by_role("row").filter(has_text=name)).to_contain_text("±")
    (table,) = Workspace.open(served.workspace).studies.glob("*/results.parquet")
    unused = pl.read_parquet(table).group_by("scenario").agg(pl.col("unused_green").mean())
    assert unused.height == unused["unused_green"].n_unique() == 2  # the light was changed
