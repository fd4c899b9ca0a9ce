"""A stand-in for a CARLA server, in a process of its own, for tests."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections import Counter
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from tests.carla_standin import wire

_ROOT = Path(__file__).parents[2]
_END_SECONDS = 10.0
USUAL = os.environ.get("ODSCEN_STANDIN_RELEASE", wire.CLIENT_VERSION)
"""Release of the client that tests have."""


class StandIn:
    """Server process; a context manager that leaves no process behind.

    The process has to be another one: the client keeps Python's lock while it waits.

    Parameters
    ----------
    xodr
        Map to begin with; ``map_name`` is what the server calls it.
    other_maps
        More maps that can be loaded, by name.
    box_offset
        Metres by which the boxes of vehicles lie before their origin, and to the right of it; some
        models have that.
    speaks
        Release whose wire it speaks, one of :data:`tests.carla_standin.wire.SPOKEN`, and which it
        says that it is unless the switch ``version`` is given; usually that of
        ``ODSCEN_STANDIN_RELEASE``, so that all tests can be run with the client of another.
    switches
        Of :class:`tests.carla_standin.switches.Switches`.
    """

    host = "127.0.0.1"
    module = "tests.carla_standin"

    def __init__(
        self,
        xodr: Path,
        *,
        map_name: str | None = None,
        other_maps: dict[str, Path] | None = None,
        box_offset: tuple[float, float] = (0.0, 0.0),
        speaks: str = USUAL,
        **switches: Any,
    ) -> None:
        maps = {map_name or xodr.stem: xodr, **(other_maps or {})}
        self._options: dict[str, Any] = {
            "maps": {name: str(file.resolve()) for name, file in maps.items()},
            "box_offset": box_offset,
            "speaks": speaks,
            "switches": {"version": speaks, **switches},
        }
        self.port = 0

    def __enter__(self) -> Self:
        path = os.pathsep.join(filter(None, (str(_ROOT), os.environ.get("PYTHONPATH"))))
        self._process = subprocess.Popen(
            [sys.executable, "-m", self.module],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            cwd=_ROOT,
            env={**os.environ, "PYTHONPATH": path},
            text=True,
        )
        try:
            self._write(self._options)
            self.port = self._read()["port"]
        except BaseException:
            self.__exit__(None, None, None)
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End the process: it ends by itself with its standard input, or else is killed."""
        try:
            self._process.communicate(timeout=_END_SECONDS)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.communicate()

    # ------------------------------------------------------------------------------- side door
    def calls(self) -> Counter[str]:
        """How often each RPC was called since the start or :meth:`reset_calls`."""
        return Counter(self._ask("calls"))

    def reset_calls(self) -> None:
        """Count RPCs anew."""
        self._ask("reset_calls")

    def actors(self) -> list[dict[str, Any]]:
        """All actors as the server has them, in the order of their ids."""
        return list(self._ask("actors"))

    def generation(self) -> list[Any]:
        """Parameters by which a world was made of an OpenDRIVE text, as they were sent."""
        return list(self._ask("generation"))

    def commands(self) -> dict[int, list[Any]]:
        """For each actor the last command of a batch that drove it or put it somewhere."""
        return {int(actor): command for actor, command in self._ask("commands").items()}

    def set(self, **switches: Any) -> None:
        """Change switches of :class:`tests.carla_standin.switches.Switches`."""
        self._ask("set", **switches)

    def load(self, name: str) -> None:
        """Load another map, as another client might."""
        self._ask("load", name=name)

    # ------------------------------------------------------------------------------- violence
    def kill(self) -> None:
        """Kill the server at once."""
        self._process.kill()
        self._process.wait()

    def pause(self) -> None:
        """Freeze the whole process."""
        self._process.send_signal(signal.SIGSTOP)

    def resume(self) -> None:
        """Let a frozen process go on."""
        self._process.send_signal(signal.SIGCONT)

    def has_died(self, seconds: float = _END_SECONDS) -> bool:
        """Whether the process ends within some seconds."""
        try:
            self._process.wait(seconds)
        except subprocess.TimeoutExpired:
            return False
        return True

    def _ask(self, name: str, /, **arguments: Any) -> Any:
        self._write([name, arguments])
        answer = self._read()
        if "error" in answer:
            raise RuntimeError(answer["error"])
        return answer["result"]

    def _write(self, message: Any) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(message) + "\n")
        self._process.stdin.flush()

    def _read(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise RuntimeError(f"the stand-in ended with {self._process.wait()}")
        return dict(json.loads(line))


class Replay(StandIn):
    """Server process that says again what was recorded by ``--record-protocol``.

    Parameters
    ----------
    transcript
        The recording.
    tolerance
        By how much numbers of a call may differ from those recorded, metres and degrees.
    """

    module = "tests.carla_standin.replay"

    def __init__(self, transcript: Path, *, tolerance: float = 1e-4) -> None:
        self._options: dict[str, Any] = {"file": str(transcript.resolve()), "tolerance": tolerance}
        self.port = 0

    def outcome(self) -> dict[str, Any]:
        """``differences`` in words, names of calls that are ``left``, how many were ``made``."""
        return dict(self._ask("outcome"))
