"""When the ticks come between one step of SUMO's and the next: ours, or another client's."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from odscen.base.errors import CarlaError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from odscen.carla.server.carla_server import Server
    from odscen.sumo.runner.in_step import Step

_OFF = 0.01
"""Share of a tick by which the time of a server, whose ticks are float32, may be off."""
_HAIR = 1e-6
"""Seconds by which sums of ticks may be off."""


class StepClock(Protocol):
    """Says how far the way from the last step to this one is in each tick; the last is 1."""

    def shares(self, step: Step) -> Iterator[float]:
        """Shares of the way, ascending; each is asked for when its tick may be prepared."""


class OwnTicks:
    """We make the ticks: so many a step, evenly.

    Parameters
    ----------
    delta
        Seconds by which each leads on.
    """

    def __init__(self, server: Server, count: int, delta: float) -> None:
        self._server, self._count, self._delta = server, count, delta

    def shares(self, step: Step) -> Iterator[float]:  # noqa: ARG002 - alike in all steps
        """As :meth:`StepClock.shares`.

        Raises
        ------
        CarlaError
            If a tick has not led the server's time on by its seconds: another client sets it.
        """
        for tick in range(1, self._count + 1):
            before, cuts = self._server.own_time(), self._server.interruptions
            yield tick / self._count
            after = self._server.own_time()
            if before is None or after is None or self._server.interruptions > cuts:
                continue  # a tick of another client shows in the number of our next frame
            passed = after - before
            if abs(passed - self._delta) > _OFF * self._delta:
                raise CarlaError(
                    f"a tick of {self._delta:g} s led the CARLA server at {self._server.address} "
                    f"on by {passed:g} s: another client changes its settings"
                )


class FollowedTicks:
    """Another client makes the ticks, of whatever length: steps are shown when their time comes.

    What is asked for becomes visible with the next tick, so each is prepared for the time that the
    next one will have if it is as long as the last. Steps that are late are shown at once.

    Parameters
    ----------
    step_length
        Of SUMO's steps, seconds.
    """

    def __init__(self, server: Server, step_length: float) -> None:
        self._server = server
        self._step_length = step_length
        self._zero: float | None = None
        self._prepared = 0.0

    def shares(self, step: Step) -> Iterator[float]:
        """As :meth:`StepClock.shares`; waits for the server.

        Raises
        ------
        CarlaError
            If no tick comes.
        """
        if self._zero is None:
            now, delta = self._server.first_clock()
            self._zero = now + delta - step.time
        while True:
            now, delta = self._server.clock()
            late = now + delta - (self._zero + step.time)
            if late >= -_HAIR:
                self._prepared = now
                yield 1.0
                return
            if late > _HAIR - self._step_length and now > self._prepared:
                self._prepared = now
                yield 1.0 + late / self._step_length
            else:
                self._server.await_tick(now)
