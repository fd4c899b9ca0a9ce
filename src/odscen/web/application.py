"""The application: routes, guard, and the built page if there is one."""

from __future__ import annotations

import mimetypes
from contextlib import asynccontextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fastapi import FastAPI
from pydantic import TypeAdapter
from pydantic.json_schema import JsonSchemaMode
from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.middleware.gzip import DEFAULT_EXCLUDED_CONTENT_TYPES, GZipMiddleware
from starlette.responses import HTMLResponse, Response
from starlette.staticfiles import StaticFiles

from odscen.base.version import __version__
from odscen.carla.server.client import Address
from odscen.maps.child_process import keep_ready
from odscen.scenario.document.scenario_document import Scenario
from odscen.web.entry_pages import interface_page
from odscen.web.error_answers import ERROR_RESPONSES, add_error_handlers, error_response
from odscen.web.exchange import exchange_routes, recording_routes
from odscen.web.large.large_documents import LARGE
from odscen.web.messages import Health
from odscen.web.routes import (
    background_routes,
    carla_routes,
    demand_routes,
    figure_routes,
    map_routes,
    model_routes,
    removal_routes,
    result_routes,
    run_routes,
    scenario_routes,
    signal_routes,
)
from odscen.web.security import LOOPBACK, MAX_UPLOAD, Guard
from odscen.web.services import Services, Shared
from odscen.web.studies import study_routes
from odscen.web.sweeps import sweep_routes
from odscen.web.wire.live_messages import LiveMessage

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Collection

    from starlette.types import Scope

    from odscen.maps.store import Workspace

STATIC = Path(__file__).parent / "static"
"""Where the built front end lies."""

_PACKED = (
    *DEFAULT_EXCLUDED_CONTENT_TYPES,
    "application/octet-stream",
    "application/vnd.apache.parquet",
    "application/zip",
    "multipart/x-mixed-replace",
)
"""What is not compressed: it is already, or has to go out picture by picture."""

