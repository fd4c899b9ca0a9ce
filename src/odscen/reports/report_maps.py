"""Maps of the reports: trajectories, mean speed and level of service by place, with their kit."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from odscen.base.markup import Markup, element, join, number, path_data
from odscen.drawing.map_drawing import Lines
from odscen.drawing.map_sheet import length_text, round_length
from odscen.drawing.palette import FONT
from odscen.drawing.svg_layers import LayerOptions, map_layers
from odscen.figures.by_place.level_of_service import FEWEST
from odscen.figures.by_place.traffic import over_run
from odscen.records.outcomes import IncidentKind, reason_label
from odscen.records.run_events import EventKind
from odscen.records.traces import speed_by_place, thinned_paths
from odscen.reports.report_words import stretch

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import polars as pl

    from odscen.base.arrays import Bounds, FloatArray, IntArray
    from odscen.drawing.map_drawing import MapDrawing
    from odscen.figures.by_place.traffic import TrafficFigures
    from odscen.figures.measures.gridlock import Incident
    from odscen.figures.measures.summary import ActorOutcome
    from odscen.lanegraph.graphs import MapGraph
    from odscen.records.run_events import Event
    from odscen.records.run_plan import Plan, PlannedMeasure, PlannedParking
    from odscen.records.traces import Paths
    from odscen.reports.place_names import PlaceNames


MOSTLY_SPREAD = 0.05
"""Share of the time on a segment from which its figures are said to be those of whole lanes."""
WHOLE_LANE = "figures of the whole lane, which reaches further"

_CENTRE_TOLERANCE = 0.5
"""Metres by which a drawn lane may leave its centre."""


@dataclass(frozen=True, slots=True, eq=False)
class PlaceShapes:
    """Segments and junctions as lines and points, OpenDRIVE frame, metres.

    Attributes
    ----------
    segments
        The centres of the lanes of each road segment.
    junctions
        Middle of each junction.
    """

    segments: Mapping[str, Lines]
    junctions: Mapping[str, FloatArray]

    @property
    def points(self) -> FloatArray:
        """Every point of the shapes, shape ``(N, 2)``."""
        lines = [lines.xy for lines in self.segments.values()]
        middles = [middle[np.newaxis] for middle in self.junctions.values()]
        return np.concatenate([np.empty((0, 2)), *lines, *middles])


def place_shapes(graph: MapGraph) -> PlaceShapes:
    """Shapes of all places of a map on which vehicles drive."""
    import shapely

    lanes, segments = graph.lanes, graph.segments
    xy = np.column_stack([lanes.x, lanes.y])
    junction = np.array([kind == "junction" for kind in segments.kinds])
    # Nodes are in the order of their lanes: a piece ends where lane or segment changes.
    begins = np.flatnonzero(
        np.concatenate(
            ([True], (np.diff(lanes.lane) != 0) | (np.diff(lanes.segment) != 0))[: len(xy)]
        )
    )
    ends = np.append(begins[1:], len(xy))
    pieces: dict[str, list[FloatArray]] = {}
    for begin, end in zip(begins.tolist(), ends.tolist(), strict=True):
        row = int(lanes.segment[begin])
        if junction[row]:
            continue
        # The next node of the lane, in the segment behind, closes the gap between two pieces.
        same_lane = end < len(xy) and lanes.lane[end] == lanes.lane[begin]
        piece = xy[begin : end + same_lane]
        if len(piece) > 1:
            line = shapely.simplify(shapely.LineString(piece), _CENTRE_TOLERANCE)
            pieces.setdefault(segments.ids[row], []).append(shapely.get_coordinates(line))
    middles = {
        str(name): xy[lanes.segment == row].mean(axis=0)
        for row, name in enumerate(segments.ids)
        if junction[row] and (lanes.segment == row).any()
    }
    return PlaceShapes({name: _join_lines(parts) for name, parts in pieces.items()}, middles)


def _join_lines(parts: list[FloatArray]) -> Lines:
    start = np.cumsum([0, *(len(part) for part in parts)])
    return Lines(np.concatenate(parts), start)


CATEGORIES = {
    "car": "Cars",
    "van": "Vans",
    "truck": "Trucks",
    "bus": "Buses",
    "motorcycle": "Motorcycles",
    "bicycle": "Bicycles",
    "pedestrian": "Pedestrians",
    "other": "Others",
}
"""Categories in the order of every legend, with the name of many."""

SPEED_STEPS_KMH = (5.0, 15.0, 30.0, 50.0, 80.0)
"""Limits between the colours of the speed map, km/h."""

_MARKED_EVENTS = (EventKind.TELEPORT_START, EventKind.COLLISION)

_DRAW_LIMIT = 4000
_POINT_LIMIT = 150_000
"""Trajectories drawn at most, and their points; of more, every n-th is drawn, as the page says."""


class RunMap(NamedTuple):
    """Map of a run: its drawing, and pairs of class and words for its two legends.

    Of ``one_in`` trajectories one is drawn.
    """

    drawing: Markup
    categories: list[tuple[str, str]]
    speeds: list[tuple[str, str]]
    trajectories: int
    one_in: int


def run_map(
    traces: pl.DataFrame,
    plan: Plan,
    actors: Sequence[ActorOutcome],
    events: Sequence[Event],
    drawing: MapDrawing | None,
    *,
    incidents: Sequence[Incident] = (),
) -> RunMap | None:
    """Draw the run; ``None`` if nothing has a place.

    Parameters
    ----------
    traces
        As :func:`~odscen.records.traces.tidy` gives them.
    plan
        Gives the places where actors were to start.
    actors, events
        What became of them and what happened.
    drawing
        The map to draw below the trajectories, if there is one.
    incidents
        In the order of the report's table.
    """
    paths = thinned_paths(traces)
    spawns = np.array([(actor.x, actor.y) for actor in plan.actors]).reshape(-1, 2)
    bounds = fitted_view(np.concatenate([paths.xy, spawns]), drawing)
    if bounds is None:
        return None
    extent = max(bounds[2] - bounds[0], bounds[3] - bounds[1])
    # Marks shrink where there are many, so that they do not hide the trajectories.
    dot = min(max(extent / 260.0, 0.5), 4.0) * min(1.0, (300.0 / max(len(paths.ids), 1)) ** 0.4)
    ground = None
    if drawing is not None:
        options = LayerOptions(symbol_size=dot * 2.2, prefix="map-")
        # A wide window shows land beside the drawing's box: the roads continue there.
        beside = 0.35 * (bounds[2] - bounds[0])
        wider = (bounds[0] - beside, bounds[1], bounds[2] + beside, bounds[3])
        ground = element("g", map_layers(drawing.clipped(wider), options), class_="map")
    vehicles = traces.select("x", "y", "speed").filter(traces["category"] != "pedestrian")
    cells = speed_by_place(vehicles)
    steps = np.searchsorted(SPEED_STEPS_KMH, cells.speed * 3.6, side="right")
    shading = shaded_cells(
        cells.corner, cells.size, steps, [f"v{i}" for i in range(len(SPEED_STEPS_KMH) + 1)]
    )
    one_in = max(-(-len(paths.ids) // _DRAW_LIMIT), -(-len(paths.xy) // _POINT_LIMIT), 1)
    svg = element(
        "svg",
        element("title", "Map of the run: the trajectories of all actors"),
        ground,
        element("g", *shading, class_="for-speeds"),
        _path_layer(paths, actors, dot, one_in),
        _mark_layer(paths, spawns, events, dot),
        parking_layer(plan.parking, extent / 400.0),
        measure_layer(plan.measures, extent / 400.0),
        incident_rings(incidents, extent / 400.0),
        scale_bar(bounds),
        viewBox=view_box(bounds),
        class_="run-map",
        role="img",
    )
    categories = [
        (f"c-{key}", CATEGORIES[key]) for key in CATEGORIES if key in set(paths.categories)
    ]
    categories += [
        ("spawn", "departure"),
        ("goal", "arrival"),
        ("incident", "teleport or collision"),
    ]
    limits = ["0", *(number(step, 0) for step in SPEED_STEPS_KMH)]
    names = [f"{a} to {b} km/h" for a, b in itertools.pairwise(limits)]
    names.append(f"over {limits[-1]} km/h")
    speeds = [(f"v{i}", name) for i, name in enumerate(names)]
    return RunMap(svg, categories, speeds, len(paths.ids), one_in)


_SPEED_COLORS = ("#a50026", "#e4572e", "#f5a742", "#f3dc6b", "#74add1", "#3b5fb0")
"""As in the style sheet of reports, for pictures that stand alone."""


def speed_picture(traces: pl.DataFrame, drawing: MapDrawing | None, *, name: str) -> str | None:
    """Draw the mean speed by place as an SVG document of its own; ``None`` if nobody drove.

    Parameters
    ----------
    traces
        With ``x``, ``y`` (m, OpenDRIVE frame), ``speed`` (m/s) and ``category``.
    drawing
        The map to draw below, if there is one.
    name
        Of the run.
    """
    vehicles = traces.select("x", "y", "speed").filter(traces["category"] != "pedestrian")
    cells = speed_by_place(vehicles)
    bounds = fitted_view(cells.corner, drawing)
    if bounds is None:
        return None
    steps = np.searchsorted(SPEED_STEPS_KMH, cells.speed * 3.6, side="right")
    styles = [f"v{index}" for index in range(len(_SPEED_COLORS))]
    ground = None
    if drawing is not None:
        options = LayerOptions(symbol_size=4.0, prefix="map-")
        ground = element("g", map_layers(drawing.clipped(bounds), options))
    wide = (bounds[2] - bounds[0]) * 100
    limits = [*(number(step, 0) for step in SPEED_STEPS_KMH), "more"]
    legend = []
    for index, (color, limit) in enumerate(zip(_SPEED_COLORS, limits, strict=True)):
        x = round(bounds[0] * 100 + wide * (0.32 + 0.1 * index))
        y, side = round(-bounds[1] * 100 - wide * 0.033), round(wide * 0.015)
        legend.append(element("rect", x=x, y=y, width=side, height=side, fill=color))
        words = f"to {limit} km/h" if limit != "more" else limit
        at = {"x": x + round(side * 1.3), "y": y + side, "font_size": round(wide * 0.014)}
        legend.append(element("text", words, **at))
    rules = "".join(
        f".{style}{{fill:{color}}}" for style, color in zip(styles, _SPEED_COLORS, strict=True)
    )
    svg = element(
        "svg",
        element("title", f"Mean speed by place, {name}"),
        element("style", f"{rules}.scale path{{fill:none;stroke:#22282e}}"),
        ground,
        *shaded_cells(cells.corner, cells.size, steps, styles),
        *legend,
        scale_bar(bounds),
        xmlns="http://www.w3.org/2000/svg",
        viewBox=view_box(bounds),
        width=900,
        height=round(900 * (bounds[3] - bounds[1]) / (bounds[2] - bounds[0])),
        font_family=FONT,
    )
    return f"{svg}\n"


def fitted_view(everything: FloatArray, drawing: MapDrawing | None) -> Bounds | None:
    """Bounds of the traffic with a margin, of a shape fit for a page; the map's if it is idle."""
    if len(everything) == 0:
        return None if drawing is None else drawing.bounds
    low, high = everything.min(axis=0), everything.max(axis=0)
    middle, half = (low + high) / 2.0, (high - low) / 2.0
    half = half + max(12.0, 0.05 * float(half.max()))
    half[0] = max(half[0], half[1] * 1.2)
    half[1] = max(half[1], half[0] * 0.3)
    return (*(middle - half).tolist(), *(middle + half).tolist())


