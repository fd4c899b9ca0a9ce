"""Places where queues begin and grow, and by how much a generator that sees its own traffic errs.

A model that is trained on SUMO's traffic places too few vehicles in queues once all traffic ahead
is its own: an error at one place is what the next place is told. The logarithms of odds are
raised here by what made fills of towns that the model had not seen have as many vehicles, and
stopped ones, in each kind of place as SUMO has there. Long queues are left as they are:
corrected like short ones, they made dense traffic on Town04 far from SUMO's.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.learning.traffic_snapshots import STOPPED, SignalAhead

if TYPE_CHECKING:
    from odscen.base.arrays import IntArray
    from odscen.learning.reference.gap_states import GapStates
    from odscen.learning.reference.site_features import Site
    from odscen.learning.traffic_snapshots import LightView

AT_LINE = 9.0
"""Metres to the stop line in which the first of a queue stands."""
BEHIND = 9.0
"""Metres from a node to the rear of a stopped vehicle within which one queues behind it."""
LONG = 4
"""Stopped vehicles in a row, from which on a queue is a long one."""
PLACES = 10
"""Elsewhere; first at the stop line without a light, at green or yellow, at red; behind a short
queue likewise; behind a long one likewise."""
OCCUPIED_MORE = np.array([0.0, 0.35, 0.1, 0.25, 0.55, 0.0, 0.5, 0.0, 0.0, 0.0])
"""Added to the logit of a vehicle on a node, by kind of place."""
STOPPED_MORE = np.array([-1.2, 0.45, -0.7, 0.0, 0.0, 0.0, -0.2, 0.0, 0.0, 0.0])
"""Added to the logit of a vehicle being stopped, by kind of place."""


def queue_places(site: Site, lights: LightView, states: GapStates, nodes: IntArray) -> IntArray:
    """Kind of place of nodes, from 0 to ``PLACES - 1``, given the traffic ahead of them."""
    gap, leader = states.gap[nodes], states.leader[nodes]
    behind = (leader >= 0.0) & (leader < STOPPED) & (gap < BEHIND)
    first = (leader < 0.0) & (site.to_line[nodes] < AT_LINE)
    state = lights.state[site.lane[site.strips.root[nodes]]]
    shown = np.where(state == SignalAhead.NONE, 0, np.where(state == SignalAhead.RED, 2, 1))
    kind = np.where(states.queue[nodes] < LONG, 4, 7)
    found: IntArray = np.where(behind, kind + shown, np.where(first, 1 + shown, 0))
    return found
