"""Reporters for tests: one keeps what it hears, one calls a function with each progress."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.runs.reporter import Reporter

if TYPE_CHECKING:
    from collections.abc import Callable

    from odscen.runs.finished_run import Run
    from odscen.runs.reporter import Progress


class Listener(Reporter):
    def __init__(self) -> None:
        self.progress: list[Progress] = []
        self.words: list[str] = []
        self.runs: list[Run] = []

    def advanced(self, progress: Progress) -> None:
        self.progress.append(progress)

    def said(self, words: str) -> None:
        self.words.append(words)

    def finished(self, run: Run) -> None:
        self.runs.append(run)


class EachProgress(Reporter):
    def __init__(self, act: Callable[[Progress], None]) -> None:
        self._act = act

    def advanced(self, progress: Progress) -> None:
        self._act(progress)
