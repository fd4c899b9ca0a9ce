"""What goes over the wire as JSON, with the types that the OpenAPI schema shows.

Field names are those of the documents; units are SI; positions are in the OpenDRIVE frame.
"""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field

from odscen.base.categories import Category
from odscen.learning.offered_models import OfferedModel
from odscen.learning.offered_options import OptionKind, OptionValue
from odscen.scenario.document.scenario_document import Scenario
from odscen.simulators.assets import Age, TimeOfDay

Name = Annotated[str, Field(min_length=1, max_length=64)]
Version = Annotated[int, Field(ge=0, lt=2**53)]


class RequestBody(BaseModel):
    """Base of what a client sends: unknown fields are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Answer(BaseModel):
    """Base of what the server sends: nothing is left out, whatever has a default."""

    model_config = ConfigDict(frozen=True, json_schema_serialization_defaults_required=True)


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


class JobStarted(Answer):
    """Work has been taken on; ask for the job."""

    job: str


class DayMade(Answer):
    """A day of traffic that a scenario was given, and what it asks of the busiest junction.

    ``volume`` and ``capacity`` are vehicles per hour at ``place`` in the busiest hour, in which
    ``peak_trips`` depart. ``found`` says what was tried by runs, and is null without a trial.
    """

    trips: float
    peak_trips: float
    place: str
    volume: float
    capacity: float
    found: str | None


class JobInfo(Answer):
    """How far a job is; ``share`` from 0 to 1. ``result`` is the name of what was made.

    ``day`` is told of a day of traffic alone.
    """

    id: str
    state: Literal["queued", "running", "done", "failed", "cancelled"]
    step: str
    share: float
    error: ErrorInfo | None = None
    result: str | None = None
    day: DayMade | None = None


class BlueprintInfo(Answer):
    """A model of road user; metres."""

    id: str
    category: Category
    special_type: str
    age: Age | None
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
    time_of_day: TimeOfDay
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


class NewScenario(RequestBody):
    """Start a scenario on a map; a free name is found if none is given.

    With a ``template`` it is not empty; ``values`` are numbers that differ from the template's.
    """

    map: Name
    name: Name | None = None
    template: Name | None = None
    values: Annotated[dict[Name, float], Field(max_length=40)] = {}


class RoomQuestion(RequestBody):
    """Whether a map has room for a template; ``values`` are numbers that differ from its own."""

    map: Name
    values: Annotated[dict[Name, float], Field(max_length=40)] = {}


class RoomAnswer(Answer):
    """``reason`` says why there is no room; it is empty where there is."""

    reason: str


class TemplateNumber(Answer):
    """A number of a template; ``usual`` ``null`` follows from the others, as ``meaning`` says."""

    name: str
    title: str
    usual: float | None
    low: float
    high: float
    unit: str
    meaning: str


class TemplateInfo(Answer):
    """A scene that can be placed on maps."""

    name: str
    title: str
    summary: str
    source: str
    needs: str
    numbers: list[TemplateNumber]


class OptionInfo(Answer):
    """An option of a generator or behaviour model; ``usual`` ``null`` has to be given."""

    name: str
    kind: OptionKind
    title: str
    meaning: str
    usual: OptionValue | None
    low: float | None
    high: float | None
    choices: list[str]


class OfferedInfo(Answer):
    """A generator or behaviour model to choose; ``error`` says why it cannot be, or is empty."""

    name: str
    summary: str
    options: list[OptionInfo]
    error: str

    @classmethod
    def of(cls, offered_model: OfferedModel) -> Self:
        """What the page is told of one."""
        options = [
            OptionInfo(**{**option._asdict(), "choices": [*option.choices]})
            for option in offered_model.options
        ]
        return cls(
            name=offered_model.name,
            summary=offered_model.summary,
            options=options,
            error=offered_model.error,
        )


class OfVersion(RequestBody):
    """What is asked for holds for this version only."""

    version: Version


class NewName(RequestBody):
    """Another name."""

    name: Name


class CopyName(RequestBody):
    """Name of a copy; made from the original's if not given."""

    name: Name | None = None


class Goals(Answer):
    """Goal candidates of a spawn."""

    spawn: str
    goals: list[str]


class Path(Answer):
    """Shortest path inside the region, with [x, y] of its nodes; empty if there is none."""

    nodes: list[str]
    points: list[tuple[float, float]]


class RoiInfo(Answer):
    """Segments of the region, and those that may be added or taken out now."""

    inside: list[str]
    candidates: list[str]
    removable: list[str]


class CarlaInfo(Answer):
    """Whether the CARLA server can be used, and what to do about it, in words."""

    state: Literal["connected", "absent", "wrong_version"]
    address: str
    message: str


class EntryPlace(Answer):
    """Where vehicles can drive into the region: lanes are OpenDRIVE ids, the outermost first."""

    segment: str
    direction: Literal["forward", "backward"]
    lanes: list[int]


class WholeDay(RequestBody):
    """Give a scenario a day of traffic on its whole map.

    With a ``trial``, its busiest hour is run, and there are as many trips as it carries.
    """

    version: Version
    day: Literal["weekday", "weekend"] = "weekday"
    trips: Annotated[float, Field(ge=1, le=1e6)] = 51_000.0
    trial: bool = True