def view_box(bounds: Bounds) -> str:
    """Of a drawing in centimetres, y downwards."""
    size = (bounds[2] - bounds[0], bounds[3] - bounds[1])
    return " ".join(str(round(value * 100)) for value in (bounds[0], -bounds[3], *size))


def shaded_cells(
    corner: FloatArray, size: float, steps: IntArray, styles: Sequence[str]
) -> list[Markup]:
    """Squares of a map, one path for each class.

    Parameters
    ----------
    corner
        Shape ``(N, 2)``: lower left corners, metres.
    size
        Side of a square, metres.
    steps
        Shape ``(N,)``: which of ``styles`` each has.
    """
    side = round(size * 100)
    whole = np.rint(corner * 100.0).astype(np.int64)
    parts = []
    for index, style in enumerate(styles):
        chosen = whole[steps == index].tolist()
        data = "".join(f"M{x} {-y}h{side}v{-side}h{-side}z" for x, y in chosen)
        if data:
            parts.append(element("path", d=data, class_=f"cell {style}"))
    return parts


def _path_layer(paths: Paths, actors: Sequence[ActorOutcome], dot: float, one_in: int) -> Markup:
    status = {actor.id: actor.status for actor in actors}
    groups: dict[str, list[Markup]] = {}
    for k in range(0, len(paths.ids), one_in):
        xy = paths.xy[paths.start[k] : paths.start[k + 1]] * (1.0, -1.0)
        data = path_data(xy, np.array([0, len(xy)]), unit=0.1)
        name = paths.ids[k]
        title = element("title", f"{name} ({paths.categories[k]}) {status.get(name, '')}".strip())
        groups.setdefault(paths.categories[k], []).append(element("path", title, d=data))
    width = round(dot * 4.0)
    drawn = [
        element("g", *groups[key], class_=f"trajectory c-{key}", stroke_width=width)
        for key in CATEGORIES
        if key in groups
    ]
    return element("g", *drawn, class_="for-trajectories", transform="scale(10)")


