"""A run that goes on, and the live view of it over a WebSocket.

What is sent follows the client: after each frame the server waits for any text, and meanwhile
newer frames take the place of older ones. A client that never answers is sent one frame, and costs
nothing more.
"""

from __future__ import annotations

import asyncio
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING

from starlette.websockets import WebSocketDisconnect

from odscen.web.wire.live_messages import (
    LiveDetectors,
    LiveEnd,
    LiveIncidents,
    LiveLights,
    LiveState,
    introduction,
)
from odscen.web.wire.run_messages import IncidentInfo

if TYPE_CHECKING:
    from collections.abc import Callable

    from starlette.websockets import WebSocket

    from odscen.records.run_plan import Plan
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.runner.live_run import Live, LivePicture
    from odscen.web.messages import Answer
    from odscen.web.wire.run_messages import RunState

GRACE = 5.0
"""Wall seconds after the end of a run in which a client may still ask for the last frame."""


@dataclass(slots=True, eq=False)
class Active:
    """A run that this server has started.

    Attributes
    ----------
    introduction
        Makes the text that introduces all road users to a watcher; ``None`` while it is prepared.
    slice_length
        Seconds, of a long run.
    forget
        Called when no one can watch it any more.
    carla
        Whether a CARLA server shows it too.
    interrupted
        Whether its user has interrupted it, to go on later.
    preparing
        How far its routes have been found, in words.
    """

    id: str
    scenario: Scenario
    live: Live
    introduction: Callable[[], str] | None = None
    slice_length: float | None = None
    forget: Callable[[], None] = lambda: None
    finishing: bool = False
    carla: bool = False
    interrupted: bool = False
    preparing: str | None = None
    error: str | None = None
    ended: RunState | None = None
    future: Future[None] = field(default_factory=Future)

    @property
    def state(self) -> RunState:
        """What it does now."""
        if self.ended is not None:
            return self.ended
        if self.finishing or self.live.ended:
            return "finishing"
        if self.live.progress is None and self.live.picture.number == 0:
            return "preparing"
        return "paused" if self.live.pace.paused else "running"

    @property
    def long(self) -> bool:
        """Whether it goes in slices, and can be interrupted."""
        return self.slice_length is not None

    def prepared(self, plan: Plan) -> None:
        """Say what is to happen."""
        self.introduction, self.slice_length = partial(introduction, plan), plan.slice_length
        self.live.wake()

    def end(self, state: RunState, error: str | None = None) -> None:
        """Say how it has ended."""
        self.error = error
        self.ended = state
        self.live.wake()


class LiveView:
    """One client that watches one run."""

    def __init__(self, socket: WebSocket, run: Active) -> None:
        self._socket = socket
        self._run = run
        self._changed = asyncio.Event()
        self._ready = True
        self._gone = False
        self._greeted = False
        self._said: LiveState | None = None
        self._lights: dict[str, str] = {}
        self._detectors: dict[str, bool] = {}
        self._incidents = 0
        self._frame = 0

    async def show(self) -> None:
        """Serve the client until it leaves or the run is over and shown."""
        loop = asyncio.get_running_loop()

        def wake() -> None:
            with suppress(RuntimeError):  # the server has ended meanwhile
                loop.call_soon_threadsafe(self._changed.set)

        listening = asyncio.create_task(self._listen_for_messages())
        self._run.live.add_watcher(wake)
        try:
            with suppress(WebSocketDisconnect, RuntimeError):
                await self._serve_frames()
        finally:
            self._run.live.remove_watcher(wake)
            listening.cancel()

    async def _serve_frames(self) -> None:
        live = self._run.live
        while not self._gone:
            self._changed.clear()
            over = self._run.ended is not None
            if self._ready:
                # Taken first, so that what is reported is no older than the frame.
                picture = live.picture
                await self._report_changes()
                if picture.number > self._frame:
                    await self._send_frame(picture)
                elif over:
                    break
                else:
                    live.ask_frame()
                    await self._changed.wait()
            elif over:
                await self._wait_once()
                self._ready = True
            else:
                await self._changed.wait()
        if not self._gone:
            await self._send_message(LiveEnd(state=self._run.state, error=self._run.error))
            await self._socket.close()

    async def _wait_once(self) -> None:
        """Wait for a client's answer, but not for ever; go on with nothing more to show."""
        with suppress(TimeoutError):
            await asyncio.wait_for(self._wait_for_answer(), GRACE)
            return
        self._frame = self._run.live.picture.number

    async def _wait_for_answer(self) -> None:
        while not (self._ready or self._gone):
            await self._changed.wait()
            self._changed.clear()

    async def _report_changes(self) -> None:
        """Report what has changed since the last report to this client."""
        live, introduction = self._run.live, self._run.introduction
        if introduction is not None and not self._greeted:
            self._greeted = True
            await self._socket.send_text(await asyncio.to_thread(introduction))
        state = LiveState(state=self._run.state, speed=live.pace.speed)
        if state != self._said:
            self._said = state
            await self._send_message(state)
        lights, incidents = live.lights, live.incidents
        changed = {n: state for n, state in lights.items() if self._lights.get(n) != state}
        if changed:
            self._lights = lights
            await self._send_message(LiveLights(lights=changed))
        await self._report_detectors()
        if len(incidents) > self._incidents:
            new = incidents[self._incidents :]
            self._incidents += len(new)
            await self._send_message(
                LiveIncidents(events=[IncidentInfo(**incident) for incident in new])
            )

    async def _report_detectors(self) -> None:
        now, last_sent = self._run.live.detectors, self._detectors
        changed = {name: on for name, on in now.items() if last_sent.get(name) != on}
        if changed:
            self._detectors = now
            await self._send_message(LiveDetectors(detectors=changed))

    async def _send_frame(self, picture: LivePicture) -> None:
        self._frame = picture.number
        self._ready = False
        await self._socket.send_bytes(picture.frame)

    async def _send_message(self, message: Answer) -> None:
        await self._socket.send_text(message.model_dump_json())

    async def _listen_for_messages(self) -> None:
        while True:
            message = await self._socket.receive()
            if message["type"] == "websocket.disconnect":
                self._gone = True
                self._changed.set()
                return
            self._ready = True
            self._changed.set()
