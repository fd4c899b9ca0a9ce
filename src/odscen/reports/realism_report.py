"""How alike a run and recorded traffic are, as a page: distances by figure, and distributions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from odscen.base.markup import Markup, element
from odscen.reports.charts import Axis, ChartFrame, chart, legend, nice_ticks, value_axis
from odscen.reports.page_templates import render_page

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.base.arrays import FloatArray

_STYLES: Final = {"recorded": "c-car", "run": "c-bus"}
_HEIGHT: Final = 230.0
_WORDS: Final = {"ttc": "time to collision"}
"""Figures whose name does not say what they are."""


def render_realism(compared: Mapping[str, Any], *, run: str, recorded: str) -> str:
    """Write the page.

    Parameters
    ----------
    compared
        As :func:`odscen.formats.tracks.realism.compare_traffic` gives it.
    run, recorded
        What the two are called.
    """
    groups: dict[str, list[dict[str, Any]]] = {}
    for row in compared["figures"]:
        groups.setdefault(row["group"], []).append(row)
    charts = [
        (row, _draw_distributions(row))
        for row in compared["figures"]
        if row["group"] in ("vehicles", "pedestrians") and len(row["bins"]) > 3
    ]
    return render_page(
        "realism_report.html.j2",
        title=f"{run} and {recorded} compared",
        run=run,
        recorded=recorded,
        compared=compared,
        groups=groups,
        charts=charts,
        words={row["figure"]: _name_figure(row) for row in compared["figures"]},
    )


def _name_figure(row: Mapping[str, Any]) -> str:
    name = str(row["figure"])
    return _WORDS.get(name, name.replace("_", " "))


def _draw_distributions(row: Mapping[str, Any]) -> Markup:
    """Shares of the states in each bin, of both, as steps."""
    bins = np.array(row["bins"])
    shares = {name: np.array(row["shares"][name]) for name in ("recorded", "run")}
    # Bins at both ends in which neither has anything are not drawn.
    used = np.flatnonzero(shares["recorded"] + shares["run"] > 0.0)
    first, last = int(used[0]), int(used[-1]) + 1
    low, high = float(bins[first]), float(bins[last])
    ticks = [(value, f"{value:g}") for value in nice_ticks(low, high) if low <= value <= high]
    label = _name_figure(row) + (f", {row['unit']}" if row["unit"] else "")
    top = max(float(share.max()) for share in shares.values())
    frame = ChartFrame(
        Axis(low, high, ticks, label), value_axis(100.0 * top, "share of states, %"), _HEIGHT
    )
    lines = [
        element(
            "path",
            d=_step_path(frame, bins[first : last + 1], 100.0 * share[first:last]),
            class_=f"line {_STYLES[name]}",
        )
        for name, share in shares.items()
    ]
    return chart(
        frame,
        lines,
        description=f"Distributions of {label} of {row['group']}",
        keys=legend([(style, name) for name, style in _STYLES.items()]),
    )


def _step_path(frame: ChartFrame, bins: FloatArray, shares: FloatArray) -> str:
    x, y = np.asarray(frame.x(np.repeat(bins, 2)[1:-1])), np.asarray(frame.y(np.repeat(shares, 2)))
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x.tolist(), y.tolist(), strict=True))
    return f"M{points}"
