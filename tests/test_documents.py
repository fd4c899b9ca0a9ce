"""Documents lead where they say: links, anchors, and the names of modules and files in them."""

from __future__ import annotations

import operator
import re
from importlib.util import find_spec
from pathlib import Path

import pytest
from PIL import Image

import odscen
from odscen.app import generators
from odscen.maps.importers import registry
from odscen.scenario.story import own_kinds
from odscen.simulators import assets
from odscen.sumo.worker.behaviour import behaviour_doors
from tools.docs_site import switched_pictures

ROOT = Path(__file__).parents[1]
DOCUMENTS = sorted([*(ROOT / "docs").rglob("*.md"), *ROOT.glob("*.md"), ROOT / "maps/README.md"])
CURRENT = [
    path
    for path in DOCUMENTS
    if path.parent.name != "decisions" and path.name != "api-reference.md"
]
"""Decisions are history: they name what was there when they were made. The reference is made of
docstrings, which have tests of their own."""

_LINK = re.compile(r'\]\(([^)\s]+)\)|\b(?:src|srcset)="([^"]+)"')
_LIGHT = re.compile(r'src="([^"]+-light\.png)"')
_HEADING = re.compile(r"^#+ (.+)$", re.MULTILINE)
_FENCE = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
_DIFF = re.compile(r"^```diff.*?^```$", re.MULTILINE | re.DOTALL)
"""Recipes show what is not there yet."""
_MODULE = re.compile(r"\bodscen(?:\.\w+)+")
_FILE = re.compile(r"`((?:src|tests|tools|bench|suites|maps|examples|frontend)/[\w./-]+)`")


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def anchors(text: str) -> set[str]:
    """Names of places in a page, as GitHub and the site make them from headings."""
    headings = _HEADING.findall(_FENCE.sub("", text))
    plain = (re.sub(r"[^\w\- ]", "", heading.lower()) for heading in headings)
    return {heading.replace(" ", "-") for heading in plain} | set(re.findall(r'id="([^"]+)"', text))


def is_module(name: str) -> bool:
    try:
        return find_spec(name) is not None
    except ModuleNotFoundError:
        return False


def exists(module: str) -> bool:
    """Whether a module, or a name in one, is there: ``odscen.base.frames.sumo_to_xodr``."""
    if module.split(".")[1] in (*odscen.__all__, *odscen.MODULES):
        try:
            operator.attrgetter(module.partition(".")[2])(odscen)
        except AttributeError:  # unless it is a module that nothing has imported yet
            return is_module(module)
        return True
    for parts in (module, module.rpartition(".")[0]):
        try:
            spec = find_spec(parts)
        except ModuleNotFoundError:
            continue
        if spec is not None and spec.origin is not None:
            name = module.removeprefix(parts).removeprefix(".")
            return re.search(rf"\b{name}\b", Path(spec.origin).read_text("utf-8")) is not None
    return False


@pytest.mark.parametrize("path", DOCUMENTS, ids=name_of)
def test_every_link_leads_to_a_file_and_a_heading_that_are_there(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    broken = []
    for link in (one or other for one, other in _LINK.findall(_FENCE.sub("", text))):
        if re.match(r"[a-z]+:", link):
            continue
        target, _, anchor = link.partition("#")
        file = (path.parent / target).resolve() if target else path
        found = file.exists() and (
            not anchor or anchor in anchors(file.read_text(encoding="utf-8"))
        )
        if not found:
            broken.append(link)
    assert broken == []


@pytest.mark.parametrize("path", DOCUMENTS, ids=name_of)
def test_pictures_have_a_light_and_a_dark_form_between_which_the_site_switches(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    shown = switched_pictures(text)
    for light in _LIGHT.findall(text):
        dark = light.replace("-light.png", "-dark.png")
        with Image.open(path.parent / light) as one, Image.open(path.parent / dark) as other:
            assert one.size == other.size, light
        assert f'src="{light}#only-light"' in shown
        assert f'src="{dark}#only-dark"' in shown
    assert "<picture>" not in shown


def test_every_picture_of_the_page_is_in_a_document() -> None:
    texts = "".join(path.read_text(encoding="utf-8") for path in DOCUMENTS)
    pictures = sorted(path.name for path in (ROOT / "docs/images").glob("page-*.png"))
    assert [name for name in pictures if name not in texts] == []


@pytest.mark.parametrize("path", CURRENT, ids=name_of)
def test_modules_that_a_document_names_are_there(path: Path) -> None:
    named = set(_MODULE.findall(_DIFF.sub("", path.read_text(encoding="utf-8"))))
    named -= {
        own_kinds.CONDITION_GROUP,
        own_kinds.ACTION_GROUP,
        generators.GROUP,
        behaviour_doors.GROUP,
        assets.GROUP,
        registry.GROUP,
    }  # entry points
    assert sorted(module for module in named if not exists(module)) == []


@pytest.mark.parametrize("path", CURRENT, ids=name_of)
def test_files_that_a_document_names_are_there(path: Path) -> None:
    named = set(_FILE.findall(path.read_text(encoding="utf-8")))
    places = (ROOT, ROOT / "tests")
    assert [file for file in sorted(named) if not any((at / file).exists() for at in places)] == []


def test_no_requirement_stands_twice_in_the_table() -> None:
    rows = re.findall(
        r"^\| (R\d[^|]*?) \|", (ROOT / "docs/requirements.md").read_text("utf-8"), re.MULTILINE
    )
    assert len(rows) > 50
    assert sorted({row for row in rows if rows.count(row) > 1}) == []
