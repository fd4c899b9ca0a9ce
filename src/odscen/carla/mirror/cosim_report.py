"""What came of a mirrored run."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any


@dataclass(slots=True)
class CosimReport:
    """What came of the mirror.

    Attributes
    ----------
    map
        ``there``, ``loaded`` or ``generated``.
    ticks, spawned
        How many ticks were made, and how many actors.
    refused
        Road users whom the server never took: id, tries, its words.
    foreign
        Who else was on the server and was seen by SUMO's traffic: actor, type and role.
    signals, signals_missing
        How many signals of the map are joined to a light of the server, and ids of those that the
        server has no light for.
    sizes
        Metres by which the length of a blueprint differs from the road user it represents.
    interruptions
        How often the stream of the server's states was cut and came back.
    sensors
        Files that each sensor has written.
    pictures, pictures_dropped
        How many pictures from above came, and how many of them were given up because writing them
        took too long.
    own_ms
        Median and 95th percentile of our own share of a tick, milliseconds.
    error, interrupted
        Why it has ended early.
    warnings
        What a user should know of the server, in words.
    left_behind
        What could not be given back, in words.
    """

    address: str
    map: str = ""
    ticks: int = 0
    spawned: int = 0
    refused: list[dict[str, Any]] = field(default_factory=list)
    foreign: list[dict[str, Any]] = field(default_factory=list)
    signals: int = 0
    signals_missing: list[str] = field(default_factory=list)
    sizes: dict[str, float] = field(default_factory=dict)
    interruptions: int = 0
    sensors: dict[str, int] = field(default_factory=dict)
    pictures: int = 0
    pictures_dropped: int = 0
    own_ms: tuple[float, float] | None = None
    error: str | None = None
    interrupted: bool = False
    warnings: list[str] = field(default_factory=list)
    left_behind: list[str] = field(default_factory=list)