def _mark_layer(paths: Paths, spawns: FloatArray, events: Sequence[Event], dot: float) -> Markup:
    ends = paths.xy[paths.start[1:][np.array(paths.last, dtype=np.bool_)] - 1]
    incidents = np.array(
        [
            (event.x, event.y)
            for event in events
            if event.kind in _MARKED_EVENTS and event.x is not None and event.y is not None
        ]
    ).reshape(-1, 2)
    width = round(dot * 100)
    parts = [
        element("path", d=_dot_data(ends), class_="goal-ring", stroke_width=round(width * 1.3)),
        element("path", d=_dot_data(ends), class_="goal", stroke_width=round(width * 0.8)),
        element("path", d=_dot_data(spawns), class_="spawn", stroke_width=width),
    ]
    r = round(dot * 120)
    crosses = "".join(
        f"M{x - r} {y - r}l{2 * r} {2 * r}M{x - r} {y + r}l{2 * r} {-2 * r}"
        for x, y in np.rint(incidents * (100.0, -100.0)).astype(np.int64).tolist()
    )
    shown = element("path", d=crosses, class_="incident", stroke_width=round(dot * 60))
    return element("g", element("g", *parts, class_="for-trajectories"), shown if crosses else None)


def _dot_data(places: FloatArray) -> str:
    """Path data of dots; where many are in one place, which a day of traffic brings, of one."""
    whole = np.unique(np.rint(places * (10.0, -10.0)).astype(np.int64), axis=0) * 10
    return "".join(f"M{x} {y}h0" for x, y in whole.tolist())


