"""Changes of a light that need its whole program: another cycle, and the map's program taken over.

Edits that need the document and the map's lights alone are in
:mod:`odscen.scenario.edits.signal_edits`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from odscen.app.maps import map_of
from odscen.app.scenarios import given_scenario
from odscen.app.signals.signal_optimisation import chosen_lights
from odscen.base.errors import InputError, NotFoundError
from odscen.records.light_programs import stage_spans
from odscen.scenario.checks.signal_checks import signal_problems
from odscen.scenario.document.problems import refuse_errors
from odscen.scenario.document.signals_document import JunctionTiming, ProgramGroup, ProgramStage
from odscen.sumo.calibrate.light_timing import retimed, stretched, timing_of, with_timings
from odscen.sumo.realize.lights.light_realization import realized_lights

if TYPE_CHECKING:
    from odscen.base.given_files import GivenPath
    from odscen.maps.store import Workspace
    from odscen.records.light_programs import LightProgram
    from odscen.scenario.document.scenario_document import Scenario

_DAY = 86_400.0


def stretch_cycle(
    workspace: Workspace,
    scenario: Scenario | GivenPath,
    junction: str,
    *,
    cycle: float,
    plan: str | None = None,
) -> Scenario:
    """Give a light another cycle: greens in proportion to what they are, intergreens as they were.

    Parameters
    ----------
    cycle
        Seconds.
    plan
        Plan of the day; that at the begin of the scenario if not given.

    Raises
    ------
    InputError
        If least greens and intergreens do not fit into the cycle.
    NotFoundError
        If the junction has no light, or the light no such plan.
    ScenarioError
        With every problem of the signals.
    """
    scenario = given_scenario(scenario)
    loaded = map_of(workspace, scenario)
    refuse_errors(signal_problems(scenario.signals, loaded.lights))
    (number,) = chosen_lights(loaded, (junction,))
    shown = realized_lights(scenario, loaded.sumo, until=_DAY)[number].shown
    if plan is not None:
        own = [day_plan for day_plan in shown.plans if day_plan.id == plan]
        if not own:
            raise NotFoundError("plan of the day", plan, [plan.id for plan in shown.plans])
        shown = replace(shown, plans=tuple(own))
    timing = timing_of(scenario, shown.junctions)
    times = stretched(shown, loaded.lights[number], timing, cycle)
    new = with_timings(scenario, [retimed(scenario, times)])
    refuse_errors(signal_problems(new.signals, loaded.lights))
    return new


def take_over_program(
    workspace: Workspace, scenario: Scenario | GivenPath, junction: str
) -> Scenario:
    """Make the map's program of a light one of the scenario, which can be changed as a whole.

    Signal groups, stages and greens are those of the map, with the times that the scenario gives
    them; intergreens are those that the paths need. Control and priority stay, detectors too; with
    actuated control greens have the bounds that they had.

    Raises
    ------
    InputError
        If the light has a program of the scenario already.
    NotFoundError
        If the junction has no light.
    ScenarioError
        With every problem of the signals; greens of a network from outside may conflict.
    """
    scenario = given_scenario(scenario)
    loaded = map_of(workspace, scenario)
    refuse_errors(signal_problems(scenario.signals, loaded.lights))
    (number,) = chosen_lights(loaded, (junction,))
    view = loaded.lights[number]
    old = timing_of(scenario, view.names) or JunctionTiming(junction=view.names[0])
    if old.stages:
        raise InputError(
            f"the light of junction {junction!r} has a program of this scenario already"
        )
    # With fixed-time control every stage comes, and lasts its green.
    fixed = old.model_copy(update={"control": "fixed", "bus_priority": False, "detectors": ()})
    plain = with_timings(scenario, [fixed])
    shown, was = (
        realized_lights(document, loaded.sumo)[number].shown for document in (plain, scenario)
    )
    new = with_timings(scenario, [_own_program(shown, was, old)])
    refuse_errors(signal_problems(new.signals, loaded.lights))
    return new


def _own_program(shown: LightProgram, was: LightProgram, old: JunctionTiming) -> JunctionTiming:
    """Entry of the scenario with groups and stages as they are shown, and the bounds they had."""
    plan = shown.plans[0]
    bounds = {
        stage_span.id: (stage_span.least, stage_span.most)
        for stage_span in stage_spans(was.plans[0])
        if was.control == "actuated" and stage_span.most > stage_span.least
    }
    stages = []
    for span in stage_spans(plan):
        permissive = span.groups(shown, "g")
        least, most = bounds.get(span.id, (None, None))
        stages.append(
            ProgramStage(
                id=span.id,
                protected=tuple(name for name in span.groups(shown) if name not in permissive),
                permissive=permissive,
                green=span.seconds,
                min_green=least,
                max_green=most,
            )
        )
    groups = tuple(ProgramGroup(id=group.id, movements=group.movements) for group in shown.groups)
    control = "fixed" if old.control == "extended" else old.control  # stages of the map alone are
    return old.model_copy(
        update={
            "control": control,
            "groups": groups,
            "stages": tuple(stages),
            "green": (),
            "offset": plan.offset,
        }
    )
