"""Writes docs/images/page-*.png: every view of the page, light and dark.

``python -m tools.screenshots [FOLDER]``.
"""

from __future__ import annotations

import io
import re
import sys
import tempfile
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, expect

from odscen.app.maps import load_map
from odscen.app.scenarios import SUFFIX, generate, write_scenario
from odscen.app.studies.executors import LocalExecutor
from odscen.app.studies.study_plan import StudyPlan, StudyRuns, StudyVariant
from odscen.app.studies.study_runs import begin_study_of, carry_out_study
from odscen.app.template_scenarios import template_scenario
from odscen.scenario import edits
from odscen.scenario.demand.count_stations import transitions
from odscen.scenario.document.measures_document import SpeedLimit
from odscen.scenario.document.rules_document import StoryRule
from odscen.scenario.document.scenario_document import MapReference, Scenario
from odscen.scenario.placing.region import Region
from odscen.scenario.sampling.generation_settings import GenerationSettings
from odscen.sumo.realize.road_users.planned_positions import planned_positions
from odscen.workspace.shipped import shipped_maps
from odscen.workspace.store import Workspace
from tests.app.test_scenario_imports import ROAD
from tests.browser.pages import OdscenPage, settle
from tests.browser.test_openscenario import REFUSED, drop
from tests.signal_case import program
from tests.signal_case import scenario as lit_scenario
from tools import page as tool

IMAGES = tool.ROOT / "docs/images"
MAP = "town_5x5"
SMALL = "signal_crossing"
WEAVE = "motorway_weave"
COUNTED, LONG, LIT, RULED, TIMED = "morning", "night", "signals", "mid-block", "timed"
SWEPT, STUDY = "cut-in", "rain"
SIZE = {"width": 1280, "height": 800}
LARGEST = 400_000
PATIENCE = 60_000
"""Milliseconds that a view may take to come about on a busy machine."""


class Camera:
    """Takes pictures of one page in one colour scheme."""

    def __init__(self, user: OdscenPage, scheme: str, folder: Path) -> None:
        self.user, self.scheme, self.folder = user, scheme, folder

    def take(self, view: str) -> None:
        """Keep what is seen now, once nothing moves, under the view's name."""
        settle(self.user.page)
        raw = Image.open(io.BytesIO(self.user.page.screenshot())).convert("RGB")
        path = self.folder / f"page-{view}-{self.scheme}.png"
        raw.save(path, optimize=True)
        size = path.stat().st_size
        if size > LARGEST:
            sys.exit(f"{path} has {size} bytes, more than {LARGEST}")
        print(f"{path.name}: {size // 1000} kB")


def main() -> None:
    folder = Path(sys.argv[1]) if sys.argv[1:] else IMAGES
    folder.mkdir(parents=True, exist_ok=True)
    expect.set_options(timeout=PATIENCE)
    with tempfile.TemporaryDirectory() as name:
        workspace = Workspace.open(Path(name))
        for path in shipped_maps():
            workspace.add_map(path)
        made = generate(
            workspace, settings=GenerationSettings(map_name=MAP, seed=5, fill=0.15, roi_segments=7)
        )[0]
        scenario = made.name.removesuffix(SUFFIX)
        _counted(workspace)
        _long(workspace)
        study(workspace)
        _lit(workspace)
        _ruled(workspace)
        _timed(workspace)
        _swept(workspace)
        with tool.served(Path(name)) as server, tool.launched() as browser:
            for scheme in ("light", "dark"):
                _views(browser, server.url, scheme, scenario, folder)
                _traffic_views(browser, server.url, scheme, folder)
                _signal_view(browser, server.url, scheme, folder)
                _timing_views(browser, server.url, scheme, folder)
                _rule_views(browser, server.url, scheme, folder)
                _time_views(browser, server.url, scheme, folder)
                _exchange_views(browser, server.url, scheme, folder)
                _sweep_views(browser, server.url, scheme, folder)
                _study_views(browser, server.url, scheme, folder)


