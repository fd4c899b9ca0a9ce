"""``python -m odscen.carla.server.recording_proxy``: stands between a client and a server.

A process of its own, for the client keeps Python's lock while it waits. It reads its options as one
line of JSON, says on which port it listens, and ends with its standard input. Everything is passed
on as it comes; calls, answers and states of the world are written down. The server says where its
streams are by tokens of 24 bytes; those are changed to lead through here as well.

Transcript of what a CARLA server and a client said to each other: one JSON object a line.

The first line says what the file is. Each other line is a frame: a call or its answer as they were
on the wire (msgpack-rpc), or a state of the world as it was streamed. What sensors see is not in a
transcript.
"""

from __future__ import annotations

import asyncio
import base64
import binascii
import gzip
import ipaddress
import json
import os
import socket
import struct
import sys
import time
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import msgpack

from odscen.base.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Coroutine, Iterable, Iterator


# -------------------------------- transcript of what a CARLA server and a client said to each other
FORM, VERSION = "odscen-carla-protocol", 1


class FrameKind(StrEnum):
    """What a frame is."""

    CALL = "call"
    ANSWER = "answer"
    STATE = "state"


@dataclass(frozen=True, slots=True)
class ProtocolFrame:
    """One frame.

    Attributes
    ----------
    at
        Seconds since the recording began.
    connection
        Counted from 1; 0 for states.
    name
        Of the function that is called or that has answered.
    number
        Of the call on its connection; the frame's own number for states.
    data
        As it was on the wire; of states without their length.
    """

    at: float
    connection: int
    kind: FrameKind
    name: str
    number: int
    data: bytes


def header_line() -> str:
    """First line of a transcript."""
    return json.dumps({"format": FORM, "version": VERSION}) + "\n"


def frame_line(frame: ProtocolFrame) -> str:
    """A frame as one line."""
    return (
        json.dumps(
            {
                "at": round(frame.at, 6),
                "connection": frame.connection,
                "kind": str(frame.kind),
                "name": frame.name,
                "number": frame.number,
                "data": base64.b64encode(frame.data).decode("ascii"),
            }
        )
        + "\n"
    )


def parse_transcript(lines: Iterable[str], *, file: str) -> list[ProtocolFrame]:
    """Frames of a transcript.

    A last line that was not written whole, because the recording was killed, is left out.

    Raises
    ------
    InputError
        If it is no transcript; names the line.
    """
    frames = []
    rows = enumerate(lines, start=1)
    _check_header(next(rows, (1, ""))[1], file=file)
    for number, line in rows:
        if not line.endswith("\n"):
            break
        try:
            frames.append(_parse_frame(json.loads(line)))
        except (ValueError, KeyError, TypeError, binascii.Error) as error:
            raise InputError(
                f"is no frame of a transcript: {error}", file=file, element=f"line {number}"
            ) from error
    return frames


def _check_header(line: str, *, file: str) -> None:
    try:
        head = json.loads(line)
    except ValueError:
        head = None
    if not isinstance(head, dict) or head.get("format") != FORM:
        raise InputError(
            f"is no transcript of CARLA's protocol: the first line has to name {FORM}",
            file=file,
            element="line 1",
        )
    if head.get("version") != VERSION:
        raise InputError(
            f"version {head.get('version')!r} is not known, {VERSION} is",
            file=file,
            element="line 1",
        )


def _parse_frame(row: dict[str, Any]) -> ProtocolFrame:
    return ProtocolFrame(
        float(row["at"]),
        int(row["connection"]),
        FrameKind(row["kind"]),
        str(row["name"]),
        int(row["number"]),
        base64.b64decode(row["data"], validate=True),
    )


# ---------------------------------------------------- python -m odscen.carla.server.recording_proxy
_CHUNK = 1 << 16
_TOKEN = struct.Struct("<IHBB16s")
_TOKEN_MARK = b"\xc4\x18"
"""How msgpack begins 24 bytes."""
_NO_ADDRESS, _IPV4, _IPV6 = 0, 1, 2
"""Kinds of address in a token; without one the client takes the host that it was made with."""
_TOKENS = ("get_sensor_token", "get_episode_info")
"""Functions that answer with a token."""
_OBSERVER = 1
"""Stream of the world's states."""
_SIZE, _FRAME = struct.Struct("<I"), struct.Struct("<8xQ")


