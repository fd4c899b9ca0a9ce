"""What of a map was lost for traffic, or guessed: the counts beside its name, from its report."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, get_args

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

LossKind = Literal[
    "access_rules",
    "connections",
    "crosswalks",
    "lanes_both_ways",
    "road_lengths",
    "roads",
    "signals",
    "temporary_lanes",
    "unknown_signs",
]
"""What road users meet that a map may lose in the import, or that is not as the file says."""

_LOST: tuple[tuple[LossKind, str], ...] = (
    ("roads", "[road-left-out]"),
    ("connections", "[connection-left-out]"),
    ("connections", "connecting lane "),
    ("connections", "no vehicle class may use"),
    ("lanes_both_ways", "open both ways"),
    ("access_rules", "access: "),
    ("access_rules", "access of "),
    ("crosswalks", "crosswalk"),
    ("temporary_lanes", "[temporary-lanes]"),
)
_GUESSED: tuple[tuple[LossKind, str], ...] = (
    ("connections", "[junction-table]"),
    ("connections", "[missing-contact-point]"),
    ("connections", "which alone states the link"),
    ("road_lengths", "[road-length]"),
)
"""What the reasons of the report have that say so; signals are told by their element."""

_EVERY_CROSSING = "every crossing of a junction with lights"
"""Pedestrian lights that act as the file says, if not from the pole that it says."""

_NAMES: dict[LossKind, tuple[str, str]] = {
    "access_rules": ("access rule", "access rules"),
    "connections": ("connection", "connections"),
    "crosswalks": ("crosswalk", "crosswalks"),
    "lanes_both_ways": ("lane open both ways", "lanes open both ways"),
    "road_lengths": ("length of a road", "lengths of roads"),
    "roads": ("road", "roads"),
    "signals": ("light or sign", "lights and signs"),
    "temporary_lanes": ("road with temporary lanes", "roads with temporary lanes"),
    "unknown_signs": ("sign not understood", "signs not understood"),
}


class TrafficLosses(NamedTuple):
    """Counts of what is lost, and of what is guessed, by kind; never a count of 0."""

    lost: Mapping[LossKind, int]
    guessed: Mapping[LossKind, int]

    def __str__(self) -> str:
        """Both in words, each after a semicolon; empty if there is nothing."""
        parts = (("lost for traffic", self.lost), ("guessed", self.guessed))
        return "".join(f"; {words}: {_list_counts(counts)}" for words, counts in parts if counts)


def traffic_losses(report: Mapping[str, Any]) -> TrafficLosses:
    """Count them in the import report of a map, as ``map.json`` has it."""
    lost: Counter[LossKind] = Counter()
    guessed: Counter[LossKind] = Counter()
    for row in report.get("entries", ()):
        fate, element, reason = row["fate"], str(row["element"]), str(row["reason"])
        if element.startswith("edit "):  # an edit that does not fit the map: nothing was lost
            continue
        if fate == "lost" and element.startswith("signals of type"):
            lost["unknown_signs"] += int(reason.partition(" ")[0])
        elif fate in ("lost", "guessed") and "> signal" in element:
            if not reason.startswith(_EVERY_CROSSING):
                (lost if fate == "lost" else guessed)["signals"] += 1
        elif fate in ("lost", "repaired"):
            words, counts = (_LOST, lost) if fate == "lost" else (_GUESSED, guessed)
            counts.update(_kind_of(words, reason))
    return TrafficLosses(_order_kinds(lost), _order_kinds(guessed))


def _kind_of(words: Iterable[tuple[LossKind, str]], reason: str) -> tuple[LossKind, ...]:
    return tuple(kind for kind, part in words if part in reason)[:1]


def _order_kinds(counts: Mapping[LossKind, int]) -> dict[LossKind, int]:
    return {kind: counts[kind] for kind in get_args(LossKind) if kind in counts}


def _list_counts(counts: Mapping[LossKind, int]) -> str:
    return ", ".join(f"{count} {_NAMES[kind][count != 1]}" for kind, count in counts.items())
