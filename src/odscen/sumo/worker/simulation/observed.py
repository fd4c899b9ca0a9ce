"""What a running simulation says of itself: the values that a session hands out."""

from __future__ import annotations

from enum import IntFlag
from typing import TYPE_CHECKING, Any, NamedTuple, Self

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import numpy as np
    from numpy.typing import NDArray


class VehicleSignal(IntFlag):
    """SUMO's bits: https://sumo.dlr.de/docs/TraCI/Vehicle_Signalling.html."""

    BLINKER_RIGHT = 1
    BLINKER_LEFT = 2
    BLINKER_EMERGENCY = 4
    BRAKE = 8
    FRONT = 16
    FOG = 32
    HIGH_BEAM = 64
    DOOR_OPEN_LEFT = 512
    DOOR_OPEN_RIGHT = 1024
    EMERGENCY_BLUE = 2048


class Front(NamedTuple):
    """Where a road user is, as SUMO has it: centre of the front, metres and degrees, SUMO frame."""

    x: float
    y: float
    z: float
    angle_deg: float


class Poses(NamedTuple):
    """Where all vehicles, or all persons, are: centre of the front, arrays of shape ``(n,)``.

    Those that are not on the road have SUMO's INVALID_DOUBLE_VALUE, -2^30, as x. ``signals`` are
    bits of :class:`VehicleSignal`, 0 for persons.
    """

    ids: Sequence[str]
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    angle_deg: NDArray[np.float64]
    speed: NDArray[np.float64]
    signals: NDArray[np.int64]


class Collision(NamedTuple):
    """One collision that lasts, in libsumo's words."""

    collider: str
    victim: str
    type: str
    lane: str


class StepLists(NamedTuple):
    """What happened in one step: ids, and collisions that lasted, in SUMO's order.

    ``parked`` have taken a place beside the road, ``unparked`` have left one. ``fronts`` are of
    those who have departed or left a place, come back from a teleport, or brake in an emergency.
    """

    departed: Sequence[str]
    arrived: Sequence[str]
    departed_persons: Sequence[str]
    arrived_persons: Sequence[str]
    teleports_started: Sequence[str]
    teleports_ended: Sequence[str]
    emergency_stops: Sequence[str]
    collisions: Sequence[Collision]
    parked: Sequence[str]
    unparked: Sequence[str]
    fronts: Mapping[str, Front | None]

    @classmethod
    def from_row(cls, row: Sequence[Any]) -> Self:
        """One from its JSON."""
        step = cls(*row)
        fronts = {
            name: None if front is None else Front(*front) for name, front in step.fronts.items()
        }
        touching = [Collision(*collision) for collision in step.collisions]
        return step._replace(collisions=touching, fronts=fronts)


class StoppedVehicle(NamedTuple):
    """A vehicle that is stopped: where its front is, metres along ``lane``, and for how long, s."""

    vehicle: str
    lane: str
    pos: float
    waited: float


class ViewAhead(NamedTuple):
    """What a vehicle has before it.

    Attributes
    ----------
    onwards
        Whether its lane continues along its route.
    light
        Letter of the next link: ``r`` red, ``y`` yellow, ``G``, ``g`` green; others without light.
    open
        Whether right of way and light let it pass.
    leader
        Vehicle that is stopped so close ahead that there is no room to proceed: right in front, or
        just behind the junction, which must be kept clear.
    people
        Whether a pedestrian is on a crossing that its next link runs over.
    beside
        Where its own lane does not continue: whether another lane of the road does.
    """

    onwards: bool
    light: str
    open: bool
    leader: str | None
    people: bool
    beside: bool = False


class RouteAhead(NamedTuple):
    """Normal edges that a vehicle has before it.

    Attributes
    ----------
    start
        Edge inside a junction on which it is to depart, if it is.
    edges
        From its own on.
    inside
        Whether it is inside a junction, so that it cannot get another route yet.
    """

    start: tuple[str, ...]
    edges: tuple[str, ...]
    inside: bool
