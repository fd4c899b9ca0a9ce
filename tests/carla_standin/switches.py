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
    refuse_grounded
        Refuse spawns that touch the ground, as real servers do.
    kerb
        Metres by which sidewalks stand above the surface of the file.
    freeze_at_tick, freeze_seconds
        Before this tick the whole process stands still.
    drop_stream_at_tick
        Cut all streams off instead of showing this tick; subscribers may come back.
    refuse_streams
        Close every new subscription at once.
    die_at_tick
        The process ends instead of answering this tick.
    frames_per_tick, time_factor
        By how many frames a tick leads on, and by how many times the seconds it is to last.
    least_lift
        Metres above the ground from which on a body is made.
    place_error, place_aside
        Metres by which a vehicle that is put somewhere is too high, and too far along x.
    drops_pitch
        Whether vehicles that are put somewhere stay level.
    late_places
        Whether vehicles are where they were put a tick later only.
    half_capsule
        Whether a walker's half height is added to where it is put, as a real server does.
    walkers_drift
        Whether walkers also move by themselves from where they are put, by their speed.
    still_speed
        m/s that actors without physics report; a real server says 0.
    speed_factor
        By how many times actors with physics report their velocity.
    blind_ground
        Whether nothing is ever found below a place.
    no_projection
        Whether it does not know the call that says what is below a place.
    late_calls
        When calls that wait for no answer are done, as a real server's worker threads may do them:
        at once if empty, ``call`` behind the next call that waits, ``tick`` behind the next tick.
    nameless_lights
        How many traffic lights do not say which signal of the map they are.
    deaf_lamps
        Whether the lights of vehicles cannot be switched.
    tick_seconds, ground_seconds
        Seconds that a tick, and an answer on what is below a place, take more.
    keeps_actors
        Whether actors cannot be destroyed.
    navigation
        Whether a navigation mesh is served; clients keep its file in ``~/carlaCache``.
    large_map
        Whether actors that are further than ``actor_active_distance`` from all of a role with
        ``hero`` or ``ego_vehicle`` in it, or else from the spectator, become dormant with the next
        tick: the process ends when a dormant walker is put somewhere (CarlaActor.cpp). Further away
        from them than ``tile_stream_distance`` no ground is found, for its tile is not loaded.
    """

    version: str = wire.CLIENT_VERSION
    refuse_spawn_every: int = 0
    refusal: str = "Spawn failed because of a collision at spawn position"
    refuse_grounded: bool = True
    kerb: float = 0.0
    freeze_at_tick: int = 0
    freeze_seconds: float = 0.0
    drop_stream_at_tick: int = 0
    refuse_streams: bool = False
    die_at_tick: int = 0
    frames_per_tick: int = 1
    time_factor: float = 1.0
    least_lift: float = 0.15
    place_error: float = 0.0
    place_aside: float = 0.0
    drops_pitch: bool = False
    late_places: bool = False
    half_capsule: bool = True
    walkers_drift: bool = False
    still_speed: float = 0.0
    speed_factor: float = 1.0
    blind_ground: bool = False
    no_projection: bool = False
    late_calls: str = ""
    nameless_lights: int = 0
    deaf_lamps: bool = False
    tick_seconds: float = 0.0
    ground_seconds: float = 0.0
    keeps_actors: bool = False
    navigation: bool = False
    large_map: bool = False
    _ticks: int = 0
    _spawns: int = 0

    def change(self, **values: Any) -> None:
        """Set some switches; a wrong name is a ``TypeError``."""
        known = {field.name for field in fields(self) if not field.name.startswith("_")}
        if unknown := set(values) - known:
            raise TypeError(f"no such switch: {', '.join(sorted(unknown))}")
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
