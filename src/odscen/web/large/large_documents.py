"""Requests about large scenarios are answered by a child process.

Reading, checking and writing a document of many megabytes holds Python's lock for seconds, in which
the server would answer no one. Such a request is given whole to a child, which has the same routes
and works on the same files; what it answers is passed on. A child takes a second or two to start,
so that small documents stay here.
"""

from __future__ import annotations

import json
import os
import threading
from collections import defaultdict
from contextlib import ExitStack, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import anyio
from anyio import CapacityLimiter
from anyio.to_thread import run_sync
from fastapi import HTTPException
from fastapi.routing import APIRoute
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response, StreamingResponse

from odscen.base.atomic_folders import scratch_folder
from odscen.maps.allowances import for_large_document
from odscen.maps.child_process import work_in_child
from odscen.maps.folder_names import is_name
from odscen.maps.wastebasket import SCENARIO_SUFFIX

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Coroutine

    from odscen.maps.store import Workspace

LARGE = 1_000_000
"""Bytes of a document, or of a request, from which on a child works on it. To read a megabyte holds
Python's lock for 0.07 s."""
_CHILD = "odscen.web.large.child_requests"
_PASSED_ON = (b"accept-encoding", b"content-type", b"content-length", b"if-none-match")
"""What the child has to know of a request; who asks is known here."""
_PIECE = 1 << 20
REQUEST, BODY, HEAD, ANSWER = "request.json", "body", "head.json", "answer"
"""Files of a request, and of its answer."""


class LargeDocuments:
    """Which documents of a workspace are large, and the children that work on them.

    Parameters
    ----------
    large
        Bytes, see :data:`LARGE`.
    """

    def __init__(self, workspace: Workspace, *, large: int = LARGE) -> None:
        self._workspace = workspace
        self._large = large
        self._names: defaultdict[str, threading.Lock] = defaultdict(threading.Lock)
        self._children: CapacityLimiter | None = None

    def is_large(self, name: str) -> bool:
        """Whether the scenario of that name is."""
        return self.size(name) >= self._large

    def size(self, name: str) -> int:
        """Bytes of a scenario's file; 0 if there is none."""
        if not is_name(name):
            return 0
        try:
            return (self._workspace.scenarios / f"{name}{SCENARIO_SUFFIX}").stat().st_size
        except OSError:
            return 0

    def concerns(self, request: Request, name: str | None) -> bool:
        """Whether a request is about a large document, or sends one."""
        if name is not None and self.is_large(name):
            return True
        if request.method in ("GET", "HEAD", "DELETE"):
            return False
        length = request.headers.get("content-length", "")
        return int(length) >= self._large if length.isdigit() else True

    def row_of(self, name: str) -> dict[str, Any]:
        """What the list of scenarios says of a large one."""
        with self._names[name], scratch_folder() as scratch:
            return work_in_child(
                f"{_CHILD}:scenario_row",
                what=f"reading scenario {name!r}",
                arguments={"workspace": str(self._workspace.root), "scenario": name},
                folders=(scratch,),
                allowance=for_large_document(self.size(name)),
            )

    async def answer(self, request: Request, name: str | None) -> Response:
        """Have a child answer a request."""
        if self._children is None:
            self._children = CapacityLimiter(max(2, os.cpu_count() or 1))
        scratch = ExitStack()
        folder = await run_sync(scratch.enter_context, scratch_folder())
        try:
            await _write_down(request, folder)
            await run_sync(self._hold_name, folder, name, limiter=self._children)
            response = await run_sync(_read_answer, folder, scratch)
        except BaseException:
            scratch.close()
            raise
        if not isinstance(response, StreamingResponse):
            await run_sync(scratch.close)
        return response

    def _hold_name(self, folder: Path, name: str | None) -> None:
        with self._names[name] if name and is_name(name) else nullcontext():
            sent = (folder / BODY).stat().st_size
            work_in_child(
                f"{_CHILD}:answer_request",
                what="working on the scenario" if name is None else f"working on scenario {name!r}",
                arguments={"workspace": str(self._workspace.root), "folder": str(folder)},
                folders=(folder,),
                allowance=for_large_document(sent + (self.size(name) if name else 0)),
            )


class LargeDocumentRoute(APIRoute):
    """A route about one scenario; a child answers if that, or what is sent, is large."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """Make the function that answers."""
        here = super().get_route_handler()

        async def handle(request: Request) -> Response:
            large: LargeDocuments | None = request.app.state.services.large
            name = await self.about(request)
            if large is not None and large.concerns(request, name):
                return await large.answer(request, name)
            return await here(request)

        return handle

    async def about(self, request: Request) -> str | None:
        """Name of the scenario that a request is about; ``None`` for a new one."""
        name: str | None = request.path_params.get("name")
        return name


class LargeForecastRoute(LargeDocumentRoute):
    """The same for a route whose body names the scenario."""

    async def about(self, request: Request) -> str | None:
        """Name in the body, if there is one."""
        try:
            name = (await request.json())["scenario"]
        except (ValueError, KeyError, TypeError, RecursionError, ClientDisconnect):
            return None
        return name if isinstance(name, str) else None


async def _write_down(request: Request, folder: Path) -> None:
    """Write a request into a folder, for a child."""
    scope = request.scope
    said = {
        "method": scope["method"],
        "path": scope["path"],
        "query": scope["query_string"].decode("latin-1"),
        "headers": [
            [name.decode("latin-1"), value.decode("latin-1")]
            for name, value in scope["headers"]
            if name in _PASSED_ON
        ],
    }
    async with await anyio.open_file(folder / BODY, "wb") as body:
        try:
            async for piece in request.stream():
                await body.write(piece)
        except ClientDisconnect as error:
            raise HTTPException(400, "the request has no end") from error
    await anyio.Path(folder / REQUEST).write_text(json.dumps(said), encoding="utf-8")


def _read_answer(folder: Path, scratch: ExitStack) -> Response:
    """What the child has answered; ``scratch`` is left when a long answer has been sent."""
    head = json.loads((folder / HEAD).read_text(encoding="utf-8"))
    content = folder / ANSWER
    response: Response
    if content.stat().st_size <= _PIECE:
        response = Response(content.read_bytes(), head["status"])
    else:
        response = StreamingResponse(_read_pieces(folder, scratch), head["status"])
    response.raw_headers = [
        (name.encode("latin-1"), value.encode("latin-1")) for name, value in head["headers"]
    ]
    return response


async def _read_pieces(folder: Path, scratch: ExitStack) -> AsyncIterator[bytes]:
    try:
        async with await anyio.open_file(folder / ANSWER, "rb") as content:
            while piece := await content.read(_PIECE):
                yield piece
    finally:
        scratch.close()
