"""The editor in headless Chromium, drawn in software, with 2,000 road users on a town.

Aims: 50 frames a second while the map is panned, zoomed or a road user is dragged; a change of
road users, region, measures, rules, signals or criteria shown 100 ms after the key or the click
that asks for it; a region filled with 2,000 in 3 s, with a word on its progress. When a change is
saved, and the part of the server, is told apart.
"""

from __future__ import annotations

import itertools
import statistics
import tempfile
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
from playwright.sync_api import expect

from bench.canvas import TOWN
from bench.common import shared_maps
from odscen.app.generation import generate
from odscen.app.scenarios import SUFFIX
from odscen.maps.store import Workspace
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.document.scenario_document import Scenario
from odscen.scenario.sampling.generation_settings import GenerationSettings
from tests.browser.pages import OdscenPage
from tools import page as tool

ACTORS = 2000
CHANGES = 10
FILLS = 3
STEPS = 90
DENSITY, SLIDER_STEP = 75, 5
"""Percent of the most that fit the region, some 2,000, and of a step of the slider."""

_PROBE = """
window.odscenFrames = [];
const tick = now => { window.odscenFrames.push(now); requestAnimationFrame(tick); };
requestAnimationFrame(tick);
window.odscenChange = {};
window.odscenShown = 'table[aria-rowcount]';
const watch = () => {
  const begun = performance.now();
  const rows = () => {
    const shown = document.querySelector(window.odscenShown);
    return shown && shown.getAttribute('aria-rowcount') + shown.textContent;
  };
  const before = rows();
  const change = window.odscenChange = {};
  let asked = false;
  const note = what => requestAnimationFrame(() => { change[what] = performance.now() - begun; });
  const look = () => {
    if (window.odscenChange !== change) return;
    const saved = document.getElementById('head-slot').innerText.includes('All changes saved');
    if (!saved) asked = true;
    if (!change.sawRows && rows() !== before) { change.sawRows = true; note('shown'); }
    const said = document.querySelector('.map-hint')?.textContent.includes('Applying the change');
    if (said && !change.sawWord) { change.sawWord = true; note('said'); }
    if (asked && saved) note('saved');
    else requestAnimationFrame(look);
  };
  look();
};
addEventListener('keydown', watch, true);
addEventListener('pointerdown', watch, true);
"""
"""Notes each frame, and how long after a key or a click its change is seen in what is watched for
it (``odscenShown``), is saved, and whether it is said meanwhile that it is being made."""


def main() -> None:
    shared = shared_maps()
    if shared is None:
        print(f"no folder of real maps with {TOWN} here")
        return
    with tempfile.TemporaryDirectory() as name:
        workspace = Workspace.open(Path(name))
        workspace.add_map(shared / TOWN)
        scenario, number = _crowd(workspace)
        with tool.served(Path(name)) as server, tool.launched() as browser:
            context = browser.new_context(
                base_url=server.url, viewport={"width": 1360, "height": 850}
            )
            context.set_default_timeout(120_000)
            expect.set_options(timeout=120_000)
            context.add_init_script(f"localStorage.setItem({tool.TOUR_SEEN!r}, 'seen')")
            context.add_init_script(_PROBE)
            user = OdscenPage(context.new_page())
            user.open_editor(scenario)
            expect(user.names.first).to_be_visible()
            print(f"{Path(TOWN).stem}: {number} road users (wanted {ACTORS})")
            _measure(user)


def _crowd(workspace: Workspace) -> tuple[str, int]:
    """Name of a scenario with many road users, and how many it has."""
    settings = GenerationSettings(map_name=Path(TOWN).stem, seed=5, fill=0.9, roi_segments=400)
    path = generate(workspace, settings=settings)[0]
    made = loads(path.read_text(encoding="utf-8"))
    assert isinstance(made, Scenario)
    kept = made.model_copy(update={"actors": made.actors[:ACTORS]})
    path.write_text(dumps(kept), encoding="utf-8")
    return path.name.removesuffix(SUFFIX), len(kept.actors)


