"""How many clicks the usual tasks take, counted by the page; and that the keyboard alone does them.

In the first run all that is clicked is in sight on a screen of 1440 x 900: nothing is scrolled.
"""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Locator, expect

from odscen.app.maps import load_map
from odscen.app.running.runs import run
from odscen.app.scenarios import SUFFIX
from odscen.maps.store import Workspace
from odscen.records.run_events import events_from_json
from odscen.scenario import edits
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.document.scenario_document import Scenario
from tests.browser.conftest import CROSSING, PATIENCE, SHIPPED
from tests.browser.pages import MOST_TABS, OdscenPage
from tests.browser.test_keyboard import press
from tests.browser.test_rule_scenes import MOST_OPTIONS, Keyboard, Mouse, node_near
from tests.browser.test_run_in_sight import run_of_head
from tools import page as tool

SCREEN = {"width": 1440, "height": 900}
OWN = "own_crossing"
MOST_CLICKS = {"first run": 18, "story": 30, "before and after": 12}


class Clicks(Mouse):
    """Clicks all that it does, fields that are written in too."""

    def check(self, box: Locator) -> None:
        self.press(box)

    def take(self, kind: str) -> None:
        self.press(self.user.kind(kind))

    def choose(self, label: str, word: str) -> None:
        self.press(self.page.get_by_role("textbox", name=label).first)
        self.press(self.page.get_by_role("option", name=word, exact=True))

    def pick(self, group: str, word: str) -> None:
        """Choose one of the buttons of a group that are all in sight."""
        self.press(self.page.get_by_role("radiogroup", name=group).get_by_text(word, exact=True))

    def pick_item(self, name: str) -> None:
        """Choose one entry of the menu that is open."""
        self.press(self.page.get_by_role("menuitem", name=re.compile(f"^{name}")))

    def write(self, label: str, text: str) -> None:
        self.press(self.page.get_by_label(label, exact=True))
        super().write(label, text)


class ClicksInSight(Clicks):
    """Scrolls to nothing."""

    def press(self, wanted: Locator) -> None:
        expect(wanted).to_be_in_viewport(ratio=0.95)
        wanted.click()


class Keys(Keyboard):
    """Never touches the mouse."""

    def check(self, box: Locator) -> None:
        press(self.user, box, "Space")

    def pick(self, group: str, word: str) -> None:
        # A group of buttons is one stop; the arrows go through them.
        radios = self.page.get_by_role("radiogroup", name=group)
        chosen = radios.get_by_role("radio", checked=True)
        expect(radios).to_be_visible()
        for _ in range(MOST_TABS):  # the radio itself is as good as invisible
            if chosen.evaluate("element => element === document.activeElement"):
                break
            self.page.keyboard.press("Tab")
        expect(chosen).to_be_focused()
        wanted = radios.get_by_role("radio", name=word, exact=True)
        for _ in range(MOST_OPTIONS):
            self.page.keyboard.press("ArrowRight")
            if wanted.is_checked():
                break
        expect(wanted).to_be_checked()

    def pick_item(self, name: str) -> None:
        # In a menu the arrows go from entry to entry.
        wanted = self.page.get_by_role("menuitem", name=re.compile(f"^{name}"))
        expect(wanted).to_be_visible()
        for _ in range(MOST_OPTIONS):
            if wanted.evaluate("element => element === document.activeElement"):
                break
            self.page.keyboard.press("ArrowDown")
        expect(wanted).to_be_focused()
        self.page.keyboard.press("Enter")


Hand = Clicks | Keys
IDS = ["mouse", "keyboard"]
HANDS = pytest.mark.parametrize("hand_of", [Clicks, Keys], ids=IDS)


def assert_clicks(user: OdscenPage, hand: Hand, task: str) -> None:
    actions = user.actions()
    if isinstance(hand, Keys):
        assert actions["pointer"] == 0
    else:
        assert 0 < actions["pointer"] <= MOST_CLICKS[task]


@pytest.fixture
def empty(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tool.Served]:
    """A server that nobody has used yet."""
    with tool.served(tmp_path_factory.mktemp("empty")) as server:
        yield server


