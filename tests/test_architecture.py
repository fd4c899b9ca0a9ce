"""The house holds: no modules in a circle, tests beside what they test."""

from __future__ import annotations

import ast
from pathlib import Path

import networkx as nx

ROOT = Path(__file__).parents[1]
SOURCES = ROOT / "src" / "odscen"


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


def test_no_modules_import_each_other_in_a_circle() -> None:
    graph = nx.DiGraph(
        (name, other) for name, path in MODULES.items() for other in _imports(path) - {name}
    )
    assert graph.number_of_edges() > len(MODULES)
    circles = [sorted(each) for each in nx.strongly_connected_components(graph) if len(each) > 1]
    assert circles == []


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


def test_one_module_alone_makes_folders_in_that_of_everybody() -> None:
    """They are their user's alone, and what is left of them after a kill is removed.

    What has no name, ``TemporaryFile``, needs neither.
    """
    by_name = {"TemporaryDirectory", "NamedTemporaryFile", "gettempdir", "mkdtemp", "mkstemp"}
    makers = {
        name
        for name, path in MODULES.items()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if (isinstance(node, ast.Attribute) and node.attr in by_name)
        or (isinstance(node, ast.alias) and node.name in by_name)
    }
    assert makers == {"odscen.base.atomic_folders"}
