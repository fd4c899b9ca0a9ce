"""Parameters of a scenario: named numbers that others are computed from."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from odscen.scenario.document.document_parts import Part

ParameterName = Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_]*$", max_length=64)]
Value = Annotated[float, Field(allow_inf_nan=False)]


class Parameter(Part):
    """A named number with its unit and the bounds between which it makes sense.

    Any number of the document may be written as a formula of parameters, ``"$gap"`` or
    ``"2 * $gap + 1"``, and so may the ``value`` of a later parameter.
    """

    value: Value
    unit: Annotated[str, Field(max_length=40)] = ""
    min: Value | None = None
    max: Value | None = None
    description: Annotated[str, Field(max_length=1000)] = ""

    @model_validator(mode="after")
    def _within_bounds(self) -> Self:
        low, high = self.min, self.max
        if low is not None and high is not None and low > high:
            raise ValueError(f"min {low:g} is above max {high:g}")
        if (low is not None and self.value < low) or (high is not None and self.value > high):
            bounds = f"{'' if low is None else f'{low:g}'}..{'' if high is None else f'{high:g}'}"
            msg = f"value {self.value:g} is outside {bounds} {self.unit}".rstrip()
            raise ValueError(msg)
        return self
