"""Behaviour models: what drives vehicles in place of SUMO, and its answers, checked before use.

Shaped like the actors of Waymax (Gulino et al., 2023): ``init(rng, scene) -> state`` once, then
``act(observation, state) -> action, is_controlled`` before each step. Everything is arrays with a
row for each vehicle; what is not controlled stays SUMO's.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from odscen.base.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.base.arrays import BoolArray, FloatArray, Int32Array
    from odscen.learning.fill import Array
    from odscen.learning.offered_options import OptionValue


AHEAD = 4
"""Lanes along its route that each vehicle is told of, those inside junctions included."""


class DrivingKind(IntEnum):
    """How a vehicle is driven in the next step."""

    SPEED = 0
    """At a speed, as far as SUMO's driver thinks it safe and has right of way."""
    SPEED_UNCHECKED = 1
    """At a speed, whatever comes."""
    LANE_POSITION = 2
    """On a lane of its route, its front so many metres along it."""
    POSE = 3
    """With its body centre somewhere, on or off the road."""


class LightAhead(IntEnum):
    """What the light at the end of a vehicle's lane shows for where it goes."""

    NONE = 0
    GREEN = 1
    YELLOW = 2
    RED = 3


@dataclass(frozen=True, slots=True, eq=False)
class BehaviourScene:
    """What does not change during a run: ``V`` planned vehicles, ``L`` lanes of SUMO.

    Attributes
    ----------
    step_length
        Seconds.
    time
        Simulated seconds at which the model begins: 0, or the beginning of a slice of a long run.
    vehicle_id, vehicle_category
        Shape ``(V,)``, text; ``car``, ``van``, ``truck``, ``bus``, ``motorcycle``, ``bicycle``.
    vehicle_length, vehicle_width
        ``(V,)``, metres.
    desired_speed
        ``(V,)``, m/s; NaN for the limit.
    speed_factor
        ``(V,)``; multiplies the limit.
    ego
        ``(V,)``, bool.
    lane_id
        ``(L,)``, text, SUMO's.
    lane_length, lane_limit, lane_width
        ``(L,)``, metres, m/s, metres.
    lane_left, lane_right
        ``(L,)``: rows of lanes, -1 for none.
    lane_shape_start, lane_shape_x, lane_shape_y
        Centre line of lane ``k``: points ``lane_shape_start[k]`` to ``lane_shape_start[k + 1]``;
        OpenDRIVE frame, metres.
    """

    step_length: float
    time: float
    vehicle_id: Array
    vehicle_category: Array
    vehicle_length: FloatArray
    vehicle_width: FloatArray
    desired_speed: FloatArray
    speed_factor: FloatArray
    ego: BoolArray
    lane_id: Array
    lane_length: FloatArray
    lane_limit: FloatArray
    lane_width: FloatArray
    lane_left: Int32Array
    lane_right: Int32Array
    lane_shape_start: Int32Array
    lane_shape_x: FloatArray
    lane_shape_y: FloatArray


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class RoadObservation:
    """The ``N`` vehicles on the road before a step; arrays of shape ``(N,)``, but ``ahead``.

    In a run a field is read from the simulation when a model first looks at it.

    Attributes
    ----------
    time
        Simulated seconds at which the next step begins.
    index
        Row of the vehicle in the scene; it stays the same during its trip.
    x, y, hdg
        Body centre, OpenDRIVE frame; metres, radians.
    speed, acceleration
        m/s, m/s^2; acceleration of the last step.
    lane
        Row of the lane of its front, -1 off the road.
    pos
        Of the front, metres along the lane.
    left
        Of the front, metres to the left of the middle of the lane.
    leader, gap
        Row in this observation of the vehicle ahead, on its lane or on those ahead (-1: none), and
        metres from bumper to bumper (infinite: none).
    ahead
        ``(N, AHEAD)``: lanes that it comes to along its route, -1 where they end or where it has to
        change lanes first.
    can_left, can_right
        Whether the lane beside is open to it and leads on along its route.
    light
        :class:`LightAhead`.
    """

    time: float
    index: Int32Array
    x: FloatArray
    y: FloatArray
    hdg: FloatArray
    speed: FloatArray
    acceleration: FloatArray
    lane: Int32Array
    pos: FloatArray
    left: FloatArray
    leader: Int32Array
    gap: FloatArray
    ahead: Int32Array
    can_left: BoolArray
    can_right: BoolArray
    light: Int32Array

    def __len__(self) -> int:
        return len(self.index)


