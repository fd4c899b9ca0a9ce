"""What goes over the wire about runs; see :mod:`odscen.web.messages`."""

from __future__ import annotations

from typing import Annotated, Literal, TypeVar

from pydantic import ConfigDict, Field
from pydantic.json_schema import SkipJsonSchema

from odscen.base.categories import Category
from odscen.learning.offered_options import OptionValue
from odscen.records.outcomes import ActorStatus
from odscen.records.run_events import EventKind
from odscen.web.messages import Answer, Name, RequestBody
from odscen.web.wire.summary_messages import RunSummary

RunState = Literal[
    "preparing", "running", "paused", "finishing", "completed", "stopped", "failed", "interrupted"
]


class ChosenBehaviour(RequestBody):
    """An installed behaviour model by its name, and options that differ from its usual ones."""

    name: Annotated[str, Field(min_length=1, max_length=200)]
    options: Annotated[dict[str, OptionValue], Field(max_length=100)] = Field(default_factory=dict)


class ChosenSimulator(ChosenBehaviour):
    """An installed simulator by its name, and options that differ from its usual ones."""


class NewRun(RequestBody):
    """Run a scenario as it is now.

    ``until``, ``seed`` and ``step_length`` stand in for the scenario's own. ``speed`` is in
    simulated seconds per second, ``None`` as fast as it can; a ``paused`` run makes one step.
    Places of road users are recorded ``every`` so many seconds, ``None`` with each step, unless
    ``trajectories`` is false. With ``carla`` it is shown on the CARLA server too, step by step, and
    recorded whole. Vehicles are driven by a ``behaviour`` model, ``None`` for SUMO's drivers.
    A ``simulator`` plays it instead of SUMO.
    """

    scenario: Name
    until: Annotated[float, Field(gt=0, le=1e6)] | None = None
    seed: Annotated[int, Field(ge=0, lt=2**31)] | None = None
    step_length: Annotated[float, Field(ge=0.01, le=1)] | None = None
    speed: Annotated[float, Field(ge=0.01, le=1000)] | None = None
    paused: bool = False
    trajectories: bool = True
    every: Annotated[float, Field(gt=0, le=3600)] | None = None
    carla: bool = False
    behaviour: ChosenBehaviour | None = None
    simulator: ChosenSimulator | None = None


class GoOn(RequestBody):
    """Go on with an interrupted run; ``speed`` as in :class:`NewRun`."""

    speed: Annotated[float, Field(ge=0.01, le=1000)] | None = None


class RunForecast(Answer):
    """What a run will need, roughly: bytes, and how many will be on the road at a time at most.

    ``free`` is what the disk has; ``planned`` is how many set out in all.
    """

    planned: int
    running: int
    disk: int
    memory: int
    free: int


class RunSlices(Answer):
    """Slices of a long run: what was simulated up to ``time`` cannot be lost any more.

    ``done`` is how many are complete, of ``length`` seconds each.
    """

    done: int
    length: float
    time: float


class RunStarted(Answer):
    """The run's id."""

    run: str


class RunControl(RequestBody):
    """Steer a run. ``speed`` (with action ``speed``) as in :class:`NewRun`.

    ``interrupt`` ends a long run at once, so that it can go on later.
    """

    action: Literal["pause", "resume", "step", "speed", "stop", "interrupt"]
    speed: Annotated[float, Field(ge=0.01, le=1000)] | None = None


class RunProgress(Answer):
    """How far a run is; ``time_left`` in wall seconds at full speed, if it can be told."""

    time: float
    until: float
    running: int
    departed: int
    arrived: int
    planned: int
    time_left: float | None = None


class RunInfo(Answer):
    """A run, going on or finished; ``summary`` is that of ``summary.json``.

    ``finished`` is when its results were written, in seconds since 1970. ``preparing`` says how far
    routes by travel time have been found before it begins. ``carla`` says that it is
    shown on a CARLA server, whose camera can then be watched. A long run that has not ended has
    ``slices``; one that is ``interrupted`` can go on from the last of them. ``clock`` is the time
    of day at the start, seconds, while the server still has the scenario (see ``RunContent``).
    """

    run: str
    state: RunState
    scenario: str
    map: str | None
    speed: float | None = None
    progress: RunProgress | None = None
    summary: RunSummary | None = None
    error: str | None = None
    finished: float | None = None
    carla: bool = False
    slices: RunSlices | None = None
    preparing: str | None = None
    clock: float | None = None


class RunFile(Answer):
    """A file of a run that can be downloaded; ``size`` in bytes."""

    name: str
    size: int


