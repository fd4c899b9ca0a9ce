"""What a child does for the server: requests about large scenarios, and days of traffic."""

from __future__ import annotations

import asyncio
import json
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from starlette.requests import Request

from odscen.maps.store import Workspace
from odscen.web.application import create_app
from odscen.web.large.large_documents import ANSWER, BODY, HEAD, REQUEST
from odscen.web.large.whole_days import day_made
from odscen.web.messages import WholeDay

if TYPE_CHECKING:
    from collections.abc import Callable, MutableMapping

    from fastapi import FastAPI

    from odscen.web.services import Services


def answer_request(
    *, workspace: str, folder: str, progress: Callable[[str, float], None]
) -> dict[str, Any]:
    """Answer a request that was written into a folder, there; a job of a child."""
    progress("working on the scenario", 0.0)
    asyncio.run(_answer_request(_child_application(workspace), Path(folder)))
    return {}


def scenario_row(
    *, workspace: str, scenario: str, progress: Callable[[str, float], None]
) -> dict[str, Any]:
    """What the list of scenarios says of one; a job of a child."""
    progress("reading the scenario", 0.0)
    return services_in_child(workspace).drafts.row(scenario).model_dump(mode="json")


def whole_day(
    *,
    workspace: str,
    name: str,
    wish: dict[str, Any],
    made: str | None,
    progress: Callable[[str, float], None],
) -> dict[str, Any]:
    """Make a day of traffic for a scenario; a job of a child."""
    file = None if made is None else Path(made)
    asked = WholeDay.model_validate(wish)
    day = day_made(services_in_child(workspace), name, asked, made=file, progress=progress)
    return day.model_dump(mode="json")


def services_in_child(workspace: str) -> Services:
    """Services of a child, which has the large documents to itself."""
    services: Services = _child_application(workspace).state.services
    return services


@lru_cache(maxsize=1)
def _child_application(workspace: str) -> FastAPI:
    app = create_app(Workspace.open(Path(workspace)), hosts=None, in_child=True)

    @app.exception_handler(MemoryError)
    def short(_request: Request, error: MemoryError) -> NoReturn:
        raise error  # it is the child's limit that was met

    return app


async def _answer_request(app: FastAPI, folder: Path) -> None:
    request = json.loads((folder / REQUEST).read_text(encoding="utf-8"))
    body = (folder / BODY).read_bytes()
    scope = {
        "type": "http",
        "http_version": "1.1",
        "method": request["method"],
        "path": request["path"],
        "raw_path": request["path"].encode(),
        "query_string": request["query"].encode("latin-1"),
        "headers": [
            (b"host", b"localhost"),
            *(
                (name.encode("latin-1"), value.encode("latin-1"))
                for name, value in request["headers"]
            ),
        ],
        "scheme": "http",
        "root_path": "",
    }

    async def receive() -> MutableMapping[str, Any]:
        return {"type": "http.request", "body": body, "more_body": False}

    with (folder / ANSWER).open("wb") as content:

        async def send(message: MutableMapping[str, Any]) -> None:
            if message["type"] == "http.response.start":
                head = {
                    "status": message["status"],
                    "headers": [
                        [name.decode("latin-1"), value.decode("latin-1")]
                        for name, value in message["headers"]
                    ],
                }
                (folder / HEAD).write_text(json.dumps(head), encoding="utf-8")
            else:
                content.write(message.get("body", b""))

        await app(scope, receive, send)
