"""What a run is planned to do: the value that passes from preparation to run, figures and report.

A :class:`Plan` is written beside the SUMO files, so that a run can be judged, and repeated, from
its folder alone. Poses are body centres in the OpenDRIVE frame; metres, radians, seconds, m/s.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Literal, Self, TypeVar

from odscen.base.stored_files import stored_document, typed_rows
from odscen.records.row_text import VERSION, field_defaults, json_with_rows, without_defaults

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping


StationKind = Literal["detector", "section", "cordon"]
StationLine = tuple[tuple[str, float], ...]
"""SUMO lanes and metres along them."""


@dataclass(frozen=True, slots=True)
class PlannedStation:
    """A station of the scenario's study.

    Attributes
    ----------
    first, second
        Lines: of a detector where it lies, and none; of a section its begin and end; of a cordon
        its entries and exits.
    """

    id: str
    kind: StationKind
    first: StationLine
    second: StationLine = ()

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """Inverse of ``dataclasses.asdict``, after JSON too."""
        lines = (
            tuple((str(lane), float(pos)) for lane, pos in data[name])
            for name in ("first", "second")
        )
        return cls(str(data["id"]), data["kind"], *lines)


_Row = TypeVar("_Row")

PLAN_FORMAT = "odscen-plan"


@dataclass(frozen=True, slots=True)
class PlannedActor:
    """One road user that the run is to insert; those of flows are listed one by one.

    Attributes
    ----------
    id
        Id in SUMO: the actor's id, or ``<flow>.<k>``.
    x, y, z, hdg
        Body centre at departure, lateral offset included, OpenDRIVE frame.
    speed
        Desired speed, ``None`` for the limit.
    speed_factor
        Drawn for this actor; multiplies the speed limit (vehicles) or the walking speed.
    route_length
        Metres from the spawn node to the goal along the lane graph.
    free_flow_time
        Seconds of the route at the desired speed without other traffic; ``None`` if unknown.
    flow
        Id of the flow it belongs to, if any.
    problem
        Why it is not in the SUMO files, if it is not.
    informed
        Whether it looks for quicker routes on the way.
    begins_in, ends_in
        Parking areas of its trip: ``depart`` is when it is to leave its place, and it has arrived
        when it takes one.
    appears
        Whether a rule lets it appear; until then it is not due, and ``depart`` is the run's end.
    from_file
        Whether it comes from a file of a SUMO project: where on its first edge it departs is
        SUMO's choice.
    """

    id: str
    category: str
    spawn: str
    goal: str | None
    depart: float
    length: float
    width: float
    x: float
    y: float
    z: float
    hdg: float
    speed: float | None = None
    speed_factor: float = 1.0
    route_length: float | None = None
    free_flow_time: float | None = None
    model: str | None = None
    flow: str | None = None
    ego: bool = False
    problem: str | None = None
    informed: bool = False
    begins_in: str | None = None
    ends_in: str | None = None
    appears: bool = False
    from_file: bool = False

    @property
    def person(self) -> bool:
        """Whether SUMO runs it as a person."""
        return self.category == "pedestrian"


@dataclass(frozen=True, slots=True)
class PlannedMeasure:
    """A measure of the scenario as reports tell it; ``end`` is at most the end of the run.

    ``lines`` are the centre lines of its lanes, x and y in turn, or one place.
    """

    id: str
    kind: str
    words: str
    begin: float
    end: float
    lines: tuple[tuple[float, ...], ...] = ()


@dataclass(frozen=True, slots=True)
class PlannedParking:
    """A parking area: its segment, how many places it has, and where its middle is, metres."""

    id: str
    segment: str
    places: int
    x: float
    y: float


def begin_area(area: str) -> str:
    """Id by which SUMO knows the places of a parking area that trips begin in."""
    return f"{area}.begin"


@dataclass(frozen=True, slots=True)
class ClosedPeriod:
    """From ``begin`` to ``end`` (s) vehicles of ``vclass`` cannot pass between these edges.

    Attributes
    ----------
    ends
        Closed edges before which trips to them end.
    waits
        Closed edges before which those who are bound for them wait, and until when (s).
    """

    begin: float
    end: float
    vclass: str
    pairs: tuple[tuple[str, str], ...]
    ends: tuple[str, ...] = ()
    waits: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True, slots=True)
class Plan:
    """What a run is to do.

    Attributes
    ----------
    until, step_length
        Seconds.
    net_offset
        What is added to OpenDRIVE x and y to give SUMO's.
    elevation
        Whether the network has heights.
    slice_length
        Seconds after which the state is saved and the run goes on from what was saved; ``None``
        for a run in one piece.
    trajectories
        Whether they are recorded.
    measures
        Of the scenario, by begin.
    closed
        What they close, by begin: who would pass there must find another route.
    warm_up, interval
        What of the run is analysed, s.
    clock
        Time of day at its start, s after midnight; 0 if the scenario has none.
    stations
        Of its study.
    parking
        Areas, where trips park.
    criteria
        Of the scenario: what must come out for the run to pass.
    scene
        Whether its rules and criteria are what it is about, and not traffic.
    after_story
        Seconds after the end of its story at which the run ends; ``None``: it goes on.
    awaits
        Actors who must have arrived before that, as criteria ask about their arrival.
    """

    scenario: str
    seed: int
    until: float
    step_length: float
    net_offset: tuple[float, float]
    actors: tuple[PlannedActor, ...]
    elevation: bool = False
    slice_length: float | None = None
    trajectories: bool = True
    measures: tuple[PlannedMeasure, ...] = ()
    closed: tuple[ClosedPeriod, ...] = ()
    warm_up: float = 0.0
    interval: float | None = None
    clock: float = 0.0
    stations: tuple[PlannedStation, ...] = ()
    parking: tuple[PlannedParking, ...] = ()
    criteria: tuple[str, ...] = ()
    scene: bool = False
    after_story: float | None = None
    awaits: tuple[str, ...] = ()

    def to_json(self) -> str:
        """One actor per line; the same plan gives the same text."""
        head: dict[str, Any] = {
            "format": PLAN_FORMAT,
            "version": VERSION,
            "scenario": self.scenario,
            "seed": self.seed,
            "until": self.until,
            "step_length": self.step_length,
            "net_offset": list(self.net_offset),
            "elevation": self.elevation,
            "slice_length": self.slice_length,
            "trajectories": self.trajectories,
        }
        if self.measures:
            head["measures"] = [asdict(measure) for measure in self.measures]
            head["closed"] = [without_defaults(period, _CLOSED_DEFAULTS) for period in self.closed]
        data: dict[str, Any] = {
            "warm_up": self.warm_up,
            "interval": self.interval,
            "clock": self.clock,
        }
        data["stations"] = [asdict(station) for station in self.stations]
        data["parking"] = [asdict(parking) for parking in self.parking]
        data["criteria"] = list(self.criteria)
        data["scene"], data["awaits"] = self.scene, list(self.awaits)
        head |= {name: value for name, value in data.items() if value}
        if self.after_story is not None:
            head["after_story"] = self.after_story
        return json_with_rows(
            head, "actors", [without_defaults(actor, _DEFAULTS) for actor in self.actors]
        )

    @classmethod
    def from_json(cls, text: str) -> Plan:
        """Inverse of :meth:`to_json`.

        Raises
        ------
        InputError
            If it is not a plan of this version.
        """
        with stored_document(
            text, form=PLAN_FORMAT, version=VERSION, what="a plan of a run"
        ) as data:
            x, y = data["net_offset"]
            data["net_offset"] = (float(x), float(y))
            data["actors"] = tuple(map(_PLANNED_ACTOR, data["actors"]))
            data["measures"] = _make_nested(_PLANNED_MEASURE, data.get("measures", ()), "lines")
            data["closed"] = _make_nested(
                _CLOSED_PERIOD, data.get("closed", ()), "pairs", "ends", "waits"
            )
            data["stations"] = tuple(map(PlannedStation.from_dict, data.get("stations", ())))
            data["parking"] = tuple(map(_PLANNED_PARKING, data.get("parking", ())))
            data["criteria"] = tuple(data.get("criteria", ()))
            data["awaits"] = tuple(data.get("awaits", ()))
            return _PLAN({key: data[key] for key in data.keys() - {"format", "version"}})


def _make_nested(
    make: Callable[[Mapping[str, Any]], _Row], rows: Iterable[Mapping[str, Any]], *names: str
) -> tuple[_Row, ...]:
    """Make rows of which some fields, if they are there, have tuples, or tuples of tuples."""
    return tuple(
        make({**row, **{name: _lists_to_tuples(row[name]) for name in names if name in row}})
        for row in rows
    )


def _lists_to_tuples(value: Any) -> Any:
    """Lists, and those in them, as tuples."""
    return tuple(map(_lists_to_tuples, value)) if isinstance(value, list) else value


_PLANNED_ACTOR = typed_rows(PlannedActor)

_PLANNED_MEASURE = typed_rows(PlannedMeasure)

_PLANNED_PARKING = typed_rows(PlannedParking)

_CLOSED_PERIOD = typed_rows(ClosedPeriod)
_CLOSED_DEFAULTS = field_defaults(ClosedPeriod)

_PLAN = typed_rows(Plan)
_DEFAULTS = field_defaults(PlannedActor)
