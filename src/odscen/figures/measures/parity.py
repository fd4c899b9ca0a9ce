"""How far two simulators agree on one run: where road users were, and what the lights showed.

Pure functions of two tables. ``states`` has a row for each road user and step of SUMO's::

    time, row, x, y, z, hdg, carla_x, carla_y, carla_z, carla_hdg

body centres in the OpenDRIVE frame, metres and radians, ``row`` being that of the plan; CARLA's
columns are NaN where it showed no road user. ``lights`` has a row for each step and signal that
both know: ``time, signal, sumo, carla``. The simulator beside SUMO may be another than CARLA; the
columns keep their names.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import polars as pl

    from odscen.base.arrays import FloatArray
    from odscen.records.run_plan import Plan, PlannedActor

FORMAT = "odscen-parity"
VERSION = 1
WORST = 25
"""Road users listed, each at its worst moment."""
PERCENTILES = (50, 95, 99, 100)


def with_errors(states: pl.DataFrame) -> pl.DataFrame:
    """Add ``position`` (level, metres), ``height`` (metres) and ``heading`` (degrees), unsigned.

    All three are null where CARLA did not show it.
    """
    import polars as pl

    dx, dy = pl.col("carla_x") - pl.col("x"), pl.col("carla_y") - pl.col("y")
    turn = pl.col("carla_hdg") - pl.col("hdg")
    return states.with_columns(
        (dx**2 + dy**2).sqrt().alias("position"),
        (pl.col("carla_z") - pl.col("z")).abs().alias("height"),
        pl.arctan2(turn.sin(), turn.cos()).abs().degrees().alias("heading"),
    ).with_columns(pl.col("position", "height", "heading").fill_nan(None))


def parity_figures(
    states: pl.DataFrame, lights: pl.DataFrame, plan: Plan, *, shown_by: str = "CARLA"
) -> dict[str, Any]:
    """All figures of ``parity.json``.

    Parameters
    ----------
    states
        As :func:`with_errors` gives them.
    shown_by
        The simulator that is compared with SUMO.
    """
    both = states.filter(states["position"].is_not_null())
    total = states.height
    return {
        "format": FORMAT,
        "version": VERSION,
        "scenario": plan.scenario,
        "shown_by": shown_by,
        "steps": states["time"].n_unique(),
        "samples": total,
        "mirrored": both.height,
        "share_mirrored": round(both.height / total, 6) if total else None,
        **_position_errors(both),
        "by_category": _errors_by_category(both, plan),
        "departures": _compare_departures(states, plan),
        "absent": _list_absent(states, plan),
        "lights": _compare_lights(lights),
        "worst": _list_worst_moments(both, plan),
    }


def error_curve(states: pl.DataFrame, *, width: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Middle of each ``width`` seconds, and the median and largest position error in them."""
    import polars as pl

    rows = (
        states.filter(pl.col("position").is_not_null())
        .group_by((pl.col("time") / width).floor().alias("bin"))
        .agg(pl.col("position").median().alias("median"), pl.col("position").max().alias("most"))
        .sort("bin")
    )
    middle = (rows["bin"].to_numpy() + 0.5) * width
    return middle, rows["median"].to_numpy(), rows["most"].to_numpy()


def errors_by_place(states: pl.DataFrame, *, size: float) -> tuple[FloatArray, FloatArray]:
    """Largest position error in square cells: lower left corners ``(C, 2)``, errors ``(C,)``."""
    import polars as pl

    cells = (
        states.filter(pl.col("position").is_not_null())
        .group_by((pl.col("x") / size).floor().alias("i"), (pl.col("y") / size).floor().alias("j"))
        .agg(pl.col("position").max())
        .sort("i", "j")
    )
    return cells.select("i", "j").to_numpy() * size, cells["position"].to_numpy()


