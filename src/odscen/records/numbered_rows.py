"""Rows of trajectories as arrays, with numbers in place of names.

There are very many rows, and few vehicles and lanes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
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
    found: IntArray = names.cast(kind).to_physical().to_numpy()
    return found, kind.categories.to_list()


def numbers_among(names: pl.Series, known: pl.Series) -> IntArray:
    """Row of each name in ``known``, which has all of them, each once; no nulls."""
    number, named = numbers(names)
    row = {name: k for k, name in enumerate(known)}
    kind = np.min_scalar_type(len(row))  # numpy sorts small numbers sooner
    found: IntArray = np.array([row.get(name, 0) for name in named], dtype=kind)[number]
    return found


def among(column: str, names: pl.Series, kind: pl.DataType) -> pl.Expr:
    """Whether a column of type ``kind``, text or numbered, has one of these names."""
    import polars as pl

    return pl.col(column).is_in(names.cast(kind, strict=False).drop_nulls().implode())


def by_vehicle_and_time(vehicle: IntArray, time: pl.Series) -> IntArray:
    """Places of rows in the order of vehicles and times (s)."""
    if time.is_sorted():  # as SUMO writes them
        return np.argsort(vehicle, kind="stable")
    return np.lexsort((time.to_numpy(), vehicle))


def changes(values: IntArray | FloatArray) -> BoolArray:
    """Whether a value is another than the one before it, ``(N,)``; the first one is."""
    found = np.ones(len(values), dtype=np.bool_)
    found[1:] = values[1:] != values[:-1]
    return found


def _enum_of(names: pl.Series) -> pl.Enum:
    import polars as pl

    return pl.Enum(names.unique().drop_nulls().sort())
