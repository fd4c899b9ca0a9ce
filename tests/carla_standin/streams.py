"""The stream port: state messages and pictures go to whoever subscribed to their stream."""

from __future__ import annotations

import asyncio
import struct
from collections import Counter

from tests.carla_standin import wire
from tests.carla_standin.rpc import no_delay

_HOLD_SECONDS = 0.5
"""How long a tick waits for a subscription whose token was handed out."""

_SIZE = struct.Struct("<I")


class StreamServer:
    """Subscribers by stream id.

    A client subscribes in the background: it asks for a token and connects a moment later. A tick
    must wait for that (:meth:`settled`), else its message is lost and the client times out.
    """

    def __init__(self) -> None:
        self.port = 0
        self.refusing = False
        self._writers: dict[int, set[asyncio.StreamWriter]] = {}
        self._expected: Counter[int] = Counter()
        self._arrival = asyncio.Event()

    async def start(self) -> None:
        """Listen on loopback, on a port of its own."""
        server = await asyncio.start_server(self._serve, "127.0.0.1", 0)
        self.port = int(server.sockets[0].getsockname()[1])

    def token(self, stream: int) -> bytes:
        """Token of a stream, without expecting anybody."""
        return wire.token(stream, self.port)

    def expect(self, stream: int) -> bytes:
        """Token of a stream for a client that is about to subscribe."""
        self._expected[stream] += 1
        return self.token(stream)

    def is_watched(self, stream: int) -> bool:
        """Whether anybody has subscribed to a stream."""
        return bool(self._writers.get(stream))

    async def settled(self) -> None:
        """Wait until all who asked for a token have connected, half a second at most."""
        try:
            async with asyncio.timeout(_HOLD_SECONDS):
                while +self._expected:
                    self._arrival.clear()
                    await self._arrival.wait()
        except TimeoutError:
            self._expected.clear()

    def send(self, stream: int, message: bytes) -> None:
        """Send one message to all subscribers of a stream."""
        for writer in self._writers.get(stream, ()):
            writer.write(_SIZE.pack(len(message)))
            writer.write(message)

    def drop(self) -> None:
        """Cut all subscribers off; their clients connect again by themselves."""
        for writers in self._writers.values():
            for writer in writers:
                writer.transport.abort()
        self._writers.clear()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        no_delay(writer)
        stream = 0
        try:
            (stream,) = _SIZE.unpack(await reader.readexactly(4))
            if self.refusing:
                return
            self._writers.setdefault(stream, set()).add(writer)
            # One who comes back by itself asks for no token again, and is not expected.
            self._expected[stream] = max(self._expected[stream] - 1, 0)
            self._arrival.set()
            # Nothing more is ever written by the client: this ends when it unsubscribes.
            await reader.read()
        except (ConnectionError, asyncio.IncompleteReadError):
            pass
        finally:
            self._writers.get(stream, set()).discard(writer)
            writer.close()
