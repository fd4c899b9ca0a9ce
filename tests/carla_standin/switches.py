"""Misbehaviour on demand: what real servers do at times, at a tick of the test's choice."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass, fields
from typing import Any

from tests.carla_standin import wire


@dataclass(slots=True)
class Switches:
    """What the server does wrong. Each can be set at the start and while it runs.

    Ticks are those that a client asked for (``tick_cue``), the next one being 1; setting any switch
    of a tick starts the count anew.

    Attributes
    ----------
    version
        What the server says it is.
    refuse_spawn_every
        Refuse every n-th spawn with ``refusal``; 0 for none.
    freeze_at_tick, freeze_seconds
        Before this tick the whole process stands still.
    drop_stream_at_tick
        Cut all streams off instead of showing this tick; subscribers may come back.
    refuse_streams
        Close every new subscription at once.
    die_at_tick
        The process ends instead of answering this tick.
    """

    version: str = wire.CLIENT_VERSION
    refuse_spawn_every: int = 0
    refusal: str = "Spawn failed because of a collision at spawn position"
    freeze_at_tick: int = 0
    freeze_seconds: float = 0.0
    drop_stream_at_tick: int = 0
    refuse_streams: bool = False
    die_at_tick: int = 0
    _ticks: int = 0
    _spawns: int = 0

    def change(self, **values: Any) -> None:
        """Set some switches; a wrong name is a ``TypeError``."""
        known = {field.name for field in fields(self) if not field.name.startswith("_")}
        if unknown := set(values) - known:
            msg = f"no such switch: {', '.join(sorted(unknown))}"
            raise TypeError(msg)
        for name, value in values.items():
            setattr(self, name, value)
        if any(name.endswith("_at_tick") for name in values):
            self._ticks = 0
        if "refuse_spawn_every" in values:
            self._spawns = 0

    def refuse_spawn(self) -> str | None:
        """Why this spawn is refused, ``None`` if it is not."""
        self._spawns += 1
        every = self.refuse_spawn_every
        return self.refusal if every and self._spawns % every == 0 else None

    def before_tick(self) -> bool:
        """Count a tick and stand still or die; whether the streams are to be dropped."""
        self._ticks += 1
        if self._ticks == self.die_at_tick:
            os._exit(1)
        if self._ticks == self.freeze_at_tick:
            # Not asyncio's sleep: a frozen server neither answers nor streams.
            time.sleep(self.freeze_seconds)
        return self._ticks == self.drop_stream_at_tick