def scale_bar(bounds: Bounds) -> Markup:
    """Bar with its length, in the lower left corner of a map."""
    wide = bounds[2] - bounds[0]
    length = round_length(wide / 5.0)
    x, y = bounds[0] + wide * 0.02, -bounds[1] - wide * 0.02
    tick = wide * 0.008
    bar = path_data(
        np.array([[x, y - tick], [x, y], [x + length, y], [x + length, y - tick]]), np.array([0, 4])
    )
    label = element(
        "text",
        length_text(length),
        x=round((x + length / 2) * 100),
        y=round((y - tick * 1.4) * 100),
        font_size=round(wide * 1.7),
        text_anchor="middle",
    )
    line = element("path", d=bar, stroke_width=round(wide * 0.25))
    return element("g", line, label, class_="scale")


LEVELS = {
    "A": "A: free flow",
    "B": "B: reasonably free",
    "C": "C: stable",
    "D": "D: nearly unstable",
    "E": "E: at capacity",
    "F": "F: congested",
}
"""Levels of service with the words of the legends."""


class ServiceMap(NamedTuple):
    """Map of the levels of service: its drawing, what its views show, and its legend."""

    drawing: Markup
    views: dict[str, str]
    legend: list[tuple[str, str]]


def service_map(
    figures: TrafficFigures,
    shapes: PlaceShapes,
    worst: Sequence[Mapping[str, Any]],
    names: PlaceNames,
) -> ServiceMap | None:
    """Levels over the run and in its busiest interval; ``None`` if no vehicle drove.

    Parameters
    ----------
    worst
        Rows of the junctions that are numbered on the map, in the order of the table.
    names
        Of the places.
    """
    bounds = fitted_view(shapes.points, None)
    if bounds is None:
        return None
    extent = max(bounds[2] - bounds[0], bounds[3] - bounds[1])
    views = {"run": ("The whole run", over_run(figures.segments), over_run(figures.junctions))}
    if figures.network.height > 1:
        # The interval with most vehicles on the road.
        busiest = figures.network.sort(["running", "begin"], descending=[True, False])
        begin, end = busiest.select("begin", "end").row(0)
        words = f"The busiest time, {stretch(begin, end)}"
        tables = (figures.segments, figures.junctions)
        segments, junctions = (table.filter(table["begin"] == begin) for table in tables)
        views["peak"] = (words, segments, junctions)
    roads = [
        element("path", id=f"place-{index}", d=path_data(lines.xy * (1, -1), lines.start))
        for index, lines in enumerate(shapes.segments.values())
    ]
    layers = [
        element(
            "g", _service_layer(shapes, segments, junctions, extent, names), class_=f"for-{key}"
        )
        for key, (_, segments, junctions) in views.items()
    ]
    svg = element(
        "svg",
        element("title", "Map of the roads and junctions, coloured by level of service"),
        element("defs", *roads),
        *layers,
        _junction_numbers(shapes, worst, extent),
        scale_bar(bounds),
        viewBox=view_box(bounds),
        class_="run-map",
        role="img",
    )
    entries = [(f"los-{level.lower()}", words) for level, words in LEVELS.items()]
    entries.append(("los-none", f"no traffic, or fewer than {FEWEST} vehicles"))
    return ServiceMap(svg, {key: view[0] for key, view in views.items()}, entries)


