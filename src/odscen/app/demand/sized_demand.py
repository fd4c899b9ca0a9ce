"""Demand that fits its network: tried by runs of its busiest hour before it is promised.

Capacities of lanes and signals only propose an amount: spillback, lane changes, turns across
oncoming traffic and whatever else a map has that nobody has seen are not part of them. So the
busiest hour is run with :data:`MARGIN` times what is to be promised, and the largest amount is
taken with which that run is ``usable`` with each of :data:`SEEDS` seeds: no gridlock, nearly no
teleports, everyone inserted and served (:mod:`odscen.figures.measures.usability`).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.app.maps import map_of
from odscen.app.running.runs import carry_out, check_run, prepare_run
from odscen.base.atomic_folders import scratch_folder
from odscen.base.errors import InputError, NotFoundError
from odscen.figures.measures.usability import UsabilityLevel
from odscen.runs.recording import Recording
from odscen.runs.reporter import Reporter
from odscen.runs.run_settings import RunSettings
from odscen.scenario.demand.scaled_demand import (
    excerpt,
    part_trips,
    scalable,
    scaled,
    trips_of,
)
from odscen.scenario.document.scenario_document import Background
from odscen.sumo.calibrate.town_day import carried_background

if TYPE_CHECKING:
    from collections.abc import Callable

    from odscen.maps.store import Workspace
    from odscen.records.run_plan import Plan
    from odscen.runs.finished_run import Run
    from odscen.runs.reporter import Progress
    from odscen.scenario.document.scenario_document import Scenario

MARGIN = 1.1
"""Times the promised demand that is tried."""
SEEDS = 2
"""Random seeds with which an amount has to be usable, from the scenario's own on."""
LESS = 0.7
"""Times the demand after a trial that was not usable, until one is."""
LEAST = 0.02
"""Share of the demand below which the demand is not what the run suffers from."""
BACKLOG = 0.2
"""Share of a trial's road users that wait for room to depart at one time, above which it ends at
once. A backlog cannot grow faster than demand comes, so that the verdict is certain: over 90
minutes the latent delay would be more than a minute."""
HALVINGS = 2
"""Times that the interval between a usable and a not usable amount is halved."""


@dataclass(frozen=True, slots=True)
class DemandTrial:
    """A run of the busiest hour.

    Attributes
    ----------
    share
        Of the demand proposed that would be promised; :data:`MARGIN` times that was tried.
    vehicles
        Road users of the run.
    seconds
        Simulated time of the run.
    headline
        The verdict in words.
    """

    share: float
    seed: int
    vehicles: int
    seconds: float
    usable: bool
    headline: str

    @property
    def words(self) -> str:
        """One line for people."""
        return (
            f"{_format_percent(self.share)} of the demand and "
            f"{_format_percent(MARGIN - 1.0)} more, "
            f"{self.vehicles:,} road users in {self.seconds / 60.0:.0f} min, seed {self.seed}: "
            f"{self.headline}"
        )


@dataclass(frozen=True, slots=True)
class DemandSizing:
    """What was tried, and what is promised: ``share`` of the demand proposed, ``trips`` in all."""

    share: float
    trips: float
    trials: tuple[DemandTrial, ...]

    @property
    def words(self) -> str:
        """A sentence for people."""
        refused = [trial.share for trial in self.trials if not trial.usable]
        also = f"; {_format_percent(min(refused))} is too much" if refused else ""
        amount = f" ({self.trips:,.0f} trips)" if self.trips else ""
        return (
            f"{_format_percent(self.share)} of the demand{amount} fits: "
            f"with {_format_percent(MARGIN - 1.0)} "
            f"more its busiest hour is usable with {SEEDS} seeds{also} ({len(self.trials)} runs)"
        )

    def to_dict(self) -> dict[str, Any]:
        """For ``--json``."""
        keys = ("share", "seed", "vehicles", "seconds", "usable", "headline")
        return {
            "share": self.share,
            "margin": MARGIN,
            "trials": [{key: getattr(trial, key) for key in keys} for trial in self.trials],
        }


def proposed_background(workspace: Workspace, scenario: Scenario, **fields: Any) -> float:
    """Trips of background traffic that the junctions of a scenario's region may carry.

    Parameters
    ----------
    fields
        Of ``Background``, without an amount.

    Raises
    ------
    InputError
        If no trips are possible in the region.
    ValueError
        If a field is not possible.
    """
    part = Background.model_validate({"id": "proposed", "trips": 1.0, **fields})
    graph_map = map_of(workspace, scenario).sumo
    per_hour = carried_background(scenario, graph_map, mix=part.mix)
    return round(part_trips(scenario, part, per_hour=per_hour), 1)


