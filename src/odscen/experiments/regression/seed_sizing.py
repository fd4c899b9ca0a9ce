"""Choose the seeds of a new baseline, scenario by scenario, so that they catch what they are to.

How far differences scatter where something has changed, only a change can tell, and changes are not
alike in it. So a pilot runs each scenario as it is and, with the same seeds, with two changes:
drivers who keep a longer headway, chosen so that the figure changes by about as much as is to be
caught, and steps of another length, which move all traffic about. The one that scatters more
counts. More seeds are run as long as those that are there ask for more.
"""

from __future__ import annotations

import shutil
from dataclasses import replace
from statistics import fmean
from typing import TYPE_CHECKING

from odscen.experiments.regression.detection import size_of
from odscen.experiments.regression.scatter import FEWEST_SEEDS
from odscen.sumo.realize.driving import normal_headway

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.app.running.runs import CheckedRun
    from odscen.experiments.regression.detection import Detection
    from odscen.experiments.suites.suite import Case
    from odscen.experiments.suites.suite_loading import LoadedCase
    from odscen.experiments.suites.suite_runs import RunPlace, SeedRunner
    from odscen.runs.run_settings import RunSettings
    from odscen.scenario.document.scenario_document import Scenario

PILOT = 16
"""Seeds, at least, from which the scatter of differences is estimated."""

PROBE = 1.0
"""Seconds more of headway with which its effect on the figure is estimated."""

_LEAST, _MOST = 0.02, 1.5
"""Share of the probe, at least and at most, that the pilot takes."""

_LONGEST = 5.0
"""Seconds of headway that a scenario may have."""

_LONGEST_STEP = 1.0
"""Seconds."""


def choose_seeds(
    cases: Sequence[LoadedCase], runner: SeedRunner, place: RunPlace, aside: RunPlace
) -> None:
    """Give each case that has a change to catch its seeds, its sizing and its runs.

    A case with runs that fail keeps the seeds that it was run with, and has no sizing.

    Parameters
    ----------
    place
        Of runs of the scenarios as they are.
    aside
        Of runs of the scenarios with a change, none of which stays.
    """
    pilots = [_Pilot(case, case.case.detect) for case in cases if case.case.detect is not None]
    pilots = _run_as_they_are(pilots, runner, place)
    for pilot in pilots:
        pilot.slower = pilot.with_headway(PROBE, seeds=FEWEST_SEEDS)
    runner.run([pilot.slower for pilot in pilots], aside)
    for pilot in pilots:
        pilot.slower = pilot.with_headway(pilot.more_headway(), seeds=pilot.count)
    while pilots:
        runner.run([pilot.slower for pilot in pilots], aside)
        runner.run([pilot.stepped for pilot in pilots], aside)
        pilots = [pilot for pilot in pilots if pilot.goes_on()]
        pilots = _run_as_they_are(pilots, runner, place)


def _run_as_they_are(pilots: Sequence[_Pilot], runner: SeedRunner, place: RunPlace) -> list[_Pilot]:
    """Run scenarios with the seeds that they are to have by now; those that work are left."""
    for pilot in pilots:
        pilot.case.case = _with_seeds(pilot.case, pilot.count)
    runner.run([pilot.case for pilot in pilots], place)
    return [pilot for pilot in pilots if _works(pilot.case)]


def _works(case: LoadedCase) -> bool:
    return not case.refused and not any(run.error for run in case.runs.values())


def _with_seeds(case: LoadedCase, count: int) -> Case:
    return replace(case.case, seeds=tuple(range(1, count + 1)))


class _Pilot:
    """A scenario as it is and, with the same seeds, with changes; ``count`` seeds by now."""

    def __init__(self, case: LoadedCase, detect: Detection) -> None:
        self.case = case
        self.detect = detect
        self.count = min(PILOT, detect.seeds_max)
        self.slower = case
        self.stepped = self._changed(
            replace(case.run, settings=with_other_steps(case.run)), seeds=self.count
        )

    def _changed(self, run: CheckedRun, *, seeds: int) -> LoadedCase:
        return replace(self.case, case=_with_seeds(self.case, seeds), run=run, runs={}, refused={})

    def with_headway(self, more: float, *, seeds: int) -> LoadedCase:
        """The scenario with drivers who keep so many seconds more."""
        run = replace(self.case.run, scenario=with_longer_headway(self.case.run.scenario, more))
        return self._changed(run, seeds=seeds)

    def more_headway(self) -> float:
        """Seconds with which the figure changes by what is to be caught, if it is proportional."""
        pairs = self._pairs(self.slower)
        effect = abs(fmean(new - old for old, new in pairs)) if pairs else 0.0
        share = self.detect.size(fmean(old for old, _ in pairs)) / effect if effect else _MOST
        return PROBE * min(_MOST, max(_LEAST, share))

    def goes_on(self) -> bool:
        """Whether more seeds are to be run; else the case has its seeds."""
        pairs = self._pairs(self.slower)
        if len(pairs) < FEWEST_SEEDS:
            self.case.refused[-1] = (
                f"{len(pairs)} of {self.count} pairs of runs, as it is and with a longer headway, "
                f"have {self.detect.figure.name}; {FEWEST_SEEDS} are needed to choose seeds"
            )
            return False
        sizing = size_of(self.detect, pairs, self._pairs(self.stepped))
        if sizing.seeds > self.count:
            self.count = min(sizing.seeds, 2 * self.count)
            for changed in (self.slower, self.stepped):
                changed.case = _with_seeds(changed, self.count)
            return True
        self.case.case = _with_seeds(self.case, sizing.seeds)
        self.case.sizing = sizing
        self._leave_others()
        return False

    def _pairs(self, changed: LoadedCase) -> list[tuple[float, float]]:
        """The figure as it is and with a change, of seeds that have it on both sides."""
        key = self.detect.key
        found = [
            (run.figures.get(key), changed.runs[seed].figures.get(key))
            for seed, run in sorted(self.case.runs.items())
            if seed in changed.runs
        ]
        return [(old, new) for old, new in found if old is not None and new is not None]

    def _leave_others(self) -> None:
        """Forget runs of the pilot that the baseline does not need."""
        for seed in self.case.runs.keys() - set(self.case.case.seeds):
            run = self.case.runs.pop(seed)
            if run.folder is not None:
                shutil.rmtree(run.folder)


def with_longer_headway(scenario: Scenario, more: float) -> Scenario:
    """Let drivers keep so many seconds more; driver sets with a headway of their own stay."""
    headway = min(_LONGEST, normal_headway(scenario.drivers) + more)
    drivers = scenario.drivers.model_copy(
        update={"headway": round(headway, 3), "saturation_flow": None}
    )
    return scenario.model_copy(update={"drivers": drivers})


def with_other_steps(run: CheckedRun) -> RunSettings:
    """Double the length of steps; half it where that would be above a second."""
    step = run.settings.step_length or run.scenario.simulation.step_length
    return replace(run.settings, step_length=2 * step if 2 * step <= _LONGEST_STEP else step / 2)
