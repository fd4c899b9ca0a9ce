"""From the scenarios of a suite to checked runs, each on its map and with its baseline.

What is wrong with one scenario is an error of that scenario; the others go on.
"""

from __future__ import annotations

import hashlib
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from odscen.app.running.runs import check_run
from odscen.app.scenarios import read_scenario
from odscen.base.errors import InputError, ToolError, in_file
from odscen.convert.model.conversion_settings import ConversionSettings
from odscen.experiments.regression.baseline import fingerprint, read_baseline
from odscen.figures.judging.expectations import needs_criticality
from odscen.maps.folder_names import name_from_file
from odscen.runs.recording import Recording
from odscen.runs.run_settings import RunSettings
from odscen.simulators.assets import shipped_assets

if TYPE_CHECKING:
    from odscen.app.running.runs import CheckedRun
    from odscen.experiments.regression.baseline import Baseline, Fingerprint
    from odscen.experiments.regression.case_results import SeedResult
    from odscen.experiments.regression.detection import Sizing
    from odscen.experiments.suites.suite import Case, Suite
    from odscen.maps.map_entry import MapEntry
    from odscen.maps.store import Workspace
    from odscen.scenario.document.scenario_document import Scenario


@dataclass(slots=True)
class LoadedCase:
    """A case with its scenario on the map that it will run on; ``run`` is without a seed.

    ``runs`` by seed, and ``refused``, the words of a seed that could not be run, are filled later.
    So is ``sizing``, with the seeds of ``case``, where those are chosen for a new baseline.
    """

    case: Case
    run: CheckedRun
    made_of: Fingerprint
    baseline: Baseline | None
    sizing: Sizing | None = None
    runs: dict[int, SeedResult] = field(default_factory=dict)
    refused: dict[int, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class UnusableCase:
    """A case that cannot be run, and why; with its map and baseline, where those are there."""

    case: Case
    error: InputError | ToolError
    entry: MapEntry | None = None
    baseline: Baseline | None = None


def load_cases(
    workspace: Workspace, suite: Suite, *, with_baseline: bool
) -> list[LoadedCase | UnusableCase]:
    """Read and check every scenario of a suite on its map.

    Raises
    ------
    InputError
        If the suite, as a whole, names a map that is not there and that no scenario is on.
    """
    maps = _SuiteMaps(workspace, suite)
    loaded: list[LoadedCase | UnusableCase] = []
    for case in suite.cases:
        try:
            loaded.append(_load(workspace, case, maps, with_baseline=with_baseline))
        except (InputError, ToolError) as error:
            loaded.append(_unusable(case, error, maps))
    if suite.whole:
        maps.refuse_unused()
    return loaded


def _unusable(case: Case, error: InputError | ToolError, maps: _SuiteMaps) -> UnusableCase:
    with suppress(InputError, ToolError):  # which may be the error itself
        entry = maps.of(read_scenario(case.file))
        baseline = None if case.baseline is None else read_baseline(case.baseline)
        return UnusableCase(case, error, entry, baseline)
    return UnusableCase(case, error)


def _load(workspace: Workspace, case: Case, maps: _SuiteMaps, *, with_baseline: bool) -> LoadedCase:
    scenario = read_scenario(case.file)
    with in_file(str(case.file)):
        entry = maps.of(scenario)
        # The suite names the map to test on; a baseline knows if it is not the one of before.
        reference = scenario.map.model_copy(update={"sha256": entry.sha256})
        scenario = scenario.model_copy(update={"map": reference})
        settings = _settings(case)
        run = check_run(workspace, scenario, name=case.name, settings=settings, entry=entry)
    network = None if entry.converter == "odscen" else entry.net_sha256
    made_of = fingerprint(scenario, entry.sha256, settings, network=network)
    baseline = read_baseline(case.baseline) if with_baseline and case.baseline else None
    run = replace(run, assets=shipped_assets())  # a baseline holds in every workspace
    if baseline is None:
        return LoadedCase(case, run, made_of, None)
    if case.detect is not None and not case.other_seeds:
        case = replace(case, seeds=baseline.seeds)
    return LoadedCase(case, run, made_of, baseline, baseline.sizing)


def map_before(entry: MapEntry, digest: str, workspace: Workspace | None) -> MapEntry | None:
    """Find the map of a baseline, by its digest; ``None`` where the workspace has lost it.

    Parameters
    ----------
    entry
        The map of now, which may be the same.
    digest
        ``map`` of the baseline's fingerprint: the beginning of a SHA-256.
    """
    if not digest or entry.sha256.startswith(digest):
        return entry
    if workspace is None:
        return None
    return workspace.first_map(lambda one: one.sha256.startswith(digest))


class _SuiteMaps:
    """The maps of a suite, each built once; one that cannot be is the error of its scenarios."""

    def __init__(self, workspace: Workspace, suite: Suite) -> None:
        self._workspace = workspace
        self._suite = suite
        self._files = {name_from_file(path): path for path in suite.maps}
        self._asked: set[str] = set()
        self._known: dict[tuple[str, str, float], MapEntry | InputError | ToolError] = {}

    def of(self, scenario: Scenario) -> MapEntry:
        """Find the map of a scenario.

        Raises
        ------
        InputError, ToolError
            If it is not there or cannot be built, each time that it is asked for.
        """
        reference = scenario.map
        self._asked.add(reference.name)
        key = reference.name, reference.sha256, reference.spacing
        if key not in self._known:
            try:
                self._known[key] = self._found(scenario)
            except (InputError, ToolError) as error:
                self._known[key] = error
        found = self._known[key]
        if isinstance(found, Exception):
            raise found
        return found

    def refuse_unused(self) -> None:
        """Refuse a suite with a map that is not there, if that is no scenario's error.

        Raises
        ------
        InputError
            With the first of them.
        """
        for name, path in self._files.items():
            if name not in self._asked and not path.is_file():
                raise InputError(
                    f"there is no file {path}, and no scenario is on a map of that name",
                    file=str(self._suite.file),
                    element="maps",
                )

    def _found(self, scenario: Scenario) -> MapEntry:
        """The map of the suite, built in the workspace if need be; else the workspace's own.

        A map of that name and another content or converter in the workspace is left alone.
        """
        workspace, converter = self._workspace, self._suite.converter
        name = scenario.map.name
        source = self._files.get(name)
        if source is None:
            own = workspace.map_for(name, scenario.map.sha256)
            if converter in (None, own.converter):
                return own
            source = own.checked("xodr")
        wished = ConversionSettings(spacing=scenario.map.spacing, converter=converter or "odscen")
        try:
            content = source.read_bytes()
        except OSError as error:
            raise InputError(error.strerror or str(error), file=str(source)) from error
        sha256 = hashlib.sha256(content).hexdigest()
        there = workspace.first_map(lambda one: (one.sha256, one.conversion) == (sha256, wished))
        if there is not None:
            return there
        free = name not in workspace.map_names()
        new = name if free else f"{name[:40]}-{sha256[:8]}-{wished.converter}"
        return workspace.add_map(source, name=new, settings=wished)


def _settings(case: Case) -> RunSettings:
    return RunSettings(
        redraw=case.redraw,
        until=case.until,
        step_length=case.step_length,
        recording=Recording(criticality=needs_criticality(case.expectations)),
        time_limit=case.time_limit,
    )
