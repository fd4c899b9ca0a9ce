"""What goes over the wire about programs of traffic lights, and what they showed in a run."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from odscen.app.signals.signal_views import ProgramOrigin
from odscen.web.messages import Answer, OfVersion, ScenarioState


class StageInfo(Answer):
    """A stage in the cycle of a plan; seconds.

    ``split`` lasts from ``begin`` until the next stage begins; ``least`` and ``most`` are those of
    a green that may vary, else 0. ``groups`` have green, and a movement of those in ``permissive``
    gives way. ``picture`` is SVG.
    """

    id: str
    begin: float
    end: float
    split: float
    least: float
    most: float
    on_call: bool
    groups: list[str]
    permissive: list[str]
    words: str
    picture: str


class PhaseInfo(Answer):
    """A state for so many seconds of the cycle; ``stage`` is empty if it is none's green."""

    seconds: float
    state: str
    name: str
    stage: str


class DayPlanInfo(Answer):
    """A plan of the day; ``times`` are seconds of the day at which it begins, none if always.

    ``begins`` are the seconds of a run at which it takes over. ``bars`` is the time bar as SVG, in
    which the cycle lasts from the first to the second share of the width.
    """

    id: str
    cycle: float
    offset: float
    times: list[float]
    begins: list[float]
    stages: list[StageInfo]
    phases: list[PhaseInfo]
    bars: str
    plot: tuple[float, float]


class LightGroupInfo(Answer):
    """A signal group: the letters of the light's states that are its own, and their movements."""

    id: str
    movements: list[str]
    links: list[int]
    walk: bool


class DetectorInfo(Answer):
    """A detector and what it is for; metres before the stop line, and seconds of its gap.

    ``label`` names it in the pictures, where its shape has its id as ``data-detector``. ``bus`` if
    it is an area of ``length`` metres that sees buses only, which have priority for its stages.
    ``calls`` are begin and end of the times in which it saw a road user, seconds of a run; none
    without a run, and none of an area for buses, which SUMO does not log. ``place`` are points
    along it in driving direction, x and y in metres.
    """

    id: str
    label: str
    stages: list[str]
    call: bool
    bus: bool
    ahead: float
    length: float
    gap: float
    calls: list[tuple[float, float]]
    place: list[tuple[float, float]]


class TurnInfo(Answer):
    """A turn across oncoming traffic, and how it is treated in the first plan.

    ``both`` is protected in one stage and permissive in another. ``alone`` if no other movement
    uses its lanes, so that it can have an arrow.
    """

    approach: str
    turn: Literal["left", "right"]
    treatment: Literal["permissive", "protected", "both"]
    alone: bool


class MovementInfo(Answer):
    """A movement as a group names it, and the group that has it now; empty without one."""

    name: str
    walk: bool
    group: str


class GroupPairInfo(Answer):
    """A group that ends and one that begins; seconds of intergreen.

    ``needed`` is what their paths need, ``given`` what the scenario says, ``used`` what is kept.
    ``together`` says whether both may have green: ``yields`` if ``ending`` gives way, ``first`` if
    ``beginning`` does.
    """

    ending: str
    beginning: str
    needed: float
    given: float | None
    used: float
    together: Literal["free", "yields", "first", "never"]


class DetectorLaneInfo(Answer):
    """A lane before the light, and its approach; ``line`` leads to the stop line, metres."""

    at: str
    approach: str
    line: list[tuple[float, float]]


class PictureKey(Answer):
    """A shape of the pictures in 24 by 14 pixels, as SVG, and what it means."""

    picture: str
    words: str


class LightProgramInfo(Answer):
    """What a light is told to show. ``site`` is the junction with its detectors, as SVG.

    ``ground`` is what the pictures of the stages refer to: it has to be in the page with them.
    ``turns`` are those across oncoming traffic, ``movements`` all that groups may have, ``pairs``
    the groups of the scenario's own program that meet, and ``lanes`` where detectors can be placed;
    none of these in a run.
    """

    id: str
    junctions: list[str]
    control: Literal["fixed", "extended", "actuated"]
    origin: ProgramOrigin
    groups: list[LightGroupInfo]
    plans: list[DayPlanInfo]
    detectors: list[DetectorInfo]
    turns: list[TurnInfo]
    movements: list[MovementInfo]
    pairs: list[GroupPairInfo]
    lanes: list[DetectorLaneInfo]
    site: str
    ground: str
    legend: list[PictureKey]


class ShownStates(Answer):
    """What a light showed: from ``times[i]`` on ``states[shown[i]]`` of ``plans[i]``; seconds."""

    light: str
    times: list[float]
    shown: list[int]
    plans: list[str]
    states: list[str]


class RunSignals(Answer):
    """What the lights of a finished run showed; none if the map has none."""

    lights: list[ShownStates]


class CycleWish(OfVersion):
    """Another cycle for a light, seconds; ``plan`` is a plan of the day where it has several."""

    cycle: Annotated[float, Field(gt=0, le=3600, allow_inf_nan=False)]
    plan: str | None = None


class WebsterWish(OfVersion):
    """Lights to be timed after the demand: all, or these junctions.

    With ``turn_arrows`` turns get a protected stage first where the volumes ask for it.
    """

    junctions: tuple[str, ...] = ()
    turn_arrows: bool = False


class CorridorWish(OfVersion):
    """Lights to be coordinated: junctions in driving order, or those along roads.

    ``speed`` is that of progression, m/s; the speed limits if not given. ``cycle`` in seconds; the
    longest of the lights if not given.
    """

    junctions: tuple[str, ...] = ()
    along: tuple[str, ...] = ()
    favoured: Literal["both", "out", "back"] = "both"
    speed: Annotated[float, Field(gt=0, le=100, allow_inf_nan=False)] | None = None
    cycle: Annotated[float, Field(gt=0, le=3600, allow_inf_nan=False)] | None = None


class TimedSignalsState(Answer):
    """A scenario whose lights have been timed, and in words what came of it.

    ``picture`` is the time-space diagram of a corridor as SVG, else empty.
    """

    state: ScenarioState
    notes: list[str]
    picture: str
