"""A SUMO project dropped on the page: opened with its map, run, and compared without typing."""

from __future__ import annotations

from typing import TYPE_CHECKING

from playwright.sync_api import expect

from odscen.runs.finished_run import Run
from odscen.runs.layout import TRIPS_FILE
from tests.app.test_sumo_projects import Original, assert_agrees, original, project
from tests.browser.test_openscenario import drop

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
