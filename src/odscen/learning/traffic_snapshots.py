"""Snapshots of traffic: where vehicles are at one time, how fast, and what lights show.

They are what the reference generator learns from, and what generated traffic is compared with.
A *shard* is the snapshots of one run on one map, as one .npz file without pickles.
"""

from __future__ import annotations

import io
import json
from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.base.errors import InputError, in_file
from odscen.base.given_arrays import arrays_from_npz
from odscen.base.stored_files import documents

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.base.arrays import FloatArray, IntArray
    from odscen.lanegraph.graphs import ByteArray

VERSION = 1
STOPPED = 0.1
"""m/s; what is slower is stopped, as in SUMO."""


class SignalAhead(IntEnum):
    """What the traffic light at the end of a lane shows to those on it."""

    NONE = 0
    GREEN = 1
    YELLOW = 2
    RED = 3


@dataclass(frozen=True, slots=True, eq=False)
class LightView:
    """What traffic lights show at one time.

    Attributes
    ----------
    state
        Shape ``(L,)``: :class:`SignalAhead` at the end of each lane of the lane graph.
    since
        Shape ``(L,)``: seconds for which it has been shown; 0 without a light.
    """

    state: ByteArray
    since: FloatArray


def no_lights(lanes: int) -> LightView:
    """Lights of a map that has none."""
    return LightView(np.zeros(lanes, dtype=np.uint8), np.zeros(lanes))


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """Traffic at one time; arrays have one value for each vehicle unless said otherwise.

    Attributes
    ----------
    node
        Node of the lane graph nearest to the centre of the body.
    category
        Place in :class:`~odscen.base.categories.Category`.
    speed
        m/s.
    braking
        Strongest deceleration in the two seconds that follow, m/s²; NaN where it is not known.
    lights
        What lights show.
    """

    node: IntArray
    category: IntArray
    speed: FloatArray
    braking: FloatArray
    lights: LightView


@dataclass(frozen=True, slots=True, eq=False)
class Shard:
    """Snapshots of one run.

    Attributes
    ----------
    map_name, map_sha256
        The map.
    town
        What a split by town keeps together: versions of one town are one town.
    about
        How the run was made: seed, density, versions; values that JSON can hold.
    snapshots
        In the order of time.
    """

    map_name: str
    map_sha256: str
    town: str
    about: dict[str, Any]
    snapshots: tuple[Snapshot, ...]


_COLUMNS = {"node": np.int64, "category": np.int64, "speed": np.float64, "braking": np.float64}


def shard_bytes(
    shard: Shard, *, queues: Sequence[IntArray] = (), ahead: Sequence[ByteArray] = ()
) -> bytes:
    """Write a shard as an .npz file; the same shard gives the same bytes.

    Parameters
    ----------
    queues
        For each snapshot the number of stopped vehicles right ahead of each vehicle.
    ahead
        For each snapshot the :class:`SignalAhead` that each vehicle sees.
    """
    some = shard.snapshots
    head = {"map": shard.map_name, "sha256": shard.map_sha256, "town": shard.town}
    text = json.dumps({"version": VERSION, **head, "about": shard.about}, sort_keys=True)
    lit = _lanes_with_lights(some)
    arrays: dict[str, Any] = {
        "about": np.array([text]),
        "count": np.array([len(snapshot.node) for snapshot in some], dtype=np.int64),
        "lanes": np.array([len(some[0].lights.state) if some else 0], dtype=np.int64),
        "light_lane": lit,
        "light_state": np.array([snapshot.lights.state[lit] for snapshot in some], dtype=np.uint8),
        "light_since": np.array(
            [snapshot.lights.since[lit] for snapshot in some], dtype=np.float32
        ),
    }
    for name, kind in _COLUMNS.items():
        values = [getattr(snapshot, name) for snapshot in some]
        small = np.int32 if kind is np.int64 else np.float32
        arrays[name] = np.concatenate([*values, np.empty(0)]).astype(small)
    for name, columns in (("queue", queues), ("signal", ahead)):
        if len(columns):
            arrays[name] = np.concatenate(columns).astype(np.int16)
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **arrays)
    return buffer.getvalue()


def shard_from_bytes(data: bytes, *, file: str) -> Shard:
    """Inverse of :func:`shard_bytes`; queues and signals of vehicles follow from the rest.

    Raises
    ------
    InputError
        If it is no shard.
    """
    arrays = arrays_from_npz(data, file=file)
    with in_file(file), documents("a shard of snapshots", RecursionError):
        about = json.loads(str(arrays["about"][0]))
        if about["version"] != VERSION:
            raise InputError(
                f"version is {about['version']}; this odscen reads {VERSION}", file=file
            )
        return Shard(
            about["map"], about["sha256"], about["town"], about["about"], _read_snapshots(arrays)
        )


def _lanes_with_lights(snapshots: tuple[Snapshot, ...]) -> IntArray:
    """Lanes that have a light at the end in any of the snapshots."""
    if not snapshots:
        return np.empty(0, dtype=np.int64)
    shown = np.any([snapshot.lights.state != SignalAhead.NONE for snapshot in snapshots], axis=0)
    return np.flatnonzero(shown)


def _read_snapshots(arrays: dict[str, Any]) -> tuple[Snapshot, ...]:
    ends = np.cumsum(arrays["count"]).tolist()
    found = []
    for row, (start, end) in enumerate(zip([0, *ends[:-1]], ends, strict=True)):
        columns = {name: arrays[name][start:end].astype(kind) for name, kind in _COLUMNS.items()}
        view = no_lights(int(arrays["lanes"][0]))
        view.state[arrays["light_lane"]] = arrays["light_state"][row]
        view.since[arrays["light_lane"]] = arrays["light_since"][row]
        found.append(Snapshot(**columns, lights=view))
    return tuple(found)
