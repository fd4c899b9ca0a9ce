"""Serve the application on a socket, and open the page."""

from __future__ import annotations

import secrets
import socket
import threading
import webbrowser
from typing import TYPE_CHECKING

import uvicorn

from odscen.base.errors import WorkspaceError
from odscen.carla.client import Address
from odscen.web.application import create_app
from odscen.web.security import LOOPBACK

if TYPE_CHECKING:
    from collections.abc import Callable

    from odscen.workspace.store import Workspace

_ANY = ("0.0.0.0", "::", "")  # noqa: S104 - compared with, not bound to
_MESSAGE = 2**16
"""Bytes of a WebSocket message from a client, at most; theirs are a word."""


def serve(
    workspace: Workspace,
    *,
    host: str = "127.0.0.1",
    port: int = 8420,
    browser: bool = True,
    carla: Address = Address(),  # noqa: B008 - immutable
    say: Callable[[str], None] = lambda _line: None,
) -> None:
    """Serve until interrupted.

    Parameters
    ----------
    host
        Address to listen on. Any but a loopback one needs a token, which is made and told.
    port
        0 for any that is free.
    browser
        Open the page in the user's browser.
    carla
        Where the CARLA server is that runs can be shown on, if there is one.
    say
        Called with lines for the user.

    Raises
    ------
    WorkspaceError
        If the address cannot be listened on.
    """
    local = host in LOOPBACK
    token = None if local else secrets.token_urlsafe(24)
    hosts = None if host in _ANY else LOOPBACK | {host.lower()}
    bound = _bind(host, port)
    port = bound.getsockname()[1]
    shown = "127.0.0.1" if host in _ANY else f"[{host}]" if ":" in host else host
    url = f"http://{shown}:{port}/" + (f"?token={token}" if token else "")
    say(f"odscen is at {url}")
    if token:
        say("It can be reached from other machines; anyone who has this address may use it.")
    say(f"Workspace: {workspace.root}. Ctrl-C ends it.")
    app = create_app(workspace, token=token, hosts=hosts, carla=carla)
    config = uvicorn.Config(
        app,
        log_level="warning",
        ws_max_size=_MESSAGE,
        ws_per_message_deflate=False,
        timeout_graceful_shutdown=2,
        server_header=False,
    )
    if browser:
        opener = threading.Timer(0.5, webbrowser.open, (url,))
        opener.daemon = True
        opener.start()
    uvicorn.Server(config).run(sockets=[bound])


def _bind(host: str, port: int) -> socket.socket:
    try:
        family, _, _, _, address = socket.getaddrinfo(
            host or None, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        bound = socket.socket(family, socket.SOCK_STREAM)
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        bound.bind(address)
        bound.listen()  # whoever comes before the application is ready waits
    except OSError as error:
        msg = f"cannot listen on {host}:{port}: {error.strerror or error}; try another --port"
        raise WorkspaceError(msg) from error
    return bound
