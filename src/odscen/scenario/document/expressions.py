"""Arithmetic with named values: ``$gap``, ``2 * $gap + 1``, ``round($speed / 3.6)``.

The operators and functions are those of OpenSCENARIO 1.3 that give numbers: ``+ - * / %``,
brackets, ``pow``, ``sqrt``, ``round``, ``floor``, ``ceil``, ``abs``, ``sign``, ``min`` and ``max``,
``pi``, and ``sin``, ``cos``, ``tan``, ``asin``, ``acos`` and ``atan`` of radians. Those that give
truth, ``not``, ``and`` and ``or``, give 1 or 0. Nothing else is ever called.
"""

from __future__ import annotations

import ast
import math
import operator
import re
from typing import TYPE_CHECKING, Final

from odscen.base.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

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


def _rounded(value: float) -> float:
    """Half away from zero, as OpenSCENARIO rounds; Python rounds it to the even number."""
    return math.copysign(math.floor(abs(value) + 0.5), value)


_FUNCTIONS: Final[dict[str, tuple[int, Callable[..., float]]]] = {
    "pow": (2, math.pow),
    "sqrt": (1, math.sqrt),
    "round": (1, _rounded),
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
            known = ", ".join(f"${one}" for one in values) or "none"
            raise InputError(f"{shown!r} names ${name}, which is no parameter; there are {known}")
    if len(text) > LONGEST:
        raise InputError(f"the expression {shown!r} is longer than {LONGEST} characters")
    try:
        tree = ast.parse(_NAME.sub(r" _\1 ", text).strip(), mode="eval")
        value = float(_value(tree.body, values))
    except (SyntaxError, RecursionError, MemoryError) as error:
        raise InputError(
            f"{shown!r} is no expression: numbers, $names, + - * / % and brackets make one"
        ) from error
    except (ArithmeticError, ValueError) as error:
        raise InputError(f"{shown!r} has no value: {error}") from error
    if not math.isfinite(value):
        raise InputError(f"{shown!r} is {value}, not a finite number")
    return value


def _value(node: ast.expr, values: Mapping[str, float]) -> float:
    if isinstance(node, ast.Constant) and isinstance(node.value, bool):
        raise SyntaxError(ast.unparse(node))
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        return float(node.value)
    if isinstance(node, ast.Name) and node.id == "pi":
        return math.pi
    if isinstance(node, ast.Name) and node.id.startswith("_") and node.id[1:] in values:
        return float(values[node.id[1:]])
    if isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
        return _OPERATORS[type(node.op)](_value(node.left, values), _value(node.right, values))
    if isinstance(node, ast.BoolOp):
        all_or_any = all if isinstance(node.op, ast.And) else any
        return float(all_or_any([_value(one, values) for one in node.values]))
    if isinstance(node, ast.UnaryOp) and type(node.op) in _OPERATORS:
        return _OPERATORS[type(node.op)](_value(node.operand, values))
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
        count, function = _FUNCTIONS.get(node.func.id, (None, None))
        if function is not None and count == len(node.args):
            return function(*(_value(one, values) for one in node.args))
    raise SyntaxError(ast.unparse(node))
