"""What is reported of a run while it goes on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from odscen.runs.finished_run import Run


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a run is: simulated seconds, counts of vehicles and persons.

    ``time_left`` is about how many wall seconds it will take at full speed; ``None`` if unknown.
    """

    time: float
    until: float
    running: int
    departed: int
    arrived: int
    planned: int
    time_left: float | None = None

    @property
    def share(self) -> float:
        """Share done, 0 to 1: of the time, or of the arrivals if those are further on."""
        arrivals = self.arrived / self.planned if self.planned else 0.0
        return min(1.0, max(self.time / self.until, arrivals))


class Reporter:
    """Hears of a run while it goes on, and can end it; this one ignores all of it.

    Methods are called in the thread that carries out the run. What one raises ends the run.

    >>> class Printer(Reporter):
    ...     def advanced(self, progress: Progress) -> None:
    ...         print(f"{progress.time:.0f} s, {progress.running} on the road")
    >>> Printer().advanced(Progress(5.0, 60.0, running=2, departed=2, arrived=0, planned=9))
    5 s, 2 on the road
    """

    def of_run(self, name: str) -> Reporter:
        """Return the reporter of one of several runs."""
        del name
        return self

    def started(self) -> None:
        """The simulation begins: all is prepared."""

    def advanced(self, progress: Progress) -> None:
        """It is so far; called a few times a second."""

    def said(self, words: str) -> None:
        """Something to know, in words: how far routes have been found, what a long run needs."""

    def finished(self, run: Run) -> None:
        """The folder of the run is there, whether it has completed or failed."""

    @property
    def cancelled(self) -> bool:
        """Whether it is to end before its time; what happened until then is kept."""
        return False


SILENT = Reporter()
"""Ignores all that it hears."""
