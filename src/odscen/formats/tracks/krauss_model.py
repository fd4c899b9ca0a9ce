"""Krauss' drivers as SUMO steps them, and their parameters fitted to how vehicles follow.

In each step a driver takes the greatest speed from which it can still stop behind its leader, if
that one brakes as hard as it can: a formula of gap and speeds alone. So it is held against each
recorded step, not against whole trajectories, in which a driver that is a little off never gets
near its leader and says nothing. Source: SUMO 1.28, ``MSCFModel::maximumSafeFollowSpeed``,
``maximumSafeStopSpeedEuler`` and ``brakeGapEuler``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.base.arrays import FloatArray
    from odscen.formats.tracks.followings import Following

_NEAR_END: Final = 1e-3
"""Metres by which SUMO makes gaps shorter, so that errors of rounding do no harm."""
_LONGEST_RATE: Final = 1.0
"""Seconds over which accelerations are measured."""
_FIRST, _NEXT, _BEST, _GENERATIONS, _STARTS, _WIDER = 1500, 200, 40, 60, 3, 1.5
_OUTLIER: Final = 0.5
"""m/s from which on a step is not explained better or worse."""
NAMES: Final = ("tau", "minGap", "accel", "decel", "leader_decel", "wanted")
"""What is fitted: those of a driver set, the deceleration that it expects of its leader (of at
least its own), and the speed that it wants, m/s."""


def next_speed_of_krauss(
    speed: FloatArray,
    gap: FloatArray,
    ahead: FloatArray | float,
    wanted: FloatArray,
    step: float,
    values: Mapping[str, FloatArray],
) -> FloatArray:
    """Speed after a step, m/s; arrays may be of any shapes that fit each other.

    Parameters
    ----------
    speed, gap, ahead
        Of the driver, m/s; from bumper to bumper, m; of its leader, m/s.
    wanted
        The speed that it wants, m/s.
    step
        Seconds.
    values
        ``tau``, ``minGap``, ``accel``, ``decel`` and ``leader_decel``.
    """
    decel, tau = values["decel"], values["tau"]
    reduction = np.maximum(decel, values["leader_decel"]) * step
    steps = np.floor(ahead / reduction)
    braking = step * (steps * ahead - reduction * steps * (steps + 1.0) / 2.0)
    free = gap - values["minGap"] + braking - _NEAR_END
    usable = np.maximum(free, 0.0)
    slower = decel * step
    root = np.sqrt(np.maximum(step**2 + 4.0 * (step * (2.0 * usable / slower - tau) + tau**2), 0.0))
    steps = np.floor(0.5 - (tau - 0.5 * root) / step)
    stops = 0.5 * steps * (steps - 1.0) * slower * step + steps * slower * tau
    safe = steps * slower + (usable - stops) / (steps * step + tau)
    safe = np.where(free < 0.0, 0.0, safe)
    found: FloatArray = np.maximum(
        np.minimum(np.minimum(speed + values["accel"] * step, safe), wanted), 0.0
    )
    return found


def fit_krauss_driver(followings: Sequence[Following]) -> dict[str, float]:
    """Parameters with which each next speed is nearest to that recorded, and the ``speed`` wanted.

    Least is the mean of the deviations, each 0.5 m/s at most, searched by generations of drivers
    as in :func:`~odscen.formats.tracks.driver_fit.fit_driver`, from three beginnings, for it has
    many local minima; always with the same numbers. The acceleration is looked for about the 98 %
    quantile of those over a second.
    """
    step = followings[0].step
    speed, gap, ahead, after = (
        np.concatenate([part[name] for part in map(_steps_of, followings)])[:, None]
        for name in ("speed", "gap", "ahead", "after")
    )
    seconds = max(1, round(_LONGEST_RATE / step))
    rates = np.concatenate(
        [
            (one.speed[seconds:] - one.speed[:-seconds]) / (seconds * step)
            for one in followings
            if len(one.speed) > seconds
        ]
    )
    accel = max(float(np.quantile(rates, 0.98)), 0.3)
    fastest = float(after.max())
    low = np.array([0.2, 0.2, 0.85 * accel, 0.6, 0.6, fastest])
    high = np.array([5.0, 9.0, 1.25 * accel, 10.0, 10.0, 1.8 * fastest + 1.0])

    def misfits(points: FloatArray) -> FloatArray:
        values = {name: points[None, :, k] for k, name in enumerate(NAMES)}
        found = next_speed_of_krauss(speed, gap, ahead, values["wanted"], step, values)
        least: FloatArray = np.minimum(np.abs(found - after), _OUTLIER).mean(axis=0)
        return least

    rng = np.random.default_rng(0)
    best, least = low, np.inf
    for _ in range(_STARTS):
        points = low + (high - low) * rng.random((_FIRST, len(low)))
        costs = misfits(points)
        for _ in range(_GENERATIONS):
            order = np.argsort(costs, kind="stable")[:_BEST]
            points, costs = points[order], costs[order]
            spread = np.cov(points.T) + np.diag(((high - low) * 1e-6) ** 2)
            centre = points.mean(axis=0)
            more = rng.multivariate_normal(centre, _WIDER * spread, _NEXT, method="cholesky")
            more = np.clip(more, low, high)
            points, costs = np.vstack([points, more]), np.append(costs, misfits(more))
        if costs.min() < least:
            best, least = points[int(np.argmin(costs))], float(costs.min())
    found = dict(zip(NAMES, best.tolist(), strict=True))
    return {**found, "speed": found["wanted"]}


def _steps_of(following: Following) -> dict[str, FloatArray]:
    return {
        "speed": following.speed[:-1],
        "gap": following.gap[:-1],
        "ahead": following.leader_speed[:-1],
        "after": following.speed[1:],
    }
