"""Where runs of a study are carried out: in threads that wait for SUMO's processes, or with Dask.

An executor takes orders and gives outcomes in the order in which they come. It loses none: an order
whose worker has died is carried out again, by another worker.
"""

from __future__ import annotations

import threading
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Protocol

from odscen.experiments.studies.study_work import GivenUpError, carry_out_order

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping
    from concurrent.futures import Future

    from odscen.experiments.studies.study_work import Outcome, WorkOrder
    from odscen.maps.store import Workspace

_LISTEN = 0.2
"""Wall seconds after which a wait looks for Ctrl-C."""


class Orders(Protocol):
    """Gives the next order."""

    def next(self, most: int) -> WorkOrder | None:
        """An order of at most so many runs; ``None`` when there are no more."""


class Executor(Protocol):
    """Carries out orders."""

    def outcomes(self, orders: Orders) -> Iterator[list[Outcome]]:
        """Outcomes of each order, when it has been carried out."""


def _import_what_threads_share() -> None:
    """Import what is otherwise imported at its first use, by several threads at a time.

    Where two of them wait for each other's imports, Python gives one a module that is half there.
    """
    for name in ("numpy.ma", "polars"):
        import_module(name)


@dataclass(frozen=True, slots=True)
class LocalExecutor:
    """Carries out orders on this machine, one run of SUMO in a process each.

    Attributes
    ----------
    workspace
        Has the maps.
    processes
        How many run at a time.
    check
        Called now and then while runs are waited for; what it raises ends them.
    """

    workspace: Workspace
    processes: int = 1
    check: Callable[[], None] | None = None
    _stop: threading.Event = field(default_factory=threading.Event)

    def outcomes(self, orders: Orders) -> Iterator[list[Outcome]]:
        """Outcomes of each order, of one run, when it has been carried out."""
        _import_what_threads_share()
        with ThreadPoolExecutor(max_workers=max(1, self.processes)) as pool:
            running: set[Future[list[Outcome]]] = set()
            try:
                while True:
                    while len(running) < self.processes + 1 and (order := orders.next(1)):
                        running.add(pool.submit(self._work, order))
                    if not running:
                        return
                    ended, running = wait(running, timeout=_LISTEN, return_when=FIRST_COMPLETED)
                    if self.check is not None:
                        self.check()
                    for future in ended:
                        yield future.result()
            finally:
                self._stop.set()
                pool.shutdown(wait=False, cancel_futures=True)

    def _work(self, order: WorkOrder) -> list[Outcome]:
        if self._stop.is_set():
            raise GivenUpError
        places: Mapping[str, Workspace] = {
            source.map_name: self.workspace for source in order.sources.values()
        }
        return carry_out_order(order, places, stopped=self._stop.is_set)
