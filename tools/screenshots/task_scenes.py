"""Pictures of the guides per task: demand, measures, rules and traffic lights."""

from __future__ import annotations

from playwright.sync_api import Locator, expect

from tools.screenshots import scenarios
from tools.screenshots.camera import Camera, Studio
from tools.screenshots.run_scenes import run_at_once, watch_again

TALL = 1300
"""Pixels of a window in which a whole form is seen."""
DETECTOR = (60.0, 5.0)
"""Near the detector of the program, metres."""
BESIDE_TOWN = (90.0, 220.0)
"""In the middle, it leaves the town beside the legend, metres."""
TO_TOP = "one => one.scrollIntoView({block: 'start'})"


def demand(studio: Studio) -> None:
    """Vehicles from outside and trips of a table; counts of another scenario against its run."""
    with studio.visit() as camera:
        user, page = camera.user, camera.user.page
        user.open_editor(scenarios.INFLOW)
        user.step("Demand").click()
        card = page.get_by_role("region", name="Vehicle input west", exact=True)
        card.get_by_role("button", name="Change the mix").click()
        card.evaluate(TO_TOP)
        camera.take("traffic", card)
        user.open_editor(scenarios.COUNTED)
        run_at_once(camera)
        page.get_by_role("tab", name="Counts").click()
        expect(page.get_by_role("heading", name="counts met")).to_be_visible()
        page.get_by_role("button", name="Hide the time bar").click()
        camera.look_at(BESIDE_TOWN, closer=0)
        camera.take("counts")


def measures(studio: Studio) -> None:
    """A road that is closed for three minutes, chosen on the map."""
    with studio.visit() as camera:
        user, page = camera.user, camera.user.page
        user.open_editor(scenarios.ROADWORKS)
        page.get_by_role("button", name="Hide the table").click()
        user.step("Measures").click()
        page.get_by_role("button", name="Choose it on the map").click()
        r25 = user.graph.middle("r25")
        with user.changing():
            user.map.click(r25)
        closure = page.get_by_role("region", name="Closure closure-1", exact=True)
        for label, minutes in (("From", "5"), ("Until", "8")):
            with user.changing():
                closure.get_by_label(label, exact=True).fill(minutes)
                page.keyboard.press("Enter")
        camera.look_at(r25, closer=2)
        user.step("Measures").evaluate(TO_TOP)
        camera.take("measures")


def rules(studio: Studio) -> None:
    """A rule with its form and its place, and the instant at which it fires in a run."""
    with studio.visit() as camera:
        user, page = camera.user, camera.user.page
        user.open_editor(scenarios.RULED)
        page.get_by_role("button", name="Hide the table").click()
        user.step("Rules").click()
        page.get_by_role("button", name="Show where crosses is").click()
        page.get_by_role("button", name="Change crosses").click()
        expect(page.get_by_role("button", name="Save the rule")).to_be_attached()
        camera.take("rules")
        run_at_once(camera)
        watch_again(camera)
        page.get_by_role("tab", name="Incidents").click()
        page.get_by_role("button", name="triggered rule crosses").click()
        user.map.area.focus()
        for key in ("ArrowDown", "ArrowRight"):  # from behind the small map
            page.keyboard.press(key)
        camera.take("rule-fired")


def signals(studio: Studio) -> None:
    """The program of a light in the editor, and where it is in its cycle in a recording."""
    with studio.visit() as camera:
        user, page = camera.user, camera.user.page
        light = _program(camera)
        light.get_by_role("slider", name="Green of stage 1").focus()
        page.keyboard.press("PageUp")
        page.keyboard.press("Enter")
        expect(light.get_by_role("slider", name="Cycle")).to_have_attribute("aria-valuenow", "89")
        expect(page.get_by_text("All changes saved")).to_be_visible()
        camera.take("signal-splits")
        light.get_by_role("heading", name="Program").evaluate("one => one.scrollIntoView()")
        camera.take("signal-turns", light)
        user.undo.click()
        expect(light.get_by_role("slider", name="Cycle")).to_have_attribute("aria-valuenow", "84")
        page.keyboard.press("Escape")
        run_at_once(camera)
        watch_again(camera)
        page.get_by_label("Moment of the run").fill("188")
        page.get_by_role("tab", name="Lights").click()
        expect(page.get_by_role("heading", name="Stages")).to_be_visible()
        user.map.area.focus()
        for _ in range(3):
            page.keyboard.press("+")
        camera.take("signals")


def signal_parts(studio: Studio) -> None:
    """What a program is made of: a signal group, intergreens, detectors, plans of the day."""
    with studio.visit(height=TALL) as camera:
        light = _program(camera)
        groups = _unfolded(light, "Change signal groups and stages")
        groups.get_by_role("button", name="Change V1L").click()
        group = groups.get_by_role("region", name="Signal group V1L")
        group.evaluate(TO_TOP)
        camera.take("signal-group", group)
        _folded(groups)
        matrix = _unfolded(light, "Change intergreens")
        camera.take("signal-intergreens", matrix)
        _folded(matrix)
        day = _unfolded(light, "Change the plans of the day")
        camera.take("signal-day", day)
    with studio.visit() as camera:
        light = _program(camera)
        camera.look_at(DETECTOR, closer=0)
        _unfolded(light, "Change detectors")
        camera.take("signal-detectors")


def _program(camera: Camera) -> Locator:
    """Open the program of the light of the crossing."""
    user, page = camera.user, camera.user.page
    user.open_editor(scenarios.LIT)
    page.get_by_role("button", name="Hide the table").click()
    user.open_first_light()
    light = page.get_by_role("region", name="Traffic light at")
    expect(light.get_by_role("slider", name="Cycle")).to_be_visible()
    return light


def _unfolded(light: Locator, title: str) -> Locator:
    fold = light.locator("details", has=light.page.get_by_text(title, exact=True))
    fold.locator("summary").first.press("Enter")
    fold.evaluate(TO_TOP)
    return fold


def _folded(fold: Locator) -> None:
    fold.locator("summary").first.press("Enter")