def _counted(workspace: Workspace) -> None:
    """Save a scenario with background traffic and counts, some of which contradict each other."""
    graph = load_map(workspace.map(MAP)).sumo.graph
    scenario = edits.new_scenario(graph, name=COUNTED, roi=graph.segments.ids)
    scenario = edits.set_clock(scenario, clock=7.5 * 3600)
    mix = {"car": 8, "van": 1, "bicycle": 1}
    scenario = edits.set_background(
        scenario, graph, background="others", per_km=2, profile="weekday", mix=mix
    )
    streams = sorted(
        (one, other)
        for one, others in transitions(graph).items()
        for other in others
        if one.startswith("r")
    )[::3]
    rows = [(f"{one}>{other}", 0, 600, 5 + 7 * n % 30) for n, (one, other) in enumerate(streams)]
    scenario = edits.set_counts(scenario, graph, counts="survey", rows=rows)
    _save(workspace, COUNTED, scenario)


def _long(workspace: Workspace) -> None:
    """Save a scenario of hours."""
    graph = load_map(workspace.map(SMALL)).sumo.graph
    scenario = edits.new_scenario(graph, name=LONG, roi=graph.segments.ids)
    scenario = edits.set_simulation(scenario, duration=24 * 3600, step_length=1.0)
    scenario = edits.set_background(scenario, graph, background="others", trips=1200)
    _save(workspace, LONG, scenario)


def _lit(workspace: Workspace) -> None:
    """Save a scenario with the signal program of the guide."""
    info = workspace.map(SMALL).info
    one = lit_scenario(program(), control="actuated", clock=12 * 3600.0, until=300.0)
    reference = MapReference(name=SMALL, sha256=info["sha256"])
    _save(workspace, LIT, one.model_copy(update={"map": reference}))


def _ruled(workspace: Workspace) -> None:
    """Save a scenario in which a pedestrian crosses the road in front of the ego."""
    graph = load_map(workspace.map(SMALL)).sumo.graph
    scenario = edits.new_scenario(graph, name=RULED, roi=graph.segments.ids)
    scenario = edits.set_simulation(scenario, duration=40.0)
    for category, spawn in (("car", "1.0.-2.6"), ("pedestrian", "ped.1.0.-4.28")):
        scenario = edits.add_actor(scenario, graph, category=category, spawn=spawn)
    scenario = edits.set_ego(scenario, actor="car-1")
    rule = StoryRule.model_validate(
        {
            "id": "crosses",
            "actor": "pedestrian-1",
            "when": {"reaches": {"of": "car-1", "place": "1.0.-2.16", "within": 5}},
            "then": [{"walk": {"to": (90.0, -8.0), "speed": 1.5}}],
        }
    )
    _save(workspace, RULED, edits.set_rule(scenario, graph, rule=rule))


def _timed(workspace: Workspace) -> None:
    """Save a scenario in which everything has its time."""
    loaded = load_map(workspace.map(SMALL))
    graph = loaded.sumo.graph
    scenario = edits.new_scenario(graph, name=TIMED, roi=graph.segments.ids)
    scenario = edits.fill_roi(scenario, graph, loaded.usable, share=0.08, seed=4)
    for number, actor in enumerate(scenario.actors):
        scenario = edits.change_actor(scenario, actor.id, depart=3.0 * number)
    assets = workspace.assets()
    region = Region.of(graph, scenario.roi)
    plan = planned_positions(scenario, loaded.sumo, region, assets)
    cars = [n for n, user in enumerate(plan.users) if user.category == "car"]
    spent = {n: plan.time[plan.first[n + 1] - 1] - plan.users[n].depart for n in cars}
    # The car that is longest on its way, early enough.
    ego = plan.users[max(cars[:5], key=lambda n: spent[n])].id
    scenario = edits.set_ego(scenario, actor=ego)
    scenario = edits.add_flow(
        scenario, graph, spawn="1.0.-2.6", per_hour=500, id="from-the-west", begin=10, end=50
    )
    rule = StoryRule.model_validate(
        {
            "id": "brakes",
            "actor": ego,
            "when": {"time": {"after": 18}},
            "then": [{"brake": {"by": 4, "hold": 2}}],
        }
    )
    scenario = edits.set_rule(scenario, graph, loaded.lights, rule=rule)
    slower = SpeedLimit(
        kind="speed_limit", id="slower", places=("r1",), speed=8.3, begin=20, end=60
    )
    scenario = edits.set_measure(scenario, graph, loaded.lights, measure=slower)
    _save(workspace, TIMED, edits.set_simulation(scenario, duration=90.0))


