"""One difference between two maps: what, where, from which value to which."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from odscen.base.shown import shown_id

if TYPE_CHECKING:
    from odscen.base.ids import RoadId

ChangeKind = Literal["added", "removed", "changed", "moved"]

ChangedThing = Literal[
    "header",
    "road",
    "geometry",
    "elevation",
    "superelevation",
    "lane offset",
    "road type",
    "road link",
    "lane",
    "lane type",
    "width",
    "limit",
    "permission",
    "road mark",
    "lane height",
    "lane direction",
    "lane link",
    "connection",
    "junction",
    "priority",
    "controller",
    "signal",
    "signal reference",
    "crosswalk",
    "object",
]


@dataclass(frozen=True, slots=True)
class ChangePlace:
    """Where a change lies: road coordinates in one of the two maps.

    ``s0`` and ``s1`` are metres (equal for a point), ``t`` metres for what stands beside the lanes,
    ``lane`` the lane's id in the same map; ``None`` for the whole road.
    """

    road: RoadId
    s0: float
    s1: float
    lane: int | None = None
    t: float | None = None


@dataclass(frozen=True, slots=True)
class MapChange:
    """A difference; ``before`` and ``after`` are words with units, ``None`` where there is none.

    ``place`` is in the map before, except for what was added; ``None`` for what lies nowhere.
    """

    kind: ChangeKind
    what: ChangedThing
    subject: str
    before: str | None = None
    after: str | None = None
    place: ChangePlace | None = None

    @property
    def words(self) -> str:
        """One line for people: ``width of lane -1 of road 5, s 0 to 120 m: 4 m -> 2.4 m``."""
        return f"{self.subject}{self._describe_place()}: {self._describe_values()}"

    def _describe_place(self) -> str:
        """Part of the road, of what may hold on a part of it."""
        place = self.place
        if place is None or place.s0 == place.s1:
            return ""
        if place.lane is None and self.what not in ("limit", "road type", "geometry"):
            return ""
        return f", s {metres(place.s0)} to {metres(place.s1)} m"

    def _describe_values(self) -> str:
        if self.before is not None and self.after is not None:
            return f"{self.before} -> {self.after}"
        value = self.after or self.before
        return f"{self.kind} ({value})" if value else self.kind

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready."""
        place = self.place
        return {
            "kind": self.kind,
            "what": self.what,
            "subject": self.subject,
            "before": self.before,
            "after": self.after,
            "place": None
            if place is None
            else {
                "road": place.road,
                "s0": round(place.s0, 3),
                "s1": round(place.s1, 3),
                "lane": place.lane,
                "t": place.t,
            },
            "words": self.words,
        }


def metres(value: float) -> str:
    """Millimetres at most, without zeros at the end."""
    text = f"{value:.3f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def of_road(road: str) -> str:
    """``road 5``, with the id shown safely."""
    return f"road {shown_id(road)}"


def of_lane(road: str, lane: int) -> str:
    """``lane -1 of road 5``; the centre lane by its name."""
    name = f"lane {lane}" if lane else "the centre line"
    return f"{name} of {of_road(road)}"
