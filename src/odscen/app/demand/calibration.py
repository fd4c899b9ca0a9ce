"""Calibration: a scenario is changed until its runs show what was measured on the road.

Targets (:mod:`odscen.scenario.demand.targets`) are flows, travel times and queues by place and
time. A part of the places is held back and fitted to nothing: it says whether what was found also
holds elsewhere. What may change is named; each change is tried by runs with the same seeds and
kept only if the runs come clearly closer to the targets that are not held back.
"""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from odscen.app.demand.calibration_knobs import (
    amount_knob,
    driver_knobs,
    parameter_knobs,
    program_knobs,
)
from odscen.app.demand.demand_correction import correct_matrix
from odscen.app.demand.plausible_calibration import doubts_of
from odscen.app.demand.target_values import (
    Measured,
    common_interval,
    read_values,
    refuse_unknown_places,
)
from odscen.app.maps import map_of
from odscen.app.running.batches import run_many
from odscen.app.scenarios import given_scenario
from odscen.base.atomic_folders import scratch_folder
from odscen.base.categories import Category
from odscen.base.errors import InputError
from odscen.records.outcomes import RunStatus
from odscen.runs.run_settings import RunSettings
from odscen.scenario.demand.targets import FLOW, KINDS, hold_back
from odscen.scenario.document.scenario_document import Counts

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from odscen.app.demand.calibration_knobs import Knob
    from odscen.app.maps import LoadedMap
    from odscen.base.given_files import GivenPath
    from odscen.maps.store import Workspace
    from odscen.scenario.demand.targets import Target
    from odscen.scenario.document.scenario_document import Scenario

CHANGES: Final = ("matrix", "routes", "drivers", "programs", "parameters")
"""What may change, in the order in which it is tried."""
SEEDS: Final = (1, 2, 3)
TRIALS: Final = 24
"""Scenarios that are run at most, each with all seeds."""
GAIN: Final = 0.01
"""Share by which a change has to lower the distance to be kept; less is chance."""
SPREADS: Final = (0.0, 0.03, 0.1)
"""Of routes by travel time, that are tried."""
STEPS: Final = (0.25, 0.125, 0.0625)
"""Shares of what is between the bounds of a number that it is moved by."""


class TargetFit(NamedTuple):
    """A target, and what runs show before and after the calibration: means over the seeds.

    ``None`` where no run has a value: nobody came, or only before the figures begin.
    """

    target: Target
    before: float | None
    after: float | None

    def met(self, *, after: bool) -> bool:
        """Whether it is within what is allowed."""
        found = self.after if after else self.before
        return found is not None and self.target.distance(found) <= 1.0


class CalibrationStep(NamedTuple):
    """A change that was tried: what, the distance of its runs, and whether it was kept."""

    what: str
    distance: float
    kept: bool

    @property
    def words(self) -> str:
        """One line for people."""
        return f"{self.what}: distance {self.distance:.3f}, {'kept' if self.kept else 'not kept'}"


class FitShare(NamedTuple):
    """Targets of a kind, of those fitted or of those held back, and how many are met."""

    kind: str
    held: bool
    targets: int
    met_before: int
    met_after: int
    off_before: float
    off_after: float


