"""axe finds nothing in any view, in both languages, light and dark, wide and narrow; the keyboard
reaches all.

No text is cut off, at 200 % of its size neither. A picture of each view is kept under
build/browser/views.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest
from playwright.sync_api import Page, expect

from odscen.app.generation import generate
from odscen.app.running import batches
from odscen.app.scenarios import SUFFIX
from odscen.experiments.comparison_page import comparison_page
from odscen.experiments.comparisons import compare_runs, read_runs
from odscen.experiments.plan import StudyPlan, StudyRuns, StudyVariant
from odscen.experiments.studies import begin_study_of, carry_out_study
from odscen.experiments.work import LocalExecutor
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from odscen.scenario.sampling.generation_settings import GenerationSettings
from tests.browser.clipped_text import clipped_texts
from tests.browser.conftest import ARTEFACTS, CROSSING
from tests.browser.pages import FAILED, OdscenPage, settle
from tests.browser.test_signals import open_program, saved
from tools import page as tool

AXE = tool.ROOT / "frontend/node_modules/axe-core/axe.min.js"

# Composite widgets have one stop of their own; hidden helpers double what has keys already.
UNREACHABLE = """() => [...document.querySelectorAll("a[href], button, input, select, textarea")]
    .filter(e => e.checkVisibility({visibilityProperty: true}) && !e.disabled && e.tabIndex < 0)
    .filter(e => !e.closest(["menu", "listbox", "radiogroup", "tablist"]
        .map(role => `[role=${role}]`).join() + ",[aria-hidden=true]"))
    .map(e => e.outerHTML.slice(0, 200))"""


SIZES = {"1440": (1440, 900), "1024": (1024, 768), "390": (390, 844), "zoomed": (720, 450)}
"""Pixels of the windows in which each view is looked at; the last is the first at 200 %."""


LANGUAGES = ("en", "de")
PREFER = """language => {
    const [key, newValue] = ["odscen.preferences", JSON.stringify({language})];
    localStorage.setItem(key, newValue);
    dispatchEvent(new StorageEvent("storage", {key, newValue}));
}"""
"""What the page sees when another tab chooses a language."""


class Inspector:
    """Looks at one view after the other and collects what is wrong."""

    def __init__(self, user: OdscenPage, scheme: str) -> None:
        self.page: Page = user.page
        self.scheme = scheme
        self.wrong = Wrongs()

    def look(self, view: str) -> None:
        """Look at what is shown now in a window of each size, in each language if it has both."""
        usual = self.page.viewport_size
        assert usual is not None
        first, *others = LANGUAGES if self.page.url.startswith("http") else ("en",)
        self._look_at_sizes(f"{view}-{first}")
        for language in others:
            self._prefer(language)
            self._look_at_sizes(f"{view}-{language}")
        self.page.set_viewport_size(usual)
        if others:
            self._prefer(first)

    def _prefer(self, language: str) -> None:
        self.page.evaluate(PREFER, language)
        self.page.wait_for_function(
            "wanted => document.documentElement.lang === wanted", arg=language
        )

    def _look_at_sizes(self, view: str) -> None:
        for size, (width, height) in SIZES.items():
            self.page.set_viewport_size({"width": width, "height": height})
            self._look(f"{view}-{size}")

    def _look(self, view: str) -> None:
        settle(self.page)
        ARTEFACTS.joinpath("views").mkdir(parents=True, exist_ok=True)
        self.page.screenshot(path=ARTEFACTS / f"views/{view}-{self.scheme}.png")
        self.page.evaluate(AXE.read_text(encoding="utf-8"))
        found: list[dict[str, Any]] = self.page.evaluate(
            "async () => (await axe.run({resultTypes: ['violations']})).violations"
        )
        for rule in found:
            for node in rule["nodes"]:
                message = node["any"][0]["message"] if node["any"] else rule["help"]
                self.wrong.append(view, f"{rule['id']}: {node['html'][:120]} {message}")
        for element in self.page.evaluate(UNREACHABLE):
            self.wrong.append(view, f"no keyboard reaches {element}")
        for text in clipped_texts(self.page):
            self.wrong.append(view, f"cut off: {text}")


class Wrongs:
    """What is wrong, and in which views."""

    def __init__(self) -> None:
        self.views: dict[str, list[str]] = {}

    def append(self, view: str, what: str) -> None:
        self.views.setdefault(what, []).append(view)

    def __str__(self) -> str:
        return "".join(f"\n{what}\n    in {', '.join(views)}" for what, views in self.views.items())


@pytest.fixture(params=["light", "dark"])
def scheme(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def visit(scheme: str, open_page: Callable[..., OdscenPage]) -> Iterator[Callable[..., Any]]:
    """Opens a page in one colour scheme, with an inspector; at the end nothing may be wrong."""
    inspectors: list[Inspector] = []

    def opened(url: str, **options: Any) -> tuple[OdscenPage, Inspector]:
        user = open_page(url, color_scheme=scheme, **options)
        inspectors.append(Inspector(user, scheme))
        return user, inspectors[-1]

    yield opened
    assert not any(one.wrong.views for one in inspectors), "".join(
        str(one.wrong) for one in inspectors
    )


@pytest.mark.slow
def test_the_first_screen(
    visit: Callable[..., Any], tmp_path_factory: pytest.TempPathFactory
) -> None:
    with tool.served(tmp_path_factory.mktemp("empty")) as server:
        user, inspector = visit(server.url)
        user.open_catalogue()
        inspector.look("catalogue-empty")


@pytest.mark.slow
def test_the_catalogue(visit: Callable[..., Any], served: tool.Served, sampled: str) -> None:
    user, inspector = visit(served.url)
    user.open_catalogue()
    expect(user.page.get_by_role("link", name=sampled, exact=True)).to_be_visible()
    inspector.look("catalogue")
    user.remove(CROSSING).click()
    expect(user.page.get_by_role("dialog")).to_be_visible()
    inspector.look("catalogue-remove")


@pytest.mark.slow
def test_studies(visit: Callable[..., Any], served: tool.Served, sampled: str) -> None:
    workspace = Workspace.open(served.workspace)
    edits = ({"kind": "set_environment", "preset": "HardRainNoon"},)
    plan = StudyPlan(
        name="rain",
        scenarios=(f"{sampled}{SUFFIX}",),
        seeds=(1, 2),
        variant=(StudyVariant(name="rain", edits=edits),),
        run=StudyRuns(until=20.0),
    )
    out = workspace.studies / "rain"
    begin_study_of(workspace, plan, out, beside=workspace.scenarios)
    carry_out_study(out, LocalExecutor(workspace, 2))
    user, inspector = visit(served.url)
    user.page.goto("/#/studies")
    expect(user.page.get_by_role("button", name="Start the study")).to_be_visible()
    inspector.look("studies")
    user.page.get_by_role("link", name="rain", exact=True).click()
    expect(user.page.get_by_role("table", name="Differences")).to_be_visible()
    inspector.look("study")


@pytest.mark.slow
def test_the_program_of_a_light_that_can_be_changed(
    visit: Callable[..., Any], served: tool.Served
) -> None:
    user, inspector = visit(served.url)
    light = open_program(user, saved(served))
    inspector.look("editor-signals")
    for summary in (
        "Shortest and longest greens",
        "Signal groups and their movements",
        "Change signal groups and stages",
        "Change intergreens",
        "Change detectors",
        "Change the plans of the day",
    ):
        light.get_by_text(summary, exact=True).click()
    light.get_by_role("button", name="Change V1L").click()
    inspector.look("editor-signals-open")


@pytest.mark.slow
def test_the_editor(visit: Callable[..., Any], served: tool.Served, sampled: str) -> None:
    user, inspector = visit(served.url)
    user.page.goto("/#/edit/nowhere")
    expect(user.page.get_by_role("alert")).to_be_visible()
    inspector.look("editor-nowhere")
    user.open_catalogue()
    user.new_scenario(CROSSING).click()
    user.wait_for_editor()
    inspector.look("editor-new")
    user.open_editor(sampled)
    for step in (
        "Map",
        "Region",
        "Weather and time",
        "Road users",
        "Demand",
        "Traffic lights",
        "Run",
    ):
        user.step(step).click()
        inspector.look("editor-" + step.lower().replace(" ", "-"))
    user.step("Weather and time").click()
    user.page.get_by_role("button", name="Fine-tune").click()
    inspector.look("editor-weather-fine")
    user.step("Road users").click()
    user.names.first.click()
    expect(user.ego).to_be_visible()
    inspector.look("editor-road-user")
    user.kind("Pedestrian").click()
    inspector.look("editor-placing")
    user.help.click()
    expect(user.page.get_by_role("dialog")).to_be_visible()
    inspector.look("editor-keys")
    user.page.get_by_role("tab", name="Glossary").click()
    inspector.look("editor-glossary")
    user.page.keyboard.press("Escape")
    for entry, view in (("Rename", "rename"), ("Save as", "copy"), ("Open another", "open")):
        user.choose_in_menu(entry)
        expect(user.page.get_by_role("dialog")).to_be_visible()
        inspector.look(f"editor-{view}")
        user.page.keyboard.press("Escape")
        expect(user.page.get_by_role("dialog")).to_have_count(0)


@pytest.mark.slow
def test_measures_and_public_transport(
    visit: Callable[..., Any], served: tool.Served, sampled: str
) -> None:
    user, inspector = visit(served.url)
    user.open_editor(sampled)
    user.step("Measures").click()
    with user.changing():
        user.page.get_by_label("or type its name").fill("r2")
        user.page.keyboard.press("Enter")
    user.choose("Kind of measure", "Signal out of order")
    inspector.look("editor-measures")
    user.step("Public transport").click()
    user.page.get_by_role("button", name="Add stops on the map").click()
    with user.changing():
        user.map.click(user.graph.middle("r2"))
    user.page.get_by_role("button", name="Change stop-1").click()
    user.page.get_by_role("button", name="Add a line").click()
    inspector.look("editor-public-transport")


@pytest.mark.slow
def test_the_study(visit: Callable[..., Any], served: tool.Served, sampled: str) -> None:
    user, inspector = visit(served.url)
    user.open_editor(sampled)
    user.step("Analysis").click()
    user.choose("Kind of station", "Travel-time section")
    user.page.get_by_role("button", name="Choose it on the map").click()
    user.map.click(user.graph.middle("r2"))
    with user.changing():
        user.map.click(user.graph.middle("r3"))
    user.choose("Analysis interval", "Another")
    inspector.look("editor-study")


@pytest.mark.slow
def test_the_time_bar(visit: Callable[..., Any], served: tool.Served, sampled: str) -> None:
    user, inspector = visit(served.url)
    user.open_editor(sampled)
    user.step("Road users").click()
    user.open_time_bar()
    inspector.look("editor-time")
    user.time_bar.get_by_role("slider", name="Planned moment").press("PageUp")
    expect(user.page.get_by_text("each alone on the road")).to_be_visible()
    inspector.look("editor-planned")


@pytest.mark.slow
def test_an_open_form_of_a_rule(
    visit: Callable[..., Any], served: tool.Served, sampled: str
) -> None:
    user, inspector = visit(served.url)
    user.open_editor(sampled)
    user.step("Rules").click()
    user.page.get_by_role("button", name="Add a rule").click()
    user.choose("Condition", "Any of several holds")
    user.page.get_by_role("button", name="Add a condition").click()
    user.page.get_by_role("button", name="When it counts").first.click()
    user.choose("Condition 2", "Not (negation)")
    user.choose("Action", "Follow a path")
    for point in ("0, 5", "8, 20"):
        user.page.get_by_label("Points: one more", exact=True).fill(point)
        user.page.keyboard.press("Enter")
    user.choose("How fast", "A speed at each point")
    user.page.get_by_role("button", name="Add next action").click()
    user.page.get_by_role("button", name="Add parallel action to action 2").click()
    user.choose("Action 2, part 2", "Set its lights")
    inspector.look("editor-rule-form")
    with user.changing():
        user.page.get_by_role("button", name="Add the rule").click()
    inspector.look("editor-rules")


@pytest.mark.slow
def test_traffic_and_counts(
    visit: Callable[..., Any], served: tool.Served, sampled: str, tmp_path: Path
) -> None:
    user, inspector = visit(served.url)
    user.open_editor(sampled)
    user.step("Demand").click()
    with user.changing():
        user.page.get_by_role("button", name="Add background traffic").click()
    user.choose("Day profile", "Weekday")
    user.page.get_by_role("button", name="Change the mix").click()
    user.page.get_by_role("button", name="Whole day on the whole map").click()
    user.page.get_by_role("button", name="Show the day profiles").click()
    inspector.look("editor-traffic-day")
    user.page.get_by_role("button", name="Import a table").click()
    table = tmp_path / "table.csv"
    place = user.document()["roi"][0]
    good = f"place,begin,end,count\n{place},0,300,10\n{place},300,600,0\n"
    for text in ("place,begin,end\n", good):
        table.write_text(text)
        user.choose("Contents of the table", "Counts")
        with user.page.expect_file_chooser() as chooser:
            user.page.get_by_role("button", name="Choose a table").click()
        chooser.value.set_files(table)
        if text != good:
            expect(user.page.get_by_text("was not imported")).to_be_visible()
            inspector.look("editor-traffic-refused")
    expect(user.page.get_by_text("is imported")).to_be_visible()
    inspector.look("editor-traffic-counts")
    user.step("Run").click()
    user.page.get_by_role("button", name="Estimate disk and memory").click()
    expect(user.page.get_by_text("of memory")).to_be_visible()
    inspector.look("editor-run-forecast")
    user.choose_pace("As fast as possible")
    user.run.click()
    expect(user.result).to_contain_text("finished", timeout=60_000)
    user.result.get_by_text("Download the results").click()
    expect(user.result.get_by_role("link", name="Key figures")).to_be_visible()
    inspector.look("run-files")
    user.page.get_by_role("tab", name="Counts").click()
    user.page.get_by_role("button", name="Show all counts").click()
    expect(user.page.get_by_role("table", name="All counts")).to_be_visible()
    inspector.look("run-counts")


@pytest.mark.slow
def test_a_long_run(visit: Callable[..., Any], served: tool.Served, sampled: str) -> None:
    user, inspector = visit(served.url)
    user.open_editor(sampled)
    user.step("Demand").click()
    with user.changing():
        user.page.get_by_role("button", name="Add background traffic").click()
    user.step("Run").click()
    user.choose("Duration: unit", "hours")
    with user.changing():
        user.page.get_by_role("textbox", name="Duration", exact=True).fill("6")
        user.page.keyboard.press("Enter")
    user.choose_pace("Real time")
    user.run.click()
    user.wait_until_moving()
    inspector.look("run-long")
    user.control("Pause and save").click()
    expect(user.result).to_contain_text("interrupted")
    inspector.look("run-interrupted")


@pytest.mark.slow
def test_the_tour(visit: Callable[..., Any], served: tool.Served, sampled: str) -> None:
    user, inspector = visit(served.url, tour=True)
    user.open_editor(sampled)
    for number in (1, 2, 3):
        expect(user.tour).to_contain_text(f"{number} of 3")
        inspector.look(f"tour-{number}")
        user.tour.get_by_role("button", name="Done" if number == 3 else "Next").click()
    expect(user.tour).to_have_count(0)
    user.page.reload()
    user.wait_for_editor()
    expect(user.tour).to_have_count(0)


@pytest.mark.slow
def test_the_run(visit: Callable[..., Any], served: tool.Served, sampled: str) -> None:
    user, inspector = visit(served.url)
    user.page.goto(f"/#/run/{sampled}/nowhere")
    expect(user.page.get_by_role("alert")).to_be_visible()
    inspector.look("run-nowhere")
    user.open_editor(sampled)
    user.step("Run").click()
    user.run.click()
    user.wait_until_moving()
    inspector.look("run-live")
    user.control("Pause").click()
    expect(user.control("Resume")).to_be_enabled()
    inspector.look("run-paused")
    user.control("Resume").click()
    user.choose_speed("As fast")
    expect(user.result).to_contain_text("finished")
    expect(user.result.get_by_role("link", name="Full report")).to_be_visible()
    inspector.look("run-finished")
    user.page.get_by_role("tab", name="Lights").click()
    expect(user.page.get_by_role("heading", name="Stages")).to_be_visible()
    inspector.look("run-lights")
    user.page.get_by_role("button", name="Back to the editor").last.click()
    user.wait_for_editor()
    user.open_first_light()
    expect(user.page.get_by_role("heading", name="Stages")).to_be_visible()
    inspector.look("editor-light")


@pytest.fixture(scope="module")
def written(one_map: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Report of a run, and the comparison of it with another, both by two seeds."""
    root = tmp_path_factory.mktemp("written")
    workspace = Workspace.open(one_map)
    sides = {}
    for side, fill in (("a", 0.25), ("b", 0.4)):
        made = generate(
            workspace,
            out=root / "made" / side,
            settings=GenerationSettings(map_name=CROSSING, seed=5, fill=fill),
        )
        for seed in (1, 2):
            batches.run_many(
                workspace, made, out=root / side / str(seed), settings=RunSettings(seed=seed)
            )
            run = next((root / side / str(seed)).iterdir())
            run.rename(root / side / f"seed-{seed}")
        sides[side] = read_runs(root / side, workspace)
    comparison = root / "comparison.html"
    comparison.write_text(comparison_page(compare_runs(sides["a"], sides["b"])), encoding="utf-8")
    return {"report": root / "a/seed-1/report.html", "comparison": comparison}


