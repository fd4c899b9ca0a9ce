"""Files of ours read again: what is not as it was written is named, in words."""

from __future__ import annotations

from contextlib import contextmanager
from enum import Enum
from functools import lru_cache
from types import NoneType
from typing import TYPE_CHECKING, Any, TypeVar, get_args, get_origin, get_type_hints

import orjson

from odscen.base.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

_Row = TypeVar("_Row")


def read_json(text: str | bytes, *, what: str) -> dict[str, Any]:
    """A JSON object.

    Raises
    ------
    InputError
        If it is something else, numbers that no double holds and nesting without end among it.
    """
    try:
        data = orjson.loads(text)
    except ValueError as error:
        raise InputError(f"not {what}: {error}") from error
    if not isinstance(data, dict):
        raise InputError(f"not {what}: the document must be a JSON object")
    return data


def read_document(text: str | bytes, *, form: str, version: int, what: str) -> dict[str, Any]:
    """A JSON document of ours.

    Parameters
    ----------
    form, version
        What it must say of itself, as ``format`` and ``version``.
    what
        What it is, for messages: ``a baseline``.

    Raises
    ------
    InputError
        If it is no JSON, or another document.
    """
    data = read_json(text, what=what)
    if (data.get("format"), data.get("version")) != (form, version):
        raise InputError(
            f"format {data.get('format')!r} version {data.get('version')!r} is not {what}"
        )
    return data


@contextmanager
def documents(what: str, *more: type[Exception]) -> Iterator[None]:
    """Say of a document that is used here what is wrong with it, instead of how Python puts it.

    Parameters
    ----------
    more
        What else a wrong part of it may lead to.

    Raises
    ------
    InputError
        Instead of what an unknown, missing or wrong part of it leads to.
    """
    try:
        yield
    except KeyError as error:
        raise InputError(f"not {what}: {error.args[0]!r} is missing or not known") from error
    except (TypeError, ValueError, ArithmeticError, AttributeError, LookupError) as error:
        raise InputError(f"not {what}: {error}") from error
    except more as error:
        raise InputError(f"not {what}: {_first_line(error)}") from error


@contextmanager
def stored_document(
    text: str | bytes, *more: type[Exception], form: str, version: int, what: str
) -> Iterator[dict[str, Any]]:
    """Read a JSON document of ours and say what is wrong with it where it is used.

    Parameters and errors of :func:`read_document` and :func:`documents`.
    """
    data = read_document(text, form=form, version=version, what=what)
    with documents(what, *more):
        yield data


@contextmanager
def tables(place: str) -> Iterator[None]:
    """Say where tables are that cannot be read or lack columns: in the folder of a run.

    Raises
    ------
    InputError
        Instead of what polars and the system raise.
    """
    import polars as pl

    try:
        yield
    except (OSError, pl.exceptions.PolarsError) as error:
        raise InputError(
            f"files of the run cannot be read: {_first_line(error)}", file=place
        ) from error
    except pl.exceptions.PanicException as error:  # no Exception, and no crash either
        raise InputError(
            f"files of the run cannot be read: {_first_line(error)}", file=place
        ) from None


def _first_line(error: BaseException) -> str:
    lines = str(error).strip().splitlines()
    return lines[0][:200] if lines else type(error).__name__


def typed_rows(kind: Callable[..., _Row]) -> Callable[[Mapping[str, Any]], _Row]:
    """Make rows of a flat dataclass or named tuple, each value of the type that it is to have.

    What it gives raises ``TypeError`` or ``ValueError`` that name the field.
    """
    enums, known = _field_types(kind)

    def make(row: Mapping[str, Any]) -> _Row:
        for name, value in row.items():
            if name in known and type(value) not in known[name]:
                raise TypeError(f"{name} cannot be {value!r:.60}")
        return kind(**{**row, **{name: enum(row[name]) for name, enum in enums.items()}})

    return make


@lru_cache(maxsize=64)
def _field_types(kind: Callable[..., Any]) -> tuple[dict[str, type], dict[str, frozenset[type]]]:
    """Enumerations among the fields, and the types that the value of each may have."""
    hints = {name: _types_of_hint(hint) for name, hint in get_type_hints(kind).items()}
    enums = {name: types[0] for name, types in hints.items() if issubclass(types[0], Enum)}
    return enums, {name: _accepted_json_types(types) for name, types in hints.items()}


def _types_of_hint(hint: Any) -> tuple[type, ...]:
    """Types of a hint: those of a union; of a tuple or an object that itself, not what is in it."""
    if get_origin(hint) in (tuple, dict):
        return (get_origin(hint),)
    return tuple(get_origin(argument) or argument for argument in get_args(hint)) or (hint,)


def _accepted_json_types(types: tuple[type, ...]) -> frozenset[type]:
    """Types of JSON values: a whole number may stand for any, a text for an enumeration."""
    json_types = {str if issubclass(kind, str) else kind for kind in types}
    return frozenset(json_types | {int} if float in json_types else json_types) | (
        json_types & {NoneType}
    )
