"""What a sweep will take, measured with one of its cases before it starts."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Final

from odscen.app.running.batches import run_all
from odscen.app.running.runs import check_run
from odscen.base.errors import InputError, ScenarioError
from odscen.experiments.sweeps.sweep_runs import WATCHES_CLOSENESS, refuse_unknown
from odscen.experiments.sweeps.sweep_table import limits_of, named_cases
from odscen.records.outcomes import RunStatus
from odscen.runs.run_settings import RunSettings
from odscen.scenario.sweeps.sweep_plan import concrete

if TYPE_CHECKING:
    from odscen.app.running.runs import CheckedRun
    from odscen.experiments.sweeps.sweep_folder import SweepSettings
    from odscen.maps.store import Workspace
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.sweeps.sweep_plan import SweepPlan

PATIENCE: Final = 60.0
"""Wall seconds that the one case may take."""
_TRIED: Final = 8
"""Cases that are looked at until one is possible."""


@dataclass(frozen=True, slots=True)
class SweepEstimate:
    """What one case has taken.

    Attributes
    ----------
    case
        Its name; it is one from the middle of the plan.
    seconds
        Wall seconds of computing.
    disk
        Bytes of its folder.
    whole
        Whether it came to its end; if not, it takes longer.
    """

    case: str
    seconds: float
    disk: int
    whole: bool


def estimate(
    workspace: Workspace,
    scenario: Scenario,
    plan: SweepPlan,
    *,
    settings: SweepSettings,
    patience: float = PATIENCE,
) -> SweepEstimate:
    """Run one case of a plan and measure it; nothing of it is kept.

    Parameters
    ----------
    patience
        Wall seconds after which it is given up.

    Raises
    ------
    InputError
        If a parameter, limit or figure is unknown, or no case that was tried is possible.
    """
    refuse_unknown(plan.names, scenario)
    limits_of(settings)
    with TemporaryDirectory(prefix="odscen-sweep-") as folder:
        began = time.monotonic()
        run = _possible(workspace, scenario, plan, settings, patience, Path(folder))
        (ended,) = run_all([run], reports=False, figures=False)
        seconds = time.monotonic() - began
        disk = sum(file.stat().st_size for file in run.folder.rglob("*") if file.is_file())
    whole = ended.status is RunStatus.COMPLETED
    if not whole and seconds < patience:
        raise InputError(f"{run.name} was tried, and has failed: {ended.known['error']}")
    return SweepEstimate(run.name, seconds, disk, whole)


def _possible(
    workspace: Workspace,
    scenario: Scenario,
    plan: SweepPlan,
    settings: SweepSettings,
    patience: float,
    out: Path,
) -> CheckedRun:
    """A case that can be run, as near to the middle of the plan as can be."""
    cases = list(named_cases(plan).items())
    nearest = sorted(range(len(cases)), key=lambda index: abs(index - len(cases) // 2))
    given = RunSettings(seed=settings.seed, recording=WATCHES_CLOSENESS, time_limit=patience)
    first: ScenarioError | None = None
    for name, values in (cases[index] for index in nearest[:_TRIED]):
        try:
            case = concrete(scenario, values, name=name)
            return check_run(workspace, case, name=name, out=out, settings=given)
        except ScenarioError as error:
            first = first or error
    reason = "" if first is None else "; ".join([first.problem, *first.problems])
    raise InputError(f"of the cases that were tried none is possible: {reason}")
