"""Sentences of Python source as templates of the catalogue (ICU MessageFormat).

A sentence is a string or an f-string with at least two words of prose. What an f-string inserts
becomes a placeholder named after it, an ``a if b else c`` of strings one template for each, lines
one template each.
"""

from __future__ import annotations

import ast
import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

# Descriptions for programmers, names of random streams, patterns, and the texts of registries,
# which tools.server_texts has; the last two are written into the scenario, as data of its own.
_NOT_SENTENCES = frozenset(
    {
        "ActionKind",
        "ActorMeasure",
        "ConditionKind",
        "Exporter",
        "Field",
        "File",
        "Form",
        "Query",
        "SceneTemplate",
        "TemplateParameter",
        "TemplateScene",
        "compile",
        "create_model",
        "disk_errors",
        "draw_key",
        "getLogger",
        "new_scenario",
        "say",
        "stream",
    }
)
_NOT_KEYWORDS = frozenset({"class_", "description", "help", "definition", "source"})
_PROSE = re.compile(r"[a-z]{2,}[,;:]? +(?:[a-z(]|\0)|\0[,;:]? +[a-z]{2,}|[A-Za-z]{2,}: \0")
_MARKUP = re.compile(
    r"^\s*<|\w=\"|<!--|\\\w|^\(.+[<>] |^Content-|^multipart/|^default-src|^import sys|^%s"
)
# What stands before a sentence that goes on another; the page sets it aside, too.
_JOINT = re.compile(r"^[\s;,]+")
_MOST_FORMS = 8


class _Value(str):
    """The name of what a sentence inserts; every other part of one is text."""

    __slots__ = ()


class _Quoted(_Value):
    """One that is inserted in quotes, as ids are; other words of the language may go with it."""

    __slots__ = ()


_Parts = tuple[str, ...]


def templates_of(source: str) -> Iterator[tuple[str, str]]:
    """Form and template of each sentence of a module; of one form are the same sentences."""
    for parts in _sentences(ast.parse(source)):
        yield _form(parts), _icu(parts)


def templates_of_text(text: str) -> Iterator[tuple[str, str]]:
    """The same of a text for :meth:`str.format`."""
    for parts in _forms_of(ast.Constant(text)):
        yield _form(parts), _icu(parts)


def _sentences(tree: ast.Module) -> Iterator[_Parts]:
    found = _Finder()
    found.visit(tree)
    for node in found.texts:
        for parts in _forms_of(node):
            for line in _lines(parts):
                if _is_prose(line) or (node in found.names and line):
                    yield line


class _Finder(ast.NodeVisitor):
    """Collects what may be a sentence: strings that are no documentation and no annotation."""

    def __init__(self) -> None:
        self.texts: list[ast.expr] = []
        self.names: set[ast.expr] = set()

    def visit_Expr(self, node: ast.Expr) -> None:
        if not isinstance(node.value, ast.Constant):
            self.visit(node.value)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self.visit(node.value)

    def visit_arg(self, node: ast.arg) -> None:
        pass

    def visit_keyword(self, node: ast.keyword) -> None:
        if node.arg not in _NOT_KEYWORDS:
            self.visit(node.value)

    def visit_Call(self, node: ast.Call) -> None:
        name = _called(node)
        if name in _NOT_SENTENCES or name.endswith("Figure"):
            return
        if name in {"NotFoundError", "edit"} and node.args:
            self.names.add(node.args[0])  # of one word, too
        self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        if _is_text(node):
            self.texts.append(node)
        else:
            self.generic_visit(node)

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None:
        self.texts.append(node)
        for part in node.values:  # sentences within, as in a join of them
            if isinstance(part, ast.FormattedValue) and not _is_choice(part.value):
                self.visit(part.value)

    def visit_Constant(self, node: ast.Constant) -> None:
        if isinstance(node.value, str):
            self.texts.append(node)


def _called(node: ast.Call) -> str:
    return ast.unparse(node.func).rsplit(".", maxsplit=1)[-1]


def _is_text(node: ast.expr) -> bool:
    if isinstance(node, ast.BinOp):
        return isinstance(node.op, ast.Add) and (_is_text(node.left) or _is_text(node.right))
    return isinstance(node, ast.JoinedStr) or (
        isinstance(node, ast.Constant) and isinstance(node.value, str)
    )


