"""Conditions of rules: when something is to happen; each kind a part with its own fields.

Metres, seconds, m/s, m/s^2. What each kind means is in :mod:`odscen.scenario.story.condition_kinds`
and in docs/rules.md.
"""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import ConfigDict, Field, model_validator

from odscen.scenario.document.document_parts import Identifier, Label, Part, Seconds

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
    def _one_bound(self) -> Self:
        one_of(self, ("below", "above"), "bound")
        return self


class OwnBounded(Bounded):
    """A value of one actor: ``of``, or the rule's own."""

    of: Identifier | None = None


class PairBounded(OwnBounded):
    """A value between two actors."""

    to: Identifier


class AfterTime(Part):
    """Simulated time is ``after`` seconds or more."""

    after: Seconds


class DistanceBounded(OwnBounded):
    """A distance to an actor or to a place; ``free`` measures between bodies, not their centres."""

    to: Identifier | None = None
    place: RulePlace | None = None
    along: Literal["straight", "longitudinal", "lateral", "lane"] = "straight"
    free: bool = True

    @model_validator(mode="after")
    def _one_end(self) -> Self:
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
    ttc: PairBounded | None = None
    headway: PairBounded | None = None
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
    def _one_kind(self) -> Self:
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
