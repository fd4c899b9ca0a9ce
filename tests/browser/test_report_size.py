"""How long reports are: a first page of one sheet of A4, and few screens while parts are folded."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Page

from odscen.app.maps import load_map
from odscen.app.running.runs import run
from odscen.maps.store import Workspace
from odscen.scenario import edits
from odscen.scenario.document.scenario_document import Scenario
from tests.browser.conftest import ARTEFACTS, CROSSING, SHIPPED
from tests.browser.pages import OdscenPage

TOWN = "town_5x5"
SCREEN = {"width": 1440, "height": 900}
MOST_SCREENS = {"study": 8, "scene": 3}
VEHICLES = 4800


@pytest.fixture(scope="module")
def workspace(one_map: Path, tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    root = tmp_path_factory.mktemp("reports") / "workspace"
    shutil.copytree(one_map, root)
    opened = Workspace.open(root)
    opened.add_map(SHIPPED / f"{TOWN}.xodr")
    return opened


def _study(workspace: Workspace) -> Scenario:
    """A town for an hour, with departures for all of it."""
    graph = load_map(workspace.map(TOWN)).sumo.graph
    scenario = edits.new_scenario(graph, name="study", roi=graph.segments.ids)
    scenario = edits.set_background(scenario, graph, background="all", trips=VEHICLES)
    return edits.set_simulation(scenario, duration=3600.0, step_length=0.5)


def _scene(workspace: Workspace) -> Scenario:
    """Two cars on a crossing."""
    graph = load_map(workspace.map(CROSSING)).sumo.graph
    scenario = edits.new_scenario(graph, name="scene", roi=graph.segments.ids)
    for spawn in ("1.0.-2.6", "1.0.-1.13"):
        scenario = edits.add_actor(scenario, graph, category="car", spawn=spawn)
    scenario = edits.set_ego(scenario, actor="car-1")
    scenario = edits.set_criteria(scenario, criteria=("collided(ego) == 0",))
    return edits.set_simulation(scenario, duration=20.0)


def _count_sheets(page: Page) -> int:
    """Sheets of A4 that the page prints as it is now."""
    return len(re.findall(rb"/Type\s*/Page\b", page.pdf(format="A4", prefer_css_page_size=True)))


@pytest.mark.slow
@pytest.mark.parametrize(("name", "make"), [("study", _study), ("scene", _scene)])
def test_a_report_is_a_sheet_first_and_few_screens_until_parts_are_opened(
    workspace: Workspace,
    open_page: Callable[..., OdscenPage],
    tmp_path: Path,
    name: str,
    make: Callable[[Workspace], Scenario],
) -> None:
    done = run(workspace, make(workspace), name=name, out=tmp_path / name)
    if name == "study":
        assert done.counts["planned"] >= VEHICLES
    page = open_page("about:blank", viewport=SCREEN).page
    page.goto((done.folder / "report.html").as_uri())
    ARTEFACTS.mkdir(parents=True, exist_ok=True)
    page.screenshot(path=ARTEFACTS / f"report-{name}.png", full_page=True)
    height = page.evaluate("document.documentElement.scrollHeight")
    assert height <= MOST_SCREENS[name] * SCREEN["height"]
    assert _count_sheets(page) == 1
    page.get_by_role("button", name="Open all parts").click()
    assert _count_sheets(page) > 1
