"""Rows as JSON text with one row per line, which people can read and diff."""

from __future__ import annotations

import json
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any, TypeVar

from odscen.base.stored_files import stored_document

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    import polars as pl

    from odscen.base.arrays import BoolArray, FloatArray, IntArray


def with_numbered_names(table: pl.DataFrame) -> pl.DataFrame:
    """The same table with columns of text as ``polars.Enum``, categories in alphabetical order."""
    import polars as pl

    texts = [name for name, kind in table.schema.items() if kind == pl.String]
    return table.with_columns(table[name].cast(_enum_of(table[name])) for name in texts)


def numbers(names: pl.Series) -> tuple[IntArray, list[str]]:
    """Number of each name, and the names that are numbered, of which some may not occur.

    Parameters
    ----------
    names
        Text, then numbered in alphabetical order, or from :func:`with_numbered_names`; no nulls.
    """
    import polars as pl

    kind = names.dtype if isinstance(names.dtype, pl.Enum) else _enum_of(names)
    codes: IntArray = names.cast(kind).to_physical().to_numpy()
    return codes, kind.categories.to_list()


def numbers_among(names: pl.Series, known: pl.Series) -> IntArray:
    """Row of each name in ``known``, which has all of them, each once; no nulls."""
    import numpy as np  # lazily: a process that forks simulations has none

    number, named = numbers(names)
    row = {name: k for k, name in enumerate(known)}
    kind = np.min_scalar_type(len(row))  # numpy sorts small numbers sooner
    codes: IntArray = np.array([row.get(name, 0) for name in named], dtype=kind)[number]
    return codes


def among(column: str, names: pl.Series, kind: pl.DataType) -> pl.Expr:
    """Whether a column of type ``kind``, text or numbered, has one of these names."""
    import polars as pl

    return pl.col(column).is_in(names.cast(kind, strict=False).drop_nulls().implode())


def by_vehicle_and_time(vehicle: IntArray, time: pl.Series) -> IntArray:
    """Places of rows in the order of vehicles and times (s)."""
    import numpy as np

    if time.is_sorted():  # as SUMO writes them
        return np.argsort(vehicle, kind="stable")
    return np.lexsort((time.to_numpy(), vehicle))


def changes(values: IntArray | FloatArray) -> BoolArray:
    """Whether a value is another than the one before it, ``(N,)``; the first one is."""
    import numpy as np

    is_change = np.ones(len(values), dtype=np.bool_)
    is_change[1:] = values[1:] != values[:-1]
    return is_change


def _enum_of(names: pl.Series) -> pl.Enum:
    import polars as pl

    return pl.Enum(names.unique().drop_nulls().sort())


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