def _service_layer(
    shapes: PlaceShapes,
    segments: pl.DataFrame,
    junctions: pl.DataFrame,
    extent: float,
    names: PlaceNames,
) -> Markup:
    rows = {row["segment"]: row for row in segments.iter_rows(named=True)}
    parts = []
    for index, name in enumerate(shapes.segments):
        row = rows.get(name)
        level = None if row is None else row["level"]
        words = f"{names.name_segment(name)}: no traffic"
        if row is not None and row["speed"] is not None:
            graded = f"level {level}" if level else f"n/a ({row['vehicles']:,} vehicles)"
            words = f"{names.name_segment(name)}: {graded}, {number(row['speed'] * 3.6, 0)} km/h"
            if (row["spread"] or 0.0) > MOSTLY_SPREAD:
                words += f" ({WHOLE_LANE})"
        parts.append(
            element(
                "use", element("title", words), href=f"#place-{index}", class_=_level_style(level)
            )
        )
    width = round(100 * max(3.0, extent / 350.0))
    roads = element("g", *parts, class_="los-roads", stroke_width=width)
    busy = {row["junction"]: row for row in junctions.iter_rows(named=True) if row["level"]}
    radius = round(100 * min(extent / 90.0, 12.0))
    discs = []
    for name, (x, y) in shapes.junctions.items():
        row = busy.get(name)
        if row is None:
            continue
        lost = "no vehicle enters it"
        delay = row["delay"] if row["control_delay"] is None else row["control_delay"]
        if delay is not None:
            lost = f"{number(delay, 0)} s control delay per vehicle"
        words = f"{names.name_junction(name)}: level {row['level']}, {lost}"
        cx, cy = round(x * 100), round(-y * 100)
        disc = element("circle", cx=cx, cy=cy, r=radius, class_=_level_style(row["level"]))
        letter = element("text", row["level"], x=cx, y=cy, font_size=round(radius * 1.4),
                         class_=f"on-{row['level'].lower()}")  # fmt: skip
        discs.append(element("g", element("title", words), disc, letter))
    return join([roads, element("g", *discs, class_="los-discs", stroke_width=round(width / 5))])


def _level_style(level: str | None) -> str:
    return f"los-{level.lower()}" if level else "los-none"


