"""What goes over the wire about studies."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from odscen.figures.measures.figure import Better
from odscen.web.messages import Answer, Name, RequestBody

MOST_PAGE_RUNS = 10_000
"""Of a study that is started in the page; the command line takes more."""
StudyStatus = Literal["running", "done", "stopped", "failed"]


class StudyWish(RequestBody):
    """Scenarios as they are now, each with every weather and every seed.

    ``weather`` are presets; the scenario as designed is run as well. ``seeds`` counts from 1,
    ``until`` are simulated seconds, null for the scenarios' own, ``processes`` is how many runs are
    carried out at a time.
    """

    name: Name | None = None
    scenarios: Annotated[tuple[Name, ...], Field(min_length=1, max_length=1000)]
    seeds: Annotated[int, Field(ge=1, le=MOST_PAGE_RUNS)] = 1
    weather: Annotated[tuple[Name, ...], Field(max_length=100)] = ()
    until: Annotated[float, Field(gt=0, le=1e9)] | None = None
    processes: Annotated[int, Field(ge=1, le=256)] = 1


class ResumeStudy(RequestBody):
    """Run what is missing of a study; with ``failed`` those again that failed or were refused."""

    processes: Annotated[int, Field(ge=1, le=256)] = 1
    failed: bool = False


class StudyProblem(Answer):
    """Why so many runs failed, or were not possible."""

    words: str
    runs: int


class StudyInfo(Answer):
    """A study: what it runs, and how far it is.

    ``elsewhere`` is whether another process works on it, which this server cannot stop.
    ``seconds_left`` is null while nothing is known of it.
    """

    study: str
    state: StudyStatus
    elsewhere: bool
    scenarios: list[str]
    variants: list[str]
    seeds: int
    runs: int
    ended: int
    completed: int
    problems: list[StudyProblem]
    seconds_left: float | None = None
    error: str | None = None
    changed: float


class StudyFigure(Answer):
    """A figure that runs of a study have; ``better`` says which of two values is."""

    name: str
    label: str
    unit: str
    better: Better = Better.NEITHER


class FigureGroup(Answer):
    """A figure over the runs of a scenario and variant, or its differences from the first variant.

    The 95 % confidence interval is ``mean`` +- ``half_width``; both are null of fewer than two
    values. ``values`` has one for each run that has the figure, in the order of the study.
    """

    scenario: str
    variant: str
    runs: int
    mean: float | None
    half_width: float | None
    values: list[float]


class StudyResults(Answer):
    """One figure of a study, of all runs that have completed by now.

    ``differences`` are those of variants from the first one, ``between`` those of scenarios from
    the first one, both of runs with the same seed.
    """

    figures: list[StudyFigure]
    figure: str
    groups: list[FigureGroup]
    differences: list[FigureGroup]
    between: list[FigureGroup]
