"""Routes for CARLA: whether it is there, and the camera above a run that it shows."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import suppress

from fastapi import APIRouter
from starlette.responses import Response, StreamingResponse

from odscen.base.errors import NotFoundError
from odscen.runs import layout
from odscen.web.live_view import Active
from odscen.web.messages import CarlaInfo
from odscen.web.routes.run_routes import page_of_run
from odscen.web.services import Shared
from odscen.web.wire.media_types import HTML, PICTURES

router = APIRouter(prefix="/api")

_BOUNDARY = "picture"
_LOOK = 1.0
"""Wall seconds after which a stream looks whether its run has ended, if nobody wakes it."""


@router.get("/carla")
def carla(shared: Shared) -> CarlaInfo:
    """Whether runs can be shown on the CARLA server."""
    found = shared.carla.look()
    address = str(shared.carla.address)
    return CarlaInfo(state=found.state, address=address, message=found.message)


@router.get("/runs/{run}/camera", response_class=Response, responses=PICTURES)
async def camera(run: str, shared: Shared) -> Response:
    """Pictures from above a run that CARLA shows, as they come; JPEG, one replacing the other."""
    active = shared.runs.active(run)
    if not active.carla:
        raise NotFoundError("camera of run", run, [])
    kind = f"multipart/x-mixed-replace; boundary={_BOUNDARY}"
    return StreamingResponse(
        _yield_pictures(active), media_type=kind, headers={"Cache-Control": "no-store"}
    )


@router.get("/runs/{run}/parity.html", response_class=Response, responses=HTML)
def parity(run: str, shared: Shared) -> Response:
    """How far SUMO and CARLA agreed in a finished run."""
    return page_of_run(shared, run, layout.PARITY_FILE)


async def _yield_pictures(run: Active) -> AsyncIterator[bytes]:
    """Yield each newest picture; a slow client misses some."""
    loop = asyncio.get_running_loop()
    changed = asyncio.Event()

    def wake() -> None:
        with suppress(RuntimeError):  # the server has ended meanwhile
            loop.call_soon_threadsafe(changed.set)

    seen = 0
    run.live.add_watcher(wake)
    try:
        while True:
            over = run.ended is not None
            shot = run.live.shot
            if shot.number > seen:
                seen = shot.number
                yield _multipart_part(shot.frame)
            if over:
                return
            changed.clear()
            with suppress(TimeoutError):
                await asyncio.wait_for(changed.wait(), _LOOK)
    finally:
        run.live.remove_watcher(wake)


def _multipart_part(jpeg: bytes) -> bytes:
    head = f"--{_BOUNDARY}\r\nContent-Type: image/jpeg\r\nContent-Length: {len(jpeg)}\r\n\r\n"
    return head.encode() + jpeg + b"\r\n"
