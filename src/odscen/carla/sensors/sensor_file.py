"""A file of sensors that are to be attached to the ego: what, where, and with which attributes."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from odscen.base.errors import InputError
from odscen.scenario.document.problems import validation_problems

_Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]{0,39}$")]
_Type = Annotated[str, Field(pattern=r"^sensor\.(camera\.[a-z_]+|lidar\.ray_cast|other\.radar)$")]


class _SensorPart(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class MountingPlace(_SensorPart):
    """Where a sensor is on the ego: metres and degrees, CARLA's frame (x ahead, y right, z up)."""

    x: float = 0.0
    y: float = 0.0
    z: float = 2.0
    pitch: float = 0.0
    yaw: float = 0.0
    roll: float = 0.0


class SensorWish(_SensorPart):
    """One sensor.

    Attributes
    ----------
    name
        Of its folder in the run's.
    type
        Blueprint: a camera, a lidar or a radar.
    attributes
        Of the blueprint; numbers are written as CARLA wants them.
    """

    name: _Name
    type: _Type
    place: MountingPlace = MountingPlace()
    attributes: dict[str, str | int | float | bool] = Field(default_factory=dict)

    def values(self) -> dict[str, str]:
        """Attributes as text."""
        return {
            name: str(value).lower() if isinstance(value, bool) else str(value)
            for name, value in self.attributes.items()
        }


class SensorList(_SensorPart):
    """A file's content."""

    sensors: Annotated[tuple[SensorWish, ...], Field(min_length=1, max_length=20)]

    @model_validator(mode="after")
    def _names_differ(self) -> SensorList:
        names = [sensor.name for sensor in self.sensors]
        if twice := sorted({name for name in names if names.count(name) > 1}):
            raise ValueError(f"two sensors are named {twice[0]}")
        return self


def parse_sensors(text: str, *, file: str) -> tuple[SensorWish, ...]:
    """Sensors of a file's text.

    Raises
    ------
    InputError
        If it is not such a file; names the element and the value.
    """
    try:
        return SensorList.model_validate_json(text).sensors
    except ValidationError as error:
        raise InputError(validation_problems(error)[0], file=file) from error
