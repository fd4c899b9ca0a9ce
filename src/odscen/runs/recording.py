"""What is recorded: trajectories (how often, where, and which columns), emissions, conflicts.

Trajectories as text, for the command line: ``none``, or ``key=value`` with commas between:
``every=1s``, ``region=XMIN:YMIN:XMAX:YMAX`` (metres, OpenDRIVE frame), ``columns=lane+pos``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, Self, get_args

from odscen.base.durations import parse_duration
from odscen.base.errors import InputError

NEEDED = ("id", "x", "y", "angle", "speed")
"""Columns that are always recorded: nothing can be drawn or replayed without them."""
RecordedColumn = Literal["lane", "pos", "slope"]
OPTIONAL: tuple[RecordedColumn, ...] = get_args(RecordedColumn)
"""Columns that can be left out or added; SUMO has them for vehicles and persons alike."""
REGION_ID = "odscen.recorded"
"""Id of the polygon in SUMO's additional file."""


@dataclass(frozen=True, slots=True)
class Recording:
    """What is recorded.

    Attributes
    ----------
    trajectories
        Whether there are any.
    every
        Seconds between two records; ``None`` for every step.
    region
        Least x, least y, greatest x, greatest y; metres, OpenDRIVE frame.
    columns
        Of :data:`OPTIONAL`, beside :data:`NEEDED`.
    emissions
        Whether lanes report what was emitted on them; without trajectories too.
    criticality
        Whether vehicles watch how close they come to each other, and to people on foot if there
        are trajectories of every step.
    """

    trajectories: bool = True
    every: float | None = None
    region: tuple[float, float, float, float] | None = None
    columns: tuple[RecordedColumn, ...] = ("lane",)
    emissions: bool = True
    criticality: bool = False

    def __post_init__(self) -> None:
        if self.every is not None and not (
            isinstance(self.every, int | float) and 0 < self.every < math.inf
        ):
            raise InputError(f"every must be seconds above 0, not {self.every!r}")
        if self.region is not None and len(self.region) != 4:
            raise InputError(f"region must be four numbers, metres, not {self.region!r}")
        if isinstance(self.columns, str) or not set(self.columns) <= set(OPTIONAL):
            raise InputError(
                f"columns must be a tuple of {', '.join(OPTIONAL)}, not {self.columns!r}"
            )

    def with_criticality(self, wanted: bool) -> Self:
        """Record how close road users come too, if that is wanted."""
        return replace(self, criticality=True) if wanted else self

    def attributes(self, *, elevation: bool) -> tuple[str, ...]:
        """SUMO's names of the columns, in its order."""
        z = ("z",) if elevation else ()
        return (*NEEDED[:3], *z, *NEEDED[3:], *self.columns)


def parse_recording(text: str) -> Recording:
    """Read what the command line says.

    Raises
    ------
    InputError
        Names the part that cannot be read, and what is possible.
    """
    if text.strip() == "none":
        return Recording(trajectories=False)
    every: float | None = None
    region: tuple[float, float, float, float] | None = None
    columns: tuple[RecordedColumn, ...] = ("lane",)
    for part in text.split(","):
        key, _, value = (word.strip() for word in part.partition("="))
        if key == "every":
            every = parse_duration(value)
        elif key == "region":
            region = _parse_region(value)
        elif key == "columns":
            columns = _parse_columns(value)
        else:
            raise InputError(
                f"trajectories: {part.strip()!r} is not one of none, every=, region=, columns="
            )
    return Recording(every=every, region=region, columns=columns)


def region_xml(region: tuple[float, float, float, float], net_offset: tuple[float, float]) -> str:
    """SUMO's additional file with the region as a polygon."""
    dx, dy = net_offset
    x0, y0, x1, y1 = region[0] + dx, region[1] + dy, region[2] + dx, region[3] + dy
    shape = f"{x0:.2f},{y0:.2f} {x1:.2f},{y0:.2f} {x1:.2f},{y1:.2f} {x0:.2f},{y1:.2f}"
    return f'<additional>\n    <poly id="{REGION_ID}" shape="{shape}"/>\n</additional>\n'


def _parse_region(text: str) -> tuple[float, float, float, float]:
    try:
        x0, y0, x1, y1 = (float(number) for number in text.split(":"))
    except ValueError:
        raise InputError(
            f"trajectories: region {text!r} is not four numbers XMIN:YMIN:XMAX:YMAX in metres"
        ) from None
    if not (x0 < x1 and y0 < y1):
        raise InputError(f"trajectories: region {text!r} is empty")
    return x0, y0, x1, y1


def _parse_columns(text: str) -> tuple[RecordedColumn, ...]:
    wanted = {word.strip() for word in text.split("+")} - set(NEEDED)
    unknown = sorted(wanted - set(OPTIONAL))
    if unknown:
        raise InputError(
            f"trajectories: no column {unknown[0]!r}; {', '.join(NEEDED)} are always recorded, "
            f"possible beside them are {', '.join(OPTIONAL)}"
        )
    return tuple(name for name in OPTIONAL if name in wanted)
