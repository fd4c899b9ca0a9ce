"""The live view of a run over a WebSocket.

What is sent follows the client: after each frame the server waits for any text, and meanwhile
newer frames take the place of older ones. A client that never answers is sent one frame, and costs
nothing more.
"""

from __future__ import annotations

import asyncio
from contextlib import suppress
from typing import TYPE_CHECKING

import orjson
from starlette.websockets import WebSocketDisconnect

from odscen.sumo.worker.snapshots import origin
from odscen.web.wire.live_messages import (
    LiveActor,
    LiveDetectors,
    LiveEnd,
    LiveIncidents,
    LiveLights,
    LiveState,
)
from odscen.web.wire.run_messages import IncidentInfo

if TYPE_CHECKING:
    from starlette.websockets import WebSocket

    from odscen.results.records.run_records import Plan
    from odscen.sumo.runner.live_run import LivePicture
    from odscen.web.active_runs import Active
    from odscen.web.messages import Answer

GRACE = 5.0
"""Wall seconds after the end of a run in which a client may still ask for the last frame."""


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

        listening = asyncio.create_task(self._listen())
        self._run.live.add_watcher(wake)
        try:
            with suppress(WebSocketDisconnect, RuntimeError):
                await self._serve()
        finally:
            self._run.live.remove_watcher(wake)
            listening.cancel()

    async def _serve(self) -> None:
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
            await self._send(LiveEnd(state=self._run.state, error=self._run.error))
            await self._socket.close()

    async def _wait_once(self) -> None:
        """Wait for a client's answer, but not for ever; go on with nothing more to show."""
        with suppress(TimeoutError):
            await asyncio.wait_for(self._answered(), GRACE)
            return
        self._frame = self._run.live.picture.number

    async def _answered(self) -> None:
        while not (self._ready or self._gone):
            await self._changed.wait()
            self._changed.clear()

    async def _report_changes(self) -> None:
        """Report what has changed since the last report to this client."""
        live, plan = self._run.live, self._run.plan
        if plan is not None and not self._greeted:
            self._greeted = True
            await self._socket.send_text(await asyncio.to_thread(_hello, plan))
        state = LiveState(state=self._run.state, speed=live.pace.speed)
        if state != self._said:
            self._said = state
            await self._send(state)
        lights, incidents = live.lights, live.incidents
        changed = {n: state for n, state in lights.items() if self._lights.get(n) != state}
        if changed:
            self._lights = lights
            await self._send(LiveLights(lights=changed))
        await self._report_detectors()
        if len(incidents) > self._incidents:
            new = incidents[self._incidents :]
            self._incidents += len(new)
            await self._send(LiveIncidents(events=[IncidentInfo(**one) for one in new]))

    async def _report_detectors(self) -> None:
        now, said = self._run.live.detectors, self._detectors
        changed = {name: on for name, on in now.items() if said.get(name) != on}
        if changed:
            self._detectors = now
            await self._send(LiveDetectors(detectors=changed))

    async def _send_frame(self, picture: LivePicture) -> None:
        self._frame = picture.number
        self._ready = False
        await self._socket.send_bytes(picture.frame)

    async def _send(self, message: Answer) -> None:
        await self._socket.send_text(message.model_dump_json())

    async def _listen(self) -> None:
        while True:
            message = await self._socket.receive()
            if message["type"] == "websocket.disconnect":
                self._gone = True
                self._changed.set()
                return
            self._ready = True
            self._changed.set()


def _hello(plan: Plan) -> str:
    """Introduce every road user that will ever be in a frame.

    A :class:`~odscen.web.wire.live_messages.LiveHello`, but written at once: a day in a town has
    tens of thousands of actors.
    """
    names = [name for name in LiveActor.model_fields if name != "index"]
    hello = {
        "type": "hello",
        "scenario": plan.scenario,
        "until": plan.until,
        "step_length": plan.step_length,
        "origin": origin(plan),
        "actors": [
            {"index": index, **{name: getattr(actor, name) for name in names}}
            for index, actor in enumerate(plan.actors)
        ],
    }
    return orjson.dumps(hello).decode()
