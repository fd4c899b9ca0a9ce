"""The page as its users see it: the one place that knows its roles and labels."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import cached_property
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Locator, Page, expect

MOST_TABS = 120
FAILED = "The run failed"
"""What is said of a run that has failed."""

ACTIONS = """
window.odscenActions = {pointer: 0, key: 0};
document.addEventListener('pointerdown', () => { window.odscenActions.pointer += 1; }, true);
document.addEventListener('keydown', () => { window.odscenActions.key += 1; }, true);
"""
"""Counts what the user does, in the page itself, so that no helper can forget to count. At the
document: at the window, Playwright holds back a press whose target has just moved, and repeats it.
"""

_SETTLED = """element => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(
    () => requestAnimationFrame(() => done(element.dataset.view)))))"""


class Graph:
    """Places of a map in metres, as the page gets them from the server."""

    def __init__(self, columns: dict[str, Any]) -> None:
        self.columns = columns
        self.segments: list[dict[str, Any]] = columns["segments"]
        self._row = {one["id"]: row for row, one in enumerate(self.segments)}

    def junction(self) -> str:
        """A junction, the one with most neighbours."""
        found = [one for one in self.segments if one["kind"] == "junction"]
        return str(max(found, key=lambda one: len(one["neighbours"]))["id"])

    def neighbours(self, segment: str) -> list[str]:
        rows = self.segments[self._row[segment]]["neighbours"]
        return [self.segments[row]["id"] for row in rows]

    def middle(self, segment: str) -> tuple[float, float]:
        """A node of the segment, in the middle of its list."""
        rows = np.flatnonzero(np.asarray(self.columns["segment"]) == self._row[segment])
        return self._at(self.columns, int(rows[len(rows) // 2]))

    def starts(
        self,
        roi: Iterable[str],
        number: int,
        *,
        walking: bool = False,
        apart: float = 14.0,
        beside: Iterable[tuple[float, float]] = (),
    ) -> list[tuple[float, float]]:
        """Places where somebody may start, each ``apart`` metres from the others, far ends last.

        Also from those ``beside`` them, whose markers would be hit instead.
        """
        columns = self.columns["walks"] if walking else self.columns
        usable = np.asarray(columns["walkable" if walking else "spawnable"]) == 1
        if not walking:
            kinds = np.asarray(columns["lane_types"])[columns["lane"]]
            usable &= kinds == "driving"
        usable &= np.isin(columns["segment"], [self._row[one] for one in roi])
        middle = np.array([np.mean(self.columns["x"]), np.mean(self.columns["y"])])
        points = np.column_stack((columns["x"], columns["y"]))
        order = np.argsort(np.linalg.norm(points - middle, axis=1))
        chosen: list[tuple[float, float]] = []
        beside = tuple(beside)
        for row in order[usable[order]]:
            point = self._at(columns, int(row))
            if all(np.hypot(point[0] - x, point[1] - y) >= apart for x, y in (*chosen, *beside)):
                chosen.append(point)
        assert len(chosen) >= number, "too few places to start"
        return chosen[:number]

    def place(self, node: str) -> tuple[float, float]:
        """Where the node with this id is."""
        walking = node.startswith("ped.")
        columns = self.columns["walks"] if walking else self.columns
        lane, _, number = node.removeprefix("ped.").rpartition(".")
        row = columns["first_node"][columns["lane_keys"].index(lane)] + int(number)
        return self._at(columns, row)

    @staticmethod
    def _at(columns: dict[str, Any], row: int) -> tuple[float, float]:
        return columns["x"][row], columns["y"][row]


class MapView:
    """The canvas: points are told in metres and hit where the page shows them."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.area = page.get_by_role("application")

    def view(self) -> tuple[float, float, float]:
        """What is in the middle, and pixels per metre, once the page has drawn."""
        x, y, scale = map(float, self.area.evaluate(_SETTLED).split())
        return x, y, scale

    def at(self, x: float, y: float) -> tuple[float, float]:
        middle_x, middle_y, scale = self.view()
        box = self.area.bounding_box()
        assert box is not None
        sx = box["x"] + box["width"] / 2 + (x - middle_x) * scale
        sy = box["y"] + box["height"] / 2 - (y - middle_y) * scale
        inside = (
            box["x"] < sx < box["x"] + box["width"] and box["y"] < sy < box["y"] + box["height"]
        )
        assert inside, f"({x:.1f}, {y:.1f}) is not in sight"
        return sx, sy

    def click(self, point: tuple[float, float], **options: Any) -> None:
        self.page.mouse.click(*self.at(*point), **options)

    def steer(self, point: tuple[float, float]) -> None:
        """Bring a place to the middle with the arrow keys; the map has the focus."""
        for axis, (back, forth) in enumerate(
            (("ArrowLeft", "ArrowRight"), ("ArrowDown", "ArrowUp"))
        ):
            for modifier, pixels in (("", 60), ("Shift+", 12)):
                view = self.view()
                away = (point[axis] - view[axis]) * view[2]
                for _ in range(round(abs(away) / pixels)):
                    self.page.keyboard.press(modifier + (forth if away > 0 else back))

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Hold the button down from one place to another, in steps as a hand does."""
        mouse = self.page.mouse
        a, b = self.at(*start), self.at(*end)
        mouse.move(*a)
        mouse.down()
        mouse.move(*b, steps=8)
        mouse.up()

    def hover(self, point: tuple[float, float]) -> None:
        self.page.mouse.move(*self.at(*point))


class OdscenPage:
    """The whole page; methods are what a user does, locators what a user sees."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.map = MapView(page)
        page.add_init_script(ACTIONS)

    # Where one is

    def open_catalogue(self) -> None:
        self.page.goto("/")
        expect(self.page.get_by_role("heading", level=1)).to_be_visible()

    def open_editor(self, scenario: str) -> None:
        self.page.goto(f"/#/edit/{scenario}")
        self.wait_for_editor()

    def wait_for_editor(self) -> None:
        expect(self.map.area).to_be_visible()
        expect(self.step("Region")).to_be_visible()

    @property
    def scenario(self) -> str:
        """Name of the scenario that the address tells."""
        found = re.search(r"#/(?:edit|run)/([^/?]+)", self.page.url)
        assert found, self.page.url
        return found[1]

    def actions(self) -> dict[str, int]:
        """How often a pointer and a key were pressed since the page was loaded."""
        found: dict[str, int] = self.page.evaluate("window.odscenActions")
        return found

    def tab_to(self, wanted: Locator, *, back: bool = False) -> None:
        """Press Tab until ``wanted`` has the focus."""
        expect(wanted).to_be_visible()
        for _ in range(MOST_TABS):
            if wanted.evaluate("element => element === document.activeElement"):
                return
            self.page.keyboard.press("Shift+Tab" if back else "Tab")
        pytest.fail(f"{wanted} is not reached with the Tab key")

    @property
    def tour(self) -> Locator:
        return self.page.get_by_role("dialog", name="Short tour")

    def close_tour(self) -> None:
        """Close the tour that first users see."""
        self.tour.get_by_role("button", name="Close the tour").click()
        expect(self.tour).to_have_count(0)

    def choose_in_menu(self, entry: str) -> None:
        """Choose from the menu of the scenario in the head of the page."""
        self.page.get_by_role("banner").get_by_role("button", name="Scenario").click()
        self.page.get_by_role("menuitem", name=re.compile(f"^{entry}")).click()

    # Catalogue

    @property
    def maps(self) -> Locator:
        return self.page.get_by_role("list", name="Maps", exact=True).get_by_role("heading")

    @property
    def add_shipped(self) -> Locator:
        return self.page.get_by_role("button", name="Add the example maps")

    def new_scenario(self, map_name: str) -> Locator:
        return self.page.get_by_role("button", name=f"New scenario on {map_name}")

    def remove(self, name: str) -> Locator:
        return self.page.get_by_role("button", name=f"Remove {name}", exact=True)

    # Editor

    def step(self, title: str) -> Locator:
        """Heading of one of the steps."""
        return (
            self.page.get_by_role("region", name=title, exact=True)
            .locator("button[aria-expanded]")
            .first
        )

    def open_first_light(self) -> None:
        """Open the program of the first junction with a traffic light."""
        self.step("Traffic lights").click()
        self.first_light.click()

    @property
    def first_light(self) -> Locator:
        lights = self.page.get_by_role("group", name="Junctions with a traffic light")
        return lights.get_by_role("button").first

    @property
    def region_note(self) -> Locator:
        return self.step("Region")

    @property
    def add_all(self) -> Locator:
        return self.page.get_by_role("button", name=re.compile(r"^Add all"))

    def kind(self, word: str) -> Locator:
        palette = self.page.get_by_role("group", name="Kind of road user to place")
        return palette.get_by_role("button", name=word, exact=True)

    def flow(self, word: str) -> Locator:
        palette = self.page.get_by_role("group", name="Flow to place")
        return palette.get_by_role("button", name=word, exact=True)

    @property
    def ego(self) -> Locator:
        return self.page.get_by_label(re.compile("my vehicle"))

    @property
    def table(self) -> Locator:
        return self.page.get_by_role("region", name="Table of road users").get_by_role("table")

    @property
    def names(self) -> Locator:
        """The buttons of the table that choose one road user each."""
        return self.table.locator("button.row-button")

    def remove_actor(self, name: str) -> Locator:
        return self.table.get_by_role("button", name=f"Remove {name}", exact=True)

    @property
    def undo(self) -> Locator:
        return self.page.get_by_role("button", name=re.compile("^Undo"))

    @property
    def redo(self) -> Locator:
        return self.page.get_by_role("button", name=re.compile("^Redo"))

    @property
    def refusal(self) -> Locator:
        return self.page.get_by_role("alert")

    @property
    def problems(self) -> Locator:
        return self.page.get_by_role("region", name="Problems").get_by_role("button")

    @property
    def help(self) -> Locator:
        return self.page.get_by_role("button", name="Help: keyboard shortcuts and glossary")

    @contextmanager
    def changing(self) -> Iterator[None]:
        """Waits until what is done within has been answered by the server, is saved and checked."""
        asked = re.compile(r"/api/scenarios/[^/]+/(edits|undo|redo)\?")
        with self.page.expect_response(lambda answer: bool(asked.search(answer.url))):
            yield
        saved = self.page.get_by_text("All changes saved")
        expect(saved).to_be_visible()
        # Problems come later, and move what is beside them.
        expect(saved).to_have_attribute("data-checked", "true")

    @property
    def time_bar(self) -> Locator:
        """That of the editor, or of a run."""
        return self.page.get_by_role("region", name="Time bar")

    def open_time_bar(self) -> None:
        """Show the time bar of the editor, and wait for its plan."""
        below = self.page.get_by_role("radiogroup", name="Below the map")
        below.get_by_text("Time", exact=True).click()
        expect(self.page.get_by_text("Drag the blocks")).to_be_visible()

    # Run

    @property
    def run(self) -> Locator:
        return self.page.get_by_role("button", name="Run", exact=True).last

    @property
    def strip(self) -> Locator:
        return self.page.get_by_role("region", name="The run", exact=True)

    def control(self, word: str) -> Locator:
        return self.strip.get_by_role("button", name=word, exact=True)

    def figure(self, label: str) -> Locator:
        """The number that is shown over ``label``."""
        return self.strip.locator(".figure").filter(has_text=label).locator("b")

    def time(self) -> float:
        """Simulated seconds that the strip shows."""
        minutes, seconds = self.figure("Time").first.inner_text().split(":")
        return 60 * int(minutes) + float(seconds)

    def wait_until_moving(self) -> None:
        """The first picture after the start is there."""
        expect(self.figure("Time").first).not_to_have_text("0:00.0", timeout=20_000)

    @property
    def result(self) -> Locator:
        return self.page.get_by_role("region", name="Result of the run")

    def choose_speed(self, word: str) -> None:
        self.strip.get_by_role("combobox", name="Speed").or_(
            self.strip.get_by_label("Speed", exact=True)
        ).first.click()
        self.page.get_by_role("option", name=re.compile(word)).click()

    def choose(self, label: str, word: str) -> None:
        """Choose from the list with this label."""
        self.page.get_by_role("textbox", name=label).first.click()
        self.page.get_by_role("option", name=word, exact=True).click()

    def choose_pace(self, word: str) -> None:
        """Choose how fast a run begins."""
        pace = self.page.get_by_role("radiogroup", name="Speed at the start")
        pace.get_by_text(word, exact=True).click()

    # What the server knows

    def get(self, path: str) -> Any:
        answer = self.page.request.get(f"/api{path}")
        assert answer.ok, answer.text()
        return answer.json()

    def document(self) -> dict[str, Any]:
        """The scenario as it is saved."""
        found: dict[str, Any] = self.get(f"/scenarios/{self.scenario}")["document"]
        return found

    @cached_property
    def graph(self) -> Graph:
        """Of the map of the first scenario that was asked for."""
        return Graph(self.get(f"/maps/{self.document()['map']['name']}/graph"))


def settle(page: Page) -> None:
    """Wait until nothing fades or slides any more; what turns for ever is left alone."""
    page.wait_for_function(
        """() => document.getAnimations().every(one =>
            one.playState !== "running" || one.effect?.getTiming().iterations === Infinity)"""
    )
    # What the map shows of itself (scale, small map) follows it by a frame.
    page.evaluate("() => new Promise(d => requestAnimationFrame(() => requestAnimationFrame(d)))")
