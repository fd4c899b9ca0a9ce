"""The reference of the Python API as a page: ``docs/api-reference.md``.

Writes the file from signatures and docstrings, or with ``--check`` says whether it is what they say
now. Names that several public modules have stand once, in the first of them.
"""

from __future__ import annotations

import argparse
import inspect
import re
import sys
from enum import Enum
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import odscen

if TYPE_CHECKING:
    from collections.abc import Iterator

PAGE = Path(__file__).parents[1] / "docs/api-reference.md"
MODULES = ("odscen", *(f"odscen.{name}" for name in odscen.MODULES))
OF_PACKAGES = ("odscen.simulators.base", "odscen.simulators.positions", "odscen.simulators.assets")
"""What packages from outside are given, and the frames."""
_HEAD = """# Python reference

Every public name, by module: made of the docstrings by `python -m tools.api_reference`, and checked
by a test. [Python API](api.md) shows how to work with it.
"""
_WIDTH, _MOST_DEFAULT = 92, 50
_SECTION = re.compile(r"^(?P<name>[A-Z]\w+(?: \w+)?)\n-{3,}\n", re.MULTILINE)
_ROLE = re.compile(r":(?:class|func|meth|mod|data|attr|exc):`~?([^`]+)`")


def reference_page() -> str:
    """Text of the page; the same sources give the same text."""
    parts, known = [_HEAD], dict[int, str]()
    names = (*MODULES, *OF_PACKAGES, "odscen.base.frames")
    parts += ["\n".join(_module_lines(name, known)) for name in names]
    return "\n".join(parts) + "\n"


def _module_lines(name: str, known: dict[int, str]) -> Iterator[str]:
    module = import_module(name)
    yield f"## {name}\n"
    yield from _doc_lines(inspect.getdoc(module) or "")
    names = getattr(module, "__all__", None) or sorted(
        key
        for key, value in vars(module).items()
        if not key.startswith("_") and getattr(value, "__module__", "") == name
    )
    for own in names:
        value, full = getattr(module, own), f"{name}.{own}"
        if id(value) in known:
            yield f"### {full}\n\nThe same as [{known[id(value)]}](#{_anchor(known[id(value)])}).\n"
            continue
        known[id(value)] = full
        yield f"### {full}\n"
        yield from _object_lines(own, value)


def _anchor(heading: str) -> str:
    return re.sub(r"[^\w-]", "", heading.lower())


def _object_lines(name: str, value: Any) -> Iterator[str]:
    if inspect.isclass(value):
        told = "" if inspect.isabstract(value) or issubclass(value, Enum) else _signature(value)
        yield f"```python\nclass {name}{told}\n```\n"
        yield from _doc_lines(inspect.getdoc(value) or "")
        for member, plain in _public_members(value):
            function = plain.fget if isinstance(plain, property) else getattr(value, member)
            told = " (property)\n" if isinstance(plain, property) else ""
            yield f"#### {name}.{member}{told}"
            if not told:
                yield f"\n```python\n{member}{_signature(function)}\n```\n"
            yield from _doc_lines(inspect.getdoc(function) or "")
    elif callable(value):
        yield f"```python\n{name}{_signature(value)}\n```\n"
        yield from _doc_lines(inspect.getdoc(value) or "")
    else:
        yield f"A value: `{type(value).__name__}`.\n"


def _public_members(value: type) -> Iterator[tuple[str, Any]]:
    seen = set()
    for base in value.__mro__:
        if not base.__module__.startswith("odscen."):
            continue
        for name, plain in vars(base).items():
            if name.startswith("_") or name in seen:
                continue
            seen.add(name)
            kinds = (property, classmethod, staticmethod)
            if isinstance(plain, kinds) or inspect.isfunction(plain):
                yield name, plain


def _signature(value: Any) -> str:
    try:
        signature = inspect.signature(value)
    except ValueError:
        return "()"
    parts: list[str] = []
    star = False
    for own in signature.parameters.values():
        if own.name in ("self", "cls"):
            continue
        if own.kind is own.KEYWORD_ONLY and not star:
            star = True
            parts.append("*")
        star = star or own.kind is own.VAR_POSITIONAL
        parts.append(_parameter(own))
    result = signature.return_annotation
    arrow = f" -> {result}" if isinstance(result, str) and result != "None" else ""
    short = f"({', '.join(parts)}){arrow}"
    if len(short) <= _WIDTH:
        return short
    return "(\n" + "".join(f"    {part},\n" for part in parts) + f"){arrow}"


def _parameter(own: inspect.Parameter) -> str:
    prefix = {own.VAR_POSITIONAL: "*", own.VAR_KEYWORD: "**"}.get(own.kind, "")
    told = f"{prefix}{own.name}"
    if isinstance(own.annotation, str):
        told += f": {own.annotation}"
    if own.default is own.empty:
        return told
    shown = repr(own.default)
    if len(shown) > _MOST_DEFAULT or " at 0x" in shown or shown.startswith("<"):
        shown = "..."
    return f"{told} = {shown}"


def _doc_lines(text: str) -> Iterator[str]:
    """A docstring in numpy style as Markdown."""
    parts = _SECTION.split(_ROLE.sub(lambda role: f"`{role[1].rpartition('.')[2]}`", text))
    yield from _plain_lines(parts[0])
    for name, body in zip(parts[1::2], parts[2::2], strict=True):
        yield f"**{name}**\n"
        if name in ("Examples", "Notes"):
            yield from _plain_lines(body)
            continue
        entries: list[list[str]] = []
        for line in body.splitlines():
            if line and not line.startswith(" "):
                entries.append([line])
            elif line.strip() and entries:
                entries[-1].append(line.strip())
        for head, *told in entries:
            words = " ".join(told).replace("``", "`")
            yield f"- `{head}`{': ' if told else ''}{words}"
        yield ""


def _plain_lines(text: str) -> Iterator[str]:
    """Paragraphs, with examples and indented blocks as code."""
    text = text.strip().replace("``", "`")
    for block in re.split(r"\n\s*\n", text):
        if block.startswith((">>>", "    ")):
            yield f"```python\n{inspect.cleandoc(block)}\n```\n"
        elif block:
            yield f"{block}\n"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true")
    written = PAGE.read_text(encoding="utf-8") if PAGE.is_file() else ""
    if not parser.parse_args().check:
        PAGE.write_text(reference_page(), encoding="utf-8")
    elif written != reference_page():
        sys.exit(f"{PAGE.name} is out of date: python -m tools.api_reference")
