"""The house holds: no modules in a circle, one name for one thing, tests beside what they test."""

from __future__ import annotations

import ast
from collections import defaultdict
from pathlib import Path

import networkx as nx

ROOT = Path(__file__).parents[1]
SOURCES = ROOT / "src" / "odscen"
FREE_MODULE_NAMES = {"__init__", "__main__"}
"""Python gives these their meaning."""
MOST_MODULES = 25
"""In one room; a room with more wants a wall."""


def _modules() -> dict[str, Path]:
    found = {}
    for path in sorted(SOURCES.rglob("*.py")):
        parts = ("odscen", *path.relative_to(SOURCES).with_suffix("").parts)
        found[".".join(parts).removesuffix(".__init__")] = path
    return found


MODULES = _modules()


def _imports(path: Path) -> set[str]:
    """Modules of odscen that a file imports anywhere: lazily and for types only as well."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            names = (f"{node.module}.{alias.name}" for alias in node.names)
            found |= {name if name in MODULES else node.module for name in names}
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
    return found & MODULES.keys()


def _twice(places: dict[str, list[str]]) -> dict[str, list[str]]:
    return {name: where for name, where in places.items() if len(where) > 1}


def test_no_modules_import_each_other_in_a_circle() -> None:
    graph = nx.DiGraph(
        (name, other) for name, path in MODULES.items() for other in _imports(path) - {name}
    )
    assert graph.number_of_edges() > len(MODULES)
    circles = [sorted(each) for each in nx.strongly_connected_components(graph) if len(each) > 1]
    assert circles == []


def test_no_module_name_stands_twice() -> None:
    places = defaultdict(list)
    for name, path in MODULES.items():
        if path.stem not in FREE_MODULE_NAMES:
            places[path.stem].append(name)
    assert _twice(places) == {}


def test_no_module_has_the_name_of_a_room() -> None:
    rooms = {path.parent.name for path in MODULES.values()}
    assert rooms & {path.stem for path in MODULES.values()} == set()


def test_no_class_name_stands_twice() -> None:
    places = defaultdict(list)
    for name, path in MODULES.items():
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef):
                places[node.name].append(name)
    assert _twice(places) == {}


def test_no_room_is_crowded() -> None:
    rooms = defaultdict(int)
    for path in MODULES.values():
        rooms[path.parent.relative_to(SOURCES).as_posix()] += path.stem != "__init__"
    assert {room: count for room, count in rooms.items() if count > MOST_MODULES} == {}


def test_every_room_says_what_it_is_for() -> None:
    silent = [
        path.parent.name
        for path in SOURCES.rglob("__init__.py")
        if not ast.get_docstring(ast.parse(path.read_text(encoding="utf-8")))
    ]
    assert silent == []


def test_tests_lie_where_their_rooms_lie() -> None:
    rooms = {path.parent.relative_to(SOURCES) for path in MODULES.values()}
    others = {"browser", "carla_standin", "examples", "maps"}
    """Tests of the page, the stand-in for CARLA, the examples, and maps through all rooms."""
    strays = [
        path.relative_to(ROOT / "tests").as_posix()
        for path in (ROOT / "tests").rglob("test_*.py")
        if (room := path.parent.relative_to(ROOT / "tests")) not in rooms
        and room.as_posix() not in others
    ]
    assert strays == []
