"""A recording: map elements, tracks and signal states of a run on one clock, as arrays.

Metres, radians, seconds and m/s in the OpenDRIVE frame (x east, y north, z up, ``hdg``
counter-clockwise from +x). Every format of :mod:`odscen.formats` that learners read is written
from this, so that they all say the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from odscen.base.arrays import BoolArray, FloatArray, IntArray

STEP = 0.1
"""Seconds between two instants of a recording, as Waymo, nuPlan and Argoverse have them."""


class LightColor(IntEnum):
    """What a light shows to one lane."""

    OFF = 0
    RED = 1
    YELLOW = 2
    GREEN = 3


class LaneElement(NamedTuple):
    """A driving lane of a lane section.

    Attributes
    ----------
    key
        ``road.section.lane`` of OpenDRIVE.
    kind
        Lane type as in the file.
    road_type
        ``motorway``, ``rural``, ``town``, ... at the start of the road, or empty.
    junction
        OpenDRIVE junction, or empty.
    centre, left, right
        Shape ``(n, 3)``: centre line and borders, in driving direction, with equal steps.
    speed_limit
        m/s at the middle; NaN where the map gives none, infinite for "no limit".
    entries, exits
        Rows of the lanes before and behind.
    left_lane, right_lane
        Row of the neighbour of the same driving direction, or -1.
    opposite
        Row of the neighbour beyond the centre line of the road, against this one, or -1.
    keeps_right
        Whether the centre line of the road is on the left.
    change_left, change_right
        Whether the road mark permits the change at the middle.
    """

    key: str
    kind: str
    road_type: str
    junction: str
    centre: FloatArray
    left: FloatArray
    right: FloatArray
    speed_limit: float
    entries: tuple[int, ...]
    exits: tuple[int, ...]
    left_lane: int
    right_lane: int
    opposite: int
    keeps_right: bool
    change_left: bool
    change_right: bool


class LineElement(NamedTuple):
    """A painted line: type (``solid``, ``broken broken``, ...) and colour as in the file.

    ``points`` has shape ``(n, 3)``.
    """

    kind: str
    color: str
    points: FloatArray


class CrosswalkElement(NamedTuple):
    """A crosswalk.

    Attributes
    ----------
    corners
        Shape ``(K, 3)``, counter-clockwise, not closed.
    axis
        Shape ``(2, 3)``: where one steps on and off.
    width
        Across the axis.
    """

    corners: FloatArray
    axis: FloatArray
    width: float


@dataclass(frozen=True, slots=True, eq=False)
class MapElements:
    """Elements of a map.

    Attributes
    ----------
    lanes
        Lanes that vehicles drive on, in the order of the lane graph.
    lines
        Road markings along lanes, in the order of the file.
    edges
        Shape ``(n, 3)`` each: where the driving surface ends.
    crosswalks
        In the order of the file.
    """

    lanes: tuple[LaneElement, ...]
    lines: tuple[LineElement, ...]
    edges: tuple[FloatArray, ...]
    crosswalks: tuple[CrosswalkElement, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Tracks:
    """Road users over time; arrays of shape ``(A,)`` and ``(A, T)``.

    Attributes
    ----------
    ids, categories
        Of the run; one of the seven categories.
    ego
        Row of the ego, or -1.
    length, width, height
        Of the body.
    valid
        Whether the road user was there. All other values are zero where it was not.
    x, y, z, hdg
        Middle of the body on the ground.
    speed
        Along ``hdg``.
    """

    ids: tuple[str, ...]
    categories: tuple[str, ...]
    ego: int
    length: FloatArray
    width: FloatArray
    height: FloatArray
    valid: BoolArray
    x: FloatArray
    y: FloatArray
    z: FloatArray
    hdg: FloatArray
    speed: FloatArray

    @property
    def velocity(self) -> FloatArray:
        """Shape ``(A, T, 2)``: velocity along the heading."""
        return np.stack([self.speed * np.cos(self.hdg), self.speed * np.sin(self.hdg)], axis=-1)

    def part(self, first: int, last: int) -> Tracks:
        """Instants ``first`` up to ``last``, and of the road users those who were there then."""
        kept = np.flatnonzero(self.valid[:, first:last].any(axis=1))
        ego = np.flatnonzero(kept == self.ego)
        return Tracks(
            tuple(self.ids[row] for row in kept),
            tuple(self.categories[row] for row in kept),
            int(ego[0]) if len(ego) else -1,
            *(getattr(self, name)[kept] for name in ("length", "width", "height")),
            *(
                getattr(self, name)[kept, first:last]
                for name in ("valid", "x", "y", "z", "hdg", "speed")
            ),
        )

    def leading(self, instant: int) -> int:
        """Row of the ego; without one, of the vehicle that is there at an instant and moves most.

        -1 if there is no vehicle at all.
        """
        if self.ego >= 0:
            return self.ego
        moved = np.where(self.valid, self.speed, 0.0).sum(axis=1) + self.valid.any(axis=1)
        vehicle = np.array(
            [category != "pedestrian" for category in self.categories], dtype=np.bool_
        )
        if not vehicle.any():
            return -1
        there = vehicle & self.valid[:, instant]
        return int(np.argmax(np.where(there if there.any() else vehicle, moved, -1.0)))


@dataclass(frozen=True, slots=True, eq=False)
class LaneSignals:
    """What lights show to lanes; arrays of shape ``(K,)`` unless said otherwise.

    Attributes
    ----------
    lane
        Row of the lane through the junction that a light controls.
    approach
        Row of the lane that leads to it.
    turn
        SUMO's letter: ``s`` straight, ``l`` left, ``r`` right, ``t`` back, ...
    stop
        Shape ``(K, 3)``: end of the approach's centre line.
    color
        Shape ``(K, T)``: :class:`LightColor`.
    """

    lane: IntArray
    approach: IntArray
    turn: tuple[str, ...]
    stop: FloatArray
    color: NDArray[np.uint8]


@dataclass(frozen=True, slots=True, eq=False)
class RunRecording:
    """All of it, on one clock.

    Attributes
    ----------
    name
        Of the run's folder.
    scenario, map_name, map_sha256, seed
        Of the scenario.
    times
        Shape ``(T,)``: seconds of the simulation, each :data:`STEP` after the one before.
    recorded_step
        Seconds between two records of the run. Where it is not :data:`STEP`, places between two
        records are interpolated: linear, headings by the smaller angle.
    """

    name: str
    scenario: str
    map_name: str
    map_sha256: str
    seed: int
    times: FloatArray
    recorded_step: float
    elements: MapElements
    tracks: Tracks
    signals: LaneSignals

    @property
    def interpolated(self) -> bool:
        """Whether there are instants at which nothing was recorded."""
        return abs(self.recorded_step - STEP) > 1e-9
