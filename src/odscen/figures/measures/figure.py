"""What a figure is: name, unit, words, source, and the function that computes it."""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from odscen.base.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    import polars as pl

    from odscen.figures.by_place.parking_use import ParkingUse
    from odscen.figures.by_place.traffic import TableName, TrafficFigures
    from odscen.figures.measures.summary import ActorOutcome


_CONVERSIONS: dict[str, dict[str, float]] = {
    "s": {"s": 1.0, "min": 60.0, "h": 3600.0},
    "m/s2": {"m/s2": 1.0},
    "m/s3": {"m/s3": 1.0},
    "m": {"m": 1.0, "cm": 0.01, "km": 1000.0},
    "m/s": {"m/s": 1.0, "km/h": 1.0 / 3.6},
    "km": {"km": 1.0, "m": 0.001},
    "kg": {"kg": 1.0, "g": 0.001, "t": 1000.0},
    "g": {"g": 1.0, "mg": 0.001, "kg": 1000.0},
}
"""Factor to the unit of a figure, by that and the unit that is written."""


def in_unit(value: float, written: str, unit: str, *, name: str) -> float:
    """``value``, given in the unit ``written``, in ``unit``; "" is ``unit`` itself.

    Parameters
    ----------
    name
        Of the figure, for the error.

    Raises
    ------
    InputError
        If ``written`` is no unit for what ``unit`` measures.
    """
    if written in ("", unit):
        return value
    known = _CONVERSIONS.get(unit, {unit: 1.0} if unit else {})
    if written not in known:
        close = difflib.get_close_matches(written, known, n=1)
        hint = f"; did you mean {close[0]}?" if close else ""
        units = ", ".join(known) if known else "no unit"
        raise InputError(f"{name} is written in {units}, not in {written!r}{hint}")
    return value * known[written]


Values = dict[str, float | None]
"""Figures of a run by name, in their units; ``None`` where there is no such value."""

FigureKind = Literal["run", "segment", "junction", "actor"]
"""What a figure is of."""


class Better(StrEnum):
    """In which direction a figure is better."""

    LOWER = "lower"
    HIGHER = "higher"
    NEITHER = "neither"


class Basis(StrEnum):
    """What a run has to have recorded for a figure."""

    ACTORS = "actors"
    ROADS = "roads"
    TRIPS = "trips"
    CONFLICTS = "conflicts"
    SIGNALS = "signals"
    STOPS = "stops"
    PARKING = "parking"
    MOTION = "motion"


class SummaryPart(StrEnum):
    """Parts of ``summary.json`` that hold figures; ``actors`` are counts of actors."""

    RUN = ""
    ACTORS = "actors"
    FIGURES = "figures"


class ReportSection(StrEnum):
    """Sections of the report with cards of figures."""

    KEY_FIGURES = "key figures"
    PEDESTRIANS = "pedestrians"
    CONFLICTS = "conflicts"
    SIGNALS = "traffic lights"
    TRANSIT = "public transport"
    PARKING = "parking"
    MOTION = "motion"


@dataclass(frozen=True, slots=True)
class Display:
    """How the report and the page write a value: times ``factor``, in ``unit``.

    ``clock`` is for seconds: minutes and hours where there are some.
    """

    unit: str
    factor: float = 1.0
    digits: int = 1
    clock: bool = False


CLOCK = Display("s", clock=True)
KMH = Display("km/h", 3.6)
CM = Display("cm", 100.0)
COUNT = Display("", digits=0)


