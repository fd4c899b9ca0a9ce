"""Groups, intergreens, detectors and plans of the day of a light, made in the page."""

from __future__ import annotations

import re
from typing import Any

import pytest
from playwright.sync_api import Locator, expect

from odscen.app.scenarios import SUFFIX, read_scenario, write_scenario
from odscen.maps.store import Workspace
from odscen.scenario.document.json_form import dumps
from odscen.scenario.document.scenario_document import MapReference, Scenario
from odscen.scenario.document.signals_document import Signals
from tests.browser.conftest import CROSSING
from tests.browser.pages import OdscenPage
from tests.browser.test_signals import drag, open_program
from tests.signal_case import one_plan, program, scenario
from tools.page import Served

OF_ROW = "[data-row=plans]"


def saved(served: Served, name: str, junction: dict[str, Any], **fields: Any) -> Scenario:
    workspace = Workspace.open(served.workspace)
    sha256 = workspace.map(CROSSING).info["sha256"]
    one = scenario(junction, control="actuated", **fields)
    one = one.model_copy(update={"map": MapReference(name=CROSSING, sha256=sha256)})
    write_scenario(one, workspace.scenarios / f"{name}{SUFFIX}")
    return one


def timing(user: OdscenPage, name: str) -> dict[str, Any]:
    (found,) = user.get(f"/scenarios/{name}")["document"]["signals"]["junctions"]
    return dict(found)


def unfold(light: Locator, title: str) -> Locator:
    fold = light.locator("details", has=light.page.get_by_text(title, exact=True))
    fold.locator("summary").first.press("Enter")
    return fold


