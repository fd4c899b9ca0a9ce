"""What a foreign format is, what it is given to write, and what it gives of a file that it reads.

Modules of formats are imported to list them, so they import what is heavy when they are called.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from threading import RLock
from typing import TYPE_CHECKING, Final, Literal, NamedTuple, Protocol, TypeVar, cast

from odscen.base.errors import InputError
from odscen.base.given_files import MOST

if TYPE_CHECKING:
    from pathlib import Path

    import polars as pl

    from odscen.opendrive.road_model import OpenDrive
    from odscen.records.run_plan import PlannedActor
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.sweeps.sweep_plan import SweepPlan
    from odscen.simulators.assets import Assets
    from odscen.sumo.realize.sumo_map import SumoMap

_Made = TypeVar("_Made")
Subject = Literal["scenario", "run", "map"]
VERDICTS: Final = ("taken", "approximated", "ignored", "refused")
"""What can become of an element of a file, from the best to the worst."""
NOTES_SUFFIX: Final = ".export.json"
"""Ending of the file that says what a format cannot."""


class FormatOption(NamedTuple):
    """Something that a format lets one choose.

    Attributes
    ----------
    name
        What ``--option NAME=VALUE`` calls it.
    label
        What it is, for people.
    values
        All there are, if they can be listed; the page offers these.
    default
        The value of who does not choose.
    """

    name: str
    label: str
    values: tuple[str, ...] = ()
    default: str = ""


WINDOW_OPTIONS: Final = (
    FormatOption("begin", "Of a run: from this second on."),
    FormatOption("end", "Of a run: up to this second."),
)
"""Options of all formats that are written from a recording."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Format:
    r"""A foreign format: what command line, page and Python know of it.

    One of an installed package is an entry point of the group ``odscen.formats`` under its id; of
    odscen itself, ``FORMAT`` of a module of this package whose name ends with ``_format``.

    >>> def write_ids(source):
    ...     ids = [actor.id for actor in source.scenario.actors]
    ...     return {f"{source.name}.ids": "".join(f"{one}\n" for one in ids)}
    >>> ids = Format(
    ...     id="ids",
    ...     title="Ids",
    ...     label="ids of road users, one in a line",
    ...     of=("scenario",),
    ...     suffixes=(".ids",),
    ...     write=write_ids,
    ... )
    >>> from types import SimpleNamespace
    >>> scene = SimpleNamespace(actors=[SimpleNamespace(id="ego"), SimpleNamespace(id="van")])
    >>> ids.write(SimpleNamespace(name="cut-in", scenario=scene))
    {'cut-in.ids': 'ego\nvan\n'}

    Attributes
    ----------
    id
        What ``odscen export --to`` and ``odscen import --format`` call it.
    title
        Its name, as menus have it.
    label
        What it is, in the help.
    description
        What it is in whole sentences, on the page; the label if empty.
    of
        What its files are of. One that is written of scenarios and of runs is given either.
    suffixes
        Endings of files that are read as it. The longest that a file's name has decides.
    read
        Reads a file.
    write
        Makes the files of a scenario or a run.
    options
        What can be chosen, for reading and writing.
    checked
        Whether a scenario must be free of errors to be written.
    needs_roads
        Whether what it writes needs the road model of the map.
    choose_main
        Which of several files that were sent together is to be read; the only one with one of the
        suffixes if not given.
    """

    id: str
    title: str
    label: str
    of: tuple[Subject, ...]
    description: str = ""
    suffixes: tuple[str, ...] = ()
    read: Callable[[ImportSource], FileContent] | None = None
    write: Callable[[ExportSource], ExportFiles] | None = None
    options: tuple[FormatOption, ...] = ()
    checked: bool = True
    needs_roads: bool = False
    choose_main: Callable[[Sequence[GivenFile]], int] | None = None

    def refuse_unknown_options(self, names: Iterable[str]) -> None:
        """Raise :class:`~odscen.base.errors.InputError` if it has no option of such a name."""
        for name in names:
            if name not in {option.name for option in self.options}:
                raise InputError(f"the format {self.id} has no {name}")


# ---------------------------------------------------------------------------- writing


@dataclass(frozen=True, slots=True, eq=False)
class RecordedRun:
    """What happened in a run.

    Attributes
    ----------
    users
        Everybody who was planned, with size and height of the ground at departure.
    rows
        Trajectories of body centres, see :meth:`~odscen.runs.finished_run.Run.trajectories`.
    states
        What lights showed, see :func:`~odscen.runs.recorded.read_light_states`.
    until
        When the simulation ended, s.
    step
        Between two records, s.
    """

    users: tuple[PlannedActor, ...]
    rows: pl.DataFrame
    states: pl.DataFrame | None
    until: float
    step: float


class Kept:
    """What is made once and kept for the exports that follow, by name.

    >>> kept = Kept()
    >>> kept.made("lanes", lambda: [1, 2])
    [1, 2]
    >>> kept.made("lanes", lambda: [])
    [1, 2]
    """

    def __init__(self) -> None:
        self._made: dict[object, object] = {}
        self._lock = RLock()

    def made(self, name: object, make: Callable[[], _Made]) -> _Made:
        """What was made under a name; it is made at the first time, by one thread alone."""
        with self._lock:
            if name not in self._made:
                self._made[name] = make()
            return cast("_Made", self._made[name])