def _swept(workspace: Workspace) -> None:
    """Save the cut-in of the template with two parameters."""
    scenario = template_scenario(workspace, SWEPT, WEAVE, values={}, name=SWEPT)
    scenario = edits.set_simulation(scenario, duration=20.0)
    for name, value, unit, low, high, places in (
        ("ttc", 2.0, "s", 0.4, 4.0, ("rules/cut-in/when/ttc/below",)),
        ("challenger_speed", 11.0, "m/s", 5.0, 15.0, (
            "actors/challenger/speed", "actors/challenger/initial_speed",
            "rules/cruise/then/0/speed/to",
        )),
    ):  # fmt: skip
        scenario = edits.set_parameter(
            scenario, parameter=name, value=value, unit=unit, min=low, max=high
        )
        for place in places:
            scenario = edits.set_formula(scenario, place=place, formula=f"${name}")
    _save(workspace, SWEPT, scenario)


def _save(workspace: Workspace, name: str, scenario: Scenario) -> None:
    write_scenario(scenario, workspace.scenarios / f"{name}{SUFFIX}")


def _traffic_views(browser: Browser, url: str, scheme: str, folder: Path) -> None:
    with browser.new_context(base_url=url, viewport=SIZE, color_scheme=scheme) as context:
        context.add_init_script(f"localStorage.setItem({tool.TOUR_SEEN!r}, 'seen')")
        user = OdscenPage(context.new_page())
        camera = Camera(user, scheme, folder)
        user.open_editor(COUNTED)
        user.step("Traffic").click()
        camera.take("traffic")
        user.step("Run").click()
        user.choose_pace("As fast as possible")
        user.run.click()
        expect(user.result).to_contain_text("finished", timeout=120_000)
        user.page.get_by_role("tab", name="Counts").click()
        expect(user.page.get_by_role("heading", name="counts met")).to_be_visible()
        camera.take("counts")
        user.open_editor(LONG)
        user.step("Run").click()
        user.run.click()
        expect(user.page.get_by_text(re.compile(r"^\d of \d parts completed"))).to_be_visible(
            timeout=120_000
        )
        user.control("Resume later").click()
        expect(user.result).to_contain_text("interrupted")
        camera.take("interrupted")


def _signal_view(browser: Browser, url: str, scheme: str, folder: Path) -> None:
    with browser.new_context(base_url=url, viewport=SIZE, color_scheme=scheme) as context:
        context.add_init_script(f"localStorage.setItem({tool.TOUR_SEEN!r}, 'seen')")
        user = OdscenPage(context.new_page())
        user.open_editor(LIT)
        user.step("Run").click()
        user.choose_pace("As fast as possible")
        user.run.click()
        expect(user.result).to_contain_text("finished", timeout=120_000)
        user.page.get_by_role("button", name="Watch again").click()
        moment = user.page.get_by_label("Moment of the run")
        expect(moment).to_be_visible()
        moment.fill("188")
        user.page.get_by_role("tab", name="Lights").click()
        expect(user.page.get_by_role("heading", name="Stages")).to_be_visible()
        user.map.area.focus()
        for _ in range(3):
            user.page.keyboard.press("+")
        user.page.get_by_role("tab", name="Lights").focus()
        Camera(user, scheme, folder).take("signals")


def _timing_views(browser: Browser, url: str, scheme: str, folder: Path) -> None:
    """The program of a light in the editor: its bar with a green that is longer, and its turns."""
    with browser.new_context(base_url=url, viewport=SIZE, color_scheme=scheme) as context:
        context.add_init_script(f"localStorage.setItem({tool.TOUR_SEEN!r}, 'seen')")
        user = OdscenPage(context.new_page())
        camera = Camera(user, scheme, folder)
        page = user.page
        user.open_editor(LIT)
        user.step("Run").click()
        page.get_by_role("button", name="Hide the table").click()
        page.get_by_role("button", name="Show the signal programs").click()
        light = page.get_by_role("region", name="Traffic light of junction")
        green = light.get_by_role("slider", name="Green of stage 1")
        green.focus()
        page.keyboard.press("PageUp")
        page.keyboard.press("Enter")
        expect(light.get_by_role("slider", name="Cycle")).to_have_attribute("aria-valuenow", "89")
        expect(page.get_by_text("All changes saved")).to_be_visible()
        camera.take("signal-splits")
        light.get_by_role("heading", name="Program").evaluate("one => one.scrollIntoView()")
        camera.take("signal-turns")
        user.undo.click()
        expect(light.get_by_role("slider", name="Cycle")).to_have_attribute("aria-valuenow", "84")


