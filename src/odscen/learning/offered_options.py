"""Options of a generator or behaviour model: what it lets one choose, in JSON Schema.

A class has an attribute ``options``: a schema of an object whose properties are numbers, whole
numbers, true or false, or texts, or a pydantic model, which has such a schema; or it is a dataclass
with fields that are :func:`offered`. It is made with the values as keyword arguments.
"""

from __future__ import annotations

import math
from dataclasses import field, fields, is_dataclass
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, get_args

from odscen.base.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

OptionValue = bool | float | str
OptionKind = Literal["number", "integer", "boolean", "string"]
_KINDS: tuple[OptionKind, ...] = get_args(OptionKind)
_CALLED = {
    "number": "a number", "integer": "a whole number", "boolean": "true or false",
    "string": "a text",
}  # fmt: skip
_TYPES = {"boolean": bool, "integer": int, "number": float, "string": str}
_SCHEMA = "schema"
"""Key of a field's metadata."""
_MOST = 100
"""Options of one, and choices of an option."""
_LONGEST = 1000
"""Characters of a text."""


class OfferedOption(NamedTuple):
    """What one lets choose.

    Attributes
    ----------
    usual
        Its value if none is given; ``None`` if one has to be.
    low, high
        Bounds of a number; ``None`` for none.
    choices
        Texts of which it is one; empty for any.
    """

    name: str
    kind: OptionKind
    title: str
    meaning: str
    usual: OptionValue | None
    low: float | None
    high: float | None
    choices: tuple[str, ...]


def offered(
    usual: OptionValue,
    title: str,
    *,
    meaning: str = "",
    low: float | None = None,
    high: float | None = None,
) -> Any:
    """A field of a dataclass that is an option."""
    kind = next(name for name, of in _TYPES.items() if isinstance(usual, of))
    bounds = {"minimum": low, "maximum": high}
    schema = {"type": kind, "title": title, "description": meaning, "default": usual, **bounds}
    return field(default=usual, metadata={_SCHEMA: schema})


def options_of(made_by: Any) -> tuple[OfferedOption, ...]:
    """Options that a class has; none if it says nothing of them.

    An attribute ``options`` that is nothing like a schema, such as a method, is the class's own.

    Raises
    ------
    InputError
        If what it says is no schema of plain values.
    """
    said: Any = getattr(made_by, "options", None)
    if not _is_offer(said):
        some = fields(made_by) if is_dataclass(made_by) else ()
        schemas = {
            field.name: field.metadata[_SCHEMA] for field in some if _SCHEMA in field.metadata
        }
        return tuple(_read_option(name, schema) for name, schema in schemas.items())
    try:
        schema = said.model_json_schema() if hasattr(said, "model_json_schema") else said
    except Exception as error:  # whatever code from outside may raise
        raise InputError(f"its options have no schema: {error!r}") from error
    properties = schema.get("properties") if isinstance(schema, dict) else None
    if not isinstance(properties, dict) or len(properties) > _MOST:
        raise InputError(
            "its `options` are no JSON Schema with `properties`, and no pydantic model"
        )
    return tuple(_read_option(str(name), one) for name, one in properties.items())


def option_values(
    options: Iterable[OfferedOption], given: Mapping[str, OptionValue]
) -> dict[str, OptionValue]:
    """Check values and complete them with the usual ones.

    Raises
    ------
    InputError
        If there is no such option, a value is not possible, or one is missing.
    """
    known = {option.name: option for option in options}
    for name in given:
        if name not in known:
            offered = f"there are {', '.join(known)}" if known else "it has none"
            raise InputError(f"it has no option {name!r}; {offered}")
    found = {}
    for name, one in known.items():
        value = given.get(name, one.usual)
        if value is None:
            raise InputError(f"option {name!r} has to be given: {_CALLED[one.kind]}")
        found[name] = _check_value(one, value)
    return found


def values_for(
    found: Any, given: Mapping[str, OptionValue], *, name: str, others: bool = False
) -> dict[str, OptionValue]:
    """Values that a class is made with, checked and completed; what is no class takes none.

    Parameters
    ----------
    name
        Of the class, as an error says it.
    others
        Leave what a class does not offer to the class, unchecked.

    Raises
    ------
    InputError
        If there is no such option, a value is not possible or missing, or what the class says of
        its options is no schema.
    """
    is_class = isinstance(found, type)
    try:
        options = options_of(found) if is_class else ()
        known = {option.name for option in options}
        left = {key for key in given if key not in known} if others and is_class else set()
        checked = option_values(options, {key: v for key, v in given.items() if key not in left})
    except InputError as error:
        error.element = name
        raise
    return {**given, **checked}


def _is_offer(said: Any) -> bool:
    """Whether an attribute is meant as a schema, perhaps as a wrong one."""
    if not isinstance(said, dict):
        return hasattr(said, "model_json_schema")
    if "properties" in said or "$schema" in said or said.get("type") == "object":
        return True
    return any(isinstance(row, dict) and row.get("type") in _KINDS for row in said.values())


def _read_option(name: str, schema: Any) -> OfferedOption:
    kind = schema.get("type") if isinstance(schema, dict) else None
    choices = schema.get("enum", ()) if isinstance(schema, dict) else ()
    texts = isinstance(choices, list | tuple) and all(isinstance(choice, str) for choice in choices)
    if kind not in _KINDS or not texts or len(choices) > _MOST or (choices and kind != "string"):
        raise InputError(f"option {name!r} is not one of {', '.join(_KINDS)}; an enum has texts")
    bounds = [schema.get("minimum"), schema.get("maximum")]
    if not all(bound is None or _is_number(bound) for bound in bounds):
        raise InputError(f"bounds of option {name!r} are no numbers: {bounds}")
    option = OfferedOption(
        name=name,
        kind=kind,
        title=str(schema.get("title", name))[:_LONGEST],
        meaning=str(schema.get("description", ""))[:_LONGEST],
        usual=None,
        low=bounds[0],
        high=bounds[1],
        choices=tuple(choices),
    )
    usual = schema.get("default")
    return option if usual is None else option._replace(usual=_check_value(option, usual))


def _check_value(option: OfferedOption, value: Any) -> OptionValue:
    """Return a value as it is given to the class."""
    name, kind = option.name, option.kind
    fits = {
        "number": _is_number(value),
        "integer": _is_number(value) and value == round(value),
        "boolean": isinstance(value, bool) or value in (0, 1),
        "string": isinstance(value, str) and len(value) <= _LONGEST,
    }[kind]
    if not fits:
        raise InputError(f"option {name!r} is {value!r}, not {_CALLED[kind]}")
    if option.choices and value not in option.choices:
        raise InputError(f"option {name!r} is {value!r}, not one of {', '.join(option.choices)}")
    if kind in ("number", "integer"):
        low, high = option.low, option.high
        if (low is not None and value < low) or (high is not None and value > high):
            bounds = f"{'' if low is None else f'{low:g}'}..{'' if high is None else f'{high:g}'}"
            raise InputError(f"option {name!r} is {value:g}, not within {bounds}")
        return int(value) if kind == "integer" else float(value)
    found: OptionValue = bool(value) if kind == "boolean" else value
    return found


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
