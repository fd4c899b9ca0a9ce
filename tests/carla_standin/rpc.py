"""msgpack-rpc as CARLA's client speaks it: a method table and a TCP server that asks it."""

from __future__ import annotations

import asyncio
import inspect
import socket
import sys
import traceback
from collections import Counter
from collections.abc import Callable
from enum import Enum
from typing import Any, TypeVar

import msgpack

from tests.carla_standin import wire
from tests.carla_standin.switches import Switches

_REQUEST, _RESPONSE = 0, 1

Method = Callable[..., Any]
AnyMethod = TypeVar("AnyMethod", bound=Method)


class Returns(Enum):
    """How the answer of a method is wrapped."""

    VALUE = "Response<T>"
    VOID = "Response<void>"
    PLAIN = "no wrapping at all"


def rpc(name: str, returns: Returns = Returns.VALUE) -> Callable[[AnyMethod], AnyMethod]:
    """Mark a method as the answer to an RPC; may be given more than once."""

    def mark(method: AnyMethod) -> AnyMethod:
        marks = [*getattr(method, "rpc_marks", ()), (name, returns)]
        method.rpc_marks = marks  # type: ignore[attr-defined]
        return method

    return mark


class MethodTable:
    """All RPCs by name, and how often each was called."""

    def __init__(self, *services: object, switches: Switches) -> None:
        self.calls: Counter[str] = Counter()
        self._switches = switches
        self._late: list[tuple[str, list[Any]]] = []
        self._methods: dict[str, tuple[Method, Returns]] = {}
        for service in services:
            for _, method in inspect.getmembers(service, inspect.ismethod):
                for name, returns in getattr(method, "rpc_marks", ()):
                    self._methods[name] = (method, returns)

    async def answer(self, name: str, params: list[Any]) -> tuple[Any, Any]:
        """Error and result of a call; ``params`` begin with the call's metadata.

        A real server has several worker threads: what waits for no answer may be done behind what
        was asked for later (issue 8263 of carla-simulator/carla).
        """
        self.calls[name] += 1
        when = self._switches.late_calls
        if when and params[0][0]:
            self._late.append((name, params))
            return None, wire.void()
        answer = await self._do(name, params)
        if when == "call" or name == "tick_cue":
            await self.catch_up()
        return answer

    async def catch_up(self) -> None:
        """Do what nobody waits for and was put off."""
        late, self._late = self._late, []
        for call in late:
            await self._do(*call)

    async def _do(self, name: str, params: list[Any]) -> tuple[Any, Any]:
        unknown = name == "project_point" and self._switches.no_projection
        if name not in self._methods or unknown:
            return f"there is no function {name}", None
        method, returns = self._methods[name]
        try:
            result = method(*params[1:])
            if inspect.isawaitable(result):
                result = await result
        except wire.RefusedError as error:
            refuse = wire.void_error if returns is Returns.VOID else wire.value_error
            return None, refuse(str(error))
        except Exception as error:
            traceback.print_exc(file=sys.stderr)
            return f"{name}: {error!r}", None
        if returns is Returns.VOID:
            return None, wire.void()
        return None, wire.value(result) if returns is Returns.VALUE else result


class RpcServer:
    """Answers one call after the other on each connection, so that calls keep their order."""

    def __init__(self, methods: MethodTable) -> None:
        self._methods = methods

    async def start(self, port: int = 0) -> int:
        """Listen on loopback; the port that was chosen."""
        server = await asyncio.start_server(self._serve, "127.0.0.1", port)
        return int(server.sockets[0].getsockname()[1])

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        no_delay(writer)
        unpacker = msgpack.Unpacker(raw=False, strict_map_key=False, max_buffer_size=2**28)
        try:
            while data := await reader.read(1 << 16):
                unpacker.feed(data)
                for kind, number, name, params in unpacker:
                    if kind != _REQUEST:
                        return
                    error, result = await self._methods.answer(name, params)
                    writer.write(msgpack.packb([_RESPONSE, number, error, result]))
                await writer.drain()
        except ConnectionError:
            pass
        finally:
            writer.close()


def no_delay(writer: asyncio.StreamWriter) -> None:
    """Send small messages at once."""
    writer.get_extra_info("socket").setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
