"""Distributions that a sampling configuration is written in.

Each draws one number from a numpy generator passed in; a table ``{kind = "normal", ...}`` or a bare
number stands for one. ``weights`` and ``shares`` are relative everywhere: they need not sum to one.
"""

from __future__ import annotations

import math
import zlib
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar

import numpy as np
from pydantic import BeforeValidator, Field, PlainSerializer, model_validator

from odscen.scenario.document.document_parts import Part

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence


def stream(seed: int, *names: str) -> np.random.Generator:
    """Random numbers of one name, independent of what else is drawn, and of the order."""
    words = [zlib.crc32(name.encode()) for name in names]
    return np.random.default_rng(np.random.SeedSequence([seed, *words]))


_Key = TypeVar("_Key")

Drawn = Annotated[float, Field(ge=-1e9, le=1e9)]
"""A number that may be drawn: within what all fields of a scenario can be."""
_RETRIES = 64
"""Draws outside ``low``..``high`` before a normal distribution is clipped instead."""


class Constant(Part):
    """Always ``value``."""

    kind: Literal["constant"] = "constant"
    value: Drawn

    def draw(self, rng: np.random.Generator) -> float:  # noqa: ARG002 - same call as the others
        """Return the value."""
        return self.value


class Uniform(Part):
    """Any number from ``low`` to ``high``."""

    kind: Literal["uniform"] = "uniform"
    low: Drawn
    high: Drawn

    @model_validator(mode="after")
    def _check_bounds(self) -> Uniform:
        _check_order(self.low, self.high)
        return self

    def draw(self, rng: np.random.Generator) -> float:
        """Draw a number."""
        return min(max(float(rng.uniform(self.low, self.high)), self.low), self.high)


class Normal(Part):
    """Normal distribution, drawn again while outside ``low`` to ``high``."""

    kind: Literal["normal"] = "normal"
    mean: Drawn
    std: Annotated[float, Field(ge=0, le=1e9)]
    low: Drawn
    high: Drawn

    @model_validator(mode="after")
    def _check_bounds(self) -> Normal:
        _check_order(self.low, self.high)
        return self

    def draw(self, rng: np.random.Generator) -> float:
        """Draw a number."""
        std = abs(self.std)  # -0.0 is not below 0, but numpy refuses it
        for _ in range(_RETRIES):
            value = float(rng.normal(self.mean, std))
            if self.low <= value <= self.high:
                return value
        return min(max(self.mean, self.low), self.high)


class Choice(Part):
    """One of ``values``, each with its weight (equal if there are none)."""

    kind: Literal["choice"] = "choice"
    values: Annotated[tuple[Drawn, ...], Field(min_length=1)]
    weights: tuple[Annotated[float, Field(ge=0)], ...] | None = None

    @model_validator(mode="after")
    def _check_weights_given(self) -> Choice:
        if self.weights is not None:
            if len(self.weights) != len(self.values):
                raise ValueError(f"{len(self.values)} values but {len(self.weights)} weights")
            check_weights(self.weights, what="weight")
        return self

    def draw(self, rng: np.random.Generator) -> float:
        """Draw a number."""
        weights = self.weights or (1.0,) * len(self.values)
        return self.values[draw_place(weights, rng)]


def _read_number(value: Any) -> Any:
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return {"kind": "constant", "value": value}
    if isinstance(value, dict):
        # Read strictly, an array of JSON is a tuple, but not once Python has had it in its hands.
        return {
            name: tuple(part) if isinstance(part, list) else part for name, part in value.items()
        }
    return value


Distribution = Annotated[
    Annotated[Constant | Uniform | Normal | Choice, Field(discriminator="kind")],
    BeforeValidator(_read_number),
]
"""A number, or a table with ``kind`` constant, uniform, normal or choice."""


DistributionTable = dict[str, str | float | list[float]]
"""A distribution as it is written, with its kind."""


def as_written(
    constant: Constant | Uniform | Normal | Choice,
) -> float | DistributionTable:
    """Give a constant as the number that it is, and of others the kind, default or not."""
    if isinstance(constant, Constant):
        return constant.value
    return constant.model_dump(mode="json", exclude_none=True)


WrittenDistribution = Annotated[Distribution, PlainSerializer(as_written)]
"""A :data:`Distribution` of a document, which is written as briefly as it can be read."""


def drawn_range(distribution: Constant | Uniform | Normal | Choice) -> tuple[float, float]:
    """Least and greatest number that can be drawn."""
    if isinstance(distribution, Constant):
        return distribution.value, distribution.value
    if isinstance(distribution, Choice):
        return min(distribution.values), max(distribution.values)
    return distribution.low, distribution.high


def draw_place(weights: Sequence[float], rng: np.random.Generator) -> int:
    """Draw an index by weight; at least one weight must be above 0."""
    total = np.cumsum(weights)
    # What is drawn lies below the total, but may be rounded to it: then the last that counts.
    last_weighted = np.searchsorted(total, total[-1])
    return int(
        min(np.searchsorted(total, rng.uniform(0.0, total[-1]), side="right"), last_weighted)
    )


def draw_key(shares: Mapping[_Key, float], rng: np.random.Generator) -> _Key:
    """Draw a key by its share; keys count in the mapping's order."""
    return tuple(shares)[draw_place(tuple(shares.values()), rng)]


def _check_order(low: float, high: float) -> None:
    if low > high:
        raise ValueError(f"low {low:g} is above high {high:g}")


def check_weights(weights: Iterable[float], *, what: str) -> None:
    """Raise ``ValueError`` if nothing can be drawn by these weights."""
    total = sum(weights)
    if total <= 0:
        raise ValueError(f"at least one {what} must be above 0")
    if total == math.inf:
        raise ValueError(
            f"the sum of the {what}s is no number; they are relative, smaller ones say the same"
        )
