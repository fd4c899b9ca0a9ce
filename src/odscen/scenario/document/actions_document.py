"""Actions of rules: what an actor then does; each kind a part with its own fields.

Metres, seconds, m/s, m/s^2; left is positive. What each kind means is in
:mod:`odscen.scenario.story.action_kinds` and in docs/rules.md.
"""

from __future__ import annotations

import itertools
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from odscen.scenario.document.conditions_document import Coordinate, OwnKind, RulePlace, one_of
from odscen.scenario.document.document_parts import Identifier, Label, Part

Positive = Annotated[float, Field(gt=0, le=1e6, allow_inf_nan=False)]
Rate = Annotated[float, Field(gt=0, le=100, allow_inf_nan=False)]
RuleSpeed = Annotated[float, Field(ge=0, le=100, allow_inf_nan=False)]
Heading = Annotated[float, Field(ge=-100, le=100, allow_inf_nan=False)]
"""Radians counter-clockwise from x."""
TrajectoryRow = tuple[
    Annotated[float, Field(ge=0, le=1e6, allow_inf_nan=False)], Coordinate, Coordinate, Heading
]
WalkingSpeed = Annotated[float, Field(gt=0, le=15, allow_inf_nan=False)]


class SpeedChange(Part):
    """Reach ``to`` m/s: at a ``rate``, ``over`` seconds or ``within`` metres.

    None of the three is wanted for the shape ``step``. For ``cosine`` the rate is the largest.
    """

    to: RuleSpeed
    shape: Literal["step", "linear", "cosine"] = "linear"
    rate: Rate | None = None
    over: Positive | None = None
    within: Positive | None = None

    @model_validator(mode="after")
    def _one_measure(self) -> Self:
        names = ("rate", "over", "within")
        if self.shape != "step":
            one_of(self, names, "measure")
        elif given := [name for name in names if getattr(self, name) is not None]:
            raise ValueError(f"a step takes no time; leave out {' and '.join(given)}")
        return self


class Braking(Part):
    """Brake with ``by`` m/s^2 to a standstill; after ``hold`` seconds SUMO drives on."""

    by: Rate
    hold: Annotated[float, Field(ge=0, le=1e6)] | None = None


class Stopping(Part):
    """Come to a standstill after exactly ``within`` metres, or at once, until `go`."""

    within: Positive | None = None


class Going(Part):
    """SUMO chooses the speed again."""


class LaneChange(Part):
    """Change ``by`` so many lanes to the left (negative: right), or to the lane that leads ``to``.

    It takes ``over`` seconds.
    """

    by: Annotated[int, Field(ge=-10, le=10)] | None = None
    to: RulePlace | None = None
    over: Positive = 3.0

    @model_validator(mode="after")
    def _some_lane(self) -> Self:
        one_of(self, ("by", "to"), "lane")
        if self.by == 0:
            raise ValueError("by must not be 0")
        return self


class CuttingIn(Part):
    """Change into the lane of ``to``, in front of it, ``over`` so many seconds.

    With ``gap`` the speed changes evenly so that the free gap is that many metres in the end.
    """

    to: Identifier
    gap: Positive | None = None
    over: Positive = 3.0


class LateralMove(Part):
    """Move to ``to`` metres left of the lane's centre, ``over`` so many seconds."""

    to: Annotated[float, Field(ge=-10, le=10)]
    over: Positive = 3.0


class GapKeeping(Part):
    """Follow ``to`` at a free gap of ``metres`` or ``seconds``, for ``lasting`` seconds.

    ``ahead``: drive in front of it at that gap, seconds at its speed. ``once``: until it is that.
    """

    to: Identifier
    metres: Positive | None = None
    seconds: Positive | None = None
    ahead: bool = False
    lasting: Positive | None = None
    rate: Rate = 3.0
    once: bool = False

    @model_validator(mode="after")
    def _one_gap(self) -> Self:
        one_of(self, ("metres", "seconds"), "gap")
        return self


class Walking(Part):
    """Walk straight to a place, through others if given, wherever that leads."""

    to: RulePlace
    through: tuple[RulePlace, ...] = ()
    speed: WalkingSpeed | None = None


class NewGoal(Part):
    """Go to another node of the map from here on."""

    to: Label


class PathFollowing(Part):
    """Follow a line over the ground from where the actor is, through ``points``.

    ``speed`` is that of all of it, ``speeds`` are those at the points, ``times`` the seconds after
    the begin at which it is there; none of them leaves the speed as it is.
    With ``relative_to`` an actor, ``points`` are metres ahead and to the left of its centre, by
    where it is and heads at the begin.
    """

    points: Annotated[tuple[RulePlace, ...], Field(min_length=1, max_length=10_000)]
    speed: Annotated[float, Field(gt=0, le=100, allow_inf_nan=False)] | None = None
    speeds: Annotated[tuple[RuleSpeed, ...], Field(max_length=10_000)] = ()
    times: Annotated[tuple[Positive, ...], Field(max_length=10_000)] = ()
    relative_to: Identifier | None = None

    @model_validator(mode="after")
    def _metres_from_it(self) -> Self:
        for place in self.points if self.relative_to is not None else ():
            if isinstance(place, str):
                raise ValueError(
                    f"{place!r} is a node; relative to {self.relative_to!r} give x and y"
                )
        return self

    @model_validator(mode="after")
    def _one_timing(self) -> Self:
        given = [name for name in ("speed", "speeds", "times") if getattr(self, name)]
        if len(given) > 1:
            raise ValueError(f"give one of speed, speeds and times, not {' and '.join(given)}")
        for name in given:
            values = getattr(self, name)
            if name != "speed" and len(values) != len(self.points):
                raise ValueError(
                    f"{len(values)} {name} for {len(self.points)} points; give one for each"
                )
        if any(a >= b for a, b in itertools.pairwise(self.times)):
            raise ValueError("times must grow")
        if any(a == b == 0.0 for a, b in itertools.pairwise(self.speeds)):
            raise ValueError(
                "two speeds of 0 follow one another; the second point is never reached"
            )
        return self


