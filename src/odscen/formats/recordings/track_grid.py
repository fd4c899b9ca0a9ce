"""Trajectories on a clock of equal steps."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.categories import DEFAULT_BODY, Category
from odscen.base.errors import InputError
from odscen.formats.recordings.run_recording import STEP, Tracks

if TYPE_CHECKING:
    from collections.abc import Mapping

    import polars as pl

    from odscen.base.arrays import BoolArray, FloatArray
    from odscen.formats.base import ExportSource, RecordedRun
    from odscen.records.run_plan import PlannedActor
    from odscen.sumo.realize.sumo_map import SumoMap


# ----------------------------------------------------------- heights of the ground below road users
def ground_heights(
    sumo_map: SumoMap, rows: pl.DataFrame, lengths: Mapping[str, float]
) -> FloatArray:
    """Height of the map below the middle of each body, shape ``(N,)``, metres.

    On a SUMO lane between the nodes of the lane graph that lie on it, by position along it, so that
    it is right where roads cross on two levels; elsewhere that of the nearest node.

    Parameters
    ----------
    rows
        Trajectories: ``x`` and ``y`` of the middle, perhaps ``lane`` and ``pos`` of the front.
    lengths
        Of each body by ``id``, metres.
    """
    from scipy.spatial import cKDTree

    graph, places = sumo_map.graph, sumo_map.lane_places
    xy = np.column_stack([rows["x"].to_numpy(), rows["y"].to_numpy()])
    nodes = np.concatenate(
        [np.column_stack([part.x, part.y, part.z]) for part in (graph.lanes, graph.walks)]
    )
    if not len(nodes):
        return np.zeros(len(xy))
    heights: FloatArray = nodes[cKDTree(nodes[:, :2]).query(xy)[1], 2]
    if "lane" not in rows.columns or "pos" not in rows.columns:
        return heights
    row_of = {name: row for row, name in enumerate(places.lanes)}
    names, which = np.unique(rows["lane"].fill_null("").to_numpy(), return_inverse=True)
    lane = np.array([row_of.get(str(name), -1) for name in names], dtype=np.int64)[which]
    half = np.array([0.5 * lengths[str(name)] for name in rows["id"]])
    pos = rows["pos"].cast(float).fill_null(np.nan).to_numpy() - half
    for part in np.unique(lane[lane >= 0]).tolist():
        own = np.flatnonzero(places.lane == part)
        at = np.flatnonzero((lane == part) & np.isfinite(pos))
        if len(own) and len(at):
            own = own[np.argsort(places.pos[own], kind="stable")]
            heights[at] = np.interp(pos[at], places.pos[own], graph.lanes.z[own])
    return heights


# ----------------------------------------------------------- trajectories on a clock of equal steps
MOST_STATES = 20_000_000
"""Road users times instants; a state takes about 50 bytes of memory."""
_SAME = 1e-6
"""Seconds by which a record may miss an instant and still be of it."""
_LEAP = 2.0
"""A road user that gets this many times farther than at its speed was moved, and not driven."""
_LEEWAY = 2.0
"""Metres that are no leap at any speed."""


class ExportWindow(NamedTuple):
    """Part of a run, s; ``None`` is its first, or last, record."""

    begin: float | None = None
    end: float | None = None


def instants(recorded: RecordedRun, window: ExportWindow) -> FloatArray:
    """Seconds of a recording, whole multiples of its step.

    Raises
    ------
    InputError
        If no road user was there in the window.
    """
    times = recorded.rows["time"]
    if not len(times):
        raise InputError("no road users were in the simulation, so there is nothing to export")
    first, last = float(times.min()), float(times.max())  # type: ignore[arg-type]
    begin = first if window.begin is None else max(first, window.begin)
    end = last if window.end is None else min(last, window.end)
    low, high = int(np.ceil(begin / STEP - _SAME)), int(np.floor(end / STEP + _SAME))
    if high < low:
        raise InputError(
            f"the window has no instant: the run was recorded from {first:g} to {last:g} s"
        )
    return np.round(np.arange(low, high + 1) * STEP, 6)


def tracks_of(source: ExportSource, recorded: RecordedRun, times: FloatArray) -> Tracks:
    """Road users at each instant.

    Raises
    ------
    InputError
        If there are no road users at any of them, or there are too many.
    """
    import polars as pl

    margin = recorded.step + _SAME
    rows = recorded.rows.filter(pl.col("time").is_between(times[0] - margin, times[-1] + margin))
    lengths = {user.id: user.length for user in recorded.users}
    if "z" not in rows.columns:
        rows = rows.with_columns(z=ground_heights(source.sumo_map, rows, lengths))
    own = {str(name): part for (name,), part in rows.group_by("id", maintain_order=True)}
    users = [user for user in recorded.users if user.id in own]
    if len(users) * len(times) > MOST_STATES:
        raise InputError(
            f"{len(users)} road users at {len(times)} instants are more than {MOST_STATES:,} "
            "states; choose a part of the run with --begin and --end"
        )
    found = [_resample_to_grid(own[user.id], times, recorded.step) for user in users]
    there = [k for k, track in enumerate(found) if track.valid.any()]
    if not there:
        raise InputError(
            f"no road users were in the simulation from {times[0]:g} to {times[-1]:g} s"
        )
    users, found = [users[k] for k in there], [found[k] for k in there]
    return Tracks(
        ids=tuple(user.id for user in users),
        categories=tuple(str(user.category) for user in users),
        ego=next((row for row, user in enumerate(users) if user.ego), -1),
        length=np.array([user.length for user in users]),
        width=np.array([user.width for user in users]),
        height=np.array([body_height(source, user) for user in users]),
        valid=np.stack([track.valid for track in found]),
        x=np.stack([track.x for track in found]),
        y=np.stack([track.y for track in found]),
        z=np.stack([track.z for track in found]),
        hdg=np.stack([track.hdg for track in found]),
        speed=np.stack([track.speed for track in found]),
    )


def body_height(source: ExportSource, user: PlannedActor) -> float:
    """Metres: of the road user's model, else of its category."""
    known = None if user.model is None else source.assets.dimensions(user.model)
    return (known or DEFAULT_BODY[Category(user.category)]).height


