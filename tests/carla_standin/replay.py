"""A server that says again what was recorded: ``python -m tests.carla_standin.replay``.

Started by :class:`tests.carla_standin.process.Replay`. Calls are answered from a transcript, in its
order, and held against the calls that were recorded. States of the world are shown where they came
between calls and answers; in a world that ran by itself the last one before a call waits a little,
for a client may wait for it. Where the client made no ticks, it goes by the states that it sees, of
which only the newest counts: those between two of its calls are shown at once, with the last.
"""

from __future__ import annotations

import asyncio
import gzip
import json
import os
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

import msgpack

from odscen.carla.server.recording_proxy import FrameKind, ProtocolFrame, parse_transcript
from tests.carla_standin import wire
from tests.carla_standin.__main__ import say
from tests.carla_standin.protocol_difference import call_differences
from tests.carla_standin.rpc import no_delay
from tests.carla_standin.streams import StreamServer

_HELD_SECONDS = 0.25
_FOLLOWED_SECONDS = 0.15
"""At least between an answer and the next states for a client that makes no ticks: all that it does
meanwhile it did before they came."""
_SEEN_SECONDS = 0.01
"""For states to be seen before the answer that came behind them, on another connection."""
_AHEAD = 40
"""Recorded calls that are looked through for one that comes at another time."""
_MOST = 1000
"""Differences that are kept."""
_NUMBER_BYTES = {0xCC: 2, 0xCD: 3, 0xCE: 5, 0xCF: 9}


class Session:
    """One connection: the recorded calls that it is held against, and how far it has come."""

    def __init__(self, calls: list[int]) -> None:
        self.calls = calls
        self.at = 0


