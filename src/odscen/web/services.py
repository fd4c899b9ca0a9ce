"""What the routes share: the workspace and what goes on in it."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated

from fastapi import Depends
from starlette.requests import HTTPConnection

from odscen.app.maps import LoadedMap, map_of
from odscen.base.errors import ConflictError
from odscen.scenario.placing.region import Region
from odscen.web.active_runs import Runs
from odscen.web.carla_status import CarlaServer
from odscen.web.drafts import Drafts
from odscen.web.jobs import Jobs
from odscen.workspace.store import Workspace

if TYPE_CHECKING:
    from odscen.carla.client import Address
    from odscen.scenario.document.scenario_document import Scenario

_WAIT = 5.0
"""Seconds that an upload waits for others to be read."""


@dataclass(slots=True)
class Services:
    """One of each for a server.

    Attributes
    ----------
    search
        Held while a path is searched: a region remembers its last search.
    """

    workspace: Workspace
    drafts: Drafts
    jobs: Jobs
    runs: Runs
    carla: CarlaServer
    search: threading.Lock = field(default_factory=threading.Lock)
    _readers: threading.BoundedSemaphore = field(
        default_factory=lambda: threading.BoundedSemaphore(max(2, os.cpu_count() or 1))
    )

    @classmethod
    def of(cls, workspace: Workspace, carla: Address) -> Services:
        """Make them for a workspace and the address of a CARLA server, there or not."""
        return cls(workspace, Drafts(workspace), Jobs(), Runs(workspace, carla), CarlaServer(carla))

    def map_of(self, scenario: Scenario) -> LoadedMap:
        """Map that a scenario was made on, loaded."""
        return map_of(self.workspace, scenario)

    @contextmanager
    def reading(self) -> Iterator[None]:
        """Take a place among those whose upload is read: one for each core, and two at least.

        Raises
        ------
        ConflictError
            If none becomes free soon. Whoever waits holds a thread that others need.
        """
        if not self._readers.acquire(timeout=_WAIT):
            msg = "the server is reading other uploads; try again in a minute"
            raise ConflictError(msg)
        try:
            yield
        finally:
            self._readers.release()

    def close(self) -> None:
        """End everything that goes on."""
        self.jobs.close()
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
