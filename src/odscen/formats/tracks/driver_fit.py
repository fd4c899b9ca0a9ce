"""Drivers fitted to recorded traffic: how they follow, and how fast they want to drive.

Each driver's parameters are those with which its model, driven behind its recorded leader, comes
closest to its recorded gaps and speeds: calibration by whole trajectories, as in Kesting and
Treiber, "Calibrating car-following models by using trajectory data", Transportation Research Record
2088, 2008. The models are the intelligent driver and Krauss' driver as SUMO steps them, so that
what is fitted is what SUMO then drives; the latter is fitted step by step
(:mod:`odscen.formats.tracks.krauss_model`).
"""

from __future__ import annotations

import math
import zlib
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import polars as pl

from odscen.base.categories import Category
from odscen.base.errors import InputError
from odscen.formats.tracks.followings import find_followings
from odscen.formats.tracks.krauss_model import fit_krauss_driver, next_speed_of_krauss
from odscen.scenario.document.drivers_document import Drivers
from odscen.scenario.document.problems import validated
from odscen.sumo.realize.driving import HEADWAY, KINDS, STYLES

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.base.arrays import FloatArray
    from odscen.formats.tracks.followings import Following
    from odscen.lanegraph.graphs import MapGraph

MODELS: Final = ("IDM", "Krauss")
"""SUMO's names of the models."""
PARAMETERS: Final = ("tau", "minGap", "accel", "decel")
_BOUNDS: Final = {
    "tau": (0.2, 5.0),
    "minGap": (0.2, 9.0),
    "accel": (0.2, 8.0),
    "decel": (0.6, 10.0),
}
_LEAST: Final = 10.0
"""Seconds behind leaders from which on a driver is fitted."""
_HELD_OUT: Final = 3
"""One driver of so many is not used to fit."""
_FREE: Final = 6.0
"""Seconds of headway from which on a driver is free."""
_STEADY: Final = 0.5
_CLOSES: Final = 0.1
"""m/s by which a leader is slower to be come nearer to."""
_LONGEST_TTC: Final = 20.0
_FIRST_DRIVERS, _DRIVERS, _BEST, _GENERATIONS, _WIDER = 800, 200, 40, 40, 1.5
_FEW: Final = 4
"""Drivers below which a parameter is their median, and no distribution."""


class FittedDrivers(NamedTuple):
    """What was fitted.

    Attributes
    ----------
    drivers
        Driver sets, one for each category, as scenarios have them.
    report
        As plain values: ``categories`` with ``model``, ``misfit`` (of each model that was fitted),
        parameters, their spread, correlation and how many drivers were fitted and held out, and
        ``comparison``: figures of those held out as recorded, by the fitted and by the default
        drivers, and which of both are ``nearer``.
    """

    drivers: Drivers
    report: dict[str, Any]


def fit_drivers(
    rows: pl.DataFrame, *, graph: MapGraph | None = None, model: str | None = None
) -> FittedDrivers:
    """Fit drivers to tracks, category by category, and judge them on drivers held out.

    Parameters
    ----------
    rows
        Tracks; with a map those of :func:`~odscen.formats.tracks.lane_places.fit_on_map`.
    graph
        The map, whose limits desired speeds are shares of; without one they are not fitted.
    model
        One of :data:`MODELS`; of each category that with the least misfit if not given.

    Raises
    ------
    InputError
        If nobody follows another vehicle for 10 s, or there is no such model.
    """
    if model is not None and model not in MODELS:
        raise InputError(f"{model!r} is no model that is fitted; there are {', '.join(MODELS)}")
    followings = find_followings(rows)
    by_driver: dict[str, list[Following]] = {}
    for following in followings:
        by_driver.setdefault(following.id, []).append(following)
    usable = {
        driver: own
        for driver, own in sorted(by_driver.items())
        if sum(following.seconds for following in own) >= _LEAST
    }
    if not usable:
        longest = max((following.seconds for following in followings), default=0.0)
        raise InputError(
            f"no vehicle follows another one for {_LEAST:g} s; the longest does for {longest:.1f} s"
        )
    factors = {} if graph is None else _speed_factors(rows, graph)
    names = MODELS if model is None else (model,)
    fitted_by = {
        name: {driver: fit_driver(own, model=name) for driver, own in usable.items()}
        for name in names
    }
    sets, categories, comparison = [], {}, []
    for category in Category:
        own = [driver for driver in usable if usable[driver][0].category == category]
        if not own:
            continue
        held_out = _choose_held_out(own)
        trained = [driver for driver in own if driver not in held_out]
        misfit = {
            name: round(_mean_misfit(trained, usable, fitted_by[name], name), 4) for name in names
        }
        chosen = min(names, key=lambda name: (misfit[name], name))
        fitted = fitted_by[chosen]
        values = {
            name: np.array([fitted[driver][name] for driver in trained]) for name in PARAMETERS
        }
        wanted = np.array([factors[driver] for driver in trained if driver in factors])
        spread = {name: _spread_of(each) for name, each in values.items()}
        if len(wanted):
            spread["speedFactor"] = _spread_of(wanted)
        sets.append(
            {
                "id": f"recorded-{category}",
                "car_following": chosen,
                "parameters": {name: _distribution_of(each) for name, each in spread.items()},
            }
        )
        categories[str(category)] = {
            "model": chosen,
            "misfit": misfit,
            "fitted": len(trained),
            "held_out": len(held_out),
            "parameters": spread,
            "correlation": _correlation_of(values),
        }
        judged = [following for driver in held_out for following in usable[driver]]
        if judged:
            typical = {name: spread[name]["median"] for name in PARAMETERS}
            comparison += _compare_drivers(category, judged, typical, chosen)
    drivers = validated(Drivers, {"sets": sets})
    return FittedDrivers(drivers, {"categories": categories, "comparison": comparison})


