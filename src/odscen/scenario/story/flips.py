"""When something is true, to the instant: its value before an interval and its changes inside.

Conditions are looked at once a step, but come true at any instant; what they are combined of keeps
that instant.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence


class Flips(NamedTuple):
    """``was`` holds before the first of the instants ``at``; at each it turns, that included."""

    was: bool
    at: tuple[float, ...] = ()

    def holds(self, instant: float) -> bool:
        """Whether it is true at an instant."""
        return self.was ^ (sum(one <= instant for one in self.at) % 2 == 1)

    @property
    def last(self) -> bool:
        """Whether it is true after all."""
        return self.was ^ (len(self.at) % 2 == 1)

    def opposite(self) -> Flips:
        """What is true where this is not."""
        return Flips(not self.was, self.at)

    def shifted(self, seconds: float) -> Flips:
        """The same, so much later."""
        return Flips(self.was, tuple(one + seconds for one in self.at))

    def after(self, begin: float) -> Flips:
        """The same without the instants before ``begin``."""
        early = sum(one < begin for one in self.at)
        return Flips(self.was ^ (early % 2 == 1), self.at[early:])

    def risings(self, lasting: float) -> Flips:
        """What is true for so many seconds from each instant at which this comes true."""
        changes: list[float] = []
        now = self.was
        for one in self.at:
            now = not now
            if not now:
                continue
            if changes and one <= changes[-1]:
                changes[-1] = one + lasting
            else:
                changes += [one, one + lasting]
        return Flips(False, tuple(changes))

    def first(self, begin: float, end: float) -> float | None:
        """First instant from ``begin`` on, before ``end``, at which it is true."""
        if begin >= end:
            return None
        if not self.at:  # the usual case, asked of each rule in each step
            return begin if self.was else None
        if self.holds(begin):
            return begin
        return next((one for one in self.at if begin < one < end and self.holds(one)), None)

    def first_rise(self, begin: float, end: float, *, after: float) -> float | None:
        """First instant from ``begin`` on, ``after`` one and before ``end``, of coming true."""
        rises = self.at[int(self.was) :: 2]
        return next((one for one in rises if begin <= one < end and one > after), None)


def together(parts: Sequence[Flips], *, every: bool) -> Flips:
    """What is true where all parts are (``every``), or any of them."""
    was, steady = every, True
    for part in parts:
        if part.was != every:
            was = not every
        if part.at:
            steady = False
    if steady:  # nearly always
        return Flips(was)
    meet = all if every else any
    changes, now = [], was
    for instant in sorted({one for part in parts for one in part.at}):
        if (holds := meet(part.holds(instant) for part in parts)) != now:
            now = holds
            changes.append(instant)
    return Flips(was, tuple(changes))


def joined(before: Flips, instants: Iterable[float]) -> Flips:
    """Flips that go on with more of them."""
    return Flips(before.was, (*before.at, *instants))
