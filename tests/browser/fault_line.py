"""A server that can be killed and started anew, behind a line that can be cut."""

from __future__ import annotations

import socket
import threading
from contextlib import ExitStack, suppress
from pathlib import Path
from urllib.parse import urlsplit

from tools import page as tool

CHUNK = 65536


class FaultLine:
    """Forwards bytes between a fixed port and ``odscen serve``; what is cut refuses and closes all.

    Attributes
    ----------
    url
        Where the page is, whatever server is behind it.
    """

    def __init__(self, workspace: Path) -> None:
        self._workspace = workspace
        self._servers = ExitStack()
        self._open: set[socket.socket] = set()
        self._lock = threading.Lock()
        self.whole = True
        self._start()
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.url = f"http://127.0.0.1:{self._listening.getsockname()[1]}"
        threading.Thread(target=self._accept, daemon=True).start()

    def cut(self) -> None:
        """Close all connections, and each new one at once."""
        self.whole = False
        with self._lock:
            for one in self._open:
                with suppress(OSError):
                    one.shutdown(socket.SHUT_RDWR)

    def mend(self) -> None:
        """Let new connections through."""
        self.whole = True

    def restart(self, *, by_force: bool = False) -> None:
        """End the server, and start another one on the same workspace."""
        if by_force:
            self.server.process.kill()
        self._servers.close()
        self._start()

    def close(self) -> None:
        """Stop all."""
        self.cut()
        self._listening.close()
        self._servers.close()

    def _start(self) -> None:
        self.server = self._servers.enter_context(tool.served(self._workspace))

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                client, _ = self._listening.accept()
                threading.Thread(target=self._serve, args=(client,), daemon=True).start()

    def _serve(self, client: socket.socket) -> None:
        address = urlsplit(self.server.url)
        with client, suppress(OSError):
            if not self.whole:
                return
            with socket.create_connection((address.hostname, address.port)) as server:
                with self._lock:
                    self._open |= {client, server}
                back = threading.Thread(target=_pour, args=(server, client), daemon=True)
                back.start()
                _pour(client, server)
                back.join()
                with self._lock:
                    self._open -= {client, server}


def _pour(source: socket.socket, target: socket.socket) -> None:
    with suppress(OSError):
        while data := source.recv(CHUNK):
            target.sendall(data)
    with suppress(OSError):
        target.shutdown(socket.SHUT_RDWR)