@pytest.fixture
def own_map(tmp_path: Path) -> Path:
    """A map that a user brings."""
    path = tmp_path / f"{OWN}.xodr"
    shutil.copy(SHIPPED / f"{CROSSING}.xodr", path)
    return path


@pytest.mark.slow
@pytest.mark.parametrize("hand_of", [ClicksInSight, Keys], ids=IDS)
def test_an_own_map_is_run_first_within_eighteen_clicks_and_nothing_typed(
    empty: tool.Served,
    own_map: Path,
    open_page: Callable[..., OdscenPage],
    hand_of: Callable[[OdscenPage], Hand],
) -> None:
    user = open_page(empty.url, tour=True, viewport=SCREEN)
    hand = hand_of(user)
    user.open_catalogue()
    with user.page.expect_file_chooser() as chooser:
        hand.press(user.page.get_by_role("button", name="Choose a file"))
    chooser.value.set_files(own_map)
    expect(user.maps).to_have_text([OWN], timeout=6 * PATIENCE)
    hand.press(user.new_scenario(OWN))
    user.wait_for_editor()
    hand.press(user.tour.get_by_role("button", name="Close the tour"))
    junction = user.graph.junction()
    with user.changing():
        hand.point(user.graph.middle(junction))
    with user.changing():
        hand.press(user.add_all)
    hand.press(user.step("Road users"))
    roi = user.document()["roi"]
    kinds = ("Car", "Van", "Truck", "Motorcycle")
    starts = user.graph.starts(roi, len(kinds))
    beside = user.graph.starts(roi, 1, walking=True, beside=starts)
    for kind, start in zip((*kinds, "Pedestrian"), (*starts, *beside), strict=True):
        hand.take(kind)
        with user.changing():
            hand.point(start)
        if kind == "Car":
            with user.changing():
                hand.check(user.ego)
    hand.press(run_of_head(user))
    user.wait_until_moving()
    assert_clicks(user, hand, "first run")
    if isinstance(hand, Clicks):
        assert user.actions()["key"] == 0
    actors = user.document()["actors"]
    assert [actor["category"] for actor in actors if actor["ego"]] == ["car"]
    assert len(actors) == len(kinds) + 1


def make_story(user: OdscenPage, hand: Hand) -> None:
    """An ego at 25 km/h; a van at half of that cuts in at a TTC of 3 s.

    A pedestrian, from the other side, crosses when the ego is 30 m away; the van has passed then.
    """
    page = user.page
    user.open_catalogue()
    hand.press(user.new_scenario(CROSSING))
    user.wait_for_editor()
    with user.changing():
        hand.press(page.get_by_role("button", name="Select whole map"))
    hand.press(user.step("Road users"))
    far = node_near(user, 80.0, 7.9, walking=True)
    here = node_near(user, 80.0, -7.9, walking=True)
    ego, van = node_near(user, 140.0, 3.25), node_near(user, 120.0, 0.0)
    goal = node_near(user, -146.0, 3.25)
    for kind, node, kmh in (("Car", ego, "25"), ("Van", van, "12.5"), ("Pedestrian", here, "")):
        hand.take(kind)
        with user.changing():
            hand.point(user.graph.place(node))
        if kind == "Car":
            with user.changing():
                hand.check(user.ego)
        for label in ("Desired speed", "Speed at departure") if kmh else ():
            with user.changing():
                hand.write(label, kmh)
        if kind == "Car":  # straight on, in its lane
            hand.press(page.get_by_role("button", name="Choose on the map"))
            with user.changing():
                hand.point(user.graph.place(goal))
    hand.press(user.step("Rules"))
    hand.press(page.get_by_role("button", name="Add a rule"))
    with user.changing():
        hand.press(page.get_by_role("button", name="Add the rule"))
    hand.press(page.get_by_role("button", name="Add a rule"))
    hand.press(page.get_by_role("button", name="Place on the map"))
    hand.point(user.graph.place(far))
    with user.changing():
        hand.press(page.get_by_role("button", name="Add the rule"))
    hand.press(user.step("Criteria"))
    for words in (
        "ego does not collide",
        "Gap when stopped of ego to pedestrian-1: at least 0.5 m",
    ):
        with user.changing():
            hand.press(page.get_by_role("button", name=words))