@dataclass(frozen=True, slots=True)
class Calibration:
    """What has come of a calibration.

    Attributes
    ----------
    scenario
        The calibrated one.
    fits
        Each target with its values before and after.
    distances
        Mean distance of fitted targets before and after, and of those held back; ``None`` if there
        are none.
    steps
        What was tried, in order; ``skipped`` what could not be, and why.
    doubts
        What is not plausible of targets or result, in words.
    runs
        Runs that were made.
    """

    scenario: Scenario
    fits: tuple[TargetFit, ...]
    distances: Mapping[str, float | None]
    steps: tuple[CalibrationStep, ...]
    skipped: tuple[str, ...]
    doubts: tuple[str, ...]
    runs: int

    @property
    def shares(self) -> tuple[FitShare, ...]:
        """How many targets of each kind are met before and after, fitted and held back."""
        groups: dict[tuple[str, bool], list[TargetFit]] = defaultdict(list)
        for fit in self.fits:
            groups[fit.target.kind, fit.target.held].append(fit)
        return tuple(
            FitShare(
                kind, held, len(fits), sum(fit.met(after=False) for fit in fits),
                sum(fit.met(after=True) for fit in fits),
                _mean_distance(fits, after=False), _mean_distance(fits, after=True),
            )
            for held in (False, True)
            for kind in KINDS
            if (fits := groups.get((kind, held)))
        )  # fmt: skip

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready."""
        return {
            "distances": dict(self.distances),
            "shares": [share._asdict() for share in self.shares],
            "targets": [
                {
                    **fit.target._asdict(),
                    "before": fit.before,
                    "after": fit.after,
                    "met_before": fit.met(after=False),
                    "met_after": fit.met(after=True),
                }
                for fit in self.fits
            ],
            "steps": [step._asdict() for step in self.steps],
            "skipped": list(self.skipped),
            "doubts": list(self.doubts),
            "runs": self.runs,
        }


def calibrate(
    workspace: Workspace,
    scenario: Scenario | GivenPath,
    targets: Sequence[Target],
    *,
    change: Sequence[str] = ("matrix", "drivers"),
    held_back: float = 0.25,
    seeds: Sequence[int] = SEEDS,
    trials: int = TRIALS,
    trust: float = 0.1,
    processes: int = 1,
    tell: Callable[[str], None] | None = None,
) -> Calibration:
    """Change a scenario until its runs meet targets.

    Parameters
    ----------
    workspace
        Has the map.
    scenario
        The scenario, or its file; it is not changed.
    targets
        What was measured.
    change
        What may change, of :data:`CHANGES`.
    held_back
        Share of the places of each kind that nothing is fitted to, unless targets say it.
    seeds
        Of the runs of each trial; a value is the mean over them.
    trials
        Scenarios that are run at most.
    trust
        See :func:`odscen.sumo.calibrate.matrix_correction.corrected`.
    processes
        Runs at a time.
    tell
        Hears of each step.

    Returns
    -------
    Calibration
        The scenario, each target before and after, what was tried, and what is not plausible.

    Raises
    ------
    InputError
        If targets are missing, or at places that the scenario does not have, or nothing that may
        change is there, or a run fails.
    ScenarioError
        If the scenario has errors.
    """
    document = given_scenario(scenario)
    for name in change:
        if name not in CHANGES:
            raise InputError(f"what may change is one of {', '.join(CHANGES)}, not {name!r}")
    if not targets:
        raise InputError("there are no targets to calibrate by")
    if trials < 2:
        raise InputError(f"a calibration takes 2 trials at least, not {trials}")
    loaded = map_of(workspace, document)
    parts = hold_back(targets, held_back, seed=document.seed)
    if all(target.held for target in parts):
        raise InputError("all targets are held back: there are none to calibrate by")
    refuse_unknown_places(document, loaded, parts)
    work = _Work(workspace, loaded, parts, tuple(seeds), trials, processes, tell)
    before = work.measure(document, "as it is")
    found = _Best(document, before)
    for name in CHANGES:
        if name in change:
            _TRIED[name](work, found, trust)
    if not work.steps:
        raise InputError(
            "nothing that may change is there: " + "; ".join(work.skipped or ("no step was made",))
        )
    fits = tuple(
        TargetFit(target, old, new)
        for target, old, new in zip(parts, before.values, found.measured.values, strict=True)
    )
    distances = {
        "before": _measure_distance(parts, before.values, held=False),
        "after": _measure_distance(parts, found.measured.values, held=False),
        "validation_before": _measure_distance(parts, before.values, held=True),
        "validation_after": _measure_distance(parts, found.measured.values, held=True),
    }
    doubts = doubts_of(document, found.scenario, parts, before, found.measured, distances)
    return Calibration(
        found.scenario, fits, distances, tuple(work.steps), tuple(work.skipped),
        (*doubts, *found.doubts), work.runs,
    )  # fmt: skip


@dataclass(slots=True)
class _Best:
    """The best scenario so far, and what its runs show."""

    scenario: Scenario
    measured: Measured
    doubts: list[str] = field(default_factory=list)


@dataclass(slots=True)
class _Work:
    workspace: Workspace
    loaded: LoadedMap
    targets: tuple[Target, ...]
    seeds: tuple[int, ...]
    trials: int
    processes: int
    tell: Callable[[str], None] | None
    steps: list[CalibrationStep] = field(default_factory=list)
    skipped: list[str] = field(default_factory=list)
    runs: int = 0

    def skip(self, words: str) -> None:
        self.skipped.append(words)
        if self.tell is not None:
            self.tell(words)

    @property
    def exhausted(self) -> bool:
        return self.runs >= self.trials * len(self.seeds)

    def measure(self, scenario: Scenario, what: str) -> Measured:
        """Run a scenario with all seeds."""
        settings = RunSettings(
            interval=common_interval(self.targets), slice_length=None,
            recording=replace(RunSettings().recording, emissions=False),
        )  # fmt: skip
        rows, vehicles, verdicts = [], [], []
        with scratch_folder() as folder:
            runs = run_many(
                self.workspace, [scenario], settings=settings, seeds=self.seeds, out=folder,
                processes=self.processes, reports=False,
            )  # fmt: skip
            self.runs += len(runs)
            for run in runs:
                if run.status != RunStatus.COMPLETED:
                    raise InputError(f"a run has not completed ({what}): {run.status}")
                values, number = read_values(run, self.targets, self.loaded)
                rows.append(values)
                vehicles.append(number)
                if run.usability.get("level") != "usable":
                    verdicts.append(str(run.usability.get("headline", "")))
        means = tuple(_average_known([row[n] for row in rows]) for n in range(len(self.targets)))
        flows = [
            value or 0.0
            for target, value in zip(self.targets, means, strict=True)
            if target.kind == FLOW
        ]
        return Measured(means, sum(vehicles) / len(vehicles), sum(flows), tuple(verdicts))

    def distance(self, measured: Measured) -> float:
        found = _measure_distance(self.targets, measured.values, held=False)
        return math.inf if found is None else found

    def try_scenario(self, best: _Best, scenario: Scenario, what: str) -> bool:
        """Run a changed scenario, and keep it if it is closer to the targets."""
        if self.exhausted:
            return False
        measured = self.measure(scenario, what)
        distance = self.distance(measured)
        kept = distance < (1.0 - GAIN) * self.distance(best.measured)
        if kept:
            best.scenario, best.measured = scenario, measured
        self.steps.append(CalibrationStep(what, distance, kept))
        if self.tell is not None:
            self.tell(self.steps[-1].words)
        return kept


# ---------------------------------------------------------------------------- what is tried


def _try_matrix(work: _Work, best: _Best, trust: float) -> None:
    """The matrices by the counts; without them, more or less traffic."""
    flows = [target for target in work.targets if target.kind == FLOW and not target.held]
    demand = best.scenario.demand
    driven = [matrix for matrix in demand.matrices if Category.PEDESTRIAN not in matrix.mix]
    if not flows:
        work.skip("matrix: no flow is fitted")
        return
    if not driven:
        knob = amount_knob(best.scenario)
        if knob is None:
            work.skip("matrix: the scenario has neither matrices nor background traffic")
            return
        _try_knobs(work, best, [knob])
        return
    rows = tuple((flow.place, flow.begin, flow.end, flow.value) for flow in flows)
    counted = demand.model_copy(
        update={"counts": (Counts(id="targets", use="compare", rows=rows),)}
    )
    prior = best.scenario.model_copy(update={"demand": counted})
    new = correct_matrix(work.workspace, prior, trust=trust)
    matrices = new.scenario.demand.model_copy(update={"counts": demand.counts})
    changed = best.scenario.model_copy(update={"demand": matrices})
    what = f"matrix: {new.trips_before:,.0f} trips become {new.trips_after:,.0f}"
    work.try_scenario(best, changed, what)


def _try_routes(work: _Work, best: _Best, _trust: float) -> None:
    demand = best.scenario.demand
    if not (demand.matrices or demand.inputs or demand.background):
        work.skip("routes: no traffic of the scenario chooses its routes")
        return
    by_time = [{"by": "travel_time", "spread": spread} for spread in SPREADS]
    tried: list[dict[str, Any]] = [{"by": "length"}, *by_time]
    for fields in tried:
        chosen = demand.routes.model_copy(update=fields)
        if chosen != demand.routes:
            changed = demand.model_copy(update={"routes": chosen})
            scenario = best.scenario.model_copy(update={"demand": changed})
            spread = f", spread {fields['spread']:g}" if "spread" in fields else ""
            work.try_scenario(best, scenario, f"routes by {fields['by']}{spread}")


def _try_drivers(work: _Work, best: _Best, _trust: float) -> None:
    demand = best.scenario.demand
    parts = (demand.matrices, demand.inputs, demand.background, demand.counts)
    if not (any(parts) or best.scenario.actors or best.scenario.flows):
        work.skip("drivers: vehicles of a SUMO project have types of their own")
        return
    _try_knobs(work, best, list(driver_knobs(best.scenario)))


def _try_programs(work: _Work, best: _Best, _trust: float) -> None:
    fitted = [target for target in work.targets if not target.held]
    knobs = list(program_knobs(best.scenario, work.loaded.lights, fitted))
    if not knobs:
        work.skip("programs: no target is at a light whose greens are fixed")
        return
    _try_knobs(work, best, knobs)


def _try_parameters(work: _Work, best: _Best, _trust: float) -> None:
    knobs = list(parameter_knobs(best.scenario))
    if not knobs:
        work.skip("parameters: the scenario has none with bounds")
        return
    _try_knobs(work, best, knobs)


_TRIED: Final[dict[str, Callable[[_Work, _Best, float], None]]] = {
    "matrix": _try_matrix,
    "routes": _try_routes,
    "drivers": _try_drivers,
    "programs": _try_programs,
    "parameters": _try_parameters,
}


def _try_knobs(work: _Work, best: _Best, knobs: Sequence[Knob]) -> None:
    """Search by coordinates: each number goes up or down for as long as that helps.

    The step is a quarter of what is between its bounds, and is halved twice.
    """
    values = {knob.name: knob.start for knob in knobs}
    base, seen = best.scenario, {tuple(values.values())}

    def is_better(knob: Knob, step: float) -> bool:
        new = {**values, knob.name: knob.rounded(values[knob.name] + step)}
        if tuple(new.values()) in seen:
            return False
        seen.add(tuple(new.values()))
        scenario = base
        for other in knobs:
            if new[other.name] != other.start:
                changed = other.apply(scenario, new[other.name])
                if changed == scenario:
                    return False  # a light cannot give so much: a run would be that of another
                scenario = changed
        what = f"{knob.name} {new[knob.name]:g} {knob.unit}".rstrip()
        if not work.try_scenario(best, scenario, what):
            return False
        values.update(new)
        return True

    for share in STEPS:
        for knob in knobs:
            step = share * (knob.high - knob.low)
            for way in (step, -step):
                moved = False
                while is_better(knob, way):
                    moved = True
                if moved:
                    break
    best.doubts += [
        f"{knob.name} has come to the bound of what is usual ({values[knob.name]:g} {knob.unit}): "
        "something else may be off"
        for knob in knobs
        if values[knob.name] != knob.start and values[knob.name] in (knob.low, knob.high)
    ]


# ---------------------------------------------------------------------------- distances


def _average_known(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if known else None


def _measure_distance(
    targets: Sequence[Target], values: Sequence[float | None], *, held: bool
) -> float | None:
    """Mean over the kinds of the root mean square distance; each kind weighs the same."""
    kinds: dict[str, list[float]] = defaultdict(list)
    for target, value in zip(targets, values, strict=True):
        if target.held == held:
            off = _MISSING if value is None else target.distance(value)
            kinds[target.kind].append(min(off, _MISSING) ** 2)
    means = [math.sqrt(sum(squares) / len(squares)) for squares in kinds.values()]
    return round(sum(means) / len(means), 6) if means else None


def _mean_distance(fits: Sequence[TargetFit], *, after: bool) -> float:
    targets = [fit.target._replace(held=False) for fit in fits]
    values = [fit.after if after else fit.before for fit in fits]
    return _measure_distance(targets, values, held=False) or 0.0


_MISSING: Final = 10.0
"""Distance of a target that no run has a value of, and the most that one counts."""
