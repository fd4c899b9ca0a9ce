"""Matrices corrected by counts, and the page that shows how well counts are met."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.app.maps import map_of
from odscen.base.errors import InputError
from odscen.base.markup import join
from odscen.base.text_files import write_text
from odscen.reports.page_templates import html_page, page_head
from odscen.reports.report_demand import ShownCount, counts_section
from odscen.runs.run_settings import AS_DESIGNED
from odscen.sumo.calibrate.matrix_correction import corrected, pair_passages, with_more_trips
from odscen.sumo.runner.assignment import assign_routes, wants_assignment

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from odscen.maps.store import Workspace
    from odscen.records.assignment_steps import AssignmentStep
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.calibrate.count_fit import CountFits
    from odscen.sumo.calibrate.matrix_correction import CorrectedMatrix, Pair, PairPassages


def correct_matrix(
    workspace: Workspace,
    scenario: Scenario,
    *,
    trust: float = 0.1,
    rounds: int = 1,
    iterated: Callable[[AssignmentStep], None] | None = None,
) -> CorrectedMatrix:
    """Correct the matrices of a scenario by its counts.

    Where trips choose routes by travel time, these are found by runs first, in each round with the
    matrix of the round before.

    Parameters
    ----------
    workspace
        Has the map.
    scenario
        The scenario; it is not changed.
    trust
        How much counts are trusted against the matrix; see
        :func:`odscen.sumo.calibrate.matrix_correction.corrected`.
    rounds
        How often routes are found; without travel times one round is all there is.
    iterated
        Called after each iteration of the assignment.

    Returns
    -------
    CorrectedMatrix
        The scenario with corrected matrices, and how well counts are met before and after.

    Raises
    ------
    InputError
        If there is no matrix of vehicles or no count, slices differ in length, or a parameter is
        out of range.
    ScenarioError
        If the scenario has errors.
    """
    if not 0.0 < trust <= 1e6:
        raise InputError(f"trust must be above 0 and at most 1e6, not {trust:g}")
    if not 1 <= rounds <= 20:
        raise InputError(f"rounds must be 1 to 20, not {rounds}")
    loaded = map_of(workspace, scenario)
    if not wants_assignment(scenario):
        return corrected(scenario, loaded.sumo, pair_passages(scenario, loaded.sumo), trust=trust)
    net, assets, current = (
        loaded.entry.checked("net"),
        workspace.assets(),
        _disable_count_demand(scenario),
    )
    passages: dict[Pair, PairPassages] = {}
    for _ in range(rounds):
        found = assign_routes(
            current,
            loaded.sumo,
            net,
            assets,
            settings=AS_DESIGNED,
            wider=with_more_trips(current),
            on_step=iterated,
        )
        # Of pairs that have no trip any more, those of the round before: the next may have some.
        passages |= pair_passages(current, loaded.sumo, found.paths)
        result = corrected(scenario, loaded.sumo, passages, trust=trust)
        current = result.scenario
    return result


def write_fit_page(fits: Sequence[tuple[str, CountFits]], out: Path, *, title: str) -> Path:
    """Write a page with a scatter plot and the counts that are not met; ``fits`` have headings."""
    sections = [
        counts_section(
            [
                ShownCount(
                    row.place, row.begin, row.end, row.counted, row.modelled, row.geh, row.why
                )
                for row in fit.rows
            ],
            heading=heading,
            rmse=fit.rmse or 0.0,
            hours=(sum(hour.met for hour in fit.hours), len(fit.hours)),
        )
        for heading, fit in fits
    ]
    head = page_head("Counts and traffic", title)
    return write_text(out, html_page(f"{title} - counts", join([head, *sections])))


def _disable_count_demand(scenario: Scenario) -> Scenario:
    """Let the counts of a scenario generate nothing."""
    counts = tuple(count.model_copy(update={"use": "compare"}) for count in scenario.demand.counts)
    demand = scenario.demand.model_copy(update={"counts": counts})
    return scenario.model_copy(update={"demand": demand})