class RecordingProxy:
    """Listens, passes on, writes down.

    Parameters
    ----------
    origin
        Host and port of the server.
    """

    def __init__(self, origin: tuple[str, int], out: TextIO) -> None:
        self._origin = origin
        self._out = out
        self._start = time.monotonic()
        self._connections = 0
        self._stream_port = 0
        self._streams: dict[int, tuple[str, int]] = {}
        self._last_state = b""
        out.write(header_line())

    async def start(self) -> int:
        """Listen on loopback; the port for calls."""
        streams = await asyncio.start_server(self._serve_stream, "127.0.0.1", 0)
        self._stream_port = int(streams.sockets[0].getsockname()[1])
        calls = await asyncio.start_server(self._serve_calls, "127.0.0.1", 0)
        return int(calls.sockets[0].getsockname()[1])

    async def _serve_calls(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        self._connections += 1
        number, names = self._connections, dict[int, str]()
        try:
            there, to_server = await asyncio.open_connection(*self._origin)
        except OSError:
            writer.close()
            return
        _send_at_once(writer, to_server)
        await _first_ended(
            self._pass_calls(reader, to_server, number, names),
            self._pass_answers(there, writer, number, names),
        )
        writer.close()
        to_server.close()

    async def _pass_calls(
        self,
        reader: asyncio.StreamReader,
        to_server: asyncio.StreamWriter,
        connection: int,
        names: dict[int, str],
    ) -> None:
        frames = _Frames()
        while data := await reader.read(_CHUNK):
            to_server.write(data)
            for frame, (_, number, name, *_rest) in frames.feed(data):
                names[number] = name.decode()
                self._note_frame(connection, FrameKind.CALL, names[number], number, frame)
            await to_server.drain()

    async def _pass_answers(
        self,
        there: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
        connection: int,
        names: dict[int, str],
    ) -> None:
        frames = _Frames()
        while data := await there.read(_CHUNK):
            for frame, (_, number, *_rest) in frames.feed(data):
                name = names.pop(number, "")
                self._note_frame(connection, FrameKind.ANSWER, name, number, frame)
                writer.write(self._redirect_stream(frame) if name in _TOKENS else frame)
            await writer.drain()

    def _redirect_stream(self, frame: bytes) -> bytes:
        """An answer with its token changed, so that the stream it leads to comes through here."""
        at = len(frame) - _TOKEN.size  # it is the last value of both answers
        if not frame[:at].endswith(_TOKEN_MARK):
            return frame
        stream, port, protocol, kind, address = _TOKEN.unpack_from(frame, at)
        self._streams[stream] = (_host_in_address(kind, address) or self._origin[0], port)
        token = _TOKEN.pack(stream, self._stream_port, protocol, _NO_ADDRESS, bytes(16))
        return frame[:at] + token

    async def _serve_stream(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        try:
            (stream,) = _SIZE.unpack(await reader.readexactly(_SIZE.size))
            there, to_server = await asyncio.open_connection(*self._streams[stream])
        except (OSError, KeyError, asyncio.IncompleteReadError):
            writer.close()
            return
        _send_at_once(writer, to_server)
        to_server.write(_SIZE.pack(stream))
        # The client says nothing more: what it sends next is that it has enough.
        await _first_ended(reader.read(), self._pass_stream(stream, there, writer))
        writer.close()
        to_server.close()

    async def _pass_stream(
        self, stream: int, there: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        while True:
            head = await there.readexactly(_SIZE.size)
            message = await there.readexactly(_SIZE.unpack(head)[0])
            if stream == _OBSERVER and message != self._last_state:  # not twice for two listeners
                self._last_state = message
                (number,) = _FRAME.unpack_from(message)
                self._note_frame(0, FrameKind.STATE, "", number, message)
            writer.write(head + message)
            await writer.drain()

    def _note_frame(
        self, connection: int, kind: FrameKind, name: str, number: int, data: bytes
    ) -> None:
        at = time.monotonic() - self._start
        self._out.write(frame_line(ProtocolFrame(at, connection, kind, name, number, data)))


class _Frames:
    """Cuts what comes over a connection into values of msgpack."""

    def __init__(self) -> None:
        self._unpacker = msgpack.Unpacker(raw=True, strict_map_key=False, max_buffer_size=2**31 - 1)
        self._held = bytearray()
        self._cut = 0

    def feed(self, data: bytes) -> Iterator[tuple[bytes, list[Any]]]:
        """Whole values that there are by now, each with its bytes."""
        self._unpacker.feed(data)
        self._held += data
        for value in self._unpacker:
            end = self._unpacker.tell() - self._cut
            frame = bytes(self._held[:end])
            del self._held[:end]
            self._cut += end
            yield frame, value


def _host_in_address(kind: int, address: bytes) -> str | None:
    if kind == _IPV4:
        host = ipaddress.ip_address(address[:4])
    elif kind == _IPV6:
        host = ipaddress.ip_address(address)
    else:
        return None
    return None if host.is_unspecified else str(host)


def _send_at_once(*writers: asyncio.StreamWriter) -> None:
    for writer in writers:
        writer.get_extra_info("socket").setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)


async def _first_ended(*directions: Coroutine[Any, Any, object]) -> None:
    """Pass both directions on until one has ended."""
    tasks = [asyncio.create_task(direction) for direction in directions]
    done, rest = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    for task in rest:
        task.cancel()
    for task in (*done, *rest):
        with suppress(OSError, asyncio.IncompleteReadError, asyncio.CancelledError):
            await task


async def main() -> None:
    """Serve until standard input ends."""
    options = json.loads(sys.stdin.readline())
    file = Path(options["file"])
    try:
        out = _open_transcript(file)
    except OSError as error:
        _print_message({"error": error.strerror or str(error)})
        return
    with out:
        proxy = RecordingProxy((options["host"], options["port"]), out)
        _print_message({"port": await proxy.start()})
        loop = asyncio.get_running_loop()
        await loop.run_in_executor(None, sys.stdin.read)
        out.flush()
    os._exit(0)  # open connections are cut


def _open_transcript(file: Path) -> TextIO:
    if file.suffix == ".gz":
        return gzip.open(file, "wt", encoding="ascii")
    return file.open("w", encoding="ascii")


def _print_message(message: dict[str, object]) -> None:
    sys.stdout.write(json.dumps(message) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    asyncio.run(main())