def _rule_views(browser: Browser, url: str, scheme: str, folder: Path) -> None:
    with browser.new_context(base_url=url, viewport=SIZE, color_scheme=scheme) as context:
        context.add_init_script(f"localStorage.setItem({tool.TOUR_SEEN!r}, 'seen')")
        user = OdscenPage(context.new_page())
        camera = Camera(user, scheme, folder)
        user.open_editor(RULED)
        user.step("Rules").click()
        user.page.get_by_role("button", name="Show where crosses is").click()
        user.page.get_by_role("button", name="Change crosses").click()
        expect(user.page.get_by_role("button", name="Save the rule")).to_be_attached()
        camera.take("rules")
        user.step("Run").click()
        user.choose_pace("As fast as possible")
        user.run.click()
        expect(user.result).to_contain_text("finished", timeout=120_000)
        user.page.get_by_role("button", name="Watch again").click()
        user.page.get_by_label("Moment of the run").fill("12")
        user.page.get_by_role("tab", name="Incidents").click()
        user.page.get_by_role("button", name="began rule crosses").click()
        camera.take("rule-fired")


def _time_views(browser: Browser, url: str, scheme: str, folder: Path) -> None:
    with browser.new_context(base_url=url, viewport=SIZE, color_scheme=scheme) as context:
        context.add_init_script(f"localStorage.setItem({tool.TOUR_SEEN!r}, 'seen')")
        user = OdscenPage(context.new_page())
        camera = Camera(user, scheme, folder)
        user.open_editor(TIMED)
        user.step("Road users").click()
        user.open_time_bar()
        moment = user.time_bar.get_by_role("slider", name="Planned moment")
        for _ in range(2):
            moment.press("PageUp")
        expect(user.page.get_by_text("each alone on the road")).to_be_visible()
        camera.take("time")
        user.step("Run").click()
        user.choose_pace("As fast as possible")
        user.run.click()
        expect(user.result).to_contain_text("finished", timeout=120_000)
        user.page.get_by_role("button", name="Watch again").click()
        user.time_bar.get_by_role("button", name="Next event").click()
        user.page.wait_for_timeout(1000)  # the curve is computed in turns
        camera.take("time-run")


def _exchange_views(browser: Browser, url: str, scheme: str, folder: Path) -> None:
    """OpenSCENARIO in, with a part that cannot be taken, and out again."""
    with browser.new_context(base_url=url, viewport=SIZE, color_scheme=scheme) as context:
        context.add_init_script(f"localStorage.setItem({tool.TOUR_SEEN!r}, 'seen')")
        user = OdscenPage(context.new_page())
        camera = Camera(user, scheme, folder)
        user.open_catalogue()
        drop(user.page, {"cut_in.xosc": REFUSED, "road.xodr": ROAD})
        side = user.page.get_by_role("region", name="Report of the import")
        side.get_by_role("button", name="show on the map").first.click()
        camera.take("import")
        side.get_by_role("button", name="Open in the editor").click()
        user.wait_for_editor()
        user.page.get_by_role("banner").get_by_role("button", name="Export").click()
        user.page.get_by_role("menuitem", name="OpenSCENARIO").click()
        expect(user.page.get_by_role("link", name="Download (ZIP)")).to_be_visible()
        camera.take("export")