def _junction_numbers(
    shapes: PlaceShapes, worst: Sequence[Mapping[str, Any]], extent: float
) -> Markup:
    """Numbers of the junctions in the table, where there is room."""
    size = extent * 2.4
    written: list[tuple[float, float]] = []
    parts = []
    for place, row in enumerate(worst, start=1):
        middle = shapes.junctions.get(str(row["junction"]))
        if middle is None:
            continue
        x, y = (middle * (100.0, -100.0)).tolist()
        y -= size * 0.9
        if any(abs(x - a) < size * 4 and abs(y - b) < size * 1.2 for a, b in written):
            continue
        written.append((x, y))
        parts.append(element("text", str(place), x=round(x), y=round(y), font_size=round(size)))
    return element("g", *parts, class_="place-names")


MOST_INCIDENTS = 15
"""Rows and rings of each kind at most, the worst first."""


def incident_rings(incidents: Sequence[Incident], dot: float) -> Markup | None:
    """Rings with the numbers of the table, in the map's centimetres."""
    radius = round(dot * 220)
    parts = []
    labelled: list[tuple[int, int]] = []
    for index, incident in enumerate(worst_incidents(incidents), start=1):
        if incident.x is None or incident.y is None:
            continue
        x, y = round(incident.x * 100), round(-incident.y * 100)
        title = element("title", f"{index}: {incident.kind.label}, {reason_label(incident.reason)}")
        ring = element("circle", cx=x, cy=y, r=radius, stroke_width=round(dot * 45))
        label = None
        if all(max(abs(x - a) / 3, abs(y - b)) > 2 * radius for a, b in labelled):
            labelled.append((x, y))
            label = element(
                "text", str(index), x=x + round(radius * 1.2), y=y, font_size=round(dot * 420)
            )
        parts.append(element("g", title, ring, label))
    return element("g", *parts, class_="incidents") if parts else None


def worst_incidents(incidents: Sequence[Incident]) -> list[Incident]:
    """Return the worst of each kind, in the order given."""
    left = dict.fromkeys(IncidentKind, MOST_INCIDENTS)
    shown = []
    for incident in incidents:
        left[incident.kind] -= 1
        if left[incident.kind] >= 0:
            shown.append(incident)
    return shown


def measure_layer(measures: Sequence[PlannedMeasure], dot: float) -> Markup | None:
    """Places of the measures with their numbers, in the map's centimetres."""
    parts = [
        _draw_measure(number, measure, dot)
        for number, measure in enumerate(measures, start=1)
        if measure.lines
    ]
    return element("g", *parts, class_="measures") if parts else None


def _draw_measure(number: int, measure: PlannedMeasure, dot: float) -> Markup:
    title = element("title", f"{number}: {measure.id}, {measure.words}")
    lines = [np.array(line).reshape(-1, 2) * (1.0, -1.0) for line in measure.lines]
    starts = np.cumsum([0, *(len(line) for line in lines)])
    points = [(line[0] * 100).round().astype(int).tolist() for line in lines if len(line) == 1]
    data = path_data(np.concatenate(lines), starts) + "".join(f"M{x} {y}h0" for x, y in points)
    longest = max(lines, key=len)
    x, y = (longest[len(longest) // 2] * 100).round().astype(int).tolist()
    shown = element("path", d=data, stroke_width=round(dot * 160))
    label = element("text", str(number), x=x, y=y, font_size=round(dot * 420))
    return element("g", title, shown, label)


def parking_layer(areas: Sequence[PlannedParking], dot: float) -> Markup | None:
    """Ids of the areas at their places, in the map's centimetres."""
    if not areas:
        return None
    size = round(dot * 380)
    parts = []
    for area in areas:
        title = element("title", f"parking {area.id}, {area.places} places, segment {area.segment}")
        x, y = round(area.x * 100), round(-area.y * 100)
        text = element(
            "text", area.id, x=x, y=y + size // 3, font_size=size, text_anchor="middle",
            fill="#1c4fa0", stroke="#fff", stroke_width=size // 6, paint_order="stroke",
        )  # fmt: skip
        parts.append(element("g", title, text))
    return element("g", *parts, class_="parking-areas")
