"""Traffic lights in the scenario document: control, timing, and programs of the engineer.

Terms are those of RiLSA and NEMA TS 2: signal groups (what shows the same light), stages (groups
that have green together), intergreens between groups, plans of the day.
"""

from __future__ import annotations

from typing import Annotated, Final, Literal, Self

from pydantic import Field, model_validator

from odscen.scenario.document.document_parts import Identifier, Label, Part

SignalSeconds = Annotated[float, Field(ge=0, le=3600, allow_inf_nan=False)]
Control = Literal["fixed", "extended", "actuated"]
MOST_STAGES: Final = 100
"""Stages of a program, and groups; each stage is held against each."""
MOST_PLANS: Final = 100
"""Plans of a day of one light; each has all stages."""
ClockTime = Annotated[str, Field(pattern=r"^([01]\d|2[0-3]):[0-5]\d(:[0-5]\d)?$")]
"""Time of day, ``06:30`` or ``06:30:15``."""


class ProgramGroup(Part):
    """A signal group: movements that always show the same.

    A movement is named ``r12>r8`` (segment before, segment behind), ``r12 left`` (``straight``,
    ``right``, ``turnaround``), ``r12`` (all of the approach), ``12.0.-1>8.1.-1`` (from lane to
    lane) or ``walk r12`` (the crossings over a leg). ``yellow`` ``None`` follows from the speed
    limit: 3 s up to 50 km/h, 4 s up to 60 km/h, 5 s above. With ``all_red``, what begins after this
    group waits for yellow and all-red; otherwise as long as the paths need. Whenever it has green,
    it is to have it for ``min_green`` at least, over as many stages as it takes.
    """

    id: Identifier
    movements: Annotated[tuple[Label, ...], Field(min_length=1, max_length=1000)]
    yellow: SignalSeconds | None = None
    all_red: SignalSeconds | None = None
    min_green: SignalSeconds | None = None


class ProgramStage(Part):
    """Groups that have green together, and for how long.

    ``protected`` groups meet nobody else who has green; ``permissive`` ones give way to those they
    meet. ``green`` is what the stage lasts with fixed-time control; actuated control keeps it
    between ``min_green`` and ``max_green`` (``None``: ``green``). A stage ``on_call`` comes only
    if somebody waits at one of its crossings, or a vehicle for a green of it.
    """

    id: Identifier
    protected: tuple[Identifier, ...] = ()
    permissive: tuple[Identifier, ...] = ()
    green: SignalSeconds
    min_green: SignalSeconds | None = None
    max_green: SignalSeconds | None = None
    on_call: bool = False

    @property
    def groups(self) -> tuple[str, ...]:
        """All that have green."""
        return (*self.protected, *self.permissive)


class SignalDetector(Part):
    """A loop in the road, and the stages that it prolongs.

    ``at`` is an approach (``r12``: a loop in each lane) or a lane (``12.0.-1``); ``before`` the
    metres from its front end to the stop line. A stage goes on while fewer than ``gap`` seconds
    pass between vehicles.
    """

    id: Identifier
    at: Label
    before: Annotated[float, Field(ge=0, le=1000)] = 30.0
    length: Annotated[float, Field(gt=0, le=100)] = 2.0
    stages: Annotated[tuple[Identifier, ...], Field(min_length=1, max_length=MOST_STAGES)]
    gap: Annotated[float, Field(gt=0, le=60)] = 3.0


class DayPlan(Part):
    """One of several plans of a day: what differs in it from the program.

    It runs from each time in ``times`` until another plan begins. ``stages`` has their order, and
    leaves out those that do not come; the times of stages are by their ids.
    """

    id: Identifier
    times: Annotated[tuple[ClockTime, ...], Field(max_length=1440)] = ()
    cycle: SignalSeconds | None = None
    offset: SignalSeconds = 0.0
    stages: Annotated[tuple[Identifier, ...], Field(max_length=MOST_STAGES)] = ()
    green: dict[Identifier, SignalSeconds] = Field(default_factory=dict)
    min_green: dict[Identifier, SignalSeconds] = Field(default_factory=dict)
    max_green: dict[Identifier, SignalSeconds] = Field(default_factory=dict)


class JunctionTiming(Part):
    """The traffic light of one junction, where it differs from the map's program.

    ``junction`` is the id of the OpenDRIVE junction, or the SUMO id of a light that is in none.
    ``control`` ``None`` is the scenario's. Either the map's stages are kept, and ``green`` has the
    seconds of green of each in order; or ``groups`` and ``stages`` are a program of its own.
    ``intergreens`` are rows of the group that ends, the one that begins, and the seconds from the
    end of green to the begin of green; pairs without a row have what their paths need. With
    ``cycle``, greens and intergreens have to add up to it, and actuated control keeps to it. The
    program begins ``offset`` seconds into the scenario, as if it had run before. Lights of one
    ``coordination`` have one cycle. ``bus_priority`` ``None`` is the scenario's.
    """

    junction: Label
    control: Control | None = None
    offset: SignalSeconds = 0.0
    green: tuple[SignalSeconds, ...] = ()
    cycle: SignalSeconds | None = None
    coordination: Identifier | None = None
    groups: Annotated[tuple[ProgramGroup, ...], Field(max_length=MOST_STAGES)] = ()
    stages: Annotated[tuple[ProgramStage, ...], Field(max_length=MOST_STAGES)] = ()
    intergreens: Annotated[
        tuple[tuple[Identifier, Identifier, SignalSeconds], ...],
        Field(max_length=MOST_STAGES * MOST_STAGES),
    ] = ()
    detectors: Annotated[tuple[SignalDetector, ...], Field(max_length=1000)] = ()
    plans: Annotated[tuple[DayPlan, ...], Field(max_length=MOST_PLANS)] = ()
    bus_priority: bool | None = None

    @model_validator(mode="after")
    def _check_one_kind(self) -> Self:
        if bool(self.groups) != bool(self.stages):
            raise ValueError("a program needs both groups and stages")
        if self.groups and self.green:
            raise ValueError("give the green in the stages of the program, not beside them")
        if not self.groups and (self.intergreens or self.plans or self.cycle is not None):
            raise ValueError("intergreens, plans and a cycle need groups and stages")
        return self


class Signals(Part):
    """How traffic lights are run: fixed-time, extended or actuated.

    Extended lights of the map keep its greens, and prolong each while vehicles follow each other,
    up to a cycle of two minutes. Actuated ones let arriving vehicles call stages and end greens.
    Where nothing is said (``None``) lights of the map are extended, as no demand is known when a
    map is converted; those of a network from outside run as that network has it, and lights whose
    greens, offset or program the scenario gives run by these.

    With ``bus_priority`` a green lasts longer for a bus that comes to it, and ends early for one
    that waits elsewhere.
    """

    control: Control | None = None
    bus_priority: bool = False
    junctions: tuple[JunctionTiming, ...] = ()

    def control_of(self, timing: JunctionTiming) -> Control | None:
        """How a light is run; ``None`` if nothing is said.

        What its program has of its own is not extended.
        """
        control = timing.control or self.control
        if timing.stages and control in (None, "extended"):
            return "fixed"
        timed = bool(timing.green or timing.offset)
        return "fixed" if control is None and timed else control
