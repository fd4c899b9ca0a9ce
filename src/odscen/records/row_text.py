"""Rows as JSON text with one row per line, which people can read and diff."""

from __future__ import annotations

import json
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any, TypeVar

from odscen.base.stored_files import stored_document

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

_Row = TypeVar("_Row")
Defaults = tuple[tuple[str, Any], ...]

VERSION = 1
_encode = json.JSONEncoder(ensure_ascii=False, allow_nan=False).encode
"""What ``json.dumps`` makes anew at each call; a long run has a row for every event."""


def json_with_rows(head: Mapping[str, Any], key: str, rows: Iterable[Mapping[str, Any]]) -> str:
    """JSON text of ``{**head, key: rows}`` with one row per line, which people can read and diff.

    Numbers are rounded to 1e-6: far below what is physical, and free of rounding noise.
    """
    return "".join(text_with_rows(head, key, map(row_text, rows)))


def rows_from_json(
    text: str, key: str, form: str, make: Callable[[Mapping[str, Any]], _Row]
) -> tuple[_Row, ...]:
    """Inverse of :func:`json_with_rows`.

    Parameters
    ----------
    key
        What the rows are.
    form
        The format that the text must name, with our version.
    make
        Makes of a row what it stands for.

    Raises
    ------
    InputError
        If the text has another format or version, or rows that ``make`` cannot take.
    """
    with stored_document(text, form=form, version=VERSION, what=f"a list of {key}") as data:
        return tuple(map(make, data[key]))


def text_with_rows(head: Mapping[str, Any], key: str, rows: Iterable[str]) -> Iterator[str]:
    """Text of :func:`json_with_rows` piece by piece, from what :func:`row_text` gives."""
    yield "{\n"
    for name, value in head.items():
        yield f"  {json.dumps(name)}: {json.dumps(value)},\n"
    yield f"  {json.dumps(key)}: ["
    before = "\n    "
    for row in rows:
        yield before + row
        before = ",\n    "
    yield "]\n}\n" if before == "\n    " else "\n  ]\n}\n"


def row_text(row: Mapping[str, Any]) -> str:
    """One row as written in such a text."""
    return _encode(rounded(row))


def rounded(row: Mapping[str, Any]) -> dict[str, Any]:
    """Round the floats of a row to 1e-6."""
    return {
        name: rounded(value)
        if isinstance(value, dict)
        else round(value, 6)
        if isinstance(value, float)
        else value
        for name, value in row.items()
    }


def field_defaults(kind: type) -> Defaults:
    """Names and defaults of the fields of a dataclass or named tuple."""
    if is_dataclass(kind):
        return tuple((field.name, field.default) for field in fields(kind))
    own = vars(kind)
    return tuple((name, own["_field_defaults"].get(name, ...)) for name in own["_fields"])


def without_defaults(value: object, defaults: Defaults) -> dict[str, Any]:
    """Fields that do not have their default value; ``defaults`` as of :func:`field_defaults`."""
    return {name: item for name, default in defaults if (item := getattr(value, name)) != default}
