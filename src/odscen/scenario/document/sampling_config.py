"""The configuration of the sampler: one small TOML or JSON file, every field with a default (R46).

An empty file is a valid configuration. docs/sampling.md explains the fields with an example.
"""

from __future__ import annotations

import tomllib
from typing import Annotated, Any

from pydantic import Field, ValidationError, field_validator
from pydantic_core import from_json

from odscen.base.categories import Category
from odscen.base.errors import ScenarioError
from odscen.scenario.document.distributions import (
    Constant,
    Distribution,
    Normal,
    Uniform,
    check_weights,
)
from odscen.scenario.document.document_parts import Label, Part
from odscen.scenario.document.drivers_document import DrivingStyle
from odscen.scenario.document.problems import validated, validation_problems

Share = Annotated[float, Field(ge=0)]
Probability = Annotated[float, Field(ge=0, le=1)]


class StatisticRange(Part):
    """What a statistic of a map must lie between; either end may be left open."""

    min: float | None = None
    max: float | None = None

    def holds(self, value: float) -> bool:
        """Whether ``value`` lies within the bounds, ends included."""
        return (self.min is None or value >= self.min) and (self.max is None or value <= self.max)


class MapFilter(Part):
    """Which maps may be drawn (R19).

    ``names`` and ``exclude`` are shell patterns; ``where`` maps a statistic's name (as in ``odscen
    maps show``) to bounds; ``weight_by`` names the statistic that the probability of a map is
    proportional to (equal ones without).
    """

    names: tuple[Label, ...] = ("*",)
    exclude: tuple[Label, ...] = ()
    where: dict[Label, StatisticRange] = Field(default_factory=dict)
    weight_by: Label | None = None


class RoiSize(Part):
    """Number of segments in the region; more than the map has means the whole map."""

    segments: Distribution = Uniform(low=4, high=16)


def _default_presets() -> dict[str, float]:
    return {
        "ClearNoon": 4.0,
        "CloudyNoon": 2.0,
        "WetNoon": 1.0,
        "SoftRainNoon": 1.0,
        "ClearSunset": 1.0,
        "ClearNight": 1.0,
    }


class EnvironmentShares(Part):
    """Presets by share, and single parameters that are drawn on top."""

    presets: dict[Label, Share] = Field(default_factory=_default_presets, min_length=1)
    parameters: dict[Label, Distribution] = Field(default_factory=dict)

    @field_validator("presets")
    @classmethod
    def _some_share(cls, presets: dict[str, float]) -> dict[str, float]:
        return _with_share(presets)


class PlacingRules(Part):
    """Where actors may start. Junction lanes are never used for sampled spawns.

    ``minimum_gap`` is the free length between two bodies, ``minimum_trip`` the shortest path to the
    nearest end of the region, ``lane_types`` restricts to these types (all drivable ones if empty),
    ``speed_limit_max`` keeps a category off faster lanes. Metres and m/s.
    """

    minimum_gap: Annotated[float, Field(ge=0, le=100)] = 3.0
    minimum_trip: Annotated[float, Field(ge=0)] = 20.0
    lane_types: tuple[Label, ...] = ()
    speed_limit_max: dict[Category, Annotated[float, Field(gt=0)]] = Field(
        default_factory=lambda: {Category.BICYCLE: 17.0}
    )
    exclude_segments: tuple[Label, ...] = ()


def _default_styles() -> dict[DrivingStyle, float]:
    return {"cautious": 0.25, "normal": 0.55, "sporty": 0.2}


class Behaviour(Part):
    """Dynamic parameters (R40).

    ``speed_factor`` times the limit of the spawn lane is a motor vehicle's desired speed, with
    ``unlimited_speed`` m/s where the map gives no limit. ``lateral_offset`` is cut so that the body
    stays in its lane.
    """

    speed_factor: Distribution = Normal(mean=1.0, std=0.1, low=0.7, high=1.2)
    unlimited_speed: Annotated[float, Field(gt=0, le=100)] = 13.89
    bicycle_speed: Distribution = Normal(mean=5.0, std=1.0, low=2.5, high=9.0)
    walking_speed: Distribution = Normal(mean=1.35, std=0.2, low=0.7, high=2.0)
    lateral_offset: Distribution = Normal(mean=0.0, std=0.15, low=-0.4, high=0.4)
    styles: dict[DrivingStyle, Share] = Field(default_factory=_default_styles, min_length=1)
    depart: Distribution = Constant(value=0.0)
    crosses_anywhere: Probability = 0.0
    ignores_red: Probability = 0.0

    @field_validator("styles")
    @classmethod
    def _some_share(cls, styles: dict[DrivingStyle, float]) -> dict[DrivingStyle, float]:
        return _with_share(styles)


