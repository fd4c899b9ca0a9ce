"""A suite: which scenarios are run with which seeds, and what must come out. One TOML file."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import AfterValidator, Field, ValidationError

from odscen.app.scenarios import scenario_name
from odscen.base.errors import InputError, ScenarioError
from odscen.base.given_files import read_given_text
from odscen.regression.tolerance import Tolerances, parse_tolerance
from odscen.results.measures.expectations import parse_expectation
from odscen.results.measures.registry import ALL_FIGURES
from odscen.scenario.document.document_parts import Label, Part
from odscen.scenario.document.validation import validation_problems

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.convert.model.conversion_settings import ConverterName
    from odscen.regression.tolerance import Tolerance
    from odscen.results.measures.expectations import Expectation

Seeds = Annotated[
    tuple[Annotated[int, Field(ge=0, lt=2**31)], ...], Field(min_length=1, max_length=1000)
]
ToleranceTable = dict[str, str | dict[str, str]]

_PLACE_KINDS = {figure.kind for figure in ALL_FIGURES} - {"run"}


def _expectation(text: str) -> str:
    try:
        parse_expectation(text)
    except InputError as error:
        raise ValueError(error.problem) from error
    return text


def _tolerance_table(table: ToleranceTable) -> ToleranceTable:
    try:
        _tolerances(table)
    except InputError as error:
        raise ValueError(str(error)) from error
    return table


class _Settings(Part):
    """What may stand at the top, for all scenarios, or at one of them."""

    seeds: Seeds | None = None
    expect: tuple[Annotated[str, AfterValidator(_expectation)], ...] = ()
    tolerance: Annotated[ToleranceTable, AfterValidator(_tolerance_table)] = Field(
        default_factory=dict
    )
    until: Annotated[float, Field(gt=0, le=1e9)] | None = None
    step_length: Annotated[float, Field(gt=0, le=1)] | None = None


class _ScenarioEntry(_Settings):
    file: Label


class _SuiteDocument(_Settings):
    name: Label | None = None
    maps: tuple[Label, ...] = ()
    scenarios: tuple[Label, ...] = ()
    scenario: tuple[_ScenarioEntry, ...] = ()
    baselines: Label | None = None
    converter: Literal["odscen", "netconvert"] | None = None
    time_limit: Annotated[float, Field(gt=0)] | None = None


@dataclass(frozen=True, slots=True)
class Case:
    """One scenario of a suite, with everything that is set for it."""

    name: str
    file: Path
    seeds: tuple[int, ...]
    expectations: tuple[Expectation, ...]
    tolerances: Tolerances
    until: float | None
    step_length: float | None
    baseline: Path | None


@dataclass(frozen=True, slots=True)
class Suite:
    """A suite as it was read.

    Attributes
    ----------
    maps
        The .xodr files to test on.
    converter
        Who writes their SUMO networks; ``None`` is odscen for ``maps``, and for those of the
        workspace who did.
    time_limit
        Wall seconds of one run.
    """

    name: str
    file: Path
    maps: tuple[Path, ...]
    cases: tuple[Case, ...]
    time_limit: float | None
    converter: ConverterName | None = None


def read_suite(file: Path) -> Suite:
    """Read a suite; paths in it are relative to the file.

    Raises
    ------
    InputError
        If the file cannot be read, or a path in it leads nowhere.
    ScenarioError
        If it is not a suite; names every key at fault.
    """
    try:
        data = tomllib.loads(read_given_text(file))
    except (ValueError, RecursionError) as error:
        msg = f"the suite cannot be read: {error}"
        raise InputError(msg, file=str(file)) from error
    try:
        document = _SuiteDocument.model_validate(data)
    except ValidationError as error:
        msg = "the suite has problems"
        raise ScenarioError(msg, problems=validation_problems(error), file=str(file)) from error
    return _suite(document, file)


def _suite(document: _SuiteDocument, file: Path) -> Suite:
    named = [("scenarios", pattern, _ScenarioEntry(file=pattern)) for pattern in document.scenarios]
    named += [("scenario", entry.file, entry) for entry in document.scenario]
    folder = None if document.baselines is None else file.parent / document.baselines
    cases: dict[str, Case] = {}
    for key, pattern, entry in named:
        for path in _found(file, key, pattern):
            case = _case(document, entry, path, folder)
            if case.name in cases and key == "scenarios":
                msg = f"{path} has the name of {cases[case.name].file}; baselines go by name"
                raise InputError(msg, file=str(file), element=key)
            cases[case.name] = case  # a [[scenario]] says more of one listed before
    if not cases:
        raise InputError("the suite names no scenario", file=str(file), element="scenarios")
    maps = [path for pattern in document.maps for path in _found(file, "maps", pattern)]
    return Suite(
        name=document.name or file.stem,
        file=file,
        maps=tuple(dict.fromkeys(maps)),
        cases=tuple(cases.values()),
        time_limit=document.time_limit,
        converter=document.converter,
    )


def _found(file: Path, key: str, pattern: str) -> list[Path]:
    try:
        found = sorted(path for path in file.parent.glob(pattern) if path.is_file())
    except (ValueError, NotImplementedError) as error:
        msg = f"{pattern!r}: {error}"
        raise InputError(msg, file=str(file), element=key) from error
    if not found:
        msg = f"there is no file {pattern!r} in {file.parent}"
        raise InputError(msg, file=str(file), element=key)
    return found


def _case(document: _SuiteDocument, entry: _ScenarioEntry, path: Path, folder: Path | None) -> Case:
    name = scenario_name(path)
    tolerances = _tolerances(document.tolerance) | _tolerances(entry.tolerance)
    expect = dict.fromkeys((*document.expect, *entry.expect))
    return Case(
        name=name,
        file=path,
        seeds=tuple(dict.fromkeys(entry.seeds or document.seeds or (0,))),
        expectations=tuple(parse_expectation(text) for text in expect),
        tolerances=Tolerances(tolerances),
        until=entry.until or document.until,
        step_length=entry.step_length or document.step_length,
        baseline=None if folder is None else folder / f"{name}.json",
    )


def _tolerances(table: ToleranceTable) -> dict[tuple[str, str], Tolerance]:
    """Tolerances by kind of place and figure; ``segment.vehicles`` is in a table."""
    found = {}
    for key, value in table.items():
        kind, rows = ("run", {key: value}) if isinstance(value, str) else (key, value)
        known = {figure.name: figure for figure in ALL_FIGURES if figure.kind == kind}
        for name, text in rows.items():
            where = f"tolerance.{name}" if kind == "run" else f"tolerance.{kind}.{name}"
            if name not in known:
                listed = ", ".join(sorted(known) or sorted(_PLACE_KINDS))
                msg = f"no figure has this name; known are {listed}"
                raise InputError(msg, element=where)
            try:
                found[kind, name] = parse_tolerance(str(text), known[name])
            except InputError as error:
                raise InputError(error.problem, element=where) from error
    return found
