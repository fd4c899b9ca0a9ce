"""A real browser on a real server. What fails leaves a picture and a trace under build/browser/.

With ``ODSCEN_TRACE`` in the environment the trace has the page at each step, too.
"""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, BrowserContext, ConsoleMessage, Page, expect

from odscen.app.generation import generate
from odscen.app.scenarios import SUFFIX
from odscen.maps.store import Workspace
from odscen.scenario.sampling.generation_settings import GenerationSettings
from tests.browser.pages import OdscenPage
from tools import chromium
from tools import page as tool

ARTEFACTS = tool.ROOT / "build/browser"
SHIPPED = tool.ROOT / "maps"
CROSSING = "signal_crossing"
PATIENCE = 40_000
"""Milliseconds that a state may take to come about on a busy machine."""

expect.set_options(timeout=PATIENCE)

_report = pytest.StashKey[pytest.TestReport]()


def _missing() -> str:
    if chromium.find() is None:
        return "there is no Chromium; `python -m tools.chromium` says what to do"
    if not tool.BUILT.is_file():
        return "the page is not built; `make page` does it"
    return ""


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    if missing := _missing():
        (pytest.fail if chromium.required() else pytest.skip)(missing)
    with tool.launched() as opened:
        yield opened


@pytest.fixture(scope="session")
def one_map(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a workspace with one map, made once; modules get copies."""
    root = tmp_path_factory.mktemp("one-map")
    Workspace.open(root).add_map(SHIPPED / f"{CROSSING}.xodr")
    return root


@pytest.fixture(scope="module")
def served(one_map: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tool.Served]:
    """A server whose workspace has one map."""
    root = tmp_path_factory.mktemp("served") / "workspace"
    shutil.copytree(one_map, root)
    with tool.served(root) as server:
        yield server


@pytest.fixture
def sampled(served: tool.Served) -> str:
    """Name of a scenario with cars and pedestrians that runs without problems."""
    workspace = Workspace.open(served.workspace)
    path = generate(workspace, settings=GenerationSettings(map_name=CROSSING, seed=5, fill=0.25))[0]
    return path.name.removesuffix(SUFFIX)


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Iterator[None]:
    outcome: Any = yield
    report = outcome.get_result()
    if report.when == "call":
        item.stash[_report] = report


@pytest.fixture
def open_page(
    browser: Browser, request: pytest.FixtureRequest
) -> Iterator[Callable[..., OdscenPage]]:
    """Opens a browser of a new user (who has seen the tour unless told otherwise) on a server."""
    contexts: list[BrowserContext] = []
    faults: list[str] = []

    def opened(
        url: str, *, tour: bool = False, context: BrowserContext | None = None, **options: Any
    ) -> OdscenPage:
        if context is None:
            options.setdefault("viewport", {"width": 1360, "height": 850})
            # A click at what still unfolds can miss it on a busy machine.
            options.setdefault("reduced_motion", "reduce")
            context = browser.new_context(base_url=url, **options)
            context.set_default_timeout(PATIENCE)
            # Pictures of each step double the time of tests by keyboard.
            context.tracing.start(snapshots="ODSCEN_TRACE" in os.environ)
            if not tour:
                context.add_init_script(f"localStorage.setItem({tool.TOUR_SEEN!r}, 'seen')")
            contexts.append(context)
        page = context.new_page()
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.on("console", lambda said: faults.extend(_fault(said)))
        return OdscenPage(page)

    yield opened
    report = request.node.stash.get(_report, None)
    failed = report is None or report.failed
    name = re.sub(r"\W+", "-", request.node.name).strip("-")
    for number, context in enumerate(contexts):
        if failed or faults:
            _keep(context, ARTEFACTS / f"{name}-{number}")
        else:
            context.tracing.stop()
        context.close()
    assert not faults, "the page has reported errors"


def _fault(said: ConsoleMessage) -> list[str]:
    """Errors of the page's own; a refusal by the server is not one, and is shown to the user."""
    refused = said.text.startswith(("Failed to load resource", "WebSocket connection to"))
    mine = said.type == "error" and not refused
    return [said.text] if mine else []


def _keep(context: BrowserContext, stem: Path) -> None:
    stem.parent.mkdir(parents=True, exist_ok=True)
    for number, page in enumerate(context.pages):
        page.screenshot(path=f"{stem}-{number}.png")
    context.tracing.stop(path=f"{stem}.zip")


@pytest.fixture
def user(open_page: Callable[..., OdscenPage], served: tool.Served) -> OdscenPage:
    """One user on the server with one map."""
    return open_page(served.url)


@pytest.fixture
def page(user: OdscenPage) -> Page:
    return user.page
