"""Baselines: the figures of a scenario that a change is held against, and what they came from.

One JSON file per scenario, one figure or place per line and one value per seed, so that a diff
shows what has changed. The fingerprint tells a changed input from a changed behaviour.
"""

from __future__ import annotations

import hashlib
import json
from contextlib import suppress
from dataclasses import dataclass
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from odscen.base.errors import in_file
from odscen.base.given_files import read_given
from odscen.base.stored_files import documents, read_document
from odscen.base.text_files import write_text
from odscen.base.version import __version__
from odscen.experiments.measure import FigureKey
from odscen.experiments.tolerance import (
    CHANGE,
    FEWEST_SEEDS,
    VARYING,
    Level,
    Sizing,
    hardly_varying,
    seeds_needed,
)
from odscen.records.row_text import json_with_rows

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from odscen.experiments.measure import Measured
    from odscen.figures.measures.figure import FigureKind
    from odscen.maps.map_entry import MapEntry
    from odscen.runs.run_settings import RunSettings
    from odscen.scenario.document.scenario_document import Scenario

FORMAT = "odscen-baseline"
VERSION = 1

_SHORT = 16
"""Hexadecimal digits of a digest; 64 bits are enough to tell versions of one file apart."""

_DELAY = FigureKey("run", "", "mean_delay")

_SCATTER = "scatter"
"""Value of ``tolerance`` in the file."""

_KINDS: tuple[FigureKind, ...] = ("segment", "junction", "actor")

Fingerprint = dict[str, str]
"""What a run was made of, by name: ``map``, ``scenario.actors``, ``odscen``, ``sumo``, ..."""


@dataclass(frozen=True, slots=True)
class Baseline:
    """Figures per seed; every tuple is in the order of ``seeds``.

    ``by_scatter`` says that the scatter over the seeds decides what is allowed, where that is more
    than the figure's own tolerance; baselines of few seeds, and those of before 0.2, do not.
    ``sizing`` is what the seeds were chosen for; ``None`` where the suite names them.
    """

    seeds: tuple[int, ...]
    fingerprint: Fingerprint
    figures: dict[FigureKey, tuple[float | None, ...]]
    by_scatter: bool = False
    sizing: Sizing | None = None


def fingerprint(
    scenario: Scenario, map_sha256: str, settings: RunSettings, *, network: str | None = None
) -> Fingerprint:
    """Fingerprint of what a scenario is run from.

    ``network`` is the SHA-256 of a network that odscen has not written.

    The scenario's parts are apart, so that the one that has changed can be named. Its seed is
    left out, as the suite names the seeds, and so are name and description.
    """
    # What has its default value is left out: a field that a later version adds changes nothing.
    document = scenario.model_dump(mode="json", exclude_defaults=True)
    wished = {"duration": settings.until, "step_length": settings.step_length}
    given = {name: value for name, value in wished.items() if value is not None}
    document["simulation"] = document.get("simulation", {}) | given
    for other in _NOT_ACTING:
        document.pop(other, None)
    found = {"map": map_sha256[:_SHORT]}
    if network is not None:
        found["network"] = network[:_SHORT]
    found |= {f"scenario.{part}": _digest_of(value) for part, value in document.items()}
    if settings.redraw != "open":
        found["redraw"] = settings.redraw
    return found | {"odscen": __version__, "sumo": version("libsumo")}


_NOT_ACTING = (
    "format", "version", "name", "description", "map", "variant", "seed", "parameters", "formulas",
)  # fmt: skip
"""Parts of a scenario that say nothing of traffic, or nothing that others do not say."""


def map_digest(entry: MapEntry) -> str:
    """``map`` of the fingerprint of a run on this map."""
    return entry.sha256[:_SHORT]


def _digest_of(value: object) -> str:
    text = json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return hashlib.sha256(text.encode()).hexdigest()[:_SHORT]


def baseline_of(
    runs: Mapping[int, Measured], made_of: Fingerprint, *, sizing: Sizing | None = None
) -> Baseline:
    """Make the baseline of the runs of a scenario, given by seed."""
    seeds = tuple(sorted(runs))
    keys = dict.fromkeys(key for seed in seeds for key in runs[seed])
    return Baseline(
        seeds,
        made_of,
        {key: tuple(runs[seed].get(key) for seed in seeds) for key in keys},
        by_scatter=len(seeds) >= FEWEST_SEEDS,
        sizing=sizing,
    )


def seeds_that_hardly_vary(baseline: Baseline) -> tuple[str, ...]:
    """Warn where seeds make next to no difference, as their scatter then says little of chance."""
    words = hardly_varying(baseline.figures.get(FigureKey("run", "", VARYING), ()))
    return () if words is None else (words,)


