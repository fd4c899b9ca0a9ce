"""What a run says of itself at its end: ``summary.json`` as it goes over the wire.

Runs of earlier versions lack some fields, which then have their defaults.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pydantic import Field, create_model

from odscen.figures.measures.gridlock import Incident
from odscen.figures.measures.registry import COUNTS
from odscen.figures.measures.usability import UsabilityLevel, UsabilityReason
from odscen.learning.offered_options import OptionValue
from odscen.records.outcomes import RunStatus
from odscen.web.messages import Answer

if TYPE_CHECKING:
    SummaryCounts = Answer
else:
    SummaryCounts = create_model(
        "SummaryCounts",
        __base__=Answer,
        __doc__="Actors by outcome, see ``docs/runs.md``; a failed run has ``planned`` only.",
        planned=(int, ...),
        **{name: (int | None, None) for name in COUNTS if name != "planned"},
    )


class GridlockInfo(Answer):
    """Gridlock and teleports: how often, and the first of the places."""

    jams: int
    jams_at_the_end: int
    moved_on: int = Field(title="Teleported")
    kept_out: int = Field(title="Not inserted")
    places: list[Incident]


class UsabilityInfo(Answer):
    """Whether the figures of a run can be used, in one line and reason by reason."""

    level: UsabilityLevel
    headline: str
    reasons: list[UsabilityReason] = Field(default_factory=list)


class ExpectationInfo(Answer):
    """An expectation, what came of it, and whether it was met."""

    expectation: str
    value: float | None
    passed: bool


class CriterionInfo(Answer):
    """A criterion of the scenario: ``value`` in ``unit``, and when it came about, s."""

    criterion: str
    words: str
    value: float | None
    unit: str
    passed: bool
    time: float | None


class SliceInfo(Answer):
    """A slice of a long run: its end, and what it took up to there; megabytes."""

    time: float
    running: int
    steps: int
    wall_seconds: float
    memory_mb: float


class SlicesInfo(Answer):
    """Slices that are complete, up to ``time`` in seconds."""

    time: float
    done: list[SliceInfo]


class RunSummary(Answer):
    """Key figures of a run that has ended; seconds, metres, m/s.

    ``figures`` are those of ``docs/runs.md`` by name, null where there was nothing to measure.
    ``driven_by`` says who moved the actors, if not SUMO, and ``behaviour`` which model drove its
    vehicles, if any. ``files`` are relative to the run's folder.
    """

    format: str
    version: int
    usable: UsabilityInfo | None = None
    status: RunStatus
    error: str | None = None
    stopped: bool = False
    scenario: str
    map: str | None = None
    map_sha256: str | None = None
    meso: bool = False
    scene: bool = False
    driven_by: str | None = None
    behaviour: str | None = None
    behaviour_options: dict[str, OptionValue] = Field(default_factory=dict)
    seed: int
    until: float
    step_length: float
    sim_seconds: float | None = None
    steps: int | None = None
    wall_seconds: float
    real_time_factor: float | None = None
    actors: SummaryCounts
    insertion_error_max: float | None = None
    figures: dict[str, float | None] = Field(default_factory=dict)
    gridlock: GridlockInfo | None = None
    criteria: list[CriterionInfo] = Field(default_factory=list)
    expectations: list[ExpectationInfo] = Field(default_factory=list)
    problems: list[str] = Field(default_factory=list)
    notes: list[str] = Field(default_factory=list)
    files: dict[str, str] = Field(default_factory=dict)
    versions: dict[str, str] = Field(default_factory=dict)
    slices: SlicesInfo | None = None
