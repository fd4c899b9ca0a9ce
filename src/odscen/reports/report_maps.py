"""The map of a run: trajectories by category, mean speed by place, spawns, goals and incidents."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from odscen.base.markup import Markup, element, number, path_data
from odscen.drawing.map_drawing import Lines
from odscen.drawing.map_sheet import length_text, round_length
from odscen.drawing.svg_layers import LayerOptions, map_layers
from odscen.records.run_events import EventKind
from odscen.records.traces import speed_by_place, thinned_paths
from odscen.reports.report_incidents import incident_rings
from odscen.reports.report_measures import measure_layer
from odscen.reports.report_parking import parking_layer

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import polars as pl

    from odscen.base.arrays import Bounds, FloatArray
    from odscen.drawing.map_drawing import MapDrawing
    from odscen.figures.measures.gridlock import Incident
    from odscen.figures.measures.summary import ActorOutcome
    from odscen.lanegraph.graphs import MapGraph
    from odscen.records.run_events import Event
    from odscen.records.run_plan import Plan
    from odscen.records.traces import Paths, SpeedCells


_TOLERANCE = 0.5
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
            line = shapely.simplify(shapely.LineString(piece), _TOLERANCE)
            pieces.setdefault(segments.ids[row], []).append(shapely.get_coordinates(line))
    middles = {
        str(name): xy[lanes.segment == row].mean(axis=0)
        for row, name in enumerate(segments.ids)
        if junction[row] and (lanes.segment == row).any()
    }
    return PlaceShapes({name: _lines(parts) for name, parts in pieces.items()}, middles)


def _lines(parts: list[FloatArray]) -> Lines:
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

_INCIDENTS = (EventKind.TELEPORT_START, EventKind.COLLISION)

_DRAW_LIMIT = 4000
_POINT_LIMIT = 150_000
"""Trajectories drawn at most, and their points; of more, every n-th is drawn, as the page says."""


def run_map(
    traces: pl.DataFrame,
    plan: Plan,
    actors: Sequence[ActorOutcome],
    events: Sequence[Event],
    drawing: MapDrawing | None,
    *,
    incidents: Sequence[Incident] = (),
) -> Markup | None:
    """Build the figure: controls, drawing, legend; ``None`` if nothing has a place.

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
    layers = []
    if drawing is not None:
        options = LayerOptions(symbol_size=dot * 2.2, prefix="map-")
        # A wide window shows land beside the drawing's box: the roads continue there.
        beside = 0.35 * (bounds[2] - bounds[0])
        wider = (bounds[0] - beside, bounds[1], bounds[2] + beside, bounds[3])
        layers.append(element("g", map_layers(drawing.clipped(wider), options), class_="map"))
    vehicles = traces.select("x", "y", "speed").filter(traces["category"] != "pedestrian")
    layers.append(_speed_layer(speed_by_place(vehicles)))
    layers.append(_path_layer(paths, actors, dot))
    layers.append(_mark_layer(paths, spawns, events, dot))
    layers += [areas] if (areas := parking_layer(plan.parking, extent / 400.0)) else []
    layers += [shown] if (shown := measure_layer(plan.measures, extent / 400.0)) else []
    layers += [rings] if (rings := incident_rings(incidents, extent / 400.0)) else []
    svg = element(
        "svg",
        element("title", "Map of the run: the trajectories of all actors"),
        *layers,
        scale_bar(bounds),
        viewBox=view_box(bounds),
        class_="run-map",
        role="img",
    )
    note = None
    if (nth := _one_in(paths)) > 1:
        words = f"There are {len(paths.ids):,} trajectories; one in {nth} is drawn."
        note = element("p", words, class_="for-trajectories")
    return element(
        "div", *_controls(), svg, *_legends(paths), note, class_="map-figure", id="map-figure"
    )


def _controls() -> list[Markup]:
    """Radio buttons before the drawing: the style sheet shows what is checked, without a script."""
    parts = []
    views = {
        "trajectories": "Trajectories by category",
        "speeds": "Mean speed of vehicles by place",
    }
    for key, label in views.items():
        checked = "checked" if key == "trajectories" else None
        name = f"show-{key}"
        parts.append(
            element("input", type="radio", name="map-view", id=name, class_=name, checked=checked)
        )
        parts.append(element("label", label, for_=name))
    return parts


def _legends(paths: Paths) -> list[Markup]:
    present = [key for key in CATEGORIES if key in set(paths.categories)]
    lines = [swatch(f"c-{key}", CATEGORIES[key]) for key in present]
    signs = [
        swatch("spawn", "departure"),
        swatch("goal", "arrival"),
        swatch("incident", "teleport or collision"),
    ]
    steps = ["0", *(number(step, 0) for step in SPEED_STEPS_KMH)]
    names = [f"{a} to {b} km/h" for a, b in itertools.pairwise(steps)]
    names.append(f"over {steps[-1]} km/h")
    speeds = [swatch(f"v{i}", name) for i, name in enumerate(names)]
    return [
        element("div", *lines, *signs, class_="legend for-trajectories"),
        element("div", *speeds, class_="legend for-speeds"),
    ]


def swatch(style: str, label: str) -> Markup:
    """Entry of a legend; ``style`` is the class that gives its colour."""
    return element("span", element("i", class_=f"swatch {style}"), label)


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


def _speed_layer(cells: SpeedCells) -> Markup:
    kmh = cells.speed * 3.6
    step = np.searchsorted(SPEED_STEPS_KMH, kmh, side="right")
    side = round(cells.size * 100)
    corner = np.rint(cells.corner * 100.0).astype(np.int64)
    parts = []
    for index in range(len(SPEED_STEPS_KMH) + 1):
        chosen = corner[step == index].tolist()
        data = "".join(f"M{x} {-y}h{side}v{-side}h{-side}z" for x, y in chosen)
        if data:
            parts.append(element("path", d=data, class_=f"cell v{index}"))
    return element("g", *parts, class_="for-speeds")


def _one_in(paths: Paths) -> int:
    """Of so many trajectories one is drawn."""
    return max(-(-len(paths.ids) // _DRAW_LIMIT), -(-len(paths.xy) // _POINT_LIMIT), 1)


def _path_layer(paths: Paths, actors: Sequence[ActorOutcome], dot: float) -> Markup:
    status = {actor.id: actor.status for actor in actors}
    every = _one_in(paths)
    groups: dict[str, list[Markup]] = {}
    for k in range(0, len(paths.ids), every):
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
            if event.kind in _INCIDENTS and event.x is not None and event.y is not None
        ]
    ).reshape(-1, 2)
    width = round(dot * 100)
    parts = [
        element("path", d=_dots(ends), class_="goal-ring", stroke_width=round(width * 1.3)),
        element("path", d=_dots(ends), class_="goal", stroke_width=round(width * 0.8)),
        element("path", d=_dots(spawns), class_="spawn", stroke_width=width),
    ]
    r = round(dot * 120)
    crosses = "".join(
        f"M{x - r} {y - r}l{2 * r} {2 * r}M{x - r} {y + r}l{2 * r} {-2 * r}"
        for x, y in np.rint(incidents * (100.0, -100.0)).astype(np.int64).tolist()
    )
    shown = element("path", d=crosses, class_="incident", stroke_width=round(dot * 60))
    return element("g", element("g", *parts, class_="for-trajectories"), shown if crosses else None)


def _dots(places: FloatArray) -> str:
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
