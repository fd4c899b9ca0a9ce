"""Formulas in a document as JSON: numbers come in for them when it is read, and they when written.

A formula is a text with the ``$name`` of a parameter where a number is expected. In memory every
number is a number, and ``formulas`` says where in the document one was computed: keys are places as
in a JSON Pointer, except that parts with an id are named by it, ``rules/cut-in/when/ttc/below``.

The operators and functions are those of OpenSCENARIO 1.3 that give numbers: ``+ - * / %``,
brackets, ``pow``, ``sqrt``, ``round``, ``floor``, ``ceil``, ``abs``, ``sign``, ``min`` and ``max``,
``pi``, and ``sin``, ``cos``, ``tan``, ``asin``, ``acos`` and ``atan`` of radians. Those that give
truth, ``not``, ``and`` and ``or``, give 1 or 0. Nothing else is ever called.
"""

from __future__ import annotations

import ast
import json
import math
import operator
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from odscen.base.errors import InputError, NotFoundError, ScenarioError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping


LONGEST: Final = 500
"""Characters of an expression at most."""
_NAME = re.compile(r"\$([A-Za-z_][A-Za-z0-9_]*)")
_OPERATORS: Final[dict[type[ast.AST], Callable[..., float]]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Mod: math.fmod,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
    ast.Not: lambda value: float(not value),
}


def _round_half_away(value: float) -> float:
    """Half away from zero, as OpenSCENARIO rounds; Python rounds it to the even number."""
    return math.copysign(math.floor(abs(value) + 0.5), value)


_FUNCTIONS: Final[dict[str, tuple[int, Callable[..., float]]]] = {
    "pow": (2, math.pow),
    "sqrt": (1, math.sqrt),
    "round": (1, _round_half_away),
    "floor": (1, math.floor),
    "ceil": (1, math.ceil),
    "abs": (1, abs),
    "sign": (1, lambda value: float((value > 0) - (value < 0))),
    "min": (2, min),
    "max": (2, max),
    "sin": (1, math.sin),
    "cos": (1, math.cos),
    "tan": (1, math.tan),
    "asin": (1, math.asin),
    "acos": (1, math.acos),
    "atan": (1, math.atan),
}


def names_in(text: str) -> frozenset[str]:
    """Names that an expression uses, without their ``$``."""
    return frozenset(_NAME.findall(text))


def evaluate(text: str, values: Mapping[str, float]) -> float:
    """Compute an expression.

    Parameters
    ----------
    text
        The expression, names with ``$``.
    values
        What each name stands for.

    Raises
    ------
    InputError
        If a name is unknown, the expression is none, or its value is no finite number.
    """
    shown = text if len(text) <= LONGEST else text[:LONGEST] + "..."
    for name in sorted(names_in(text)):
        if name not in values:
            known = ", ".join(f"${value}" for value in values) or "none"
            raise InputError(f"{shown!r} names ${name}, which is no parameter; there are {known}")
    if len(text) > LONGEST:
        raise InputError(f"the expression {shown!r} is longer than {LONGEST} characters")
    try:
        tree = ast.parse(_NAME.sub(r" _\1 ", text).strip(), mode="eval")
        value = float(_evaluate_node(tree.body, values))
    except (SyntaxError, RecursionError, MemoryError) as error:
        raise InputError(
            f"{shown!r} is no expression: numbers, $names, + - * / % and brackets make one"
        ) from error
    except (ArithmeticError, ValueError) as error:
        raise InputError(f"{shown!r} has no value: {error}") from error
    if not math.isfinite(value):
        raise InputError(f"{shown!r} is {value}, not a finite number")
    return value


def _evaluate_node(node: ast.expr, values: Mapping[str, float]) -> float:
    if isinstance(node, ast.Constant) and isinstance(node.value, bool):
        raise SyntaxError(ast.unparse(node))
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        return float(node.value)
    if isinstance(node, ast.Name) and node.id == "pi":
        return math.pi
    if isinstance(node, ast.Name) and node.id.startswith("_") and node.id[1:] in values:
        return float(values[node.id[1:]])
    if isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
        return _OPERATORS[type(node.op)](
            _evaluate_node(node.left, values), _evaluate_node(node.right, values)
        )
    if isinstance(node, ast.BoolOp):
        all_or_any = all if isinstance(node.op, ast.And) else any
        return float(all_or_any([_evaluate_node(value, values) for value in node.values]))
    if isinstance(node, ast.UnaryOp) and type(node.op) in _OPERATORS:
        return _OPERATORS[type(node.op)](_evaluate_node(node.operand, values))
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
        count, function = _FUNCTIONS.get(node.func.id, (None, None))
        if function is not None and count == len(node.args):
            return function(*(_evaluate_node(argument, values) for argument in node.args))
    raise SyntaxError(ast.unparse(node))


_TEXTS = frozenset({"name", "description", "unit", "id", "formulas"})
"""Keys of texts that are for people, or name something: no formulas."""


