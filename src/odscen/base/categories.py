"""The seven categories of road users (requirement R35) and their usual bodies."""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple


class Category(StrEnum):
    """Exactly seven; the order is that of the interface."""

    CAR = "car"
    VAN = "van"
    TRUCK = "truck"
    BUS = "bus"
    MOTORCYCLE = "motorcycle"
    BICYCLE = "bicycle"
    PEDESTRIAN = "pedestrian"


class Body(NamedTuple):
    """A road user's bounding box, metres."""

    length: float
    width: float
    height: float


DEFAULT_BODY: dict[Category, Body] = {
    # SUMO's defaults per vehicle class:
    # https://sumo.dlr.de/docs/Vehicle_Type_Parameter_Defaults.html
    Category.CAR: Body(5.0, 1.8, 1.5),
    Category.VAN: Body(6.5, 2.16, 2.86),
    Category.TRUCK: Body(7.1, 2.4, 2.4),
    Category.BUS: Body(12.0, 2.5, 3.4),
    Category.MOTORCYCLE: Body(2.2, 0.9, 1.5),
    Category.BICYCLE: Body(1.6, 0.65, 1.7),
    Category.PEDESTRIAN: Body(0.215, 0.478, 1.719),
}
