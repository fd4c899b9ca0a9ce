"""A newcomer builds a cut-in and a mid-block walker in the page, and sees the rule fire."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest
from playwright.sync_api import Locator, expect

from odscen.app.maps import load_map
from odscen.app.scenarios import SUFFIX
from odscen.maps.store import Workspace
from odscen.scenario import edits
from odscen.scenario.document.json_form import dumps
from tests.browser.conftest import CROSSING
from tests.browser.pages import OdscenPage
from tests.browser.test_keyboard import press
from tools.page import Served

MOST_OPTIONS = 40
EGO_LANE, OTHER_LANE = (146.0, 0.0), (146.0, 3.25)
"""Begins of two lanes that lead west side by side."""


@pytest.fixture
def crossing(served: Served, request: pytest.FixtureRequest) -> str:
    """Name of a scenario with a region and without road users."""
    workspace = Workspace.open(served.workspace)
    graph = load_map(workspace.map(CROSSING)).sumo.graph
    name = f"{request.node.originalname[5:25]}-{request.node.callspec.id}".replace("_", "-")
    scenario = edits.new_scenario(graph, name=name, roi=graph.segments.ids)
    scenario = edits.set_simulation(scenario, duration=20.0)
    workspace.scenarios.mkdir(exist_ok=True)
    (workspace.scenarios / f"{name}{SUFFIX}").write_text(dumps(scenario), encoding="utf-8")
    return name


class Hand:
    """What a user does with one of the two inputs."""

    def __init__(self, user: OdscenPage) -> None:
        self.user, self.page = user, user.page

    def press(self, wanted: Locator) -> None:
        raise NotImplementedError

    def point(self, at: tuple[float, float]) -> None:
        raise NotImplementedError

    def take(self, kind: str) -> None:
        raise NotImplementedError

    def choose(self, label: str, word: str) -> None:
        raise NotImplementedError

    def write(self, label: str, text: str) -> None:
        raise NotImplementedError

    def open_tab(self, name: str) -> None:
        raise NotImplementedError


class Mouse(Hand):
    def press(self, wanted: Locator) -> None:
        wanted.click()

    def point(self, at: tuple[float, float]) -> None:
        self.user.map.click(at)

    def take(self, kind: str) -> None:
        self.user.kind(kind).click()

    def choose(self, label: str, word: str) -> None:
        self.user.choose(label, word)

    def write(self, label: str, text: str) -> None:
        self.page.get_by_label(label, exact=True).fill(text)
        self.page.keyboard.press("Enter")

    def open_tab(self, name: str) -> None:
        self.page.get_by_role("tab", name=name).click()


class Keyboard(Hand):
    def press(self, wanted: Locator) -> None:
        press(self.user, wanted)

    def point(self, at: tuple[float, float]) -> None:
        self.user.tab_to(self.user.map.area)
        while self.user.map.view()[2] < 6.0:  # lanes side by side are told apart
            self.page.keyboard.press("+")
        self.user.map.steer(at)
        self.page.keyboard.press("Enter")

    def take(self, kind: str) -> None:
        press(self.user, self.user.kind(kind))

    def choose(self, label: str, word: str) -> None:
        self.user.tab_to(self.page.get_by_role("textbox", name=label).first)
        self.page.keyboard.press("Enter")
        wanted = self.page.get_by_role("option", name=word, exact=True)
        expect(wanted).to_be_visible()
        for _ in range(MOST_OPTIONS):
            if wanted.get_attribute("data-combobox-selected"):
                break
            self.page.keyboard.press("ArrowDown")
        self.page.keyboard.press("Enter")

    def write(self, label: str, text: str) -> None:
        self.user.tab_to(self.page.get_by_label(label, exact=True))
        self.page.keyboard.press("Control+A")
        self.page.keyboard.type(text)
        self.page.keyboard.press("Enter")

    def open_tab(self, name: str) -> None:
        self.user.tab_to(self.page.get_by_role("tab", selected=True))
        wanted = self.page.get_by_role("tab", name=name)
        for _ in range(MOST_OPTIONS):
            if wanted.get_attribute("aria-selected") == "true":
                return
            self.page.keyboard.press("ArrowRight")
        pytest.fail(f"the tab {name} is not reached with the arrow keys")


def node_near(user: OdscenPage, x: float, y: float, *, walking: bool = False) -> str:
    """Id of the node nearest to a point, on a lane or on a walkway."""
    columns = user.graph.columns["walks"] if walking else user.graph.columns
    away = np.hypot(np.asarray(columns["x"]) - x, np.asarray(columns["y"]) - y)
    row = int(np.argmin(away))
    lane = columns["lane"][row]
    number = row - columns["first_node"][lane]
    return f"{'ped.' * walking}{columns['lane_keys'][lane]}.{number}"


def placed(user: OdscenPage, hand: Hand, who: tuple[tuple[str, str], ...]) -> None:
    """Place road users at nodes; the first is the ego."""
    hand.press(user.step("Road users"))
    for number, (kind, node) in enumerate(who):
        hand.take(kind)
        with user.changing():
            hand.point(user.graph.place(node))
        if number == 0:
            with user.changing():
                if isinstance(hand, Keyboard):
                    press(user, user.ego, "Space")
                else:
                    user.ego.click()
    assert [one["spawn"] for one in user.document()["actors"]] == [node for _, node in who]


def run_until_fired(user: OdscenPage, hand: Hand, actor: str) -> None:
    """Run to the end; the firing is in the incidents, with its subject."""
    hand.press(user.step("Run"))
    hand.press(user.run)
    user.wait_until_moving()
    hand.choose("Speed", "As fast as possible")
    expect(user.result).to_contain_text("finished", timeout=90_000)
    hand.open_tab("Incidents")
    fired = user.page.get_by_role("list", name="Incidents").get_by_role("button")
    words = re.compile(rf"{actor} triggered rule rule-1(?!-wait)")
    expect(fired.filter(has_text=words)).to_have_count(1)


HANDS = pytest.mark.parametrize("hand_of", [Mouse, Keyboard], ids=["mouse", "keyboard"])


@pytest.mark.slow
@HANDS
def test_a_cut_in_is_built_and_fires(
    user: OdscenPage, crossing: str, hand_of: Callable[[OdscenPage], Hand]
) -> None:
    user.open_editor(crossing)
    hand = hand_of(user)
    ego = node_near(user, EGO_LANE[0] - 12, EGO_LANE[1])
    other = node_near(user, OTHER_LANE[0] - 26, OTHER_LANE[1])
    placed(user, hand, (("Car", ego), ("Van", other)))
    hand.press(user.step("Rules"))
    hand.press(user.page.get_by_role("button", name="Add a rule"))
    hand.choose("Condition", "Distance travelled")
    hand.choose("Bound", "Above")
    hand.write("Above", "10")
    hand.write("In a time", "2.5")
    with user.changing():
        hand.press(user.page.get_by_role("button", name="Add the rule"))
    words = "When distance travelled by van-1 is above 10 m, cut in before car-1 over 2.5 s."
    expect(user.page.get_by_text(words)).to_be_visible()
    (rule,) = user.document()["rules"]
    assert rule["when"]["travelled"]["above"] == 10
    run_until_fired(user, hand, "van-1")
    if isinstance(hand, Keyboard):
        assert user.actions()["pointer"] == 0


@pytest.mark.slow
@HANDS
def test_a_mid_block_walker_is_built_and_fires(
    user: OdscenPage, crossing: str, hand_of: Callable[[OdscenPage], Hand]
) -> None:
    user.open_editor(crossing)
    hand = hand_of(user)
    ego = node_near(user, OTHER_LANE[0] - 12, OTHER_LANE[1])
    here = node_near(user, 90, 9, walking=True)
    there = node_near(user, 90, -9, walking=True)
    placed(user, hand, (("Car", ego), ("Pedestrian", here)))
    hand.press(user.step("Rules"))
    hand.press(user.page.get_by_role("button", name="Add a rule"))
    hand.choose("Condition", "Distance")
    hand.write("Below", "30")
    hand.choose("Action", "Walk to")
    hand.press(user.page.get_by_role("button", name="Place on the map"))
    hand.point(user.graph.place(there))
    with user.changing():
        hand.press(user.page.get_by_role("button", name="Add the rule"))
    wait, rule = user.document()["rules"]
    assert (wait["id"], wait["actor"]) == ("rule-1-wait", "pedestrian-1")
    assert (rule["actor"], rule["then"][0]["walk"]["to"]) == ("pedestrian-1", there)
    run_until_fired(user, hand, "pedestrian-1")
    if isinstance(hand, Keyboard):
        assert user.actions()["pointer"] == 0
