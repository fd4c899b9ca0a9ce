"""A SUMO project dropped on the page: opened with its map, run, and compared without typing."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import polars as pl
import pytest
from playwright.sync_api import expect

from odscen.app.maps import load_map
from odscen.app.running.runs import run
from odscen.app.scenarios import SUFFIX
from odscen.maps.store import Workspace
from odscen.runs.finished_run import Run
from odscen.runs.layout import TRIPS_FILE
from odscen.runs.recorded import read_lanes
from tests.app.test_sumo_projects import Original, assert_agrees, original, project
from tests.browser.test_openscenario import drop
from tests.browser.test_signals import drag as drag_green

if TYPE_CHECKING:
    from pathlib import Path

    from tests.browser.pages import OdscenPage
    from tools.page import Served

__all__ = ["original", "project"]
FILES = ("run.sumocfg", "grid.net.xml", "sub/cars.rou.xml", "people.rou.xml", "things.add.xml")
BUSY = "B1B0"
"""The edge that most vehicles pass: those of flow f on their way, and those of the calibrator."""
DETOUR = ("A0B0", "C1C0")
"""Edges of the two ways around it."""


def segment_of(store: Workspace, edge: str) -> str:
    """The segment of the map that a SUMO edge is on."""
    sumo_map = load_map(store.map("grid")).sumo
    segment = sumo_map.graph.lanes.segment[sumo_map.edge_nodes[edge][0]]
    return str(sumo_map.graph.segments.ids[segment])


def passages_by_edge(done: Run) -> dict[str, int]:
    """Vehicles that came onto each SUMO edge, or began there."""
    lanes = read_lanes(done.folder)
    assert lanes is not None
    number = (pl.col("entered") + pl.col("departed")).sum().alias("vehicles")
    return dict(lanes.group_by("edge").agg(number).rows())


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
    light = page.get_by_role("region", name=re.compile("^Traffic light at"))
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
    store = Workspace.open(served.workspace)
    road = segment_of(store, BUSY)
    with user.changing():
        user.map.click(user.graph.middle(road))
    document = user.document()
    assert [measure["kind"] for measure in document["measures"]] == ["closure"]
    assert document["measures"][0]["places"] == [road]
    assert document["signals"]["junctions"]
    user.open_catalogue()
    page.get_by_role("link", name="Studies").click()
    page.get_by_role("textbox", name="Scenarios").click()
    options = page.get_by_role("option")
    expect(options.first).to_be_visible()
    for name in (before, after):  # both have the title of the project
        options.filter(has_text=f"grid ({name})").click()
    page.keyboard.press("Escape")
    page.get_by_role("button", name=re.compile(r"^Start \d+ runs$")).click()
    expect(page.get_by_role("status").first).to_contain_text("all runs completed.", timeout=420_000)
    means = page.get_by_role("table", name="Means")
    for name in (before, after):
        expect(means.get_by_role("row").filter(has_text=name)).to_contain_text("±")
    (table,) = store.studies.glob("*/results.parquet")
    results = pl.read_parquet(table)
    unused = results.group_by("scenario").agg(pl.col("unused_green").mean())
    assert unused.height == unused["unused_green"].n_unique() == 2  # the light was changed
    # The closed road carried most of the traffic: that goes another way, which takes longer.
    open_road, closed_road = (
        passages_by_edge(run(store, store.scenarios / f"{name}{SUFFIX}", name=f"{name}-again"))
        for name in (before, after)
    )
    assert open_road[BUSY] >= 100
    assert closed_road.get(BUSY, 0) < 10
    assert sum(closed_road.get(edge, 0) - open_road.get(edge, 0) for edge in DETOUR) >= 90
    assert closed_road["C0C1"] >= 90  # where they go to
    for figure in ("vehicle_km", "mean_travel_time"):
        low, high = results.group_by("scenario").agg(pl.col(figure).mean())[figure].sort()
        assert high > 1.1 * low, figure
