"""Doors of behaviour models: one that ships, a class by name, another program.

An installed package offers one in its ``pyproject.toml``::

    [project.entry-points."odscen.behaviour"]
    mine = "my_package.drivers:MyDriver"

The page chooses among these and those that ship; it cannot name a module or a program.

A behaviour model in another process, over its stdin and stdout or a socket.

Messages are those of :mod:`odscen.learning.behaviour.behaviour_messages`.
"""

from __future__ import annotations

import json
import os
import select
import shlex
import shutil
import socket
import subprocess
import tempfile
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from odscen.base.errors import InputError, NotFoundError, OdscenError
from odscen.learning.behaviour.behaviour_messages import (
    HEAD,
    MOST_BYTES,
    action_from_bytes,
    framed,
    observation_bytes,
    scene_bytes,
)
from odscen.learning.behaviour.behaviour_model import BehaviourDoor
from odscen.learning.offered_models import installed_names, named_object, offered_models
from odscen.learning.offered_options import values_for
from odscen.runs.layout import BEHAVIOUR_FILE

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from typing import BinaryIO

    import numpy as np

    from odscen.base.arrays import BoolArray
    from odscen.learning.behaviour.behaviour_model import (
        BehaviourModel,
        BehaviourScene,
        DrivingAction,
        RoadObservation,
    )
    from odscen.learning.offered_models import OfferedModel
    from odscen.learning.offered_options import OptionValue


# ----------------------------- A behaviour model in another process, over its stdin and stdout or a
_LAST_LINES = 5
_LAST_BYTES = 4000
_BLOCK = 1 << 16
_PATIENCE = 5.0
"""Wall seconds that a program has to end when its input is over."""


class _Peer:
    """Asks and waits, over two descriptors that do not block."""

    def __init__(self, seed: int, time_limit: float) -> None:
        self._seed = seed
        self._time_limit = time_limit
        self._to = self._back = -1

    def init(self, rng: np.random.Generator, scene: BehaviourScene) -> None:
        """Start it, and tell it the scene."""
        del rng  # it has the seed
        self.open_connection()
        self.ask(scene_bytes(scene, self._seed))

    def act(self, observation: RoadObservation, state: Any) -> tuple[DrivingAction, BoolArray]:
        """Ask it."""
        del state
        return action_from_bytes(self.ask(observation_bytes(observation)), len(observation))

    def close(self) -> None:
        """Say that the run is over."""

    def open_connection(self) -> None:
        """Start it, or call it."""
        self._connect()
        os.set_blocking(self._to, False)
        os.set_blocking(self._back, False)

    def _connect(self) -> None:
        raise NotImplementedError

    def _explain_end(self) -> str:
        """Why it has ended."""
        raise NotImplementedError

    def ask(self, message: bytes) -> bytes:
        """Send a message, and wait for the answer.

        Raises
        ------
        InputError
            If it has ended, takes too long, or its answer is too large.
        """
        end = time.monotonic() + self._time_limit
        self._write_all(framed(message), end)
        size = HEAD.unpack(self._read_all(HEAD.size, end))[0]
        if size > MOST_BYTES:
            raise InputError(f"its answer has {size:,} bytes; {MOST_BYTES:,} are the most")
        return self._read_all(size, end)

    def _write_all(self, data: bytes, end: float) -> None:
        left = memoryview(data)
        while left:
            self._wait_ready([], [self._to], end)
            try:
                left = left[os.write(self._to, left) :]
            except OSError as error:
                raise InputError(self._explain_end()) from error

    def _read_all(self, size: int, end: float) -> bytes:
        blocks: list[bytes] = []
        while size:
            self._wait_ready([self._back], [], end)
            try:
                block = os.read(self._back, min(size, _BLOCK))
            except OSError as error:
                raise InputError(self._explain_end()) from error
            if not block:
                raise InputError(self._explain_end())
            blocks.append(block)
            size -= len(block)
        return b"".join(blocks)

    def _wait_ready(self, read: list[int], write: list[int], end: float) -> None:
        left = end - time.monotonic()
        ready = select.select(read, write, [], max(left, 0.0))
        if not any(ready):
            self._stop_peer()
            raise InputError(f"it took more than {self._time_limit:g} s for a step")

    def _stop_peer(self) -> None:
        """End it."""


