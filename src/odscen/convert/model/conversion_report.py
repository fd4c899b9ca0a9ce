"""The conversion report: what became of each element on the way to SUMO (requirement R16)."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping


class ElementOutcome(StrEnum):
    """What happened to an element."""

    KEPT = "kept"
    REPAIRED = "repaired"
    GUESSED = "guessed"
    LOST = "lost"


class ReportEntry(NamedTuple):
    """One line of the report; ``element`` is a path as in ``road 7 > laneSection 0 > lane -1``."""

    outcome: ElementOutcome
    element: str
    reason: str


def parser_entries(notes: Iterable[str]) -> list[ReportEntry]:
    """Entries for the notes of the parser, ``element: reason`` each."""
    entries = []
    for note in notes:
        element, mark, reason = note.partition(": ")
        parts = (element, reason) if mark else ("map", note)
        entries.append(ReportEntry(ElementOutcome.REPAIRED, *parts))
    return entries


@dataclass(frozen=True, slots=True)
class ConversionReport:
    """All entries, and figures by name.

    Attributes
    ----------
    entries
        Reading, then what was kept, lanes, connections, crosswalks, signals.
    figures
        Counts and lengths (metres), see ``docs/sumo-network.md``.
    """

    entries: tuple[ReportEntry, ...] = ()
    figures: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(
        cls, entries: Iterable[ReportEntry], figures: Mapping[str, float] | None = None
    ) -> ConversionReport:
        """Drop repeated entries, keeping the order."""
        return cls(tuple(dict.fromkeys(entries)), dict(figures or {}))

    def counts(self) -> dict[str, int]:
        """Count the entries of each kind."""
        outcomes = [entry.outcome for entry in self.entries]
        return {outcome.value: outcomes.count(outcome) for outcome in ElementOutcome}

    def to_dict(self) -> dict[str, Any]:
        """Form for JSON."""
        return {
            "counts": self.counts(),
            "figures": dict(self.figures),
            "entries": [
                {"fate": entry.outcome.value, "element": entry.element, "reason": entry.reason}
                for entry in self.entries
            ],
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> ConversionReport:
        """Inverse of :meth:`to_dict`."""
        return cls(
            tuple(
                ReportEntry(ElementOutcome(entry["fate"]), entry["element"], entry["reason"])
                for entry in data["entries"]
            ),
            dict(data["figures"]),
        )