def _measure(user: OdscenPage) -> None:
    page, mouse = user.page, user.page.mouse
    box = user.map.area.bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def sway(held: Callable[[int], tuple[float, float]]) -> Callable[[], None]:
        def move() -> None:
            for k in range(STEPS):
                mouse.move(*held(k))

        return move

    def wheel() -> None:
        for k in range(STEPS):
            mouse.wheel(0, -40 if k % 30 < 15 else 40)

    def pan(k: int) -> tuple[float, float]:
        return x - 150 + 3 * k, y + 60 - k

    for what, before in (("whole map", "0"), ("3 px/m", "+++++")):
        user.map.area.focus()
        for key in before:
            page.keyboard.press(key)
        mouse.move(x - 150, y + 60)
        mouse.down()
        _frames(user, f"panning, {what}", sway(pan))
        mouse.up()
    mouse.move(x, y)
    _frames(user, "zooming", wheel)
    user.names.first.click()
    page.wait_for_timeout(1500)
    actor = user.document()["actors"][0]
    at = user.map.at(*user.graph.place(actor["spawn"]))
    mouse.move(*at)
    mouse.down()
    _frames(user, "dragging a car", sway(lambda k: (at[0] + k / 3, at[1] + k / 5)))
    mouse.move(*at)
    mouse.up()
    user.names.first.click()
    with user.changing():
        page.keyboard.press("Delete")
    _changes(user)


def _frames(user: OdscenPage, what: str, move: Callable[[], None]) -> None:
    """Frames per second while something moves, and the longest pause."""
    page = user.page
    begun = page.evaluate("odscenFrames.length")
    move()
    times: list[float] = page.evaluate(f"odscenFrames.slice({begun})")
    pauses = [after - before for before, after in pairwise(times)]
    print(
        f"  {what:20} {1000 * len(pauses) / sum(pauses):5.1f} frames/s (aim 50),"
        f" longest pause {max(pauses):.0f} ms"
    )


def _changes(user: OdscenPage) -> None:
    """Milliseconds from a key or a click that asks for a change to its picture, by what it does."""
    page = user.page

    def take_back() -> None:
        # In a field the keys would undo what was typed.
        with user.changing():
            user.undo.click()

    keys = itertools.cycle(("Control+z", "Control+y"))
    _timed(user, "removal undone, redone", lambda: page.keyboard.press(next(keys)))
    user.names.nth(5).click()
    page.wait_for_timeout(1500)
    steps = itertools.cycle(".,")
    _timed(user, "moved by a key", lambda: page.keyboard.press(next(steps)))
    page.keyboard.press("Escape")
    page.keyboard.press("1")
    point = user.map.at(*_free(user))
    _timed(user, "placed by a click", lambda: page.mouse.click(*point), take_back)
    page.keyboard.press("Escape")
    _changes_of_steps(user, take_back)
    _filled(user)


def _changes_of_steps(user: OdscenPage, take_back: Callable[[], object]) -> None:
    """The same of what the steps hold; the heading of a step, or what is open, tells of it."""
    page = user.page

    def opened(step: str, shown: str = ".step-head[aria-expanded=true]") -> None:
        page.evaluate("shown => { window.odscenShown = shown; }", shown)
        user.step(step).click()
        page.wait_for_timeout(1500)

    opened("Region")
    user.map.area.focus()
    page.keyboard.press("0")
    spot = user.map.at(*user.graph.middle(_spare(user)))
    _timed(user, "segment of the region", lambda: page.mouse.click(*spot), take_back)

    opened("Measures")
    place = page.get_by_role("textbox", name="or type its name")
    roads = [one for one in user.document()["roi"] if one.startswith("r")]

    def close_road() -> None:
        place.fill(roads[0])
        place.press("Enter")

    _timed(user, "measure added", close_road, take_back)
    with user.changing():
        place.fill(roads[0])
        place.press("Enter")
    page.evaluate("window.odscenShown = '.step-body'")
    ends = page.get_by_label("Until")
    lengths = itertools.count(60)

    def end_later() -> None:
        ends.fill(str(next(lengths)))
        ends.press("Enter")

    _timed(user, "measure changed", end_later)

    opened("Rules")

    def add_rule() -> None:
        page.get_by_role("button", name="Add a rule").click()
        page.get_by_role("button", name="Add the rule").click()

    _timed(user, "rule added", add_rule, take_back)

    opened("Criteria")
    add = page.get_by_role("button", name="Add the criterion")
    _timed(user, "criterion added", add.click, take_back)

    opened("Traffic lights", ".step-body")
    controls = itertools.cycle(("Actuated", "Fixed-time"))
    group = page.get_by_role("radiogroup", name="Signal control")

    def control() -> None:
        group.get_by_text(next(controls), exact=True).click()

    _timed(user, "control of signals", control)


