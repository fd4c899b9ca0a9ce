"""Serve the application on a socket, and open the page."""

from __future__ import annotations

import gc
import resource
import socket
import threading
import webbrowser
from contextlib import ExitStack, contextmanager, suppress
from html import escape
from typing import TYPE_CHECKING

import uvicorn
from platformdirs import user_state_path
from uvicorn.protocols.http.h11_impl import H11Protocol

from odscen.base.atomic_folders import scratch_folder
from odscen.base.errors import InputError, WorkspaceError
from odscen.carla.server.client import Address
from odscen.maps.wastebasket import Wastebasket
from odscen.web.application import create_app
from odscen.web.kept_token import kept_token
from odscen.web.security import LOOPBACK, check_token

if TYPE_CHECKING:
    import asyncio
    from collections.abc import Callable, Iterator

    from starlette.types import ASGIApp

    from odscen.maps.store import Workspace

_ANY = ("0.0.0.0", "::", "")  # noqa: S104 - compared with, not bound to
MOST_CONNECTIONS = 2000
"""Connections and requests at a time; more are answered with 503."""
_MESSAGE = 2**16
"""Bytes of a WebSocket message from a client, at most; theirs are a word."""


HEAD_TIME = 20.0
"""Wall seconds in which the head of a request has to be complete."""


class PatientProtocol(H11Protocol):
    """One connection, closed when the head of its next request does not come in time.

    uvicorn waits for it for ever; connections that send a byte now and then would use up all that
    the server can have.
    """

    _timer: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin to wait."""
        super().connection_made(transport)
        self._watch_patience()

    def data_received(self, data: bytes) -> None:
        """Take what has come, and wait for the rest of a head, if it is one."""
        super().data_received(data)
        self._watch_patience()

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait no longer."""
        self._forget_timer()
        super().connection_lost(exc)

    def _watch_patience(self) -> None:
        asked = self.cycle is not None and not self.cycle.response_complete
        if asked:
            self._forget_timer()
        elif self._timer is None:
            self._timer = self.loop.call_later(HEAD_TIME, self._hang_up)

    def _forget_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _hang_up(self) -> None:
        self._timer = None
        idle = self.cycle is None or self.cycle.response_complete
        # A connection that has become a WebSocket belongs to another protocol.
        if idle and self.transport.get_protocol() is self and not self.transport.is_closing():
            self.transport.close()


def serve(
    workspace: Workspace,
    *,
    host: str = "127.0.0.1",
    port: int = 8420,
    browser: bool = True,
    token: str | None = None,
    open_to_all: bool = False,
    new_token: bool = False,
    carla: Address = Address(),  # noqa: B008 - immutable
    say: Callable[[str], None] = lambda _line: None,
) -> None:
    """Serve until interrupted.

    Parameters
    ----------
    host
        Address to listen on.
    port
        0 for any that is free.
    browser
        Open the page in the user's browser.
    token
        What clients have to show, by link, cookie or as bearer; that of the workspace's last start
        if none is given, see :mod:`odscen.web.kept_token`.
    open_to_all
        Ask for no token: whoever can reach the address may use it. Only on this machine.
    new_token
        Make a new token and forget that of the last start.
    carla
        Where the CARLA server is that runs can be shown on, if there is one.
    say
        Called with lines for the user.

    Raises
    ------
    InputError
        If the token cannot be one, or another machine could come in without one.
    WorkspaceError
        If the address cannot be listened on.
    """
    local = host in LOOPBACK
    if open_to_all and not local:
        raise InputError(
            f"--no-token is for this machine only, and {host} can be reached from others"
        )
    if open_to_all:
        token = None
    elif token:
        check_token(token)
    else:
        tokens = user_state_path("odscen", appauthor=False) / "tokens"
        token = kept_token(workspace.root, tokens, renew=new_token)
    hosts = None if host in _ANY else LOOPBACK | {host.lower()}
    bound = _bind_socket(host, port)
    port = bound.getsockname()[1]
    shown = "127.0.0.1" if host in _ANY else f"[{host}]" if ":" in host else host
    url = f"http://{shown}:{port}/" + (f"?token={token}" if token else "")
    say(f"odscen is at {url}")
    if not local:
        say("It can be reached from other machines; anyone who has this link may use it.")
    elif token:
        say("Only this link opens it; others on this machine cannot. --no-token does without.")
    say(f"Workspace: {workspace.root}. Ctrl-C ends it.")
    Wastebasket(workspace).sweep()
    _allow_many_files()
    app = create_app(workspace, token=token, hosts=hosts, carla=carla)
    with ExitStack() as stack:
        if browser:
            page = stack.enter_context(_private_link(url)) if token else url
            opener = threading.Timer(0.5, webbrowser.open, (page,))
            opener.daemon = True
            opener.start()
        # What is imported stays. Each full collection stops all requests, /api/health as well.
        gc.freeze()
        uvicorn.Server(_server_config(app)).run(sockets=[bound])


def _server_config(app: ASGIApp) -> uvicorn.Config:
    """How uvicorn serves; it logs no addresses, in which a token might be."""
    return uvicorn.Config(
        app,
        http=PatientProtocol,
        log_level="warning",
        access_log=False,
        ws_max_size=_MESSAGE,
        ws_per_message_deflate=False,
        timeout_graceful_shutdown=2,
        limit_concurrency=MOST_CONNECTIONS,
        server_header=False,
    )


@contextmanager
def _private_link(url: str) -> Iterator[str]:
    """Yield the address of a file that leads to the page, and that only its user can read.

    What a browser is started with is in the list of processes, which everybody on the machine sees.
    """
    with scratch_folder() as folder:
        file = folder / "open.html"
        file.write_text(
            f'<!doctype html><meta http-equiv="refresh" content="0;url={escape(url)}">\n'
            f'<title>odscen</title><a href="{escape(url)}">Open odscen</a>\n',
            encoding="utf-8",
        )
        yield file.as_uri()


def _allow_many_files() -> None:
    """Let the process have as many connections as it answers at a time, if the system lets it."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = 2 * MOST_CONNECTIONS
    if soft < wanted:
        with suppress(OSError, ValueError):
            resource.setrlimit(resource.RLIMIT_NOFILE, (min(wanted, hard), hard))


def _bind_socket(host: str, port: int) -> socket.socket:
    try:
        family, _, _, _, address = socket.getaddrinfo(
            host or None, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        bound = socket.socket(family, socket.SOCK_STREAM)
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        bound.bind(address)
        bound.listen()  # whoever comes before the application is ready waits
    except OSError as error:
        raise WorkspaceError(
            f"cannot listen on {host}:{port}: {error.strerror or error}; try another --port"
        ) from error
    return bound
