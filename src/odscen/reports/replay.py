"""A run to be watched inside its report: places of all road users over time, and the map below."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.base.markup import Markup, element
from odscen.drawing.svg_layers import LayerOptions, map_layers
from odscen.lanegraph.node_heights import node_heights
from odscen.reports.report_maps import fitted_view, view_box

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import polars as pl

    from odscen.base.arrays import Bounds
    from odscen.convert.lane_table.table import SumoLight
    from odscen.drawing.map_drawing import MapDrawing
    from odscen.lanegraph.graphs import LaneGraph, MapGraph, PedestrianGraph
    from odscen.records.run_plan import PlannedActor


@dataclass(frozen=True, slots=True, eq=False)
class Scenery:
    """What a replay in three dimensions needs beside the drawing of the map.

    Attributes
    ----------
    script
        Draws it; part of the built page.
    graph
        Of the map, with heights.
    weather
        Its parameters, by the names that CARLA has for them.
    """

    script: str
    graph: MapGraph
    weather: Mapping[str, float]


MOST_PLACES = 250_000
"""Places of road users at most; of more, every n-th instant is kept, as the page says."""

_CENTIMETRES = 100.0
_STEPS_OF_HEADING = 100.0
"""In one radian."""
_MOST_OF_MAP = 0.4
"""From this share of its area on the whole map is shown."""


def replay_values(
    users: Sequence[PlannedActor],
    rows: pl.DataFrame,
    drawing: MapDrawing | None,
    *,
    step: float,
    clock: float = 0.0,
    lights: Sequence[SumoLight] = (),
    states: pl.DataFrame | None = None,
    scenery: Scenery | None = None,
) -> dict[str, Any] | None:
    """Values of the block ``replay`` of a report; ``None`` if nobody moved.

    Parameters
    ----------
    users
        With category and size; others are left out.
    rows
        Centres of bodies, as :meth:`odscen.runs.finished_run.Run.trajectories` gives them.
    drawing
        Of the map, if there is one.
    step
        Between two records, s.
    clock
        Time of day at the start, s.
    lights
        Of the map.
    states
        What they showed, as :func:`odscen.runs.recorded.read_light_states` gives it.
    scenery
        With it, and a drawing, the run can be seen in three dimensions, too.
    """
    import polars as pl

    if rows.is_empty():
        return None
    known = {user.id: user for user in users}
    first = float(rows["time"].min())  # type: ignore[arg-type]  # a column of floats
    every = max(-(-rows.height // MOST_PLACES), 1)
    instant = ((pl.col("time") - first) / step).round().cast(pl.Int64)
    kept = (
        rows.with_columns(instant=instant)
        .filter(pl.col("instant") % every == 0)
        .with_columns(frame=pl.col("instant") // every)
        .unique(["id", "frame"], keep="first", maintain_order=True)
        .sort("id", "frame")
    )
    pieces = [
        piece
        for [name], own in kept.group_by("id", maintain_order=True)
        if (user := known.get(str(name))) is not None
        for piece in _split_pieces(user, own)
    ]
    if not pieces:
        return None
    bounds = _choose_view(kept, drawing)
    ground = below = None
    if drawing is not None:
        beside = 0.35 * (bounds[2] - bounds[0])
        wider = (bounds[0] - beside, bounds[1] - beside, bounds[2] + beside, bounds[3] + beside)
        options = LayerOptions(symbol_size=1.2, prefix="replay-")
        ground = element("g", map_layers(drawing.clipped(wider), options), class_="map")
        if scenery is not None:
            below = _write_json(ground_values(drawing, scenery.graph, scenery.weather, wider))
    svg = element(
        "svg", ground, viewBox=view_box(bounds), id="replay-map", aria_hidden="true",
        preserveAspectRatio="xMidYMid meet",
    )  # fmt: skip
    frames = int(kept["frame"].max()) + 1  # type: ignore[arg-type]  # a column of integers
    data = {
        "begin": round(first, 3), "step": round(step * every, 6), "frames": frames,
        "clock": clock, "pieces": pieces, "lights": _list_lights(lights, states),
    }  # fmt: skip
    return {
        "drawing": svg,
        "data": _write_json(data),
        "ground": below,
        "scripts": [Markup(scenery.script)] if scenery is not None and below else [],
        "users": len({piece["id"] for piece in pieces}),
        "every": step * every,
        "thinned": every > 1,
        "lights": bool(data["lights"]),
    }


def _write_json(values: Mapping[str, Any]) -> Markup:
    """JSON that can stand in a script of a page."""
    text = json.dumps(values, separators=(",", ":"), sort_keys=True)
    return Markup(text.replace("<", "\\u003c"))


def _choose_view(rows: pl.DataFrame, drawing: MapDrawing | None) -> Bounds:
    """Where somebody was; the whole map if that is most of it."""
    fitted = fitted_view(rows.select("x", "y").to_numpy(), drawing)
    assert fitted is not None  # there are places
    if drawing is None or _measure_area(fitted) < _MOST_OF_MAP * _measure_area(drawing.bounds):
        return fitted
    return drawing.bounds


def _measure_area(bounds: Bounds) -> float:
    return (bounds[2] - bounds[0]) * (bounds[3] - bounds[1])


def _list_lights(lights: Sequence[SumoLight], states: pl.DataFrame | None) -> list[dict[str, Any]]:
    """Heads of each light that was recorded, and when it showed which state."""
    if states is None:
        return []
    heads = {light.id: _signal_heads(light) for light in lights}
    return [
        {
            "heads": heads[light],
            "times": own["time"].round(3).to_list(),
            "states": own["state"].to_list(),
        }
        for (name,), own in states.group_by("light", maintain_order=True)
        if heads.get(light := str(name))
    ]


def _signal_heads(light: SumoLight) -> list[list[Any]]:
    """Place (cm), direction and letters of the state of each stop line of vehicles."""
    places: dict[tuple[int, int], list[Any]] = {}
    for letter, link in enumerate(light.links):
        if link.crossed or len(link.path) < 2:
            continue
        (x, y), (ahead, beside) = link.path[0], link.path[1]
        place = (round(x * _CENTIMETRES), round(y * _CENTIMETRES))
        heading = round(math.atan2(beside - y, ahead - x), 2)
        places.setdefault(place, [*place, heading, []])[3].append(letter)
    return list(places.values())


def _split_pieces(user: PlannedActor, own: pl.DataFrame) -> list[dict[str, Any]]:
    """Stretches without a gap: first value and differences of x, y (cm) and heading."""
    frame = own["frame"].to_numpy()
    heading = np.unwrap(own["hdg"].to_numpy())
    places = np.column_stack(
        [
            np.rint(own["x"].to_numpy() * _CENTIMETRES),
            np.rint(own["y"].to_numpy() * _CENTIMETRES),
            np.rint(heading * _STEPS_OF_HEADING),
        ]
    ).astype(np.int64)
    breaks = np.flatnonzero(np.diff(frame) > 1) + 1
    return [
        {
            "id": user.id, "category": user.category, "length": round(user.length, 2),
            "width": round(user.width, 2), "frame": int(numbers[0]),
            **({"ego": True} if user.ego else {}),
            "moves": np.diff(part, axis=0, prepend=0).ravel().tolist(),
        }
        for numbers, part in zip(np.split(frame, breaks), np.split(places, breaks), strict=True)
    ]  # fmt: skip


# ---------------------------------------------------------------------------------- what it lies on
def ground_values(
    drawing: MapDrawing, graph: MapGraph, weather: Mapping[str, float], bounds: Bounds
) -> dict[str, Any]:
    """Values of the script; of the map only what touches ``bounds``, m.

    Parameters
    ----------
    weather
        Parameters by the names that CARLA has for them.
    """
    lanes, walks = node_heights(graph)
    nodes = _node_columns(graph.lanes, lanes, bounds)
    beside = _node_columns(graph.walks, walks, bounds)
    return {
        "drawing": json.loads(drawing.clipped(bounds).to_json()),
        "heights": {"z": nodes.pop("z"), "walks": beside.pop("z")},
        "nodes": {**nodes, "walks": beside},
        "weather": dict(weather),
    }


def _node_columns(
    graph: LaneGraph | PedestrianGraph, z: np.ndarray, bounds: Bounds
) -> dict[str, list[float]]:
    """Places of nodes that have heights, to the centimetre and 1e-3 rad."""
    low_x, low_y, high_x, high_y = bounds
    x, y = graph.x, graph.y
    inside = (low_x <= x) & (x <= high_x) & (low_y <= y) & (y <= high_y)
    rows = np.flatnonzero(inside) if len(z) else np.empty(0, dtype=np.int64)
    columns = {"x": x, "y": y, "z": z} if len(z) else dict.fromkeys("xyz", np.empty(0))
    return {
        **{name: np.round(values[rows], 2).tolist() for name, values in columns.items()},
        "hdg": np.round(graph.hdg[rows], 3).tolist(),
    }
