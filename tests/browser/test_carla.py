"""The page and CARLA: whether it is there, a run that is shown in it, and its camera."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import expect

from odscen.app.generation import generate
from odscen.app.scenarios import SUFFIX
from odscen.maps.store import Workspace
from odscen.scenario.sampling.generation_settings import GenerationSettings
from tests.browser.conftest import CROSSING, SHIPPED
from tests.browser.pages import OdscenPage
from tests.browser.test_accessibility import Inspector
from tests.carla_standin.process import StandIn
from tools import page as tool

pytest.importorskip("carla", reason="co-simulation needs the package carla")
pytest.importorskip("av", reason="pictures need the package av")


@pytest.fixture(scope="module")
def standin() -> Iterator[StandIn]:
    with StandIn(SHIPPED / f"{CROSSING}.xodr") as server:
        yield server


@pytest.fixture(scope="module")
def served(
    one_map: Path, standin: StandIn, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tool.Served]:
    """A server that knows where the stand-in is."""
    root = tmp_path_factory.mktemp("carla") / "workspace"
    shutil.copytree(one_map, root)
    with tool.served(root, "--carla", f"{standin.host}:{standin.port}") as server:
        yield server


def left(server: StandIn) -> list[str]:
    kinds = ("vehicle.", "walker.", "sensor.")
    return [a["type_id"] for a in server.actors() if a["type_id"].startswith(kinds)]


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_run_is_shown_in_carla_and_its_picture_in_the_page(
    open_page: Callable[..., OdscenPage],
    served: tool.Served,
    standin: StandIn,
    sampled: str,
    scheme: str,
) -> None:
    user = open_page(served.url, color_scheme=scheme)
    inspector = Inspector(user, scheme)
    user.open_editor(sampled)
    user.step("Run").click()
    choice = user.page.get_by_role("group", name="CARLA", exact=True)
    expect(choice.get_by_role("status")).to_have_text("CARLA connected")
    choice.get_by_role("switch", name="Also show the run in CARLA").check()
    inspector.look("carla-choice")
    user.run.click()
    picture = user.page.get_by_role("figure").filter(has_text="CARLA, from above")
    expect(picture).to_be_visible()
    image = picture.get_by_role("img", name="The run in CARLA, seen from above")
    expect(image).to_have_js_property("naturalWidth", 960)
    user.wait_until_moving()
    assert len(left(standin)) > 10
    inspector.look("carla-run")
    user.control("Stop").click()
    expect(user.result).to_contain_text("stopped")
    assert left(standin) == []
    with user.page.expect_popup() as opened:
        user.result.get_by_role("link", name="Compared with CARLA").click()
    expect(opened.value.get_by_text("Both worlds agree")).to_be_visible()
    assert not inspector.wrong.views, inspector.wrong


@pytest.mark.slow
def test_without_carla_the_page_says_so_and_runs_all_the_same(
    open_page: Callable[..., OdscenPage], one_map: Path, tmp_path: Path
) -> None:
    root = tmp_path / "workspace"
    shutil.copytree(one_map, root)
    scenario = generate(
        Workspace.open(root), settings=GenerationSettings(map_name=CROSSING, seed=5, fill=0.1)
    )[0]
    with tool.served(root, "--carla", "127.0.0.1:9") as server:
        user = open_page(server.url)
        user.open_editor(scenario.name.removesuffix(SUFFIX))
        user.step("Run").click()
        choice = user.page.get_by_role("group", name="CARLA", exact=True)
        expect(choice.get_by_role("status")).to_have_text("CARLA not connected")
        expect(choice).to_contain_text("No CARLA server is at 127.0.0.1:9.")
        expect(choice.get_by_role("switch")).to_have_count(0)
        user.run.click()
        user.wait_until_moving()
        expect(user.page.get_by_role("figure")).to_have_count(0)