def sized(
    workspace: Workspace,
    scenario: Scenario,
    *,
    only: str | None = None,
    tell: Callable[[str], None] | None = None,
) -> tuple[Scenario, DemandSizing]:
    """Give a scenario the largest share of its demand that its network carries, tried by runs.

    Matrices and background traffic become less, never more; inputs, counts, flows and actors stay.

    Parameters
    ----------
    only
        Name of the one matrix or background traffic that becomes less.
    tell
        Called with what was found, after each run.

    Raises
    ------
    NotFoundError
        If nothing has the name ``only``.
    InputError
        If there is no such demand, or the run is not usable with next to none of it.
    ScenarioError
        If the scenario has errors.
    """
    known = scalable(scenario.demand)
    if not known:
        raise InputError("the scenario has no matrices and no background traffic to be sized")
    if only is not None and only not in known:
        raise NotFoundError("matrix or background traffic", only, known)
    trials = _Trials(workspace, scenario, only, tell)
    share = largest_share(trials.usable)
    if share is None:
        last = trials.done[-1]
        raise InputError(
            f"even {_format_percent(last.share)} of the demand is too much: {last.headline}"
        )
    if share < 1.0:
        demand = scaled(scenario.demand, share, only=only)
        scenario = scenario.model_copy(update={"demand": demand})
    return scenario, DemandSizing(share, trips_of(scenario.demand), tuple(trials.done))


def largest_share(usable: Callable[[float], bool]) -> float | None:
    """Find the largest share up to 1 that is usable, to the fineness of :data:`HALVINGS`.

    ``None`` if none from :data:`LEAST` on is.
    """
    high = low = 1.0
    while not usable(low):
        high, low = low, round(LESS * low, 4)
        if low < LEAST:
            return None
    for _ in range(HALVINGS if low < 1.0 else 0):
        middle = round((low + high) / 2.0, 4)
        if usable(middle):
            low = middle
        else:
            high = middle
    return low


@dataclass(slots=True)
class _Trials:
    """Runs of the busiest hour of one scenario, without trajectories, in folders that are gone."""

    workspace: Workspace
    scenario: Scenario
    only: str | None
    tell: Callable[[str], None] | None
    done: list[DemandTrial] = field(default_factory=list)

    def usable(self, share: float) -> bool:
        """Whether a share of the demand is usable with every seed; ends with the first not so."""
        more = scaled(self.scenario.demand, share * MARGIN, only=self.only)
        hour = excerpt(self.scenario.model_copy(update={"demand": more}))
        return all(self._run_trial(hour, share, number) for number in range(SEEDS))

    def _run_trial(self, hour: Scenario, share: float, number: int) -> bool:
        settings = RunSettings(
            seed=(hour.seed + number) % 2**31,
            recording=Recording(trajectories=False, emissions=False),
            slice_length=None,
            warm_up=0.0,
        )
        with scratch_folder() as folder:
            checked = check_run(self.workspace, hour, name="trial", out=folder, settings=settings)
            prepared = prepare_run(checked)
            try:
                limit = _BacklogLimit(prepared.plan)
                run = carry_out(checked, prepared, reporter=limit, reports=False)
                level, headline = (run.usability[key] for key in ("level", "headline"))
                # Whether it was noticed in time is a matter of the machine, the words are not.
                waiting = _most_waiting(run, prepared.plan.until)
                backlog = waiting > BACKLOG * len(prepared.plan.actors)
            except _BacklogError:
                backlog = True
            if backlog:
                level = UsabilityLevel.NOT_USABLE
                headline = (
                    f"{level}: more than {_format_percent(BACKLOG)} "
                    "had no room to depart at one time"
                )
        plan = prepared.plan
        usable = level == UsabilityLevel.USABLE
        trial = DemandTrial(share, plan.seed, len(plan.actors), plan.until, usable, headline)
        self.done.append(trial)
        if self.tell is not None:
            self.tell(trial.words)
        return trial.usable


class _BacklogError(Exception):
    """A trial has so many road users who cannot depart that it need not be run to its end."""


class _BacklogLimit(Reporter):
    """Stops a run with a backlog above :data:`BACKLOG`."""

    def __init__(self, plan: Plan) -> None:
        self._departs = np.sort([actor.depart for actor in plan.actors])

    def advanced(self, progress: Progress) -> None:
        due = int(np.searchsorted(self._departs, progress.time))
        if due - progress.departed > BACKLOG * len(self._departs):
            raise _BacklogError


def _most_waiting(run: Run, until: float) -> int:
    """Road users who were due before the run's end and not inserted at one time, at most."""
    table = run.actors()
    table = table.filter(table["depart"] < until)
    depart, inserted = (table[name].to_numpy() for name in ("depart", "inserted"))
    times = np.concatenate([depart, inserted])
    change = np.repeat([1, -1], len(depart))
    happened = np.isfinite(times)
    order = np.lexsort((-change[happened], times[happened]))
    return int(np.cumsum(change[happened][order]).max(initial=0))


def _format_percent(share: float) -> str:
    return f"{100.0 * share:.0f} %"
