"""What the server knows of a CARLA server: asked when somebody wants to know, and not too often."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING

from odscen.carla.served.served_run import probe

if TYPE_CHECKING:
    from odscen.carla.served.served_run import ServerCheck
    from odscen.carla.server.client import Address

FRESH = 10.0
"""Wall seconds that an answer is good for, while the port is as it was."""


class CarlaServer:
    """The CARLA server at one address, there or not."""

    def __init__(self, address: Address) -> None:
        self.address = address
        self._lock = threading.Lock()
        self._found: ServerCheck | None = None
        self._listened = False
        self._when = 0.0

    def look(self) -> ServerCheck:
        """See whether it is there; may take some seconds when it has just come."""
        with self._lock:
            stale = time.monotonic() - self._when > FRESH
            listens = self.address.listens()
            if self._found is None or stale or listens != self._listened:
                self._found, self._listened = probe(self.address), listens
                self._when = time.monotonic()
            return self._found