def _sweep_views(browser: Browser, url: str, scheme: str, folder: Path) -> None:
    with browser.new_context(base_url=url, viewport=SIZE, color_scheme=scheme) as context:
        context.add_init_script(f"localStorage.setItem({tool.TOUR_SEEN!r}, 'seen')")
        user = OdscenPage(context.new_page())
        camera = Camera(user, scheme, folder)
        user.open_editor(SWEPT)
        user.step("Parameters").click()
        expect(user.page.get_by_role("slider", name="ttc")).to_be_visible()
        user.page.get_by_label("Show where Rule cut-in: when ttc below is").click()
        camera.take("parameters")
        if scheme == "light":  # the other finds it there
            user.page.get_by_role("link", name="Sweep the parameters").click()
            user.page.get_by_label("Values of ttc").fill("10")
            user.page.get_by_label("Values of challenger_speed").fill("6")
            user.page.get_by_role("button", name="Plan the sweep").click()
            user.page.get_by_role("button", name="Run 60 cases").click(timeout=120_000)
        else:
            user.page.goto(f"/#/sweep/{SWEPT}/{SWEPT}-1")
        cases = user.page.get_by_role("heading", name="Cases")
        expect(cases).to_be_visible(timeout=600_000)
        camera.take("sweep")


def study(workspace: Workspace) -> None:
    """Carry out a study of one scenario in three kinds of weather."""
    settings = GenerationSettings(map_name=SMALL, seed=5, fill=0.3)
    scenario = generate(workspace, settings=settings)[0].name
    weather = ("WetNoon", "HardRainNoon")
    edited = [({"kind": "set_environment", "preset": one},) for one in weather]
    plan = StudyPlan(
        name=STUDY,
        scenarios=(scenario,),
        seeds=tuple(range(1, 11)),
        variant=tuple(StudyVariant(name=n, edits=e) for n, e in zip(weather, edited, strict=True)),
        run=StudyRuns(until=60.0),
    )
    out = workspace.studies / STUDY
    begin_study_of(workspace, plan, out, beside=workspace.scenarios)
    carry_out_study(out, LocalExecutor(workspace, 2))


def _study_views(browser: Browser, url: str, scheme: str, folder: Path) -> None:
    with browser.new_context(base_url=url, viewport=SIZE, color_scheme=scheme) as context:
        user = OdscenPage(context.new_page())
        user.page.goto(f"/#/study/{STUDY}")
        expect(user.page.get_by_role("table", name="Differences")).to_be_visible()
        Camera(user, scheme, folder).take("study")


def _views(browser: Browser, url: str, scheme: str, scenario: str, folder: Path) -> None:
    with browser.new_context(base_url=url, viewport=SIZE, color_scheme=scheme) as context:
        context.add_init_script(f"localStorage.setItem({tool.TOUR_SEEN!r}, 'seen')")
        user = OdscenPage(context.new_page())
        camera = Camera(user, scheme, folder)
        user.open_catalogue()
        expect(user.maps).to_have_count(len(shipped_maps()))
        user.page.wait_for_load_state("networkidle")  # the cards' pictures
        camera.take("catalogue")
        user.page.get_by_role("button", name=f"Import report of {MAP}").click()
        expect(user.page.get_by_role("dialog")).to_be_visible()
        user.page.wait_for_load_state("networkidle")
        camera.take("conversion")
        user.page.keyboard.press("Escape")
        user.open_editor(scenario)
        for step in ("Region", "Weather and time"):
            user.step(step).click()
            if step == "Region":
                user.page.get_by_role("button", name="Show the region").click()
            camera.take(step.split(maxsplit=1)[0].lower())
        user.step("Road users").click()
        user.names.first.click()
        expect(user.ego).to_be_visible()
        user.page.get_by_role("button", name="Choose on the map").click()
        camera.take("road-users")
        user.page.keyboard.press("Escape")
        user.step("Run").click()
        user.run.click()
        user.wait_until_moving()
        expect(user.figure("Time").first).to_have_text(
            re.compile(r"^0:(0[6-9]|[1-5]\d)"), timeout=30_000
        )
        user.control("Pause").click()
        expect(user.control("Resume")).to_be_enabled()
        camera.take("run")
        user.control("Resume").click()
        user.choose_speed("As fast")
        expect(user.result).to_contain_text("finished", timeout=60_000)
        expect(user.result.get_by_role("link", name="Full report")).to_be_visible()
        camera.take("result")
        user.page.get_by_role("tab", name="Charts").click()
        expect(user.page.get_by_text("Arrivals", exact=True)).to_be_visible()
        user.page.wait_for_load_state("networkidle")
        camera.take("charts")
        user.page.get_by_role("tab", name="Runs").click()
        camera.take("runs")


if __name__ == "__main__":
    main()
