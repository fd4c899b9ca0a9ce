"""What goes over the wire as JSON, with the types that the OpenAPI schema shows.

Field names are those of the documents; units are SI; positions are in the OpenDRIVE frame.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from odscen.categories import Category
from odscen.scenario.document import Scenario

Name = Annotated[str, Field(min_length=1, max_length=64)]
Version = Annotated[int, Field(ge=0, lt=2**53)]
RunState = Literal[
    "preparing", "running", "paused", "finishing", "completed", "stopped", "failed", "interrupted"
]


class Body(BaseModel):
    """Base of what a client sends: unknown fields are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Answer(BaseModel):
    """Base of what the server sends."""

    model_config = ConfigDict(frozen=True)


class ErrorInfo(Answer):
    """What is wrong: the error's type, its words, and all reasons where there are several.

    ``current`` is the newest version, where another one was expected.
    """

    kind: str
    message: str
    problems: list[str] = []
    current: int | None = None


class ErrorAnswer(Answer):
    """Body of every answer with a status of 400 or more."""

    error: ErrorInfo


class Health(Answer):
    """That the server is there."""

    version: str
    workspace: str


class MapInfo(Answer):
    """A map of the catalogue; see ``map.json`` for the fields within."""

    name: str
    sha256: str
    source: str
    opendrive: dict[str, Any]
    statistics: dict[str, Any]
    graph: dict[str, Any]
    sumo: dict[str, Any]
    report_counts: dict[str, int]
    preview: str


class MapDetails(MapInfo):
    """The same with what the map means, and its traffic lights."""

    semantics: Any
    lights: list[LightInfo]


class LightInfo(Answer):
    """A traffic light: its SUMO id, by which live states are told, and what scenarios call it.

    ``green`` are the seconds of each stage in the map's program. ``signals`` has, for each letter
    of its state, the OpenDRIVE signals that show it.
    """

    id: str
    names: list[str]
    green: list[float]
    signals: list[list[str]]


class JobStarted(Answer):
    """Work has been taken on; ask for the job."""

    job: str


class JobInfo(Answer):
    """How far a job is; ``share`` from 0 to 1. ``result`` is the name of what was made."""

    id: str
    state: Literal["queued", "running", "done", "failed"]
    step: str
    share: float
    error: ErrorInfo | None = None
    result: str | None = None


class BlueprintInfo(Answer):
    """A model of road user; metres."""

    id: str
    category: Category
    special_type: str
    age: str | None
    length: float
    width: float
    height: float


class CategoryInfo(Answer):
    """A category of road users and its usual body; metres."""

    category: Category
    length: float
    width: float
    height: float


class WeatherInfo(Answer):
    """A weather preset; parameters have CARLA's names and units."""

    name: str
    kind: str
    time_of_day: str
    parameters: dict[str, float]


class AssetsInfo(Answer):
    """The asset catalogue, and the built-in day profiles: relative shares of equal slices."""

    categories: list[CategoryInfo]
    blueprints: list[BlueprintInfo]
    weather: list[WeatherInfo]
    day_profiles: dict[str, list[float]]


class ProblemInfo(Answer):
    """One thing that is wrong with a scenario, see ``docs/scenario-format.md`` for the codes."""

    severity: Literal["error", "warning"]
    code: str
    where: str
    message: str
    nodes: list[str] = []
    segments: list[str] = []


class ScenarioRow(Answer):
    """A scenario in the list; ``error`` if its file cannot be read."""

    name: str
    title: str | None = None
    map: str | None = None
    actors: int = 0
    flows: int = 0
    modified: float
    version: int
    error: str | None = None


class ScenarioState(Answer):
    """A scenario as it is now; ``undo`` and ``redo`` name the edit that they would take or give."""

    name: str
    version: int
    document: Scenario
    problems: list[ProblemInfo]
    label: str
    undo: str | None
    redo: str | None


class NewScenario(Body):
    """Start a scenario on a map; a free name is found if none is given."""

    map: Name
    name: Name | None = None


class OfVersion(Body):
    """What is asked for holds for this version only."""

    version: Version


class NewName(Body):
    """Another name."""

    name: Name


class CopyName(Body):
    """Name of a copy; made from the original's if not given."""

    name: Name | None = None


class Goals(Answer):
    """Goal candidates of a spawn."""

    spawn: str
    goals: list[str]


class Path(Answer):
    """Shortest way inside the region, with [x, y] of its nodes; empty if there is none."""

    nodes: list[str]
    points: list[tuple[float, float]]


class RoiInfo(Answer):
    """Segments of the region, and those that may be added or taken out now."""

    inside: list[str]
    candidates: list[str]
    removable: list[str]


class NewRun(Body):
    """Run a scenario as it is now.

    ``until``, ``seed`` and ``step_length`` stand in for the scenario's own. ``speed`` is in
    simulated seconds per second, ``None`` as fast as it can; a ``paused`` run makes one step.
    Places of road users are recorded ``every`` so many seconds, ``None`` with each step, unless
    ``trajectories`` is false. With ``carla`` it is shown on the CARLA server too, step by step, and
    recorded whole.
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


class GoOn(Body):
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


class SliceInfo(Answer):
    """A slice of a long run: simulated seconds at its end, how many were on the road then, wall
    seconds of the run so far, and megabytes that it held.
    """

    time: float
    running: int
    wall_seconds: float
    memory_mb: float


class RunSlices(Answer):
    """Slices of a long run: what was simulated up to ``time`` cannot be lost any more.

    ``done`` is how many are complete, of ``length`` seconds each.
    """

    done: int
    length: float
    time: float


class CarlaInfo(Answer):
    """Whether the CARLA server can be used, and what to do about it, in words."""

    state: Literal["connected", "absent", "wrong_version"]
    address: str
    message: str


class RunStarted(Answer):
    """The run's id."""

    run: str


class Control(Body):
    """Steer a run. ``speed`` (with action ``speed``) as in :class:`NewRun`."""

    action: Literal["pause", "resume", "step", "speed", "stop"]
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

    ``finished`` is when its results were written, in seconds since 1970. ``carla`` says that it is
    shown on a CARLA server, whose camera can then be watched. A long run that has not ended has
    ``slices``; one that is ``interrupted`` can go on from the last of them.
    """

    run: str
    state: RunState
    scenario: str
    map: str | None
    speed: float | None = None
    progress: RunProgress | None = None
    summary: dict[str, Any] | None = None
    error: str | None = None
    finished: float | None = None
    carla: bool = False
    slices: RunSlices | None = None


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
    """All counts of a run's scenario against the run; ``rmse`` in vehicles per slice."""

    rows: list[FitRow]
    met: int
    rmse: float | None
    contradictions: list[str]


class DayMade(Answer):
    """A scenario that was given a day of traffic, and what that asks of the busiest junction.

    ``volume`` and ``capacity`` are vehicles per hour at ``place`` in the busiest hour, in which
    ``peak_trips`` set out.
    """

    scenario: ScenarioState
    trips: float
    peak_trips: float
    place: str
    volume: float
    capacity: float


class WholeDay(Body):
    """Give a scenario a day of traffic on its whole map."""

    version: Version
    day: Literal["weekday", "weekend"] = "weekday"
    trips: Annotated[float, Field(ge=1, le=1e6)] = 51_000.0


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

    ``counts`` is how many counts of vehicles the scenario has.
    """

    digest: str
    counts: int


class RunEvents(Answer):
    """Incidents of a finished run, as the live view tells them; ``left_off`` were too many."""

    events: list[dict[str, Any]]
    left_off: int


MapDetails.model_rebuild()