def _filled(user: OdscenPage) -> None:
    """From the click that fills the region until all are shown, and what is said meanwhile."""
    page = user.page
    user.step("Road users").click()
    page.get_by_role("button", name="Generate traffic").click()
    density = page.get_by_role("slider", name="Density, percent of the maximum")
    density.press("End")
    for _ in range((100 - DENSITY) // SLIDER_STEP):
        density.press("ArrowLeft")
    page.evaluate("window.odscenShown = 'table[aria-rowcount]'")
    button = page.get_by_role("button", name="Fill the region", exact=True)
    for seed in range(FILLS):
        page.get_by_role("textbox", name="Random seed").fill(str(seed))
        page.evaluate("window.odscenChange = {}")
        button.click()
        page.wait_for_function("odscenChange.shown && odscenChange.saved")
        change = page.evaluate("odscenChange")
        said = change.get("said")
        word = "no word on it" if said is None else f"said after {said:.0f} ms"
        print(
            f"  {len(user.document()['actors'])} filled in, shown after {change['shown']:.0f} ms"
            f" (aim 3000 for {ACTORS}), {word}"
        )
        page.wait_for_timeout(3000)


def _spare(user: OdscenPage) -> str:
    """A segment that can be taken out of the region: nobody starts, passes or ends there."""
    columns = user.graph.columns
    rows = {lane: row for row, lane in enumerate(columns["lane_keys"])}
    document = user.document()
    used = set()
    for actor in document["actors"]:
        for node in (actor["spawn"], actor["goal"], *actor["via"]):
            if node is not None and not node.startswith("ped."):
                lane, _, number = node.rpartition(".")
                used.add(columns["segment"][columns["first_node"][rows[lane]] + int(number)])
    removable = user.get(f"/scenarios/{user.scenario}/roi")["removable"]
    segments = [one["id"] for one in columns["segments"]]
    free = [one for one in removable if segments.index(one) not in used]
    return max(free, key=lambda one: columns["segment"].count(segments.index(one)))


def _free(user: OdscenPage) -> tuple[float, float]:
    """A start in sight on which a car may be put, with room around it."""
    document, graph = user.document(), user.graph
    middle_x, middle_y, scale = user.map.view()
    taken = np.array([graph.place(actor["spawn"]) for actor in document["actors"]])
    columns = graph.columns
    inside = {row for row, one in enumerate(columns["segments"]) if one["id"] in document["roi"]}
    return next(
        (x, y)
        for row, (x, y) in enumerate(zip(columns["x"], columns["y"], strict=True))
        if columns["spawnable"][row]
        and columns["segment"][row] in inside
        and columns["lane_types"][columns["lane"][row]] == "driving"
        and max(abs(x - middle_x), abs(y - middle_y)) * scale < 200
        and np.hypot(*(taken - (x, y)).T).min() > 6
    )


def _timed(
    user: OdscenPage,
    what: str,
    change: Callable[[], object],
    take_back: Callable[[], object] = lambda: None,
) -> None:
    page = user.page
    times: list[tuple[float, float, float]] = []
    for _ in range(CHANGES):
        page.evaluate("performance.clearResourceTimings()")
        page.evaluate("window.odscenChange = {}")
        change()
        page.wait_for_function("odscenChange.shown && odscenChange.saved")
        shown, saved = page.evaluate("[odscenChange.shown, odscenChange.saved]")
        served = page.evaluate(
            "performance.getEntriesByType('resource').filter("
            "one => /(undo|redo|edits)\\?/.test(one.name)).map(one => one.duration)[0] ?? NaN"
        )
        times.append((shown, saved, served))
        take_back()
        page.wait_for_timeout(1000)  # for the problems
    shown, saved, served = (statistics.median(each) for each in zip(*times, strict=True))
    print(
        f"  {what:22} shown after {shown:.0f} ms, worst {max(each[0] for each in times):.0f} ms"
        f" (aim 100), saved after {saved:.0f} ms, of which the server's answer {served:.0f} ms"
    )
