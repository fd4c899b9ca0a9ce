"""OpenSCENARIO in and out of the page: dropped on the catalogue, reported, edited, downloaded."""

from __future__ import annotations

import base64
import json
import re
import zipfile
from typing import TYPE_CHECKING

import pytest
from playwright.sync_api import Page, expect

from tests.app.test_scenario_imports import FILE, ROAD, SPEED

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from tests.browser.pages import OdscenPage
    from tools import page as tool

CUT_IN = FILE.replace("ACTION", SPEED)
LANE = '<RelativeTargetLane entityRef="Other" value="1"/>'
REFUSED = CUT_IN.replace(LANE, "<Sideways/>")
"""A file with an action that there is not."""

_DROP = """([element, files]) => {
    const data = new DataTransfer();
    for (const [name, content] of Object.entries(files)) {
        const bytes = Uint8Array.from(atob(content), one => one.charCodeAt(0));
        data.items.add(new File([bytes], name));
    }
    for (const kind of ["dragenter", "dragover", "drop"])
        element.dispatchEvent(new DragEvent(kind, {dataTransfer: data, bubbles: true}));
}"""


def drop(page: Page, files: Mapping[str, str]) -> None:
    """Drop files on the catalogue, as a hand does from a file manager."""
    packed = {name: base64.b64encode(text.encode()).decode() for name, text in files.items()}
    catalogue = page.locator(".catalogue").element_handle()
    page.evaluate(_DROP, [catalogue, packed])


@pytest.mark.slow
def test_a_dropped_scene_is_reported_edited_and_exported(
    served: tool.Served, open_page: Callable[..., OdscenPage]
) -> None:
    user = open_page(served.url)
    user.open_catalogue()
    page = user.page
    # Without its map first: the page says which one, and takes it without all being sent again.
    drop(page, {"cut_in.xosc": REFUSED})
    alert = page.get_by_role("alert").filter(has_text="could not be imported")
    expect(alert).to_contain_text("'road.xodr'")
    with page.expect_file_chooser() as chooser:
        alert.get_by_role("button", name="Add its map or catalogs and try again").click()
    chooser.value.set_files(
        [{"name": "road.xodr", "mimeType": "application/xml", "buffer": ROAD.encode()}]
    )

    side = page.get_by_role("region", name="Report of the import")
    expect(side.get_by_role("heading", name="cut_in.xosc was imported")).to_be_visible()
    expect(side).to_contain_text("2 road users and")
    expect(side).to_contain_text("road, which was added to your maps")
    sections = [one.get_attribute("aria-label") for one in side.locator("section").all()]
    assert sections[0] == "Not supported (affects behaviour)"
    assert sections[-1] == "Imported unchanged"
    place = side.get_by_role("region", name=sections[0]).get_by_role("button").first
    place.click()
    expect(place).to_have_attribute("aria-pressed", "true")
    # The event is that of the other, which starts a lane to the right of the ego.
    expect(page.locator(".map-hint")).to_have_text("x = 88.6 m, y = -5.3 m")
    assert user.map.view()[:2] == pytest.approx((88.6, -5.25), abs=0.01)

    side.get_by_role("button", name="Open in the editor").click()
    user.wait_for_editor()
    assert [one["id"] for one in user.document()["actors"]] == ["Ego", "Other"]

    banner = page.get_by_role("banner")
    banner.get_by_role("button", name="Export").click()
    page.get_by_role("menuitem", name="OpenSCENARIO").click()
    dialog = page.get_by_role("dialog", name="Export to OpenSCENARIO")
    expect(dialog).to_contain_text("3 files: ")
    with page.expect_download() as download:
        dialog.get_by_role("link", name="Download (ZIP)").click()
    with zipfile.ZipFile(download.value.path()) as archive:
        names = archive.namelist()
        xosc = archive.read(f"{user.scenario}.xosc").decode()
        json.loads(archive.read(f"{user.scenario}.export.json"))
    assert names == sorted([f"{user.scenario}.export.json", f"{user.scenario}.xosc", "road.xodr"])
    assert re.search(r'revMajor="1" revMinor="2"', xosc)

    dialog.get_by_role("button", name="Close").or_(dialog.locator("button").first).first.click()
    user.choose_in_menu("Report of the import")
    expect(side).to_be_visible()
