"""Sections of the report about traffic by place and time: what their templates are given.

Each function gives the values of one block of ``run_report.html.j2``, ``None`` if the run has
nothing to show in it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.base.arrays import FloatArray, IntArray, offsets, ranges
from odscen.base.markup import Markup, element, number, path_data
from odscen.figures.by_place.level_of_service import FEWEST
from odscen.figures.by_place.traffic import over_run
from odscen.reports.charts import (
    ChartFrame,
    Dots,
    Series,
    chart,
    clock_axis,
    dot_chart,
    legend,
    line_chart,
    text_at,
    value_axis,
)
from odscen.reports.report_cards import Card
from odscen.reports.report_words import stretch

if TYPE_CHECKING:
    from collections.abc import Sequence

    import polars as pl

    from odscen.figures.by_place.traffic import TrafficFigures
    from odscen.reports.place_names import PlaceNames

MOST_PLACES = 12
"""Rows of each table of places at most, the worst first."""

FEW = 20
"""Vehicles that a place has to have had to be among the worst: one unlucky driver is no jam."""


def service_values(figures: TrafficFigures, names: PlaceNames) -> dict[str, Any] | None:
    """Worst junctions and turning movements by level of service."""
    junctions = _graded_places("junction", figures.junctions)
    movements = _graded_places("movement", figures.movements)
    for row in junctions:
        row["name"] = names.name_junction(row["junction"])
    for row in movements:
        row["name"] = names.name_movement(row["movement"])
    if not (junctions or movements):
        return None
    return {"junctions": junctions, "movements": movements, "fewest": FEWEST, "few": FEW}


def _graded_places(place: str, table: pl.DataFrame) -> list[dict[str, Any]]:
    """Worst places with their strips of levels and worst intervals."""
    import polars as pl

    rows = worst_places(over_run(table))
    for row in rows:
        times = table.filter(pl.col(place) == row[place]).sort("begin")
        row["counted"] = row["vehicles"] if row.get("passages") is None else row["passages"]
        row["strip"] = level_strip(times)
        measured = "control_delay" if times["passages"].count() else "delay"
        known = times.with_columns(shown=measured).drop_nulls("shown")
        row["worst"] = "-"
        if not known.is_empty():
            worst = known.sort(["shown", "begin"], descending=[True, False]).row(0, named=True)
            begin = stretch(worst["begin"], worst["end"]).split(" to ")[0]
            row["worst"] = f"{begin}, {number(worst['shown'], 0)} s"
    return rows


def worst_places(rows: pl.DataFrame) -> list[dict[str, Any]]:
    """Return the places with the longest delay first; those with traffic only."""
    import polars as pl

    shown = rows.with_columns(shown=pl.coalesce("control_delay", "delay"))
    number = pl.coalesce("passages", "vehicles")
    busy = shown.filter((number >= FEW) & pl.col("shown").is_not_null())
    place = "movement" if "movement" in rows.columns else "junction"
    return busy.sort(["shown", place], descending=[True, False]).head(MOST_PLACES).to_dicts()


def level_strip(times: pl.DataFrame) -> Markup:
    """Band of the levels of one place over time, the first interval at the left."""
    rows = times.select("begin", "end", "level").rows()
    begin, end = rows[0][0], rows[-1][1]
    shapes: dict[str, list[str]] = {}
    for start, stop, level in rows:
        if level is not None:
            x, width = ((value / (end - begin)) * 960 for value in (start - begin, stop - start))
            shapes.setdefault(level, []).append(f"M{x:.0f} 0h{width:.0f}v10h-{width:.0f}z")
    parts = [
        element("path", d="".join(data), class_=f"los-{level.lower()}")
        for level, data in sorted(shapes.items())
    ]
    words = f"level over time, between {min(shapes)} and {max(shapes)}" if shapes else "no traffic"
    return element(
        "svg", element("title", words), *parts, viewBox="0 0 960 10", role="img", class_="strip",
        preserveAspectRatio="none",
    )  # fmt: skip


def group_values(groups: pl.DataFrame, names: PlaceNames) -> dict[str, Any] | None:
    """Lane groups with the longest queues, demand and capacity per hour.

    Parameters
    ----------
    groups
        ``lane_groups`` of :class:`odscen.figures.by_place.traffic.TrafficFigures`.
    """
    import polars as pl

    if groups.is_empty():
        return None
    whole = over_run(groups).sort(["queue_metres_p95", "lane_group"], descending=[True, False])
    hours = (pl.col("end") - pl.col("begin")) / 3600.0
    shown = whole.head(MOST_PLACES).with_columns(
        demand=pl.col("demand") / hours, capacity=pl.col("capacity") / hours
    )
    rows = shown.to_dicts()
    for row in rows:
        row["name"] = names.name_lane_group(row["lane_group"])
    return {"rows": rows}


MOST_STATIONS = 200
"""Rows at most; the file has all."""
_STATION_COLUMNS = (
    ("vehicles", 0, 1.0),
    ("flow", 0, 1.0),
    ("speed", 1, 3.6),
    ("occupancy", 1, 100.0),
    ("travel_time", 1, 1.0),
    ("travel_time_p95", 1, 1.0),
    ("left", 0, 1.0),
    ("balance", 0, 1.0),
)
"""Name, digits, and what a value is multiplied by to have the unit of its heading."""


def station_values(stations: pl.DataFrame) -> dict[str, Any] | None:
    """Stations by interval, see :mod:`odscen.figures.by_place.station_figures`."""
    if stations.is_empty():
        return None
    rows = []
    for row in stations.head(MOST_STATIONS).iter_rows(named=True):
        values = [
            "-" if row[name] is None else number(row[name] * factor, digits)
            for name, digits, factor in _STATION_COLUMNS
        ]
        rows.append((row["station"], row["kind"], stretch(row["begin"], row["end"]), *values))
    return {"rows": rows, "count": stations.height}


TIMES = 6
"""Parts of the run that have a colour of their own in the fundamental diagram."""

FLOW, DENSITY, SPEED = "flow, veh/h per lane", "density, veh/km per lane", "speed, km/h"


def column(table: pl.DataFrame, name: str) -> FloatArray:
    """A column as numbers; NaN where there is nothing."""
    import polars as pl

    return table[name].cast(pl.Float64).fill_null(float("nan")).to_numpy()


def _interval_middles(table: pl.DataFrame) -> FloatArray:
    """Middle of each interval, seconds."""
    return (column(table, "begin") + column(table, "end")) / 2.0


def _network_chart(
    network: pl.DataFrame, series: Sequence[Series], *, y_label: str, description: str
) -> Markup:
    """Low chart over the intervals of ``network``, one value of each line for each."""
    return line_chart(
        _interval_middles(network),
        series,
        y_label=y_label,
        description=description,
        height=210.0,
        end=float(network["end"][-1]),
    )


ENOUGH = 50
"""Vehicles below which a mean flow or density of the network says nothing of traffic."""


def _has_traffic(network: pl.DataFrame) -> bool:
    return int(network["departed"].sum() or 0) >= ENOUGH


def flow_values(network: pl.DataFrame) -> dict[str, Any] | None:
    """Three charts over time; ``None`` for one interval only or fewer than 50 vehicles."""
    network = network.sort("begin")
    if network.height < 2 or not _has_traffic(network):
        return None
    charts = []
    for name, factor, label in (
        ("flow", 1.0, FLOW),
        ("density", 1.0, DENSITY),
        ("speed", 3.6, SPEED),
    ):
        series = [Series(name, "c-all", column(network, name) * factor)]
        text = f"{name.capitalize()} of the network over time"
        drawn = _network_chart(network, series, y_label=label, description=text)
        charts.append((name.capitalize(), drawn))
    return {"charts": charts, "minutes": (network["end"][0] - network["begin"][0]) / 60.0}


def diagram_values(network: pl.DataFrame) -> dict[str, Any] | None:
    """Macroscopic fundamental diagram; ``None`` with fewer than four intervals or 50 vehicles."""
    import polars as pl

    busy = network.sort("begin").filter(pl.col("density") > 0)
    if busy.height < 4 or not _has_traffic(network):
        return None
    begin, end = float(busy["begin"][0]), float(busy["end"][-1])
    edges = np.linspace(begin, end, TIMES + 1)
    part_of_row = np.searchsorted(edges, _interval_middles(busy), side="right") - 1
    part_of_row = np.clip(part_of_row, 0, TIMES - 1)
    titles = [
        f"{stretch(row['begin'], row['end'])}: {number(row['flow'], 0)} veh/h, "
        f"{number(row['density'], 1)} veh/km"
        for row in busy.iter_rows(named=True)
    ]
    flow, density = column(busy, "flow"), column(busy, "density")
    groups = []
    for part in range(TIMES):
        chosen = np.flatnonzero(part_of_row == part)
        if len(chosen):
            label = stretch(edges[part], edges[part + 1])
            groups.append(Dots(label, f"t{part}", density[chosen], flow[chosen],
                               [titles[row] for row in chosen.tolist()]))  # fmt: skip
    drawn = dot_chart(
        groups, x_label=DENSITY, y_label=FLOW, joined=True,
        description="Flow of the network over its density, one dot for each interval",
    )  # fmt: skip
    top = busy.sort("flow", descending=True).row(0, named=True)
    values = {name: top[name] for name in ("flow", "density", "speed")}
    return {"chart": drawn, "time": stretch(top["begin"], top["end"]), **values}


SUBSTANCES = {
    "co2": ("carbon dioxide (CO2)", "c-truck"),
    "fuel": ("fuel", "c-bus"),
    "nox": ("nitrogen oxides (NOx)", "c-motorcycle"),
    "co": ("carbon monoxide (CO)", "c-van"),
    "hc": ("hydrocarbons (HC)", "c-bicycle"),
    "pmx": ("particulate matter (PMx)", "c-other"),
}
"""Words and colour by column, in the order of the legends."""

_EMISSION_CHARTS = (
    ("kg/h", 1000.0, ("co2", "fuel"), "Carbon dioxide and fuel over time"),
    ("g/h", 1.0, ("nox", "hc", "pmx"), "Pollutants over time"),
)


def emission_values(figures: TrafficFigures, names: PlaceNames) -> dict[str, Any] | None:
    """Totals, charts and the places with most; ``None`` if emissions were not recorded."""
    import polars as pl

    network = figures.network.sort("begin")
    if network.is_empty() or not (network["co2"].sum() or 0.0):
        return None
    total = over_run(network).row(0, named=True)
    cards = [
        Card(words, _format_mass(total[name]))
        for name, (words, _) in SUBSTANCES.items()
        if total[name] is not None
    ]
    charts = []
    if network.height > 1:
        hours = (column(network, "end") - column(network, "begin")) / 3600.0
        for label, unit, columns, text in _EMISSION_CHARTS:
            series = [
                Series(*SUBSTANCES[name], column(network, name) / hours / unit)
                for name in columns
                if name in network.columns and network[name].is_not_null().any()
            ]
            drawn = _network_chart(network, series, y_label=label, description=text)
            charts.append((text, drawn))
    tables = [
        over_run(table).select(
            pl.lit(kind).alias("kind"),
            pl.col(place).alias("place"),
            "vehicles",
            pl.col("co2", "fuel", "nox", "pmx").cast(pl.Float64),
        )
        for kind, place, table in (
            ("road", "segment", figures.segments),
            ("junction", "junction", figures.junctions),
        )
    ]
    most = (
        pl.concat(tables)
        .filter(pl.col("co2").is_not_null())
        .sort(["co2", "place"], descending=[True, False])
        .head(MOST_PLACES)
    )
    rows = most.to_dicts()
    for row in rows:
        row["place"] = names.name_place(row["place"])
    return {"cards": cards, "charts": charts, "rows": rows, "total": total["co2"]}


def _format_mass(grams: float) -> str:
    for unit, size in (("t", 1e6), ("kg", 1e3)):
        if grams >= size:
            return f"{number(grams / size, 1)} {unit}"
    return f"{number(grams, 1)} g"


QUEUED_BELOW = 5.0 / 3.6
"""m/s; slower is drawn as queued, as a queue that creeps is one."""

_SHARP = 0.4
"""Units of the drawing by which a simplified line may be off."""


@dataclass(frozen=True, slots=True, eq=False)
class CorridorTraces:
    """Vehicles on a corridor in a stretch of time.

    Attributes
    ----------
    segments
        Of the corridor, in driving direction.
    junctions
        Name, begin and end (metres along the corridor) of each junction on it.
    length
        Of the corridor, metres.
    begin, end
        Of the stretch of time, seconds.
    time, along, speed, piece
        Shape ``(N,)``: seconds, metres along the corridor, m/s; ``piece`` numbers the passages, one
        after the other, in order of time in each.
    vehicles
        How many there were, drawn or not.
    """

    segments: tuple[str, ...]
    junctions: Sequence[tuple[str, float, float]]
    length: float
    begin: float
    end: float
    time: FloatArray
    along: FloatArray
    speed: FloatArray
    piece: IntArray
    vehicles: int


NONE_RECORDED = "There are no trajectories to draw: the run was made without them."


def corridor_values(traces: CorridorTraces | str, names: PlaceNames) -> dict[str, Any]:
    """Time-space diagram, or the words why there is none."""
    if isinstance(traces, str):
        return {"words": traces, "through": "", "chart": ""}
    junctions = _format_count(len(traces.junctions), "junction")
    words = (
        f"From {names.name_segment(traces.segments[0])} to "
        f"{names.name_segment(traces.segments[-1])}, {number(traces.length, 0)} m "
        f"through {junctions}, {stretch(traces.begin, traces.end)}: "
        f"{_format_count(traces.vehicles, 'vehicle')}."
    )
    through = ", ".join(names.name_junction(name) for name, _, _ in traces.junctions)
    return {"words": words, "through": through, "chart": _time_space_chart(traces, names)}


def _format_count(count: int, noun: str) -> str:
    return f"{count:,} {noun}{'' if count == 1 else 's'}"


def _time_space_chart(traces: CorridorTraces, names: PlaceNames) -> Markup:
    frame = ChartFrame(
        clock_axis(traces.begin, traces.end),
        value_axis(traces.length, "distance along the corridor, m", tight=True),
        height=460.0,
    )
    left, right = (float(frame.x(value)) for value in (traces.begin, traces.end))
    bands: list[Markup] = []
    texts: list[Markup] = []
    labels: list[float] = []
    for name, begin, end in traces.junctions:
        low, high = float(frame.y(begin)), float(frame.y(end))
        bands.append(element("rect", x=left, y=high, width=right - left,
                             height=max(low - high, 1.0), class_="band-of"))  # fmt: skip
        middle = (low + high) / 2 + 4.0
        if all(abs(middle - other) > 14.0 for other in labels):
            labels.append(middle)
            words = names.name_junction(name)
            texts.append(text_at(right - 4, middle, words, class_="over", text_anchor="end"))
    driven = [
        element("path", d=data, transform="scale(0.1)", class_=f"trace {style}")
        for style, data in zip(("moving", "standing"), _trace_data(frame, traces), strict=True)
    ]
    keys = [("c-moving", "moving vehicle"), ("c-standing", "queued vehicle"),
            ("c-band", "junction")]  # fmt: skip
    return chart(
        frame,
        [*bands, *driven, *texts],
        description="Places of vehicles along the corridor over time; red where they are queued",
        keys=legend(keys),
    )


def _trace_data(frame: ChartFrame, traces: CorridorTraces) -> tuple[str, str]:
    """Path data of everything driven and of everything queued, in tenths of the drawing's units."""
    import shapely

    count = len(traces.time)
    if count == 0:
        return "", ""
    slow = traces.speed < QUEUED_BELOW
    new_piece = np.concatenate([[True], traces.piece[1:] != traces.piece[:-1]])
    begins = np.flatnonzero(new_piece | np.concatenate([[True], slow[1:] != slow[:-1]]))
    ends = np.append(begins[1:], count)
    # A run of one kind reaches to the first point of the next one of the same passage.
    joined = (ends < count) & ~new_piece[np.minimum(ends, count - 1)]
    sizes = ends - begins + joined
    keep = sizes > 1
    begins, sizes = begins[keep], sizes[keep]
    if len(begins) == 0:
        return "", ""
    rows = ranges(begins, sizes)
    points = np.column_stack([frame.x(traces.time[rows]), frame.y(traces.along[rows])])
    lines = shapely.linestrings(points, indices=np.repeat(np.arange(len(sizes)), sizes))
    lines = shapely.simplify(lines, _SHARP, preserve_topology=False)
    data = []
    for kind in (False, True):
        chosen = lines[slow[begins] == kind]
        xy, index = shapely.get_coordinates(chosen, return_index=True)
        start = offsets(np.bincount(index, minlength=len(chosen)))
        data.append(path_data(xy, start, unit=0.1))
    return data[0], data[1]
