"""Two runs, or several seeds of two, side by side."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from odscen.app.maps import load_map
from odscen.app.running.confident_runs import FIGURE, confidence_of
from odscen.base.errors import InputError, ScenarioError, in_file
from odscen.base.given_files import as_path
from odscen.experiments.measure import FigureKey, measure
from odscen.figures.measures.comparison import CONFIDENCE, compare_figure
from odscen.figures.measures.registry import SEGMENT_FIGURES
from odscen.figures.measures.traffic_files import read_tables
from odscen.records.outcomes import RunStatus
from odscen.reports.report_maps import place_shapes
from odscen.runs.deferred_figures import whole_summary
from odscen.runs.finished_run import Run
from odscen.runs.layout import FIGURES_FOLDER, SCENARIO_FILE, SUMMARY_FILE
from odscen.scenario.document.json_form import content_sha256, loads
from odscen.scenario.edits.edit_messages import read_edit

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    import polars as pl

    from odscen.base.given_files import GivenPath
    from odscen.experiments.measure import Measured
    from odscen.figures.measures.comparison import Difference, Finding
    from odscen.maps.store import Workspace
    from odscen.reports.report_maps import PlaceShapes
    from odscen.scenario.document.scenario_document import Scenario


def made_by_edits(a: Scenario | None, b: Scenario | None) -> Iterator[str]:
    """Yield the edits that make one side of the other, where one is a variant of the other.

    Says so, too, where one of both is not as it was when the variant was made.
    """
    if a is None or b is None:
        return
    for name, child, other, parent in (("B", b, "A", a), ("A", a, "B", b)):
        variant = child.variant
        if variant is None:
            continue
        known = variant.parent_sha256 == content_sha256(parent)
        if not known and variant.parent != parent.name:
            continue
        yield f"{name} is a variant of {other} ({variant.parent}): " + "; ".join(
            map(_describe_edit, variant.edits)
        )
        if not known:
            yield f"{other} is not as it was when the variant was made, so more may differ"
        if variant.sha256 != content_sha256(child):
            yield f"{name} was changed after it was made, so more than these edits differs"


def _describe_edit(edit: Mapping[str, Any]) -> str:
    try:
        return read_edit(edit).words
    except ScenarioError:  # an edit of another version
        return f"{edit.get('kind')}"


FORMAT = "odscen-comparison"
VERSION = 1

WANTED = 0.05
"""Half the width of an interval, as a share of the mean, that a comparison asks of its seeds."""
MOST = 8
"""Places that are named, at most."""

NAMED = 3
"""Folders that an error names."""

_TELLING = {(figure.kind, figure.name) for figure in SEGMENT_FIGURES if figure.tells}
"""The one figure of each kind of place that says how well traffic moves there."""


@dataclass(frozen=True, slots=True)
class RunSet:
    """Runs of one side by seed; ``versions`` and ``scenario`` as in their summaries.

    ``networks`` are their tables of the whole network over time, where they have them; ``shapes``
    those of the map, if a workspace that has it was given. ``document`` is the scenario of the
    first run, if its folder has it.
    """

    name: str
    scenario: str
    versions: tuple[str, ...]
    runs: Mapping[int, Measured]
    places: bool
    networks: tuple[pl.DataFrame, ...] = ()
    shapes: PlaceShapes | None = None
    document: Scenario | None = None


@dataclass(frozen=True, slots=True)
class Row:
    """One figure on both sides."""

    key: FigureKey
    difference: Difference

    @property
    def cells(self) -> tuple[str, ...]:
        """Figure, unit, both means, difference, interval, and what it says."""
        found, unit = self.difference, self.key.entry.unit
        interval = difference = ""
        if found.low is not None and found.high is not None and found.low < found.high:
            interval = f"{found.low:+,.2f} to {found.high:+,.2f}"
        a, b = (("-" if value is None else f"{value:,.2f}") for value in (found.a, found.b))
        if found.difference is not None:
            difference = f"{found.difference:+,.2f}" if found.difference else "0"
        if found.relative:
            difference += f" ({100 * found.relative:+.1f} %)"
        return self.key.name, unit, a, b, difference, interval, self.says

    @property
    def says(self) -> Finding:
        """What the difference amounts to."""
        return self.difference.finding

    @property
    def improves(self) -> bool | None:
        """Whether B is the better side; ``None`` if neither is."""
        return self.key.entry.improves(self.difference.difference)

    @property
    def words(self) -> str:
        """One line for people."""
        found, figure = self.difference, self.key.entry
        a, b = ("none" if v is None else figure.written(v) for v in (found.a, found.b))
        return f"{self.key.name}: {a} in A, {b} in B ({self.says})"


@dataclass(frozen=True, slots=True)
class RunComparison:
    """The comparison of two sides A and B.

    Attributes
    ----------
    a, b
        The runs of both sides.
    rows
        One for each figure of the runs and of each place: ``key`` says which, ``difference`` has
        the means ``a`` and ``b``, ``difference`` (B minus A) and the bounds ``low`` and ``high``
        of its 95 % interval, all in the unit of the figure; ``words`` says it in a line.
    places
        Rows of the places that differ most.
    notes
        What limits the comparison, in words.
    """

    a: RunSet
    b: RunSet
    rows: tuple[Row, ...]
    places: tuple[Row, ...]
    notes: tuple[str, ...]

    @property
    def place_rows(self) -> list[Row]:
        """The one figure of each place that says how traffic gets on there."""
        return [row for row in self.rows if (row.key.kind, row.key.figure) in _TELLING]

    def to_dict(self) -> dict[str, Any]:
        """Return it as data; figures in SI units, named beside each."""

        def side(runs: RunSet) -> dict[str, Any]:
            return {"runs": runs.name, "scenario": runs.scenario, "seeds": sorted(runs.runs)}

        return {
            "format": FORMAT,
            "version": VERSION,
            "confidence": CONFIDENCE,
            "a": side(self.a),
            "b": side(self.b),
            "figures": [_difference_row(row) for row in self.rows],
            "notes": list(self.notes),
        }


def _difference_row(row: Row) -> dict[str, Any]:
    key = {"kind": row.key.kind, "place": row.key.place or None, "figure": row.key.figure}
    found = asdict(row.difference)
    found |= {"relative": row.difference.relative, "clear": row.difference.clear}
    return {**key, "unit": row.key.entry.unit, **found}


def compare(
    a: Run | GivenPath, b: Run | GivenPath, *, workspace: Workspace | None = None
) -> RunComparison:
    """Compare runs: every figure of both sides, with 95 % intervals where there are several seeds.

    Parameters
    ----------
    a, b
        A run, its folder, or a folder of runs of one scenario with different seeds.
    workspace
        To draw the map on the page of the comparison, if it has it.

    Returns
    -------
    RunComparison
        Differences are B minus A, in the unit of each figure.

    Raises
    ------
    InputError
        If there is no run, one has failed, or two of one side have the same seed.

    Notes
    -----
    Runs of the same seeds are compared in pairs; intervals are Student's t.
    """
    folders = [side.folder if isinstance(side, Run) else as_path(side) for side in (a, b)]
    return compare_runs(*(read_runs(folder, workspace) for folder in folders))


def read_runs(folder: Path, workspace: Workspace | None = None) -> RunSet:
    """Read a run, or all runs in a folder, of one scenario with different seeds.

    Figures of segments and junctions are there only where every run has measured lanes.

    Parameters
    ----------
    workspace
        To draw its map, if it has it.

    Raises
    ------
    InputError
        If there is no run, one has failed, or two have the same seed.
    DamagedError
        If a file of a run is not as it was written.
    """
    if (folder / SUMMARY_FILE).is_file():
        folders = [folder]
    else:
        folders = sorted(path.parent for path in folder.glob(f"*/{SUMMARY_FILE}"))
    if not folders:
        raise InputError(_explain_no_run(folder), file=str(folder))
    runs: dict[int, Measured] = {}
    scenarios: dict[str, None] = {}
    versions: dict[str, None] = {}
    networks: list[pl.DataFrame] = []
    maps: set[tuple[str, str]] = set()
    for path in folders:
        summary = _read_summary(path)
        with in_file(str(path)):
            measured, figures = measure(path, summary), read_tables(path / FIGURES_FOLDER)
        if summary["seed"] in runs:
            raise InputError(
                f"seed {summary['seed']} is there twice; a folder to compare holds one run a seed",
                file=str(path),
            )
        runs[summary["seed"]] = measured
        if figures is not None:
            networks.append(figures.network)
        maps.add((str(summary.get("map")), str(summary.get("map_sha256"))))
        scenarios[str(summary.get("scenario"))] = None
        used = summary.get("versions") or {}
        versions[", ".join(f"{key} {used[key]}" for key in ("odscen", "sumo") if key in used)] = (
            None
        )
    if len(scenarios) > 1:
        raise InputError(
            f"runs of different scenarios: {', '.join(scenarios)}; name a folder with one",
            file=str(folder),
        )
    places = all(any(key.kind == "segment" for key in figures) for figures in runs.values())
    return RunSet(
        str(folder),
        next(iter(scenarios)),
        tuple(versions),
        runs,
        places,
        tuple(networks),
        None if workspace is None else _map_shapes(workspace, maps),
        _read_document(folders[0]),
    )


def _explain_no_run(folder: Path) -> str:
    """Say what is wanted, with the folders further down that would do."""
    wanted = f"name a run, which has a {SUMMARY_FILE}, or a folder of runs of one scenario"
    deeper = sorted({path.parent.parent for path in folder.glob(f"*/*/{SUMMARY_FILE}")})
    if not deeper:
        return f"no run here; {wanted}"
    listed = ", ".join(map(str, deeper[:NAMED])) + (", ..." if len(deeper) > NAMED else "")
    return f"runs of {len(deeper)} scenarios, one folder further down; {wanted}: {listed}"


def _read_summary(folder: Path) -> dict[str, Any]:
    summary = whole_summary(folder)
    status = summary["status"]
    if status != RunStatus.COMPLETED or not isinstance(summary["seed"], int):
        raise InputError(
            f"the run has not completed, it is {status!r}", file=str(folder / SUMMARY_FILE)
        )
    return summary


def _read_document(folder: Path) -> Scenario | None:
    path = folder / SCENARIO_FILE
    return loads(path.read_text(encoding="utf-8"), file=str(path)) if path.is_file() else None


def _map_shapes(workspace: Workspace, maps: set[tuple[str, str]]) -> PlaceShapes | None:
    """Shapes of the one map that all runs are on, if the workspace has it."""
    with suppress(InputError):
        if len(maps) == 1:
            return place_shapes(load_map(workspace.map_for(*next(iter(maps)))).sumo.graph)
    return None


def compare_runs(a: RunSet, b: RunSet) -> RunComparison:
    """Compare every figure that one of the two sides has."""
    keys = dict.fromkeys(
        key for side in (a, b) for figures in side.runs.values() for key in figures
    )
    rows = []
    for key in keys:
        one, other = (
            {seed: figures.get(key) for seed, figures in side.runs.items()} for side in (a, b)
        )
        difference = compare_figure(one, other)
        if difference.a is not None or difference.b is not None:
            rows.append(Row(key, difference))
    return RunComparison(a, b, tuple(rows), _most_changed(rows, a, b), _comparison_notes(a, b))


def _most_changed(rows: list[Row], a: RunSet, b: RunSet) -> tuple[Row, ...]:
    """Segments by speed and junctions by waiting, weighted by how many vehicles passed."""
    if not (a.places and b.places):
        return ()
    passed = {
        (row.key.kind, row.key.place): min(row.difference.a or 0.0, row.difference.b or 0.0)
        for row in rows
        if row.key.figure == "vehicles"
    }
    scored = []
    for row in rows:
        if (row.key.kind, row.key.figure) not in _TELLING or not row.difference.difference:
            continue
        size = abs(row.difference.difference) / max(abs(row.difference.a or 0.0), 1.0)
        weight = math.sqrt(passed.get((row.key.kind, row.key.place), 0.0))
        scored.append((-size * weight, row.key, row))
    return tuple(row for _, _, row in sorted(scored, key=lambda item: item[:2])[:MOST])


def _comparison_notes(a: RunSet, b: RunSet) -> tuple[str, ...]:
    notes = list(made_by_edits(a.document, b.document))
    if a.scenario != b.scenario and not notes:
        notes.append(f"the scenarios have different names: {a.scenario} and {b.scenario}")
    if a.versions != b.versions:
        notes.append(f"made with different versions: {'; '.join(a.versions)} and "
                     f"{'; '.join(b.versions)}")  # fmt: skip
    if a.runs.keys() != b.runs.keys():
        notes.append("the seeds differ, so runs are not paired; pairs show smaller differences")
    elif len(a.runs) == 1:
        notes.append("one run each: intervals need at least two seeds a side")
    for name, side in (("A", a), ("B", b)):
        values = [figures.get(FigureKey("run", "", FIGURE)) for figures in side.runs.values()]
        found = confidence_of(values, share=WANTED)
        if found.seeds > 1 and found.mean and not found.enough:
            notes.append(f"{name}: {found.words}")
    if not (a.places and b.places):
        notes.append("a run has not measured traffic on lanes, so places are left out")
    return tuple(notes)
