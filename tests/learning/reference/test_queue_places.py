"""Kinds of place in which queues begin and grow."""

from __future__ import annotations

import numpy as np

from odscen.learning.reference.gap_states import gap_states
from odscen.learning.reference.queue_places import (
    AT_LINE,
    OCCUPIED_MORE,
    PLACES,
    STOPPED_MORE,
    queue_places,
)
from odscen.learning.reference.site_features import site_of
from odscen.learning.traffic_snapshots import LightView, SignalAhead, no_lights
from tests.graphs import fork

GRAPH = fork()
SITE = site_of(GRAPH.lanes)
APPROACH = int(GRAPH.lanes.lane[0])
ON_IT = np.flatnonzero(GRAPH.lanes.lane == APPROACH)


def light(state: SignalAhead) -> LightView:
    lights = no_lights(len(GRAPH.lanes.lanes.keys))
    lights.state[APPROACH] = state
    return lights


def kinds(state: SignalAhead, speed: float | None = None) -> list[int]:
    """Of the nodes of the approach, with or without a car on its last node."""
    some = np.array([ON_IT[-1]] if speed is not None else [], dtype=np.int64)
    none = np.zeros(len(some), dtype=np.int64)
    states = gap_states(SITE.strips, node=some, category=none, speed=np.full(len(some), speed or 0))
    return queue_places(SITE, light(state), states, ON_IT).tolist()


def test_the_first_of_a_queue_stands_at_the_stop_line() -> None:
    near = SITE.to_line[ON_IT] < AT_LINE
    for state, kind in ((SignalAhead.NONE, 1), (SignalAhead.GREEN, 2), (SignalAhead.RED, 3)):
        assert np.array(kinds(state)).tolist() == np.where(near, kind, 0).tolist()


def test_a_queue_grows_right_behind_a_stopped_vehicle_alone() -> None:
    behind = np.array(kinds(SignalAhead.RED, speed=0.0))[:-1]
    assert behind[-1] == 6
    assert 3 <= (behind == 6).sum() <= 6  # nodes every two metres, nine metres and half a car
    assert set(behind.tolist()) == {0, 6}
    assert 4 <= kinds(SignalAhead.NONE, speed=0.0)[-2] < 5
    assert set(kinds(SignalAhead.RED, speed=5.0)[:-1]) == {0}


def test_there_is_a_correction_for_each_kind_and_none_elsewhere() -> None:
    assert OCCUPIED_MORE.shape == STOPPED_MORE.shape == (PLACES,)
    assert OCCUPIED_MORE[0] == 0.0
