"""Rules: conditions, actions, and which of them belong together; each kind a part of its own.

Metres, seconds, m/s, m/s^2; left is positive. What each kind means is in
:mod:`odscen.scenario.story.action_kinds` and in docs/rules.md.

Metres, seconds, m/s, m/s^2. What each kind means is in :mod:`odscen.scenario.story.condition_kinds`
and in docs/rules.md.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Annotated, Final, Literal, NamedTuple, Self

from pydantic import ConfigDict, Field, model_validator

from odscen.scenario.document.document_parts import Identifier, Label, Part, Seconds

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator


Coordinate = Annotated[float, Field(ge=-1e7, le=1e7, allow_inf_nan=False)]
RulePlace = Label | tuple[Coordinate, Coordinate]
"""A node of the map, or x and y in the OpenDRIVE frame, metres."""
OwnValue = Annotated[float, Field(allow_inf_nan=False)] | Label
Metres = Annotated[float, Field(ge=0, le=1e6, allow_inf_nan=False)]
Signed = Annotated[float, Field(ge=-1e6, le=1e6, allow_inf_nan=False)]


def one_of(part: Part, names: tuple[str, ...], what: str) -> None:
    """Refuse a part in which not exactly one of these fields is given.

    Raises
    ------
    ValueError
        With the fields that are.
    """
    given = [name for name in names if getattr(part, name) is not None]
    if len(given) != 1:
        listed = ", ".join(names)
        raise ValueError(f"give one {what} of {listed}, not {' and '.join(given) or 'none'}")


class Bounded(Part):
    """A value held against a bound: ``below`` it or ``above`` it, one of the two."""

    below: Signed | None = None
    above: Signed | None = None

    @model_validator(mode="after")
    def _check_one_bound(self) -> Self:
        one_of(self, ("below", "above"), "bound")
        return self


class OwnBounded(Bounded):
    """A value of one actor: ``of``, or the rule's own."""

    of: Identifier | None = None


class PairBounded(OwnBounded):
    """A value between two actors."""

    to: Identifier


Behind = Annotated[float, Field(ge=-30, le=30, allow_inf_nan=False)]
PointsBehind = tuple[Behind, Behind]
"""Metres by which measured points lie behind the centres of two bodies: of the first, and of
the other. The middle of a rear axle is one."""
CENTRES: Final = (0.0, 0.0)


class SecondsBetween(PairBounded):
    """Seconds between two actors; ``free`` measures between the bodies, not their centres.

    With ``ahead`` they are known only while ``to`` is ahead, as those of OpenSCENARIO's headway.
    Without ``free`` the points measured between are ``behind`` metres behind the two centres.
    """

    free: bool = True
    ahead: bool = False
    behind: PointsBehind = CENTRES


class AfterTime(Part):
    """Simulated time is ``after`` seconds or more."""

    after: Seconds


class DistanceBounded(OwnBounded):
    """A distance to an actor or to a place; ``free`` measures between bodies, not their centres.

    Without ``free`` the points measured between are ``behind`` metres behind the two centres.
    """

    to: Identifier | None = None
    place: RulePlace | None = None
    along: Literal["straight", "longitudinal", "lateral", "lane"] = "straight"
    free: bool = True
    behind: PointsBehind = CENTRES

    @model_validator(mode="after")
    def _check_one_end(self) -> Self:
        one_of(self, ("to", "place"), "end")
        return self


class Standing(Part):
    """An actor has been stopped for so many seconds."""

    of: Identifier | None = None
    seconds: Seconds = 0.0


class Reaching(Part):
    """The centre of an actor's body is within so many metres of a place."""

    of: Identifier | None = None
    place: RulePlace
    within: Annotated[float, Field(gt=0, le=1000)] = 1.0


class SignalShows(Part):
    """A movement of a traffic light shows a colour.

    ``light`` is the junction, ``movement`` a name as in signal programs, ``r1>r2`` or ``walk r1``.
    """

    light: Label
    movement: Label
    shows: Literal["red", "yellow", "green"]


class AfterRule(Part):
    """Another rule has started, or has ended, at least once."""

    id: Identifier
    has: Literal["started", "ended"] = "ended"


class OneActor(Part):
    """An actor, the rule's own if none is named."""

    of: Identifier | None = None


class Touching(Part):
    """The body of an actor touches that of another one, or of any that a rule names."""

    of: Identifier | None = None
    to: Identifier | None = None


class OwnKind(Part):
    """A kind that an installed package gives, with its name and its own ``values``.

    ``to`` is another actor that it asks about, ``place`` a place.
    """

    kind: Identifier
    to: Identifier | None = None
    place: RulePlace | None = None
    values: Annotated[dict[Identifier, OwnValue], Field(max_length=50)] = Field(
        default_factory=dict
    )


class OwnCondition(OwnKind):
    """A condition of an installed package; ``of`` is whose value it is, the rule's actor's if not.

    See :mod:`odscen.scenario.story.own_kinds`.
    """

    of: Identifier | None = None


