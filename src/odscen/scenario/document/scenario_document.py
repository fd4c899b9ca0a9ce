"""The scenario document: one small JSON file, versioned, with a published schema.

Units are SI: metres, seconds, m/s; flows count per hour, as traffic engineers do, and say so in the
name. Times are seconds after the start of the run. Node, segment and map names refer to the lane
graph of one map, named with its content hash.
Rules that need the graph live in :mod:`odscen.scenario.checks.scenario_checks`, not here.

Placed actors and flows take the shortest route whatever is said here; so does traffic that is
generated from counts, for its routes are chosen to pass the count stations.

Times are seconds after the start of the run. Stations lie on nodes of the lane graph: a line across
a road is a list of nodes, one for each lane.

Words are those of GTFS and Transmodel: a line has trips, which serve stops; a trip stays at a stop
for its dwell time, and no shorter than to its scheduled departure.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, Self

from pydantic import ConfigDict, Field, WithJsonSchema, model_validator

from odscen.base.categories import Category
from odscen.scenario.document.distributions import Constant, WrittenDistribution
from odscen.scenario.document.document_parts import PRINTABLE, Identifier, Label, Part, Seconds
from odscen.scenario.document.drivers_document import Drivers
from odscen.scenario.document.measures_document import Measure
from odscen.scenario.document.rules_document import DriverName, StoryRule
from odscen.scenario.document.signals_document import Signals
from odscen.scenario.document.sumo_document import SumoProject

if TYPE_CHECKING:
    from pydantic.config import JsonDict


USUAL_DWELL = Constant(value=20.0)


class TransitStop(Part):
    """A place where vehicles of lines stop; ``node`` is in the middle of its ``length`` (metres).

    In a ``bay`` they stand beside the lane and hold up no other vehicle.
    """

    id: Identifier
    name: Annotated[str, Field(max_length=200)] = ""
    node: Label
    length: Annotated[float, Field(ge=5, le=200)] = 15.0
    bay: bool = False


class ServedStop(Part):
    """A stop on a line.

    ``after`` is the scheduled departure there, seconds after the departure of the trip; without it
    the vehicle goes on after its dwell time. ``dwell`` ``None`` is that of the line.
    """

    stop: Identifier
    after: Seconds | None = None
    dwell: WrittenDistribution | None = None


class TransitLine(Part):
    """A line: trips from the node ``start`` by its stops to the node ``goal``.

    Trips depart every ``headway`` seconds from ``begin`` until before ``end`` (``None``: the end of
    the run), or at the times ``departures``. Dwell times (s) are drawn for each trip and stop.
    """

    id: Identifier
    start: Label
    goal: Label | None = None
    stops: Annotated[tuple[ServedStop, ...], Field(min_length=1, max_length=500)]
    headway: Annotated[float, Field(ge=10, le=86_400)] | None = None
    begin: Seconds = 0.0
    end: Seconds | None = None
    departures: Annotated[tuple[Seconds, ...], Field(max_length=10_000)] = ()
    dwell: WrittenDistribution = USUAL_DWELL
    category: Category = Category.BUS
    model: Label | None = None

    @model_validator(mode="after")
    def _check_one_timetable(self) -> Self:
        if (self.headway is None) == (not self.departures):
            raise ValueError(
                f"give one of headway and departures, not {'both' if self.headway else 'none'}"
            )
        given = [stop.after for stop in self.stops if stop.after is not None]
        if any(later <= earlier for earlier, later in pairwise(given)):
            raise ValueError("scheduled departures (after) must grow from stop to stop")
        if list(self.departures) != sorted(set(self.departures)):
            raise ValueError("departures must grow, each given once")
        return self


class Transit(Part):
    """Stops and lines of a scenario."""

    stops: tuple[TransitStop, ...] = ()
    lines: tuple[TransitLine, ...] = ()


WholeSeconds = Annotated[float, Field(ge=0, le=1e9, multiple_of=1)]
Line = Annotated[tuple[Label, ...], Field(min_length=1, max_length=100)]
"""Nodes of the lane graph, one for each lane that is crossed."""


class Detector(Part):
    """Counts vehicles, their speed, and the share of the time in which one is on it."""

    id: Identifier
    nodes: Line

    @property
    def lines(self) -> tuple[tuple[str, Line], ...]:
        """Its lines, with the names of their fields."""
        return (("nodes", self.nodes),)


class TravelTimeSection(Part):
    """Measures the time from one line to another, of the vehicles that cross both."""

    id: Identifier
    begin: Line
    end: Line

    @property
    def lines(self) -> tuple[tuple[str, Line], ...]:
        """Its lines, with the names of their fields."""
        return (("begin", self.begin), ("end", self.end))


class Cordon(Part):
    """Counts the vehicles that enter and leave an area, at all the lines around it."""

    id: Identifier
    entries: Line
    exits: Line

    @property
    def lines(self) -> tuple[tuple[str, Line], ...]:
        """Its lines, with the names of their fields."""
        return (("entries", self.entries), ("exits", self.exits))


class Study(Part):
    """What of a run is analysed, and where it is measured besides.

    ``warm_up`` are seconds from the start that all figures leave out. ``interval`` is what figures
    over time are given for, 900 s for those of an hour by quarters; ``None`` leaves it to odscen.
    """

    warm_up: WholeSeconds = 0.0
    interval: Annotated[float, Field(ge=1, le=86_400, multiple_of=1)] | None = None
    detectors: tuple[Detector, ...] = ()
    sections: tuple[TravelTimeSection, ...] = ()
    cordons: tuple[Cordon, ...] = ()

    @property
    def stations(self) -> tuple[tuple[str, Detector | TravelTimeSection | Cordon], ...]:
        """All stations, with their places in the document."""
        return tuple(
            (f"study.{kind}[{index}]", station)
            for kind in ("detectors", "sections", "cordons")
            for index, station in enumerate(getattr(self, kind))
        )


EditValue = Annotated[
    Any,
    WithJsonSchema({"type": ["null", "boolean", "number", "string", "array", "object"]}),
]
"""An argument of an edit: any JSON, for what is possible is for the edit to say."""

Sha256 = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


class Variant(Part):
    """The scenario that a variant was made of, and the edits that made it.

    ``parent`` is the name of its file, ``parent_sha256`` and ``sha256`` are of the content of the
    parent and of this scenario when it was made, seed and name apart. An edit is an object with its
    ``kind`` and arguments, as :mod:`odscen.scenario.edits` has them.
    """

    parent: Label
    parent_sha256: Sha256
    sha256: Sha256
    edits: Annotated[tuple[dict[str, EditValue], ...], Field(min_length=1, max_length=5000)]


ParameterName = Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_]*$", max_length=64)]
Value = Annotated[float, Field(allow_inf_nan=False)]


class Parameter(Part):
    """A named number with its unit and the bounds between which it makes sense.

    Any number of the document may be written as a formula of parameters, ``"$gap"`` or
    ``"2 * $gap + 1"``, and so may the ``value`` of a later parameter.
    """

    value: Value
    unit: Annotated[str, Field(max_length=40)] = ""
    min: Value | None = None
    max: Value | None = None
    description: Annotated[str, Field(max_length=1000)] = ""

    @model_validator(mode="after")
    def _within_bounds(self) -> Self:
        low, high = self.min, self.max
        if low is not None and high is not None and low > high:
            raise ValueError(f"min {low:g} is above max {high:g}")
        if (low is not None and self.value < low) or (high is not None and self.value > high):
            bounds = f"{'' if low is None else f'{low:g}'}..{'' if high is None else f'{high:g}'}"
            msg = f"value {self.value:g} is outside {bounds} {self.unit}".rstrip()
            raise ValueError(msg)
        return self


RouteShare = Annotated[float, Field(gt=0, le=1e6, allow_inf_nan=False)]
"""Relative to the other routes of the same trips."""
Via = Annotated[tuple[Label, ...], Field(max_length=50)]
"""Segments that a route leads over, in this order; without any it is the usual route."""


class SharedRoutes(Part):
    """Trips from ``origin`` to ``destination`` are dealt out to routes by fixed shares.

    Both are zones or segments. Each of ``routes`` is the segments it leads over and its share.
    """

    origin: Label
    destination: Label
    routes: Annotated[tuple[tuple[Via, RouteShare], ...], Field(min_length=1, max_length=50)]


class RouteChoice(Part):
    """How trips of inputs, matrices and background traffic choose their routes.

    By ``length`` each takes the shortest. By ``travel_time`` the run is repeated, at most
    ``iterations`` times, and each time some trips change to the route that was quickest, until
    ``gap``, the share of travel time that could be saved, is small enough. Travel times are means
    of ``interval`` seconds. With a ``spread`` drivers tell routes apart only roughly: of two routes
    one of which takes longer by that share of the time, it is taken ``e`` times as rarely.

    ``informed`` is the share of drivers who look for a quicker route on the way, every ``period``
    seconds, whichever route they began with. ``shares`` deal out trips to routes beforehand.
    """

    by: Literal["length", "travel_time"] = "length"
    iterations: Annotated[int, Field(ge=1, le=100)] = 20
    gap: Annotated[float, Field(ge=0, lt=1)] = 0.01
    interval: Annotated[float, Field(ge=60, le=3600)] = 900.0
    spread: Annotated[float, Field(ge=0, le=1)] = 0.03
    informed: Annotated[float, Field(ge=0, le=1)] = 0.0
    period: Annotated[float, Field(ge=1, le=3600)] = 60.0
    shares: Annotated[tuple[SharedRoutes, ...], Field(max_length=1000)] = ()


USUAL_STAY = Constant(value=3600.0)

ParkingShare = Annotated[float, Field(ge=0, le=1)]


class TripParking(Part):
    """Shares of the cars of matrices, inputs and background that park.

    ``begin`` is the share that begin in a parking place (inputs begin at the boundary), ``end``
    the share that end in one. ``stay`` is how long a place is taken, seconds: before a trip that
    begins there, and after one that has ended there. Between zones, places are at most ``within``
    metres from where the trip would begin or end; elsewhere anywhere in the region.
    """

    begin: ParkingShare = 0.0
    end: ParkingShare = 0.0
    stay: WrittenDistribution = USUAL_STAY
    within: Annotated[float, Field(ge=10, le=10_000)] = 300.0

    @property
    def used(self) -> bool:
        """Whether any trip parks."""
        return self.begin > 0.0 or self.end > 0.0


FORMAT: Final = "odscen-scenario"
VERSION: Final = 1

_PROSE = r"^[^\x00-\x08\x0b-\x1f\x7f\ufffe\uffff]*$"

STEP_WITH_RULES: Final = 0.1
"""Seconds of a step of a scenario with rules that does not say how long steps are."""

Prose = Annotated[str, Field(max_length=10_000, pattern=_PROSE)]
Speed = Annotated[float, Field(gt=0, le=100, allow_inf_nan=False)]
InitialSpeed = Annotated[float, Field(ge=0, le=100, allow_inf_nan=False)]
Number = Annotated[float, Field(ge=0, le=1e7, allow_inf_nan=False)]
"""How many road users; a fraction is a probability."""
Share = Annotated[float, Field(gt=0, le=1e9, allow_inf_nan=False)]
"""Relative to the others."""
Mix = dict[Category, Annotated[float, Field(gt=0)]]
"""Share of each category; shares are relative, they need not sum to one."""


Criterion = Annotated[
    str,
    Field(
        max_length=200,
        pattern=r"^\s*[A-Za-z_]\w*\s*(\(\s*[^()\s]+\s*\)\s*)?(>=|<=|==|>|<)\s*[-+.0-9eE]+\s*"
        r"(%|[A-Za-z][A-Za-z/0-9]*)?\s*$",
    ),
]
"""What must come out of a run: ``NAME OP NUMBER [UNIT]``, of one actor ``NAME(ACTOR) ...``."""

_ANY_NAME = WithJsonSchema(
    {"type": "object", "additionalProperties": {"type": "number"}}, mode="serialization"
)
"""Whoever reads a document need not know which names can be written."""


class MapReference(Part):
    """The map, by name *and* content, and the spacing of the graph that node names refer to."""

    name: Label
    sha256: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
    spacing: Annotated[float, Field(gt=0, le=100)] = 2.0


class Environment(Part):
    """Weather and time of day: a preset of the asset catalogue and single values that differ."""

    preset: Label = "ClearNoon"
    parameters: Annotated[dict[Label, float], _ANY_NAME] = Field(default_factory=dict)
    affects_driving: bool = True


class BodySize(Part):
    """Bounding box of a road user, metres; without a height it has that of its category."""

    length: Annotated[float, Field(ge=0.1, le=30)]
    width: Annotated[float, Field(ge=0.1, le=5)]
    height: Annotated[float, Field(ge=0.1, le=10)] | None = None


class Actor(Part):
    """One road user, placed by hand or sampled.

    ``category`` is always given; ``model`` may name a blueprint of that category. ``goal`` ``None``
    draws one of the candidates by the scenario's seed. ``speed`` is the desired speed; ``None`` is
    the limit (vehicles) or the category's usual walking speed (pedestrians). ``lateral_offset`` is
    positive to the left of the driving direction, ``longitudinal_offset`` in it: metres from the
    node to the centre of the body. ``size`` is that of its body; ``None`` is that of its model, or
    the usual one of its category. ``style`` is a driving style or the id of a driver set of the
    scenario. ``initial_speed`` is a vehicle's speed at departure, m/s;
    ``None`` is from rest. ``via`` are nodes that its route leads through on its way to the goal, in
    their order; an open goal is one that can be reached from the last of them. ``driver`` is who
    drives a vehicle that no rule moves: SUMO, or the ``story`` alone, which keeps its initial speed
    and its lane whatever is in the way.
    """

    id: Identifier
    category: Category
    model: Label | None = None
    spawn: Label
    goal: Label | None = None
    via: Annotated[tuple[Label, ...], Field(max_length=50)] = ()
    speed: Speed | None = None
    lateral_offset: Annotated[float, Field(ge=-10, le=10)] = 0.0
    longitudinal_offset: Annotated[float, Field(ge=-10, le=10)] = 0.0
    size: BodySize | None = None
    depart: Seconds = 0.0
    initial_speed: InitialSpeed | None = None
    style: Identifier = "normal"
    ego: bool = False
    crosses_anywhere: bool = False
    ignores_red: bool = False
    driver: DriverName = "sumo"


class Flow(Part):
    """A flow of actors from one spawn node, ``per_hour`` of them from ``begin`` to ``end``.

    Pedestrian nodes take pedestrians only, lane nodes the other six. With ``goal`` ``None`` each
    actor of the flow draws its own goal from the candidates. With a ``profile``, ``per_hour`` is
    the mean of a day, and the profile says when there are more and when fewer. ``initial_speed``
    is that of its vehicles at departure, m/s; ``None`` is from rest.
    """

    id: Identifier
    spawn: Label
    goal: Label | None = None
    per_hour: Annotated[float, Field(gt=0, le=20_000)]
    begin: Seconds = 0.0
    end: Seconds = 3600.0
    mix: Mix = Field(default_factory=lambda: {Category.CAR: 1.0}, min_length=1)
    speed: Speed | None = None
    initial_speed: InitialSpeed | None = None
    profile: Identifier | None = None


class Zone(Part):
    """Segments that demand calls by one name."""

    id: Identifier
    segments: Annotated[tuple[Label, ...], Field(min_length=1)]


class Profile(Part):
    """How demand is spread over a day: relative shares of equal slices, from midnight on.

    With ``begin`` and ``end``, seconds after midnight in whole minutes, the slices are of the time
    between them, and nothing comes before and after it.
    """

    id: Identifier
    shares: Annotated[tuple[Number, ...], Field(min_length=1, max_length=1440)]
    begin: Annotated[float, Field(ge=0, lt=86_400)] | None = None
    end: Annotated[float, Field(gt=0, le=86_400)] | None = None

    @model_validator(mode="after")
    def _check_not_empty(self) -> Self:
        if sum(self.shares) <= 0:
            raise ValueError("at least one share must be above 0")
        return self

    @model_validator(mode="after")
    def _whole_minutes(self) -> Self:
        if (self.begin is None) != (self.end is None):
            raise ValueError("a profile of a part of the day needs begin and end")
        if self.begin is None or self.end is None:
            return self
        if self.end <= self.begin:
            raise ValueError("the profile ends before it begins")
        piece = (self.end - self.begin) / len(self.shares)
        if self.begin % 60.0 or self.end % 60.0 or piece % 60.0:
            raise ValueError("begin, end and slices of a profile must be whole minutes")
        return self

    @property
    def seconds(self) -> float:
        """Of the part of the day that it describes; over these its mean is that of the demand."""
        return 86_400.0 if self.begin is None or self.end is None else self.end - self.begin

    @property
    def of_day(self) -> tuple[float, ...]:
        """Shares of equal slices of the whole day."""
        if self.begin is None or self.end is None:
            return self.shares
        first = round(self.begin / 60.0)
        piece = round((self.end - self.begin) / 60.0 / len(self.shares))
        step = math.gcd(first, piece, 1440)
        day = [0.0] * (1440 // step)
        for index, share in enumerate(self.shares):
            begin = (first + index * piece) // step
            day[begin : begin + piece // step] = [share] * (piece // step)
        return tuple(day)


class Window(Part):
    """Demand between two times; ``end`` ``None`` is the end of the run.

    ``profile`` says when of that time it comes; without one no time has more than another. With
    ``arrivals`` ``random`` vehicles come as in a Poisson process, the number is that of the mean
    over many seeds; with ``even`` as many come as are said, whatever the seed.
    """

    id: Identifier
    begin: Seconds = 0.0
    end: Seconds | None = None
    profile: Identifier | None = None
    arrivals: Literal["even", "random"] = "even"
    mix: Mix = Field(default_factory=lambda: {Category.CAR: 1.0}, min_length=1)


class Matrix(Window):
    """Trips from where to where: rows of origin, destination and number.

    Origins and destinations are zones or segments. The numbers are those of the whole window.
    """

    trips: Annotated[tuple[tuple[Label, Label, Number], ...], Field(min_length=1)]


class Counts(Part):
    """Vehicles that were counted: rows of place, begin and end of the slice, and number.

    A place is one segment, or segments that are passed one after another, written
    ``r12>j54>r8``: two count those who go from one into the next, three or more a turn. Traffic is
    made that reproduces the counts, of vehicles in the shares of ``mix``; with ``use`` ``compare``
    none is, and other traffic is held against them.
    """

    id: Identifier
    use: Literal["generate", "compare"] = "generate"
    mix: Mix = Field(default_factory=lambda: {Category.CAR: 1.0}, min_length=1)
    rows: Annotated[tuple[tuple[Label, Seconds, Seconds, Number], ...], Field(min_length=1)]


class Background(Window):
    """Vehicles that come and go anywhere in the region; one of the three says how many.

    ``fill``, a share of those that fit, and ``per_km``, vehicles per kilometre of lane, are how
    many are to be on the road at a time; with a profile, on average over a day. ``trips`` is how
    many depart in the window.
    """

    fill: Annotated[float, Field(gt=0, le=1)] | None = None
    per_km: Annotated[float, Field(gt=0, le=200)] | None = None
    trips: Annotated[float, Field(gt=0, le=1e7)] | None = None

    @model_validator(mode="after")
    def _check_one_amount(self) -> Self:
        given = [name for name in ("fill", "per_km", "trips") if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(
                f"give one of fill, per_km and trips, not {' and '.join(given) or 'none'}"
            )
        return self


class VehicleInput(Window):
    """Vehicles that drive into the region at its boundary, at the speed of those before them.

    They come on the lanes that begin on ``segment``, or on some of them: ``lanes`` are ids of
    OpenDRIVE lanes. ``direction`` is needed where vehicles come in both ways, and is ``forward``
    with growing s. ``per_hour`` are all lanes together, with a ``profile`` on average over a day;
    or ``volumes`` are counted vehicles of slices of ``interval`` seconds from ``begin`` on. ``to``
    are zones or segments with their shares; without it, each draws one of the ends of the region.
    ``peak_hour_factor`` is the volume of an hour divided by four times that of its busiest quarter,
    which is the second of each hour from ``begin`` on; the other three are alike.
    """

    segment: Label
    direction: Literal["forward", "backward"] | None = None
    lanes: Annotated[tuple[int, ...], Field(max_length=40)] = ()
    per_hour: Annotated[float, Field(gt=0, le=40_000)] | None = None
    volumes: Annotated[tuple[Number, ...], Field(max_length=10_000)] = ()
    interval: Annotated[float, Field(ge=1, le=86_400)] = 900.0
    peak_hour_factor: Annotated[float, Field(ge=0.25, le=1)] | None = None
    to: Annotated[tuple[tuple[Label, Share], ...], Field(max_length=1000)] = ()

    @model_validator(mode="after")
    def _check_one_volume(self) -> Self:
        if (self.per_hour is None) == (not self.volumes):
            raise ValueError(
                f"give one of per_hour and volumes, not {'both' if self.volumes else 'none'}"
            )
        if self.volumes and self.profile is not None:
            raise ValueError(f"volumes say when vehicles come; leave profile {self.profile!r} out")
        if self.volumes and self.peak_hour_factor is not None:
            raise ValueError("volumes say when vehicles come; leave peak_hour_factor out")
        return self


class Demand(Part):
    """Traffic around the placed actors; ``clock`` is the time of day at the start, seconds.

    ``routes`` says how its trips choose their routes, ``parking`` which of them park.
    """

    clock: Annotated[float, Field(ge=0, lt=86_400)] = 0.0
    zones: tuple[Zone, ...] = ()
    profiles: tuple[Profile, ...] = ()
    inputs: tuple[VehicleInput, ...] = ()
    matrices: tuple[Matrix, ...] = ()
    counts: tuple[Counts, ...] = ()
    background: tuple[Background, ...] = ()
    routes: RouteChoice = RouteChoice()
    parking: TripParking = TripParking()

    @property
    def parts(self) -> tuple[tuple[str, VehicleInput | Matrix | Counts | Background], ...]:
        """All that puts road users on the road, with its place in the document."""
        return tuple(
            (f"demand.{kind}[{index}]", part)
            for kind in ("inputs", "matrices", "counts", "background")
            for index, part in enumerate(getattr(self, kind))
        )


AFTER_STORY = 10.0
"""Seconds for which a scene goes on after its story has ended."""
LONGEST_AFTER_STORY = 1e6
"""Seconds."""
AfterStory = Annotated[float, Field(ge=0, le=LONGEST_AFTER_STORY)] | Literal["auto", "never"]


class Simulation(Part):
    """How the scenario is run unless the command says otherwise; seconds.

    ``action_step`` is the time between decisions of a driver, where it is more than a step.
    ``lateral_resolution`` (metres) lets vehicles share a lane side by side, as two-wheelers do.
    ``teleport_after`` is how long the first vehicle of a lane may wait before SUMO teleports it; 0
    is never. ``pedestrians`` is SUMO's model: in ``striping`` they walk around each other.
    ``after_story`` is how long the run goes on once its story has ended, in seconds; ``never``: it
    goes on to its duration; ``auto``: :data:`AFTER_STORY` seconds in a scene, else ``never``.
    """

    duration: Annotated[float, Field(gt=0, le=1e9)] = 600.0
    step_length: Annotated[float, Field(gt=0, le=1)] = 0.5
    action_step: Annotated[float, Field(gt=0, le=5)] | None = None
    lateral_resolution: Annotated[float, Field(ge=0.1, le=5)] | None = None
    teleport_after: Annotated[float, Field(ge=0, le=86_400)] = 300.0
    pedestrians: Literal["striping", "nonInteracting"] = "striping"
    after_story: AfterStory = "auto"


def _first_paragraph(schema: JsonDict) -> None:
    """Leave what is for readers of Python out of the published schema."""
    schema["description"] = str(schema["description"]).partition("\n\n")[0]


class Scenario(Part):
    """The whole document.

    It is frozen: ``scenario.model_copy(update={"seed": 3})`` gives another one. Nodes and segments
    are named as in the lane graph of the map; docs/scenario-format.md describes every part.

    Attributes
    ----------
    format, version
        Which document it is.
    name, description
        For people.
    map
        Name and SHA-256 of the map, and metres between the nodes of its lane graph.
    variant
        Parent and edits, if the scenario was made as a variant of another.
    seed
        Random seed of whatever is drawn in a run, 0 to 2^31 - 1.
    roi
        Region of interest: ids of segments.
    environment
        Weather, and time of day.
    drivers
        Headway, gap acceptance and eagerness to change lanes.
    actors
        Vehicles and pedestrians, with ``spawn``, ``goal``, ``depart`` (s) and ``speed`` (m/s).
    flows
        Road users that keep coming, per hour.
    demand
        Traffic from inputs, matrices, day profiles, counts and background.
    transit
        Stops and lines of public transport.
    signals
        How traffic lights are run.
    measures
        Closures, roadworks, incidents, limits, permissions and signal outages, each with its times.
    simulation
        Duration and step length, s.
    study
        Warm-up and interval of the figures, s.
    rules
        What actors do, and when.
    criteria
        What must come out of a run for it to pass, as expectations of a suite are written.
    sumo
        Files and options of a SUMO project, which run with the scenario as they are.
    parameters
        Named numbers that others are computed from.
    formulas
        Which numbers those are: formulas by place, as :mod:`~odscen.scenario.document.formulas`
        names it. Files have a formula in the place of its number.
    """

    model_config = ConfigDict(json_schema_extra=_first_paragraph)

    format: Literal["odscen-scenario"] = FORMAT
    version: Literal[1] = VERSION
    name: Annotated[str, Field(min_length=1, max_length=120, pattern=PRINTABLE)]
    description: Prose = ""
    map: MapReference
    variant: Variant | None = None
    seed: Annotated[int, Field(ge=0, lt=2**31)] = 0
    roi: tuple[Label, ...]
    environment: Environment = Environment()
    drivers: Drivers = Drivers()
    actors: tuple[Actor, ...] = ()
    flows: tuple[Flow, ...] = ()
    demand: Demand = Demand()
    transit: Transit = Transit()
    signals: Signals = Signals()
    measures: tuple[Measure, ...] = ()
    simulation: Simulation = Simulation()
    study: Study = Study()
    rules: tuple[StoryRule, ...] = ()
    criteria: Annotated[tuple[Criterion, ...], Field(max_length=200)] = ()
    sumo: SumoProject | None = None
    parameters: dict[ParameterName, Parameter] = Field(default_factory=dict, max_length=200)
    formulas: dict[str, str] = Field(default_factory=dict)

    def __repr__(self) -> str:
        """What a person asks first; the whole has tens of kilobytes: ``model_dump()`` has it."""
        counts = {"actor": self.actors, "flow": self.flows, "rule": self.rules}
        parts = [f"{len(of)} {what}{'s'[: len(of) != 1]}" for what, of in counts.items() if of]
        what = ", ".join([*parts, f"{self.simulation.duration:g} s"])
        return f"<Scenario {self.name} on {self.map.name}: {what}>"

    __str__ = __repr__

    @property
    def by_story(self) -> tuple[Actor, ...]:
        """Actors whom the story alone drives unless a rule says otherwise."""
        return tuple(actor for actor in self.actors if actor.driver == "story")

    @property
    def is_scene(self) -> bool:
        """Whether it has rules, or vehicles that the story alone drives, and no traffic."""
        traffic = self.flows or self.demand.parts or self.transit.lines or self.sumo is not None
        return bool(self.rules or self.by_story) and not traffic

    @model_validator(mode="after")
    def _fine_steps(self) -> Self:
        """With rules, steps are short unless the document says how long."""
        if (self.rules or self.by_story) and "step_length" not in self.simulation.model_fields_set:
            fine = self.simulation.model_copy(update={"step_length": STEP_WITH_RULES})
            self.__dict__["simulation"] = fine  # frozen, but not yet handed out
        return self
