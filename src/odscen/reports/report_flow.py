"""Flow, density and speed of the whole network over time, and over each other."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.base.markup import Markup, element, number
from odscen.reports.charts import Dots, Series, dot_chart, line_chart
from odscen.reports.page_templates import report_section
from odscen.reports.report_words import stretch

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import polars as pl

    from odscen.base.arrays import FloatArray


TIMES = 6
"""Parts of the run that have a colour of their own."""

FLOW, DENSITY, SPEED = "flow, veh/h per lane", "density, veh/km per lane", "speed, km/h"


def column(table: pl.DataFrame, name: str) -> FloatArray:
    """A column as numbers; NaN where there is nothing."""
    import polars as pl

    return table[name].cast(pl.Float64).fill_null(float("nan")).to_numpy()


def middles(table: pl.DataFrame) -> FloatArray:
    """Middle of each interval, seconds."""
    return (column(table, "begin") + column(table, "end")) / 2.0


def network_chart(
    network: pl.DataFrame, series: Sequence[Series], *, y_label: str, description: str
) -> Markup:
    """Low chart over the intervals of ``network``, one value of each line for each."""
    return line_chart(
        middles(network),
        series,
        y_label=y_label,
        description=description,
        height=210.0,
        end=float(network["end"][-1]),
    )


def flow_section(network: pl.DataFrame) -> Markup | None:
    """Three charts over time; ``None`` for a run with one interval only."""
    network = network.sort("begin")
    if network.height < 2:
        return None
    charts: list[Markup | None] = []
    for name, factor, label in (
        ("flow", 1.0, FLOW),
        ("density", 1.0, DENSITY),
        ("speed", 3.6, SPEED),
    ):
        series = [Series(name, "c-all", column(network, name) * factor)]
        text = f"{name.capitalize()} of the network over time"
        charts += [
            element("h3", name.capitalize()),
            network_chart(network, series, y_label=label, description=text),
        ]
    width = number((network["end"][0] - network["begin"][0]) / 60.0, 1)
    explained = (
        "flow is how many vehicles pass a place on a lane in an hour, density how many are on a "
        f"kilometre of it, both as means over all lanes of the map and {width} min; flow is "
        "density times speed. When density climbs while speed falls, the network becomes congested."
    )
    return report_section("Flow, density and speed", *charts, explained=explained, ident="flow")


def diagram_section(network: pl.DataFrame) -> Markup | None:
    """Macroscopic fundamental diagram; ``None`` with fewer than four intervals with traffic."""
    import polars as pl

    busy = network.sort("begin").filter(pl.col("density") > 0)
    if busy.height < 4:
        return None
    drawn = dot_chart(
        _by_time(busy), x_label=DENSITY, y_label=FLOW, joined=True,
        description="Flow of the network over its density, one dot for each interval",
    )  # fmt: skip
    top = busy.sort("flow", descending=True).row(0, named=True)
    most = element(
        "p",
        f"The flow was highest from {stretch(top['begin'], top['end'])}: {number(top['flow'], 0)} "
        f"veh/h per lane, at {number(top['density'], 1)} veh/km and "
        f"{number(top['speed'] * 3.6, 0)} km/h on average.",
    )
    explained = (
        "each dot is one interval, and the line joins them in order of time. As long as dots climb "
        "to the right in a straight line, traffic flows freely. Where they bend or fall, the "
        "network has reached its capacity: a higher density no longer brings a higher flow. If the "
        "line returns below itself, it draws a loop (hysteresis): congestion dissolves more slowly "
        "than it built up, with a lower flow at the same density."
    )
    return report_section(
        "Macroscopic fundamental diagram", drawn, most, explained=explained, ident="diagram"
    )


def _by_time(busy: pl.DataFrame) -> list[Dots]:
    begin, end = float(busy["begin"][0]), float(busy["end"][-1])
    edges = np.linspace(begin, end, TIMES + 1)
    which = np.clip(np.searchsorted(edges, middles(busy), side="right") - 1, 0, TIMES - 1)
    titles = [_title(row) for row in busy.iter_rows(named=True)]
    flow, density = column(busy, "flow"), column(busy, "density")
    groups = []
    for part in range(TIMES):
        chosen = np.flatnonzero(which == part)
        if len(chosen):
            label = stretch(edges[part], edges[part + 1])
            groups.append(Dots(label, f"t{part}", density[chosen], flow[chosen],
                               [titles[row] for row in chosen.tolist()]))  # fmt: skip
    return groups


def _title(row: Mapping[str, float]) -> str:
    return (
        f"{stretch(row['begin'], row['end'])}: {number(row['flow'], 0)} veh/h, "
        f"{number(row['density'], 1)} veh/km"
    )