class ReplayServer:
    """Answers from a transcript.

    Parameters
    ----------
    tolerance
        By how much numbers of a call may differ from those recorded.

    Attributes
    ----------
    differences
        In words, in the order of the calls.
    """

    def __init__(self, frames: list[ProtocolFrame], *, tolerance: float) -> None:
        self.differences: list[str] = []
        self.streams = StreamServer()
        self._frames = frames
        self._tolerance = tolerance
        self._sessions: list[Session] = []
        self._shown = 0
        self._pacing: asyncio.Task[None] | None = None
        self._calls: dict[int, list[int]] = defaultdict(list)
        self._answers: dict[tuple[int, int], int] = {}
        self._follows = all(frame.name != "tick_cue" for frame in frames)
        for k, frame in enumerate(frames):
            if frame.kind is FrameKind.CALL:
                self._calls[frame.connection].append(k)
            elif frame.kind is FrameKind.ANSWER:
                self._answers[frame.connection, frame.number] = k

    async def start(self) -> int:
        """Listen on loopback; the port for calls."""
        await self.streams.start()
        server = await asyncio.start_server(self._serve, "127.0.0.1", 0)
        return int(server.sockets[0].getsockname()[1])

    def left(self) -> list[str]:
        """Names of recorded calls that were not made, in their order."""
        done = {id(session.calls): session.at for session in self._sessions}
        return [
            self._frames[k].name
            for calls in self._calls.values()
            for k in calls[done.get(id(calls), 0) :]
        ]

    def made(self) -> int:
        """How many recorded calls were made again."""
        return sum(session.at for session in self._sessions)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        no_delay(writer)
        unpacker = msgpack.Unpacker(raw=False, strict_map_key=False, max_buffer_size=2**28)
        session = None
        try:
            while data := await reader.read(1 << 16):
                unpacker.feed(data)
                for _, number, name, params in unpacker:
                    session = session or self._begin()
                    await self._answer(session, writer, number, name, params)
                await writer.drain()
        except ConnectionError:
            pass
        finally:
            writer.close()

    def _begin(self) -> Session:
        recorded = list(self._calls.values())
        number = len(self._sessions)
        session = Session(recorded[number] if number < len(recorded) else [])
        self._sessions.append(session)
        return session

    async def _answer(
        self,
        session: Session,
        writer: asyncio.StreamWriter,
        number: int,
        name: str,
        params: list[Any],
    ) -> None:
        if self._pacing is not None:
            self._pacing.cancel()
            self._pacing = None
        call = self._matching(session, name)
        if call is None:
            writer.write(self._answer_at_a_loss(number, name))
            return
        await self._show_until(call)
        frame = self._frames[call]
        recorded = msgpack.unpackb(frame.data, raw=False, strict_map_key=False)[3]
        for words in call_differences(name, recorded, params, tolerance=self._tolerance):
            self._differs(f"call {frame.number}, {name}{words}")
        at = self._answers.get((frame.connection, frame.number))
        if at is None:  # the recording ended before it
            return
        await self._show_until(at)
        writer.write(self._fitted(self._frames[at].data, number, name, params))
        self._pacing = asyncio.create_task(self._show_on(at, name))

    def _matching(self, session: Session, name: str) -> int | None:
        """Position of the recorded call that this one is."""
        ahead = session.calls[session.at : session.at + _AHEAD]
        for k, call in enumerate(ahead):
            if self._frames[call].name == name:
                for skipped in ahead[:k]:
                    one = self._frames[skipped]
                    self._differs(f"call {one.number}, {one.name}: recorded, not made now")
                session.at += k + 1
                return call
        expected = self._frames[ahead[0]].name if ahead else "none"
        self._differs(f"{name}: not recorded here, but {expected}")
        return None

    def _answer_at_a_loss(self, number: int, name: str) -> bytes:
        """What was said to such a call at any time, or else an error."""
        for frame in reversed(self._frames):
            if frame.kind is FrameKind.ANSWER and frame.name == name:
                return self._fitted(frame.data, number, name, [])
        return bytes(msgpack.packb([1, number, f"{name} was never recorded", None]))

    def _fitted(self, answer: bytes, number: int, name: str, params: list[Any]) -> bytes:
        """An answer with the number of this call, and with where this server streams."""
        rest = answer[2 + _NUMBER_BYTES.get(answer[2], 1) :]
        if name in ("get_sensor_token", "get_episode_info"):
            stream = int(params[1]) if len(params) > 1 else wire.WORLD_OBSERVER
            asked = name == "get_sensor_token"
            token = self.streams.expect(stream) if asked else self.streams.token(stream)
            rest = rest[: -wire.TOKEN_BYTES] + token  # it is the last value of both answers
        return b"\x94\x01" + bytes(msgpack.packb(number)) + rest

    async def _show_until(self, position: int) -> None:
        shown = [await self._show(k) for k in range(self._shown, position)]
        self._shown = max(self._shown, position)
        if self._follows and any(shown):
            await asyncio.sleep(_SEEN_SECONDS)

    async def _show(self, position: int) -> bool:
        """Show a frame of the recording if it is a state, and say whether it is."""
        frame = self._frames[position]
        if frame.kind is not FrameKind.STATE:
            return False
        await self.streams.settled()
        self.streams.send(wire.WORLD_OBSERVER, frame.data)
        return True

    async def _show_on(self, answer: int, name: str) -> None:
        """Show what came between an answer and the next call, when it came."""
        begun = self._frames[answer]
        gap = []
        for k in range(answer + 1, len(self._frames)):
            if self._frames[k].kind is FrameKind.CALL:
                break
            gap.append(k)
        loop = asyncio.get_running_loop()
        start = loop.time()
        states = [k for k in gap if self._frames[k].kind is FrameKind.STATE]
        if self._follows and states:
            after = self._frames[states[-1]].at - begun.at
            await asyncio.sleep(max(after, _FOLLOWED_SECONDS))
            await self._show_until(states[-1] + 1)
            return
        for k in states:
            after = self._frames[k].at - begun.at
            if name != "tick_cue" and k == states[-1]:
                after = max(after, _HELD_SECONDS)
            await asyncio.sleep(max(0.0, start + after - loop.time()))
            if k >= self._shown:
                await self._show(k)
                self._shown = k + 1

    def _differs(self, words: str) -> None:
        if len(self.differences) < _MOST:
            self.differences.append(words)


def read(file: Path) -> list[ProtocolFrame]:
    """Frames of a transcript."""
    content = file.read_bytes()
    text = (gzip.decompress(content) if file.suffix == ".gz" else content).decode("ascii")
    return parse_transcript(text.splitlines(keepends=True), file=file.name)


async def main() -> None:
    """Serve until the test has had enough."""
    options = json.loads(sys.stdin.readline())
    server = ReplayServer(read(Path(options["file"])), tolerance=options["tolerance"])
    say({"port": await server.start()})
    loop = asyncio.get_running_loop()
    reader = asyncio.StreamReader()
    await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
    while await reader.readline():
        told = {"differences": server.differences, "left": server.left(), "made": server.made()}
        say({"result": told})
    os._exit(0)


if __name__ == "__main__":
    asyncio.run(main())