class Replaying(Part):
    """Be where a recorded road user was: ``rows`` of seconds after the begin, x, y and heading.

    Centre of the body, OpenDRIVE frame; metres, and radians counter-clockwise from x. Between rows
    it moves evenly.
    """

    rows: Annotated[tuple[TrajectoryRow, ...], Field(min_length=2, max_length=100_000)]

    @model_validator(mode="after")
    def _growing(self) -> Self:
        for index, (one, other) in enumerate(itertools.pairwise(self.rows)):
            if one[0] >= other[0]:
                raise ValueError(f"rows[{index + 1}] is at {other[0]:g} s, not after {one[0]:g} s")
        if self.rows[0][0] != 0.0:
            raise ValueError(f"rows must begin at 0 s, not at {self.rows[0][0]:g} s")
        return self


class Arriving(Part):
    """Be at a place at the instant at which ``to`` is at another one.

    ``at`` is where the actor is to be, ``when_at`` where the other one is then. With a ``speed``
    it arrives at that, which it has already reached ``steady`` metres before.
    """

    at: RulePlace
    to: Identifier
    when_at: RulePlace
    speed: RuleSpeed | None = None
    steady: Annotated[float, Field(ge=0, le=1e6, allow_inf_nan=False)] = 0.0

    @model_validator(mode="after")
    def _steady_speed(self) -> Self:
        if self.steady and not self.speed:
            raise ValueError(f"steady for {self.steady:g} m wants a speed above 0")
        return self


class Appearing(Part):
    """Be there from now on: the actor is not on the road before, whatever its ``depart`` is.

    It appears where it is placed, or ``at`` x, y and heading of its body's centre, with its initial
    speed or ``speed``.
    """

    at: tuple[Coordinate, Coordinate, Heading] | None = None
    speed: RuleSpeed | None = None


class SignalSwitch(Part):
    """Switch a traffic light.

    ``green``: its program jumps to where ``movement`` has green, and resumes from there. ``off``:
    right of way as without lights. ``program``: the program that ran before.
    """

    light: Label
    shows: Literal["green", "off", "program"] = "green"
    movement: Label | None = None

    @model_validator(mode="after")
    def _green_of_some(self) -> Self:
        if (self.shows == "green") != (self.movement is not None):
            raise ValueError("green needs a movement, and only green does")
        return self


class VehicleLights(Part):
    """Set lights of a vehicle: what is not given is off; without any the driver sets them again."""

    indicator: Literal["off", "left", "right", "hazard"] | None = None
    brake: bool | None = None
    front: bool | None = None
    high_beam: bool | None = None
    fog: bool | None = None
    emergency: bool | None = None


class Honking(Part):
    """Sound the horn."""


class Vanishing(Part):
    """Leave the simulation."""


class Ending(Part):
    """End the run: it is complete with the step in which that is asked for."""


class Ignoring(Part):
    """Heed neither red lights nor right of way, or one of the two."""

    red: bool = True
    right_of_way: bool = False


class Releasing(Part):
    """SUMO drives as if there had been no rule."""


class OwnAction(OwnKind):
    """An action of an installed package."""


class Action(Part):
    """One kind of action, or several that run together."""

    speed: SpeedChange | None = None
    brake: Braking | None = None
    stop: Stopping | None = None
    go: Going | None = None
    lane: LaneChange | None = None
    offset: LateralMove | None = None
    keep_gap: GapKeeping | None = None
    walk: Walking | None = None
    cut_in: CuttingIn | None = None
    goal: NewGoal | None = None
    path: PathFollowing | None = None
    replay: Replaying | None = None
    arrive: Arriving | None = None
    appear: Appearing | None = None
    vanish: Vanishing | None = None
    end: Ending | None = None
    signal: SignalSwitch | None = None
    lights: VehicleLights | None = None
    horn: Honking | None = None
    ignore: Ignoring | None = None
    release: Releasing | None = None
    own: OwnAction | None = None
    together: Annotated[tuple[Action, ...], Field(min_length=2)] | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        one_of(self, tuple(type(self).model_fields), "action")
        for one in self.together or ():
            if one.together is not None:
                raise ValueError("what runs together cannot itself be together")
        return self

    @property
    def kind(self) -> str:
        """Name of the field that is given."""
        names = type(self).model_fields
        return next(name for name in names if getattr(self, name) is not None)

    @property
    def parts(self) -> tuple[Action, ...]:
        """The single actions: those that run together, or this one."""
        return self.together or (self,)