class PipedDriver(_Peer):
    """A program that is started with the run and ends with it."""

    def __init__(self, words: Sequence[str], seed: int, time_limit: float) -> None:
        super().__init__(seed, time_limit)
        self._words = words
        self._process: subprocess.Popen[bytes] | None = None
        self._said: BinaryIO

    def _connect(self) -> None:
        self._said = tempfile.TemporaryFile()  # noqa: SIM115 - as long as the process
        try:
            self._process = subprocess.Popen(
                self._words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._said
            )
        except OSError as error:
            raise InputError(
                f"it cannot be started: {error.strerror}", element=self._words[0]
            ) from error
        if self._process.stdin is not None and self._process.stdout is not None:
            self._to, self._back = self._process.stdin.fileno(), self._process.stdout.fileno()

    def close(self) -> None:
        """Let it end: its input is over."""
        if self._process is not None and self._process.stdin is not None:
            with suppress(OSError):
                self._process.stdin.close()
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(_PATIENCE)
            if self._process.poll() is None:
                self._process.kill()
                self._process.wait()

    def _explain_end(self) -> str:
        code = None
        if self._process is not None:
            with suppress(subprocess.TimeoutExpired):
                code = self._process.wait(1.0)
        self._said.seek(max(0, self._said.seek(0, os.SEEK_END) - _LAST_BYTES))
        lines = self._said.read().decode("utf-8", "replace").strip().splitlines()[-_LAST_LINES:]
        output = f": {' / '.join(lines)}" if lines else ""
        how = "it has closed its output" if code is None else f"it ended with exit code {code}"
        return f"{how}{output}"

    def _stop_peer(self) -> None:
        if self._process is not None:
            self._process.kill()


class SocketDriver(_Peer):
    """A program that listens at a socket, and waits for the run."""

    def __init__(self, path: str, seed: int, time_limit: float) -> None:
        super().__init__(seed, time_limit)
        self._path = path
        self._socket: socket.socket

    def _connect(self) -> None:
        self._socket = socket.socket(socket.AF_UNIX)
        try:
            self._socket.connect(self._path)
        except OSError as error:
            raise InputError(f"no program listens at its socket: {error.strerror}") from error
        self._to = self._back = self._socket.fileno()

    def close(self) -> None:
        """Hang up."""
        if hasattr(self, "_socket"):
            self._socket.close()

    def _explain_end(self) -> str:
        return "it has closed its socket"


# ------------------------------------------------------------------------ doors of behaviour models
GROUP = "odscen.behaviour"
"""Of entry points."""
IDM, IMITATION = "idm", "imitation"
MAX_PRESSURE, SIGNAL_AGENT = "max-pressure", "signal-agent"
"""Names of the models that ship; the last two switch lights."""
_SHIPPED = IDM, IMITATION, MAX_PRESSURE
"""Those that need no file."""


