"""SUMO's additional file that makes it measure traffic on lanes, and emissions if wanted."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from odscen.runs.layout import EMISSIONS_FILE, LANES_FILE, STATES_FILE

if TYPE_CHECKING:
    from collections.abc import Sequence

INTERVALS = (10.0, 30.0, 60.0, 300.0, 900.0)
"""Seconds, from fine to coarse: one of them is what is measured over."""
MOST_INTERVALS = 96
"""Of a run, unless it is longer than a day."""
LANE_ATTRIBUTES = (
    "sampledSeconds", "traveltime", "density", "waitingTime", "timeLoss", "speed", "departed",
    "arrived", "entered", "left", "distance",
)  # fmt: skip
EMISSIONS = ("CO2", "CO", "HC", "NOx", "PMx", "fuel", "electricity")
"""SUMO's names: mg, electricity in Wh."""


def interval_of(
    until: float, slice_length: float | None = None, *, analysed: Sequence[float] = ()
) -> float:
    """Seconds that a run of ``until`` seconds is measured over; no longer than a slice.

    ``analysed`` are times that figures begin at or are given over: whole multiples of it.
    """
    fine = (value for value in INTERVALS if until / value <= MOST_INTERVALS)
    interval = min(next(fine, INTERVALS[-1]), slice_length or until)
    if all(math.isclose(value % interval, 0.0, abs_tol=1e-6) for value in analysed):
        return interval
    return float(math.gcd(round(interval), *(round(value) for value in analysed)))


def measures_xml(
    interval: float, *, emissions: bool, lights: bool = False, watched: Sequence[str] = ()
) -> str:
    """Text of ``measures.add.xml``; files are relative to it.

    Parameters
    ----------
    lights
        Whether there are traffic lights, whose states are logged when they change.
    watched
        SUMO's ids of lights whose detectors are logged too, in every step.
    """
    wanted = [_lane_data("lanes", LANES_FILE, interval, LANE_ATTRIBUTES)]
    if emissions:
        attributes = tuple(f"{name}_abs" for name in EMISSIONS)
        wanted.append(
            _lane_data("emissions", EMISSIONS_FILE, interval, attributes, 'type="emissions" ')
        )
    if lights:
        wanted.append(f'    <timedEvent type="SaveTLSSwitchStates" dest="{STATES_FILE}"/>')
    wanted += [
        f'    <timedEvent type="SaveTLSStates" source="{light}" dest="{calls_file(number)}"'
        ' saveDetectors="true"/>'
        for number, light in enumerate(watched)
    ]
    return "\n".join(["<additional>", *wanted, "</additional>", ""])


def calls_file(number: int) -> str:
    """Name of SUMO's log of the detectors of one light; there is one for each."""
    return f"detector_calls.{number}.xml"


def _lane_data(
    name: str, file: str, interval: float, attributes: tuple[str, ...], kind: str = ""
) -> str:
    return (
        f'    <laneData id="{name}" {kind}file="{file}" period="{interval:g}"'
        f' excludeEmpty="true" withInternal="true" writeAttributes="{" ".join(attributes)}"/>'
    )
