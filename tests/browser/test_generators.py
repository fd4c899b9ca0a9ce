"""A region filled by a generator that is chosen, with its options, by mouse."""

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
from tests import own_generator
from tests.browser.conftest import CROSSING
from tests.browser.pages import OdscenPage
from tools import page as tool


@pytest.fixture(scope="module")
def served(one_map: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tool.Served]:
    """A server in whose environment a package with a generator is installed."""
    folder = tmp_path_factory.mktemp("with-generator")
    root, site = folder / "workspace", folder / "site"
    shutil.copytree(one_map, root)
    site.mkdir()
    with pytest.MonkeyPatch.context() as patch:
        own_generator.install(site, patch)
        with tool.served(root) as server:
            yield server


@pytest.fixture
def filling(open_page: Callable[..., OdscenPage], served: tool.Served) -> OdscenPage:
    """The editor of a scenario, with the form that fills its region."""
    settings = GenerationSettings(map_name=CROSSING, seed=5, fill=0.05)
    path = generate(Workspace.open(served.workspace), settings=settings)[0]
    user = open_page(served.url)
    user.open_editor(path.name.removesuffix(SUFFIX))
    user.step("Road users").click()
    user.page.get_by_role("button", name="Generate traffic").click()
    return user


def choose(user: OdscenPage, field: str, option: str) -> None:
    user.page.get_by_role("textbox", name=field, exact=True).click()
    user.page.get_by_role("option", name=option, exact=True).click()


def fill(user: OdscenPage) -> list[dict[str, object]]:
    with user.changing():
        user.page.get_by_role("button", name="Fill the region", exact=True).click()
    actors: list[dict[str, object]] = user.document()["actors"]
    return actors


@pytest.mark.slow
def test_the_generator_that_ships_and_an_own_one_with_options_fill_the_region(
    filling: OdscenPage,
) -> None:
    choose(filling, "Placed by", "Generator reference")
    expect(
        filling.page.get_by_text("Places vehicles as they are in SUMO's traffic")
    ).to_be_visible()
    placed = fill(filling)
    assert len(placed) > 5
    assert any(one["initial_speed"] for one in placed)  # at random all start from rest

    choose(filling, "Placed by", "Generator spread")
    many = fill(filling)
    assert {one["category"] for one in many} == {"car"}
    assert not any(one["initial_speed"] for one in many)
    choose(filling, "Category", "truck")
    filling.page.get_by_label("Nodes between two cars").fill("60")
    filling.page.get_by_role("checkbox", name="They move").click()
    few = fill(filling)
    assert {one["category"] for one in few} == {"truck"}
    assert 0 < 2 * len(few) < len(many)
    assert {one["initial_speed"] for one in few} == {2.0}
    with filling.changing():
        filling.undo.click()
    assert filling.document()["actors"] == many


@pytest.mark.slow
def test_what_a_generator_cannot_do_is_said_and_nothing_changes(filling: OdscenPage) -> None:
    before = filling.document()
    choose(filling, "Placed by", "Generator gone")
    expect(filling.page.get_by_text("it cannot be imported from my_traffic:Gone")).to_be_visible()
    filling.page.get_by_role("button", name="Fill the region", exact=True).click()
    expect(filling.page.get_by_role("alert").filter(has_text="my_traffic:Gone")).to_have_count(2)
    assert filling.document() == before
