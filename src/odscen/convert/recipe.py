"""What netconvert is told: lane types, and the options from best to plainest.

Why these: ``docs/decisions/0001-netconvert-recipe.md``.
"""

from __future__ import annotations

from typing import NamedTuple

from odscen.opendrive.model import DRIVABLE_TYPES, WALKABLE_TYPES

TYPEMAP_FILE = "types.typ.xml"

_NO_CAR = (
    "pedestrian tram rail_urban rail rail_electric rail_fast ship container cable_car subway "
    "aircraft wheelchair scooter drone"
)
_MOTORWAY_TYPES = frozenset({"onRamp", "offRamp", "connectingRamp", "mwyEntry", "mwyExit", "HOV"})
_RESERVED = {"bus": "bus coach emergency", "taxi": "taxi emergency"}
_CLOSED_TYPES = frozenset(
    {"none", "shoulder", "border", "median", "curb", "stop", "restricted", "parking", "shared"}
    | {"bidirectional", "special1", "special2", "special3", "roadWorks", "tram", "rail"}
)


class Rung(NamedTuple):
    """One step of the ladder: what it gives up compared with the one before, and its options."""

    gives_up: str
    options: tuple[str, ...]


def typemap() -> str:
    """Permissions by OpenDRIVE lane type, as netconvert's type file.

    Motor vehicles and bicycles on drivable lanes, no bicycles on motorway ramps, pedestrians on
    walkable lanes, bicycles on ``biking``. Everything else is closed: netconvert then keeps such a
    lane only where it separates others, with nobody allowed on it.
    """
    names = sorted(DRIVABLE_TYPES | WALKABLE_TYPES | _CLOSED_TYPES | {"biking"})
    lines = (f'    <type id="{name}" {_type(name)}/>' for name in names)
    return "\n".join(["<types>", *lines, "</types>", ""])


def _type(name: str) -> str:
    if name in WALKABLE_TYPES:
        return 'priority="-2" speed="2.78" width="2.50" allow="pedestrian"'
    if name == "biking":
        return 'priority="-1" speed="5.56" width="1.50" allow="bicycle"'
    if name in _RESERVED:
        return f'priority="1" speed="13.89" width="3.65" allow="{_RESERVED[name]}"'
    if name in _MOTORWAY_TYPES:
        return f'priority="1" speed="22.22" width="3.65" disallow="bicycle moped {_NO_CAR}"'
    if name in DRIVABLE_TYPES:
        return f'priority="1" speed="13.89" width="3.65" disallow="{_NO_CAR}"'
    return 'priority="0" speed="1.39" width="1.00" disallow="all" discard="true"'


def ladder(*, lefthand: bool) -> tuple[Rung, ...]:
    """Options to try one after the other until netconvert manages."""
    common = (
        "--precision=4",
        "--no-turnarounds",
        "--output.original-names",
        "--aggregate-warnings=5",
        "--xml-validation=never",
        *(("--lefthand",) if lefthand else ()),
    )
    lanes = ("--opendrive.import-all-lanes", f"--type-files={TYPEMAP_FILE}")
    walks = (
        "--crossings.guess",
        "--crossings.guess.speed-threshold=100",
        "--default.crossing-width=2",
        "--junctions.endpoint-shape",
    )
    fine, coarse = "--opendrive.curve-resolution=0.5", "--opendrive.curve-resolution=2.0"
    return (
        Rung("", (*common, *lanes, *walks, fine)),
        Rung("curves are sampled every 2 m", (*common, *lanes, *walks, coarse)),
        Rung("no crossings are made", (*common, *lanes, coarse)),
        Rung("only driving lanes are converted", (*common, coarse)),
    )
