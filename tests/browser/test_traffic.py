"""Traffic, counts and long runs in the page, by somebody who never programs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Locator, expect

from odscen.app.maps import load_map
from odscen.app.scenarios import SUFFIX
from odscen.maps.store import Workspace
from odscen.scenario import edits
from odscen.scenario.document.json_form import dumps
from tests.browser.conftest import CROSSING
from tests.browser.pages import OdscenPage
from tools.page import Served

HOUR = 3600


@pytest.fixture
def crossing(served: Served, request: pytest.FixtureRequest) -> str:
    """Name of a scenario on the whole crossing in which nobody is."""
    workspace = Workspace.open(served.workspace)
    graph = load_map(workspace.map(CROSSING)).sumo.graph
    name = request.node.name.replace("_", "-")[:40]
    scenario = edits.new_scenario(graph, name=name, roi=graph.segments.ids)
    _write(workspace, name, scenario)
    return name


def _write(workspace: Workspace, name: str, scenario: Any) -> None:
    workspace.scenarios.mkdir(exist_ok=True)
    (workspace.scenarios / f"{name}{SUFFIX}").write_text(dumps(scenario), encoding="utf-8")


def open_traffic(user: OdscenPage, scenario: str) -> None:
    user.open_editor(scenario)
    user.step("Demand").click()


def send_table(user: OdscenPage, kind: str, path: Path) -> None:
    user.choose("Contents of the table", kind)
    with user.page.expect_file_chooser() as chooser:
        user.page.get_by_role("button", name="Choose a table").click()
    chooser.value.set_files(path)


def background(user: OdscenPage) -> Locator:
    return user.page.get_by_role("region", name="Background traffic background", exact=True)


@pytest.mark.slow
def test_vehicles_from_outside_are_added_where_lanes_lead_in(
    user: OdscenPage, crossing: str
) -> None:
    open_traffic(user, crossing)
    user.page.get_by_role("button", name="Add vehicle inputs").click()
    place = "North Street, north of East Street / North Street (r2), 2 lanes"
    user.choose("Where they drive in", place)
    with user.changing():
        user.page.get_by_role("button", name="Add", exact=True).click()
    card = user.page.get_by_role("region", name="Vehicle input input", exact=True)
    with user.changing():
        card.get_by_label("Vehicles per hour").fill("950")
        user.page.keyboard.press("Enter")
    (inflow,) = user.document()["demand"]["inputs"]
    assert (inflow["segment"], inflow["per_hour"]) == ("r2", 950)
    card.get_by_role("button", name="Remove input").click()
    expect(card).to_have_count(0)


@pytest.mark.slow
def test_background_traffic_is_added_changed_and_taken_back(
    user: OdscenPage, crossing: str
) -> None:
    open_traffic(user, crossing)
    with user.changing():
        user.page.get_by_role("button", name="Add background traffic").click()
    with user.changing():
        user.choose("Amount given as", "Number of trips")
    with user.changing():
        background(user).get_by_label("Trips", exact=True).fill("80")
        user.page.keyboard.press("Enter")
    with user.changing():
        user.choose("Day profile", "Weekend")
    expect(background(user).get_by_role("img", name="Weekend over the day")).to_be_visible()
    background(user).get_by_role("button", name="Change the mix").click()
    with user.changing():
        background(user).get_by_label("Bus", exact=True).fill("1")
        user.page.keyboard.press("Enter")
    with user.changing():
        user.page.get_by_label("Time of day at the start").fill("07:30")
        user.page.keyboard.press("Enter")
    for label, minutes in (("From", "07:35"), ("Until", "07:50")):
        with user.changing():
            background(user).get_by_label(label, exact=True).fill(minutes)
            user.page.keyboard.press("Enter")
    demand = user.document()["demand"]
    assert demand["clock"] == 7.5 * HOUR
    (one,) = demand["background"]
    assert (one["begin"], one["end"]) == (300, 1200)
    assert (one["trips"], one["per_km"], one["profile"]) == (80, None, "weekend")
    assert one["mix"] == {"car": 1, "bus": 1}
    with user.changing():
        background(user).get_by_role("button", name="Remove background").click()
    expect(background(user)).to_have_count(0)
    with user.changing():
        user.undo.click()
    expect(background(user)).to_be_visible()
    assert user.document()["demand"] == demand
    with user.changing():
        background(user).get_by_label("Until", exact=True).fill("")
        user.page.keyboard.press("Enter")
    assert user.document()["demand"]["background"][0]["end"] is None


@pytest.mark.slow
def test_a_table_with_a_mistake_names_line_and_column_and_corrected_it_is_imported(
    user: OdscenPage, crossing: str, tmp_path: Path
) -> None:
    open_traffic(user, crossing)
    before = user.document()
    user.page.get_by_role("button", name="Import a table").click()
    table = tmp_path / "commuters.csv"
    table.write_text("from,to,trips\nr1,r2,30\nr1,r77,20\n")
    send_table(user, "Trips between zones", table)
    refused = user.page.get_by_role("alert").filter(has_text="commuters.csv was not imported")
    expect(refused).to_contain_text("Line 3, column 'to': 'r77' is neither a zone nor a segment")
    assert user.document() == before
    table.write_text("from,to,trips\nr1,r2,30\nr1,r3,20\n")
    send_table(user, "Trips between zones", table)
    expect(refused).to_have_count(0)
    card = user.page.get_by_role("region", name="Trips between zones trips")
    expect(card).to_contain_text("50 trips in 2 rows")
    with user.changing():
        user.undo.click()
    assert user.document() == before


@pytest.mark.slow
def test_a_day_on_the_whole_map_is_generated_and_its_load_on_the_junctions_reported(
    user: OdscenPage, crossing: str
) -> None:
    open_traffic(user, crossing)
    user.page.get_by_role("button", name="Whole day on the whole map").click()
    user.page.get_by_label("Trips per day, at most").fill("400")
    user.page.get_by_role("button", name="Generate the day").click()
    said = user.page.get_by_text("The busiest approach of a junction then reaches")
    expect(said).to_contain_text("its busiest hour is usable with 2 seeds")
    document = user.document()
    assert document["simulation"]["duration"] == 24 * HOUR
    assert sum(row[2] for row in document["demand"]["matrices"][0]["trips"]) > 350


@pytest.mark.slow
def test_a_flow_can_have_a_day_profile(user: OdscenPage, crossing: str, served: Served) -> None:
    workspace = Workspace.open(served.workspace)
    loaded = load_map(workspace.map(CROSSING))
    graph = loaded.sumo.graph
    scenario = edits.new_scenario(graph, name=crossing, roi=graph.segments.ids)
    spawn = edits.fill_roi(scenario, graph, loaded.usable, share=0.2, seed=1).actors[0].spawn
    _write(workspace, crossing, edits.add_flow(scenario, graph, spawn=spawn, per_hour=200))
    user.open_editor(crossing)
    user.step("Road users").click()
    user.names.first.click()
    with user.changing():
        user.choose("Day profile", "Weekday")
    assert user.document()["flows"][0]["profile"] == "weekday"


@pytest.mark.slow
def test_the_fit_to_counts_is_shown_with_its_places(
    user: OdscenPage, crossing: str, tmp_path: Path
) -> None:
    open_traffic(user, crossing)
    user.page.get_by_role("button", name="Import a table").click()
    table = tmp_path / "survey.csv"
    table.write_text("place,begin,end,count\nr1>j10001,0,300,20\nr1>j10001>r2,0,300,900\n")
    send_table(user, "Counts", table)
    expect(user.problems).to_contain_text(["add up to 900"])
    user.step("Run").click()
    user.choose_pace("As fast as possible")
    user.run.click()
    expect(user.result).to_contain_text("finished", timeout=60_000)
    user.page.get_by_role("tab", name="Counts").click()
    expect(user.page.get_by_role("heading", name="of 2 counts met")).to_be_visible()
    unmet = user.page.get_by_role("table", name="Counts that are not met")
    expect(unmet).to_contain_text("add up to 900")
    before = user.map.view()
    unmet.get_by_role("button", name=", from the east to the north").click()
    expect(user.map.area).not_to_have_attribute("data-view", " ".join(f"{v:g}" for v in before))
    user.page.get_by_role("tab", name="Result").click()
    user.result.get_by_text("Download the results").click()
    with user.page.expect_download() as download:
        user.result.get_by_role("link", name="Key figures").click()
    assert '"arrived"' in Path(download.value.path()).read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_long_run_is_forecast_interrupted_and_resumed_to_its_end(
    user: OdscenPage, crossing: str, served: Served
) -> None:
    workspace = Workspace.open(served.workspace)
    graph = load_map(workspace.map(CROSSING)).sumo.graph
    scenario = edits.new_scenario(graph, name=crossing, roi=graph.segments.ids)
    scenario = edits.set_simulation(scenario, duration=2 * HOUR)
    _write(
        workspace,
        crossing,
        edits.set_background(scenario, graph, background="others", trips=500),
    )
    user.open_editor(crossing)
    user.step("Run").click()
    with user.changing():
        user.page.get_by_role("textbox", name="Duration", exact=True).fill("3")
        user.page.keyboard.press("Enter")
    assert user.document()["simulation"]["duration"] == 3 * HOUR
    user.choose("Record trajectories", "Every 10 seconds")
    user.page.get_by_role("button", name="Estimate disk and memory").click()
    expect(user.page.get_by_text("of memory")).to_be_visible()
    user.run.click()
    later = user.strip.get_by_role("button", name="Pause and save")
    expect(later).to_be_enabled()
    later.click()
    expect(user.result).to_contain_text("interrupted")
    user.page.reload()
    expect(user.result).to_contain_text("interrupted")
    user.result.get_by_role("button", name="Resume", exact=True).click()
    expect(user.result).to_contain_text("finished", timeout=120_000)
    user.result.get_by_text("The 3 parts of the run").click()
    expect(
        user.page.get_by_role("table", name="Parts of the run").get_by_role("row")
    ).to_have_count(4)