class _Track(NamedTuple):
    valid: BoolArray
    x: FloatArray
    y: FloatArray
    z: FloatArray
    hdg: FloatArray
    speed: FloatArray


def _resample_to_grid(rows: pl.DataFrame, times: FloatArray, step: float) -> _Track:
    """States of one road user; what lies between two records that belong together is linear."""
    at = rows["time"].to_numpy()
    x, y, z, hdg, speed = (
        rows[name].cast(float).to_numpy() for name in ("x", "y", "z", "hdg", "speed")
    )
    after = np.clip(np.searchsorted(at, times - _SAME), 0, len(at) - 1)
    before = np.maximum(after - 1, 0)
    exact = np.abs(at[after] - times) <= _SAME
    before = np.where(exact, after, before)
    gap = at[after] - at[before]
    moved = np.hypot(x[after] - x[before], y[after] - y[before])
    usual = np.maximum(speed[after], speed[before]) * gap
    driven = (gap > 0) & (gap <= 1.5 * step) & (moved <= _LEAP * usual + _LEEWAY)
    valid = exact | (driven & (at[before] < times) & (times < at[after]))
    share = np.where(exact | (gap <= 0), 0.0, (times - at[before]) / np.where(gap > 0, gap, 1.0))
    turn = np.remainder(hdg[after] - hdg[before] + np.pi, 2.0 * np.pi) - np.pi

    def between(values: FloatArray) -> FloatArray:
        return np.where(valid, values[before] + share * (values[after] - values[before]), 0.0)

    turned = np.remainder(hdg[before] + share * turn + np.pi, 2.0 * np.pi) - np.pi
    return _Track(
        valid,
        between(x),
        between(y),
        between(np.nan_to_num(z)),
        np.where(valid, turned, 0.0),
        between(speed),
    )