@pytest.mark.slow
@pytest.mark.parametrize("view", ["report", "comparison"])
def test_the_pages_that_are_files(
    visit: Callable[..., Any], written: dict[str, Path], view: str
) -> None:
    user, inspector = visit("about:blank")
    user.page.goto(written[view].as_uri())
    if view == "report":
        inspector.look("report-folded")
        user.page.get_by_role("button", name="Open all parts").click()
    wanted = {
        "report": ("In brief", "Key figures", "Emissions and fuel"),
        "comparison": ("Summary", "Largest changes by place", "Macroscopic fundamental diagram"),
    }
    for heading in wanted[view]:
        expect(user.page.get_by_role("heading", name=heading)).to_be_visible()
    if view == "report":
        user.page.get_by_label("Mean speed of vehicles by place").check()
    inspector.look(view)


@pytest.mark.slow
def test_a_failed_run(visit: Callable[..., Any], served: tool.Served, sampled: str) -> None:
    user, inspector = visit(served.url)
    user.open_editor(sampled)
    user.step("Run").click()
    server = psutil.Process(served.process.pid)
    before = set(server.children(recursive=True))
    user.run.click()
    user.wait_until_moving()
    for child in set(server.children(recursive=True)) - before:
        child.kill()
    expect(user.result).to_contain_text(FAILED)
    inspector.look("run-failed")
