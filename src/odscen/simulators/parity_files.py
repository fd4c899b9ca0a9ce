"""How far SUMO and another simulator agree on a run: the tables, figures and page in its folder."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Final

from odscen.figures.measures.parity import parity_figures, with_errors
from odscen.reports.parity_report import render_parity
from odscen.runs import layout

if TYPE_CHECKING:
    from pathlib import Path

    import polars as pl

    from odscen.drawing.map_drawing import MapDrawing
    from odscen.records.run_plan import Plan

PARITY_STATES: Final = (
    "time", "row", "x", "y", "z", "hdg", "carla_x", "carla_y", "carla_z", "carla_hdg",
)  # fmt: skip
"""Columns of states, see :mod:`odscen.figures.measures.parity`."""
PARITY_LIGHTS: Final = ("time", "signal", "sumo", "carla")


def write_parity(
    folder: Path,
    states: pl.DataFrame,
    lights: pl.DataFrame | None,
    plan: Plan,
    drawing: MapDrawing | None,
    *,
    shown_by: str = "CARLA",
) -> None:
    """Write the parity report, its figures and its tables into a run folder.

    Parameters
    ----------
    states, lights
        As :mod:`odscen.figures.measures.parity` wants them; no lights where none are shown.
    shown_by
        The simulator that is compared with SUMO, which has the columns ``carla_...``.
    """
    import polars as pl

    if lights is None:
        types = (pl.Float64, pl.String, pl.String, pl.String)
        lights = pl.DataFrame(schema=dict(zip(PARITY_LIGHTS, types, strict=True)))
    states = with_errors(states)
    states.write_parquet(folder / layout.PARITY_STATES_FILE)
    lights.write_parquet(folder / layout.PARITY_LIGHTS_FILE)
    figures = parity_figures(states, lights, plan, shown_by=shown_by)
    text = json.dumps(figures, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    (folder / layout.PARITY_FIGURES_FILE).write_text(text, encoding="utf-8")
    page = render_parity(figures, states, drawing=drawing)
    (folder / layout.PARITY_FILE).write_text(page, encoding="utf-8")