_PLAIN = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>odscen</title></head>
<body><main><h1>odscen</h1>
<p>The server is running, but its page has not been built. In a checkout, build it with</p>
<pre>cd frontend &amp;&amp; npm ci &amp;&amp; npm run build</pre>
<p>and load this page again. The interface for programs is described at
<a href="/api/docs">/api/docs</a>.</p></main></body></html>
"""


def create_app(
    workspace: Workspace,
    *,
    token: str | None = None,
    hosts: Collection[str] | None = LOOPBACK,
    max_upload: int = MAX_UPLOAD,
    static: Path = STATIC,
    carla: Address = Address(),  # noqa: B008 - immutable
    large: int = LARGE,
    in_child: bool = False,
) -> FastAPI:
    """Make the server's application.

    Parameters
    ----------
    workspace
        Maps, scenarios and runs that it serves.
    token
        What clients have to show; ``None`` if anybody who can reach it may use it.
    hosts
        Names that it answers to; ``None`` for all, which only a token makes safe.
    max_upload
        Bytes of a request with a file that is not recorded traffic, at most.
    static
        Folder of the built front end.
    carla
        Where the CARLA server is that runs can be shown on, if there is one.
    large
        Bytes of a document from which on children work on it.
    in_child
        Whether this is a child of the server, which has asked already who may come in.
    """
    shared = Services.of(workspace, carla, large=None if in_child else large)

    @asynccontextmanager
    async def lifespan(_app: FastAPI) -> AsyncIterator[None]:
        keep_ready()
        yield
        shared.close()

    app = _Api(
        title="odscen",
        version=__version__,
        docs_url=None,  # FastAPI's own loads scripts from elsewhere
        redoc_url=None,
        openapi_url="/api/openapi.json",
        lifespan=lifespan,
        responses=ERROR_RESPONSES,
    )
    app.state.services = shared
    add_error_handlers(app)

    @app.get("/api/health")
    async def health(shared: Shared) -> Health:
        """Say that the server is there, also while all threads are at work."""
        return Health(version=__version__, workspace=str(shared.workspace.root))

    for routes in (
        map_routes,
        background_routes,
        model_routes,
        scenario_routes,
        demand_routes,
        run_routes,
        study_routes,
        sweep_routes,
        signal_routes,
        result_routes,
        figure_routes,
        carla_routes,
        removal_routes,
    ):
        app.include_router(routes.router)
    app.include_router(scenario_routes.templates)
    app.include_router(demand_routes.days)
    app.include_router(exchange_routes.router)
    app.include_router(exchange_routes.exports)
    app.include_router(recording_routes.router)
    app.include_router(recording_routes.ghosts)

    @app.get("/api/docs", include_in_schema=False)
    def describe_interface() -> Response:
        return interface_page(app.openapi())

    @app.get("/api", include_in_schema=False)
    @app.get("/api/{path:path}", include_in_schema=False)
    def nothing(path: str = "") -> Response:
        return error_response(404, "NotFound", f"there is no /api/{path}")

    if (static / "index.html").is_file():
        app.mount("/", _BuiltPage(directory=static, html=True))
    else:
        app.get("/", include_in_schema=False)(lambda: HTMLResponse(_PLAIN))
    app.add_middleware(GZipMiddleware, compresslevel=5, exclude_content_types=_PACKED)
    if not in_child:
        app.add_middleware(Guard, hosts=hosts, token=token, max_upload=max_upload)
    return app


class _Api(FastAPI):
    """The interface; its schema also has what goes over WebSockets, and scenarios as files."""

    def openapi(self) -> dict[str, Any]:
        """Schema of all messages, made once; the answer to what fails stands in it once, too."""
        if self.openapi_schema is None:
            schema = super().openapi()
            for methods in schema["paths"].values():
                for operation in methods.values():
                    error = operation["responses"]["default"]
                    operation["responses"]["default"] = {"$ref": "#/components/responses/Error"}
            schema["components"]["responses"] = {"Error": error}
            schemas = schema["components"]["schemas"]
            schemas |= _schema_components("LiveMessage", LiveMessage, mode="serialization")
            schemas |= _schema_components("Scenario", Scenario, mode="validation", suffix="-File")
        return super().openapi()


def _schema_components(
    name: str, model: Any, *, mode: JsonSchemaMode, suffix: str = ""
) -> dict[str, Any]:
    """Schema of a type and of all that it is made of, by name."""
    template = f"#/components/schemas/{{model}}{suffix}"
    schema = TypeAdapter(model).json_schema(mode=mode, ref_template=template)
    parts = schema.pop("$defs")
    return {f"{part}{suffix}": part_schema for part, part_schema in {**parts, name: schema}.items()}


class _BuiltPage(StaticFiles):
    """The built front end; its own addresses, which are no files, all lead to its one page."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        """Answer with a file, else with the page."""
        try:
            response = await self._packed_response(path, scope) or await super().get_response(
                path, scope
            )
        except HTTPException as error:
            if error.status_code != 404 or "." in Path(path).name:
                raise
            response = await super().get_response("index.html", scope)
        if response.media_type == "text/html":  # names the files that belong to it
            response.headers["Cache-Control"] = "no-cache"
        return response

    async def _packed_response(self, path: str, scope: Scope) -> Response | None:
        """Answer with what the build has packed, if it has and the browser takes it."""
        taken = Headers(scope=scope).get("accept-encoding", "")
        if "br" not in [part.partition(";")[0].strip() for part in taken.split(",")]:
            return None
        try:
            response = await super().get_response(f"{path}.br", scope)
        except HTTPException:
            return None
        response.headers["Content-Type"] = mimetypes.guess_type(path)[0] or "text/plain"
        response.headers["Content-Encoding"] = "br"
        response.headers.add_vary_header("Accept-Encoding")
        return response
