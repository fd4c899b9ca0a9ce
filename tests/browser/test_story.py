"""The first story of a domain expert, made by clicks: a cut-in, then a pedestrian who crosses.

The ego approaches at 6 m/s; a van at 3 m/s, 20 m ahead in the lane beside, cuts in at a time to
collision of 3 s; a pedestrian crosses at 1 m/s when the ego is 30 m away. It passes if the ego does
not collide and stops before the pedestrian, who is 4.62 m from the middle of the ego's lane.
"""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any, NamedTuple

import pytest
from playwright.sync_api import expect

from odscen.app.maps import load_map
from odscen.app.running.runs import run
from odscen.app.scenarios import SUFFIX
from odscen.maps.store import Workspace
from odscen.records.run_events import events_from_json
from odscen.scenario import edits
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.document.scenario_document import Scenario
from tests.browser.conftest import CROSSING
from tests.browser.pages import OdscenPage
from tests.browser.test_rule_scenes import Mouse, node_near, placed

if TYPE_CHECKING:
    from pathlib import Path

    from tools.page import Served

HIT, BEFORE = "collided(ego) == 0", "stopped_before(ego,pedestrian-1) >= 0.5 m"
NAME = "first-story"


class Variation(NamedTuple):
    """What differs from the story as it was made, and which criteria are not met."""

    missed: tuple[str, ...] = ()
    story: bool = False
    """Whether the story alone drives the ego, which then hits what is in its way."""
    crosses_at: float = 30.0
    gains: float = 2.0
    """m/s² with which the van goes to 9 m/s as it cuts in."""
    brakes: tuple[float, float] | None = None
    """By how much the ego brakes, and how far ahead the pedestrian then is, m."""


VARIATIONS = {
    "SUMO, 30 m": Variation(),
    "SUMO, 26 m": Variation(crosses_at=26.0),
    # It follows the van at 3 m/s: 30 m in 10 s, and the pedestrian is out of its way after 5.8 s.
    "SUMO, the van stays slow": Variation((BEFORE,), gains=0.0),
    # Below 2 m nobody comes: the ego drives past a pedestrian who has not begun to cross.
    "SUMO, nobody crosses": Variation((BEFORE,), crosses_at=2.0),
    # 30 m in 5 s; the pedestrian is in the ego's way from 3.5 s to 5.8 s.
    "story, 30 m": Variation((HIT, BEFORE), story=True),
    # 9 m in 1.5 s, its rear 0.83 s later: the pedestrian has walked 2.3 m of the 3.5 m.
    "story, 9 m": Variation((BEFORE,), story=True, crosses_at=9.0),
    # 9 m to the van at 3 m/s are closed 3 s after its change began.
    "story, the van stays slow": Variation((HIT, BEFORE), story=True, gains=0.0),
    # 6²/(2 x 6) = 3 m: it stops 17 m before the pedestrian.
    "story, brakes from 20 m": Variation(story=True, brakes=(6.0, 20.0)),
    # 6²/(2 x 4) = 4.5 m: it stops 0.2 m before the pedestrian, less than 0.5 m.
    "story, brakes from 4.7 m": Variation((BEFORE,), story=True, brakes=(4.0, 4.7)),
    # It hits the pedestrian at sqrt(36 - 2 x 4 x 3) = 3.5 m/s and stops 1.5 m behind.
    "story, brakes from 3 m": Variation((HIT, BEFORE), story=True, brakes=(4.0, 3.0)),
}


def make_story(user: OdscenPage, name: str) -> None:
    """Make the story in the page, with the mouse and the keys that write numbers."""
    page, hand = user.page, Mouse(user)
    user.open_editor(name)
    far = node_near(user, 80.0, -7.9, walking=True)
    goal = node_near(user, -146.0, 3.25)
    ego, van = node_near(user, 140.0, 3.25), node_near(user, 120.0, 0.0)
    here = node_near(user, 80.0, 7.9, walking=True)
    placed(user, hand, (("Car", ego), ("Van", van), ("Pedestrian", here)))
    for actor, kmh in (("car-1", "21.6"), ("van-1", "10.8")):
        open_actor(user, actor)
        for label in ("Desired speed", "Speed at departure"):
            page.get_by_label(label, exact=True).fill(kmh)
            with user.changing():
                page.keyboard.press("Enter")
    with user.changing():
        user.choose("Driven by", "The story alone")  # the van, which is open: at just its speed
    open_actor(user, "car-1")  # straight on, in its lane
    page.get_by_role("button", name="Choose on the map").click()
    with user.changing():
        user.map.click(user.graph.place(goal))
    user.step("Rules").click()
    begin_rule(user, hand, "wait", "pedestrian-1")
    user.choose("Condition", "Time")
    hand.write("After", "0")
    user.choose("Action", "Stop")
    add_rule(user)
    begin_rule(user, hand, "cut-in", "van-1")
    hand.write("In a time", "2")
    page.get_by_role("button", name="Add parallel action to action").click()
    user.choose("Action, part 2", "Reach a speed")
    page.get_by_label("Speed", exact=True).fill("32.4")
    page.keyboard.press("Enter")
    add_rule(user)
    begin_rule(user, hand, "cross", "pedestrian-1")
    user.choose("Condition", "Distance")
    hand.write("Below", "30")
    page.get_by_role("button", name="Place on the map").click()
    user.map.click(user.graph.place(far))
    hand.write("Speed", "3.6")
    add_rule(user)
    user.step("Criteria").click()
    add_criterion(user, hand, "collisions", "exactly", "0")
    add_criterion(user, hand, "gap when stopped", "at least", "0.5", other="pedestrian-1")


