"""How alike the traffic of a run and recorded traffic are, by distributions of what is seen.

The kinds are those of the sim agents challenge of Waymo (Montali et al., "The Waymo Open Sim Agents
Challenge", NeurIPS 2023): kinematic, interactive and of the map. That challenge asks how likely
what was recorded is among many runs of the same scene; here two sets of traffic are compared, which
need not have a road user in common.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import polars as pl

from odscen.base.categories import Category
from odscen.base.errors import InputError
from odscen.formats.tracks.close_pairs import find_close_pairs
from odscen.formats.tracks.followings import find_leaders
from odscen.formats.tracks.lane_places import LaneFinder, fit_on_map
from odscen.formats.tracks.scenes import exposure, find_scenes, known_sizes, times_to_collision
from odscen.learning.traffic_metrics import divergence

if TYPE_CHECKING:
    from odscen.base.arrays import FloatArray
    from odscen.lanegraph.graphs import MapGraph

STEP: Final = 0.1
"""Seconds between states that are compared, if both sides have them."""
SIGHT: Final = 50.0
"""Metres within which others are near."""
SHORT_TTC: Final = 5.0
"""Seconds of a time to collision, above which all count as this."""
LONG_HEADWAY: Final = 10.0
REGION: Final = 10.0
"""Metres from recorded places within which the run is compared."""
_MOVING: Final = 1.0
"""m/s from which on a turn and a headway are those of driving."""
_FEWEST: Final = 20
"""States below which there is no distribution."""
_RECTANGLE: Final = np.array([(0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.5, -0.5)])


class RealismFigure(NamedTuple):
    """What is compared.

    Attributes
    ----------
    name, kind, unit, definition
        ``kind`` is ``kinematic``, ``interactive`` or ``map``.
    bounds
        Of the bins of the divergence; beyond them counts as the ends.
    """

    name: str
    kind: str
    unit: str
    definition: str
    bounds: FloatArray


REALISM_FIGURES: Final = (
    RealismFigure("speed", "kinematic", "m/s", "Speed.", np.arange(0.0, 41.0)),
    RealismFigure(
        "acceleration", "kinematic", "m/s²", "Change of speed over a step.",
        np.arange(-8.0, 8.1, 0.25),
    ),
    RealismFigure(
        "angular_speed", "kinematic", "°/s", "Turn over a step, from 1 m/s on.",
        np.arange(-45.0, 45.1, 1.5),
    ),
    RealismFigure(
        "nearest_distance", "interactive", "m", "Distance to the nearest body, 50 m at most.",
        np.arange(0.0, SIGHT + 1.0, 1.0),
    ),
    RealismFigure(
        "headway", "interactive", "s", "Time to the body ahead in the path, 10 s at most.",
        np.arange(0.0, LONG_HEADWAY + 0.1, 0.25),
    ),
    RealismFigure(
        "ttc", "interactive", "s", "Time to collision, 5 s for all that are longer.",
        np.arange(0.0, SHORT_TTC + 0.1, 0.25),
    ),
    RealismFigure(
        "touching", "interactive", "", "Share whose body touches another one.",
        np.array([-0.5, 0.5, 1.5]),
    ),
    RealismFigure(
        "lane_edge", "map", "m", "From the side of the body to the edge of its lane, outside < 0.",
        np.arange(-2.0, 3.1, 0.1),
    ),
    RealismFigure(
        "off_lane", "map", "", "Share with the middle of the body on no lane (walk).",
        np.array([-0.5, 0.5, 1.5]),
    ),
)  # fmt: skip
"""In the order in which they are listed."""
_KINDS: Final = tuple(dict.fromkeys(figure.kind for figure in REALISM_FIGURES))
_NAMES: Final = ("all", *_KINDS, *(figure.name for figure in REALISM_FIGURES))


def compare_traffic(
    driven: pl.DataFrame, recorded: pl.DataFrame, graph: MapGraph | None = None
) -> dict[str, Any]:
    """Distances between the distributions of a run and of a recording.

    Parameters
    ----------
    driven, recorded
        Tracks of both, as :data:`~odscen.formats.tracks.recorded_traffic.TRACK_COLUMNS`.
    graph
        The map on which both lie. The run is then compared where it was recorded, within 10 m;
        without one there are no figures of the map, and all of the run is compared.

    Returns
    -------
    dict
        ``step`` (s, of both sides), ``run`` and ``recorded`` (``states``, ``road_users``, and of
        the run ``share``: of its states, that are compared), ``figures``, ``kinds`` and ``scenes``.
        Each figure has its ``group`` (vehicles, pedestrians, or a category), ``figure``, ``kind``,
        ``unit``, both sides (``states``, ``mean``, ``p5``, ``p50``, ``p95``), ``distance``
        (Wasserstein, in the unit) and ``divergence`` (Jensen-Shannon, bits, 0 to 1), and the same
        of the first and second half of the recording (``between_halves``), which is what chance
        and time make. ``kinds`` has the mean divergences of each kind, and of all as ``all``.

    Raises
    ------
    InputError
        If the recording, or the run where it was recorded, has no road user.
    """
    known = [rows.filter(pl.col("category").is_not_null()) for rows in (driven, recorded)]
    if not known[1].height:
        raise InputError("the recording has no road user of a known category")
    in_run = known[0].height
    if graph is not None:
        known[0] = _rows_near(known[0], known[1])
    if not known[0].height:
        where = "" if graph is None else f" within {REGION:g} m of where it was recorded"
        raise InputError(f"the run has no road user{where}")
    steps = [_step_of(rows) for rows in known]
    step = max(STEP, *steps)
    states = [
        _measure_states(rows, own, step, graph) for rows, own in zip(known, steps, strict=True)
    ]
    middle = _middle_of(states[1])
    halves = [states[1].filter(pl.col("time") <= middle), states[1].filter(pl.col("time") > middle)]
    figures = []
    for group, is_of_group in _groups_of(states):
        parts = [part.filter(is_of_group) for part in (*states, *halves)]
        for figure in REALISM_FIGURES:
            if figure.name in states[1].columns:
                values = [part[figure.name].drop_nulls().to_numpy() for part in parts]
                if min(len(values[0]), len(values[1])) >= _FEWEST:
                    figures.append({"group": group, **_compare_figure(figure, values)})
    placed = known if graph is None else [fit_on_map(rows, graph)[0] for rows in known]
    rates = [exposure(rows, find_scenes(rows, graph)) for rows in placed]
    return {
        "step": round(step, 4),
        "run": {**_describe_side(states[0]), "share": round(known[0].height / max(in_run, 1), 4)},
        "recorded": _describe_side(states[1]),
        "figures": figures,
        "kinds": _mean_by_kind(figures),
        "scenes": [
            {
                "scene": kind,
                **{
                    f"{side}_per_100_km": rate["scenes"].get(kind, {"per_100_km": 0.0})[
                        "per_100_km"
                    ]
                    for side, rate in zip(("run", "recorded"), rates, strict=True)
                },
            }
            for kind in sorted({kind for rate in rates for kind in rate["scenes"]})
        ],
    }


def check_realism_name(of: str) -> None:
    """Refuse what is neither a figure nor a kind of them.

    Raises
    ------
    InputError
        If it is none; names those there are.
    """
    if of not in _NAMES:
        raise InputError(f"{of!r} is none of {', '.join(_NAMES)}")


def divergence_of(compared: dict[str, Any], of: str) -> float | None:
    """One number of a comparison, bits: of a kind, of ``all``, or of a figure of all vehicles.

    ``None`` if nothing of it was seen on both sides.

    Raises
    ------
    InputError
        If ``of`` is none of them.
    """
    check_realism_name(of)
    rows = [row for row in compared["figures"] if row["group"] == "vehicles"]
    by_name = {row["figure"]: row for row in rows} | compared["kinds"]
    return float(by_name[of]["divergence"]) if of in by_name else None


# ---------------------------------------------------------------------------- states


def _step_of(rows: pl.DataFrame) -> float:
    times = rows.select((pl.col("time") * 1000.0).round().unique().sort()).to_series().to_numpy()
    return float(np.median(np.diff(times))) / 1000.0 if len(times) > 1 else STEP


def _rows_near(rows: pl.DataFrame, places: pl.DataFrame) -> pl.DataFrame:
    """Rows within some metres of places, both of any number."""
    from scipy.spatial import cKDTree

    cells = places.select((pl.col("x", "y") / 2.0).round() * 2.0).unique().to_numpy()
    near, _ = cKDTree(cells).query(rows.select("x", "y").to_numpy(), distance_upper_bound=REGION)
    return rows.filter(pl.Series(np.isfinite(near)))


def _measure_states(
    rows: pl.DataFrame, own_step: float, step: float, graph: MapGraph | None
) -> pl.DataFrame:
    """States a step apart, with the figures as columns; null where a figure is not defined."""
    moment = (pl.col("time") * 1000.0).round().cast(pl.Int64)
    sized = rows.with_columns(known_sizes(), moment=moment)
    moments = sized["moment"].unique().sort()
    kept = sized.filter(
        pl.col("moment").is_in(moments.gather_every(round(step / own_step)).implode())
    )
    time = pl.col("time").diff().over("id")
    follows = time.is_between(0.5 * step, 1.5 * step)
    turn = pl.col("hdg").diff().over("id")
    turn = pl.arctan2(turn.sin(), turn.cos()) * (180.0 / np.pi)
    kept = kept.sort("id", "time").with_columns(
        acceleration=pl.when(follows).then(pl.col("speed").diff().over("id") / time),
        angular_speed=pl.when(follows & (pl.col("speed") >= _MOVING)).then(turn / time),
    )
    if graph is not None:
        kept = _measure_on_map(kept, graph)
    return measure_between(kept.sort("moment", "id"))


def _measure_on_map(states: pl.DataFrame, graph: MapGraph) -> pl.DataFrame:
    parts = []
    walkers = pl.col("category") == str(Category.PEDESTRIAN)
    for walks, part in ((False, states.filter(~walkers)), (True, states.filter(walkers))):
        has_lanes = bool(graph.walks.lane_keys if walks else graph.lanes.lanes.keys)
        if not (part.height and has_lanes):
            parts.append(
                part.with_columns(
                    lane_edge=pl.lit(None, pl.Float64), off_lane=pl.lit(None, pl.Float64)
                )
            )
            continue
        found = LaneFinder(graph, walks=walks).locate(
            *(part[name].to_numpy() for name in ("x", "y", "hdg"))
        )
        half = part["width"].to_numpy() / 2.0
        edge = found.width / 2.0 - np.abs(found.lateral) - half
        parts.append(
            part.with_columns(
                # Beside its lane a road user is off it, and how far says more of the map.
                lane_edge=pl.Series(np.where(found.is_on_lane, edge, np.nan)).fill_nan(None),
                off_lane=pl.Series((~found.is_on_lane).astype(np.float64)),
            )
        )
    return pl.concat(parts)


def measure_between(states: pl.DataFrame) -> pl.DataFrame:
    """Add what is between bodies at one moment."""
    import shapely

    columns = ("x", "y", "hdg", "speed", "length", "width")
    values = states.select(pl.col(columns).cast(pl.Float64)).to_numpy()
    on_foot = (states["category"] == str(Category.PEDESTRIAN)).to_numpy()
    c, s = np.cos(values[:, 2]), np.sin(values[:, 2])
    along = _RECTANGLE[None, :, 0] * values[:, 4, None]
    across = _RECTANGLE[None, :, 1] * values[:, 5, None]
    corners = np.stack(
        [
            values[:, 0, None] + along * c[:, None] - across * s[:, None],
            values[:, 1, None] + along * s[:, None] + across * c[:, None],
        ],
        axis=2,
    )
    bodies = shapely.polygons(corners)
    nearest = np.full(len(values), SIGHT)
    headway, ttc = np.full(len(values), np.nan), np.full(len(values), SHORT_TTC)
    ttc[on_foot] = np.nan
    starts = np.flatnonzero(np.diff(states["moment"].to_numpy(), prepend=-1))
    for begin, end in pairwise([*starts.tolist(), len(values)]):
        if end - begin < 2:
            continue
        (own, _), away = shapely.STRtree(bodies[begin:end]).query_nearest(
            bodies[begin:end], max_distance=SIGHT, return_distance=True, exclusive=True,
            all_matches=False,
        )  # fmt: skip
        nearest[begin + own] = away
        vehicles = begin + np.flatnonzero(~on_foot[begin:end])
        part = values[vehicles]
        if len(part) < 2:
            continue
        least = np.full(len(part), SHORT_TTC)
        for i, j in find_close_pairs(part[:, 0], part[:, 1], 3.0 * SIGHT):
            np.minimum.at(least, i, times_to_collision(part, i, j))
        ttc[vehicles] = least
        leader, gap = find_leaders(part[:, [0, 1, 2, 4, 5]])
        follows = (leader >= 0) & (part[:, 3] >= _MOVING)
        headway[vehicles[follows]] = np.minimum(gap[follows] / part[follows, 3], LONG_HEADWAY)
    return states.with_columns(
        nearest_distance=nearest,
        headway=pl.Series(headway).fill_nan(None),
        ttc=pl.Series(ttc).fill_nan(None),
        touching=(nearest <= 0.0).astype(np.float64),
    )


# ---------------------------------------------------------------------------- distributions


def _middle_of(states: pl.DataFrame) -> float:
    return float(states["time"].median())  # type: ignore[arg-type]


def _groups_of(states: list[pl.DataFrame]) -> list[tuple[str, pl.Expr]]:
    """All vehicles, all pedestrians, and each category of vehicles that both sides have."""
    category = pl.col("category").cast(pl.String)
    walker = str(Category.PEDESTRIAN)
    present = [set(part["category"].cast(pl.String).unique()) for part in states]
    both = [str(each) for each in Category if all(str(each) in part for part in present)]
    groups = [("vehicles", category != walker)]
    if walker in both:
        groups.append(("pedestrians", category == walker))
    kinds = [each for each in both if each != walker]
    if set().union(*present) - {walker} != set(kinds) or len(kinds) > 1:
        groups += [(each, category == each) for each in kinds]
    return groups


def _compare_figure(figure: RealismFigure, values: list[FloatArray]) -> dict[str, Any]:
    from scipy.stats import wasserstein_distance

    driven, recorded, first, second = values
    between = None
    if min(len(first), len(second)) >= _FEWEST:
        between = {
            "distance": round(float(wasserstein_distance(first, second)), 4),
            "divergence": round(divergence(first, second, figure.bounds), 4),
        }
    return {
        "figure": figure.name,
        "kind": figure.kind,
        "unit": figure.unit,
        "run": _describe_values(driven),
        "recorded": _describe_values(recorded),
        "distance": round(float(wasserstein_distance(recorded, driven)), 4),
        "divergence": round(divergence(recorded, driven, figure.bounds), 4),
        "between_halves": between,
        "bins": [round(bound, 3) for bound in figure.bounds.tolist()],
        "shares": {
            name: _shares_of(sample, figure.bounds)
            for name, sample in (("run", driven), ("recorded", recorded))
        },
    }


def _describe_values(values: FloatArray) -> dict[str, float]:
    p5, p50, p95 = np.quantile(values, (0.05, 0.5, 0.95)).tolist()
    described = {"mean": float(values.mean()), "p5": p5, "p50": p50, "p95": p95}
    return {"states": len(values), **{name: round(value, 4) for name, value in described.items()}}


def _shares_of(values: FloatArray, bounds: FloatArray) -> list[float]:
    counts, _ = np.histogram(np.clip(values, bounds[0], bounds[-1]), bounds)
    return [round(share, 5) for share in (counts / len(values)).tolist()]


def _describe_side(states: pl.DataFrame) -> dict[str, Any]:
    return {"states": states.height, "road_users": states["id"].n_unique()}


def _mean_by_kind(figures: list[dict[str, Any]]) -> dict[str, dict[str, float | None]]:
    """Mean divergences of all vehicles and all pedestrians; each figure counts once."""
    rows = [row for row in figures if row["group"] in ("vehicles", "pedestrians")]
    kinds = list(dict.fromkeys(row["kind"] for row in rows))
    found: dict[str, dict[str, float | None]] = {}
    for kind in kinds:
        own = [row for row in rows if row["kind"] == kind]
        halves = [row["between_halves"]["divergence"] for row in own if row["between_halves"]]
        found[kind] = {
            "divergence": round(float(np.mean([row["divergence"] for row in own])), 4),
            "between_halves": round(float(np.mean(halves)), 4) if len(halves) == len(own) else None,
        }
    if found:
        means = {
            name: [kind[name] for kind in found.values()]
            for name in ("divergence", "between_halves")
        }
        found["all"] = {
            name: None if None in values else round(float(np.mean(values)), 4)  # type: ignore[arg-type]
            for name, values in means.items()
        }
    return found
