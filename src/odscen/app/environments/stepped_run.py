"""A run that waits before each step for what a program of the same process wants.

The simulation has a process of its own, as every run; its behaviour model is this process, at a
socket in a folder of its own.
"""

from __future__ import annotations

import socket
import threading
from contextlib import ExitStack
from dataclasses import replace
from typing import TYPE_CHECKING

from odscen.app.running.runs import carry_out, check_given, prepare_run
from odscen.base.atomic_folders import scratch_folder
from odscen.base.errors import SimulationError
from odscen.learning.behaviour.behaviour_messages import (
    HEAD,
    action_bytes,
    framed,
    observation_from_bytes,
    scene_from_bytes,
)
from odscen.learning.behaviour.behaviour_model import BehaviourDoor
from odscen.records.outcomes import RunStatus
from odscen.runs.recording import Recording
from odscen.runs.run_settings import RunSettings

if TYPE_CHECKING:
    from collections.abc import Callable

    from odscen.base.arrays import BoolArray
    from odscen.base.given_files import GivenPath
    from odscen.learning.behaviour.behaviour_model import (
        BehaviourScene,
        DrivingAction,
        RoadObservation,
    )
    from odscen.maps.store import Workspace
    from odscen.runs.finished_run import Run
    from odscen.scenario.document.scenario_document import Scenario

LEAN = RunSettings(recording=Recording(emissions=False), slice_length=None)
"""How such a run is made if nothing else is said."""
PATIENCE = 3600.0
"""Wall seconds that the simulation waits for a step."""
_LISTEN = 0.2
"""Wall seconds after which a wait looks whether the run is over."""


class HeldRun:
    """One run, in a process of its own, that waits for this one at a socket.

    Parameters
    ----------
    workspace
        Has the map.
    scenario
        The scenario, or its file.
    settings
        How it is run; its behaviour is the one at the socket.
    door
        Makes that of the socket's path.

    Raises
    ------
    SimulationError
        If it fails before its first step.
    InputError
        If the scenario or its file cannot be used.
    """

    def __init__(
        self,
        workspace: Workspace,
        scenario: Scenario | GivenPath,
        *,
        settings: RunSettings,
        door: Callable[[str], BehaviourDoor],
    ) -> None:
        self._scratch = ExitStack()
        folder = self._scratch.enter_context(scratch_folder())
        self._failure: BaseException | None = None
        self._run: Run | None = None
        path = folder / "drive"
        checked = check_given(
            workspace,
            scenario,
            name="run",
            out=folder,
            settings=replace(settings, behaviour=door(str(path))),
        )
        prepared = prepare_run(checked)

        def carry() -> None:
            try:
                self._run = carry_out(checked, prepared)
            except BaseException as error:
                self._failure = error

        self._thread = threading.Thread(target=carry, daemon=True)
        with socket.socket(socket.AF_UNIX) as listener:
            listener.bind(str(path))
            listener.listen(1)
            listener.settimeout(_LISTEN)
            self._thread.start()
            self._connection = self._accept_worker(listener)
        first = self.read_message()
        if first is None:
            raise self._explain_early_end()
        self.first = first
        self.answer(b"")

    def wait(self) -> bytes | None:
        """Wait for the next step; ``None`` once the run is over.

        Raises
        ------
        SimulationError
            If it has failed.
        """
        data = self.read_message()
        if data is not None:
            return data
        self._thread.join()
        if self._run is None or self._run.status is not RunStatus.COMPLETED:
            raise self._explain_early_end()
        return None

    def answer(self, data: bytes) -> None:
        """Let the step be made."""
        self._connection.sendall(framed(data))

    def close(self) -> None:
        """End the run, wherever it is, and remove its files."""
        self._connection.close()
        self._thread.join()
        self._scratch.close()

    def _accept_worker(self, listener: socket.socket) -> socket.socket:
        while True:
            try:
                found, _ = listener.accept()
            except TimeoutError:
                if not self._thread.is_alive():
                    raise self._explain_early_end() from None
            else:
                found.settimeout(None)
                return found

    def read_message(self) -> bytes | None:
        """Wait for a message; ``None`` at the end of the run."""
        head = self._read_bytes(HEAD.size)
        return None if head is None else self._read_bytes(HEAD.unpack(head)[0])

    def _read_bytes(self, size: int) -> bytes | None:
        blocks = bytearray()
        while len(blocks) < size:
            block = self._connection.recv(size - len(blocks))
            if not block:
                return None
            blocks += block
        return bytes(blocks)

    def _explain_early_end(self) -> BaseException:
        self._thread.join()
        if self._failure is not None:
            return self._failure
        reason = (
            "it ended before its first step" if self._run is None else self._run.summary["error"]
        )
        return SimulationError(str(reason or "it ended before its first step"))


class SteppedRun(HeldRun):
    """One run whose vehicles this process drives; :meth:`see` and :meth:`drive` in turn.

    Attributes
    ----------
    scene
        Of the run.
    """

    def __init__(
        self, workspace: Workspace, scenario: Scenario | GivenPath, *, settings: RunSettings = LEAN
    ) -> None:
        def door(path: str) -> BehaviourDoor:
            return BehaviourDoor(socket=path, time_limit=PATIENCE)

        super().__init__(workspace, scenario, settings=settings, door=door)
        self.scene: BehaviourScene = scene_from_bytes(self.first)[0]

    def see(self) -> RoadObservation | None:
        """Wait for the next step; ``None`` once the run is over.

        Raises
        ------
        SimulationError
            If it has failed.
        """
        data = self.wait()
        return None if data is None else observation_from_bytes(data)

    def drive(self, action: DrivingAction, controlled: BoolArray) -> None:
        """Let the step be made."""
        self.answer(action_bytes(action, controlled))