def open_actor(user: OdscenPage, actor: str) -> None:
    user.table.get_by_text(actor, exact=True).click()
    form = user.page.get_by_role("region", name="Road users", exact=True)
    expect(form.get_by_text(actor, exact=True)).to_be_visible()


def begin_rule(user: OdscenPage, hand: Mouse, name: str, actor: str) -> None:
    user.page.get_by_role("button", name="Add a rule").click()
    hand.write("Name", name)
    user.choose("Who acts", actor)


def add_rule(user: OdscenPage) -> None:
    with user.changing():
        user.page.get_by_role("button", name="Add the rule").click()


def add_criterion(
    user: OdscenPage, hand: Mouse, what: str, bound: str, number: str, other: str | None = None
) -> None:
    user.choose("About", "ego")
    user.choose("What", what)
    if other is not None:
        user.choose("Other road user", other)
    user.choose("Is", bound)
    hand.write("Number", number)
    with user.changing():
        user.page.get_by_role("button", name="Add the criterion").click()


def run_on_page(user: OdscenPage, verdict: str) -> None:
    user.step("Run").click()
    user.run.click()
    user.wait_until_moving()
    user.choose("Speed", "As fast as possible")
    expect(user.result).to_contain_text(f"finished: {verdict}", timeout=90_000)


def varied(document: dict[str, Any], variation: Variation) -> Scenario:
    """The saved story with other numbers, as a program would change it."""
    data = json.loads(json.dumps(document))
    data["actors"][0]["driver"] = "story" if variation.story else "sumo"
    rules = {rule["id"]: rule for rule in data["rules"]}
    rules["cross"]["when"]["distance"]["below"] = variation.crosses_at
    change, speed = rules["cut-in"]["then"][0]["together"]
    if variation.gains == 0.0:
        rules["cut-in"]["then"] = [change]
    else:
        speed["speed"]["rate"] = variation.gains
    if variation.brakes is not None:
        by, ahead = variation.brakes
        near = {"of": "car-1", "to": "pedestrian-1", "along": "longitudinal", "below": ahead}
        then = [{"brake": {"by": by}}]
        data["rules"].append(
            {"id": "brake", "actor": "car-1", "when": {"distance": near}, "then": then}
        )
    found = loads(json.dumps(data))
    assert isinstance(found, Scenario)
    return found


@pytest.mark.slow
def test_the_story_is_made_by_clicks_and_passes_or_fails_as_it_should(
    user: OdscenPage, served: Served, tmp_path: Path
) -> None:
    workspace = Workspace.open(served.workspace)
    graph = load_map(workspace.map(CROSSING)).sumo.graph
    empty = edits.new_scenario(graph, name=NAME, roi=graph.segments.ids)
    empty = edits.set_simulation(empty, step_length=0.1)
    workspace.scenarios.mkdir(exist_ok=True)
    path = workspace.scenarios / f"{NAME}{SUFFIX}"
    path.write_text(dumps(empty), encoding="utf-8")
    make_story(user, NAME)
    assert user.document()["criteria"] == [HIT, BEFORE]
    run_on_page(user, "passed")
    expect(user.result).to_contain_text("Met: Gap when stopped of ego to pedestrian-1")
    user.open_editor(NAME)
    user.step("Road users").click()
    open_actor(user, "car-1")
    with user.changing():
        user.choose("Driven by", "The story alone")
    run_on_page(user, "not passed")
    expect(user.result).to_contain_text("Not met: ego does not collide")
    document = json.loads(path.read_text(encoding="utf-8"))
    for number, (name, variation) in enumerate(VARIATIONS.items()):
        done = run(
            workspace, varied(document, variation), name=f"v{number}", out=tmp_path / f"{number}"
        )
        rows = {row["criterion"]: row for row in done.summary["criteria"]}
        missed = tuple(text for text, row in rows.items() if not row["passed"])
        assert missed == variation.missed, (name, rows)
        events = events_from_json((done.folder / "events.json").read_text())
        fired = {one.rule: one for one in events if one.kind == "rule_started"}
        assert (fired["cut-in"].values or {})["ttc"] == pytest.approx(3.0, abs=0.01), name
        hits = [one for one in events if one.kind == "collision"]
        if name == "story, 30 m":
            assert hits[0].time - fired["cross"].time == pytest.approx(5.0, abs=0.15)
        if name == "story, the van stays slow":
            assert hits[0].time - fired["cut-in"].time == pytest.approx(3.0, abs=0.1)
        if name == "story, brakes from 4.7 m":
            assert rows[BEFORE]["value"] == pytest.approx(0.2, abs=0.05)
        if name == "story, brakes from 3 m":
            speed = (hits[0].values or {})["impact_speed"]
            assert speed == pytest.approx(math.hypot(math.sqrt(12.0), 1.0), abs=0.2)