def _mean_misfit(
    drivers: Sequence[str],
    usable: Mapping[str, Sequence[Following]],
    fitted: Mapping[str, Mapping[str, float]],
    model: str,
) -> float:
    """Root of the mean square of deviations of trajectories, all driven with the medians.

    With own values a model that bends to anything would be the best, as an intelligent driver does
    to waiting at a junction. Of a few drivers each has its own.
    """
    total, count = 0.0, 0
    for driver in drivers:
        of = drivers if len(drivers) >= _FEW else [driver]
        values = {
            name: np.array([np.median([fitted[other][name] for other in of])])
            for name in PARAMETERS
        }
        wanted = np.array([fitted[driver]["speed"]])
        mean = _mean_speed(usable[driver])
        for following in usable[driver]:
            gaps, speeds = drive_behind(following, values, wanted, model=model)
            total += float(_measure_deviations(following, gaps, speeds, mean).sum())
            count += len(following.gap)
    return math.sqrt(total / max(count, 1))


# ---------------------------------------------------------------------------- the models


def next_speed_of_idm(
    speed: FloatArray,
    gap: FloatArray,
    ahead: float,
    wanted: FloatArray,
    step: float,
    values: Mapping[str, FloatArray],
) -> FloatArray:
    """Speed of the intelligent driver after a step, m/s, as SUMO's ``MSCFModel_IDM``.

    All of shape ``(M,)`` but the leader's speed ``ahead`` and ``step``.
    """
    accel = values["accel"]
    closing = speed * (speed - ahead) / (2.0 * np.sqrt(accel * values["decel"]))
    desired = values["minGap"] + np.maximum(0.0, speed * values["tau"] + closing)
    free = (speed / np.maximum(wanted, 0.1)) ** 4
    rate = accel * (1.0 - free - (desired / np.maximum(gap, 1e-3)) ** 2)
    return np.maximum(0.0, speed + rate * step)


def drive_behind(
    following: Following,
    values: Mapping[str, FloatArray],
    wanted: FloatArray,
    *,
    model: str = "IDM",
) -> tuple[FloatArray, FloatArray]:
    """Gaps and speeds of ``M`` drivers behind the recorded leader, each of shape ``(T, M)``.

    Parameters
    ----------
    values
        By the names of :data:`PARAMETERS`, of shape ``(M,)``.
    wanted
        Their desired speeds, m/s, shape ``(M,)``.
    model
        One of :data:`MODELS`. Krauss' drivers take their leader to brake as a car of odscen does.
    """
    next_speed = next_speed_of_idm
    if model == "Krauss":
        next_speed = next_speed_of_krauss
        values = {"leader_decel": np.array([KINDS[Category.CAR].decel]), **values}
    step, count = following.step, len(following.speed)
    leader_way = (following.gap + following.travelled).tolist()
    ahead = following.leader_speed.tolist()
    gaps, speeds = np.empty((count, len(wanted))), np.empty((count, len(wanted)))
    speed, way = np.full(len(wanted), float(following.speed[0])), np.zeros(len(wanted))
    for k in range(count):
        gap = leader_way[k] - way
        gaps[k], speeds[k] = gap, speed
        speed = next_speed(speed, np.maximum(gap, 0.0), ahead[k], wanted, step, values)
        way = way + speed * step
    return gaps, speeds


