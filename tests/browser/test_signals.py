"""Programs of traffic lights on the page: in the editor, in a live run and in its recording."""

from __future__ import annotations

import re

from playwright.sync_api import expect

from odscen.app.scenarios import SUFFIX, write_scenario
from odscen.scenario.document.scenario_document import MapReference
from odscen.workspace.store import Workspace
from tests.browser.conftest import CROSSING
from tests.browser.pages import OdscenPage
from tests.signal_case import JUNCTION, program, scenario
from tools.page import Served

AT_STOP_LINE = (22.0, 3.25)


def saved(served: Served) -> str:
    """Name of a scenario of a minute with the program of the guide."""
    workspace = Workspace.open(served.workspace)
    sha256 = workspace.map(CROSSING).info["sha256"]
    one = scenario(program(), control="actuated", clock=12 * 3600.0, until=60.0)
    one = one.model_copy(update={"map": MapReference(name=CROSSING, sha256=sha256)})
    write_scenario(one, workspace.scenarios / f"signals{SUFFIX}")
    return "signals"


def test_a_click_on_a_signal_shows_its_program_and_a_run_where_it_is_in_its_cycle(
    user: OdscenPage, served: Served
) -> None:
    page = user.page
    user.open_editor(saved(served))
    user.step("Run").click()
    page.get_by_role("button", name="Show the signal programs").click()
    light = page.get_by_role("region", name=f"Traffic light of junction {JUNCTION}")
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
