"""Targets of a calibration: what was measured on the road, where and when.

Flows are held by GEH, travel times and queues by their difference from what was measured
(:meth:`Target.distance`). Bounds of flows and travel times are those of the UK's WebTAG unit M3.1;
for queues no bound is usual.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from odscen.base.errors import InputError
from odscen.scenario.demand.count_stations import GOOD, geh
from odscen.scenario.demand.demand_tables import read_target_lines
from odscen.scenario.document.distributions import stream

if TYPE_CHECKING:
    from collections.abc import Sequence

FLOW: Final = "flow"
TRAVEL_TIME: Final = "travel_time"
QUEUE: Final = "queue"
LONGEST_QUEUE: Final = "queue_max"
KINDS: Final = (FLOW, TRAVEL_TIME, QUEUE, LONGEST_QUEUE)
UNITS: Final = {FLOW: "veh", TRAVEL_TIME: "s", QUEUE: "m", LONGEST_QUEUE: "m"}

TRAVEL_TIME_SHARE: Final = 0.15
TRAVEL_TIME_LEAST: Final = 60.0
"""A travel time is met within 15 %, or one minute where that is more."""
QUEUE_SHARE: Final = 0.2
QUEUE_LEAST: Final = 15.0
"""A queue is met within 20 %, or 15 m (two vehicles) where that is more."""


class Target(NamedTuple):
    """What was measured at a place between two times (s): vehicles, seconds, or metres.

    Places of flows are count stations (``r8>j54>r12``), of travel times sections of the study, of
    queues approaches (``r8>j54``) or lane groups. ``held`` are those that nothing is fitted to.
    """

    kind: str
    place: str
    begin: float
    end: float
    value: float
    held: bool = False

    def distance(self, found: float) -> float:
        """How far a value is off, in multiples of what is allowed; at most 1 is met."""
        if self.kind == FLOW:
            return geh(found, self.value, self.end - self.begin) / GOOD
        share, least = (
            (TRAVEL_TIME_SHARE, TRAVEL_TIME_LEAST)
            if self.kind == TRAVEL_TIME
            else (QUEUE_SHARE, QUEUE_LEAST)
        )
        return abs(found - self.value) / max(share * self.value, least)

    @property
    def words(self) -> str:
        """Which one it is."""
        return f"{self.kind} of {self.place}, {self.begin:g} to {self.end:g} s"


def read_targets(text: str, *, clock: float = 0.0) -> tuple[Target, ...]:
    """Read targets: columns ``kind``, ``place``, ``begin``, ``end``, ``value`` and perhaps ``use``.

    ``use`` is ``calibrate`` or ``validate``; empty leaves it open.

    Raises
    ------
    InputError
        With the line and the value that cannot be used.
    """
    targets: dict[tuple[str, str, float, float], Target] = {}
    for line in read_target_lines(text):
        kind, place = line["kind"].lower(), line["place"]
        if kind not in KINDS:
            raise InputError(
                f"kind must be one of {', '.join(KINDS)}, not {kind!r:.60}", element=line.where
            )
        use = line["use"] if line.has("use") and line.filled("use") else "calibrate"
        if use not in ("calibrate", "validate"):
            raise InputError(
                f"use must be calibrate, validate or empty, not {use!r:.60}", element=line.where
            )
        begin, end = line.slice(clock)
        place = place if kind == TRAVEL_TIME else place.replace(" ", "").replace("+", " + ")
        key = (kind, place, begin, end)
        if key in targets:
            raise InputError(f"the {targets[key].words}, is there twice", element=line.where)
        targets[key] = Target(*key, line.number("value"), held=use == "validate")
    return tuple(targets.values())


def hold_back(targets: Sequence[Target], share: float, *, seed: int) -> tuple[Target, ...]:
    """Hold whole places back for the validation, drawn by the seed: ``share`` of each kind.

    A place whose slices were partly fitted would validate nothing. Kinds with one place, and all
    where some are held already, stay as they are.

    Raises
    ------
    InputError
        If the share is not from 0 to 0.9.
    """
    if not 0.0 <= share <= 0.9:
        raise InputError(f"the share that is held back must be 0 to 0.9, not {share:g}")
    if any(target.held for target in targets):
        return tuple(targets)
    held: set[tuple[str, str]] = set()
    for kind in KINDS:
        places = sorted({target.place for target in targets if target.kind == kind})
        number = min(round(share * len(places)), len(places) - 1)
        if share and len(places) > 1:
            number = max(number, 1)
        drawn = stream(seed, "hold_back", kind).permutation(len(places))[: max(number, 0)]
        held |= {(kind, places[row]) for row in drawn.tolist()}
    return tuple(target._replace(held=(target.kind, target.place) in held) for target in targets)
