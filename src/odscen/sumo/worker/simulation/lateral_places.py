"""Lateral positions that stay the same in metres where lanes are of other widths.

Without the sublane model SUMO keeps a vehicle beside the centre of its lane by a share of the room
that it has there: 0.25 m of a lane of 3.25 m are 0.5 m on the wider lane of a turn, at once. Here
the share is set for the lane that a vehicle enters in the step to come, so that it is beside the
centre by as many metres as before.
"""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.sumo.worker.simulation.planned_looks import PlannedLooks, seconds_to

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from odscen.sumo.worker.simulation.road_lanes import RoadLanes

_LONGEST_WAIT = 2.0
"""Seconds after which a vehicle is looked at in any case: a rule may have made it faster."""
_LONGEST_STEP = 0.5
"""Seconds of a step up to which this is done: beyond it is not foreseen who enters a lane."""
_LARGEST_GAIN = 20.0
"""m/s2 by which something else makes a vehicle faster, at most; more is seen a step late."""
_LEAST = 1e-4
"""Metres that are no change."""


class _Entry(NamedTuple):
    """A vehicle that may enter another lane: its lane, metres beside its centre, those set."""

    lane: str
    beside: float
    given: float
    width: float


class LateralPlaces:
    """Keeps vehicles where they are beside the centres of their lanes.

    Parameters
    ----------
    sumo, errors
        libsumo, and what it raises.
    lanes
        Those of the network.
    native
        Gives the function of libsumo behind one of Python, by domain and name.
    """

    def __init__(
        self,
        sumo: Any,
        errors: tuple[type[Exception], ...],
        lanes: RoadLanes,
        native: Callable[[str, str], Any],
    ) -> None:
        self._sumo, self._errors, self._lanes = sumo, errors, lanes
        self._beside = native("vehicle", "getLateralLanePosition")
        self._looks = PlannedLooks(sumo, native)
        self._is_left_to_sumo: bool | None = None
        self._entries: dict[str, _Entry] = {}
        self._lane_sizes: dict[str, tuple[float, float]] = {}

    def before_step(
        self,
        *,
        only: frozenset[str] | None = None,
        moved: Collection[str] = (),
        placed: Collection[str] = (),
    ) -> None:
        """Prepare those who may enter another lane in the step to come.

        Parameters
        ----------
        only
            Whose places are kept; ``None``: everyone's.
        moved
            Whose speed something else chooses: perhaps one that is not allowed.
        placed
            Of these, who is put somewhere, and left alone here.
        """
        if self._is_left_to_sumo:
            return
        names = self._looks.next_step()
        if self._is_left_to_sumo is None:
            sublane = float(self._sumo.simulation.getOption("lateral-resolution") or 0.0) > 0.0
            self._is_left_to_sumo = sublane or self._looks.step_length > _LONGEST_STEP
            if self._is_left_to_sumo:
                return
        self._put_back()
        due = [name for name in names if only is None or name in only]
        for name in (*due, *self._looks.take_due()):
            with suppress(*self._errors):  # it has arrived
                self._look_at(name, is_moved=name in moved, is_placed=name in placed)

    def forget(self) -> None:
        """Put all where they are, before the state is saved; those in the middle are left alone."""
        if self._is_left_to_sumo is not False:
            return
        self._put_back()
        self._looks.plan_all_now()

    def _put_back(self) -> None:
        """Put back who did not do in the last step what was likely; changes of lane go on."""
        vehicle = self._sumo.vehicle
        for name, (lane, beside, given, width) in self._entries.items():
            with suppress(*self._errors):
                now = vehicle.getLaneID(name)
                aside = beside - self._scale_offset(given, width, lane, now)
                if abs(aside) > _LEAST:
                    vehicle.setLateralLanePosition(name, self._beside(name) + aside)
        self._entries.clear()

    def _look_at(self, name: str, *, is_moved: bool, is_placed: bool) -> None:
        beside = float(self._beside(name))
        if beside == 0.0:
            return
        vehicle = self._sumo.vehicle
        lane = vehicle.getLaneID(name)
        if is_placed or not lane:
            self._plan_look(name, self._looks.step_length)
            return
        width, gains = vehicle.getWidth(name), vehicle.getAccel(name)
        speed, seconds = vehicle.getSpeed(name), self._looks.step_length
        rest = self._size_of(lane)[0] - vehicle.getLanePosition(name)
        if is_moved and (speed + _LARGEST_GAIN * seconds) * seconds < rest:
            self._plan_look(name, seconds)
            return
        if not is_moved and (speed + gains * seconds) * seconds < rest:
            self._plan_look(name, seconds_to(rest, speed, gains))
            return
        likely = speed + vehicle.getAcceleration(name) * seconds
        if not is_moved:
            likely = min(likely, vehicle.getAllowedSpeed(name))
        beyond = max(0.0, likely) * seconds - rest
        farthest = max(beyond, (speed + gains * seconds) * seconds - rest, 0.0)
        entered = self._find_lane(name, lane, beyond if beyond >= 0.0 else 0.5 * farthest)
        given = beside if entered is None else self._scale_offset(beside, width, entered, lane)
        if beyond < 0.0 and abs(given) > abs(beside):
            given = beside  # to be wrong would be to swing out
        if abs(given - beside) > _LEAST:
            vehicle.setLateralLanePosition(name, given)
        self._entries[name] = _Entry(lane, beside, given, width)
        self._plan_look(name, seconds)

    def _plan_look(self, name: str, seconds: float) -> None:
        self._looks.plan(name, min(seconds, _LONGEST_WAIT))

    def _scale_offset(self, beside: float, width: float, lane: str, entered: str) -> float:
        """What SUMO makes of metres beside the centre of a lane where another one is entered."""
        edge_of = self._sumo.lane.getEdgeID
        if lane == entered or edge_of(lane) == edge_of(entered):
            return beside
        room, more_room = (self._size_of(name)[1] - width for name in (lane, entered))
        if more_room <= 0.0 or abs(beside) > 0.5 * room:
            return beside  # who is over the border of a lane is left as it is
        return beside * more_room / room

    def _find_lane(self, name: str, lane: str, beyond: float) -> str | None:
        """The lane that is ``beyond`` metres behind the end of one, on the way of a vehicle."""
        for ahead in self._lanes.ahead(name, lane):
            length = self._size_of(ahead)[0]
            if beyond < length:
                return ahead
            beyond -= length
        return None

    def _size_of(self, lane: str) -> tuple[float, float]:
        """Length and width of a lane, m."""
        known = self._lane_sizes.get(lane)
        if known is None:
            of = self._sumo.lane
            known = self._lane_sizes[lane] = float(of.getLength(lane)), float(of.getWidth(lane))
        return known
