"""What docstrings name is there: parameters, attributes, exceptions and what they refer to."""

from __future__ import annotations

import ast
import builtins
import importlib
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

SOURCES = Path(__file__).parents[1] / "src"

Function = ast.FunctionDef | ast.AsyncFunctionDef
Documented = Function | ast.ClassDef

EDGE = ("app", "assistants", "carla", "cli", "experiments", "web")
"""Rooms whose errors are told by who calls them: a person, or an answer of the server."""

_SECTION = re.compile(r"^(?P<name>[A-Z][a-z ]+)\n-{3,}\n", re.MULTILINE)
_ROLE = re.compile(r":(?:func|class|meth|mod|attr|data|exc):`~?([^`]+)`")


def module_name(path: Path) -> str:
    parts = path.relative_to(SOURCES).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@cache
def texts() -> dict[str, str]:
    """Every module of the source, read when a test asks: each worker collects all tests."""
    return {module_name(path): path.read_text("utf-8") for path in sorted(SOURCES.rglob("*.py"))}


@cache
def nodes_of_modules() -> dict[str, list[ast.AST]]:
    return {module: list(ast.walk(ast.parse(text))) for module, text in texts().items()}


@cache
def classes() -> dict[str, ast.ClassDef]:
    return {
        node.name: node
        for nodes in nodes_of_modules().values()
        for node in nodes
        if isinstance(node, ast.ClassDef)
    }


def sections(docstring: str) -> dict[str, list[str]]:
    """Names that each section of a numpy docstring lists."""
    parts = _SECTION.split(docstring)
    found = {}
    for name, body in zip(parts[1::2], parts[2::2], strict=True):
        heads = [line for line in body.splitlines() if line and not line.startswith(" ")]
        names = [word.strip(" *") for line in heads for word in line.split(":")[0].split(",")]
        found[name] = [word for word in names if word]
    return found


def parameters(function: Function) -> set[str]:
    args = function.args
    every = [*args.posonlyargs, *args.args, *args.kwonlyargs, args.vararg, args.kwarg]
    return {arg.arg for arg in every if arg is not None}


@cache
def members(node: ast.ClassDef) -> set[str]:
    """Fields, methods, and what ``self`` is given, of a class and of its bases that are ours."""
    names: set[str] = set()
    for base in node.bases:
        known = classes().get(ast.unparse(base).split(".")[-1].split("[")[0])
        names |= members(known) if known is not None and known is not node else set()
    for one in node.body:
        if isinstance(one, ast.AnnAssign):
            names.add(ast.unparse(one.target))
        elif isinstance(one, ast.Assign):
            names |= {ast.unparse(target) for target in one.targets}
        elif isinstance(one, Function):
            names.add(one.name)
            names |= {
                target.attr
                for target in ast.walk(one)
                if isinstance(target, ast.Attribute) and isinstance(target.ctx, ast.Store)
            }
    return names


def taken(node: Documented) -> set[str]:
    """What a function or a class can be called with."""
    if isinstance(node, Function):
        return parameters(node)
    made = [one for one in node.body if isinstance(one, Function) and one.name == "__init__"]
    return parameters(made[0]) if made else members(node)


def documented() -> Iterator[tuple[str, Documented, dict[str, list[str]]]]:
    for module, nodes in nodes_of_modules().items():
        for node in nodes:
            if isinstance(node, Documented) and (text := ast.get_docstring(node)):
                yield f"{module}.{node.name}", node, sections(text)


def test_every_parameter_that_is_described_is_one() -> None:
    wrong = [
        f"{name}: {parameter}"
        for name, node, found in documented()
        for parameter in found.get("Parameters", ())
        if parameter not in taken(node)
    ]
    assert wrong == []


def test_every_attribute_that_is_described_is_there() -> None:
    wrong = [
        f"{name}: {attribute}"
        for name, node, found in documented()
        for attribute in found.get("Attributes", ())
        if not isinstance(node, ast.ClassDef) or attribute not in members(node)
    ]
    assert wrong == []


def test_every_exception_that_is_described_exists() -> None:
    known = {*classes(), *dir(builtins)}
    wrong = [
        f"{name}: {exception}"
        for name, _, found in documented()
        for exception in found.get("Raises", ())
        if exception not in known and not installed(exception)
    ]
    assert wrong == []


def installed(target: str) -> bool:
    """Whether somebody else's module has it."""
    module, _, name = target.rpartition(".")
    return bool(module) and hasattr(importlib.import_module(module), name)


def raised(function: Function) -> set[str]:
    """Names of the exceptions that a function raises itself."""
    errors = [node.exc for node in ast.walk(function) if isinstance(node, ast.Raise)]
    names = [ast.unparse(getattr(error, "func", error)) for error in errors if error is not None]
    return {name for name in names if name[0].isupper()}


def test_who_raises_says_so() -> None:
    wrong = [
        f"{name}: {exception}"
        for name, node, found in documented()
        if isinstance(node, Function) and not node.name.startswith("_")
        if name.split(".")[1] not in EDGE
        for exception in raised(node)
        if exception not in found.get("Raises", ()) and exception not in ast.get_docstring(node)
    ]
    assert wrong == []


@cache
def names_of(module: str) -> frozenset[str]:
    """What a module defines or imports, and the members of its classes as ``Class.member``."""
    names: set[str] = set()
    for node in nodes_of_modules()[module]:
        if isinstance(node, ast.ClassDef):
            names |= {node.name, *(f"{node.name}.{member}" for member in members(node))}
        elif isinstance(node, Function):
            names.add(node.name)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.add(node.id)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            names |= {alias.asname or alias.name for alias in node.names}
    return frozenset(names)


def resolves(target: str, module: str) -> bool:
    start, _, rest = target.partition(".")
    if start == "odscen":
        return target in texts() or any(
            target.startswith(f"{one}.") and target.removeprefix(f"{one}.") in names_of(one)
            for one in texts()
        )
    if target in names_of(module) or any(n.endswith(f".{target}") for n in names_of(module)):
        return True
    return rest in members(classes()[start]) if start in classes() else installed(target)


def test_what_is_referred_to_is_there() -> None:
    wrong = [
        f"{module}: {target}"
        for module, text in texts().items()
        for words in _ROLE.findall(text)
        if not resolves(target := words.rpartition("<")[2].strip(">()"), module)
    ]
    assert wrong == []


def test_the_search_tells_parameters_and_attributes_that_are_not_there() -> None:
    (function, record) = ast.parse(
        '''
def f(a, *rest): """One.

Parameters
----------
a, b
    Text.
*rest
    More.
"""
class K:
    """One.

    Attributes
    ----------
    x : int
    gone
    """

    x: int = 1
'''
    ).body
    assert isinstance(function, Function)
    assert isinstance(record, ast.ClassDef)
    assert sections(ast.get_docstring(function) or "") == {"Parameters": ["a", "b", "rest"]}
    assert taken(function) == {"a", "rest"}
    assert sections(ast.get_docstring(record) or "") == {"Attributes": ["x", "gone"]}
    assert members(record) == {"x"}
