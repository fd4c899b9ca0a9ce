"""Figures of traffic as files: ``figures.json`` and a CSV per table."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from odscen.results.measures.traffic import TABLES, TrafficFigures, over_run
from odscen.results.measures.traffic_sums import EMISSIONS
from odscen.results.measures.units import unit_of
from odscen.results.records.run_records import rounded

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    import polars as pl

FIGURES_FORMAT = "odscen-figures"
VERSION = 1
_DIGITS = 4

COLUMN_UNITS = {
    **dict.fromkeys(("begin", "end", "delay", "waiting", "travel_time", "free_flow_time"), "s"),
    **dict.fromkeys(("seconds", "time_loss", "standing_seconds"), "veh*s"),
    **dict.fromkeys(("vehicles", "standing", "running", "departed", "arrived"), "veh"),
    **dict.fromkeys(("queue_max", "queue_p95", "throughput"), "veh"),
    **dict.fromkeys(EMISSIONS, "g"),
    "flow": "veh/h",
    "density": "veh/km",
    "speed": "m/s",
    "distance": "m",
    "length": "km",
}
"""Units of the columns of :class:`odscen.results.measures.traffic.TrafficFigures`."""
_COUNTS = ("vehicles", "departed", "arrived", "throughput")


def write_tables(figures: TrafficFigures, folder: Path) -> None:
    """Write ``network.csv``, ``segments.csv``, ``junctions.csv`` and ``movements.csv``."""
    folder.mkdir(exist_ok=True)
    for name in TABLES:
        table: pl.DataFrame = getattr(figures, name)
        _short(table).write_csv(folder / f"{name}.csv")


def read_tables(folder: Path) -> TrafficFigures | None:
    """Inverse of :func:`write_tables`; ``None`` if the run has none."""
    import polars as pl

    if not all((folder / f"{name}.csv").is_file() for name in TABLES):
        return None
    types: dict[str, type[pl.DataType]] = dict.fromkeys(COLUMN_UNITS, pl.Float64)
    types |= dict.fromkeys(_COUNTS, pl.Int64)
    tables = {}
    for name in TABLES:
        file = folder / f"{name}.csv"
        names = pl.scan_csv(file).collect_schema().names()
        # Whatever else a table has, such as ids and levels, is text.
        schema = {column: types.get(column, pl.String) for column in names}
        tables[name] = pl.read_csv(file, schema=schema)
    return TrafficFigures(**tables)


def figures_json(figures: TrafficFigures, of_run: Mapping[str, float | None]) -> str:
    """``figures.json``: figures of the run, and of each place over the whole run, with units."""
    tables = {name: over_run(getattr(figures, name)) for name in TABLES}
    data: dict[str, Any] = {
        "format": FIGURES_FORMAT,
        "version": VERSION,
        "units": {"run": {name: unit_of(name) for name in of_run}, "tables": COLUMN_UNITS},
        "run": rounded(of_run),
        **{name: _short(table).to_dicts() for name, table in tables.items()},
    }
    return json.dumps(data, indent=1, allow_nan=False) + "\n"


def _short(table: pl.DataFrame) -> pl.DataFrame:
    import polars.selectors as cs

    return table.with_columns(cs.float().round(_DIGITS))
