"""Measures in the scenario document: what is closed, narrowed or out of order, where and when.

Measures change what traffic may do without another map. Places are named as in the lane graph: a
segment (``r12``), a lane (``12.0.-1``: road, section, lane), or a turn, the segments that are
passed one after another (``r12>j54>r8``; junctions may be left out). Times are seconds after the
start of the run; what they cannot say is in docs/measures.md.
"""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from odscen.base.categories import Category
from odscen.scenario.document.document_parts import Identifier, Label, Part, Seconds

Places = Annotated[tuple[Label, ...], Field(min_length=1)]
LimitSpeed = Annotated[float, Field(gt=0, le=100)]


class TimedMeasure(Part):
    """What all measures have; ``end`` ``None`` is the end of the run."""

    id: Identifier
    begin: Seconds = 0.0
    end: Seconds | None = None

    @model_validator(mode="after")
    def _check_order(self) -> Self:
        if self.end is not None and self.end <= self.begin:
            raise ValueError(f"it ends at {self.end:g} s, not after it begins ({self.begin:g} s)")
        return self


class RoadClosure(TimedMeasure):
    """Segments, lanes or turns that no vehicle enters; who is on them drives out.

    ``destinations`` says what becomes of trips to what is closed: the vehicle is taken out at once
    (``leave``), the trip ends on the last open road before it (``end``), or the vehicle waits
    there beside the road until the closure ends (``wait``).
    """

    kind: Literal["closure"]
    places: Places
    destinations: Literal["leave", "end", "wait"] = "leave"


class Roadworks(TimedMeasure):
    """A stretch with a lower limit (m/s), closed lanes, or narrowed ones.

    ``width`` (metres) is that of the lanes left open. SUMO does not drive slower on narrow lanes,
    so the limit is lowered by what HCM takes off the free-flow speed. At least one of the three.
    """

    kind: Literal["roadworks"]
    places: Places
    speed: LimitSpeed | None = None
    closed_lanes: tuple[Label, ...] = ()
    width: Annotated[float, Field(ge=2, le=6)] | None = None

    @model_validator(mode="after")
    def _does_something(self) -> Self:
        if self.speed is None and self.width is None and not self.closed_lanes:
            raise ValueError("give at least one of speed, closed_lanes and width")
        return self


class LaneIncident(TimedMeasure):
    """A broken-down vehicle that blocks a lane.

    Its front stops ``s`` metres from the start of the road, as OpenDRIVE counts; it is ``length``
    metres long. It drives up as all others do, so that it stops at ``begin`` or a little later.
    """

    kind: Literal["incident"]
    lane: Label
    s: Annotated[float, Field(ge=0, le=1e7)]
    length: Annotated[float, Field(ge=2, le=25)] = 5.0


class SpeedLimit(TimedMeasure):
    """Another speed limit, m/s; of several at a place the lowest holds."""

    kind: Literal["speed_limit"]
    places: Places
    speed: LimitSpeed


class ChangedPermission(TimedMeasure):
    """Who may use segments, lanes or turns: only ``allowed``, or all vehicles but ``banned``."""

    kind: Literal["permission"]
    places: Places
    allowed: tuple[Category, ...] = ()
    banned: tuple[Category, ...] = ()

    @model_validator(mode="after")
    def _check_one_of_both(self) -> Self:
        if bool(self.allowed) == bool(self.banned):
            raise ValueError("give either allowed or banned")
        if Category.PEDESTRIAN in (*self.allowed, *self.banned):
            raise ValueError("measures are about vehicles; pedestrians walk beside the lanes")
        return self


class SignalOutage(TimedMeasure):
    """A traffic light out of order.

    ``off``: right of way as without lights; ``flashing``: all vehicles give way. ``junction`` is
    named as in the timing of signals.
    """

    kind: Literal["signal_outage"]
    junction: Label
    shows: Literal["off", "flashing"] = "off"


Measure = Annotated[
    RoadClosure | Roadworks | LaneIncident | SpeedLimit | ChangedPermission | SignalOutage,
    Field(discriminator="kind"),
]
"""One measure; ``kind`` says which."""


def banned_by(measure: TimedMeasure) -> tuple[Category, ...]:
    """Categories of vehicles that may not enter the places that a measure closes."""
    vehicles = [category for category in Category if category is not Category.PEDESTRIAN]
    if not isinstance(measure, ChangedPermission):
        return tuple(vehicles)
    if measure.banned:
        return tuple(vehicle for vehicle in vehicles if vehicle in measure.banned)
    return tuple(vehicle for vehicle in vehicles if vehicle not in measure.allowed)


def closed_places(measure: TimedMeasure) -> tuple[str, ...]:
    """Places of a measure that some vehicles may not enter."""
    if isinstance(measure, Roadworks):
        return measure.closed_lanes
    if isinstance(measure, RoadClosure | ChangedPermission):
        return measure.places
    return ()


def named_places(measure: TimedMeasure) -> tuple[tuple[str, str], ...]:
    """All places that a measure names, each with the field that names it."""
    if isinstance(measure, LaneIncident):
        return (("lane", measure.lane),)
    found = [
        (f"{field}[{index}]", place)
        for field in ("places", "closed_lanes")
        for index, place in enumerate(getattr(measure, field, ()))
    ]
    return tuple(found)


def measure_words(measure: TimedMeasure) -> str:
    """What a measure does, in one line for people."""
    where = ", ".join(place for _, place in named_places(measure))
    match measure:
        case RoadClosure():
            return f"closed: {where}"
        case Roadworks():
            parts = [f"limit {measure.speed * 3.6:.0f} km/h"] if measure.speed is not None else []
            parts += [f"lanes {measure.width:g} m wide"] if measure.width is not None else []
            parts += [f"closed lanes {', '.join(measure.closed_lanes)}"] * bool(
                measure.closed_lanes
            )
            return f"roadworks on {', '.join(measure.places)}: {', '.join(parts)}"
        case LaneIncident():
            return f"broken-down vehicle on lane {measure.lane} at s {measure.s:g} m"
        case SpeedLimit():
            return f"speed limit {measure.speed * 3.6:.0f} km/h: {where}"
        case ChangedPermission():
            who = ", ".join(category.value for category in measure.allowed or measure.banned)
            return f"{'only' if measure.allowed else 'no'} {who}: {where}"
        case SignalOutage():
            return f"traffic light {measure.junction} {measure.shows}"
    return measure.id
