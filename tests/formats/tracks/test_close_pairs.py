"""Pairs of road users that are close: all that there are, no more than bodies have room for."""

from __future__ import annotations

import time
from itertools import pairwise

import numpy as np
import polars as pl
import pytest

from odscen.base.errors import InputError
from odscen.formats.tracks.close_pairs import find_close_pairs, find_crossings
from odscen.formats.tracks.recorded_traffic import complete_tracks
from odscen.formats.tracks.scenes import find_scenes


@pytest.mark.parametrize("count", [1, 2, 40, 700])
def test_all_within_reach_are_found_once(count: int) -> None:
    x, y = np.random.default_rng(count).uniform(0.0, 900.0, (2, count))
    rows = [pair for i, j in find_close_pairs(x, y, 50.0) for pair in zip(i, j, strict=True)]
    far = np.hypot(x[:, None] - x, y[:, None] - y)
    wanted = {(i, j) for i, j in np.argwhere(far < 50.0).tolist() if i != j}
    assert len(rows) == len(set(rows))
    assert wanted <= set(rows)
    if count > 48:
        assert wanted == set(rows)


def test_more_than_bodies_have_room_for_are_refused_before_they_are_paired() -> None:
    x = np.arange(30_000) / 1000.0
    begin = time.process_time()
    with pytest.raises(InputError, match="of 30,000 road users at one time each has 29,999 others"):
        list(find_close_pairs(x, np.zeros_like(x), 150.0))
    assert time.process_time() - begin < 2.0


def test_crossings_are_those_of_a_search_of_all_segments() -> None:
    rng = np.random.default_rng(3)

    def walk(begin: float, count: int) -> np.ndarray:
        steps = rng.normal(0.0, 1.5, (count, 2)).cumsum(axis=0)
        return np.column_stack([begin + 0.4 * np.arange(count), steps])

    a, b = ([walk(rng.uniform(0, 15), int(n)) for n in rng.integers(1, 40, 9)] for _ in range(2))
    expected: dict[tuple[int, int], float] = {}
    for k, one in enumerate(a):
        for m, other in enumerate(b):
            for p, p_next in pairwise(one):
                for q, q_next in pairwise(other):
                    (rx, ry), (sx, sy) = p_next[1:] - p[1:], q_next[1:] - q[1:]
                    dx, dy = q[1:] - p[1:]
                    cross = rx * sy - ry * sx
                    t, u = (dx * sy - dy * sx) / cross, (dx * ry - dy * rx) / cross
                    times = p[0] + 0.4 * t, q[0] + 0.4 * u
                    if 0 <= t < 1 and 0 <= u < 1 and abs(times[0] - times[1]) < 5.0:
                        expected[k, m] = min(times[0], expected.get((k, m), times[0]))
    found = {(row.a, row.b): row.a_time for row in find_crossings(a, b, within=5.0)}
    assert len(expected) > 8
    assert found.keys() == expected.keys()
    assert [found[pair] for pair in expected] == pytest.approx(list(expected.values()))


def test_two_long_tracks_upon_each_other_take_as_long_as_they_are() -> None:
    t = np.arange(8_000) * 0.1
    tracks = [
        pl.DataFrame({"id": kind, "kind": kind, "time": t, "x": 6.0 * t, "y": side})
        for kind, side in (
            ("pedestrian", np.arange(len(t)) % 2.0),
            ("car", 1.0 - np.arange(len(t)) % 2),
        )
    ]
    rows = complete_tracks(pl.concat(tracks, how="vertical_relaxed"), "tracks").rows
    begin = time.process_time()
    scenes = find_scenes(rows)
    assert time.process_time() - begin < 5.0
    assert "crossing_pedestrian" in scenes["kind"].to_list()
