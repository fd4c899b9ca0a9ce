"""Figures of traffic as files: ``figures.json`` and a CSV per table."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from odscen.base.errors import InputError
from odscen.base.stored_files import stored_document, tables
from odscen.figures.by_place.facility_levels import with_missing
from odscen.figures.by_place.traffic import TABLES, TrafficFigures
from odscen.figures.measures.figure import Basis
from odscen.figures.measures.registry import COLUMN_UNITS, RUN_FIGURES, figure_values
from odscen.figures.measures.table_columns import COLUMNS
from odscen.records.row_text import rounded

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    import polars as pl

    from odscen.figures.by_place.traffic import TableName
    from odscen.figures.measures.figure import RunData

FIGURES_FORMAT = "odscen-figures"
VERSION = 1
STATIONS_TABLE = "stations.csv"
"""Name of the table of stations in the folder of figures."""
_DIGITS = 4


def write_tables(figures: TrafficFigures, folder: Path) -> None:
    """Write ``network.csv``, ``segments.csv``, ``junctions.csv`` and so on."""
    folder.mkdir(exist_ok=True)
    for name in TABLES:
        table: pl.DataFrame = getattr(figures, name)
        _round_floats(table).write_csv(folder / f"{name}.csv")


def read_tables(folder: Path) -> TrafficFigures | None:
    """Inverse of :func:`write_tables`; ``None`` if the run has none.

    Raises
    ------
    InputError
        If a table cannot be read.
    """
    import polars as pl

    there = [name for name in TABLES if (folder / f"{name}.csv").is_file()]
    if not {*TABLES} - {"lane_groups"} <= {*there}:  # which earlier versions have not written
        return None
    found = {}
    for name in there:
        file = folder / f"{name}.csv"
        with tables(str(file)):
            names = pl.scan_csv(file).collect_schema().names()
            if "begin" not in names:
                raise InputError(
                    "not a table of figures: there is no column 'begin'", file=str(file)
                )
            found[name] = with_missing(pl.read_csv(file, schema=_column_types(names)))
    return TrafficFigures(**found)


def write_stations(stations: pl.DataFrame, folder: Path) -> None:
    """Write what the stations of the study counted, ``stations.csv``."""
    folder.mkdir(exist_ok=True)
    _round_floats(stations).write_csv(folder / STATIONS_TABLE)


def read_stations(folder: Path) -> pl.DataFrame | None:
    """Inverse of :func:`write_stations`; ``None`` if the run has none.

    Raises
    ------
    InputError
        If the table cannot be read.
    """
    import polars as pl

    file = folder / STATIONS_TABLE
    if not file.is_file():
        return None
    with tables(str(file)):
        names = pl.scan_csv(file).collect_schema().names()
        text = {"station", "kind"}
        return pl.read_csv(
            file, schema={name: pl.String if name in text else pl.Float64 for name in names}
        )


def places_from_json(text: str, table: TableName) -> pl.DataFrame:
    """One table of :func:`figures_json`: a row for each place, over the whole run.

    Raises
    ------
    InputError
        If the text is something else.
    """
    import polars as pl

    with stored_document(
        text,
        pl.exceptions.PolarsError,
        form=FIGURES_FORMAT,
        version=VERSION,
        what="figures of a run",
    ) as data:
        rows = data.get(table, ()) if table == "lane_groups" else data[table]
        return pl.DataFrame(rows, schema=_column_types(rows[0] if rows else ()))


def _column_types(names: Iterable[str]) -> dict[str, type[pl.DataType]]:
    import polars as pl

    types: dict[str, type[pl.DataType]] = {
        column.name: pl.Int64 if column.whole else pl.Float64 for column in COLUMNS
    }
    # Whatever else a table has, such as ids and levels, is text.
    return {name: types.get(name, pl.String) for name in names}


def figures_json(data: RunData, figures: TrafficFigures) -> str:
    """``figures.json``: figures of the run and of each place over the whole run, with units.

    Figures that are of actors alone are in ``summary.json`` only.
    """
    shown = [figure for figure in RUN_FIGURES if figure.basis is not Basis.ACTORS]
    of_run = figure_values(data, shown)
    units = {figure.name: figure.unit for figure in shown if figure.name in of_run}
    content: dict[str, Any] = {
        "format": FIGURES_FORMAT,
        "version": VERSION,
        "units": {"run": units, "tables": COLUMN_UNITS},
        "run": rounded(of_run),
        **{name: _round_floats(table).to_dicts() for name, table in figures.whole.items()},
    }
    return json.dumps(content, indent=1, allow_nan=False) + "\n"


def _round_floats(table: pl.DataFrame) -> pl.DataFrame:
    import polars.selectors as cs

    return table.with_columns(cs.float().round(_DIGITS))
