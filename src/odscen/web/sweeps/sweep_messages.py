"""What goes over the wire about sweeps."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from odscen.web.messages import Answer, Name, RequestBody

SweepState = Literal["running", "done", "stopped", "failed"]
Text = Annotated[str, Field(min_length=1, max_length=200)]
Point = tuple[float, float]


class VaryWish(RequestBody):
    """A parameter that takes values from ``low`` to ``high``, or those of a set.

    ``steps`` is how many of the range a grid has, both ends included.
    """

    parameter: Name
    low: float | None = None
    high: float | None = None
    steps: Annotated[int, Field(ge=2, le=100_000)] | None = None
    values: Annotated[list[float], Field(min_length=1, max_length=10_000)] | None = None

    @property
    def data(self) -> dict[str, Any]:
        """As a plan of a sweep has it."""
        if self.values is not None:
            return {"parameter": self.parameter, "values": self.values}
        ends = {"from": self.low, "to": self.high, "steps": self.steps}
        return {"parameter": self.parameter, **ends}


class TableWish(RequestBody):
    """Parameters that take values together: each row of ``table`` has one for each of them."""

    parameters: Annotated[list[Name], Field(min_length=1, max_length=50)]
    table: Annotated[list[list[float]], Field(min_length=1, max_length=10_000)]

    @property
    def data(self) -> dict[str, Any]:
        """As a plan of a sweep has it."""
        return {"parameters": self.parameters, "table": self.table}


class SweepWish(RequestBody):
    """A sweep of a scenario as it is now; parameters that are not varied keep their values.

    ``samples`` is how many cases, of all methods but the grid, and ``sample_seed`` is of them.
    ``safe`` are limits that a safe case keeps besides no collision, ``figures`` more columns.
    ``seed`` stands in for the scenario's, ``processes`` is how many cases run at a time.
    """

    scenario: Name
    vary: Annotated[list[VaryWish | TableWish], Field(min_length=1, max_length=50)]
    method: Name = "grid"
    samples: Annotated[int, Field(ge=1, le=100_000)] | None = None
    sample_seed: Annotated[int, Field(ge=0, lt=2**31)] = 0
    safe: Annotated[tuple[Text, ...], Field(max_length=20)] = ()
    figures: Annotated[tuple[Name, ...], Field(max_length=20)] = ()
    seed: Annotated[int, Field(ge=0, lt=2**31)] | None = None
    processes: Annotated[int, Field(ge=1, le=256)] = 1

    @property
    def plan(self) -> dict[str, Any]:
        """The plan as data."""
        vary = [axis.data for axis in self.vary]
        return {
            "vary": vary, "method": self.method, "samples": self.samples, "seed": self.sample_seed,
        }  # fmt: skip


class ResumeSweep(RequestBody):
    """Go on with a sweep that was stopped."""

    processes: Annotated[int, Field(ge=1, le=256)] = 1


class PlannedSweep(Answer):
    """How many cases a sweep has, and what they will take, from a trial of ``tried``.

    ``seconds`` is wall time of all cases, null if the one that was tried takes longer than
    ``patience`` seconds; ``disk`` and ``free`` are bytes. ``without_effect`` has a sentence for
    each varied parameter that changes nothing.
    """

    cases: int
    tried: str
    case_seconds: float
    seconds: float | None
    disk: int
    free: int
    processes: int
    patience: float
    without_effect: list[str]


class SweepInfo(Answer):
    """A sweep: what is varied, and how far it is.

    ``seconds_left`` is null while nothing is known of it. ``safe`` and ``unsafe`` count cases once
    all have ended.
    """

    sweep: str
    scenario: str
    state: SweepState
    parameters: list[str]
    method: str
    cases: int
    ended: int
    seconds_left: float | None = None
    safe: int | None = None
    unsafe: int | None = None
    error: str | None = None
    changed: float


class SweepParameter(Answer):
    """What is varied."""

    name: str
    unit: str


class SweepCase(Answer):
    """One case: values of the parameters and of the columns, in their order.

    ``safe`` is null where it has not been run, and ``detail`` says why. ``collision`` is a column
    as well, 1 or 0.
    """

    case: str
    status: Literal["completed", "failed", "refused", "waiting"]
    safe: bool | None
    detail: str | None
    values: list[float]
    measures: list[float | None]


class SweepColumn(Answer):
    """A measure of cases."""

    name: str
    unit: str


class SweepCases(Answer):
    """The table of a sweep, and ends of the stretches of the boundary between safe and not."""

    sweep: str
    limits: list[str]
    parameters: list[SweepParameter]
    columns: list[SweepColumn]
    cases: list[SweepCase]
    boundary: list[tuple[Point, Point]]


class CaseName(RequestBody):
    """Name of the scenario that a case becomes; made from the sweep's if not given."""

    name: Name | None = None
