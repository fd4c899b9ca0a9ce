"""Run folders whose files are torn, or not of one run: an error that names the folder."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

from odscen.base.errors import InputError, in_file
from odscen.base.shown import printable

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

_LONGEST = 300


@contextmanager
def damage_named(run: Path) -> Iterator[None]:
    """Say of which run a file is that cannot be read, instead of where in the code it was found.

    Raises
    ------
    InputError
        If a file is missing, torn, or says something that does not fit the others.
    """
    import polars as pl

    try:
        with in_file(str(run)):
            yield
    except (
        pl.exceptions.PolarsError,
        ArithmeticError,
        AttributeError,
        LookupError,
        OSError,
        RecursionError,
        TypeError,
        ValueError,
    ) as error:
        words = printable((str(error).splitlines() or [""])[0][:_LONGEST])
        msg = (
            f"the files of this run are damaged, or not of one run: {type(error).__name__}: {words}"
        )
        raise InputError(msg, file=str(run)) from error