def _position_errors(both: pl.DataFrame) -> dict[str, dict[str, float] | None]:
    return {
        "position_error_m": _percentiles_of(both["position"].to_numpy()),
        "height_error_m": _percentiles_of(both["height"].to_numpy()),
        "heading_error_deg": _percentiles_of(both["heading"].to_numpy()),
    }


def _percentiles_of(values: FloatArray) -> dict[str, float] | None:
    if not len(values):
        return None
    found = np.percentile(values, PERCENTILES)
    names = [f"p{p}" if p < 100 else "max" for p in PERCENTILES]
    return {name: round(float(value), 6) for name, value in zip(names, found, strict=True)}


def _errors_by_category(both: pl.DataFrame, plan: Plan) -> dict[str, Any]:
    import polars as pl

    categories = pl.Series([actor.category for actor in plan.actors], dtype=pl.String)
    named = both.with_columns(categories.gather(both["row"]).alias("category"))
    return {
        str(key[0]): {"samples": part.height, **_position_errors(part)}
        for key, part in sorted(named.group_by("category"))
    }


def _compare_departures(states: pl.DataFrame, plan: Plan) -> dict[str, Any]:
    """Planned against SUMO's first step, and SUMO's against CARLA's first sight of each."""
    import polars as pl

    first = states.sort("time").group_by("row").first()
    shown = (
        states.filter(pl.col("position").is_not_null())
        .group_by("row")
        .agg(pl.col("time").min().alias("shown"))
    )
    rows = first.join(shown, on="row", how="left").select("row", "time", "x", "y", "shown")
    late, off, behind = [], [], []
    for row, time, x, y, seen in rows.iter_rows():
        actor = plan.actors[row]
        late.append(time - actor.depart)
        off.append(math.hypot(x - actor.x, y - actor.y))
        if seen is not None:
            behind.append(seen - time)
    return {
        "planned": len(plan.actors),
        "in_sumo": rows.height,
        "in_carla": len(behind),
        "sumo_after_plan_s": _percentiles_of(np.array(late)),
        "sumo_off_plan_m": _percentiles_of(np.array(off)),
        "carla_after_sumo_s": _percentiles_of(np.array(behind)),
    }


def _list_absent(states: pl.DataFrame, plan: Plan) -> list[dict[str, Any]]:
    """Who was on the road in SUMO and not shown, with how many steps; the longest first."""
    import polars as pl

    rows = (
        states.filter(pl.col("position").is_null())
        .group_by("row")
        .agg(pl.len().alias("steps"), pl.col("time").min().alias("since"))
        .sort("steps", "row", descending=[True, False])
    )
    return [
        {"actor": plan.actors[row].id, "steps": steps, "since": since}
        for row, steps, since in rows.iter_rows()
    ]


def _compare_lights(lights: pl.DataFrame) -> dict[str, Any]:
    import polars as pl

    wrong = lights.filter(pl.col("sumo") != pl.col("carla"))
    by_signal = wrong.group_by("signal").agg(
        pl.len().alias("steps"), pl.col("time").min().alias("since")
    )
    return {
        "signals": lights["signal"].n_unique(),
        "samples": lights.height,
        "wrong": wrong.height,
        "share_same": round(1.0 - wrong.height / lights.height, 6) if lights.height else None,
        "worst": by_signal.sort("steps", "signal", descending=[True, False]).to_dicts()[:WORST],
    }


def _list_worst_moments(both: pl.DataFrame, plan: Plan) -> list[dict[str, Any]]:
    """The worst moment of each road user, the worst first."""
    rows = both.sort("position", descending=True).group_by("row", maintain_order=True).first()
    return [
        _describe_moment(plan.actors[row["row"]], row)
        for row in rows.head(WORST).iter_rows(named=True)
    ]


def _describe_moment(actor: PlannedActor, row: dict[str, Any]) -> dict[str, Any]:
    names = ("time", "x", "y", "position", "height", "heading")
    return {
        "actor": actor.id,
        "category": actor.category,
        **{name: round(row[name], 4) for name in names},
    }