class Condition(Part):
    """One kind of condition, or several that are combined; ``delay`` and ``edge`` fit all.

    ``delay`` lets it hold so many seconds later. With ``edge`` ``rising`` it holds for one step
    from the instant at which it comes true, and not if it is true when it is first looked at.
    """

    model_config = ConfigDict(serialize_by_alias=True, validate_by_name=True)

    time: AfterTime | None = None
    ttc: SecondsBetween | None = None
    headway: SecondsBetween | None = None
    distance: DistanceBounded | None = None
    relative_speed: PairBounded | None = None
    speed: OwnBounded | None = None
    acceleration: OwnBounded | None = None
    stopped: Standing | None = None
    reaches: Reaching | None = None
    travelled: OwnBounded | None = None
    signal: SignalShows | None = None
    rule: AfterRule | None = None
    appeared: OneActor | None = None
    touched: Touching | None = None
    off_road: OneActor | None = None
    own: OwnCondition | None = None
    all: Annotated[tuple[Condition, ...], Field(min_length=1)] | None = None
    any: Annotated[tuple[Condition, ...], Field(min_length=1)] | None = None
    not_: Annotated[Condition | None, Field(alias="not")] = None
    delay: Annotated[float, Field(ge=0, le=1e6)] = 0.0
    edge: Literal["none", "rising"] = "none"

    @model_validator(mode="after")
    def _check_one_kind(self) -> Self:
        kinds = tuple(name for name in type(self).model_fields if name not in ("delay", "edge"))
        one_of(self, kinds, "condition")
        return self

    @property
    def kind(self) -> str:
        """Name of the field that is given."""
        return next(
            name
            for name in type(self).model_fields
            if name not in ("delay", "edge") and getattr(self, name) is not None
        )


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

    None of the three is wanted for the shape ``step``. Of a curve the rate is the largest.
    """

    to: RuleSpeed
    shape: Literal["step", "linear", "cosine", "cubic"] = "linear"
    rate: Rate | None = None
    over: Positive | None = None
    within: Positive | None = None

    @model_validator(mode="after")
    def _check_single_measure(self) -> Self:
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


USUAL_MOVE = 3.0
"""Seconds of a lateral move that says neither time nor length nor rate."""
SideShape = Literal["linear", "cosine", "cubic"]
"""How the offset of a lateral move grows with the time, or with the metres."""


class SidewaysMove(Part):
    """A lateral move: ``over`` seconds, ``within`` metres along the lane or with a ``rate``.

    The rate is the largest speed to the side, m/s. Without any of the three it takes 3 s.
    """

    @model_validator(mode="after")
    def _check_one_measure(self) -> Self:
        names = ("over", "within", "rate")
        if any(getattr(self, name) is not None for name in names):
            one_of(self, names, "measure")
        return self


class LaneChange(SidewaysMove):
    """Change ``by`` so many lanes to the left (negative: right), or to the lane that leads ``to``.

    It ends ``offset`` metres to the left of the centre of that lane.
    """

    by: Annotated[int, Field(ge=-10, le=10)] | None = None
    to: RulePlace | None = None
    over: Positive | None = None
    within: Positive | None = None
    rate: Rate | None = None
    shape: SideShape = "cosine"
    offset: Annotated[float, Field(ge=-10, le=10, allow_inf_nan=False)] = 0.0

    @model_validator(mode="after")
    def _some_lane(self) -> Self:
        one_of(self, ("by", "to"), "lane")
        if self.by == 0:
            raise ValueError("by must not be 0")
        return self


class CuttingIn(SidewaysMove):
    """Change into the lane of ``to``, in front of it.

    With ``gap`` the speed changes evenly so that the free gap is that many metres in the end; then
    the change takes a time, and no length.
    """

    to: Identifier
    gap: Positive | None = None
    over: Positive | None = None
    within: Positive | None = None
    rate: Rate | None = None
    shape: SideShape = "cosine"

    @model_validator(mode="after")
    def _check_time_for_gap(self) -> Self:
        if self.gap is not None and self.within is not None:
            raise ValueError("a gap is reached over a time; give over, not within")
        return self


class LateralMove(SidewaysMove):
    """Move to ``to`` metres left of the lane's centre."""

    to: Annotated[float, Field(ge=-10, le=10)]
    over: Positive | None = None
    within: Positive | None = None
    rate: Rate | None = None
    shape: SideShape = "cosine"