class FitRow(Answer):
    """One count of vehicles from ``begin`` to ``end`` (seconds) and what a run made of it.

    ``x`` and ``y`` are where it was counted, metres; ``why`` says why it is not met.
    """

    counts: str
    place: str
    begin: float
    end: float
    counted: float
    modelled: int
    geh: float
    met: bool
    why: str
    x: float | None = None
    y: float | None = None


class RunFit(Answer):
    """All counts of a run's scenario against the run; ``rmse`` in vehicles per slice.

    ``hours`` are those that slices of a place make up, ``hours_met`` how many of them are met.
    """

    rows: list[FitRow]
    met: int
    hours: int
    hours_met: int
    rmse: float | None
    contradictions: list[str]


class RunCurve(Answer):
    """How many are on the road, have arrived, and wait to enter, at each ``time`` in seconds."""

    time: list[float]
    running: list[float]
    arrived: list[float]
    waiting: list[float]


class RunSpeeds(Answer):
    """Speeds of all vehicles in m/s around each ``time``: mean, and 10th and 90th percentile."""

    time: list[float]
    mean: list[float | None]
    low: list[float | None]
    high: list[float | None]


class RunShares(Answer):
    """Share of all vehicle time spent between ``edges[i]`` and ``edges[i + 1]``, m/s."""

    edges: list[float]
    share: list[float]


class RunCurves(Answer):
    """What a finished run looked like over time."""

    counts: RunCurve
    speeds: RunSpeeds
    shares: RunShares


class RunContent(Answer):
    """``digest`` is the same where scenarios differ at most in name and description.

    ``counts`` is how many counts of vehicles the scenario has, ``clock`` the time of day at the
    start, seconds, 0 without one.
    """

    digest: str
    counts: int
    clock: float = 0.0


_One = TypeVar("_One")
_IfKnown = Annotated[_One | SkipJsonSchema[None], Field(exclude_if=lambda value: value is None)]
"""Left out of the message where there is nothing to say."""


class IncidentInfo(Answer):
    """Something that happened to ``actor``; see :class:`~odscen.records.run_events.Event`.

    What there is nothing to say of is left out.
    """

    model_config = ConfigDict(json_schema_serialization_defaults_required=False)

    time: float
    kind: EventKind
    actor: str
    x: _IfKnown[float] = None
    y: _IfKnown[float] = None
    lane: _IfKnown[str] = None
    partner: _IfKnown[str] = None
    error: _IfKnown[float] = None
    travel_time: _IfKnown[float] = None
    detail: _IfKnown[str] = None
    waited: _IfKnown[float] = None
    queue: _IfKnown[int] = None
    rule: _IfKnown[str] = None
    values: _IfKnown[dict[str, float]] = None


class RunEvents(Answer):
    """Incidents of a finished run, as the live view reports them; ``left_off`` were too many."""

    events: list[IncidentInfo]
    left_off: int


class EgoOutcome(Answer):
    """What became of a vehicle under test; seconds, m/s.

    ``travel_time`` and ``delay`` are known of one that arrived.
    """

    id: str
    status: ActorStatus
    travel_time: float | None
    delay: float | None
    mean_speed: float | None
    collisions: int
    emergency_stops: int
    teleports: int


class RunEgos(Answer):
    """The vehicles under test of a finished run, in the order of the scenario."""

    egos: list[EgoOutcome]


class ReplayActor(Answer):
    """A road user in a recording; metres."""

    id: str
    category: Category
    length: float
    width: float
    ego: bool


class ReplayColumns(Answer):
    """Who was where: rows ``first[i]`` up to ``first[i + 1]`` belong to ``times[i]``, seconds.

    Per row who it was (a row of ``actors``), the centre of the body (metres), its heading (radians)
    and its speed (m/s).
    """

    times: list[float]
    first: list[int]
    actor: list[int]
    x: list[float]
    y: list[float]
    hdg: list[float]
    speed: list[float]
    actors: list[ReplayActor]


class RunLanes(Answer):
    """What vehicles did on each lane in each interval of a run.

    Interval ``i`` is from ``times[i]`` to ``times[i + 1]``, seconds; rows ``first[i]`` up to
    ``first[i + 1]`` belong to it: which ``lane`` (a row of ``lengths``, metres), and the
    ``distance`` (m), ``seconds`` and ``time_loss`` (vehicle-seconds) of all vehicles on it. Lanes
    without vehicles have no row. Nodes ``node_first[k]`` up to ``node_end[k]`` of the map's graph
    lie on lane ``node_lane[k]``.
    """

    times: list[float]
    first: list[int]
    lane: list[int]
    distance: list[float]
    seconds: list[float]
    time_loss: list[float]
    lengths: list[float]
    node_first: list[int]
    node_end: list[int]
    node_lane: list[int]
