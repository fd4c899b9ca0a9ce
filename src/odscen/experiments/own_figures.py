"""Figures of a suite's own: a function of the finished run, or its distance from a recording."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, Self

from pydantic import AfterValidator, Field, model_validator

from odscen.app.figure_functions import value_of
from odscen.base.errors import InputError
from odscen.experiments.table import COLUMNS, SUITE, MeasuredRun
from odscen.experiments.tolerance import parse_tolerance
from odscen.figures.measures.figure import Better, Figure
from odscen.figures.measures.registry import names_of
from odscen.scenario.document.document_parts import Label, Part

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from odscen.maps.map_entry import MapEntry
    from odscen.runs.finished_run import Run


def _check_free_name(name: str) -> str:
    if name in names_of("run"):
        raise ValueError(f"{name} is a figure of odscen; give yours another name")
    return name


FigureName = Annotated[
    str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_]{0,63}$"), AfterValidator(_check_free_name)
]


class FigureEntry(Part):
    """``[figures.NAME]`` of a suite; files are relative to the suite.

    Attributes
    ----------
    function
        ``FILE.py:NAME``, of the finished run; or instead of it
    recording
        recorded traffic, from which the run differs by so many bits in
    of
        a kind of figures (``kinematic``, ``interactive``, ``map``, ``all``) or one of them.
    window, offset
        Part of the recording, and how it lies on the map.
    """

    function: Annotated[str, Field(pattern=r"^[^:\x00]+\.py:[A-Za-z_][A-Za-z0-9_]*$")] | None = None
    recording: Label | None = None
    of: Label = "all"
    window: Label | None = None
    offset: Label | None = None
    unit: Annotated[str, Field(max_length=20)] = ""
    label: Label | None = None
    better: Better = Better.NEITHER
    tolerance: str = "2 %"

    @model_validator(mode="after")
    def _function_or_recording(self) -> Self:
        if (self.function is None) == (self.recording is None):
            raise ValueError("give a function or a recording, and not both")
        if self.recording is not None:
            from odscen.formats.tracks.realism import check_realism_name

            try:
                check_realism_name(self.of)
            except InputError as error:
                raise ValueError(error.problem) from error
        return self


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RecordingFigure(Figure):
    """How far a run is from recorded traffic; ``source`` is its file.

    Attributes
    ----------
    of, window, offset
        As in the suite.
    """

    of: str
    window: str
    offset: str


def declared(data: Mapping[str, Any]) -> dict[str, Figure]:
    """Figures that the text of a suite declares, before it is validated, and columns of suites."""
    entries = data.get("figures")
    figures: dict[str, Figure] = {}
    for name, entry in entries.items() if isinstance(entries, dict) else ():
        given = entry if isinstance(entry, dict) else {}
        values: dict[str, Any] = {
            "name": name,
            "unit": str(given.get("unit", "")),
            "label": str(given.get("label") or name.replace("_", " ")),
            "definition": "Defined by the suite.",
            "source": str(given.get("function") or given.get("recording") or ""),
            "better": next(
                (better for better in Better if better == given.get("better")), Better.NEITHER
            ),
            "tolerance": str(given.get("tolerance", "2 %")),
        }
        if given.get("recording"):
            for key, usual in (("of", "all"), ("window", ""), ("offset", "")):
                values[key] = str(given.get(key) or usual)
            figures[name] = RecordingFigure(**values)
        else:
            figures[name] = Figure(**values)
    more = {name: column.figure for name, column in COLUMNS.items() if SUITE in column.tables}
    return figures | more


def refuse_tolerances(figures: Mapping[str, Figure]) -> None:
    """Read the tolerance of each figure.

    Raises
    ------
    InputError
        If one is none; names the figure.
    """
    for name, figure in figures.items():
        try:
            parse_tolerance(figure.tolerance, figure)
        except InputError as error:
            raise InputError(error.problem, element=f"figures.{name}.tolerance") from error


def own_values(
    figures: Mapping[str, Figure], run: Run, *, beside: Path, entry: MapEntry | None = None
) -> dict[str, float | None]:
    """Compute the figures of a finished run on a map; files are relative to ``beside``.

    Raises
    ------
    InputError
        If a function cannot be loaded, raises, or returns anything but a number or ``None``; or
        a recording cannot be read.
    """
    from odscen.app.exchange.recorded_traffic import compare_with_recording, read_recorded_traffic
    from odscen.formats.tracks.realism import divergence_of

    found: dict[str, float | None] = {}
    compared: dict[tuple[str, ...], dict[str, Any]] = {}
    for name, figure in figures.items():
        if name in COLUMNS:
            value = COLUMNS[name].value(MeasuredRun(run))
            found[name] = None if value is None else float(value)
            continue
        if isinstance(figure, RecordingFigure):
            recording = (figure.source, figure.window, figure.offset)
            if recording not in compared:
                read = read_recorded_traffic(
                    beside / figure.source, window=figure.window, offset=figure.offset
                )
                driven = read_recorded_traffic(run.folder)
                compared[recording] = compare_with_recording(driven, read, entry)
            found[name] = divergence_of(compared[recording], figure.of)
            continue
        file, _, function = figure.source.rpartition(":")

        def call(run: Run, file: Path = beside / file, function: str = function) -> object:
            return _load_function(file, function)(run)

        found[name] = value_of(call, run, source=figure.source, element=f"figures.{name}")
    return found


def own_column(name: str, function: str, *, beside: Path) -> Callable[[Run], float | None]:
    """Make a function of a finished run of ``FILE.py:NAME``; errors of :func:`own_values`.

    Raises
    ------
    InputError
        If it does not name a function of a file.
    """
    try:
        FigureEntry(function=function)
    except ValueError as error:
        raise InputError(f"{name}={function}: give the function as FILE.py:NAME") from error
    figure = Figure(
        name=name, unit="", label=name, definition="", source=function, better=Better.NEITHER,
        tolerance="2 %",
    )  # fmt: skip
    return lambda run: own_values({name: figure}, run, beside=beside)[name]


@cache
def _load_function(file: Path, name: str) -> Callable[[Run], object]:
    """Load a function from a file; the file is run once."""
    spec = importlib.util.spec_from_file_location(f"odscen_figures_{file.stem}", file)
    if spec is None or spec.loader is None:
        raise ImportError(f"{file} is no Python file")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    function: Callable[[Run], object] = getattr(module, name)
    return function
