"""A finished run, read from its folder."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from html import escape
from typing import TYPE_CHECKING, Any, Literal, Protocol, Self, get_args, get_type_hints

from odscen.base.errors import InputError, NotFoundError, in_file
from odscen.base.given_files import as_path
from odscen.figures.by_place.lane_places import LanePlaces
from odscen.figures.measures.figure import Basis, SummaryPart
from odscen.figures.measures.motion import read_motion
from odscen.figures.measures.registry import names_of, run_figure
from odscen.figures.measures.summary import ActorOutcome, actors_from_json
from odscen.figures.measures.traffic_files import places_from_json, read_stations, read_tables
from odscen.records.outcomes import RunStatus
from odscen.records.replay import body_centres
from odscen.records.run_events import Event, events_from_json
from odscen.records.run_plan import Plan
from odscen.runs import layout
from odscen.runs.deferred_figures import checked_summary, figure_of_actors, measured_summary
from odscen.runs.ended import RECORDS_ONLY
from odscen.runs.measured import measure_motion
from odscen.runs.recorded import read_trajectories

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    import polars as pl

    from odscen.base.given_files import GivenPath
    from odscen.drawing.map_drawing import MapDrawing
    from odscen.drawing.map_sheet import Picture
    from odscen.figures.by_place.traffic import TableName
    from odscen.figures.measures.figure import RunFigure

PlaceKind = Literal["network", "segment", "junction", "movement", "lane_group"]
_TABLES: dict[PlaceKind, TableName] = {
    "network": "network",
    "segment": "segments",
    "junction": "junctions",
    "movement": "movements",
    "lane_group": "lane_groups",
}


_SHOWN = ("planned", "arrived", "collided", "teleported", "mean_delay", "mean_speed")
"""Figures that a notebook shows."""


class _DrawnMap(Protocol):
    """A map that can be drawn; the map of the catalogue is one, which is above this floor."""

    def drawing(self) -> MapDrawing: ...


@dataclass(frozen=True, slots=True, repr=False)
class Run:
    """A run that has ended: what became of it, what was measured, what was recorded.

    Tables are :class:`polars.DataFrame` and read from the folder when asked for. Positions are
    metres in the OpenDRIVE frame (x east, y north), times are simulated seconds, speeds m/s.

    Attributes
    ----------
    folder
        Its folder, with all files.
    known
        As in ``summary.json``: ``status``, ``seed``, ``sim_seconds``, counts of ``actors``,
        ``figures``, ``expectations``, ``problems``, ``versions`` and more. With ``records_only``
        there are no figures yet: ``summary`` has them.

    Examples
    --------
    >>> run = Run.open(Path("runs/Town01-0007"))
    >>> run.figure("mean_delay")
    12.4
    >>> run.figures_by("junction").sort("delay", descending=True)
    """

    folder: Path
    known: Mapping[str, Any]

    @classmethod
    def open(cls, folder: GivenPath) -> Self:
        """Open the folder of a run that has ended.

        Raises
        ------
        InputError
            If no run has ended there.
        DamagedError
            If a file of it is not as it was written; its report is not looked at.
        """
        opened = as_path(folder)
        return cls(opened, checked_summary(opened, leave=(layout.REPORT_FILE,)))

    @property
    def summary(self) -> Mapping[str, Any]:
        """As in ``summary.json``; figures are computed, and written down, if they are not there.

        Raises
        ------
        InputError
            If they are not, and the records of the run are not whole any more.
        """
        if self.known.get(RECORDS_ONLY):
            # A run is frozen for its users; what is known of it only becomes more.
            object.__setattr__(self, "known", measured_summary(self.folder))
        return self.known

    @property
    def status(self) -> RunStatus:
        """``completed`` if the simulation ended by itself, whatever became of the actors."""
        return RunStatus(self.known["status"])

    @property
    def expectations_met(self) -> bool:
        """Whether every expectation has passed; true if there is none."""
        return all(verdict["passed"] for verdict in self.known["expectations"])

    @property
    def exit_code(self) -> int:
        """0 completed, 1 completed with failed expectations, 3 failed."""
        if self.status is RunStatus.FAILED:
            return 3
        return 0 if self.expectations_met else 1

    @property
    def usability(self) -> Mapping[str, Any]:
        """Whether its figures can be used: ``level``, ``headline``, ``reasons``.

        ``level`` is ``"usable"``, ``"usable with reservations"`` or ``"not usable"``. Empty for a
        run of an earlier version.
        """
        return dict(self.known.get("usable") or {})

    @property
    def counts(self) -> Mapping[str, int]:
        """How many road users were planned, inserted, arrived, teleported, ..., by name."""
        return dict(self.known["actors"])

    @property
    def figures(self) -> Mapping[str, float | None]:
        """Figures of the whole run by name; ``None`` without anything to compute one from.

        Units are those of the table of figures in docs/runs.md, for example ``mean_delay`` s and
        ``mean_speed`` m/s, with definition and source of each.
        """
        return dict(self.summary["figures"])

    def figure(self, name: str) -> float:
        """Return one figure of the run, or one of its counts, to be asserted on.

        Parameters
        ----------
        name
            Of the table of figures in docs/runs.md: ``mean_delay``, ``arrived``, ...

        Returns
        -------
        float
            In the unit of the figure.

        Raises
        ------
        NotFoundError
            If there is no figure of this name.
        InputError
            If the run has nothing to compute it from, as it failed or nobody arrived.
        """
        __tracebackhide__ = True  # pytest shows the test, not this
        entry = run_figure(name)
        if entry is None:
            raise NotFoundError("figure", name, names_of("run"))
        value = self.value_of(entry)
        if value is None:
            raise InputError(
                f"the run has no {name}: {entry.definition} It is {self.status}.",
                file=str(self.folder),
            )
        return value

    def value_of(self, figure: RunFigure) -> float | None:
        """Value of a figure of the run; ``None`` if it has nothing to compute it from.

        Those that are made of what became of the actors do not have all others computed.
        """
        waits = self.known.get(RECORDS_ONLY) and figure.part is SummaryPart.FIGURES
        if waits and figure.basis is Basis.ACTORS:
            return figure_of_actors(self.folder, self.known, figure)
        return figure.of_summary(self.summary if waits else self.known)

    def __repr__(self) -> str:
        seed, scenario = self.known.get("seed"), self.known.get("scenario")
        return f"<Run of {scenario}, seed {seed}: {self.known['status']}>"

    def _repr_html_(self) -> str:
        """What notebooks show: the verdict, the figures of note, and a picture."""
        rows = "".join(
            f"<tr><th>{escape(row['label'])}</th><td>{row['value']:.4g} {row['unit']}</td></tr>"
            for row in self.figure_table().iter_rows(named=True)
            if row["name"] in _SHOWN and row["value"] is not None
        )
        words = self.usability.get("headline", "")
        head = f"<p>{escape(repr(self))} {escape(str(words))}</p><table>{rows}</table>"
        try:
            return head + self.plot().svg
        except InputError:  # without trajectories
            return head

    def plot(self, map_entry: _DrawnMap | None = None) -> Picture:
        """Draw the mean speed of vehicles by place.

        Parameters
        ----------
        map_entry
            The map of the run, such as ``workspace.map(NAME)``, to be drawn below.

        Returns
        -------
        Picture
            Shown by notebooks; ``save`` writes it.

        Raises
        ------
        InputError
            If no trajectories of vehicles were recorded.
        """
        from odscen.drawing.map_sheet import Picture
        from odscen.reports.report_maps import speed_picture

        drawing = None if map_entry is None else map_entry.drawing()
        name = f"{self.known.get('scenario')}, seed {self.known.get('seed')}"
        svg = speed_picture(self.trajectories(), drawing, name=name)
        if svg is None:
            raise InputError("the run has no vehicles to draw", file=str(self.folder))
        return Picture(svg)

    def figure_table(self) -> pl.DataFrame:
        """List figures and counts of the run with their units; ``.to_pandas()`` is for pandas.

        Returns
        -------
        polars.DataFrame
            One row per figure: ``name``, ``label``, ``value`` (null where there is nothing to
            compute it from), ``unit`` (such as s, m/s or kg; empty of counts and shares),
            ``definition``.

        Raises
        ------
        InputError
            If the records of the run are not whole any more.
        """
        import polars as pl

        figures = [entry for name in names_of("run") if (entry := run_figure(name)) is not None]
        rows = [
            (entry.name, entry.label, self.value_of(entry), entry.unit, entry.definition)
            for entry in figures
        ]
        schema = {"name": pl.String, "label": pl.String, "value": pl.Float64}
        schema |= {"unit": pl.String, "definition": pl.String}
        return pl.DataFrame(rows, schema=schema, orient="row")

    @property
    def report(self) -> Path | None:
        """The report, an HTML file; ``None`` if none was written."""
        file = self.folder / layout.REPORT_FILE
        return file if file.is_file() else None

    def actors(self) -> pl.DataFrame:
        """What was planned for each road user and what became of it.

        Returns
        -------
        polars.DataFrame
            One row per planned road user, in the plan's order. ``id``, ``category``, ``flow``,
            ``spawn`` and ``goal`` (nodes of the lane graph), ``status`` (arrived, running,
            waiting); ``depart``, ``inserted``, ``arrived``, ``travel_time``, ``delay``,
            ``time_loss``, ``waiting_time`` (s); ``route_length`` and ``insertion_error`` (m);
            ``mean_speed`` (m/s); counts of ``stops``, ``teleports`` and ``collisions``. Null where
            it does not apply.

        Raises
        ------
        InputError
            If the run failed before it had any.
        """
        rows = actors_from_json(self._read_text(layout.ACTORS_FILE))
        return _make_table([asdict(row) for row in rows], get_type_hints(ActorOutcome))

    def events(self) -> pl.DataFrame:
        """What happened, in order of time.

        Returns
        -------
        polars.DataFrame
            One row per event: ``time`` (s), ``kind`` (departed, arrived, collision, jam_begin,
            ...), ``actor``, ``x`` and ``y`` (m; body centre of departures, front of everything
            else), ``lane`` (of SUMO), ``partner``, ``error`` (m), ``travel_time`` (s), ``detail``,
            ``waited`` (s), ``queue``, ``rule``, ``values`` (of a rule's conditions, as JSON). Null
            where it does not apply.

        Raises
        ------
        InputError
            If the run failed before it had any.
        """
        rows = events_from_json(self._read_text(layout.EVENTS_FILE))
        records = [
            row._asdict() | {"values": None if row.values is None else json.dumps(row.values)}
            for row in rows
        ]
        return _make_table(records, {**get_type_hints(Event), "values": str})

    def trajectories(self) -> pl.DataFrame:
        """Where everyone was, at every recorded time.

        Returns
        -------
        polars.DataFrame
            One row per road user and record, sorted by time: ``time`` (s), ``id``, ``category``,
            ``x``, ``y`` (m) and ``hdg`` (rad, counter-clockwise from +x) of the body centre in the
            OpenDRIVE frame, ``speed`` (m/s), and what else was recorded: ``z`` (m, of the front
            bumper), ``lane`` (of SUMO; null for pedestrians), ``pos`` (m along it), ``slope_deg``.

        Raises
        ------
        InputError
            If no trajectories were recorded.
        """
        recorded = read_trajectories(self.folder)
        if recorded is None:
            raise InputError(
                "the run has no trajectories: they were not recorded, or there were no road users",
                file=str(self.folder),
            )
        plan = Plan.from_json(self._read_text(layout.PLAN_FILE))
        return body_centres(recorded.rows, plan, by_centres=recorded.by_centres).drop("row")

    def motion(self) -> pl.DataFrame:
        """Find motion that no body or driver makes, and hard braking.

        Returns
        -------
        polars.DataFrame
            One row per finding, in order of time: ``kind`` (jump, lateral speed, ...),
            ``category``, ``id``, ``begin``, ``end`` (s), ``x``, ``y`` (m, body centre at its worst,
            OpenDRIVE frame), ``lane`` (of SUMO), ``value`` (worst) and ``bound`` in the unit of the
            kind, ``cause`` (rule, teleport and collision move by force), ``partner`` (of overlaps).

        Raises
        ------
        InputError
            If trajectories were not recorded, or more than 1 s apart.
        """
        findings = read_motion(self.folder / layout.FIGURES_FOLDER)
        if findings is None and not self.known.get("meso"):
            findings = measure_motion(self.folder)
        if findings is None:
            raise InputError(
                "motion cannot be checked: no trajectories were recorded, or more than 1 s apart",
                file=str(self.folder),
            )
        return findings

    def lane_places(self) -> LanePlaces:
        """Segment, junction and movement of each SUMO lane: tables to join trajectories with.

        Raises
        ------
        InputError
            If the run does not have them.
        """
        with in_file(str(self.folder / layout.LANE_PLACES_FILE)):
            return LanePlaces.from_json(self._read_text(layout.LANE_PLACES_FILE))

    def figures_by(self, place: PlaceKind, *, over_time: bool = False) -> pl.DataFrame:
        """Figures of traffic by place.

        Parameters
        ----------
        place
            ``network``, ``segment``, ``junction``, ``movement`` (``r1>j10>r2``) or ``lane_group``.
        over_time
            One row for each place and interval of time, instead of one for each place.

        Returns
        -------
        polars.DataFrame
            ``vehicles``, ``flow`` (veh/h), ``density`` (veh/km), ``speed`` (m/s), ``delay`` and
            ``waiting`` (s per vehicle), ``level`` of service, emissions (g) and more; places that
            no vehicle came to are left out.

        Raises
        ------
        NotFoundError
            If there is no such kind of place.
        InputError
            If traffic was not measured in this run.

        Notes
        -----
        Flow, density and speed are Edie's generalized definitions (1963), delay and levels of
        service those of the Highway Capacity Manual, 7th edition; docs/runs.md has each.
        """
        if place not in _TABLES:
            raise NotFoundError("kind of place", place, list(_TABLES))
        name, _ = _TABLES[place], self.summary  # which has them computed
        if not over_time:
            return places_from_json(self._read_text(layout.FIGURES_FILE), name)
        tables = read_tables(self.folder / layout.FIGURES_FOLDER)
        if tables is None:
            raise InputError("traffic was not measured in this run", file=str(self.folder))
        table: pl.DataFrame = getattr(tables, name)
        return table

    def stations(self) -> pl.DataFrame:
        """What the detectors, sections and cordons of the scenario's study counted.

        Returns
        -------
        polars.DataFrame
            One row for each station and interval: ``station``, ``kind``, ``begin``, ``end`` (s),
            ``vehicles``, ``flow`` (veh/h), ``speed`` (m/s), ``occupancy``, ``travel_time``,
            ``travel_time_p95`` (s), ``left``, ``balance``; null where a kind does not have it.

        Raises
        ------
        InputError
            If the study has none, or no trajectories were recorded.
        """
        _ = self.summary  # which has them computed
        table = read_stations(self.folder / layout.FIGURES_FOLDER)
        if table is None:
            raise InputError(
                "the run has no stations: its study has none, or no trajectories were recorded",
                file=str(self.folder),
            )
        return table

    def to_dict(self) -> dict[str, Any]:
        """Return the summary with the folder and absolute paths of its files."""
        files = {name: str(self.folder / file) for name, file in self.summary["files"].items()}
        if self.report is not None:  # perhaps written later
            files["report"] = str(self.report)
        return {**self.summary, "folder": str(self.folder), "files": files}

    def _read_text(self, name: str) -> str:
        try:
            return (self.folder / name).read_text(encoding="utf-8", errors="replace")
        except OSError as error:
            raise InputError(f"the run has no {name}", file=str(self.folder)) from error


def _make_table(rows: list[dict[str, Any]], hints: Mapping[str, Any]) -> pl.DataFrame:
    """Rows as a table with the same types whatever is null in it."""
    import polars as pl

    kinds = ((bool, pl.Boolean), (int, pl.Int64), (float, pl.Float64), (str, pl.String))
    schema = {}
    for name, hint in hints.items():
        own = (get_args(hint) or (hint,))[0]
        schema[name] = next(theirs for ours, theirs in kinds if issubclass(own, ours))
    return pl.DataFrame(
        [{k: str(v) if isinstance(v, str) else v for k, v in row.items()} for row in rows],
        schema=schema,
    )
