"""Shards of snapshots: written, read back, and refused."""

from __future__ import annotations

import numpy as np
import pytest

from odscen.base.errors import InputError
from odscen.learning.traffic_snapshots import (
    LightView,
    Shard,
    SignalAhead,
    Snapshot,
    shard_bytes,
    shard_from_bytes,
)


def snapshot(count: int) -> Snapshot:
    lights = LightView(np.zeros(5, dtype=np.uint8), np.zeros(5))
    lights.state[2], lights.since[2] = SignalAhead.RED, 12.5
    return Snapshot(
        node=np.arange(count) * 7,
        category=np.arange(count) % 6,
        speed=np.arange(count) * 0.25,
        braking=np.where(np.arange(count) == 1, np.nan, 0.5),
        lights=lights,
    )


def test_a_shard_is_read_as_it_was_written() -> None:
    shard = Shard("Town01", "0" * 64, "Town01", {"seed": 3}, (snapshot(3), snapshot(0)))
    data = shard_bytes(shard)
    found = shard_from_bytes(data, file="one.npz")
    assert (found.map_name, found.town, found.about) == ("Town01", "Town01", {"seed": 3})
    assert [len(one.node) for one in found.snapshots] == [3, 0]
    for name in ("node", "category", "speed", "braking"):
        np.testing.assert_array_equal(
            getattr(found.snapshots[0], name), getattr(shard.snapshots[0], name)
        )
    assert found.snapshots[1].lights.state.tolist() == [0, 0, 3, 0, 0]
    assert found.snapshots[1].lights.since.tolist() == [0.0, 0.0, 12.5, 0.0, 0.0]
    assert shard_bytes(found) == data


@pytest.mark.parametrize("data", [b"", b"PK\x03\x04", b"no shard"])
def test_what_is_no_shard_is_refused_by_name(data: bytes) -> None:
    with pytest.raises(InputError, match=r"one\.npz"):
        shard_from_bytes(data, file="one.npz")