def _default_shares() -> dict[Category, float]:
    return {
        Category.CAR: 0.7,
        Category.VAN: 0.1,
        Category.TRUCK: 0.06,
        Category.BUS: 0.02,
        Category.MOTORCYCLE: 0.06,
        Category.BICYCLE: 0.06,
    }


class SamplingConfig(Part):
    """Everything that automated generation draws from.

    ``fill`` is the share of the largest number of actors that fit; ``vehicles`` the share of each
    category among vehicles; ``pedestrian_share`` the share of pedestrians among all actors as far
    as the walks of the region have room. ``actors_max`` caps the number of vehicles and pedestrians
    together. ``ego`` makes one of the cars (any vehicle if there is none) the ego.
    """

    maps: MapFilter = MapFilter()
    roi: RoiSize = RoiSize()
    environment: EnvironmentShares = EnvironmentShares()
    fill: Distribution = Uniform(low=0.05, high=0.3)
    actors_max: Annotated[int, Field(ge=0)] | None = None
    vehicles: dict[Category, Share] = Field(default_factory=_default_shares, min_length=1)
    pedestrian_share: Annotated[float, Field(ge=0, lt=1)] = 0.1
    places: PlacingRules = PlacingRules()
    behaviour: Behaviour = Behaviour()
    ego: bool = False
    duration: Annotated[float, Field(gt=0, le=1e9)] = 600.0
    step_length: Annotated[float, Field(gt=0, le=1)] = 0.5

    @field_validator("vehicles")
    @classmethod
    def _vehicles_only(cls, shares: dict[Category, float]) -> dict[Category, float]:
        if Category.PEDESTRIAN in shares:
            raise ValueError("pedestrians are not vehicles; give pedestrian_share instead")
        return _with_share(shares)

    @field_validator("fill")
    @classmethod
    def _within_one(cls, fill: Any) -> Any:
        values = [
            getattr(fill, name) for name in ("value", "low", "high") if hasattr(fill, name)
        ] or list(fill.values)
        if min(values) < 0 or max(values) > 1:
            raise ValueError("a fill share lies between 0 and 1")
        return fill


def overridden(
    config: SamplingConfig, *, fill: float | None = None, roi_segments: int | None = None
) -> SamplingConfig:
    """Return the configuration with a fixed fill share or number of segments, where given.

    Raises
    ------
    ScenarioError
        If the value is not possible.
    """
    changes: dict[str, Any] = {}
    if fill is not None:
        changes["fill"] = fill
    if roi_segments is not None:
        if roi_segments < 1:
            raise ScenarioError(
                f"a region has at least 1 segment, not {roi_segments}", element="roi.segments"
            )
        changes["roi"] = {"segments": roi_segments}
    fields = {name: getattr(config, name) for name in SamplingConfig.model_fields}
    return validated(SamplingConfig, fields | changes)


def loads_config(text: str, *, file: str | None = None) -> SamplingConfig:
    """Read a sampling configuration from TOML or, if it starts with ``{``, JSON.

    Raises
    ------
    ScenarioError
        With one line per problem, each with its place.
    """
    try:
        data = from_json(text) if text.lstrip().startswith("{") else tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise ScenarioError(
            f"the sampling configuration cannot be read: {error}", file=file
        ) from error
    try:
        return SamplingConfig.model_validate(data)
    except ValidationError as error:
        raise ScenarioError(
            "the sampling configuration has problems",
            problems=validation_problems(error),
            file=file,
        ) from error


def _with_share(shares: dict[Any, float]) -> dict[Any, float]:
    check_weights(shares.values(), what="share")
    return shares