@pytest.mark.slow
@HANDS
def test_the_story_is_made_within_thirty_clicks(
    served: tool.Served,
    open_page: Callable[..., OdscenPage],
    hand_of: Callable[[OdscenPage], Hand],
    tmp_path: Path,
) -> None:
    user = open_page(served.url, viewport=SCREEN)
    hand = hand_of(user)
    make_story(user, hand)
    hand.press(run_of_head(user))
    user.wait_until_moving()
    assert_clicks(user, hand, "story")

    document = user.document()
    assert document["criteria"] == [
        "collided(ego) == 0",
        "stopped_before(ego,pedestrian-1) >= 0.5 m",
    ]
    scenario = loads(json.dumps(document))
    assert isinstance(scenario, Scenario)
    workspace = Workspace.open(served.workspace)
    done = run(workspace, scenario, name="story", out=tmp_path / "story")
    events = events_from_json((done.folder / "events.json").read_text())
    fired = {one.rule: one for one in events if one.kind == "rule_started"}
    cut_in, walk = (rule["id"] for rule in document["rules"] if "wait" not in rule["id"])
    assert (fired[cut_in].values or {})["ttc"] == pytest.approx(3.0, abs=0.15)
    assert (fired[walk].values or {})["distance"] == pytest.approx(30.0, abs=0.7)
    rows = done.summary["criteria"]
    assert [(row["criterion"], row["passed"]) for row in rows] == [
        (criterion, True) for criterion in document["criteria"]
    ]


@pytest.fixture
def busy(served: tool.Served, request: pytest.FixtureRequest) -> str:
    """Name of a scenario with traffic on all roads for five minutes."""
    workspace = Workspace.open(served.workspace)
    graph = load_map(workspace.map(CROSSING)).sumo.graph
    name = f"busy{request.node.callspec.id}"
    scenario = edits.new_scenario(graph, name=name, roi=graph.segments.ids)
    scenario = edits.set_background(scenario, graph, background="all", trips=100.0)
    scenario = edits.set_simulation(scenario, duration=300.0)
    workspace.scenarios.mkdir(exist_ok=True)
    (workspace.scenarios / f"{name}{SUFFIX}").write_text(dumps(scenario), encoding="utf-8")
    return name


def compare_control(user: OdscenPage, hand: Hand, scenario: str) -> None:
    """Copy a scenario, have its light actuated, and compare both over ten seeds."""
    page = user.page
    user.open_catalogue()
    listed = page.get_by_role("table", name="Your scenarios")
    hand.press(listed.get_by_role("link", name=scenario).first)
    user.wait_for_editor()
    menu = page.get_by_role("banner").get_by_role("button", name="Scenario")
    hand.press(menu)
    hand.pick_item("Save as")
    hand.press(page.get_by_role("dialog").get_by_role("button", name="Save", exact=True))
    expect(page).to_have_url(re.compile(f"{scenario}-copy"))
    user.wait_for_editor()
    hand.press(user.step("Traffic lights"))
    with user.changing():
        hand.pick("Signal control", "Actuated")
    hand.press(menu)
    hand.pick_item("Compare with")
    hand.press(page.get_by_role("dialog").get_by_role("button", name="Start 20 runs"))
    expect(page.get_by_role("heading", level=1)).to_contain_text("Study")


@pytest.mark.slow
@HANDS
def test_before_and_after_of_a_light_over_ten_seeds_within_twelve_clicks(
    served: tool.Served,
    open_page: Callable[..., OdscenPage],
    hand_of: Callable[[OdscenPage], Hand],
    busy: str,
) -> None:
    user = open_page(served.url, viewport=SCREEN)
    hand, page = hand_of(user), user.page
    compare_control(user, hand, busy)
    assert_clicks(user, hand, "before and after")
    said = page.get_by_role("list", name="In a sentence").get_by_role("listitem")
    expect(page.get_by_role("status").first).to_contain_text("all runs completed", timeout=240_000)
    expect(said).to_contain_text(f"{busy}-copy")
    expect(said).to_contain_text(re.compile(r"\d to −?\d"))
