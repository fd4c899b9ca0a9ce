"""``odscen serve``: the page in the browser."""

from __future__ import annotations

from typing import Annotated

import typer

from odscen.cli.console import WorkspaceOption, log


def serve(
    host: Annotated[
        str,
        typer.Option(help="Address to listen on; any but this machine's own needs a token."),
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port; 0 for any.")] = 8420,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the page.")] = True,
    carla: Annotated[
        str,
        typer.Option(help="Where a CARLA server is, if there is one.", metavar="HOST:PORT"),
    ] = "127.0.0.1:2000",
    workspace: WorkspaceOption = None,
) -> None:
    """Design, run and watch scenarios in the browser, without code."""
    from odscen.carla.client import Address
    from odscen.web.http_server import serve as run_server
    from odscen.workspace.store import Workspace

    run_server(
        Workspace.open(workspace),
        host=host,
        port=port,
        browser=browser,
        carla=Address.parse(carla),
        say=log,
    )
