"""Programs of traffic lights against those of today, by paired runs over seeds.

Both sides have the demand, the measures and everything else of one scenario, and differ in what is
said of lights. Runs of one seed are the same traffic under two programs, so that what the programs
make of it is the mean of the differences, with Student's interval.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from odscen.app.running.batches import run_many
from odscen.app.scenarios import given_scenario
from odscen.base.atomic_folders import scratch_folder
from odscen.base.errors import InputError
from odscen.figures.measures.comparison import compare_figure
from odscen.figures.measures.registry import COUNTS
from odscen.records.outcomes import RunStatus
from odscen.runs.recording import Recording
from odscen.runs.reporter import SILENT
from odscen.runs.run_settings import RunSettings

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.base.given_files import GivenPath
    from odscen.figures.measures.comparison import Difference
    from odscen.maps.store import Workspace
    from odscen.runs.finished_run import Run
    from odscen.runs.reporter import Reporter
    from odscen.scenario.document.scenario_document import Scenario

DECIDES = "mean_delay"
"""The figure by which one side is the better one: of all who were due, waits outside included."""

FIGURES = (DECIDES, "mean_latent_delay", "arrived", "teleported", "departure_lateness")
"""What is compared, where runs have it."""

SEEDS = (1, 2, 3, 4, 5)
"""Runs of each side unless others are named."""


@dataclass(frozen=True, slots=True)
class SignalEvaluation:
    """What programs make of the traffic of a scenario, against those of today.

    Attributes
    ----------
    seeds
        Runs of each side.
    differences
        By figure, in its unit; ``a`` is today, ``b`` the programs that are evaluated.
    """

    seeds: tuple[int, ...]
    differences: Mapping[str, Difference]

    @property
    def delay(self) -> Difference:
        """Mean delay of all road users, seconds."""
        return self.differences[DECIDES]

    @property
    def worse(self) -> bool:
        """Whether the mean delay is longer at 95 %."""
        return self.delay.low is not None and self.delay.low > 0.0

    @property
    def better(self) -> bool:
        """Whether the mean delay is shorter at 95 %."""
        return self.delay.high is not None and self.delay.high < 0.0

    @property
    def words(self) -> str:
        """What the programs do, in a sentence."""
        found = self.delay
        if found.a is None or found.b is None or found.difference is None:
            return "No run has a mean delay, so nothing can be said of the programs."
        both = f"Mean delay {found.b:.1f} s, today {found.a:.1f} s"
        if found.low is None or found.high is None:
            return f"{both}: one run of each says no more; take more seeds."
        interval = f"{found.low:+.1f} to {found.high:+.1f} s at 95 %, {found.runs} seeds"
        change = f"{both}: {found.difference:+.1f} s ({interval})"
        if self.worse:
            return f"{change}, worse than today."
        if self.better:
            return f"{change}, better than today."
        return f"{change}, no difference that these seeds can tell."

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready."""
        figures = {
            name: {**asdict(found), "finding": found.finding.value}
            for name, found in self.differences.items()
        }
        verdict = "worse" if self.worse else "better" if self.better else "unclear"
        return {
            "seeds": list(self.seeds),
            "verdict": verdict,
            "words": self.words,
            "figures": figures,
        }


def evaluate_signals(
    workspace: Workspace,
    scenario: Scenario | GivenPath,
    *,
    today: Scenario | GivenPath | None = None,
    seeds: Sequence[int] = SEEDS,
    processes: int = 1,
    reporter: Reporter = SILENT,
) -> SignalEvaluation:
    """Run a scenario with its programs of lights and with those of today, seed by seed.

    Demand, measures and everything but the lights are those of ``scenario`` on both sides.

    Parameters
    ----------
    workspace
        Has the map.
    scenario
        The scenario, or its file, with the programs that are evaluated; it is not changed.
    today
        Scenario, or its file, whose programs are those of today; the map's own if not given.
    seeds
        Of the runs of each side, of which pairs are made.
    processes
        Runs at a time.
    reporter
        Hears of each run.

    Returns
    -------
    SignalEvaluation
        Both sides, their difference with its interval, and one sentence.

    Raises
    ------
    InputError
        If both have the same programs, or other maps, or a run fails.
    ScenarioError
        If the scenario has errors.
    """
    new = given_scenario(scenario)
    lights = type(new.signals)() if today is None else _lights_of(new, given_scenario(today))
    if lights == new.signals:
        what = "the map's own" if today is None else "those of today"
        raise InputError(f"the programs of {new.name!r} are {what}: there is nothing to compare")
    old = new.model_copy(update={"signals": lights})
    # Figures of lanes and positions are not asked for, and are the dearest part of a run.
    settings = RunSettings(recording=Recording(trajectories=False, emissions=False))
    with scratch_folder() as folder:
        runs = run_many(
            workspace, (old, new), settings=settings, seeds=seeds, out=folder,
            processes=processes, reports=False, reporter=reporter,
        )  # fmt: skip
        before, after = (
            {seed: _read_figures(run) for seed, run in zip(seeds, half, strict=True)}
            for half in (runs[: len(seeds)], runs[len(seeds) :])
        )
    differences = {
        name: compare_figure(
            {seed: row.get(name) for seed, row in before.items()},
            {seed: row.get(name) for seed, row in after.items()},
        )
        for name in FIGURES
    }
    known = {
        name: found
        for name, found in differences.items()
        if name == DECIDES or found.a is not None or found.b is not None
    }
    return SignalEvaluation(tuple(seeds), known)


def _lights_of(new: Scenario, today: Scenario) -> Any:
    if (new.map.name, new.map.sha256) != (today.map.name, today.map.sha256):
        raise InputError(
            f"{today.name!r} is on map {today.map.name!r}, {new.name!r} on {new.map.name!r}: "
            "programs are compared on one map"
        )
    return today.signals


def _read_figures(run: Run) -> dict[str, float | None]:
    if run.status != RunStatus.COMPLETED:
        raise InputError(f"a run with seed {run.summary['seed']} has not completed: {run.status}")
    counts, figures = run.summary["actors"], run.summary["figures"]
    return {name: (counts if name in COUNTS else figures).get(name) for name in FIGURES}
