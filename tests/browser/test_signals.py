"""Programs of traffic lights on the page: in the editor, in a live run and in its recording."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Locator, expect

from odscen.app.scenarios import SUFFIX, write_scenario
from odscen.maps.store import Workspace
from odscen.scenario.document.scenario_document import MapReference
from tests.browser.conftest import CROSSING
from tests.browser.pages import OdscenPage
from tests.signal_case import JUNCTION, program, scenario
from tools.page import Served

LIGHT = "Traffic light at East Street / North Street"

AT_STOP_LINE = (22.0, 3.25)


def saved(served: Served) -> str:
    """Name of a scenario of a minute with the program of the guide."""
    workspace = Workspace.open(served.workspace)
    sha256 = workspace.map(CROSSING).info["sha256"]
    one = scenario(program(), control="actuated", clock=12 * 3600.0, until=60.0)
    one = one.model_copy(update={"map": MapReference(name=CROSSING, sha256=sha256)})
    write_scenario(one, workspace.scenarios / f"signals{SUFFIX}")
    return "signals"


@pytest.mark.slow
def test_a_click_on_a_signal_shows_its_program_and_a_run_where_it_is_in_its_cycle(
    user: OdscenPage, served: Served
) -> None:
    page = user.page
    user.open_editor(saved(served))
    user.open_first_light()
    light = page.get_by_role("region", name=LIGHT)
    expect(light).to_be_focused()
    expect(light.get_by_role("img", name=re.compile("^stage "))).to_have_count(4)
    expect(light.get_by_role("img", name="Signal timing plan of junction")).to_be_visible()
    expect(light).to_contain_text("the engineer’s, in this scenario")
    expect(light.get_by_role("table", name="Detectors")).to_contain_text("prolongs stage 1")
    page.keyboard.press("Escape")
    expect(light).to_have_count(0)
    page.get_by_role("application").hover(position={"x": 5, "y": 5})
    user.map.click(AT_STOP_LINE)
    expect(light).to_be_visible()
    light.get_by_role("button", name="Close the traffic light").click()

    user.step("Run").click()
    user.choose_pace("As fast as possible")
    user.run.click()
    expect(user.result).to_contain_text("finished")
    page.reload()
    page.get_by_role("tab", name="Lights").click()
    again = page.get_by_role("button", name="Watch again")
    moment = page.get_by_label("Moment of the run")
    expect(again.or_(moment)).to_be_visible()
    if again.count():
        again.click()
    # The program begins 12 s after it is 12 o'clock, and stage 2 32 s later.
    for second, stage in ((20, "stage 1"), (47, "stage 2")):
        moment.fill(str(second))
        expect(light.get_by_text(re.compile("^Now: "))).to_contain_text(stage)
        expect(light.locator("[aria-current=step]")).to_contain_text(stage)
    expect(light.get_by_role("table", name="Detectors")).to_contain_text("of the last minute")


def open_program(user: OdscenPage, scenario: str) -> Locator:
    """Open the program of the crossing's light in the editor."""
    user.open_editor(scenario)
    user.open_first_light()
    light = user.page.get_by_role("region", name=LIGHT)
    expect(light.get_by_role("slider", name="Cycle")).to_be_visible()
    return light


def drag(user: OdscenPage, handle: Locator, bar: Locator, seconds: float, *, span: float) -> None:
    """Drag a handle along a bar that is ``span`` seconds wide."""
    box, whole = handle.bounding_box(), bar.bounding_box()
    assert box is not None
    assert whole is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    mouse = user.page.mouse
    mouse.move(x, y)
    mouse.down()
    mouse.move(x + seconds * whole["width"] / span, y, steps=6)
    mouse.up()


@pytest.mark.slow
def test_a_green_is_made_longer_by_mouse_and_by_keyboard_run_and_undone(
    user: OdscenPage, served: Served
) -> None:
    workspace = Workspace.open(served.workspace)
    sha256 = workspace.map(CROSSING).info["sha256"]
    one = scenario(None, until=30.0, walkers=0.0)
    one = one.model_copy(update={"map": MapReference(name=CROSSING, sha256=sha256)})
    write_scenario(one, workspace.scenarios / f"splits{SUFFIX}")
    page = user.page
    light = open_program(user, "splits")
    splits = light.get_by_role("table", name="Splits")
    first, second = (light.get_by_role("slider", name=f"Green of stage {n}") for n in "12")
    assert [one.get_attribute("aria-valuetext") for one in (first, second)] == ["13 s", "13 s"]
    with user.changing():
        drag(user, first, light.locator(".ring"), 5.0, span=1.25 * 52.0)
    expect(splits.get_by_role("row").nth(1)).to_contain_text("18 s")
    expect(light.get_by_role("slider", name="Cycle")).to_have_attribute("aria-valuetext", "57 s")
    user.tab_to(second)
    with user.changing():
        page.keyboard.press("PageUp")
        page.keyboard.press("Enter")
    expect(splits.get_by_role("row").nth(2)).to_contain_text("18 s")
    saved = user.get("/scenarios/splits")["document"]["signals"]["junctions"]
    assert [(entry["junction"], entry["green"]) for entry in saved] == [(JUNCTION, [18.0, 18.0])]

    drag(user, first, light.locator(".ring"), -14.0, span=1.25 * 62.0)
    expect(user.refusal).to_contain_text("4 s is too short for a green")
    expect(first).to_have_attribute("aria-valuetext", "18 s")
    page.get_by_role("button", name="Close this message").click()
    light.get_by_role("button", name="Close the traffic light").click()

    user.step("Run").click()
    user.choose_pace("As fast as possible")
    user.run.click()
    expect(user.result).to_contain_text("finished")
    page.get_by_role("button", name="Back to the editor").first.click()
    user.wait_for_editor()
    for _ in range(2):
        with user.changing():
            user.undo.click()
    assert user.get("/scenarios/splits")["document"]["signals"]["junctions"] == []
