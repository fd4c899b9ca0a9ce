"""The conversion report: what became of each element on the way to SUMO (requirement R16)."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.opendrive.parse_rules import LOSING_RULES

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping


class ElementOutcome(StrEnum):
    """What happened to an element.

    Attributes
    ----------
    KEPT
        It is there as it was.
    REPAIRED
        It was wrong, and is read as it must have been meant.
    GUESSED
        Something that the file does not say was completed.
    LOST
        It is not there any more.
    """

    KEPT = "kept"
    REPAIRED = "repaired"
    GUESSED = "guessed"
    LOST = "lost"


class ReportEntry(NamedTuple):
    """One line of the report.

    Attributes
    ----------
    outcome
        What became of the element.
    element
        Its path, as in ``road 7 > laneSection 0 > lane -1``.
    reason
        Why, in words.
    confidence
        How sure an importer of another format is, 0 to 1; ``None`` if nothing is said of it.
    source_id
        Of the element of the imported file that it comes from.
    """

    outcome: ElementOutcome
    element: str
    reason: str
    confidence: float | None = None
    source_id: str | None = None

    def to_dict(self) -> dict[str, Any]:
        """Form for JSON; what is not known is left out."""
        row = {"fate": self.outcome.value, "element": self.element, "reason": self.reason}
        known = {"confidence": self.confidence, "source_id": self.source_id}
        return {**row, **{key: value for key, value in known.items() if value is not None}}


def parser_entries(notes: Iterable[str]) -> list[ReportEntry]:
    """Entries for the notes of the parser, ``element: reason`` each."""
    entries = []
    for note in notes:
        element, mark, reason = note.partition(": ")
        parts = (element, reason) if mark else ("map", note)
        rule = note.rpartition("[")[2].removesuffix("]")
        outcome = ElementOutcome.LOST if rule in LOSING_RULES else ElementOutcome.REPAIRED
        entries.append(ReportEntry(outcome, *parts))
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
            "entries": [entry.to_dict() for entry in self.entries],
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> ConversionReport:
        """Inverse of :meth:`to_dict`."""
        return cls(
            tuple(
                ReportEntry(
                    ElementOutcome(entry["fate"]),
                    entry["element"],
                    entry["reason"],
                    entry.get("confidence"),
                    entry.get("source_id"),
                )
                for entry in data["entries"]
            ),
            dict(data["figures"]),
        )