def seeds_for_small_changes(baseline: Baseline) -> tuple[str, ...]:
    """Say with how many seeds a small change of the mean delay would be caught.

    Where they were chosen for a change, say what they catch.
    """
    if baseline.sizing is not None:
        return (baseline.sizing.words,)
    known = [value for value in baseline.figures.get(_DELAY, ()) if value is not None]
    run = sum(key.kind == "run" for key in baseline.figures)
    needed = seeds_needed(known, level=Level.shared(run=run, places=1).run)
    if needed is None or needed <= len(baseline.seeds):
        return ()
    count = len(baseline.seeds)
    words = f"to tell a change of mean_delay by {100 * CHANGE:g} % from chance takes {needed} seeds"
    if baseline.by_scatter:
        return (f"{words}, not {count}",)
    few = f"{count} seeds are too few to know their scatter, so tolerances are fixed ones"
    return (f"{few}; from {FEWEST_SEEDS} seeds on they come from it; {words}",)


def write_baseline(baseline: Baseline, file: Path, *, scenario: str) -> None:
    """Write a baseline; the same figures give the same text."""
    head: dict[str, Any] = {
        "format": FORMAT,
        "version": VERSION,
        "scenario": scenario,
        "fingerprint": baseline.fingerprint,
        "seeds": list(baseline.seeds),
    }
    if baseline.by_scatter:
        head["tolerance"] = _SCATTER
    if baseline.sizing is not None:
        head["detect"] = baseline.sizing.model_dump(mode="json")
    write_text(file, json_with_rows(head, "rows", _baseline_rows(baseline)))


def _baseline_rows(baseline: Baseline) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = [
        {"figure": key.figure, "values": _plain_numbers(values)}
        for key, values in baseline.figures.items()
        if key.kind == "run"
    ]
    for kind in _KINDS:
        places: dict[str, dict[str, Any]] = {}
        for key, values in baseline.figures.items():
            if key.kind == kind:
                places.setdefault(key.place, {kind: key.place})[key.figure] = _plain_numbers(values)
        rows += [places[name] for name in sorted(places)]
    return rows


def _plain_numbers(values: Sequence[float | None]) -> list[float | None]:
    """Whole numbers without a decimal point, as counts are written."""
    return [int(v) if v is not None and v.is_integer() else v for v in values]


def read_baseline(file: Path) -> Baseline | None:
    """Read a baseline; ``None`` if there is no such file.

    Raises
    ------
    InputError
        If it is not a baseline of this version.
    """
    with suppress(OSError):  # which reading it names
        if not file.exists():
            return None
    what = "a baseline"
    with in_file(str(file)):
        data = read_document(read_given(file), form=FORMAT, version=VERSION, what=what)
        with documents(f"{what}, write it again with --update-baseline"):
            return _baseline_from_data(data)


def _baseline_from_data(data: Mapping[str, Any]) -> Baseline:
    seeds = tuple(int(seed) for seed in data["seeds"])
    figures: dict[FigureKey, tuple[float | None, ...]] = {}
    for row in data["rows"]:
        if "figure" in row:
            figures[FigureKey("run", "", _required_name(row["figure"]))] = _read_values(
                row["values"], seeds
            )
            continue
        kind = next((kind for kind in _KINDS if kind in row), None)
        if kind is None:
            raise ValueError(f"row {row!r:.60} is of no figure, {', '.join(_KINDS)}")
        place = _required_name(row[kind])
        for name, values in row.items():
            if name != kind:
                figures[FigureKey(kind, place, name)] = _read_values(values, seeds)
    by_scatter = data.get("tolerance") == _SCATTER
    made_of = {name: _required_name(digest) for name, digest in dict(data["fingerprint"]).items()}
    chosen = data.get("detect")
    sizing = None if chosen is None else Sizing.model_validate(chosen)
    if sizing is not None and sizing.seeds != len(seeds):
        raise ValueError(f"detect has {sizing.seeds} seeds, and {len(seeds)} are there")
    return Baseline(seeds, made_of, figures, by_scatter, sizing)


def _required_name(value: object) -> str:
    if not isinstance(value, str):
        raise ValueError(f"{value!r:.60} is not a text")
    return value


def _read_values(values: Sequence[float | None], seeds: Sequence[int]) -> tuple[float | None, ...]:
    if len(values) != len(seeds):
        raise ValueError(f"{len(values)} values for {len(seeds)} seeds")
    return tuple(None if value is None else float(value) for value in values)