# ---------------------------------------------------------------------------- fitting


def fit_driver(followings: Sequence[Following], *, model: str = "IDM") -> dict[str, float]:
    """Parameters of one driver by its followings, and its desired ``speed`` (m/s) in them.

    Of the intelligent driver least is the mean square of the deviations of gaps, as shares of
    them, and of speeds, as shares of the mean. It has many local minima, so that it is searched by
    generations of drivers, each drawn around the best of the one before (cross-entropy method),
    always with the same numbers. Krauss' driver is fitted by
    :func:`~odscen.formats.tracks.krauss_model.fit_krauss_driver`.
    """
    if model == "Krauss":
        return fit_krauss_driver(followings)
    fastest = max(float(following.speed.max()) for following in followings)
    mean = _mean_speed(followings)
    low = np.array([*(_BOUNDS[name][0] for name in PARAMETERS), fastest])
    high = np.array([*(_BOUNDS[name][1] for name in PARAMETERS), 1.8 * fastest + 1.0])

    def misfits(points: FloatArray) -> FloatArray:
        values = {name: points[:, k] for k, name in enumerate(PARAMETERS)}
        total, count = np.zeros(len(points)), 0
        for following in followings:
            gaps, speeds = drive_behind(following, values, points[:, -1])
            total += _measure_deviations(following, gaps, speeds, mean).sum(axis=0)
            count += len(following.gap)
        return total / count

    rng = np.random.default_rng(0)
    points = low + (high - low) * rng.random((_FIRST_DRIVERS, len(low)))
    costs = misfits(points)
    for _ in range(_GENERATIONS):
        order = np.argsort(costs, kind="stable")[:_BEST]
        points, costs = points[order], costs[order]
        centre, spread = points.mean(axis=0), np.cov(points.T) + np.diag(((high - low) * 1e-6) ** 2)
        more = rng.multivariate_normal(centre, _WIDER * spread, _DRIVERS, method="cholesky")
        more = np.clip(more, low, high)
        points, costs = np.vstack([points, more]), np.append(costs, misfits(more))
        if np.all(np.sqrt(np.diag(spread))[: len(PARAMETERS)] < 1e-4 * centre[: len(PARAMETERS)]):
            break
    best = points[int(np.argmin(costs))].tolist()
    return {**dict(zip(PARAMETERS, best, strict=False)), "speed": best[-1]}


def _mean_speed(followings: Sequence[Following]) -> float:
    return max(float(np.mean([following.speed.mean() for following in followings])), 1.0)


def _measure_deviations(
    following: Following, gaps: FloatArray, speeds: FloatArray, mean: float
) -> FloatArray:
    """Squares of the deviations of gaps, as shares of them, and of speeds, ``(T, M)``."""
    wrong = (gaps - following.gap[:, None]) / np.maximum(following.gap[:, None], 1.0)
    late = (speeds - following.speed[:, None]) / mean
    found: FloatArray = wrong**2 + late**2
    return found