@dataclass(frozen=True, slots=True, eq=False)
class ExportSource:
    """A scenario, or a run of one, to be written.

    Attributes
    ----------
    name
        Of the scenario's file without its ending, or of the run's folder.
    scenario
        The document.
    sumo_map
        Lane graph, pedestrian graph and SUMO network of its map, with the table between them.
    map_file
        The map, as it was added.
    net
        The map's SUMO network file.
    assets
        Size of models and parameters of weather.
    options
        What was chosen, by name.
    recorded
        Of a run.
    roads
        The road model of the map, for formats that need it.
    report
        Gives the page of the run's report with a replay, of a run.
    of_map
        What formats have made of the map; all exports on one map may share it.
    of_run
        What formats have made of the run; all exports of one run may share it.
    """

    name: str
    scenario: Scenario
    sumo_map: SumoMap
    map_file: Path
    net: Path
    assets: Assets
    options: Mapping[str, str] = field(default_factory=dict)
    recorded: RecordedRun | None = None
    roads: OpenDrive | None = None
    report: Callable[[], str] | None = None
    of_map: Kept = field(default_factory=Kept)
    of_run: Kept = field(default_factory=Kept)


ExportFiles = Mapping[str, "str | bytes | Path"]
"""By name: the content of a file, or a file that is copied."""


@dataclass(slots=True)
class ExportNotes:
    """What could not be written as it is in odscen; each with its place in the document."""

    approximated: list[tuple[str, str]] = field(default_factory=list)
    left_out: list[tuple[str, str]] = field(default_factory=list)

    def files(self, name: str) -> dict[str, str]:
        """File with these notes, without repetitions, beside the files of an export."""
        notes = {
            kind: [{"place": place, "reason": reason} for place, reason in dict.fromkeys(rows)]
            for kind, rows in (("approximated", self.approximated), ("left_out", self.left_out))
        }
        return {f"{name}{NOTES_SUFFIX}": json.dumps(notes, indent=2, ensure_ascii=False) + "\n"}


# ---------------------------------------------------------------------------- reading


class GivenFile(Protocol):
    """A file to be read: of the disk, or sent to the server."""

    @property
    def name(self) -> str:
        """What a report calls it, without its folder."""

    @property
    def where(self) -> str:
        """What messages call it."""

    @property
    def on_disk(self) -> Path:
        """Where it lies, for readers that take a part of it at a time; it may not be there."""

    def read(self, *, most: int = MOST) -> bytes:
        """Its content.

        Raises
        ------
        InputError
            If it cannot be read, or has more than so many bytes.
        """

    def other(self, named: str) -> GivenFile:
        """A file that it names, relative to its folder.

        Raises
        ------
        InputError
            If only files that were sent may be read, and that one was not.
        """

    def others(self, folders: Sequence[str], suffix: str) -> Iterator[GivenFile]:
        """All files with an ending in folders that it names."""


@dataclass(frozen=True, slots=True, eq=False)
class ImportMap:
    """A map of the workspace.

    Attributes
    ----------
    name, sha256
        As scenarios name it, and of its content.
    sumo_map
        Lane graph, pedestrian graph and SUMO network, with the table between them.
    read_roads
        Gives its road model.
    """

    name: str
    sha256: str
    sumo_map: SumoMap
    read_roads: Callable[[], OpenDrive]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ImportSource:
    """A file to be read, and what it can be read with.

    Attributes
    ----------
    name
        For the scenario: that of the file without its ending.
    file
        The file.
    find_map
        Gives the map that a file names. Which file that is matters, as its folder is searched.
    assets
        Size of models and parameters of weather.
    options
        What was chosen, by name.
    map_given
        Whether a map, or a folder of maps, was given beside the file.
    bring_network
        Makes a map of a SUMO network, of a file's name and content, or gives the one that has it.
    """

    name: str
    file: GivenFile
    find_map: Callable[[str, GivenFile], ImportMap]
    assets: Assets
    options: Mapping[str, str] = field(default_factory=dict)
    map_given: bool = False
    bring_network: Callable[[str, bytes], ImportMap] | None = None

    def map(self, named: str = "") -> ImportMap:
        """The map that was given beside the file, or else the one that it names.

        Raises
        ------
        NotFoundError
            If there is none.
        """
        return self.find_map(named, self.file)


class ReportRow(NamedTuple):
    """An element of a file that was read, and why it has its verdict.

    Attributes
    ----------
    file
        Its name.
    xpath
        The element: in XML its path, elsewhere what people find it by, such as ``row 7``.
    line
        In the file; 0 if it has no lines.
    x, y
        Place on the map that it is about, if that is known: metres in the OpenDRIVE frame.
    """

    file: str
    xpath: str
    line: int
    reason: str
    x: float | None = None
    y: float | None = None


@dataclass(slots=True)
class ElementReport:
    """What becomes of the elements of a file, for readers without a report of their own."""

    file: str
    lists: dict[str, list[ReportRow]] = field(
        default_factory=lambda: {verdict: [] for verdict in VERDICTS}
    )

    def add(self, verdict: str, element: str, reason: str = "", *, line: int = 0) -> None:
        """Add an element with one of the :data:`VERDICTS`."""
        self.lists[verdict].append(ReportRow(self.file, element, line, reason))


class FileContent(NamedTuple):
    """What a file has: a scenario, or tracks of a recording.

    Attributes
    ----------
    scenario
        The document.
    tracks
        Columns ``time`` (s), ``id``, ``x``, ``y`` (m), ``hdg`` (rad, counter-clockwise from +x) of
        body centres in the frame of the file, and what else it has of road users.
    lists
        Elements of the file by their verdict; empty of formats that are always taken whole.
    plan
        Of a sweep, if the file varies parameters.
    """

    scenario: Scenario | None = None
    tracks: pl.DataFrame | None = None
    lists: Mapping[str, Sequence[ReportRow]] = {}
    plan: SweepPlan | None = None
