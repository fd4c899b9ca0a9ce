"""Kinds of place in which queues begin and grow."""

from __future__ import annotations

import numpy as np

from odscen.learning.reference.gap_states import gap_states
from odscen.learning.reference.queue_places import (
    AT_LINE,
    LONG,
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


def kinds(state: SignalAhead, *, speed: float = 0.0, cars: int = 0) -> list[int]:
    """Of the nodes of the approach, with so many cars behind each other from its last node on."""
    some = ON_IT[::-1][: 3 * cars : 3]
    none = np.zeros(cars, dtype=np.int64)
    states = gap_states(SITE.strips, node=some, category=none, speed=np.full(cars, speed))
    return queue_places(SITE, light(state), states, ON_IT).tolist()


def test_the_first_of_a_queue_stands_at_the_stop_line() -> None:
    near = SITE.to_line[ON_IT] < AT_LINE
    for state, kind in ((SignalAhead.NONE, 1), (SignalAhead.GREEN, 2), (SignalAhead.RED, 3)):
        assert np.array(kinds(state)).tolist() == np.where(near, kind, 0).tolist()


def test_a_queue_grows_right_behind_a_stopped_vehicle_alone() -> None:
    behind = np.array(kinds(SignalAhead.RED, cars=1))[:-1]
    assert behind[-1] == 6
    assert 3 <= (behind == 6).sum() <= 6  # nodes every two metres, nine metres and half a car
    assert set(behind.tolist()) == {0, 6}
    assert kinds(SignalAhead.NONE, cars=1)[-2] == 4
    assert set(kinds(SignalAhead.RED, cars=1, speed=5.0)[:-1]) == {0}


def test_a_long_queue_is_another_kind_of_place_than_a_short_one() -> None:
    for cars, kind in ((LONG - 1, 6), (LONG, 9)):
        last = len(ON_IT) - 1 - 3 * (cars - 1)  # of the node of the last car
        assert kinds(SignalAhead.RED, cars=cars)[last - 1] == kind


def test_there_is_a_correction_for_each_kind_and_none_elsewhere() -> None:
    assert OCCUPIED_MORE.shape == STOPPED_MORE.shape == (PLACES,)
    assert OCCUPIED_MORE[0] == 0.0
