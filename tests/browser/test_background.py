"""A picture is laid under a map by its world file, and by two places chosen by mouse and keys."""

from __future__ import annotations

import io
import re
from collections.abc import Callable

import pytest
from PIL import Image
from playwright.sync_api import expect

from odscen.maps.store import Workspace
from tests.browser.pages import OdscenPage
from tools import page as tool


def picture() -> bytes:
    out = io.BytesIO()
    Image.new("RGB", (400, 200), (255, 0, 255)).save(out, "PNG")
    return out.getvalue()


@pytest.mark.slow
def test_a_picture_lies_under_the_roads_where_its_files_or_two_places_say(
    served: tool.Served, open_page: Callable[..., OdscenPage]
) -> None:
    user = open_page(served.url)
    page = user.page
    page.goto(f"{served.url}/#/mend/signal_crossing")
    form = page.get_by_role("region", name="Picture under the map")
    world = b"1 0 0 -1 -199.5 99.5"
    form.get_by_label("Picture and world file").set_input_files(
        [
            {"name": "photo.png", "mimeType": "image/png", "buffer": picture()},
            {"name": "photo.pgw", "mimeType": "text/plain", "buffer": world},
        ]
    )
    expect(form).to_contain_text("photo.png lies under the map")
    under = Workspace.open(served.workspace).background("signal_crossing")
    assert under is not None
    assert under.bounds() == (-200, -100, 200, 100)
    share = (
        "canvas => { const d = canvas.getContext('2d').getImageData(0, 0, canvas.width, "
        "canvas.height).data; let n = 0; for (let i = 0; i < d.length; i += 4) "
        "n += d[i] > 240 && d[i + 1] < 20 && d[i + 2] > 240; return n / (d.length / 4); }"
    )
    base = page.locator("canvas[data-layer=base]").first
    assert base.evaluate(share) > 0.2
    page.get_by_role("button", name="Layers of the map").click()
    page.get_by_role("checkbox", name="Picture under the map").uncheck()
    page.keyboard.press("Escape")
    page.wait_for_timeout(300)
    assert base.evaluate(share) == 0

    # By two places: the first by mouse, the second by keys.
    form.get_by_label("Picture and world file").set_input_files(
        [{"name": "plan.png", "mimeType": "image/png", "buffer": picture()}]
    )
    shown = form.get_by_role("application")
    box = shown.bounding_box()
    assert box is not None
    shown.click(position={"x": box["width"] / 4, "y": box["height"] / 2})
    expect(form.get_by_role("status")).to_contain_text("the same place on the map (place 1 of 2)")
    area = page.get_by_role("application", name=re.compile("^Map "))
    area.focus()
    page.keyboard.press("Enter")
    shown.focus()
    for _ in range(25):
        page.keyboard.press("ArrowRight")
    page.keyboard.press("Enter")
    area.focus()
    for _ in range(3):
        page.keyboard.press("ArrowRight")
    page.keyboard.press("Enter")
    expect(form.get_by_role("status")).to_contain_text("Two places are known")
    form.get_by_role("button", name="Place the picture").click()
    expect(form).to_contain_text("plan.png lies under the map")
    page.get_by_role("button", name="Layers of the map").click()
    page.get_by_role("checkbox", name="Picture under the map").check()
    page.keyboard.press("Escape")
    placed = Workspace.open(served.workspace).background("signal_crossing")
    assert placed is not None
    x, y, scale = map(float, (area.get_attribute("data-view") or "").split())
    a, b, c, d, e, f = placed.affine
    # Columns 100 and 300 of row 100 are 180 pixels of the screen apart.
    assert a == pytest.approx(180 / scale / 200, rel=0.02)
    assert a * 300 + b * 100 + c == pytest.approx(x, abs=0.5)
    assert d * 300 + e * 100 + f == pytest.approx(y, abs=0.5)
    form.get_by_role("button", name="Remove the picture").click()
    expect(form).to_contain_text("An aerial photograph or a plan")
