"""What happens in the midst of a piece of work, and that nothing is lost by it."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Locator, expect

from odscen.app.maps import load_map
from odscen.app.scenarios import SUFFIX
from odscen.base.categories import Category
from odscen.lanegraph.query import node_id
from odscen.maps.store import Workspace
from odscen.scenario import edits
from odscen.scenario.document.json_form import dumps
from tests.browser.conftest import CROSSING
from tests.browser.fault_line import FaultLine
from tests.browser.pages import OdscenPage
from tests.browser.test_signals import LIGHT
from tests.signal_case import JUNCTION

OUTSIDE = "r4"
"""The arm of the crossing that is not in the region at first."""
START = (116.0, 0.0)
"""Metres: on a lane that leads west to the crossing."""
MEASURE = "r2"
BOUND = "12"
AWAY = 10.0
"""Metres by which a car is dragged."""


@pytest.fixture(scope="module")
def line(one_map: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[FaultLine]:
    root = tmp_path_factory.mktemp("line") / "workspace"
    shutil.copytree(one_map, root)
    made = FaultLine(root)
    yield made
    made.close()


@pytest.fixture
def scenario(line: FaultLine, request: pytest.FixtureRequest) -> str:
    """Name of a scenario with a car, on all arms of the crossing but one."""
    workspace = Workspace.open(line.server.workspace)
    graph = load_map(workspace.map(CROSSING)).sumo.graph
    of = f"{request.node.callspec.id}-{request.node.originalname[5:20]}"
    name = re.sub(r"[\W_]+", "-", of).strip("-")
    roi = [one for one in graph.segments.ids if one != OUTSIDE]
    made = edits.new_scenario(graph, name=name, roi=roi)
    away = np.hypot(graph.lanes.x - START[0], graph.lanes.y - START[1])
    spawn = node_id(graph, int(np.argmin(away)))
    made = edits.add_actor(made, graph, category=Category.CAR, spawn=spawn, ego=True)
    made = edits.set_simulation(made, duration=20.0)
    workspace.scenarios.mkdir(exist_ok=True)
    (workspace.scenarios / f"{name}{SUFFIX}").write_text(dumps(made), encoding="utf-8")
    return name


class Work:
    """Something that is begun, interrupted and finished."""

    def begin(self, user: OdscenPage) -> None:
        raise NotImplementedError

    def finish(self, user: OdscenPage) -> None:
        raise NotImplementedError

    def resume(self, user: OdscenPage) -> None:
        """Go on after another view was shown; what was held by the mouse is begun anew."""
        self.begin(user)

    def done(self, document: dict[str, Any]) -> bool:
        raise NotImplementedError


class DragCar(Work):
    def begin(self, user: OdscenPage) -> None:
        user.step("Road users").click()
        user.names.first.click()
        self.spawn = user.document()["actors"][0]["spawn"]
        x, y = user.graph.place(self.spawn)
        user.page.mouse.move(*user.map.at(x, y))
        user.page.mouse.down()
        user.page.mouse.move(*user.map.at(x - AWAY, y), steps=5)

    def finish(self, user: OdscenPage) -> None:
        user.page.mouse.up()

    def done(self, document: dict[str, Any]) -> bool:
        return bool(document["actors"][0]["spawn"] != self.spawn)


class DrawRegion(Work):
    def begin(self, user: OdscenPage) -> None:
        user.step("Region").click()
        user.map.area.press("0")
        columns = user.graph.columns
        row = [one["id"] for one in user.graph.segments].index(OUTSIDE)
        rows = np.flatnonzero(np.asarray(columns["segment"]) == row)
        points = np.column_stack((columns["x"], columns["y"]))[rows]
        low, high = points.min(axis=0) - 3, points.max(axis=0) + 3
        user.page.keyboard.down("Shift")
        user.page.mouse.move(*user.map.at(*low))
        user.page.mouse.down()
        user.page.mouse.move(*user.map.at(*high), steps=5)

    def finish(self, user: OdscenPage) -> None:
        user.page.mouse.up()
        user.page.keyboard.up("Shift")

    def done(self, document: dict[str, Any]) -> bool:
        return OUTSIDE in document["roi"]


class WriteRule(Work):
    def begin(self, user: OdscenPage) -> None:
        user.step("Rules").click()
        user.page.get_by_role("button", name="Add a rule").click()
        user.choose("Condition", "Distance travelled")
        user.choose("Bound", "Above")
        user.page.get_by_label("Above", exact=True).fill(BOUND)

    def finish(self, user: OdscenPage) -> None:
        user.page.get_by_role("button", name="Add the rule").click()

    def resume(self, user: OdscenPage) -> None:
        expect(user.page.get_by_label("Above", exact=True)).to_have_value(re.compile(BOUND))

    def done(self, document: dict[str, Any]) -> bool:
        return BOUND in str([one["when"] for one in document["rules"]])


class NameMeasure(Work):
    def begin(self, user: OdscenPage) -> None:
        user.step("Measures").click()
        user.page.get_by_label("or type its name").fill(MEASURE)

    def finish(self, user: OdscenPage) -> None:
        user.page.get_by_label("or type its name").press("Enter")

    def resume(self, user: OdscenPage) -> None:
        expect(user.page.get_by_label("or type its name")).to_have_value(MEASURE)

    def done(self, document: dict[str, Any]) -> bool:
        return [one["places"] for one in document["measures"]] == [[MEASURE]]


class LengthenGreen(Work):
    def begin(self, user: OdscenPage) -> None:
        user.open_first_light()
        light = user.page.get_by_role("region", name=LIGHT)
        green = light.get_by_role("slider", name="Green of stage 1")
        expect(green).to_be_visible()
        box = green.bounding_box()
        assert box is not None
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        user.page.mouse.move(x, y)
        user.page.mouse.down()
        user.page.mouse.move(x + 30, y, steps=6)

    def finish(self, user: OdscenPage) -> None:
        user.page.mouse.up()

    def done(self, document: dict[str, Any]) -> bool:
        return [one["junction"] for one in document["signals"]["junctions"]] == [JUNCTION]


class ChooseCriterion(Work):
    def begin(self, user: OdscenPage) -> None:
        user.step("Criteria").click()
        user.page.get_by_label("Number", exact=True).fill(BOUND)

    def finish(self, user: OdscenPage) -> None:
        user.page.get_by_role("button", name="Add the criterion").click()

    def resume(self, user: OdscenPage) -> None:
        expect(user.page.get_by_label("Number", exact=True)).to_have_value(re.compile(BOUND))

    def done(self, document: dict[str, Any]) -> bool:
        return document["criteria"] == [f"collided == {BOUND}"]


WORK = {
    "dragging a car": DragCar,
    "drawing a region": DrawRegion,
    "writing a rule": WriteRule,
    "naming a measure": NameMeasure,
    "lengthening a green": LengthenGreen,
    "choosing a criterion": ChooseCriterion,
}


@pytest.fixture(params=WORK)
def work(request: pytest.FixtureRequest) -> Work:
    return WORK[request.param]()


@pytest.fixture
def editor(
    line: FaultLine, scenario: str, open_page: Callable[..., OdscenPage]
) -> Iterator[OdscenPage]:
    """The editor of the scenario, opened from the list of maps, with a car."""
    user = open_page(line.url)
    user.open_catalogue()
    user.open_editor(scenario)
    yield user
    line.mend()


def unsaved(user: OdscenPage) -> Locator:
    """What says that a change was not saved; other alerts may say what could not be asked for."""
    return user.refusal.filter(has=user.page.get_by_role("button", name="Apply my change again"))


def made_again(user: OdscenPage, *, said: str) -> None:
    """The change was refused in words that name the reason; it is asked for once more."""
    expect(unsaved(user)).to_contain_text(said)
    with user.changing():
        user.page.get_by_role("button", name="Apply my change again").click()
    expect(unsaved(user)).to_have_count(0)


def kept(before: dict[str, Any], after: dict[str, Any], work: Work) -> None:
    """What was begun is done, and nothing else is lost."""
    assert work.done(after)
    assert set(before["roi"]) <= set(after["roi"])
    assert [one["id"] for one in before["actors"]] == [one["id"] for one in after["actors"]]


@pytest.mark.slow
def test_a_second_window_that_changes_the_scenario_takes_nothing_away(
    editor: OdscenPage, line: FaultLine, work: Work, open_page: Callable[..., OdscenPage]
) -> None:
    before = editor.document()
    work.begin(editor)
    other = open_page(line.url, context=editor.page.context)
    other.open_editor(editor.scenario)
    other.step("Demand").click()
    with other.changing():
        other.page.get_by_role("button", name="Add background traffic").click()
    work.finish(editor)
    made_again(editor, said="another tab")
    kept(before, editor.document(), work)
    assert len(editor.document()["demand"]["background"]) == 1


@pytest.mark.slow
def test_a_server_that_is_killed_and_started_again_takes_nothing_away(
    editor: OdscenPage, line: FaultLine, work: Work
) -> None:
    before = editor.document()
    work.begin(editor)
    line.restart(by_force=True)
    with editor.changing():
        work.finish(editor)
    kept(before, editor.document(), work)
    with editor.changing():
        editor.undo.click()
    assert editor.document() == before


@pytest.mark.slow
def test_a_connection_that_is_lost_takes_nothing_away(
    editor: OdscenPage, line: FaultLine, work: Work
) -> None:
    before = editor.document()
    work.begin(editor)
    line.cut()
    work.finish(editor)
    expect(unsaved(editor)).to_contain_text("not saved")
    line.mend()
    made_again(editor, said="The server cannot be reached")
    kept(before, editor.document(), work)


@pytest.mark.slow
def test_a_map_that_is_removed_and_brought_back_takes_nothing_away(
    editor: OdscenPage, work: Work
) -> None:
    before = editor.document()
    work.begin(editor)
    removed = editor.page.request.delete(f"/api/maps/{CROSSING}").json()["id"]
    work.finish(editor)
    expect(unsaved(editor)).to_contain_text("not saved")
    assert editor.page.request.post(f"/api/trash/{removed}/restore").ok
    made_again(editor, said=CROSSING)
    kept(before, editor.document(), work)


@pytest.mark.slow
def test_the_back_button_takes_nothing_away(editor: OdscenPage, work: Work) -> None:
    before = editor.document()
    work.begin(editor)
    editor.page.go_back()
    expect(editor.maps.first).to_be_visible()
    editor.page.mouse.up()
    editor.page.keyboard.up("Shift")
    assert editor.get(f"/scenarios/{before['name']}")["document"] == before
    editor.page.go_forward()
    editor.wait_for_editor()
    work.resume(editor)
    with editor.changing():
        work.finish(editor)
    kept(before, editor.document(), work)


MOMENT = 6.0
"""Seconds into a recording."""


def begun(user: OdscenPage, scenario: str, *, speed: float | None) -> str:
    """Start a run of a minute, and open it from the editor; its id."""
    answer = user.page.request.post(
        "/api/runs", data={"scenario": scenario, "speed": speed, "until": 60}
    )
    run = str(answer.json()["run"])
    while speed is None and user.get(f"/runs/{run}")["state"] != "completed":
        user.page.wait_for_timeout(300)
    user.page.goto(f"/#/run/{scenario}/{run}")
    return run


def goes_on(user: OdscenPage) -> None:
    """The time that the run shows goes on."""
    shown = user.figure("Time").first.inner_text()
    expect(user.figure("Time").first).not_to_have_text(shown)


def second_window(user: OdscenPage, line: FaultLine, open_page: Callable[..., OdscenPage]) -> None:
    other = open_page(line.url, context=user.page.context)
    other.page.goto(user.page.url)
    expect(other.map.area).to_be_visible()
    other.page.close()


def restarted_server(_user: OdscenPage, line: FaultLine, _open: object) -> None:
    line.restart()


def killed_server(_user: OdscenPage, line: FaultLine, _open: object) -> None:
    line.restart(by_force=True)


def lost_connection(user: OdscenPage, line: FaultLine, _open: object) -> None:
    line.cut()
    user.page.wait_for_timeout(1500)
    line.mend()


def removed_map(user: OdscenPage, _line: FaultLine, _open: object) -> None:
    removed = user.page.request.delete(f"/api/maps/{CROSSING}").json()["id"]
    user.page.wait_for_timeout(1000)
    assert user.page.request.post(f"/api/trash/{removed}/restore").ok


def back_button(user: OdscenPage, _line: FaultLine, _open: object) -> None:
    user.page.go_back()
    user.wait_for_editor()
    user.page.go_forward()


FAULTS = pytest.mark.parametrize(
    "fault",
    [
        second_window,
        restarted_server,
        killed_server,
        lost_connection,
        removed_map,
        back_button,
    ],
)


@pytest.mark.slow
@FAULTS
def test_a_run_that_is_watched_goes_on_or_says_how_it_ended(
    editor: OdscenPage,
    line: FaultLine,
    open_page: Callable[..., OdscenPage],
    fault: Callable[..., None],
) -> None:
    before = editor.document()
    run = begun(editor, editor.scenario, speed=1.0)
    editor.wait_until_moving()
    fault(editor, line, open_page)
    if fault is killed_server:
        expect(editor.page.get_by_role("heading", level=1)).to_have_text("This run is gone")
        editor.page.get_by_role("button", name="Run again").click()
    if fault is restarted_server:
        expect(editor.result).to_contain_text("stopped")
    else:
        goes_on(editor)
        run = editor.page.url.partition("?")[0].rsplit("/", 1)[1]
        editor.control("Stop").click()
        expect(editor.result).to_contain_text("stopped")
    assert editor.document() == before
    assert run in {one["run"] for one in editor.get("/runs")}
    editor.result.get_by_role("button", name="Back to the editor").click()
    editor.wait_for_editor()


@pytest.mark.slow
@FAULTS
def test_a_recording_that_is_played_keeps_its_moment_and_goes_on(
    editor: OdscenPage,
    line: FaultLine,
    open_page: Callable[..., OdscenPage],
    fault: Callable[..., None],
) -> None:
    begun(editor, editor.scenario, speed=None)
    strip = editor.page.get_by_role("region", name="The recording")
    moment = strip.get_by_label("Moment of the run")
    moment.fill(str(MOMENT))
    expect(editor.page).to_have_url(re.compile(f"time={MOMENT}"))
    fault(editor, line, open_page)
    expect(moment).to_have_value(f"{MOMENT:g}")
    strip.get_by_role("button", name="Play", exact=True).click()
    expect(moment).not_to_have_value(f"{MOMENT:g}")
    strip.get_by_role("button", name="Pause").click()
    editor.page.reload()
    expect(moment).to_be_visible()
    expect(editor.result).to_contain_text("finished")
