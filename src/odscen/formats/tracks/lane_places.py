"""Recorded states on the lanes of a map: where, how far from the middle, and how well it fits."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Final, TypeVar

import numpy as np
import polars as pl

from odscen.base.categories import Category
from odscen.base.errors import InputError
from odscen.lanegraph.graphs import Relation

if TYPE_CHECKING:
    from odscen.base.arrays import BoolArray, FloatArray, IntArray
    from odscen.lanegraph.graphs import MapGraph

_NEAREST: Final = 32
"""Stretches of lanes around a place that are looked at; lanes lie on each other in junctions."""
_TURN_COST: Final = 4.0
"""Metres that a lane across counts as farther away; one that leads the other way twice that."""
_OUTSIDE_COST: Final = 10.0
"""As often a metre outside a lane counts as one beside its middle."""
_WRONG: Final = 0.75 * np.pi
"""Turn from the lane from which on a vehicle drives against it."""
_MOVING: Final = 1.0
"""m/s from which on a heading is that of driving."""
_ROUNDS, _SETTLED = 20, 1e-3
_AT_ONCE: Final = 50_000
"""Places that are looked at together: each needs some kilobytes for the stretches around it."""
_FEWEST: Final = 20
_SAMPLE: Final = 1000
_EDGE: Final = 5.0
"""Metres from the middles of the outermost lanes to where places are on none."""


@dataclass(frozen=True, slots=True, eq=False)
class LanePlaces:
    """Nearest lanes of places, each of shape ``(N,)``.

    Attributes
    ----------
    node
        The node of the lane graph at or before the place; of the pedestrian graph for walkers.
    lane
        Row of the lane.
    lateral
        Metres left of the lane's middle.
    width
        Of the lane there, metres.
    turn
        From the lane's direction to the heading, rad, in (-pi, pi].
    normal_x, normal_y
        To the left of the lane.
    """

    node: IntArray
    lane: IntArray
    lateral: FloatArray
    width: FloatArray
    turn: FloatArray
    normal_x: FloatArray
    normal_y: FloatArray

    @property
    def is_on_lane(self) -> BoolArray:
        """Whether the middle of the body lies on the lane."""
        return np.abs(self.lateral) <= self.width / 2.0

    @property
    def is_wrong_way(self) -> BoolArray:
        """Whether it lies on the lane and looks against it."""
        return self.is_on_lane & (np.abs(self.turn) > _WRONG)


class LaneFinder:
    """Finds lanes of a map around places; made once per map.

    Parameters
    ----------
    walks
        Whether walks are looked for, and not lanes of vehicles.
    """

    def __init__(self, graph: MapGraph, *, walks: bool = False) -> None:
        from scipy.spatial import cKDTree

        nodes = graph.walks if walks else graph.lanes
        along = np.ones(len(nodes.source), dtype=np.bool_)
        if not walks:
            along = graph.lanes.relation == Relation.SUCCESSOR
        source, target = nodes.source[along], nodes.target[along]
        a = np.column_stack([nodes.x[source], nodes.y[source]])
        b = np.column_stack([nodes.x[target], nodes.y[target]])
        length = np.hypot(*(b - a).T)
        kept = length > 1e-6
        self._source, self._a, self._length = source[kept], a[kept], length[kept]
        self._along = (b - a)[kept] / length[kept, None]
        self._walks = walks
        self._lane, self._width = nodes.lane, nodes.width
        if not kept.any():
            raise InputError(f"map {graph.map_name!r} has no {'walk' if walks else 'lane'}")
        self._tree = cKDTree((a[kept] + b[kept]) / 2.0)

    def locate(self, x: FloatArray, y: FloatArray, hdg: FloatArray) -> LanePlaces:
        """Lanes on which bodies are, or the nearest; of several on each other that of the heading.

        Parameters
        ----------
        x, y, hdg
            Shapes ``(N,)``, in the frame of the map.
        """
        parts = [
            self._locate_some(*(values[k : k + _AT_ONCE] for values in (x, y, hdg)))
            for k in range(0, max(len(x), 1), _AT_ONCE)
        ]
        names = [place_field.name for place_field in fields(LanePlaces)]
        return LanePlaces(
            *(np.concatenate([getattr(part, name) for part in parts]) for name in names)
        )

    def _locate_some(self, x: FloatArray, y: FloatArray, hdg: FloatArray) -> LanePlaces:
        places = np.column_stack([x, y])
        count = min(_NEAREST, len(self._length))
        rows = self._tree.query(places, k=count)[1].reshape(len(places), count)
        away = places[:, None, :] - self._a[rows]
        way = self._along[rows]
        at = np.sum(away * way, axis=2)
        past = at - np.clip(at, 0.0, self._length[rows])
        lateral = way[..., 0] * away[..., 1] - way[..., 1] * away[..., 0]
        lane_hdg = np.arctan2(way[..., 1], way[..., 0])
        turn = np.remainder(hdg[:, None] - lane_hdg + np.pi, 2.0 * np.pi) - np.pi
        beside = np.hypot(lateral, past)
        # Who lies on a lane is on it, even against its direction, before one that it lies beside.
        outside = np.maximum(beside - self._width[self._source[rows]] / 2.0, 0.0)
        cost = beside + _OUTSIDE_COST * outside
        if not self._walks:  # people walk along walks either way
            cost = cost + _TURN_COST * (1.0 - np.cos(turn))
        best = (np.arange(len(places)), np.argmin(cost, axis=1))
        node = self._source[rows[best]]
        past_end = np.abs(past[best]) > 1e-9
        left = np.where(past_end, np.copysign(beside[best], lateral[best]), lateral[best])
        return LanePlaces(
            node,
            self._lane[node],
            left,
            self._width[node],
            turn[best],
            -way[best][:, 1],
            way[best][:, 0],
        )


class LaneFit:
    """Locates tracks on a map, part by part, and says how well the two agree."""

    def __init__(self, graph: MapGraph) -> None:
        self._graph = graph
        self._finders: dict[str, tuple[LaneFinder, pl.Series] | None] = {}
        self._found: dict[str, list[pl.DataFrame]] = {}

    def place(self, rows: pl.DataFrame) -> pl.DataFrame:
        """Rows in the frame of the map with the lanes that they are on.

        Returns
        -------
        polars.DataFrame
            With ``lane`` (``road.section.lane``; of pedestrians a walk), ``lateral`` (m, left of
            its middle), ``on_lane`` and ``wrong_way``; rows of no category are left out.
        """
        walkers = pl.col("category") == str(Category.PEDESTRIAN)
        known = rows.filter(pl.col("category").is_not_null())
        placed = [
            self._place_kind(name, part)
            for name, part in (
                ("vehicles", known.filter(~walkers)),
                ("pedestrians", known.filter(walkers)),
            )
            if part.height
        ]
        return pl.concat(placed).sort("id", "time") if placed else known

    def agreement(self) -> dict[str, Any]:
        """Shares and offsets of vehicles, of pedestrians, and of vehicles by road."""
        agreement: dict[str, Any] = {}
        for name, parts in self._found.items():
            found = pl.concat(parts)
            if self._finders[name] is None:
                agreement[name] = {"states": found.height, "on_lane": 0.0}
                continue
            agreement[name] = _agreement_of(found)
            if name == "vehicles":
                lanes = pl.col("lane").cast(pl.String)
                roads = found.with_columns(lanes.str.split(".").list.first().alias("road"))
                agreement["roads"] = [
                    {"road": str(road), **_agreement_of(own)}
                    for (road,), own in sorted(roads.group_by("road"), key=lambda item: item[0][0])
                ]
        return agreement

    def _place_kind(self, name: str, part: pl.DataFrame) -> pl.DataFrame:
        if name not in self._finders:
            self._finders[name] = self._make_finder(name)
        finder = self._finders[name]
        if finder is None:
            placed = part.with_columns(
                lane=pl.lit(None, pl.Categorical),
                lateral=pl.lit(None, pl.Float64),
                on_lane=pl.lit(value=False),
                wrong_way=pl.lit(value=False),
            )
        else:
            lanes, keys = finder
            columns = ("x", "y", "hdg")
            found = lanes.locate(*(part[column].to_numpy() for column in columns))
            moving = part["speed"].to_numpy() >= _MOVING
            placed = part.with_columns(
                keys.gather(found.lane).alias("lane"),
                lateral=found.lateral,
                on_lane=found.is_on_lane,
                wrong_way=found.is_wrong_way & moving & (name == "vehicles"),
            )
        kept = placed.select("lane", "lateral", "on_lane", "wrong_way")
        self._found.setdefault(name, []).append(kept)
        return placed

    def _make_finder(self, name: str) -> tuple[LaneFinder, pl.Series] | None:
        on_foot = name == "pedestrians"
        keys = self._graph.walks.lane_keys if on_foot else self._graph.lanes.lanes.keys
        if not keys:
            return None
        names = pl.Series([str(key) for key in keys], dtype=pl.Categorical)
        return LaneFinder(self._graph, walks=on_foot), names


def fit_on_map(rows: pl.DataFrame, graph: MapGraph) -> tuple[pl.DataFrame, dict[str, Any]]:
    """Locate tracks in the frame of a map, and say how well the two agree, see :class:`LaneFit`."""
    fit = LaneFit(graph)
    placed = fit.place(rows)
    return placed, fit.agreement()


def _agreement_of(placed: pl.DataFrame) -> dict[str, float]:
    offset = placed.filter(pl.col("on_lane"))["lateral"].to_numpy()
    wrong = placed["wrong_way"].to_numpy()
    figures = {
        "states": placed.height,
        "on_lane": round(len(offset) / placed.height, 4),
        "wrong_way": round(float(wrong.mean()), 4),
    }
    if len(offset):
        figures["offset_median"] = round(float(np.median(offset)), 3)
        figures["offset_95"] = round(float(np.quantile(np.abs(offset), 0.95)), 3)
    return figures


def share_on_lanes(rows: pl.DataFrame, graph: MapGraph) -> float:
    """Share of states of moving vehicles, of a thousand, on a lane of a map in its direction."""
    moving = moving_vehicles(rows)
    if not moving.height or not len(graph.lanes.x):
        return 0.0
    sample = moving.gather_every(max(1, moving.height // _SAMPLE))
    x, y, hdg = (sample[name].to_numpy() for name in ("x", "y", "hdg"))
    lanes = graph.lanes
    near = (x >= lanes.x.min() - _EDGE) & (x <= lanes.x.max() + _EDGE)
    near &= (y >= lanes.y.min() - _EDGE) & (y <= lanes.y.max() + _EDGE)
    if not near.any():
        return 0.0
    found = LaneFinder(graph).locate(x[near], y[near], hdg[near])
    return float((found.is_on_lane & (np.abs(found.turn) < np.pi / 4.0)).sum()) / len(x)


Rows = TypeVar("Rows", pl.DataFrame, pl.LazyFrame)


def moving_vehicles(rows: Rows) -> Rows:
    """States of vehicles that move at 1 m/s or more."""
    return rows.filter(
        pl.col("category").is_not_null()
        & (pl.col("category") != str(Category.PEDESTRIAN))
        & (pl.col("speed") >= _MOVING)
    )


def estimate_offset(rows: pl.DataFrame, graph: MapGraph) -> tuple[float, float, float]:
    """Metres and radians by which tracks lie best on the lanes of a map, from where they are.

    Found by moving and turning them, round by round, so that the sum of squares of their offsets
    from the middles of the lanes nearest to them, in their direction, is least. It has to be less
    than half a lane away to begin with.

    Raises
    ------
    InputError
        If too few vehicles move near a lane.
    """
    moving = moving_vehicles(rows)
    if moving.height < _FEWEST:
        raise InputError(f"{moving.height} states of moving vehicles are too few for an offset")
    x, y, hdg = (moving[name].to_numpy() for name in ("x", "y", "hdg"))
    finder = LaneFinder(graph)
    dx = dy = turn = 0.0
    for _ in range(_ROUNDS):
        c, s = np.cos(turn), np.sin(turn)
        here_x, here_y = dx + c * x - s * y, dy + s * x + c * y
        found = finder.locate(here_x, here_y, hdg + turn)
        used = found.is_on_lane & (np.abs(found.turn) < np.pi / 4.0)
        if used.sum() < _FEWEST:
            raise InputError(f"{int(used.sum())} states lie on a lane of the map, in its direction")
        mid_x, mid_y = here_x[used].mean(), here_y[used].mean()
        nx, ny = found.normal_x[used], found.normal_y[used]
        arm = ny * (here_x[used] - mid_x) - nx * (here_y[used] - mid_y)
        # A direction that no lane tells apart, as along a straight, is not moved in.
        step = np.linalg.lstsq(np.column_stack([nx, ny, arm]), -found.lateral[used], rcond=1e-3)[0]
        c, s = np.cos(step[2]), np.sin(step[2])
        dx, dy = (
            mid_x + c * (dx - mid_x) - s * (dy - mid_y) + step[0],
            mid_y + s * (dx - mid_x) + c * (dy - mid_y) + step[1],
        )
        turn += step[2]
        if np.abs(step).max() < _SETTLED:
            break
    return float(dx), float(dy), float(turn)
