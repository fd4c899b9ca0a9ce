"""Pictures of the catalogue and of the steps of the editor."""

from __future__ import annotations

from playwright.sync_api import expect

from odscen.maps.shipped import shipped_maps
from tests.app.test_scenario_imports import ROAD
from tests.browser.test_language import choose_preferences
from tests.browser.test_openscenario import REFUSED, drop
from tools.screenshots import scenarios
from tools.screenshots.camera import Studio

PATIENCE = 300_000
"""Milliseconds that something that is computed may take on a busy machine."""
CROSSING = (0.0, 30.0)
"""North of the middle of the crossing, metres."""
NARROW, TALL = 390, 844
"""Pixels of a telephone."""


def catalogue(studio: Studio) -> None:
    """The maps, and the import report of one."""
    with studio.visit() as camera:
        user = camera.user
        user.open_catalogue()
        expect(user.maps).to_have_count(len(shipped_maps()))
        user.page.wait_for_load_state("networkidle")  # the cards' pictures
        camera.take("catalogue")
        user.page.get_by_role("button", name=f"Import report of {scenarios.MAP}").click()
        report = user.page.get_by_role("dialog")
        expect(report).to_be_visible()
        expect(report.get_by_role("region", name="Imported unchanged")).to_be_visible()
        camera.take("conversion", report)


def placing(studio: Studio) -> None:
    """A region, its weather, road users and their goals, and what fills it."""
    with studio.visit() as camera:
        user, page = camera.user, camera.user.page
        user.open_editor(scenarios.SAMPLED)
        user.step("Region").click()
        page.get_by_role("button", name="Show the region").click()
        camera.take("region")
        user.step("Weather and time").click()
        camera.take("weather", page.get_by_role("region", name="Weather and time", exact=True))
        user.step("Road users").click()
        page.get_by_role("button", name="Generate traffic").click()
        user.choose("Placed by", "Generator reference")
        form = page.locator(".fold").filter(has=page.get_by_label("Placed by")).last
        form.evaluate("one => one.scrollIntoView({block: 'end'})")
        camera.take("fill", form)
        page.get_by_role("button", name="Hide", exact=True).click()
        user.names.first.click()
        expect(user.ego).to_be_visible()
        page.get_by_role("button", name="Choose on the map").click()
        page.get_by_role("button", name="Use the first suggestion").evaluate(
            "one => one.scrollIntoView({block: 'start'})"
        )
        camera.take("road-users")


def map_tools(studio: Studio) -> None:
    """A grid, names, and an area that is measured."""
    with studio.visit() as camera:
        user, page = camera.user, camera.user.page
        user.open_editor(scenarios.SAMPLED)
        page.get_by_role("button", name="Layers of the map").click()
        for layer in ("Grid with coordinates", "Names of roads and junctions"):
            page.get_by_role("checkbox", name=layer).check()
        page.keyboard.press("Escape")
        page.get_by_role("button", name="Measure lengths").click()
        x, y, _ = user.map.view()
        for dx, dy in ((-150, -48), (-78, -48), (-78, 42), (-150, 42), (-150, -48)):
            user.map.click((x + dx, y + dy))
        page.get_by_role("button", name="Layers of the map").click()
        camera.take("map-tools")


def planned_time(studio: Studio) -> None:
    """The time bar of the editor, with the plan at 20 s on the map."""
    with studio.visit() as camera:
        user = camera.user
        user.open_editor(scenarios.TIMED)
        user.step("Road users").click()
        user.open_time_bar()
        moment = user.time_bar.get_by_role("slider", name="Planned moment")
        for _ in range(2):
            moment.press("PageUp")
        camera.look_at(CROSSING, closer=1)
        expect(user.page.get_by_text("each alone on the road")).to_be_visible()
        camera.take("time")


def language(studio: Studio) -> None:
    """Where language and units are chosen, and the page in German."""
    with studio.visit() as camera:
        page = camera.user.page
        camera.user.open_editor(scenarios.SAMPLED)
        page.get_by_role("button", name="Language and units").click()
        dialog = page.get_by_role("dialog")
        expect(dialog.get_by_label("Language")).to_be_visible()
        camera.take("units", dialog)
        page.keyboard.press("Escape")
        choose_preferences(page, Language="de")
        expect(page.get_by_text("Alles gespeichert")).to_be_visible()
        page.locator("button.row-button").first.click()
        camera.take("language")


def narrow(studio: Studio) -> None:
    """The editor in the window of a telephone."""
    with studio.visit(width=NARROW, height=TALL) as camera:
        user = camera.user
        user.open_editor(scenarios.SAMPLED)
        user.step("Road users").click()
        user.map.area.evaluate("one => one.scrollIntoView({block: 'start'})")
        camera.take("narrow")


def exchange(studio: Studio) -> None:
    """OpenSCENARIO in, with a part that cannot be taken, and out again."""
    with studio.visit() as camera:
        user, page = camera.user, camera.user.page
        user.open_catalogue()
        drop(page, {"cut_in.xosc": REFUSED, "road.xodr": ROAD})
        side = page.get_by_role("region", name="Report of the import")
        side.get_by_role("button", name="show on the map").first.click()
        camera.take("import")
        side.get_by_role("button", name="Open in the editor").click()
        user.wait_for_editor()
        offer = page.get_by_role("banner").get_by_role("button", name="Export")
        offer.click()
        camera.take("export-menu", page.get_by_role("menu"), offer, margin=8)
        page.get_by_role("menuitem", name="OpenSCENARIO").click()
        expect(page.get_by_role("link", name="Download (ZIP)")).to_be_visible()
        camera.take("export", page.get_by_role("dialog"))


def sweeps(studio: Studio) -> None:
    """Parameters with their sliders, and the sweep over them."""
    with studio.visit() as camera:
        user, page = camera.user, camera.user.page
        user.open_editor(scenarios.SWEPT)
        user.step("Parameters").click()
        expect(page.get_by_role("slider", name="ttc")).to_be_visible()
        page.get_by_label("Show where Rule cut-in: when ttc below is").click()
        camera.take("parameters")
        page.get_by_role("link", name="Sweep the parameters").click()
        page.get_by_label("Values of ttc").fill("10")
        page.get_by_label("Values of challenger_speed").fill("6")
        page.get_by_role("button", name="Plan the sweep").click()
        page.get_by_role("button", name="Run 60 cases").click(timeout=PATIENCE)
        expect(page.get_by_role("heading", name="Cases")).to_be_visible(timeout=PATIENCE)
        camera.take("sweep")


def studies(studio: Studio) -> None:
    """What a study found."""
    with studio.visit() as camera:
        page = camera.user.page
        page.goto(f"/#/study/{scenarios.STUDY}")
        expect(page.get_by_role("table", name="Differences")).to_be_visible()
        camera.take("study")