def open_behaviour(door: BehaviourDoor, seed: int) -> BehaviourModel:
    """Find and make a model.

    Parameters
    ----------
    seed
        For another program.

    Raises
    ------
    InputError
        If there is none, it cannot be imported or made, or an option is not possible.
    """
    given = [name for name in (door.name, door.command, door.socket) if name is not None]
    if len(given) != 1:
        raise InputError("a behaviour model is given by its name or as a command, not both")
    if door.socket is not None:
        return SocketDriver(door.socket, seed, door.time_limit)
    if door.command is not None:
        if door.options:
            raise InputError("a command takes its options in its own line", element="behaviour")
        return PipedDriver(_split_command(door.command), seed, door.time_limit)
    name = door.name or ""
    found = _find_behaviour(name)
    options = values_for(found, door.options, name=name, others=True)
    try:
        made = found(**options) if isinstance(found, type) else found
    except OdscenError:
        raise
    except Exception as error:  # whatever code from outside may raise
        raise InputError(f"it cannot be made: {error!r}", element=name) from error
    if switches_lights(made) and not callable(getattr(made, "act", None)):
        wanted: tuple[str, ...] = ("init_lights(rng, scene)", "switch(observation, state)")
    else:
        wanted = ("init(rng, scene)", "act(observation, state)")
    for method in wanted:
        if not callable(getattr(made, method.partition("(")[0], None)):
            raise InputError(f"it has no method `{method}`", element=name)
    model: BehaviourModel = made
    return model


def switches_lights(model: Any) -> bool:
    """Whether a model, or its class, chooses stages of traffic lights."""
    return callable(getattr(model, "switch", None))


def door_switches_lights(door: BehaviourDoor | None) -> bool:
    """Whether what a door leads to chooses stages of traffic lights; programs do not.

    Raises
    ------
    InputError
        If it cannot be imported.
    """
    return (
        door is not None and door.name is not None and switches_lights(_find_behaviour(door.name))
    )


def read_behaviour(text: str) -> BehaviourDoor:
    """Where the model of a run comes from, as its folder says.

    Raises
    ------
    InputError
        If that cannot be read.
    """
    try:
        return BehaviourDoor(**json.loads(text))
    except (TypeError, ValueError) as error:
        raise InputError(f"it names no behaviour model: {error}", file=BEHAVIOUR_FILE) from error


def is_installed(door: BehaviourDoor) -> bool:
    """Whether a model ships or belongs to an installed package, and is no code of a folder."""
    other = door.command is not None or door.socket is not None
    return not other and door.name in installed_names(GROUP, _SHIPPED)


def installed_behaviours() -> tuple[OfferedModel, ...]:
    """Models that ship and those of installed packages, by name, with their options."""
    return offered_models(installed_names(GROUP, _SHIPPED), _find_behaviour)


def chosen_behaviour(name: str, options: Mapping[str, OptionValue]) -> BehaviourDoor:
    """The door of one of :func:`installed_behaviours`, with none but the options that it offers.

    Raises
    ------
    NotFoundError
        If there is no such model; a module or a file is none.
    InputError
        If it cannot be imported, or an option is not possible.
    """
    known = installed_names(GROUP, _SHIPPED)
    if name not in known:
        raise NotFoundError("behaviour model", name, known)
    values = values_for(_find_behaviour(name), options, name=name)
    return BehaviourDoor(name=name, options={option: values[option] for option in options})


def _split_command(command: str) -> tuple[str, ...]:
    try:
        words = tuple(shlex.split(command))
    except ValueError as error:
        raise InputError(f"{command!r} is no command: {error}", element="behaviour") from error
    if not words or shutil.which(words[0]) is None:
        raise InputError("there is no such program", element=words[0] if words else "behaviour")
    return words


def _find_behaviour(name: str) -> Any:
    if name == IDM:
        from odscen.learning.behaviour.intelligent_driver import IntelligentDriver

        return IntelligentDriver
    if name == IMITATION:
        from odscen.learning.behaviour.imitation_driver import ImitationDriver

        return ImitationDriver
    if name == MAX_PRESSURE:
        from odscen.learning.behaviour.max_pressure import MaxPressure

        return MaxPressure
    if name == SIGNAL_AGENT:
        from odscen.learning.behaviour.signal_agent import SignalAgentModel

        return SignalAgentModel
    shipped = f"{', '.join(map(repr, _SHIPPED))} and {SIGNAL_AGENT!r} ship"
    return named_object(name, group=GROUP, what="behaviour", shipped=shipped)