@dataclass(frozen=True, eq=False)
class RunData:
    """What is known of a run that has ended: all that a figure can be computed from.

    Attributes
    ----------
    outcomes
        What has become of each planned actor.
    traffic
        Figures by place and time; ``None`` if nothing was measured on lanes.
    trips
        One row per vehicle and person who departed, from
        :func:`odscen.runs.recorded.read_trips`; ``None`` without.
    conflicts
        From :func:`odscen.figures.measures.conflicts.conflict_table`; ``None`` if criticality was
        not measured.
    end
        Simulated seconds; ``None`` if unknown.
    signals
        One row per signal group, from :func:`odscen.figures.measures.signal_use.signal_use`;
        ``None`` if the map has no lights.
    visits
        One row per visit of a stop, from :func:`odscen.runs.recorded.read_visits`; ``None``
        if the scenario has no lines of public transport.
    parking
        Use of parking areas; ``None`` if no trip parks.
    motion
        From :func:`odscen.figures.measures.motion.check_motion`; ``None`` if trajectories were not
        recorded, or too seldom.
    stations
        From :func:`odscen.figures.by_place.station_figures.station_figures`; ``None`` if the study
        has none, or trajectories were not recorded.
    """

    outcomes: Sequence[ActorOutcome] = ()
    traffic: TrafficFigures | None = None
    trips: pl.DataFrame | None = None
    conflicts: pl.DataFrame | None = None
    end: float | None = None
    signals: pl.DataFrame | None = None
    visits: pl.DataFrame | None = None
    stations: pl.DataFrame | None = None
    parking: ParkingUse | None = None
    motion: pl.DataFrame | None = None

    @cached_property
    def kept(self) -> dict[str, Any]:
        """What figures have been computed, and what several of them are made of, by name."""
        return {}

    @cached_property
    def vehicles(self) -> Sequence[ActorOutcome]:
        """Outcomes of the planned vehicles."""
        return [outcome for outcome in self.outcomes if outcome.category != "pedestrian"]

    @cached_property
    def pedestrians(self) -> Sequence[ActorOutcome]:
        """Outcomes of the planned pedestrians."""
        return [outcome for outcome in self.outcomes if outcome.category == "pedestrian"]

    @cached_property
    def network(self) -> Mapping[str, Any]:
        """The network's row over the whole run, see :class:`TrafficFigures`; empty without."""
        return {} if self.traffic is None else self.traffic.whole["network"].row(0, named=True)

    def has(self, basis: Basis) -> bool:
        """Whether the run has recorded it."""
        return {
            Basis.ACTORS: True,
            Basis.ROADS: self.traffic is not None,
            Basis.TRIPS: self.trips is not None,
            Basis.CONFLICTS: self.conflicts is not None,
            Basis.SIGNALS: self.signals is not None,
            Basis.STOPS: self.visits is not None,
            Basis.PARKING: self.parking is not None,
            Basis.MOTION: self.motion is not None,
        }[basis]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Figure:
    """What is said of any figure.

    Attributes
    ----------
    unit
        Of its values: s, m, m/s, ..., or "" for counts and ratios.
    label
        For people, as the field calls it.
    definition
        One sentence.
    source
        Who defines or measures it.
    tolerance
        By how much it may differ from a baseline, as it may be written in a suite.
    """

    kind: ClassVar[FigureKind] = "run"

    name: str
    unit: str
    label: str
    definition: str
    source: str
    better: Better = Better.NEITHER
    tolerance: str = "2 %"
    display: Display | None = None

    @property
    def shown(self) -> Display:
        """How the report and the page write it."""
        return self.display or Display(self.unit, digits=2)

    def written(self, value: float, *, digits: int = 2) -> str:
        """``"12.50 s"``: a value in the figure's unit; without decimals where it has none."""
        if not self.unit:
            return f"{value:.{digits}f}".rstrip("0").rstrip(".")
        return f"{value:.{digits}f} {self.unit}"

    def in_unit_of(self, value: float, unit: str) -> float:
        """``value``, written in ``unit``, in the figure's unit; "" is that unit.

        Raises
        ------
        InputError
            If the figure cannot be measured in ``unit``.
        """
        return in_unit(value, unit, self.unit, name=self.name)

    def improves(self, difference: float | None) -> bool | None:
        """Whether a value that is larger by ``difference`` is better; ``None`` if neither."""
        if self.better is Better.NEITHER or not difference:
            return None
        return (difference > 0) == (self.better is Better.HIGHER)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RunFigure(Figure):
    """A figure of a whole run.

    Attributes
    ----------
    compute
        Its value, in ``unit``; is asked only where the run has recorded ``basis``.
    part
        Where ``summary.json`` has it.
    section
        Of the report, where it has a card; ``None`` for none.
    note
        Below the value on the card, perhaps from the other figures of the run.
    limit
        What is recorded at all: this value says only that it is no worse.
    alarming
        Whether it should be none: the card is red otherwise.
    on_page
        Whether the page shows it with the results of a run.
    """

    compute: Callable[[RunData], float | None]
    basis: Basis = Basis.ACTORS
    part: SummaryPart = SummaryPart.FIGURES
    section: ReportSection | None = None
    note: str | Callable[[Mapping[str, Any]], str] = ""
    limit: float | None = None
    alarming: bool = False
    on_page: bool = False

    @property
    def count(self) -> bool:
        """Whether it counts actors, so that it is also a share of the planned ones."""
        return self.part is SummaryPart.ACTORS

    def of_summary(self, summary: Mapping[str, Any]) -> float | None:
        """Its value in ``summary.json``; ``None`` if the run does not have it."""
        values = (summary.get(self.part) or {}) if self.part else summary
        value = values.get(self.name)
        return float(value) if isinstance(value, int | float) else None


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SegmentFigure(Figure):
    """A figure of each segment over the whole run; ``column`` makes it of those of its table.

    ``tells`` is the one that says how well traffic moves there.
    """

    kind: ClassVar[FigureKind] = "segment"
    table: ClassVar[TableName] = "segments"

    column: Callable[[], pl.Expr]
    tells: bool = False


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class JunctionFigure(SegmentFigure):
    """A figure of each junction over the whole run."""

    kind: ClassVar[FigureKind] = "junction"
    table: ClassVar[TableName] = "junctions"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ActorFigure(Figure):
    """A figure of each actor that is no member of a flow."""

    kind: ClassVar[FigureKind] = "actor"

    compute: Callable[[ActorOutcome], float | None]


@dataclass(frozen=True, slots=True, kw_only=True)
class TableColumn:
    """A column of the tables by place and time."""

    name: str
    unit: str
    definition: str
    whole: bool = False
    """Whether its values are whole numbers."""


def mean(values: Sequence[float | None]) -> float | None:
    """Mean of the values that are known; ``None`` of none."""
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if known else None


def largest(values: Sequence[float | None]) -> float | None:
    """Largest of the values that are known; ``None`` of none."""
    return max((value for value in values if value is not None), default=None)
