"""Frees a Traffic Manager that waits for its own thread.

In synchronous mode the thread that ticks and the Traffic Manager's own wake each other without
holding the lock that the other one goes to sleep with (issue 9172 of carla-simulator/carla). Now
and then one is called a moment before it sleeps: then both sleep, no time-out applies, and the
tick never ends. Leaving synchronous mode calls the Traffic Manager's thread once more. The thread
that ticks holds the lock of the client's Traffic Managers meanwhile, so this is asked for at the
port on which the Traffic Manager listens for other clients.
"""

from __future__ import annotations

import socket
import threading
import time
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

PATIENCE = 2.0
"""Seconds after the frame has come until a tick that has not ended is taken for one that never
will: the Traffic Manager's own step takes milliseconds."""
_LOOK = 0.25
"""Seconds between two looks."""
_ANSWER = 2.0
"""Seconds for an answer of the Traffic Manager."""


class TickWatch:
    """Sees to it that ticks end; looks from a thread of its own until the process ends.

    Parameters
    ----------
    port
        On which the Traffic Manager of this process listens.
    frame
        Number of the newest frame that has come from the server.

    Attributes
    ----------
    freed
        How often a tick had to be freed.
    """

    def __init__(self, port: int, frame: Callable[[], int], *, patience: float = PATIENCE) -> None:
        self._port = port
        self._frame = frame
        self._patience = patience
        self._before: int | None = None
        self.freed = 0
        threading.Thread(target=self._watch_ticks, name="tick-watch", daemon=True).start()

    @contextmanager
    def tick(self) -> Iterator[None]:
        """Watch the tick that is made within."""
        self._before = self._frame()
        try:
            yield
        finally:
            self._before = None

    def _watch_ticks(self) -> None:
        watched, since = None, 0.0
        while True:
            time.sleep(_LOOK)
            before = self._before
            if before is None or self._frame() <= before:
                watched = None
            elif before != watched:
                watched, since = before, time.monotonic()
            elif time.monotonic() - since >= self._patience:
                watched = None
                with suppress(OSError):  # then it is tried again
                    free(self._port)
                    self.freed += 1


def free(port: int) -> None:
    """Call the thread of the Traffic Manager that listens on a port of this machine.

    Both requests are sent at once, so that it makes no step of its own between the two.

    Raises
    ------
    OSError
        If it does not answer.
    """
    import msgpack

    requests = [
        msgpack.packb([0, number, "set_synchronous_mode", [on]])
        for number, on in enumerate((False, True))
    ]
    with socket.create_connection(("127.0.0.1", port), timeout=_ANSWER) as line:
        line.sendall(b"".join(requests))
        answers = msgpack.Unpacker()
        got = 0
        while got < len(requests):
            part = line.recv(4096)
            if not part:
                raise ConnectionError(f"the Traffic Manager at port {port} closed the connection")
            answers.feed(part)
            got += sum(1 for _ in answers)