@pytest.mark.slow
def test_a_program_is_made_part_by_part_with_the_bytes_of_the_file_and_undone(
    user: OdscenPage, served: Served
) -> None:
    page = user.page
    # The program of the guide without what is made here.
    before = saved(
        served,
        "parts",
        one_plan(intergreens=None, detectors=None),
        clock=6 * 3600.0 - 50,
        until=120,
    )
    light = open_program(user, "parts")

    # A least green that no stage gives is refused at its field; one that fits is taken.
    groups = unfold(light, "Change signal groups and stages")
    groups.get_by_role("button", name="Change V1L").click()
    form = groups.get_by_role("region", name="Signal group V1L")
    least = form.get_by_label("Least green")
    least.fill("30")
    least.press("Enter")
    expect(form.get_by_role("alert").filter(visible=True)).to_contain_text(
        "may have only 26 s of green in stage '1', '2'"
    )
    with user.changing():
        least.fill("8")
        least.press("Enter")
    # Greens that are never allowed are told without asking.
    form.get_by_role("radiogroup", name="V1L in stage 4").get_by_text("Green").click()
    expect(form.get_by_role("alert").filter(visible=True)).to_contain_text(
        "V1L and P1 cross: they can never be green together. P1 is green in stage 4."
    )
    form.get_by_role("radiogroup", name="V1L in stage 1").get_by_text("Green").click()
    expect(form.get_by_role("alert").filter(visible=True)).to_contain_text("has to give way to")

    # A new group by keyboard: it takes a turn from another.
    button = groups.get_by_role("button", name="New signal group")
    button.press("Enter")
    new = groups.get_by_role("region", name="New signal group")
    new.get_by_label("Name").fill("V2L")
    turns = new.get_by_label("Turns and crossings").first
    turns.focus()
    page.keyboard.type("north, left")
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    with user.changing():
        new.get_by_role("button", name="Add the group").press("Enter")
    group = groups.get_by_role("region", name="Signal group V2L")
    expect(group).to_contain_text("from the north: left turn")

    # An intergreen: shorter than computed is refused at the matrix, longer is kept.
    matrix = unfold(light, "Change intergreens")
    cell = matrix.get_by_label("Intergreen from V4 to P1, seconds; the paths need 7")
    cell.fill("6")
    cell.press("Enter")
    expect(matrix.get_by_role("alert").filter(visible=True)).to_contain_text("is too short")
    expect(cell).to_have_attribute("aria-invalid", "true")
    with user.changing():
        cell.fill("11")
        cell.press("Enter")
    expect(cell).to_have_attribute("aria-invalid", "false")

    # A detector is placed by a click in a lane, and dragged along it.
    loops = unfold(light, "Change detectors")
    loops.get_by_role("button", name="Place a detector on the map").click()
    with user.changing():
        user.map.click((33.0, 5.6))
    (made,) = timing(user, "parts")["detectors"]
    assert (made["id"], made["stages"]) == ("D1", ["1", "2"])
    assert made["before"] == pytest.approx(11.0, abs=0.6)
    with user.changing():
        user.map.drag((33.0, 5.6), (28.0, 5.6))
    (moved,) = timing(user, "parts")["detectors"]
    assert moved["before"] == pytest.approx(made["before"] - 5.0, abs=0.8)
    assert moved["at"] == made["at"]
    gap = loops.get_by_label("Passage gap")
    with user.changing():
        gap.fill("2.5")
        gap.press("Enter")
    expect(loops.get_by_label("Passage gap")).to_have_value("2.5 s")

    # The day is divided, and the morning begins earlier by keyboard.
    day = unfold(light, "Change the plans of the day")
    with user.changing():
        day.get_by_role("button", name=re.compile("^Divide the day")).click()
    begin = day.get_by_role("slider", name="Begin of plan A")
    expect(begin).to_have_attribute("aria-valuetext", "06:00")
    user.tab_to(begin)
    with user.changing():
        page.keyboard.press("ArrowRight")
        page.keyboard.press("Enter")
    with user.changing():
        drag(user, begin, day.locator(".day-track"), -900.0, span=86_400.0)
    expect(begin).to_have_attribute("aria-valuetext", "06:00")
    offset = day.get_by_role("region", name="Plan A").get_by_label("Offset")
    with user.changing():
        offset.fill("7")
        offset.press("Enter")

    # What the page made is what a file says.
    by_page = timing(user, "parts")
    assert [(plan["id"], plan["times"], plan["offset"]) for plan in by_page["plans"]] == [
        ("B", ["00:00", "09:00"], 0), ("A", ["06:00"], 7),
    ]  # fmt: skip
    wanted = program(
        intergreens=[["V4", "P1", 11]],
        detectors=[{"id": "D1", "at": moved["at"], "before": moved["before"], "stages": ["1", "2"],
                    "gap": 2.5}],
        plans=[{"id": "B", "times": ["00:00", "09:00"]},
               {"id": "A", "times": ["06:00"], "offset": 7}],
    )  # fmt: skip
    at = [group["id"] for group in wanted["groups"]].index("V2")
    others = next(one["movements"] for one in by_page["groups"] if one["id"] == "V2")
    assert sorted(others) == ["r2 right", "r2 straight"]
    wanted["groups"][at]["movements"] = others
    wanted["groups"].insert(at + 1, {"id": "V2L", "movements": ["r2 left"]})
    wanted["groups"][1]["min_green"] = 8
    wanted["stages"][2]["permissive"] = ["V2", "V4", "V2L"]
    by_file = before.model_copy(
        update={"signals": Signals.model_validate({"control": "actuated", "junctions": [wanted]})}
    )
    file = Workspace.open(served.workspace).scenarios / f"parts{SUFFIX}"
    assert dumps(read_scenario(file)) == dumps(by_file)

    # A run has both plans in its time bar.
    light.get_by_role("button", name="Close the traffic light").click()
    user.step("Run").click()
    user.choose_pace("As fast as possible")
    user.run.click()
    expect(user.result).to_contain_text("finished")
    again = page.get_by_role("button", name="Watch again")
    moment = page.get_by_label("Moment of the run")
    expect(again.or_(moment)).to_be_visible()
    if again.count():
        again.click()
    expect(page.locator(f"{OF_ROW} .time-plan")).to_have_text(["B", "A"])
    page.get_by_role("button", name="Back to the editor").first.click()
    user.wait_for_editor()
    for _ in range(10):
        with user.changing():
            user.undo.click()
    assert dumps(read_scenario(file)) == dumps(before)
