"""What the plan and a camera show at the same instants, while a run is mirrored."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.carla.sensors.pictures import still
from odscen.reports.picture_sheet import SheetMoment

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.carla.sensors.camera import View
    from odscen.carla.sensors.pictures import Picture
    from odscen.carla.server.batch import ActorPlace
    from odscen.carla.server.carla_server import Server
    from odscen.records.run_plan import Plan
    from odscen.sumo.runner.in_step import Step

_REMEMBERED = 400
"""Ticks whose pictures may still come."""
_MOST_WAITING = 10
"""Pictures that may wait for their ticks."""
_SAME = 1e-3
"""Seconds by which the clock of a picture may be off that of its tick."""


class _Tick(NamedTuple):
    """What a tick showed: seconds of the server, the road users, and where the camera looked."""

    elapsed: float
    shown: Step
    x: float
    y: float


class _Kept(NamedTuple):
    """A picture, its height over its width, and the tick that it shows."""

    tick: _Tick
    shape: float
    jpeg: bytes


class SheetRecorder:
    """Keeps pictures at even steps of the run, and where everybody was then.

    How long a run takes is not known before it has ended: of four times as many as are wanted every
    second one is given up.

    Parameters
    ----------
    view
        Where the camera looks first; its width is that of all pictures.
    wanted
        Pictures at the end.
    """

    def __init__(self, server: Server, plan: Plan, view: View, *, wanted: int) -> None:
        self._server, self._plan, self._wanted = server, plan, wanted
        self._middle, self._span = (view.x, view.y), view.span
        self._shown: Step | None = None
        self._ticks: deque[_Tick] = deque(maxlen=_REMEMBERED)
        self._waiting: deque[Picture] = deque(maxlen=_MOST_WAITING)
        self._kept: list[_Kept] = []
        self._apart = 0.0

    def look(self, shown: Step, places: Mapping[int, ActorPlace]) -> None:
        """Hear before a tick what it will show, and where the camera is to be."""
        self._shown = shown
        for place in places.values():
            self._middle = (place.x, -place.y)

    def ticked(self) -> None:
        """Hear that the tick is made."""
        if self._shown is not None:
            elapsed = self._server.world.get_snapshot().timestamp.elapsed_seconds
            self._ticks.append(_Tick(elapsed, self._shown, *self._middle))

    def take(self, picture: Picture) -> None:
        """Keep a picture, if it is time for one; called in the camera's thread."""
        # It may come before the tick that it shows is known to be made.
        self._waiting.append(picture)
        self._match_waiting()

    def _match_waiting(self) -> None:
        ticks = tuple(self._ticks)
        while self._waiting and ticks and self._waiting[0].time < ticks[-1].elapsed + _SAME:
            picture = self._waiting.popleft()
            near = min(ticks, key=lambda tick: abs(tick.elapsed - picture.time))
            if abs(near.elapsed - picture.time) < _SAME:
                self._keep_picture(near, picture)

    def _keep_picture(self, tick: _Tick, picture: Picture) -> None:
        if self._kept and tick.shown.time < self._kept[-1].tick.shown.time + self._apart - _SAME:
            return
        self._kept.append(_Kept(tick, picture.height / picture.width, still(picture, "jpeg")))
        if len(self._kept) >= 4 * self._wanted:
            self._apart = self._kept[2].tick.shown.time - self._kept[0].tick.shown.time
            self._kept = self._kept[::2]

    def moments(self) -> list[SheetMoment]:
        """What is kept, in the order of time."""
        self._match_waiting()
        chosen = np.unique(np.linspace(0, len(self._kept) - 1, self._wanted).round().astype(int))
        return [self._describe_moment(self._kept[k]) for k in chosen] if self._kept else []

    def _describe_moment(self, kept: _Kept) -> SheetMoment:
        tick, shown = kept.tick, kept.tick.shown
        actors = [self._plan.actors[row] for row in shown.index.tolist()]
        tall = self._span * kept.shape
        return SheetMoment(
            time=shown.time,
            bounds=(
                tick.x - self._span / 2, tick.y - tall / 2,
                tick.x + self._span / 2, tick.y + tall / 2,
            ),
            poses=np.column_stack([shown.x, shown.y, shown.hdg]),
            sizes=np.array([(actor.length, actor.width) for actor in actors]).reshape(-1, 2),
            categories=tuple(str(actor.category) for actor in actors),
            ids=tuple(shown.ids.tolist()),
            jpeg=kept.jpeg,
        )  # fmt: skip
