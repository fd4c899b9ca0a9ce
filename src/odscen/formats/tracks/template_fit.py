"""Scenes of recorded traffic as numbers of templates, and how these are distributed.

What a template is made of is measured where its scene begins, so that what drivers did about it
does not count: times to collision are those if both keep the speeds that they have there.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import polars as pl

from odscen.base.categories import Category
from odscen.base.errors import InputError
from odscen.formats.tracks.followings import find_leaders
from odscen.formats.tracks.lane_places import LaneFinder
from odscen.formats.tracks.scenes import known_sizes
from odscen.scenario.templates.car_scenes import INTRUSION, LEAST_CLOSING
from odscen.scenario.templates.template_registry import TEMPLATES

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from odscen.base.arrays import FloatArray
    from odscen.lanegraph.graphs import MapGraph

_AROUND: Final = 12.0
"""Seconds before and after a change of lanes in which its beginning and end are looked for."""
_STILL: Final = 0.1
"""m/s to the side below which a change of lanes has not begun, or is over."""
_FIRST, _LAST = 0.1, 0.9
"""Shares of a half-cosine between which its duration is measured, where it is steep."""
_BRAKES: Final = 0.3
"""m/s² of deceleration above which a vehicle is braking."""
_LEAST_DROP: Final = 2.0
"""m/s that braking has to take."""
_SAME_SPEED: Final = 2.0
"""m/s by which the speeds of a vehicle and that behind it may differ in a template with one."""
_STEPS: Final = 0.3
"""m/s from which on a pedestrian walks."""
_DRIVES: Final = 2.0


class _UnfitSceneError(Exception):
    """A scene is not one of its template; the reason reads on from the number of scenes."""


class FittedScene(NamedTuple):
    """A scene as numbers of a template.

    Attributes
    ----------
    template
        Its name.
    id, other, begin
        Of the scene: road users, and seconds.
    values
        By the names of the template's parameters, SI.
    """

    template: str
    id: str
    other: str
    begin: float
    values: dict[str, float]


class TemplateFit(NamedTuple):
    """What scenes were made.

    Attributes
    ----------
    scenes
        By template and time.
    unfit
        By template: why others are not scenes of it, and how many.
    """

    scenes: list[FittedScene]
    unfit: dict[str, dict[str, int]]


def fit_templates(placed: pl.DataFrame, scenes: pl.DataFrame, graph: MapGraph) -> TemplateFit:
    """Fit templates to scenes: cut-ins, vehicles ahead that brake, pedestrians who cross.

    Parameters
    ----------
    placed
        Tracks on the map, of :func:`~odscen.formats.tracks.lane_places.fit_on_map`.
    scenes
        Of :func:`~odscen.formats.tracks.scenes.find_scenes` with this map.
    graph
        The map.
    """
    rows = placed.with_columns(known_sizes()).sort("id", "time")
    tracks = {str(user): own for (user,), own in rows.group_by("id", maintain_order=True)}
    finder = LaneFinder(graph)

    def fit_cut_in(scene: Mapping[str, Any]) -> tuple[str, dict[str, float]]:
        return _fit_cut_in(scene, tracks, finder)

    def fit_braking(scene: Mapping[str, Any]) -> tuple[str, dict[str, float]]:
        return _fit_braking(scene, tracks, rows)

    def fit_crossing(scene: Mapping[str, Any]) -> tuple[str, dict[str, float]]:
        return _fit_crossing(scene, tracks)

    kinds: dict[str, tuple[str, Callable[[Mapping[str, Any]], tuple[str, dict[str, float]]]]] = {
        "cut_in": ("cut-in", fit_cut_in),
        "hard_braking": ("lead-brakes", fit_braking),
        "crossing_pedestrian": ("mid-block", fit_crossing),
    }
    found: list[FittedScene] = []
    unfit: dict[str, dict[str, int]] = {template: {} for template, _ in kinds.values()}
    for scene in scenes.filter(pl.col("kind").is_in(list(kinds))).iter_rows(named=True):
        template, fit = kinds[scene["kind"]]
        try:
            other, values = fit(scene)
            _refuse_out_of_range(template, values)
        except _UnfitSceneError as error:
            unfit[template][str(error)] = unfit[template].get(str(error), 0) + 1
            continue
        rounded = {name: round(value, 4) for name, value in values.items()}
        found.append(FittedScene(template, scene["id"], other, scene["begin"], rounded))
    order = [template for template, _ in kinds.values()]
    found.sort(key=lambda scene: (order.index(scene.template), scene.begin, scene.id, scene.other))
    return TemplateFit(found, unfit)


def _refuse_out_of_range(template: str, values: Mapping[str, float]) -> None:
    for number in TEMPLATES[template].parameters:
        value = values.get(number.name)
        if value is not None and not number.low <= value <= number.high:
            raise _UnfitSceneError(
                f"{number.name} is not {number.low:g} to {number.high:g} {number.unit}".rstrip()
            )


# ---------------------------------------------------------------------------- scenes


def _fit_cut_in(
    scene: Mapping[str, Any], tracks: Mapping[str, pl.DataFrame], finder: LaneFinder
) -> tuple[str, dict[str, float]]:
    own = tracks[scene["id"]].filter(
        pl.col("time").is_between(scene["end"] - _AROUND, scene["end"] + _AROUND)
    )
    time = own["time"].to_numpy()
    places = finder.locate(*(own[name].to_numpy() for name in ("x", "y", "hdg")))
    crossed = int(np.searchsorted(time, scene["end"] - 1e-6))
    side = math.copysign(1.0, places.lateral[crossed])
    width = float(places.width[crossed])
    # Metres from the middle of the new lane, towards the old one: before the border the lane is
    # that one, whose middle is half of both widths away.
    before = np.arange(len(time)) < crossed
    # Measured is the middle of the front, which comes into the lane first.
    half = float(own["length"].median()) / 2.0  # type: ignore[arg-type]
    aside = side * (places.lateral + half * np.sin(places.turn))
    aside = aside + np.where(before, (places.width + width) / 2.0, 0.0)
    first, last = _ends_of_move(time, aside, crossed)
    whole = aside[first] - aside[last]
    if last - first < 2 or whole < width / 2.0:
        raise _UnfitSceneError("the lane change is not seen as a whole")
    moved = (aside[first] - aside[first : last + 1]) / whole
    early, late = (_time_of_share(time[first : last + 1], moved, at) for at in (_FIRST, _LAST))
    # Half-cosine: its share is (1 - cos(pi t / over)) / 2.
    shares = [math.acos(1.0 - 2.0 * at) / math.pi for at in (_FIRST, _LAST)]
    over = (late - early) / (shares[1] - shares[0])
    begins = early - shares[0] * over
    body = float(own["width"].median())  # type: ignore[arg-type]
    border = width / 2.0 + body / 2.0 - INTRUSION
    enters = _time_of_share(
        time[first : last + 1], moved, float(np.clip((aside[first] - border) / whole, 0.0, 1.0))
    )
    ego, other = _state_at(tracks[scene["other"]], begins), _state_at(own, begins)
    if ego is None or other is None:
        raise _UnfitSceneError("one of the two is not seen when the lane change begins")
    closing = ego["speed"] - other["speed"]
    if closing < LEAST_CLOSING + 0.01:  # values are rounded
        raise _UnfitSceneError(f"the vehicle behind is not {LEAST_CLOSING:g} m/s faster")
    c, s = math.cos(ego["hdg"]), math.sin(ego["hdg"])
    ahead = (other["x"] - ego["x"]) * c + (other["y"] - ego["y"]) * s
    gap = ahead - (other["length"] + ego["length"]) / 2.0
    return scene["other"], {
        "ego_speed": ego["speed"],
        "speed": other["speed"],
        "ttc": gap / closing - (enters - begins),
        "over": over,
    }


def _ends_of_move(time: FloatArray, aside: FloatArray, crossed: int) -> tuple[int, int]:
    """Rows at which a move to the side begins and ends: before and behind it is slow."""
    if crossed < 1:
        raise _UnfitSceneError("the lane change is not seen as a whole")
    rate = -np.gradient(aside, time)
    # Where a body goes from one lane to the next, widths that differ are no motion.
    rate[max(crossed - 2, 0) : crossed + 2] = max(float(rate[crossed - 1]), 10.0 * _STILL)
    step = float(np.median(np.diff(time)))
    window = max(1, round(0.3 / step))
    smooth = np.convolve(rate, np.ones(window) / window, mode="same")
    slow = smooth < _STILL
    before, behind = np.flatnonzero(slow[:crossed]), np.flatnonzero(slow[crossed:])
    if not len(before) or not len(behind):
        raise _UnfitSceneError("the lane change is not seen as a whole")
    return int(before[-1]), crossed + int(behind[0])


def _time_of_share(time: FloatArray, moved: FloatArray, share: float) -> float:
    rising = np.maximum.accumulate(moved)
    kept = np.concatenate([[True], np.diff(rising) > 0.0])
    return float(np.interp(share, rising[kept], time[kept]))


def _fit_braking(
    scene: Mapping[str, Any], tracks: Mapping[str, pl.DataFrame], rows: pl.DataFrame
) -> tuple[str, dict[str, float]]:
    own = tracks[scene["id"]]
    time, rate = own["time"].to_numpy(), own["acceleration"].to_numpy()
    at = int(np.searchsorted(time, scene["begin"] - 1e-6))
    eases = np.flatnonzero(rate > -_BRAKES)
    first = int(eases[eases < at][-1]) if (eases < at).any() else 0
    last = int(eases[eases > at][0]) if (eases > at).any() else len(time) - 1
    speed = own["speed"].to_numpy()
    begin, end = float(speed[first]), float(speed[first : last + 1].min())
    if begin - end < _LEAST_DROP:
        raise _UnfitSceneError(f"braking takes less than {_LEAST_DROP:g} m/s")
    lost = (begin - speed[first : last + 1]) / (begin - end)
    early, late = (_time_of_share(time[first : last + 1], lost, share) for share in (0.1, 0.9))
    behind = _who_follows(scene["id"], float(time[first]), rows)
    if behind is None:
        raise _UnfitSceneError("no vehicle follows the one that brakes")
    follower, gap, its_speed = behind
    if abs(its_speed - begin) > _SAME_SPEED:
        raise _UnfitSceneError(
            f"the speeds of the two differ by more than {_SAME_SPEED:g} m/s when it brakes"
        )
    return follower, {
        "speed": its_speed,
        "gap": gap,
        "deceleration": 0.8 * (begin - end) / max(late - early, 1e-3),
    }


def _who_follows(leader: str, time: float, rows: pl.DataFrame) -> tuple[str, float, float] | None:
    """Vehicle whose next one ahead is the leader: id, gap (m), speed (m/s)."""
    frame = rows.filter(
        pl.col("time").is_between(time - 1e-3, time + 1e-3)
        & (pl.col("category") != str(Category.PEDESTRIAN))
    ).sort("id")
    names = frame["id"].to_list()
    if leader not in names or len(names) < 2:
        return None
    columns = ("x", "y", "hdg", "length", "width")
    ahead, gap = find_leaders(frame.select(pl.col(columns).cast(pl.Float64)).to_numpy())
    behind = np.flatnonzero(ahead == names.index(leader))
    if not len(behind):
        return None
    best = int(behind[np.argmin(gap[behind])])
    return names[best], float(gap[best]), float(frame["speed"][best])


def _fit_crossing(
    scene: Mapping[str, Any], tracks: Mapping[str, pl.DataFrame]
) -> tuple[str, dict[str, float]]:
    walker, vehicle = tracks[scene["id"]], tracks[scene["other"]]
    crosses, walks = _nearest_row(walker, scene), walker["speed"].to_numpy()
    meets = _nearest_row(vehicle, scene)
    # From its last rest on, as far as the vehicle is seen and drives.
    rests = np.flatnonzero(walks[:crosses] < _STEPS)
    start = int(rests[-1]) + 1 if len(rests) else 0
    time = walker["time"].to_numpy()
    drives = vehicle.filter((pl.col("speed") >= _DRIVES) & (pl.col("time") >= time[start] - 1e-3))
    if not drives.height:
        raise _UnfitSceneError(f"the vehicle is slower than {_DRIVES:g} m/s")
    begin = float(drives["time"][0])
    start = max(start, int(np.searchsorted(time, begin - 1e-3)))
    if start >= crosses:
        raise _UnfitSceneError("the vehicle is not seen when the pedestrian starts")
    row = int(np.searchsorted(vehicle["time"].to_numpy(), time[start] - 1e-3))
    if row >= meets:
        raise _UnfitSceneError("the vehicle is past before the pedestrian starts")
    walked = _metres_between(walker, start, crosses)
    pace = walked / float(time[crosses] - time[start])
    speed = float(vehicle["speed"][row])
    length, width = float(vehicle["length"][row]), float(vehicle["width"][row])
    front = _metres_between(vehicle, row, meets) - length / 2.0
    if front <= 0.0 or speed < _DRIVES:
        raise _UnfitSceneError("the vehicle is past before the pedestrian starts")
    left = walked - pace * front / speed
    return scene["other"], {
        "ego_speed": speed,
        "walking_speed": pace,
        "hit": 0.5 - left / width,
    }


def _nearest_row(own: pl.DataFrame, scene: Mapping[str, Any]) -> int:
    return int(np.argmin(np.hypot(own["x"] - scene["x"], own["y"] - scene["y"])))


def _metres_between(own: pl.DataFrame, first: int, last: int) -> float:
    part = own.slice(first, last - first + 1)
    return float(np.hypot(np.diff(part["x"]), np.diff(part["y"])).sum())


def _state_at(own: pl.DataFrame, time: float) -> dict[str, float] | None:
    """State of a track at a time between two rows; none outside of it."""
    times = own["time"].to_numpy()
    if not times[0] - 1e-3 <= time <= times[-1] + 1e-3:
        return None
    found = {
        name: float(np.interp(time, times, own[name].to_numpy()))
        for name in ("x", "y", "speed", "length", "width")
    }
    found["hdg"] = float(own["hdg"][int(np.argmin(np.abs(times - time)))])
    return found


# ---------------------------------------------------------------------------- distributions


def describe_values(scenes: Sequence[FittedScene]) -> dict[str, Any]:
    """How the numbers of scenes of one template are distributed, and go together.

    Returns
    -------
    dict
        ``scenes``, ``parameters`` (of each ``mean``, ``std`` and quantiles ``p0`` to ``p100``) and
        ``correlation`` (Spearman's, of each pair; ``None`` of fewer than four scenes).
    """
    names = list(scenes[0].values)
    table = np.array([[scene.values[name] for name in names] for scene in scenes])
    parameters = {}
    for name, column in zip(names, table.T, strict=True):
        shares = (0, 5, 25, 50, 75, 95, 100)
        quantiles = np.quantile(column, np.array(shares) / 100.0).tolist()
        parameters[name] = {
            "mean": round(float(column.mean()), 4),
            "std": round(float(column.std()), 4),
            **{
                f"p{share}": round(value, 4) for share, value in zip(shares, quantiles, strict=True)
            },
        }
    ranks = _rank_correlation(table)
    return {
        "scenes": len(scenes),
        "parameters": parameters,
        "correlation": {
            f"{names[i]} and {names[j]}": None if ranks is None else round(float(ranks[i, j]), 3)
            for i in range(len(names))
            for j in range(i + 1, len(names))
        },
    }


def draw_values(scenes: Sequence[FittedScene], count: int, *, seed: int) -> list[dict[str, float]]:
    """Draw numbers that are distributed and go together as those of scenes of one template.

    Each has the distribution of the scenes, straight between their values; ranks go together as
    theirs do, by a Gaussian copula. Of fewer than four scenes they are drawn independently. Where
    one road user comes nearer to another, drawn is by how much it is faster, so that it always is.

    Parameters
    ----------
    seed
        The same one draws the same.

    Raises
    ------
    InputError
        If there is no scene.
    """
    from scipy.stats import norm

    if not scenes:
        raise InputError("nothing can be drawn of no scene")
    names = list(scenes[0].values)
    table = np.array([[scene.values[name] for name in names] for scene in scenes])
    closes_in = {"ego_speed", "speed"} <= set(names)
    ego, other = (names.index(name) if closes_in else 0 for name in ("ego_speed", "speed"))
    if closes_in:
        table[:, ego] -= table[:, other]
    rng = np.random.default_rng(seed)
    ranks = _rank_correlation(table)
    # A normal copula of Spearman's rho has the correlation 2 sin(pi rho / 6).
    wanted = np.eye(len(names)) if ranks is None else 2.0 * np.sin(np.pi * ranks / 6.0)
    values, vectors = np.linalg.eigh(wanted)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    root /= np.sqrt((root**2).sum(axis=1))[:, None]
    shares = norm.cdf(rng.standard_normal((count, len(names))) @ root.T)
    drawn = np.column_stack(
        [np.quantile(column, share) for column, share in zip(table.T, shares.T, strict=True)]
    )
    if closes_in:
        drawn[:, ego] += drawn[:, other]
    return [dict(zip(names, np.round(row, 4).tolist(), strict=True)) for row in drawn]


def _rank_correlation(table: FloatArray) -> FloatArray | None:
    from scipy.stats import rankdata

    if len(table) < 4:
        return None
    ranks = rankdata(table, axis=0)
    spread = ranks.std(axis=0)
    if (spread < 1e-9).all():
        return None
    found = np.eye(table.shape[1])
    some = spread > 1e-9
    found[np.ix_(some, some)] = np.corrcoef(ranks[:, some].T)
    return found
