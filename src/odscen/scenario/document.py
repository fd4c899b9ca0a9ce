"""The scenario document: one small JSON file, versioned, with a published schema.

Units are SI: metres, seconds, m/s; flows count per hour, as traffic engineers do, and say so in the
name. Node, segment and map names refer to the lane graph of one map, named with its content hash.
Rules that need the graph live in :mod:`odscen.scenario.checks`, not here.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from odscen.categories import Category

FORMAT = "odscen-scenario"
VERSION = 1

DrivingStyle = Literal["cautious", "normal", "sporty"]
Seconds = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Speed = Annotated[float, Field(gt=0, le=100, allow_inf_nan=False)]


class Part(BaseModel):
    """Base of all parts of the document: frozen, unknown fields refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class MapReference(Part):
    """The map, by name *and* content."""

    name: str
    sha256: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
    spacing: Annotated[float, Field(gt=0, le=100)] = 2.0


class Environment(Part):
    """Weather and time of day: a preset of the asset catalogue and single values that differ."""

    preset: str = "ClearNoon"
    parameters: dict[str, float] = Field(default_factory=dict)
    affects_driving: bool = True


class Actor(Part):
    """One road user, placed by hand or sampled.

    ``category`` is always given; ``model`` may name a blueprint of that category. ``goal`` ``None``
    draws one of the candidates by the scenario's seed. ``speed`` is the desired speed; ``None`` is
    the limit (vehicles) or the category's usual walking speed (pedestrians). ``lateral_offset`` is
    positive to the left of the driving direction.
    """

    id: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", max_length=64)]
    category: Category
    model: str | None = None
    spawn: str
    goal: str | None = None
    speed: Speed | None = None
    lateral_offset: Annotated[float, Field(ge=-10, le=10)] = 0.0
    depart: Seconds = 0.0
    style: DrivingStyle = "normal"
    ego: bool = False
    crosses_anywhere: bool = False
    ignores_red: bool = False


class Flow(Part):
    """A stream of actors from one spawn node, ``per_hour`` of them from ``begin`` to ``end``.

    ``mix`` gives the share of each category; shares are relative, they need not sum to one.
    Pedestrian nodes take pedestrians only, lane nodes the other six.
    """

    id: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", max_length=64)]
    spawn: str
    goal: str | None = None
    per_hour: Annotated[float, Field(gt=0, le=20_000)]
    begin: Seconds = 0.0
    end: Seconds = 3600.0
    mix: dict[Category, Annotated[float, Field(gt=0)]] = Field(
        default_factory=lambda: {Category.CAR: 1.0}
    )
    speed: Speed | None = None


class Simulation(Part):
    """How the scenario is run unless the command says otherwise."""

    duration: Annotated[float, Field(gt=0)] = 600.0
    step_length: Annotated[float, Field(gt=0, le=1)] = 0.5


class Scenario(Part):
    """The whole document."""

    format: Literal["odscen-scenario"] = FORMAT
    version: Literal[1] = VERSION
    name: Annotated[str, Field(min_length=1, max_length=120)]
    description: str = ""
    map: MapReference
    seed: Annotated[int, Field(ge=0, lt=2**31)] = 0
    roi: tuple[str, ...]
    environment: Environment = Environment()
    actors: tuple[Actor, ...] = ()
    flows: tuple[Flow, ...] = ()
    simulation: Simulation = Simulation()