@dataclass(frozen=True, slots=True, eq=False)
class DrivingAction:
    """What vehicles do in the next step; arrays of shape ``(N,)`` in the order of the observation.

    Values of vehicles that are not controlled are not looked at.

    Attributes
    ----------
    kind
        One :class:`DrivingKind` for all, or an array of them.
    speed
        m/s; needed for speeds, of a place the speed that others see (without it, its own).
    lane, pos
        For ``LANE_POSITION``: row of the lane, metres of the front along it.
    x, y, hdg
        For ``POSE``: body centre, OpenDRIVE frame.
    change
        Lanes to change to the left (negative: right) as soon as that is safe. With it SUMO changes
        lanes of controlled vehicles only where their route needs it; without, as it likes.
    """

    kind: DrivingKind | Array = DrivingKind.SPEED
    speed: FloatArray | None = None
    lane: Array | None = None
    pos: FloatArray | None = None
    x: FloatArray | None = None
    y: FloatArray | None = None
    hdg: FloatArray | None = None
    change: Array | None = None


class BehaviourModel(Protocol):
    """Drives vehicles."""

    def init(self, rng: np.random.Generator, scene: BehaviourScene) -> Any:
        """Begin; returns whatever it wants to have in each step.

        ``rng`` is the only source of chance. Each slice of a long run begins anew.
        """

    def act(self, observation: RoadObservation, state: Any) -> tuple[DrivingAction, BoolArray]:
        """Drive; returns what to do, and a bool for each vehicle: whether it is controlled."""


@dataclass(frozen=True, slots=True)
class BehaviourDoor:
    """Where a model comes from.

    Attributes
    ----------
    name
        One that ships, an entry point, ``package.module:Class`` or ``FILE.py:Class``.
    command
        Line of a command that drives over its stdin and stdout.
    socket
        Path of a socket where a program listens that drives.
    time_limit
        Wall seconds that another program may take for one step.
    options
        Keyword arguments of the class: numbers, texts, true or false.
    """

    name: str | None = None
    command: str | None = None
    socket: str | None = None
    time_limit: float = 60.0
    options: Mapping[str, OptionValue] = field(default_factory=dict)

    @property
    def shown(self) -> str:
        """What messages and summaries call it."""
        if self.name is not None:
            return self.name.rpartition("/")[2]
        return self.command or "a program at a socket"


_FASTEST = 150.0
"""m/s; a model that asks for more is mistaken."""
_NEEDS = {
    DrivingKind.SPEED: ("speed",), DrivingKind.SPEED_UNCHECKED: ("speed",),
    DrivingKind.LANE_POSITION: ("lane", "pos"), DrivingKind.POSE: ("x", "y", "hdg"),
}  # fmt: skip


class CheckedAction:
    """What a model has asked for, of ``count`` vehicles.

    Attributes
    ----------
    rows
        Of those that it controls.
    kind, speed, change
        A value for each vehicle; speed and change ``None`` if it does not use them.
    real, whole
        The other fields that it uses, by name; values of those that it does not control mean
        nothing.

    Raises
    ------
    InputError
        If shapes, types or values are not possible, or a field is missing.
    """

    def __init__(self, action: DrivingAction, controlled: Any, count: int) -> None:
        mask = np.asarray(controlled)
        if mask.shape != (count,) or mask.dtype != np.bool_:
            raise InputError(f"is_controlled is {mask.dtype} {mask.shape}, not bool ({count},)")
        self.rows = np.flatnonzero(mask)
        kinds = np.broadcast_to(np.asarray(action.kind), (count,))
        some = kinds[mask] if np.ndim(action.kind) else kinds[self.rows[:1]]
        used = np.unique(some).tolist()
        if unknown := [kind for kind in used if kind not in {*DrivingKind}]:
            raise InputError(f"there is no kind of action {unknown[0]!r}")
        self.kind = kinds
        self.real = {
            name: self._checked_numbers(action, name, count)
            for name in ("speed", "pos", "x", "y", "hdg")
            if getattr(action, name) is not None
        }
        self.whole = {
            name: self._checked_numbers(action, name, count).astype(np.int64)
            for name in ("lane", "change")
            if getattr(action, name) is not None
        }
        for kind in used:
            for name in _NEEDS[DrivingKind(kind)]:
                if name not in self.real and name not in self.whole:
                    raise InputError(f"an action of kind {DrivingKind(kind).name} needs {name}")
        speed = self.real.get("speed")
        if speed is not None and len(self.rows):
            low, high = speed[self.rows].min(), speed[self.rows].max()
            if low < 0.0 or high > _FASTEST:
                bad = low if low < 0.0 else high
                raise InputError(f"a speed of {bad:g} m/s is not between 0 and {_FASTEST:g}")
        self.speed = speed
        self.change = self.whole.get("change")

    def _checked_numbers(self, action: DrivingAction, name: str, count: int) -> Array:
        try:
            values = np.asarray(getattr(action, name), dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise InputError(f"{name} is no array of numbers") from error
        if values.shape != (count,):
            raise InputError(f"{name} has shape {values.shape}, not ({count},)")
        bad = ~np.isfinite(values[self.rows])
        if bad.any():
            row = int(self.rows[np.flatnonzero(bad)[0]])
            raise InputError(f"{name} of row {row} is {values[row]:g}")
        return np.where(np.isfinite(values), values, 0.0)
