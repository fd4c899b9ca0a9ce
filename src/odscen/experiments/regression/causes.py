"""Why figures may differ: what runs are made of now and were not made of at the baseline.

A fingerprint has a digest of each input; a cause is one input, or several that people take for
one, whose digest is another.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from odscen.experiments.regression.verdict import Change

_PACKAGES = ("sumo", "odscen")

_LABELS = {
    "map": "map",
    "network": "map",
    "scenario.signals": "signals",
    "scenario.measures": "measures",
    "scenario.rules": "rules",
    "scenario.criteria": "criteria",
    "scenario.actors": "actors",
    "scenario.flows": "demand",
    "scenario.demand": "demand",
    "scenario.transit": "public transport",
    "scenario.drivers": "drivers",
    "scenario.environment": "environment",
    "scenario.roi": "region of interest",
    "scenario.simulation": "settings",
    "redraw": "settings",
    "sumo": "SUMO",
    "odscen": "odscen",
}
"""What people call each part of a fingerprint, the likeliest to change traffic first."""

VERSIONS = tuple(_LABELS[name] for name in _PACKAGES)
"""Names of the causes that are versions, not inputs."""

_POINTS_TO = {
    ("run", "planned"): ("demand", "actors"),
    ("junction", "waiting_time"): ("signals",),
    ("segment", "free_speed"): ("map", "drivers", "environment"),
}
"""Causes that a figure speaks for when several inputs have changed."""


@dataclass(frozen=True, slots=True)
class Cause:
    """An input that has changed.

    Attributes
    ----------
    name
        ``"map"``, ``"signals"``, ``"SUMO"``, ...
    words
        What has changed about it: ``"the scenario's signals"``, ``"sumo 1.27.0 -> 1.28.0"``. What
        is different on two maps, road by road, would be said here.
    """

    name: str
    words: str


def causes_between(old: Mapping[str, str], new: Mapping[str, str]) -> tuple[Cause, ...]:
    """Compare two fingerprints; nothing if nothing is different. The likeliest cause is first."""
    order = list(_LABELS)
    names = sorted(
        old.keys() | new.keys(),
        key=lambda name: (order.index(name) if name in order else len(order), name),
    )
    return tuple(
        Cause(_LABELS.get(name, name.removeprefix("scenario.")), _words(name, old, new))
        for name in names
        if old.get(name) != new.get(name)
    )


def _words(name: str, old: Mapping[str, str], new: Mapping[str, str]) -> str:
    if name in _PACKAGES or name == "redraw":
        without = "open" if name == "redraw" else "none"
        return f"{name} {old.get(name, without)} -> {new.get(name, without)}"
    part = name.removeprefix("scenario.")
    return f"the {name}" if part == name else f"the scenario's {part}"


def likeliest_first(causes: Iterable[Cause], worst: Iterable[Change]) -> tuple[Cause, ...]:
    """Put the causes first that the figures speak for which have changed most."""
    spoken_for = [
        name
        for change in worst
        for name in _POINTS_TO.get((change.key.kind, change.key.figure), ())
    ]

    def place(cause: Cause) -> int:
        return spoken_for.index(cause.name) if cause.name in spoken_for else len(spoken_for)

    return tuple(sorted(causes, key=place))