class GapKeeping(Part):
    """Follow ``to`` at a free gap of ``metres`` or ``seconds``, for ``lasting`` seconds.

    ``ahead``: drive in front of it at that gap, seconds at its speed. ``once``: until it is that.
    ``rate`` is the strongest acceleration, and deceleration where ``braking`` says no other one.
    """

    to: Identifier
    metres: Positive | None = None
    seconds: Positive | None = None
    ahead: bool = False
    lasting: Positive | None = None
    rate: Rate = 3.0
    braking: Rate | None = None
    once: bool = False

    @model_validator(mode="after")
    def _check_one_gap(self) -> Self:
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
    where it is and heads at the begin. Of a vehicle the point that is so many metres ``behind`` the
    middle of its front is led along the line; ``backwards`` it heads against it.
    """

    points: Annotated[tuple[RulePlace, ...], Field(min_length=1, max_length=10_000)]
    speed: Annotated[float, Field(gt=0, le=100, allow_inf_nan=False)] | None = None
    speeds: Annotated[tuple[RuleSpeed, ...], Field(max_length=10_000)] = ()
    times: Annotated[tuple[Positive, ...], Field(max_length=10_000)] = ()
    relative_to: Identifier | None = None
    behind: Annotated[float, Field(ge=-10, le=30, allow_inf_nan=False)] = 0.0
    backwards: bool = False

    @model_validator(mode="after")
    def _metres_from_it(self) -> Self:
        for place in self.points if self.relative_to is not None else ():
            if isinstance(place, str):
                raise ValueError(
                    f"{place!r} is a node; relative to {self.relative_to!r} give x and y"
                )
        return self

    @model_validator(mode="after")
    def _check_one_timing(self) -> Self:
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
    def _check_growing_times(self) -> Self:
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
    """The actor is driven as if there had been no rule: by whom its ``driver`` names."""


DriverName = Literal["sumo", "story"]
"""Who drives a vehicle: SUMO's drivers, or the story alone."""


class Driving(Part):
    """From now on a vehicle is driven by the story alone or by SUMO.

    The story alone keeps speed and lane until a rule changes them, whatever is in the way, and
    heeds neither lights nor right of way.
    """

    by: DriverName


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
    drive: Driving | None = None
    own: OwnAction | None = None
    together: Annotated[tuple[Action, ...], Field(min_length=2)] | None = None

    @model_validator(mode="after")
    def _check_one_kind(self) -> Self:
        one_of(self, tuple(type(self).model_fields), "action")
        for action in self.together or ():
            if action.together is not None:
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


class StoryRule(Part):
    """When a condition holds, an actor does something; items of ``then`` follow one another.

    A rule fires ``times`` times at most: again when its condition comes true anew after what it
    does is over.
    """

    id: Identifier
    actor: Identifier
    when: Condition
    then: Annotated[tuple[Action, ...], Field(min_length=1)]
    times: Annotated[int, Field(ge=1, le=100_000)] = 1


class RulePart(NamedTuple):
    """A condition or an action with its place in the document: ``rules[0].when.all[1].ttc``."""

    where: str
    kind: str
    part: Part


def rule_parts(rule: StoryRule, where: str) -> Iterator[RulePart]:
    """All conditions and actions of a rule that are not combinations, in order."""
    yield from _condition_parts(rule.when, f"{where}.when")
    for index, item in enumerate(rule.then):
        for number, part in enumerate(item.parts):
            inside = f".together[{number}]" if item.together else ""
            place = f"{where}.then[{index}]{inside}.{part.kind}"
            yield RulePart(place, part.kind, getattr(part, part.kind))


def _condition_parts(condition: Condition, where: str) -> Iterator[RulePart]:
    kind = condition.kind
    if kind == "not_" and condition.not_ is not None:
        yield from _condition_parts(condition.not_, f"{where}.not")
    elif kind in ("all", "any"):
        for index, part in enumerate(getattr(condition, kind)):
            yield from _condition_parts(part, f"{where}.{kind}[{index}]")
    else:
        yield RulePart(f"{where}.{kind}", kind, getattr(condition, kind))


def places_of(part: Part) -> Iterator[tuple[str, RulePlace]]:
    """Places that a condition or action names, with the names of their fields."""
    if isinstance(part, Appearing):  # an exact pose, no place of the map
        return
    if isinstance(part, PathFollowing) and part.relative_to is not None:
        return
    for name in ("place", "to", "at", "when_at"):
        value = getattr(part, name, None)
        if value is not None and not (name == "to" and _names_actor_in_to(part)):
            yield name, value
    for name in ("through", "points"):
        for index, value in enumerate(getattr(part, name, ())):
            yield f"{name}[{index}]", value


def actors_of(part: Part) -> Iterator[tuple[str, str]]:
    """Actors that a condition or action names, with the names of their fields."""
    for name in ("of", "to", "relative_to"):
        value = getattr(part, name, None)
        if isinstance(value, str) and (name != "to" or _names_actor_in_to(part)):
            yield name, value


def appearing_actors(rules: Iterable[StoryRule]) -> frozenset[str]:
    """Actors that rules let appear, and that are not on the road before."""
    return frozenset(
        rule.actor
        for rule in rules
        for item in rule.then
        if any(part.appear is not None for part in item.parts)
    )


def _names_actor_in_to(part: Part) -> bool:
    """Whether ``to`` is an actor: it is a place, a speed or an offset in some."""
    return not isinstance(part, Walking | SpeedChange | LateralMove | LaneChange | NewGoal)
