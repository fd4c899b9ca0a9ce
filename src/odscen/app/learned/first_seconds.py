"""What SUMO does with generated traffic in its first two seconds, above all hard braking."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.app.learned.snapshot_data import BRAKING_SECONDS, braking_of
from odscen.app.running.batches import run_all
from odscen.app.running.runs import check_run
from odscen.base.atomic_folders import scratch_folder
from odscen.base.categories import Category
from odscen.base.errors import InputError
from odscen.runs.recording import Recording
from odscen.runs.run_settings import RunSettings

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.base.arrays import FloatArray
    from odscen.maps.store import Workspace
    from odscen.scenario.document.scenario_document import Scenario

HARD = 4.0
"""m/s²; a vehicle that brakes harder brakes hard. SUMO's cars brake with up to 4.5 as a habit."""
STEP = 0.5


class FirstSeconds(NamedTuple):
    """What became of the vehicles of one scenario.

    ``braking`` is the strongest deceleration of each that came onto the road, m/s²; ``collided``
    and ``inserted`` are shares of those planned.
    """

    braking: FloatArray
    collided: float
    inserted: float


def first_seconds(workspace: Workspace, scenarios: Sequence[Scenario]) -> list[FirstSeconds]:
    """Run scenarios for two seconds.

    Raises
    ------
    ScenarioError
        With every error of a scenario.
    InputError
        If a run fails.
    """
    with scratch_folder() as folder:
        settings = RunSettings(
            until=BRAKING_SECONDS + STEP,
            step_length=STEP,
            warm_up=0.0,
            recording=Recording(emissions=False),
        )
        checked = [
            check_run(workspace, one, name=f"{place:03d}", out=folder, settings=settings)
            for place, one in enumerate(scenarios)
        ]
        found = []
        for run in run_all(checked, reports=False, figures=False):
            if run.exit_code == 3:
                raise InputError(
                    f"the run has failed: {run.known.get('error')}", file=run.known.get("scenario")
                )
            rows = run.trajectories()
            rows = rows.filter(rows["category"] != str(Category.PEDESTRIAN))
            first = rows.filter(rows["time"] < STEP / 2.0)["id"].to_list()
            planned = max(run.counts["planned"], 1)
            braking = braking_of(rows, 0.0, first)
            found.append(
                FirstSeconds(
                    braking[~np.isnan(braking)],
                    run.counts["collided"] / planned,
                    run.counts["inserted"] / planned,
                )
            )
    return found
