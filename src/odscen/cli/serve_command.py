"""``odscen serve``: the page in the browser."""

from __future__ import annotations

from typing import Annotated

import typer

from odscen.cli.console import WorkspaceOption, log


def serve(
    host: Annotated[
        str,
        typer.Option(help="Address to listen on; others than this reach beyond this machine."),
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port; 0 for any.")] = 8420,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the page.")] = True,
    token: Annotated[
        str | None,
        typer.Option(
            help="What clients have to show. [default: that of the last start]",
            envvar="ODSCEN_TOKEN",
            show_envvar=True,
            show_default=False,
        ),
    ] = None,
    no_token: Annotated[
        bool,
        typer.Option("--no-token", help="Let anybody on this machine in."),
    ] = False,
    new_token: Annotated[
        bool,
        typer.Option("--new-token", help="Make a new token; pages and links of before are out."),
    ] = False,
    carla: Annotated[
        str,
        typer.Option(help="Where a CARLA server is, if there is one.", metavar="HOST:PORT"),
    ] = "127.0.0.1:2000",
    workspace: WorkspaceOption = None,
) -> None:
    """Design, run and watch scenarios in the browser, without code.

    The link that is printed has a token, which opens the page. What is on a command line can
    be seen by all users of the machine: give a token of your own as $ODSCEN_TOKEN.
    """
    from odscen.carla.server.client import Address
    from odscen.maps.store import Workspace
    from odscen.web.http_server import serve as run_server

    run_server(
        Workspace.open(workspace),
        host=host,
        port=port,
        browser=browser,
        token=token,
        open_to_all=no_token,
        new_token=new_token,
        carla=Address.parse(carla),
        say=log,
    )