def _choose_held_out(drivers: Sequence[str]) -> set[str]:
    """A third of the drivers, always the same; of fewer than three none."""
    ordered = sorted(drivers, key=lambda driver: (zlib.crc32(driver.encode()), driver))
    return set(ordered[: len(ordered) // _HELD_OUT])


def _speed_factors(rows: pl.DataFrame, graph: MapGraph) -> dict[str, float]:
    """Desired speed of drivers while they are free, as a share of the limit."""
    keys = {str(key): row for row, key in enumerate(graph.lanes.lanes.keys)}
    first = graph.lanes.lanes.first_node
    limits = {key: float(graph.lanes.speed_limit[int(first[row])]) for key, row in keys.items()}
    free = rows.filter(
        pl.col("on_lane")
        & (pl.col("category") != str(Category.PEDESTRIAN))
        & (pl.col("acceleration").abs() < _STEADY)
        & (pl.col("speed") > 2.0)
    ).with_columns(
        limit=pl.col("lane").replace_strict(limits, default=None, return_dtype=pl.Float64)
    )
    behind = {
        following.id
        for following in find_followings(rows)
        if float(np.median(following.gap / np.maximum(following.speed, 0.1))) < _FREE
    }
    known = free.filter(pl.col("limit").is_finite() & ~pl.col("id").is_in(sorted(behind)))
    shares = known.group_by("id").agg((pl.col("speed") / pl.col("limit")).median())
    return {str(driver): min(max(float(share), 0.2), 2.0) for driver, share in shares.iter_rows()}


def _spread_of(values: FloatArray) -> dict[str, float]:
    low, middle, high = (float(np.quantile(values, q)) for q in (0.05, 0.5, 0.95))
    return {
        "median": round(middle, 4),
        "mean": round(float(values.mean()), 4),
        "std": round(float(values.std()), 4),
        "low": round(low, 4),
        "high": round(high, 4),
        "drivers": len(values),
    }


def _distribution_of(spread: Mapping[str, float]) -> Any:
    """A normal distribution between the quantiles of 5 and 95 %; of few drivers their median."""
    if spread["drivers"] < _FEW or spread["high"] - spread["low"] < 1e-3:
        return spread["median"]
    return {"kind": "normal", **{name: spread[name] for name in ("mean", "std", "low", "high")}}


def _correlation_of(values: Mapping[str, FloatArray]) -> dict[str, float]:
    names = [name for name in values if len(values[name]) > _FEW and values[name].std() > 1e-6]
    return {
        f"{a} and {b}": round(float(np.corrcoef(values[a], values[b])[0, 1]), 3)
        for k, a in enumerate(names)
        for b in names[k + 1 :]
    }


# ---------------------------------------------------------------------------- judging


def default_parameters(category: Category) -> dict[str, float]:
    """What a normal driver of odscen has, without wishes of the scenario; its model is Krauss'."""
    traits, style = KINDS[category], STYLES["normal"]
    return {
        "tau": HEADWAY * style.headway,
        "minGap": style.min_gap,
        "accel": traits.accel * style.accel,
        "decel": traits.decel,
    }


def _compare_drivers(
    category: Category, judged: Sequence[Following], typical: Mapping[str, float], model: str
) -> list[dict[str, Any]]:
    """Figures of drivers who were held out: recorded, fitted and default."""
    from scipy.stats import wasserstein_distance

    driven: dict[str, list[tuple[FloatArray, FloatArray]]] = {
        "recorded": [(following.gap, following.speed) for following in judged]
    }
    for name, of_model, values in (
        ("fitted", model, typical),
        ("default", "Krauss", default_parameters(category)),
    ):
        alone = {key: np.array([value]) for key, value in values.items()}
        driven[name] = []
        for following in judged:
            wanted = np.array([1.2 * float(following.speed.max()) + 0.5])
            gaps, speeds = drive_behind(following, alone, wanted, model=of_model)
            driven[name].append((gaps[:, 0], speeds[:, 0]))
    step = judged[0].step
    samples = {
        name: {
            "headway": np.concatenate(
                [gap[speed > 2.0] / speed[speed > 2.0] for gap, speed in each]
            ),
            "speed": np.concatenate([speed for _, speed in each]),
            "acceleration": np.concatenate([np.diff(speed) / step for _, speed in each]),
            "time to collision": np.concatenate(
                [
                    _times_to_leader(gap, speed, following.leader_speed)
                    for (gap, speed), following in zip(each, judged, strict=True)
                ]
            ),
        }
        for name, each in driven.items()
    }
    rows = []
    units = {"headway": "s", "speed": "m/s", "acceleration": "m/s²", "time to collision": "s"}
    for figure, unit in units.items():
        row: dict[str, Any] = {"category": str(category), "figure": figure, "unit": unit}
        truth = samples["recorded"][figure]
        if not len(truth):
            continue
        for name, sample in samples.items():
            found = sample[figure]
            row[name] = {
                "mean": round(float(found.mean()), 3) if len(found) else None,
                "std": round(float(found.std()), 3) if len(found) else None,
            }
            if name != "recorded" and len(found):
                row[name]["distance"] = round(float(wasserstein_distance(truth, found)), 4)
        away = {name: row[name].get("distance", math.inf) for name in ("fitted", "default")}
        row["nearer"] = min(away, key=lambda name: (away[name], name))
        rows.append(row)
    for name in ("fitted", "default"):
        errors = np.concatenate(
            [gap - following.gap for (gap, _), following in zip(driven[name], judged, strict=True)]
        )
        rows.append(
            {
                "category": str(category),
                "figure": f"gap error of {name} drivers",
                "unit": "m",
                name: {"rms": round(float(np.sqrt(np.mean(errors**2))), 3)},
            }
        )
    return rows


def _times_to_leader(gap: FloatArray, speed: FloatArray, ahead: FloatArray) -> FloatArray:
    """Seconds to the leader while it is slower, 20 s at most."""
    closing = speed - ahead
    closes = closing > _CLOSES
    return np.minimum(np.maximum(gap[closes], 0.0) / closing[closes], _LONGEST_TTC)
