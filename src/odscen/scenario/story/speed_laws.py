"""How a speed changes over time, and the metres that come of it; exact at every instant.

    linear  v(t) = v0 + dv t/T                 s(t) = v0 t + dv t^2 / (2 T)
    cosine  v(t) = v0 + dv (1 - cos(pi t/T))/2 s(t) = v0 t + dv/2 (t - T/pi sin(pi t/T))

with t from 0 to T, dv = v1 - v0; before it the speed is v0, after it v1.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.scenario.document.actions_document import SpeedChange


@dataclass(frozen=True, slots=True)
class SpeedLaw:
    """From ``begin`` on, within ``duration`` seconds, from ``v0`` to ``v1``.

    Attributes
    ----------
    begin, duration
        Instant, and seconds from there to the last speed.
    v0, v1
        First and last speed, m/s.
    shape
        ``linear`` or ``cosine``.
    """

    begin: float
    v0: float
    v1: float
    duration: float = 0.0
    shape: str = "linear"

    @property
    def end(self) -> float:
        """Instant from which on the speed is ``v1``."""
        return self.begin + self.duration

    def speed(self, instant: float) -> float:
        """Speed at an instant, m/s."""
        t = instant - self.begin
        if t >= self.duration:
            return self.v1
        share = max(t, 0.0) / self.duration
        if self.shape == "cosine":
            share = (1.0 - math.cos(math.pi * share)) / 2.0
        return self.v0 + (self.v1 - self.v0) * share

    def metres(self, start: float, stop: float) -> float:
        """Metres from one instant to another."""
        return self._covered(stop - self.begin) - self._covered(start - self.begin)

    def _covered(self, t: float) -> float:
        if t <= 0.0:
            return self.v0 * t
        inside, change = min(t, self.duration), self.v1 - self.v0
        covered = self.v0 * inside + self.v1 * (t - inside)
        if inside <= 0.0:
            return covered
        if self.shape == "cosine":
            turn = math.pi / self.duration
            return covered + change / 2.0 * (inside - math.sin(turn * inside) / turn)
        return covered + change * inside * inside / (2.0 * self.duration)


@dataclass(frozen=True, slots=True)
class SpeedTable:
    """From ``begin`` on, speeds at instants, even between them.

    ``knots`` are seconds since the begin and m/s, in order; two at one instant are a jump.
    """

    begin: float
    knots: tuple[tuple[float, float], ...]

    @property
    def end(self) -> float:
        """Instant of the last speed."""
        return self.begin + self.knots[-1][0]

    @property
    def v1(self) -> float:
        """Last speed, m/s."""
        return self.knots[-1][1]

    def speed(self, instant: float) -> float:
        """Speed at an instant, m/s."""
        t = instant - self.begin
        for (t0, v0), (t1, v1) in itertools.pairwise(self.knots):
            if t0 <= t < t1:
                return v0 + (v1 - v0) * (t - t0) / (t1 - t0)
        return self.knots[0][1] if t < self.knots[0][0] else self.v1

    def metres(self, start: float, stop: float) -> float:
        """Metres from one instant to another."""
        return self._covered(stop - self.begin) - self._covered(start - self.begin)

    def _covered(self, t: float) -> float:
        if t <= 0.0:
            return self.knots[0][1] * t
        covered = 0.0
        for (t0, v0), (t1, v1) in itertools.pairwise(self.knots):
            if t <= t0:
                break
            inside = min(t, t1) - t0
            if inside > 0.0:
                covered += inside * (v0 + (v1 - v0) * inside / (t1 - t0) / 2.0)
        return covered + self.v1 * max(0.0, t - self.knots[-1][0])


AnyLaw = SpeedLaw | SpeedTable


def law_from_state(state: Mapping[str, Any] | None) -> AnyLaw | None:
    """Law from what ``asdict`` has made of it and JSON has kept."""
    if state is None:
        return None
    if "knots" in state:
        return SpeedTable(state["begin"], tuple((t, v) for t, v in state["knots"]))
    return SpeedLaw(**state)


def steady(begin: float, speed: float) -> SpeedLaw:
    """One speed for ever."""
    return SpeedLaw(begin, speed, speed)


def speed_change(change: SpeedChange, begin: float, speed: float) -> SpeedLaw:
    """Law of a change of speed that begins with ``speed``."""
    difference = abs(change.to - speed)
    duration = 0.0
    if change.over is not None:
        duration = change.over
    elif change.within is not None:
        duration = 2.0 * change.within / max(change.to + speed, 1e-9)
    elif change.rate is not None:
        duration = difference / change.rate
        if change.shape == "cosine":
            duration *= math.pi / 2.0
    if difference == 0.0 and change.over is None:
        duration = 0.0
    return SpeedLaw(begin, speed, change.to, duration, change.shape)


def braking(by: float, begin: float, speed: float) -> SpeedLaw:
    """Law of braking to a standstill with ``by`` m/s^2."""
    return SpeedLaw(begin, speed, 0.0, speed / by)


def stopping(within: float | None, begin: float, speed: float) -> SpeedLaw:
    """Law of stopping after so many metres; at once if ``None``."""
    if within is None or speed <= 0.0:
        return SpeedLaw(begin, speed, 0.0)
    return SpeedLaw(begin, speed, 0.0, 2.0 * within / speed)
