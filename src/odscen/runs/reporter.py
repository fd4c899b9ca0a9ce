"""What is reported of a run while it goes on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import TaskID

    from odscen.runs.finished_run import Run


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a run is: simulated seconds, counts of vehicles and persons.

    Attributes
    ----------
    time, until
        Simulated seconds, now and at the end.
    running, departed, arrived, planned
        Road users.
    time_left
        Wall seconds that it will take at full speed, about; ``None`` if unknown.
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


class ProgressBar(Reporter):
    """Shows how far runs are, in a terminal or a notebook, on standard error.

    >>> odscen.run(workspace, scenario, reporter=odscen.ProgressBar())
    """

    def __init__(self) -> None:
        from rich.console import Console
        from rich.progress import Progress as Bars

        self._bars = Bars(console=Console(stderr=True))
        self._left: set[TaskID] = set()

    def of_run(self, name: str) -> Reporter:
        """Return the reporter of one run, which has a bar of its own."""
        return _RunBar(self, name)

    def advanced(self, progress: Progress) -> None:
        """Show it in the bar of the only run."""
        if not self._left:
            self._own = _RunBar(self, "run")
        self._own.advanced(progress)

    def finished(self, run: Run) -> None:
        """Fill the bar of the only run."""
        if self._left:
            self._own.finished(run)

    def begin(self, name: str) -> TaskID:
        """Show a bar; the display begins with the first."""
        if not self._left:
            self._bars.start()
        task = self._bars.add_task(name, total=1.0)
        self._left.add(task)
        return task

    def show(self, task: TaskID, share: float) -> None:
        """Set a bar; the display ends with the last that is full."""
        self._bars.update(task, completed=share)
        if share >= 1.0:
            self._left.discard(task)
            if not self._left:
                self._bars.stop()


class _RunBar(Reporter):
    """The bar of one run."""

    def __init__(self, bars: ProgressBar, name: str) -> None:
        self._bars, self._name = bars, name
        self._task: TaskID | None = None

    def advanced(self, progress: Progress) -> None:
        self._show(min(progress.share, 0.999))

    def finished(self, run: Run) -> None:
        del run
        self._show(1.0)

    def _show(self, share: float) -> None:
        if self._task is None:
            self._task = self._bars.begin(self._name)
        self._bars.show(self._task, share)


SILENT = Reporter()
"""Ignores all that it hears."""