def _is_choice(node: ast.expr) -> bool:
    return isinstance(node, ast.IfExp) and _is_text(node.body) and _is_text(node.orelse)


def _forms_of(node: ast.expr) -> list[_Parts]:
    """Every form that a text may have; too many choices are one placeholder each."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        # Of `str.format`; in an f-string braces would be doubled, and `_icu` refuses them.
        pieces = re.split(r"\{(?:\w+\.)*(\w*)\}", node.value)
        return [tuple(_Value(x or "value") if n % 2 else x for n, x in enumerate(pieces))]
    if isinstance(node, ast.JoinedStr):
        return _joined([_part_forms(part) for part in node.values])
    if isinstance(node, ast.BinOp) and _is_text(node):
        return _joined([_forms_of(node.left), _forms_of(node.right)])
    if isinstance(node, ast.IfExp) and _is_choice(node):
        return [*_forms_of(node.body), *_forms_of(node.orelse)]
    return [(_Value(_name(node)),)]


def _part_forms(part: ast.expr) -> list[_Parts]:
    if isinstance(part, ast.FormattedValue):
        if part.conversion == ord("r"):
            return [(_Quoted(_name(part.value)),)]
        return _forms_of(part.value)
    return [(str(part.value),)] if isinstance(part, ast.Constant) else _forms_of(part)


def _joined(choices: list[list[_Parts]]) -> list[_Parts]:
    forms: list[_Parts] = [()]
    for several in choices:
        kept = several if len(forms) * len(several) <= _MOST_FORMS else [(_Value("value"),)]
        forms = [(*form, *one) for form in forms for one in kept]
    return forms


def _name(node: ast.expr) -> str:
    """What a placeholder is called: the last name of what is inserted."""
    if isinstance(node, ast.Call):
        inner = [*node.args, *(one.value for one in node.keywords)]
        if isinstance(node.func, ast.Attribute) and not inner:
            return _name(node.func)
        return _name(inner[0]) if inner else _name(node.func)
    if isinstance(node, ast.Attribute):
        return node.attr.strip("_").lower()
    if isinstance(node, ast.Name):
        return node.id.strip("_").lower()
    if isinstance(node, ast.Subscript):
        if isinstance(node.slice, ast.Constant) and isinstance(node.slice.value, str):
            return node.slice.value
        return _name(node.value)
    if isinstance(node, ast.BinOp):
        left = _name(node.left)
        return left if left != "value" else _name(node.right)
    if isinstance(node, ast.GeneratorExp):
        return _name(node.generators[0].iter)
    return "value"


def _lines(parts: _Parts) -> Iterator[_Parts]:
    """The lines of a text, without what surrounds them."""
    line: list[str] = []
    for part in parts:
        pieces = [part] if isinstance(part, _Value) else part.split("\n")
        for n, piece in enumerate(pieces):
            if n > 0:
                yield _trimmed(line)
                line = []
            line.append(piece)
    yield _trimmed(line)


def _trimmed(parts: list[str]) -> _Parts:
    merged: list[str] = []
    for part in parts:
        if merged and not isinstance(part, _Value) and not isinstance(merged[-1], _Value):
            merged[-1] += part
        elif part:
            merged.append(part)
    if merged and not isinstance(merged[0], _Value):
        merged[0] = _JOINT.sub("", merged[0])
    if merged and not isinstance(merged[-1], _Value):
        merged[-1] = merged[-1].rstrip()
    return tuple(part for part in merged if part)


def _form(parts: _Parts) -> str:
    marks = {_Value: "\0", _Quoted: "\0'"}
    return "".join(marks.get(type(part), part) for part in parts)


def _is_prose(parts: _Parts) -> bool:
    form = _form(parts)
    return bool(_PROSE.search(form)) and not _MARKUP.search(form) and not set(form) & set("{}")


def _icu(parts: _Parts) -> str:
    """The parts as a message; the same name twice would be the same value."""
    taken: dict[str, int] = {}
    made = ""
    for n, part in enumerate(parts):
        if isinstance(part, _Value):
            name = part if part.isascii() and part.isidentifier() else "value"
            taken[name] = taken.get(name, 0) + 1
            made += f"{{{name}{taken[name] if taken[name] > 1 else ''}}}"
        else:
            # An apostrophe before a brace would quote it.
            made += re.sub(r"'$", "''", part) if n + 1 < len(parts) else part
    return made
