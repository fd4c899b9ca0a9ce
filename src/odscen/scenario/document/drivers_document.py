"""Drivers in the scenario document: what all of them do, and kinds of drivers of one's own."""

from __future__ import annotations

from difflib import get_close_matches
from typing import Annotated, Literal, Self, get_args

from pydantic import Field, model_validator

from odscen.scenario.document.distributions import (
    WrittenDistribution,
    check_weights,
    drawn_range,
)
from odscen.scenario.document.document_parts import Identifier, Label, Part
from odscen.scenario.document.driver_parameters import DRIVER_PARAMETERS

DrivingStyle = Literal["cautious", "normal", "sporty"]
DRIVING_STYLES: tuple[DrivingStyle, ...] = get_args(DrivingStyle)


class DriverSet(Part):
    """Drivers of one kind, by SUMO's own names of what is different from a driving style's.

    ``parameters`` are numbers or distributions, of which each driver draws one by the scenario's
    seed; :data:`~odscen.scenario.document.driver_parameters.DRIVER_PARAMETERS` has names, ranges
    and meanings. ``car_following`` is SUMO's model.
    """

    id: Identifier
    style: DrivingStyle = "normal"
    parameters: dict[Label, WrittenDistribution] = Field(default_factory=dict)
    car_following: Literal["Krauss", "IDM"] = "Krauss"

    @model_validator(mode="after")
    def _check_names(self) -> Self:
        if self.id in DRIVING_STYLES:
            raise ValueError(f"{self.id!r} is a driving style; give the set another id")
        for name, value in self.parameters.items():
            _check_parameter(name, *drawn_range(value))
        return self


def _check_parameter(name: str, low: float, high: float) -> None:
    known = DRIVER_PARAMETERS.get(name)
    if known is None:
        near = get_close_matches(name, DRIVER_PARAMETERS, n=1)
        hint = f"; did you mean {near[0]}?" if near else ""
        raise ValueError(f"drivers have no parameter {name!r}{hint}")
    if not known.low <= low <= high <= known.high:
        unit = f" {known.unit}" if known.unit else ""
        range_text = f"{low:g}" if low == high else f"{low:g} to {high:g}"
        raise ValueError(f"{name} must be {known.low:g} to {known.high:g}{unit}, not {range_text}")


class Drivers(Part):
    """What drivers of the style ``normal`` do; the other styles are set about it.

    ``saturation_flow`` (vehicles per hour and lane that pass a stop line from a queue, cars on a
    straight approach with a limit of 50 km/h) is another way to give the ``headway``, the desired
    time from the rear of the vehicle in front, s. ``gap_acceptance`` is 0 for those who only take
    gaps in which nobody else has to brake, and 1 for those who take any that is safe.
    ``lane_change_eagerness`` multiplies the eagerness to change lanes in order to drive faster.
    ``sets`` are further kinds of drivers, whose ids actors name as their ``style``; of flows and
    demand each driver draws a style or set by ``shares``, and all are normal without.
    """

    saturation_flow: Annotated[float, Field(ge=800, le=2500)] | None = None
    headway: Annotated[float, Field(ge=0.5, le=5)] | None = None
    gap_acceptance: Annotated[float, Field(ge=0, le=1)] = 0.4
    lane_change_eagerness: Annotated[float, Field(ge=0, le=10)] = 1.0
    sets: tuple[DriverSet, ...] = ()
    shares: dict[Identifier, Annotated[float, Field(gt=0)]] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _check_one_headway(self) -> Self:
        if self.saturation_flow is not None and self.headway is not None:
            raise ValueError(
                "give one of saturation_flow and headway, not both: each decides the other"
            )
        return self

    @model_validator(mode="after")
    def _check_styles(self) -> Self:
        ids = [driver_set.id for driver_set in self.sets]
        twice = sorted({name for name in ids if ids.count(name) > 1})
        if twice:
            raise ValueError(f"several driver sets have the id {twice[0]!r}")
        for style in self.shares:
            if style not in self.styles:
                raise ValueError(
                    f"shares name {style!r}, which is neither a driving style nor a driver set"
                )
        if self.shares:
            check_weights(self.shares.values(), what="share")
        return self

    @property
    def styles(self) -> tuple[str, ...]:
        """Driving styles and ids of driver sets."""
        return (*DRIVING_STYLES, *(driver_set.id for driver_set in self.sets))
