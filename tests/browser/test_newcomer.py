"""From the first screen to a running scenario, with only the page."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import expect

from tests.browser.conftest import PATIENCE
from tests.browser.pages import OdscenPage
from tests.maps.importers.test_openstreetmap import EXTRACTS, PLACES, crossroads
from tools import page as tool

MOST_CLICKS = 20
FEWEST_FROM_OSM = 9
"""Clicks from an .osm file to a run."""
REAL = ("4way-crossing", "West-Oakland.osm")
"""Extracts of real places that are added, where they are there."""

# What comes later, such as the server's sentences in another language, is not in the first load.
_SHOWN = """
new MutationObserver(() => {
  if (!window.shownAt && document.querySelector("h1")) window.shownAt = performance.now() + 500;
}).observe(document, { childList: true, subtree: true });
"""


@pytest.fixture(scope="module")
def empty(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tool.Served]:
    """A server that nobody has used yet."""
    root: Path = tmp_path_factory.mktemp("empty")
    with tool.served(root) as server:
        yield server


@pytest.mark.slow
def test_a_newcomer_runs_a_scenario_within_twenty_clicks_and_types_nothing(
    empty: tool.Served, open_page: Callable[..., OdscenPage]
) -> None:
    user = open_page(empty.url, tour=True)
    user.open_catalogue()
    expect(user.maps).to_have_count(0)
    user.add_shipped.click()
    shipped = len(list((tool.ROOT / "maps").glob("*.xodr")))
    expect(user.maps).to_have_count(shipped, timeout=6 * PATIENCE)

    user.new_scenario("signal_crossing").click()
    user.wait_for_editor()
    user.close_tour()
    junction = user.graph.junction()
    with user.changing():
        user.map.click(user.graph.middle(junction))
    with user.changing():
        user.add_all.click()

    user.step("Road users").click()
    roi = user.document()["roi"]
    assert len(roi) == 1 + len(user.graph.neighbours(junction))
    kinds = ("Car", "Van", "Truck", "Motorcycle")
    starts = user.graph.starts(roi, len(kinds))
    for kind, start in zip(kinds, starts, strict=True):
        user.kind(kind).click()
        with user.changing():
            user.map.click(start)
        if kind == "Car":
            with user.changing():
                user.ego.click()
    user.kind("Pedestrian").click()
    with user.changing():
        user.map.click(user.graph.starts(roi, 1, walking=True, beside=starts)[0])
    expect(user.names).to_have_count(5)

    user.step("Run").click()
    user.run.click()
    user.wait_until_moving()
    actions = user.actions()
    assert actions["key"] == 0
    assert actions["pointer"] <= MOST_CLICKS

    actors = user.document()["actors"]
    assert sorted(actor["category"] for actor in actors) == [
        "car",
        "motorcycle",
        "pedestrian",
        "truck",
        "van",
    ]
    assert [actor["category"] for actor in actors if actor["ego"]] == ["car"]
    user.choose_speed("As fast")
    expect(user.result).to_contain_text("finished")
    user.result.get_by_role("button", name="Back to the editor").click()
    user.wait_for_editor()
    assert user.document()["actors"] == actors


CROSSROADS = crossroads(
    {"name": "Main Street", "sidewalk": "both", "lanes": "2"},
    node_tags={1: {"highway": "traffic_signals"}},
)


@pytest.mark.slow
@pytest.mark.parametrize(
    "place",
    ["crossroads.osm", *(file.name for file in EXTRACTS if file.stem in REAL)],
)
def test_a_newcomer_gets_from_an_osm_file_of_his_town_to_a_run_within_twenty_clicks(
    place: str, open_page: Callable[..., OdscenPage], tmp_path: Path
) -> None:
    """Nothing is typed: the file is chosen, the map taken as a whole, filled and run."""
    file = tmp_path / "place.osm" if place.startswith("crossroads") else PLACES / place
    if file.parent == tmp_path:
        file.write_bytes(CROSSROADS)
    root = tmp_path / "workspace"
    root.mkdir()
    with tool.served(root) as server:
        user = open_page(server.url, tour=True)
        user.open_catalogue()
        with user.page.expect_file_chooser() as chooser:
            user.page.get_by_role("button", name="Choose a file").click()
        chooser.value.set_files(file)
        expect(user.maps).to_have_count(1, timeout=8 * PATIENCE)
        user.page.get_by_role("button", name=re.compile("^New scenario on")).click()
        user.wait_for_editor()
        user.close_tour()
        with user.changing():
            user.page.get_by_role("button", name="Select whole map").click()
        user.step("Road users").click()
        user.page.get_by_role("button", name="Generate traffic").click()
        with user.changing():
            user.page.get_by_role("button", name="Fill the region", exact=True).click()
        assert len(user.document()["actors"]) >= 5
        user.step("Run").click()
        user.run.click()
        user.wait_until_moving()
        actions = user.actions()
        assert actions["key"] == 0
        assert actions["pointer"] <= FEWEST_FROM_OSM <= MOST_CLICKS
        user.choose_speed("As fast")
        expect(user.result).to_contain_text("finished", timeout=8 * PATIENCE)


@pytest.mark.parametrize("locale", ["en-GB", "de-DE"])
def test_the_first_load_is_below_250_kilobytes(
    locale: str,
    open_page: Callable[..., OdscenPage],
    tmp_path: Path,
) -> None:
    with tool.served(tmp_path) as server:
        user = open_page(server.url, locale=locale)
        user.page.add_init_script(_SHOWN)
        user.open_catalogue()
        expect(user.page.locator("html")).to_have_attribute("lang", locale[:2])
        sizes = user.page.evaluate(
            "performance.getEntries().filter(one => 'transferSize' in one)"
            ".filter(one => one.startTime <= shownAt)"
            ".filter(one => !one.name.includes('/api/')).map(one => [one.name, one.transferSize])"
        )
    assert any(".js" in name and size > 1000 for name, size in sizes)
    assert sum(size for _, size in sizes) < 250_000, sizes
