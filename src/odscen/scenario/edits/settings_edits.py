"""A new scenario, and changes to its name, seed, run, environment and traffic lights."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any

from odscen.base.errors import NotFoundError
from odscen.scenario.checks.scenario_checks import roi_problems
from odscen.scenario.checks.signal_timing import signal_problems
from odscen.scenario.document.problems import refuse_errors
from odscen.scenario.document.scenario_document import Environment, MapReference, Scenario
from odscen.scenario.document.signals_document import JunctionTiming
from odscen.scenario.document.validation import validated
from odscen.scenario.edits.edit_registry import edit
from odscen.scenario.edits.edited_parts import (
    changed_part,
    with_fields,
)
from odscen.scenario.signals.light import find_light

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from odscen.lanegraph.graphs import MapGraph
    from odscen.scenario.document.drivers_document import Drivers
    from odscen.scenario.document.scenario_document import Simulation
    from odscen.scenario.document.signals_document import Control
    from odscen.scenario.signals.light import Light


def new_scenario(
    graph: MapGraph, *, name: str, roi: Iterable[str] = (), seed: int = 0, description: str = ""
) -> Scenario:
    """Start an empty scenario on a map.

    Parameters
    ----------
    roi
        Segments of the region of interest, connected; may be left empty and grown later.

    Raises
    ------
    ScenarioError
        If a segment is unknown or the region is in several pieces.
    """
    fields = {
        "name": name,
        "description": description,
        "seed": seed,
        "map": MapReference(
            name=graph.map_name, sha256=graph.map_sha256, spacing=graph.lanes.spacing
        ),
        "roi": tuple(roi),
    }
    scenario = validated(Scenario, fields)
    if scenario.roi:
        refuse_errors(roi_problems(scenario, graph))
    return scenario


@edit("Rename to {name}")
def rename(scenario: Scenario, *, name: str, description: str | None = None) -> Scenario:
    """Give the scenario another name and, if given, another description."""
    changes = {"name": name} if description is None else {"name": name, "description": description}
    return with_fields(scenario, **changes)


@edit("Change the seed")
def set_seed(scenario: Scenario, *, seed: int) -> Scenario:
    """Set the random seed of the open goals and of the run."""
    return with_fields(scenario, seed=seed)


@edit("Change the run's settings")
def set_simulation(scenario: Scenario, **fields: Annotated[Any, Simulation]) -> Scenario:
    """Change fields of :class:`~odscen.scenario.document.scenario_document.Simulation`."""
    return with_fields(scenario, simulation=changed_part(scenario.simulation, fields))


@edit("Change weather and time")
def set_environment(
    scenario: Scenario,
    *,
    preset: str | None = None,
    parameters: Mapping[str, float] | None = None,
    affects_driving: bool | None = None,
) -> Scenario:
    """Change weather and time of day; a new preset drops the old parameters (R33)."""
    fields: dict[str, Any] = {}
    if preset is not None:
        fields = {"preset": preset, "parameters": {}}
    if parameters is not None:
        fields["parameters"] = dict(parameters)
    if affects_driving is not None:
        fields["affects_driving"] = affects_driving
    environment: Environment = changed_part(scenario.environment, fields)
    return with_fields(scenario, environment=environment)


@edit("Change how drivers drive")
def set_drivers(scenario: Scenario, **fields: Annotated[Any, Drivers]) -> Scenario:
    """Change fields of :class:`~odscen.scenario.document.scenario_document.Drivers`."""
    return with_fields(scenario, drivers=changed_part(scenario.drivers, fields))


@edit("Traffic lights {control}")
def set_signal_control(scenario: Scenario, *, control: Control) -> Scenario:
    """Say how all traffic lights are run that have no control of their own."""
    return with_fields(scenario, signals=changed_part(scenario.signals, {"control": control}))


@edit("Timing of light {junction}")
def set_timing(
    scenario: Scenario,
    lights: Sequence[Light],
    junction: str,
    **fields: Annotated[Any, JunctionTiming],
) -> Scenario:
    """Change how the traffic light of one junction is timed.

    Parameters
    ----------
    lights
        Traffic lights of the map.
    fields
        Fields of a :class:`~odscen.scenario.document.signals_document.JunctionTiming`,
        such as ``green``; those not given stay as they are.

    Raises
    ------
    ScenarioError
        If no light is in the junction, or if it cannot be timed so.
    """
    timings = scenario.signals.junctions
    light = find_light(lights, junction)
    own = [n for n, one in enumerate(timings) if light and one.junction in light.names]
    old = timings[own[0]] if own else JunctionTiming(junction=junction)
    new = changed_part(old, fields)
    changed = (*timings[: own[0]], new, *timings[own[0] + 1 :]) if own else (*timings, new)
    signals = changed_part(scenario.signals, {"junctions": changed})
    own_place = f"signals.junctions[{own[0] if own else len(timings)}]"
    # A file may have greens of a former network; who changes them now gives one for each stage.
    refuse_errors(
        replace(one, severity="error")
        if "green" in fields and one.where == f"{own_place}.green"
        else one
        for one in signal_problems(signals, lights)
    )
    return with_fields(scenario, signals=signals)


@edit("Timing of light {junction} as in the map")
def clear_timing(scenario: Scenario, junction: str) -> Scenario:
    """Give the traffic light of one junction back to the map's program.

    Raises
    ------
    NotFoundError
        If the scenario has no timing for it.
    """
    timings = scenario.signals.junctions
    names = [one.junction for one in timings]
    if junction not in names:
        what = "timing of junction"
        raise NotFoundError(what, junction, names)
    left = tuple(one for one in timings if one.junction != junction)
    return with_fields(scenario, signals=changed_part(scenario.signals, {"junctions": left}))
