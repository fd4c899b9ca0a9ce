"""HTTP with an end to patience: a client that never finishes asking is hung up on.

uvicorn waits for the head of a request for ever. Connections that send a byte now and then would
use up all that the server can have.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from uvicorn.protocols.http.h11_impl import H11Protocol

if TYPE_CHECKING:
    import asyncio

PATIENCE = 20.0
"""Wall seconds in which the head of a request has to be complete."""


class PatientProtocol(H11Protocol):
    """One connection, closed when the head of its next request does not come in time."""

    _timer: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin to wait."""
        super().connection_made(transport)
        self._watch()

    def data_received(self, data: bytes) -> None:
        """Take what has come, and wait for the rest of a head, if it is one."""
        super().data_received(data)
        self._watch()

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait no longer."""
        self._forget()
        super().connection_lost(exc)

    def _watch(self) -> None:
        asked = self.cycle is not None and not self.cycle.response_complete
        if asked:
            self._forget()
        elif self._timer is None:
            self._timer = self.loop.call_later(PATIENCE, self._hang_up)

    def _forget(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _hang_up(self) -> None:
        self._timer = None
        idle = self.cycle is None or self.cycle.response_complete
        # A connection that has become a WebSocket belongs to another protocol.
        if idle and self.transport.get_protocol() is self and not self.transport.is_closing():
            self.transport.close()