def computed(data: dict[str, Any], *, file: str | None = None) -> dict[str, Any]:
    """Replace formulas by their values.

    Parameters
    ----------
    data
        A document with ``parameters``, as JSON; it is not changed.

    Returns
    -------
    dict
        The document with numbers only, and ``formulas`` with where they come from.

    Raises
    ------
    ScenarioError
        With every formula that has no value, with its place.
    """
    reading = _FormulaReader({}, {}, [])
    parameters: dict[str, Any] = {}
    for name, declaration in data["parameters"].items():
        parameters[name] = reading.walked(declaration, f"parameters/{_escape_key(name)}", name)
        number = parameters[name].get("value") if isinstance(parameters[name], dict) else None
        if isinstance(number, int | float):
            reading.values[name] = float(number)
    result = {
        key: parameters if key == "parameters" else reading.walked(node, _escape_key(key), key)
        for key, node in data.items()
    }
    if reading.problems:
        count = len(reading.problems)
        what = "a formula" if count == 1 else f"{count} formulas"
        raise ScenarioError(
            f"the scenario document has {what} without a value",
            problems=reading.problems,
            file=file,
        )
    if reading.found:
        result["formulas"] = reading.found
    return result


@dataclass(frozen=True, slots=True)
class _FormulaReader:
    """Formulas found so far, by place; the parameters known so far; and what has no value."""

    found: dict[str, str]
    values: dict[str, float]
    problems: list[str]

    def walked(self, node: Any, place: str, key: str) -> Any:
        """Copy a part of the document with numbers in place of formulas."""
        if isinstance(node, str):
            return self._read_value(node, place) if _is_formula(node, key, self.values) else node
        if isinstance(node, dict):
            return {
                name: self.walked(part, _extend_pointer(place, name), name)
                for name, part in node.items()
            }
        if isinstance(node, list):
            return [
                self.walked(item, _extend_pointer(place, part), key)
                for part, item in _list_parts(node)
            ]
        return node

    def _read_value(self, text: str, place: str) -> float:
        try:
            value = evaluate(text, self.values)
        except InputError as error:
            self.problems.append(f"{place}: {error}")
            return 0
        self.found[place] = text
        return int(value) if value.is_integer() else value


def put_back(
    written: dict[str, Any], whole: Mapping[str, Any], formulas: Mapping[str, str]
) -> None:
    """Put formulas into a document that is to be written, in place of the numbers they give.

    A number that is another one by now has been set since, and stays; a formula of a part that is
    gone is dropped.

    Parameters
    ----------
    written
        The document, perhaps without what has its default value; it is changed.
    whole
        The same with all of its fields.
    """
    values = {name: float(parameter["value"]) for name, parameter in whole["parameters"].items()}
    for place, text in formulas.items():
        keys = [_unescape_key(key) for key in place.split("/")]
        try:
            if _looked_up(whole, keys) == evaluate(text, values):
                _set_value(written, keys, text)
        except (LookupError, TypeError, InputError):
            continue


def put_formula(written: dict[str, Any], whole: Mapping[str, Any], place: str, text: str) -> None:
    """Put a formula in the place of a number of a document that is to be written.

    Parameters
    ----------
    written
        The document, perhaps without what has its default value; it is changed.
    whole
        The same with all of its fields.
    place
        As in ``formulas``; it may hold nothing yet, where a number is optional.

    Raises
    ------
    NotFoundError
        If there is no such place.
    ScenarioError
        If it holds something else than a number.
    """
    keys = [_unescape_key(key) for key in place.split("/")]
    try:
        there = _looked_up(whole, keys)
    except (LookupError, TypeError) as error:
        raise NotFoundError("number", place, []) from error
    if isinstance(there, bool) or not (there is None or isinstance(there, int | float)):
        raise ScenarioError(
            f"{place}: only a number can be computed, and this is {json.dumps(there):.60}"
        )
    _set_value(written, keys, text)


def _is_formula(text: str, key: str, values: Mapping[str, float]) -> bool:
    if "$" not in text or key in _TEXTS:
        return False
    return text.startswith("$") or not names_in(text).isdisjoint(values)


def _list_parts(node: list[Any]) -> Iterator[tuple[str, Any]]:
    """Each part of a list with its id, or its index if it has none of its own."""
    ids = [row.get("id") if isinstance(row, dict) else None for row in node]
    for index, (name, part) in enumerate(zip(ids, node, strict=True)):
        own = isinstance(name, str) and ids.count(name) == 1
        yield name if own and name is not None else str(index), part


def _looked_up(node: Any, keys: list[str]) -> Any:
    for key in keys:
        node = node[key] if isinstance(node, dict) else dict(_list_parts(node))[key]
    return node


def _set_value(node: Any, keys: list[str], text: str) -> None:
    for key in keys[:-1]:
        node = node.setdefault(key, {}) if isinstance(node, dict) else dict(_list_parts(node))[key]
    if isinstance(node, dict):
        node[keys[-1]] = text
    else:
        node[[part for part, _ in _list_parts(node)].index(keys[-1])] = text


def _extend_pointer(place: str, key: str) -> str:
    return f"{place}/{_escape_key(key)}"


def _escape_key(key: str) -> str:
    return key.replace("~", "~0").replace("/", "~1")


def _unescape_key(key: str) -> str:
    return key.replace("~1", "/").replace("~0", "~")
