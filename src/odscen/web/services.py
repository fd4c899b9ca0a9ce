"""What the routes share: the workspace and what goes on in it."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated

from fastapi import Depends
from starlette.requests import HTTPConnection

from odscen.app.maps import LoadedMap, map_of
from odscen.base.errors import ConflictError
from odscen.carla.served.served_run import probe
from odscen.maps.guarded_build import read_scenario_in_child
from odscen.maps.store import Workspace
from odscen.scenario.forms.any_form import read_any
from odscen.scenario.placing.region import Region
from odscen.web.active_runs import Runs
from odscen.web.drafts import Drafts
from odscen.web.jobs import Jobs
from odscen.web.large.large_documents import LARGE, LargeDocuments
from odscen.web.studies.active_studies import Studies
from odscen.web.sweeps.active_sweeps import Sweeps

if TYPE_CHECKING:
    from odscen.carla.served.served_run import ServerCheck
    from odscen.carla.server.client import Address
    from odscen.scenario.document.scenario_document import Scenario


# ---------------------------------------------------------- what the server knows of a CARLA server
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


# ---------------------------------------------------------------------------- what the routes share
_WAIT = 5.0
"""Seconds that an upload waits for others to be read."""


@dataclass(slots=True)
class Services:
    """One of each for a server.

    Attributes
    ----------
    search
        Held while a path is searched: a region remembers its last search.
    large
        Children for large documents; ``None`` in a child.
    """

    workspace: Workspace
    drafts: Drafts
    jobs: Jobs
    runs: Runs
    sweeps: Sweeps
    studies: Studies
    carla: CarlaServer
    large: LargeDocuments | None
    search: threading.Lock = field(default_factory=threading.Lock)
    _readers: threading.BoundedSemaphore = field(
        default_factory=lambda: threading.BoundedSemaphore(max(2, os.cpu_count() or 1))
    )

    @classmethod
    def of(cls, workspace: Workspace, carla: Address, *, large: int | None = LARGE) -> Services:
        """Make them for a workspace and the address of a CARLA server, there or not.

        ``large`` is that of a document, bytes; ``None`` in a child.
        """
        children = None if large is None else LargeDocuments(workspace, large=large)
        drafts, runs = Drafts(workspace, children), Runs(workspace, carla)
        many = Sweeps(workspace), Studies(workspace)
        return cls(workspace, drafts, Jobs(), runs, *many, CarlaServer(carla), children)

    def map_of(self, scenario: Scenario) -> LoadedMap:
        """Map that a scenario was made on, loaded."""
        return map_of(self.workspace, scenario)

    def read_upload(self, content: bytes, *, file: str | None) -> Scenario:
        """Read a scenario from outside, in a child: one for each core, and two at least.

        Raises
        ------
        ScenarioError
            If it is none.
        ConflictError
            If none becomes free soon. Whoever waits holds a thread that others need.
        """
        if self.large is None:  # this is a child
            return read_any(content, file=file)
        with self._hold_reader():
            return read_scenario_in_child(content, file=file)

    @contextmanager
    def _hold_reader(self) -> Iterator[None]:
        if not self._readers.acquire(timeout=_WAIT):
            raise ConflictError("the server is reading other uploads; try again in a minute")
        try:
            yield
        finally:
            self._readers.release()

    def close(self) -> None:
        """End everything that goes on."""
        self.jobs.close()
        self.sweeps.close()
        self.studies.close()
        self.runs.close()


@lru_cache(maxsize=8)
def region_of(loaded: LoadedMap, roi: tuple[str, ...]) -> Region:
    """Region of a scenario; the last few are kept, with the paths searched in them."""
    return Region.of(loaded.sumo.graph, roi)


def services(connection: HTTPConnection) -> Services:
    """Services of the app that a request is for."""
    found: Services = connection.app.state.services
    return found


Shared = Annotated[Services, Depends(services)]
