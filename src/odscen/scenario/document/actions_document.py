"""Actions of rules: what an actor then does; each kind a part with its own fields.

Metres, seconds, m/s, m/s^2; left is positive. What each kind means is in
:mod:`odscen.scenario.story.action_kinds` and in docs/rules.md.
"""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from odscen.scenario.document.conditions_document import RulePlace, one_of
from odscen.scenario.document.document_parts import Identifier, Part

Positive = Annotated[float, Field(gt=0, le=1e6, allow_inf_nan=False)]
Rate = Annotated[float, Field(gt=0, le=100, allow_inf_nan=False)]
RuleSpeed = Annotated[float, Field(ge=0, le=100, allow_inf_nan=False)]
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
            msg = f"a step takes no time; leave out {' and '.join(given)}"
            raise ValueError(msg)
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
    """Change ``by`` so many lanes to the left (negative: right), ``over`` so many seconds."""

    by: Annotated[int, Field(ge=-10, le=10)]
    over: Positive = 3.0

    @model_validator(mode="after")
    def _some_lane(self) -> Self:
        if self.by == 0:
            msg = "by must not be 0"
            raise ValueError(msg)
        return self


class LateralMove(Part):
    """Move to ``to`` metres left of the lane's centre, ``over`` so many seconds."""

    to: Annotated[float, Field(ge=-10, le=10)]
    over: Positive = 3.0


class GapKeeping(Part):
    """Follow ``to`` at a free gap of ``metres`` or ``seconds``, for ``lasting`` seconds."""

    to: Identifier
    metres: Positive | None = None
    seconds: Positive | None = None
    lasting: Positive | None = None
    rate: Rate = 3.0

    @model_validator(mode="after")
    def _one_gap(self) -> Self:
        one_of(self, ("metres", "seconds"), "gap")
        return self


class Walking(Part):
    """Walk straight to a place, through others if given, wherever that leads."""

    to: RulePlace
    through: tuple[RulePlace, ...] = ()
    speed: WalkingSpeed | None = None


class Arriving(Part):
    """Be at a place at the instant at which ``to`` is at another one.

    ``at`` is where the actor is to be, ``when_at`` where the other one is then.
    """

    at: RulePlace
    to: Identifier
    when_at: RulePlace


class Vanishing(Part):
    """Leave the simulation."""


class Ignoring(Part):
    """Heed neither red lights nor right of way, or one of the two."""

    red: bool = True
    right_of_way: bool = False


class Releasing(Part):
    """SUMO drives as if there had been no rule."""


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
    arrive: Arriving | None = None
    vanish: Vanishing | None = None
    ignore: Ignoring | None = None
    release: Releasing | None = None
    together: Annotated[tuple[Action, ...], Field(min_length=2)] | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        one_of(self, tuple(type(self).model_fields), "action")
        for one in self.together or ():
            if one.together is not None:
                msg = "what runs together cannot itself be together"
                raise ValueError(msg)
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
