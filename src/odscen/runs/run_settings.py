"""How a scenario is run: one frozen object that goes unchanged from the door to the worker."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, Literal, Self

from odscen.base.errors import InputError
from odscen.figures.by_place.analysis_times import AnalysisTimes
from odscen.figures.judging.criteria import criteria_of
from odscen.figures.judging.expectations import Expectation, needs_criticality, parse_expectation
from odscen.learning.behaviour.behaviour_model import BehaviourDoor
from odscen.runs.recording import Recording
from odscen.scenario.document.scenario_document import AFTER_STORY
from odscen.scenario.sampling.sampler import REDRAWS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.learning.offered_options import OptionValue
    from odscen.scenario.document.scenario_document import AfterStory, Scenario
    from odscen.scenario.sampling.sampler import Redraw

SliceLength = float | Literal["auto"] | None
"""Seconds of the slices of a long run; ``auto`` what suits it, ``None`` none."""

_SEEDS = 2**31
_LONGEST = 1e9
"""Seconds that a run may last, as in the document."""


def _refuse_other_type(name: str, value: object, kinds: type | tuple[type, ...], need: str) -> None:
    """Refuse a value that a type checker would have refused: it would fail later, and elsewhere."""
    if value is None or (isinstance(value, kinds) and not isinstance(value, bool)):
        return
    raise InputError(f"{name} must be {need}, not {value!r}")


def _refuse_time(name: str, seconds: float | None, *, most: float = math.inf) -> None:
    _refuse_other_type(name, seconds, (int, float), "a number of seconds")
    if seconds is not None and not (0 < seconds <= most and math.isfinite(seconds)):
        limit = f" and at most {most:g}" if math.isfinite(most) else ""
        raise InputError(f"{name} must be above 0{limit} s, not {seconds:g}")


@dataclass(frozen=True, slots=True, kw_only=True)
class RunSettings:
    """How a scenario is run; times are in seconds.

    Attributes
    ----------
    seed
        Random seed, 0 to 2^31 - 1; the scenario's own if ``None``.
    redraw
        What the seed draws: ``open`` what the scenario leaves open; ``drivers`` also departures,
        desired speeds and styles of placed actors; ``traffic`` also their goals
        (:func:`odscen.scenario.sampling.sampler.redrawn`).
    until
        Simulated time at which the run ends at the latest, above 0; the scenario's own duration if
        ``None``.
    step_length
        Simulated time of a step, above 0 and at most 1; the scenario's own if ``None``.
    weather
        Whether weather acts on driving; the scenario can also switch it off itself.
    recording
        What is recorded. :attr:`recorded` is that with what the expectations ask for.
    meso
        Queues on road sections instead of single vehicles that follow each other: for scale.
    slice_length
        A longer run goes in slices of this simulated time and can be resumed; ``auto`` for what
        suits it (see :func:`odscen.sumo.realize.realization.slices_of`), ``None`` for one piece,
        however long.
    time_limit
        Wall time after which the run is stopped and has failed; ``None`` for no limit.
    expectations
        What must come out; the summary says of each whether it is met.
    warm_up
        Simulated time from the start that figures leave out, in whole seconds; the scenario's own
        if ``None``.
    interval
        Of figures over time, in whole seconds; the scenario's own if ``None``.
    behaviour
        What drives vehicles instead of SUMO; ``None``: nothing does.
    after_story
        Simulated time for which the run goes on once its story has ended, ``never`` for all of its
        duration, ``auto`` for what suits the scenario; the scenario's own if ``None``.
    simulator, simulator_options
        Name of what plays the scenario, see :mod:`odscen.simulators.installed`, and its options.

    Raises
    ------
    InputError
        If a value is not possible, or criticality is to be measured in meso.
    """

    seed: int | None = None
    redraw: Redraw = "open"
    until: float | None = None
    step_length: float | None = None
    weather: bool = True
    recording: Recording = field(default_factory=Recording)
    meso: bool = False
    slice_length: SliceLength = "auto"
    time_limit: float | None = None
    expectations: tuple[Expectation, ...] = ()
    warm_up: float | None = None
    interval: float | None = None
    behaviour: BehaviourDoor | None = None
    after_story: AfterStory | None = None
    simulator: str = "sumo"
    simulator_options: Mapping[str, OptionValue] = field(default_factory=dict)

    def __post_init__(self) -> None:
        _refuse_other_type("seed", self.seed, int, "a whole number")
        _refuse_other_type("recording", self.recording, Recording, "an odscen.Recording")
        need = "a BehaviourDoor, such as BehaviourDoor(name='idm')"
        _refuse_other_type("behaviour", self.behaviour, BehaviourDoor, need)
        if isinstance(self.expectations, str):
            raise InputError("expectations must be a tuple, not a single text")
        for expectation in self.expectations:
            made = f"made by odscen.parse_expectation({expectation!r})"
            _refuse_other_type("an expectation", expectation, Expectation, made)
        if self.seed is not None and not 0 <= self.seed < _SEEDS:
            raise InputError(f"seed must lie between 0 and {_SEEDS - 1}, not {self.seed}")
        if self.redraw not in REDRAWS:
            raise InputError(f"redraw must be one of {', '.join(REDRAWS)}, not {self.redraw!r}")
        _refuse_time("until", self.until, most=_LONGEST)
        _refuse_time("step_length", self.step_length, most=1.0)
        if self.slice_length != "auto":
            _refuse_time("slice_length", self.slice_length)
        _refuse_time("time_limit", self.time_limit)
        if self.after_story not in (None, "auto", "never"):
            need = "a number of seconds, 'auto' or 'never'"
            _refuse_other_type("after_story", self.after_story, (int, float), need)
            if not 0 <= float(self.after_story) <= _LONGEST:
                raise InputError(f"after_story must be at least 0 s, not {self.after_story:g}")
        for name, seconds in (("warm_up", self.warm_up), ("interval", self.interval)):
            _refuse_other_type(name, seconds, (int, float), "whole seconds")
            if seconds is not None and (seconds < 0 or seconds % 1.0 or not math.isfinite(seconds)):
                raise InputError(f"{name} must be whole seconds, not {seconds:g}")
        _refuse_time("interval", self.interval)
        if self.meso and self.behaviour is not None:
            raise InputError("in meso no model can drive: it has queues, not vehicles")
        if self.meso and self.recorded.criticality:
            raise InputError(
                "criticality cannot be measured in meso: it has queues, not vehicles that meet"
            )

    @property
    def recorded(self) -> Recording:
        """What is recorded: criticality too where an expectation asks for it."""
        return self.recording.with_criticality(needs_criticality(self.expectations))

    def recorded_of(self, scenario: Scenario) -> Recording:
        """What is recorded of a scenario: criticality too where one of its criteria asks for it.

        Not in meso, where it cannot be measured; such a criterion then has no value.
        """
        wanted = () if self.meso else criteria_of(scenario.criteria)
        return self.recorded.with_criticality(needs_criticality(wanted))

    def times(self, scenario: Scenario) -> tuple[float, float]:
        """End of a run of a scenario and length of its steps, seconds.

        Raises
        ------
        InputError
            If it would end before its first step is over.
        """
        own = scenario.simulation
        until = own.duration if self.until is None else self.until
        step_length = own.step_length if self.step_length is None else self.step_length
        if until < step_length:
            raise InputError(
                f"until is {until:g} s: the run would end before its first step ({step_length:g} s)"
            )
        return until, step_length

    def settle_time(self, scenario: Scenario) -> float | None:
        """Seconds for which a run goes on once its story has ended; ``None``: to its end."""
        own = scenario.simulation.after_story
        wanted = own if self.after_story is None else self.after_story
        if wanted == "auto":
            wanted = AFTER_STORY if scenario.is_scene else "never"
        return None if wanted == "never" or self.meso else float(wanted)

    def analysis(self, scenario: Scenario) -> AnalysisTimes:
        """What of a run of a scenario is analysed.

        Raises
        ------
        InputError
            If the warm-up leaves nothing of it.
        """
        study = scenario.study
        warm_up = study.warm_up if self.warm_up is None else self.warm_up
        times = AnalysisTimes(warm_up, study.interval if self.interval is None else self.interval)
        times.refuse_beyond(self.times(scenario)[0])
        return times

    def to_dict(self) -> dict[str, Any]:
        """As values that JSON can hold; the simulator only where it is not SUMO."""
        values = {
            **asdict(self),
            "expectations": [expectation.text for expectation in self.expectations],
        }
        if self.after_story is None:
            del values["after_story"]
        if self.simulator == "sumo":
            del values["simulator"], values["simulator_options"]
        return values

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """Inverse of :meth:`to_dict`, after JSON too."""
        recording: dict[str, Any] = {
            name: tuple(value) if isinstance(value, list) else value
            for name, value in data["recording"].items()
        }
        expectations = tuple(parse_expectation(text) for text in data["expectations"])
        own: dict[str, Any] = {"recording": Recording(**recording), "expectations": expectations}
        if data.get("behaviour") is not None:
            own["behaviour"] = BehaviourDoor(**data["behaviour"])
        values: dict[str, Any] = {**data, **own}
        return cls(**values)


AS_DESIGNED = RunSettings()
"""A run as its scenario says, without any wish."""
