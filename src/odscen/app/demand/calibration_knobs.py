"""What a calibration may change of a scenario, one number at a time, and within which bounds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from odscen.base.errors import InputError, ScenarioError
from odscen.lanegraph.segments import segment_name
from odscen.scenario import edits
from odscen.scenario.demand.scaled_demand import scalable, scaled
from odscen.scenario.document.json_form import with_values
from odscen.scenario.edits.program_changes import stages_in_plan, timing_of_light
from odscen.sumo.realize.driving import normal_headway

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from odscen.scenario.demand.targets import Target
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.signals.light import Light

HEADWAYS: Final = (0.8, 2.0)
"""Mean desired headways, s, that were measured in traffic; outside these something else is off."""
GAPS: Final = (0.0, 1.0)
EAGERNESS: Final = (0.2, 3.0)
AMOUNTS: Final = (0.5, 2.0)
GREEN_SHIFT: Final = 10.0
"""Seconds that a green may become longer or shorter."""
LEAST_GREEN: Final = 5.0


@dataclass(frozen=True, slots=True)
class Knob:
    """A number that may change: its bounds, what it is now, and the scenario with another."""

    name: str
    unit: str
    low: float
    high: float
    start: float
    apply: Callable[[Scenario, float], Scenario]
    whole: bool = False

    def rounded(self, value: float) -> float:
        """A value within the bounds, with as many digits as make sense."""
        value = min(max(value, self.low), self.high)
        return float(round(value)) if self.whole else round(value, 3)


def amount_knob(scenario: Scenario) -> Knob | None:
    """The amount of traffic: that of a SUMO project, or of matrices and background traffic."""
    if scenario.sumo is not None:
        start = float((scenario.sumo.options or {}).get("scale", 1.0))
        return Knob("amount", "of the project", *AMOUNTS, start, _scale_project)
    if scalable(scenario.demand):
        before = scenario.demand

        def apply(changed: Scenario, factor: float) -> Scenario:
            return changed.model_copy(update={"demand": scaled(before, factor)})

        return Knob("amount", "of the demand", *AMOUNTS, 1.0, apply)
    return None


def driver_knobs(scenario: Scenario) -> Iterator[Knob]:
    """What drivers of the scenario do; a SUMO project's own vehicles have types of their own."""
    drivers = scenario.drivers
    if drivers.saturation_flow is not None:
        yield Knob(
            "saturation_flow", "veh/h", 1400.0, 2200.0, drivers.saturation_flow,
            _driver_setter("saturation_flow"), whole=True,
        )  # fmt: skip
    else:
        headway = normal_headway(drivers)
        yield Knob("headway", "s", *HEADWAYS, headway, _driver_setter("headway"))
    gaps = _driver_setter("gap_acceptance")
    yield Knob("gap_acceptance", "", *GAPS, drivers.gap_acceptance, gaps)
    eagerness = _driver_setter("lane_change_eagerness")
    yield Knob("lane_change_eagerness", "", *EAGERNESS, drivers.lane_change_eagerness, eagerness)


def program_knobs(
    scenario: Scenario, lights: Sequence[Light], targets: Sequence[Target]
) -> Iterator[Knob]:
    """Greens of the lights that targets lie at; seconds go to the next stage or come from it."""
    junctions = {part for target in targets for part in target.place.split(">")}
    for light in lights:
        named = (name for name in light.names if segment_name("junction", name) in junctions)
        junction = next(named, None)
        if junction is None:
            continue
        _, timing = timing_of_light(scenario, lights, junction)
        if timing.plans:
            continue  # which of them is wrong, targets do not say
        for stage in stages_in_plan(timing, light, None)[:-1]:
            low = min(max(LEAST_GREEN, stage.green - GREEN_SHIFT), stage.green)
            yield Knob(
                f"green of {junction}, stage {stage.id}", "s", low, stage.green + GREEN_SHIFT,
                stage.green, _green_setter(lights, junction, stage.id), whole=True,
            )  # fmt: skip


def parameter_knobs(scenario: Scenario) -> Iterator[Knob]:
    """Parameters of the scenario that have bounds."""
    computed = _find_computed(scenario)
    for name, parameter in scenario.parameters.items():
        if parameter.min is not None and parameter.max is not None and name not in computed:
            yield Knob(
                name, parameter.unit, parameter.min, parameter.max, parameter.value,
                _parameter_setter(name),
            )  # fmt: skip


def _find_computed(scenario: Scenario) -> set[str]:
    """Parameters that are formulas of others."""
    places = (place.strip("/").split("/") for place in scenario.formulas)
    return {parts[1] for parts in places if parts[0] == "parameters" and len(parts) > 1}


def _scale_project(scenario: Scenario, factor: float) -> Scenario:
    project = scenario.sumo
    if project is None:
        raise InputError("the scenario has no SUMO project whose traffic could be more or less")
    options = {**(project.options or {}), "scale": f"{factor:g}"}
    return scenario.model_copy(update={"sumo": project.model_copy(update={"options": options})})


def _driver_setter(field: str) -> Callable[[Scenario, float], Scenario]:
    return lambda scenario, value: edits.set_drivers(scenario, **{field: value})


def _parameter_setter(name: str) -> Callable[[Scenario, float], Scenario]:
    return lambda scenario, value: with_values(scenario, {name: value})


def _green_setter(
    lights: Sequence[Light], junction: str, stage: str
) -> Callable[[Scenario, float], Scenario]:
    def apply(scenario: Scenario, value: float) -> Scenario:
        try:
            return edits.set_green(
                scenario, lights, junction, stage=stage, green=value, keep_cycle=True
            )
        except ScenarioError:
            return scenario  # the next stage cannot give so much

    return apply
